use super::{print, settings};
use crate::args::{Eval, Global, Measured};
use crate::{console, networks};
use pursuit::RunError;
use pursuit::config::recipes;
use pursuit::evaluation::{Entry, EvalOptions, Progress, Results, evaluate, text_table};
use pursuit::media::OpenOptions;
use pursuit::trackers::registry;
use std::hash::{DefaultHasher, Hasher};
use std::path::Path;
use std::process::ExitCode;

/// `pursuit eval DATASET…`.
pub fn run(args: &Eval, global: &Global) -> anyhow::Result<ExitCode> {
    if args.protocol == "mot" {
        return super::eval_many::run(args);
    }
    let measured = &args.measured;
    let mut options = options(measured, entries(&names(args), &measured.settings)?, &args.protocol, &args.out)?;
    options.given = args.given.clone();
    options.report = !args.no_report;
    options.against = args.against.clone();
    let results = evaluated(&options, global)?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&results)? + "\n",
        false => format!("{}\nresults in {}\n", text_table(&results), args.out.display()),
    };
    let status = print(text.as_bytes())?;
    Ok(if said_of_what_never_ran(&results) { ExitCode::FAILURE } else { status })
}

/// What `eval` and `survey` ask for alike.
pub(super) fn options(
    measured: &Measured,
    entries: Vec<Entry>,
    protocol: &str,
    out: &Path,
) -> Result<EvalOptions, RunError> {
    let mut options = EvalOptions::new(measured.datasets.clone(), entries, out.to_owned());
    options.protocol = protocol.parse()?;
    options.sequences = measured.sequences.clone();
    options.attributes = measured.attributes.clone();
    options.jobs = measured.jobs;
    options.build = build_id();
    options.open = OpenOptions::from_env();
    Ok(options)
}

/// Runs it, with a bar, until it is done or stopped, which is said.
pub(super) fn evaluated(options: &EvalOptions, global: &Global) -> Result<Results, RunError> {
    let bar = console::progress_bar(None, global);
    let results = evaluate(options, &|news| show(&bar, news), console::stop_flag())?;
    bar.finish_and_clear();
    if results.interrupted {
        tracing::warn!("stopped before everything had run; the same command goes on from here");
    }
    Ok(results)
}

/// Names trackers that went wrong on every sequence, whose figures are no figures; whether there is one.
pub(super) fn said_of_what_never_ran(results: &Results) -> bool {
    let mut found = false;
    for (name, tracker) in &results.trackers {
        let errors: Option<Vec<_>> = tracker.sequences.values().map(|score| score.error.as_ref()).collect();
        if let Some(first) = errors.as_ref().and_then(|errors| errors.first()) {
            tracing::error!("{name} stopped on every sequence: {first}");
            found = true;
        }
    }
    found
}

/// The version and a digest of this very program: what another build left, even one of the same version, is run again.
fn build_id() -> String {
    let version = env!("CARGO_PKG_VERSION");
    match std::env::current_exe().and_then(std::fs::read) {
        Ok(program) => {
            let mut hasher = DefaultHasher::new();
            hasher.write(&program);
            format!("{version}+{:016x}", hasher.finish())
        }
        Err(e) => {
            tracing::warn!(
                "what another build of {version} left is taken for this one's: it cannot be told apart: {e}"
            );
            version.to_owned()
        }
    }
}

/// The trackers named, or, where no results are given either, all that need no file.
fn names(args: &Eval) -> Vec<String> {
    let all = || registry::ready().map(|t| t.name.to_owned()).collect();
    if args.measured.trackers.is_empty() && args.given.is_empty() { all() } else { args.measured.trackers.clone() }
}

/// Trackers by name, with their parameters.
pub(super) fn entries(names: &[String], given: &[String]) -> Result<Vec<Entry>, RunError> {
    let parameters = networks::located(settings(given)?, names.iter().map(String::as_str), None);
    Ok(recipes(names, &parameters)?.into_iter().map(Entry::from).collect())
}

fn show(bar: &indicatif::ProgressBar, news: Progress) {
    match news {
        Progress::Found { sequences, runs, problems } => {
            problems.iter().for_each(|p| tracing::warn!("left out: {p}"));
            tracing::info!("{sequences} sequences, {runs} runs");
            bar.set_length(runs as u64);
        }
        Progress::Finished { tracker, sequence, auc, error, done, .. } => {
            if let Some(error) = error {
                tracing::warn!("{tracker} stopped on {sequence}: {error}");
            }
            bar.set_position(done as u64);
            bar.set_message(format!("{tracker} {sequence} AUC {auc:.3}"));
        }
        Progress::LeftOut { problem, done } => {
            tracing::warn!("left out: {problem}");
            bar.set_position(done as u64);
        }
        _ => {}
    }
}
