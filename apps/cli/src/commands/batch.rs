use super::{print, settings};
use crate::args::{Batch, Global};
use crate::{console, networks};
use pursuit::batch::{BatchNews, BatchOptions, BatchSummary, ClipJob, clips_of, read_manifest, run as run_batch};
use pursuit::config::parse_box;
use pursuit::media::{Locator, OpenOptions};
use pursuit::{RunConfig, RunError};
use std::ffi::OsString;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

/// The exit status of inputs that cannot be read.
const UNREADABLE: u8 = 3;

/// `pursuit batch MANIFEST|GLOB|INPUT… --out DIR`.
pub fn run(args: &Batch, global: &Global) -> anyhow::Result<ExitCode> {
    let clips: Vec<ClipJob> = clips(args)?.into_iter().map(located).collect();
    let mut options = BatchOptions { open: OpenOptions::from_env(), ..BatchOptions::new(args.out.clone()) };
    if args.jobs > 0 {
        options.jobs = args.jobs;
    }
    let bar = console::progress_bar(Some(clips.len() as u64), global);
    let tell = |news| match news {
        BatchNews::Done { clip, frames, earlier } => {
            bar.inc(1);
            bar.set_message(console::printable(&clip));
            if !earlier {
                tracing::info!("{clip}: {frames} frames");
            }
        }
        BatchNews::Failed { clip, error } => {
            bar.inc(1);
            bar.suspend(|| tracing::warn!("{}", console::printable(&format!("{clip}: {error}"))));
        }
        _ => {}
    };
    let summary = run_batch(&clips, &options, &tell, console::stop_flag())?;
    bar.finish_and_clear();
    if summary.left > 0 {
        tracing::warn!("stopped before everything was done; the same command goes on from here");
    }
    let text = if args.json {
        serde_json::to_string_pretty(&summary)? + "\n"
    } else {
        console::printable(&described(&summary, &args.out)?)
    };
    print(text.as_bytes())?;
    Ok(if summary.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(UNREADABLE) })
}

fn described(summary: &BatchSummary, out: &Path) -> anyhow::Result<String> {
    let mut text = String::new();
    let frames: u64 = summary.clips.iter().map(|c| c.frames).sum();
    writeln!(
        text,
        "{} clips done ({} by an earlier call), {frames} frames; {} failed, {} left; {:.1} s",
        summary.clips.len(),
        summary.earlier,
        summary.failed.len(),
        summary.left,
        summary.seconds
    )?;
    for failed in &summary.failed {
        writeln!(text, "  {}: {}", failed.clip, failed.error.as_deref().unwrap_or_default())?;
    }
    writeln!(text, "results in {}", out.display())?;
    if !summary.dataset {
        writeln!(text, "no dataset: this build cannot write Parquet; build with `--features parquet`")?;
    }
    Ok(text)
}

/// The clip with the library named that runs networks which come as files, where it has one.
fn located(ClipJob { name, config }: ClipJob) -> ClipJob {
    let RunConfig { parameters, tracker, detect, .. } = config.clone();
    let parameters = networks::located(parameters, tracker.as_deref().into_iter(), detect.as_deref());
    ClipJob { name, config: RunConfig { parameters, ..config } }
}

/// All clips, in the order given. Names are given once over all of them.
fn clips(args: &Batch) -> Result<Vec<ClipJob>, RunError> {
    let common = common(args)?;
    let is_manifest = |path: &Path| {
        path.extension().is_some_and(|e| e == "jsonl" || e == "txt") && (path.is_file() || !path.exists())
    };
    if let [only] = args.inputs.as_slice()
        && is_manifest(Path::new(only))
    {
        return read_manifest(Path::new(only), &common);
    }
    let mut inputs: Vec<Locator> = Vec::new();
    for given in &args.inputs {
        if is_manifest(Path::new(given)) {
            return Err(RunError::usage(format!(
                "{} is a manifest; give one manifest, or inputs and patterns",
                Path::new(given).display()
            )));
        }
        match pattern(given) {
            Some(pattern) => inputs.extend(matching(pattern)?),
            None => inputs.push(given.clone().into()),
        }
    }
    clips_of(inputs, &common)
}

/// What holds for every clip that says nothing else.
fn common(args: &Batch) -> Result<RunConfig, RunError> {
    let file = match &args.config {
        Some(path) => RunConfig::read(path)?,
        None => RunConfig::default(),
    };
    let flag = |given: bool| given.then_some(true);
    let options = RunConfig {
        boxes: args.boxes.iter().map(|b| parse_box(b)).collect::<Result<_, _>>()?,
        tracker: args.tracker.clone(),
        detect: args.detect.clone(),
        many: flag(args.many),
        video: flag(args.video),
        parameters: settings(&args.settings)?,
        ..RunConfig::default()
    };
    let common = file.overridden_by(options);
    Ok(RunConfig { video: Some(common.video == Some(true)), out: None, ..common })
}

/// A pattern of files, where it is not the name of one, of a stream or of a scene.
fn pattern(given: &OsString) -> Option<&str> {
    let text = given.to_str()?;
    let locates = text.contains("://") || text.starts_with("scene:") || Path::new(text).exists();
    (!locates && text.contains(['*', '?', '['])).then_some(text)
}

fn matching(pattern: &str) -> Result<Vec<Locator>, RunError> {
    let wrong = |problem: String| RunError::usage(format!("pattern {pattern}: {problem}"));
    let paths = glob::glob(pattern).map_err(|e| wrong(e.to_string()))?;
    let paths = paths.map(|path| path.map_err(|e| wrong(e.to_string()))).collect::<Result<Vec<_>, _>>()?;
    if paths.is_empty() {
        return Err(wrong("no file matches".to_owned()));
    }
    Ok(paths.into_iter().map(|path| path.into_os_string().into()).collect())
}
