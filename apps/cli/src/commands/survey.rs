use super::eval::{entries, evaluated, options, said_of_what_never_ran};
use super::print;
use crate::args::{Global, Survey as Args};
use pursuit::RunError;
use pursuit::evaluation::{Family, Survey};
use pursuit::trackers::{families, registry};
use std::process::ExitCode;

/// `pursuit survey DATASET…`.
pub fn run(args: &Args, global: &Global) -> anyhow::Result<ExitCode> {
    let measured = &args.measured;
    let entries = entries(&names(&measured.trackers), &measured.settings)?;
    let results = evaluated(&options(measured, entries, &args.protocol, &args.out)?, global)?;
    let kinds: Vec<Family> = families::families()
        .map(|f| Family {
            name: f.name.to_owned(),
            sentence: f.sentence.to_owned(),
            members: f.members().map(str::to_owned).collect(),
        })
        .collect();
    let survey = Survey::new(&results, &kinds);
    survey.write(&results, &args.out).map_err(RunError::from)?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&survey)? + "\n",
        false => format!("{}\nsurvey in {}\n", survey.to_text(), args.out.join("survey.html").display()),
    };
    let status = print(text.as_bytes())?;
    Ok(if said_of_what_never_ran(&results) { ExitCode::FAILURE } else { status })
}

/// The trackers named, or, where none is, all that need no file; the name of a family that is no tracker's stands for those of its
/// members.
fn names(given: &[String]) -> Vec<String> {
    let ready = || registry::ready().map(|t| t.name.to_owned());
    if given.is_empty() {
        return ready().collect();
    }
    let mut all = Vec::new();
    for name in given {
        match families::families().find(|f| f.name == name.as_str() && registry::tracker(name).is_err()) {
            Some(family) => all.extend(ready().filter(|t| family.members().any(|m| m == t.as_str()))),
            None => all.push(name.clone()),
        }
    }
    // Named twice, by itself and by its family, it runs once.
    let mut seen = std::collections::BTreeSet::new();
    all.retain(|name| seen.insert(name.clone()));
    all
}
