//! `pursuit eval … --protocol mot`.

use super::{print, settings};
use crate::args::Eval;
use crate::console;
use pursuit::RunError;
use pursuit::associate::Associate;
use pursuit::config::{MANY_PREFIX, parse_setting};
use pursuit::evaluation::{CrowdOptions, CrowdResults, CrowdSequence, Given, evaluate_crowds};
use std::process::ExitCode;

/// Our own association with its defaults.
const OURS: &str = "pursuit";

/// The same of whole clips at once.
const OFFLINE: &str = "offline";

/// Associates what is to be, and scores it beside the results given.
pub fn run(args: &Eval) -> anyhow::Result<ExitCode> {
    if args.against.is_some() {
        return Err(RunError::usage(
            "--against is of one target; score others' results beside with --results NAME=FOLDER",
        )
        .into());
    }
    if args.measured.attributes.is_some() {
        return Err(RunError::usage("--attributes is of one target; leave it out with --protocol mot").into());
    }
    let mut given = Vec::new();
    let ours = if args.measured.trackers.is_empty() && args.given.is_empty() {
        vec![OURS.to_owned()]
    } else {
        args.measured.trackers.clone()
    };
    for name in &ours {
        given.push(associated(args, name)?);
    }
    given.extend(args.given.iter().cloned());
    let options = CrowdOptions {
        datasets: args.measured.datasets.clone(),
        sequences: args.measured.sequences.clone(),
        given,
        rules: args.rules.parse().map_err(RunError::Evaluation)?,
        out: args.out.clone(),
        report: !args.no_report,
    };
    let results: CrowdResults = evaluate_crowds(&options).map_err(RunError::Evaluation)?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&results)? + "\n",
        false => format!("{}\nresults in {}\n", results.text_table(), args.out.display()),
    };
    print(text.as_bytes())
}

/// The tracks of our association under `name`: `pursuit` has the defaults, `offline` looks at whole clips at once, other names are presets and association
/// models.
fn associated(args: &Eval, name: &str) -> Result<Given, RunError> {
    let mut parameters = settings(&args.measured.settings)?;
    let preset = name.parse().ok();
    let offline = name == OFFLINE;
    if name != OURS && !offline && preset.is_none() {
        let (key, value) = parse_setting(&format!("{MANY_PREFIX}.association.model={name}"))?;
        parameters.insert(key, value);
    }
    let sequences = CrowdSequence::discover_all(&args.measured.datasets, args.measured.sequences.as_deref())?;
    let out = args.out.join("tracks").join(name);
    let options = Associate { preset, parameters, offline, ..Associate::default() };
    options.sequences(&sequences, &out, console::stop_flag())?;
    Ok(Given { name: name.to_owned(), path: out })
}
