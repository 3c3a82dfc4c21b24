use super::print;
use crate::args::{Calibrate, Measure};
use crate::console;
use pursuit::RunError;
use pursuit::measure::{CALIBRATION, Destination, Facts, FoundInClip, camera_of, measure, write_calibration};
use pursuit::measuring::{Calibration, Ruler};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// A lens that leaves over more than this is not as it is described, pixels.
const MUCH_LEFT_PX: f64 = 1.0;

/// `pursuit measure RUN`.
pub fn run(args: &Measure) -> anyhow::Result<ExitCode> {
    let options = args.measuring.options();
    let said = args.ruler.options();
    let of_run = || if args.run.is_dir() { args.run.clone() } else { args.run.with_file_name("") };
    let folder = args.out.clone().unwrap_or_else(of_run);
    let destination = Destination::new(&folder, &options.formats, options.plots != Some(false))?;
    let calibration = if said.is_silent() {
        None
    } else {
        let base = pursuit::measure::calibration_of(&args.run, &options)?;
        Some(said.applied(base)?)
    };
    let found = measure(&args.run, calibration, &options)?;
    let files = destination.write(&found)?;
    for warning in &found.facts.warnings {
        tracing::warn!("{warning}");
    }
    let text = if args.json {
        let mut value = serde_json::to_value(&found.facts)?;
        value["files"] = files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().into();
        serde_json::to_string_pretty(&value)? + "\n"
    } else {
        let mut text = summary(&found.facts)?;
        writeln!(text, "files")?;
        files.iter().try_for_each(|file| writeln!(text, "  {}", file.display()))?;
        console::printable(&text)
    };
    print(text.as_bytes())
}

/// What was measured, in words.
pub fn summary(facts: &Facts) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let Some(ruler) = &facts.ruler else { return Ok(text) };
    let unit = ruler.unit;
    match (ruler.per_pixel, ruler.relative_error, &facts.calibration_file) {
        _ if ruler.kind == "pixels" => {
            writeln!(text, "ruler     none: lengths are in pixels (calibrate with --scale or `pursuit calibrate`)")?
        }
        (Some(length), Some(error), from) => {
            writeln!(
                text,
                "ruler     {}, {length:.6} {unit} a pixel ± {:.2} %{}",
                ruler.kind,
                100.0 * error,
                named(from)
            )?;
        }
        (.., from) => writeln!(text, "ruler     {}{}", ruler.kind, named(from))?,
    }
    for t in &facts.targets {
        writeln!(
            text,
            "target {}  measured in {} frames from {:.3} s to {:.3} s, {} bridged, {} outside",
            t.target, t.measured, t.from_s, t.to_s, t.bridged, t.outside
        )?;
        writeln!(
            text,
            "  noise     {:.3} px, found from the track; model: constant {}",
            t.noise_px,
            if t.model_order == 4 { "jerk" } else { "acceleration" }
        )?;
        writeln!(text, "  path      {:.4} ± {:.4} {unit}", t.path[0], t.path[1])?;
        writeln!(text, "  top speed {:.4} ± {:.4} {unit}/s", t.top_speed[0], t.top_speed[1])?;
    }
    for fit in &facts.fits {
        writeln!(
            text,
            "fit       {} of target {}, {:.3} s to {:.3} s, {} frames",
            fit.asked.shape.name(),
            fit.target,
            fit.from_s,
            fit.to_s,
            fit.count
        )?;
        for p in &fit.parameters {
            writeln!(text, "  {:<12} {:.5} ± {:.5} {}", p.name, p.value, p.error, p.unit)?;
        }
        let rms: Vec<String> = fit.residual_rms.iter().map(|r| format!("{r:.5}")).collect();
        writeln!(text, "  left over    {} {unit} (RMS)", rms.join(", "))?;
    }
    if !facts.events.is_empty() {
        writeln!(text, "events    {}", facts.events.len())?;
    }
    for event in facts.events.iter().take(20) {
        let name = event.name.as_deref().unwrap_or_default();
        let [x, y] = event.at;
        writeln!(
            text,
            "  {:<9} {:.4} ± {:.4} s, target {} at {x:.4}, {y:.4} {name}",
            event.kind.as_str(),
            event.time_s,
            event.time_error_s,
            event.target
        )?;
    }
    if !facts.stays.is_empty() {
        writeln!(text, "zones")?;
    }
    for stay in &facts.stays {
        let (zone, visits) = (&stay.zone, stay.visits);
        let times = if visits == 1 { "visit" } else { "visits" };
        writeln!(
            text,
            "  {zone:<9} target {}: {:.3} ± {:.3} s inside ({:.1} %), {visits} {times}, {:.4} {unit} there",
            stay.target,
            stay.inside_s,
            stay.inside_error_s,
            100.0 * stay.share,
            stay.path
        )?;
    }
    Ok(text)
}

fn named(file: &Option<PathBuf>) -> String {
    file.as_ref().map_or_else(String::new, |file| format!(", of {}", file.display()))
}

/// A camera that was found, in words.
fn describe(text: &mut String, found: &FoundInClip) -> std::fmt::Result {
    let (of, camera) = (&found.found, &found.found.camera);
    writeln!(
        text,
        "board     seen in {} of {} frames; {} of them are used",
        found.seen,
        found.frames,
        found.used.len()
    )?;
    for (axis, name) in ["across", "down"].into_iter().enumerate() {
        writeln!(
            text,
            "{name:<9} focal length {:.2} ± {:.2} px, principal point {:.2} ± {:.2} px",
            camera.focal[axis], of.focal_error[axis], camera.centre[axis], of.centre_error[axis]
        )?;
    }
    for (name, (value, error)) in
        ["k1", "k2", "p1", "p2"].into_iter().zip(camera.distortion.iter().zip(&of.distortion_error))
    {
        writeln!(text, "{name:<9} {value:.5} ± {error:.5}")?;
    }
    writeln!(text, "left over {:.3} px (RMS)", of.rms_px)?;
    if of.rms_px > MUCH_LEFT_PX {
        tracing::warn!(
            "{:.2} px are left over, which is much: is the board flat, and does the lens keep its focus?",
            of.rms_px
        );
    }
    Ok(())
}

/// `pursuit calibrate INPUT`.
pub fn calibrate(args: &Calibrate) -> anyhow::Result<ExitCode> {
    let said = args.ruler.options();
    if said.is_silent() && args.board.is_none() {
        return Err(RunError::usage(
            "nothing is said of the ruler; give --scale X1,Y1,X2,Y2=LENGTH, --target-size or --plane, or find the lens with --board",
        )
        .into());
    }
    let mut source = pursuit::open(args.input.as_str())?;
    let size = source.info().size;
    let mut base = Calibration { picture: Some([size.width, size.height]), ..Calibration::default() };
    let mut text = String::new();
    if let Some(board) = &args.board {
        let found = camera_of(&mut *source, board)?;
        describe(&mut text, &found)?;
        base.camera = Some(found.found.camera);
    }
    let made = said.applied(base)?;
    let beside = || Path::new(&args.input).parent().unwrap_or(Path::new("")).join(CALIBRATION);
    let path = args.out.clone().unwrap_or_else(|| if args.input.contains(':') { CALIBRATION.into() } else { beside() });
    // The size of the target shows in a run only.
    if made.target.is_none() && !said.is_silent() {
        let ruler = Ruler::new(&made, &[]).map_err(RunError::from)?;
        let facts = ruler.facts();
        if let (Some(length), Some(error)) = (facts.per_pixel, facts.relative_error) {
            writeln!(text, "ruler     {}, {length:.6} {} a pixel ± {:.2} %", facts.kind, facts.unit, 100.0 * error)?;
        }
        for (i, residual) in facts.residuals_px.iter().enumerate() {
            writeln!(text, "point {:<3} {residual:.2} px off", i + 1)?;
        }
        for warning in &facts.warnings {
            tracing::warn!("{warning}");
        }
    }
    write_calibration(&made, &path, args.overwrite)?;
    writeln!(text, "written   {}", path.display())?;
    print(console::printable(&text).as_bytes())
}
