use super::{print, settings};
use crate::args::Associate;
use crate::{console, networks};
use pursuit::RunError;
use pursuit::associate::{Associate as Options, Associated};
use pursuit::geometry::Size;
use pursuit::inference::onnx::Device;
use pursuit::media::OpenOptions;
use pursuit::tracking::many::EmbeddingModel;
use std::fmt::Write;
use std::process::ExitCode;

/// `pursuit associate SET|DETECTIONS`.
pub fn run(args: &Associate) -> anyhow::Result<ExitCode> {
    let options = Options {
        format: args.format.as_deref().map(str::parse).transpose().map_err(RunError::Evaluation)?,
        video: args.video.clone().map(Into::into),
        fps: args.fps,
        size: args.size.as_deref().map(size).transpose()?,
        preset: args.preset.as_deref().map(str::parse).transpose().map_err(RunError::Parameter)?,
        parameters: networks::located(settings(&args.settings)?, std::iter::empty(), None),
        offline: args.offline,
        formats: args.formats.clone(),
        open: OpenOptions::from_env(),
        device: args.device,
    };
    if let Some(device) = args.device.filter(|d| *d != Device::Cpu)
        && options.params()?.embedding.model != EmbeddingModel::Network
    {
        let word = device.as_str();
        tracing::warn!(
            "no network tells looks apart (many.embedding.model=network), which {word} could do; all runs on the processor"
        );
    }
    let done = options.run(&args.input, &args.out, console::stop_flag())?;
    if let Some(fps) = done.iter().find_map(|d| d.assumed_fps) {
        tracing::warn!("nothing says how many frames a second there are; {fps} are assumed (--fps)");
    }
    let text = if args.json { json(&done)? } else { console::printable(&summary(&done, args)?) };
    print(text.as_bytes())
}

/// `WIDTHxHEIGHT`.
fn size(text: &str) -> Result<Size, RunError> {
    let number = |text: &str| text.trim().parse().ok().filter(|n| (1..=1 << 20).contains(n));
    let size = text.split_once('x').and_then(|(w, h)| Some(Size::new(number(w)?, number(h)?)));
    size.ok_or_else(|| RunError::usage(format!("--size `{text}` is not WIDTHxHEIGHT in pixels, for example 1280x720")))
}

fn summary(done: &[Associated], args: &Associate) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for Associated { sequence, frames, seconds, targets, .. } in done {
        let per_frame = 1e6 * seconds / (*frames).max(1) as f64;
        writeln!(text, "{sequence}  {frames} frames  {targets} targets  {per_frame:.1} us a frame")?;
    }
    writeln!(text, "results in {}", args.out.display())?;
    Ok(text)
}

fn json(done: &[Associated]) -> serde_json::Result<String> {
    let one = |d: &Associated| {
        serde_json::json!({
            "sequence": d.sequence, "frames": d.frames, "seconds": d.seconds, "targets": d.targets,
            "file": d.file.display().to_string(),
        })
    };
    let all: Vec<_> = done.iter().map(one).collect();
    Ok(serde_json::to_string_pretty(&serde_json::json!({ "sequences": all }))? + "\n")
}
