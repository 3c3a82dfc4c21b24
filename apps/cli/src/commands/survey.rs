use super::eval::{build_id, entries, said_of_what_never_ran, show};
use super::print;
use crate::args::{Global, Survey as Args};
use crate::console;
use pursuit::RunError;
use pursuit::evaluation::{EvalOptions, Family, Survey, evaluate};
use pursuit::media::OpenOptions;
use pursuit::trackers::{families, registry};
use std::process::ExitCode;

/// `pursuit survey DATASET…`.
pub fn run(args: &Args, global: &Global) -> anyhow::Result<ExitCode> {
    let entries = entries(&names(&args.trackers), &args.settings)?;
    let mut options = EvalOptions::new(args.datasets.clone(), entries, args.out.clone());
    options.protocol = args.protocol.parse().map_err(RunError::from)?;
    options.sequences = args.sequences.clone();
    options.attributes = args.attributes.clone();
    options.jobs = args.jobs;
    options.build = build_id();
    options.open = OpenOptions::from_env();
    let bar = console::progress_bar(None, global);
    let results = evaluate(&options, &|news| show(&bar, news), console::stop_flag()).map_err(RunError::from)?;
    bar.finish_and_clear();
    if results.interrupted {
        tracing::warn!("stopped before everything had run; the same command goes on from here");
    }
    let kinds: Vec<Family> = families::families()
        .map(|f| Family {
            name: f.name.to_owned(),
            sentence: f.sentence.to_owned(),
            members: f.members.iter().map(|m| (*m).to_owned()).collect(),
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
            Some(family) => all.extend(ready().filter(|t| family.members.contains(&t.as_str()))),
            None => all.push(name.clone()),
        }
    }
    // Named twice, by itself and by its family, it runs once.
    let mut seen = std::collections::BTreeSet::new();
    all.retain(|name| seen.insert(name.clone()));
    all
}
