use super::{print, settings, track};
use crate::args::{Demo, Global};
use crate::console;
use pursuit::Finished;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

/// `pursuit demo`.
pub fn run(args: &Demo, global: &Global) -> anyhow::Result<ExitCode> {
    let demo = pursuit::Demo::prepare(args.seed, &args.out, &settings(&args.settings)?)?;
    let bar = console::progress_bar(demo.frame_count(), global);
    let remote = demo.remote();
    console::on_interrupt(move || remote.stop());
    let finished = demo.run(|progress| bar.set_position(progress.frames))?;
    bar.finish_and_clear();
    let text = if args.json { track::json(&finished)? } else { summary(&finished)? };
    let code = print(text.as_bytes())?;
    match finished.outcome.failure {
        Some(error) => Err(error.into()),
        None => Ok(code),
    }
}

fn summary(finished: &Finished) -> anyhow::Result<String> {
    let mut text = track::summary(finished, true)?;
    if pursuit::NO_OVERLAY.is_none() {
        writeln!(
            text,
            "\nOpen {} to see it: green is measured, red predicted before the frame was seen, white the estimate.",
            finished.out.as_deref().unwrap_or(Path::new("")).join("overlay.mp4").display()
        )?;
    }
    writeln!(
        text,
        "Next: pursuit track YOUR_VIDEO --detect ball --set color=orange   or   --box LEFT,TOP,WIDTH,HEIGHT"
    )?;
    Ok(text)
}
