//! `cargo run --release -p pursuit-evaluation --example eval -- DATASET... --trackers a,b --out DIR`: trackers of the
//! registry evaluated from the command line, for those who develop them.

use pursuit_evaluation::{Contestant, EvalOptions, Progress, evaluate, text_table};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

const USAGE: &str = "usage: eval DATASET... --out DIR [--trackers a,b] [--set TRACKER.KEY=VALUE]... \
    [--protocol ope|long-term|reset|sre|tre] [--sequences GLOB,...] [--jobs N] [--no-report] [--no-thumbnails] [--build NAME]";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut options = EvalOptions::new(Vec::new(), Vec::new(), PathBuf::from("eval-results"));
    let (mut names, mut settings) = (Vec::new(), Vec::new());
    options.build = this_build();
    options.open.search_path = std::env::var_os("PATH");
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value\n{USAGE}"));
        match arg.as_str() {
            "--trackers" => names = value()?.split(',').map(str::to_owned).collect(),
            "--set" => settings.push(value()?),
            "--protocol" => options.protocol = value()?.parse()?,
            "--sequences" => options.sequences = Some(value()?),
            "--jobs" => options.jobs = value()?.parse()?,
            "--out" => options.out = PathBuf::from(value()?),
            "--build" => options.build = value()?,
            "--no-report" => options.report = false,
            "--no-thumbnails" => options.thumbnails = false,
            flag if flag.starts_with('-') => return Err(format!("unknown option {flag}\n{USAGE}").into()),
            _ => options.datasets.push(PathBuf::from(arg)),
        }
    }
    if options.datasets.is_empty() {
        return Err(USAGE.into());
    }
    if names.is_empty() {
        names = pursuit_trackers::registry::trackers().iter().map(|t| t.name.to_owned()).collect();
    }
    for name in names {
        let table = parameters(&name, &settings)?;
        options.trackers.push(Contestant::from(pursuit_trackers::registry::tracker(&name)?.recipe(&table)?));
    }
    let results = evaluate(&options, &show, &AtomicBool::new(false))?;
    print!("{}", text_table(&results));
    eprintln!("results in {}", options.out.display());
    Ok(())
}

/// The `--set TRACKER.KEY=VALUE` that concern a tracker, as TOML.
fn parameters(tracker: &str, settings: &[String]) -> Result<toml::Table, toml::de::Error> {
    let own = settings.iter().filter_map(|s| s.strip_prefix(tracker)?.strip_prefix('.'));
    own.collect::<Vec<_>>().join("\n").parse()
}

/// Results that another build of the trackers left must not be reused while they are being developed.
fn this_build() -> String {
    let stamp = || {
        let metadata = std::fs::metadata(std::env::current_exe().ok()?).ok()?;
        let changed = metadata.modified().ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
        Some(format!("{} bytes, {} s", metadata.len(), changed.as_secs()))
    };
    stamp().unwrap_or_default()
}

fn show(progress: Progress) {
    match progress {
        Progress::Found { sequences, runs, problems } => {
            problems.iter().for_each(|p| eprintln!("left out: {p}"));
            eprintln!("{sequences} sequences, {runs} runs");
        }
        Progress::Finished { tracker, sequence, reused, auc, fps, error, done, runs } => {
            let fps = fps.map_or_else(String::new, |f| format!("{f:8.1} fps"));
            let note = error.map_or_else(String::new, |e| format!("  stopped: {e}"));
            let kept = if reused { "  (kept)" } else { "" };
            eprintln!("[{done:3}/{runs}] {tracker:14} {sequence:28} auc {auc:.3} {fps}{kept}{note}");
        }
        _ => {}
    }
}
