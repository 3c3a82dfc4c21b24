use super::credentials::with_credentials;
use super::{print, settings};
use crate::args::{Global, Overlay, Track, numbers};
use crate::{console, memory, networks};
use pursuit::cameras::{Camera, Cameras, Watched};
use pursuit::config::parse_box;
use pursuit::media::depth::DepthOptions;
use pursuit::media::wrappers::Patience;
use pursuit::media::{Locator, OpenOptions};
use pursuit::sinks::OverlayStyle;
use pursuit::trackers::flow::SURROUNDINGS_PX;
use pursuit::{ComparedFacts, Finished, Run, RunConfig, RunError, StartFrom};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

/// `pursuit track INPUT …`: what went wrong with one of several inputs is said when it did, and the last of it at the end.
pub fn run(args: &Track, global: &Global) -> anyhow::Result<ExitCode> {
    if let Some(cameras) = cameras(args)? {
        return watch(cameras, args);
    }
    let mut configs = configs(args)?;
    let Some(last) = configs.pop() else { return Ok(ExitCode::SUCCESS) };
    let mut failed = None;
    for config in configs {
        if let Err(error) = run_one(config, args, global) {
            failed.get_or_insert(crate::fail(&error));
        }
        if let Some(code) = console::interrupted() {
            return Ok(code);
        }
    }
    let code = run_one(last, args, global)?;
    Ok(failed.unwrap_or(code))
}

fn run_one(config: RunConfig, args: &Track, global: &Global) -> anyhow::Result<ExitCode> {
    let Some(config) = with_box(config, args)? else { return Ok(ExitCode::SUCCESS) };
    let input = config.input.clone();
    let run = console::connecting(input.as_ref(), global, || Run::prepare(config, &open_options(args)))?;
    memory::check(run.input().size.area())?;
    let video = !(args.no_video || args.overlay == Some(Overlay::None));
    let say = |finished: &Finished| match (&finished.out, args.json) {
        // Standard output belongs to the results.
        (None, _) => Ok(String::new()),
        (Some(_), true) => json(finished),
        (Some(_), false) => Ok(console::printable(&summary(finished, video)?)),
    };
    #[cfg(feature = "studio")]
    if args.watch {
        return super::studio::watched(run, |run, _| carry_out(run, global, say));
    }
    carry_out(run, global, say)
}

/// The configuration with the box that the user draws, where one is to be drawn; none when the user gave up.
pub fn with_box(config: RunConfig, args: &Track) -> anyhow::Result<Option<RunConfig>> {
    #[cfg(feature = "studio")]
    if args.pick {
        return super::studio::pick(config, &open_options(args));
    }
    let _ = args;
    Ok(Some(config))
}

/// Runs to the end, with a bar and an ear for Ctrl-C, prints what `say` makes of it, and fails as the run did.
pub fn carry_out(
    run: Run,
    global: &Global,
    say: impl FnOnce(&Finished) -> anyhow::Result<String>,
) -> anyhow::Result<ExitCode> {
    let bar = console::progress_bar(run.frame_count(), global);
    let remote = run.remote();
    console::on_interrupt(move || remote.stop());
    let finished = run.run(|progress| {
        bar.set_position(progress.frames);
        if let Some(estimate) = progress.records.first().and_then(|r| r.estimate.as_ref()) {
            bar.set_message(estimate.state.as_str());
        }
    })?;
    bar.finish_and_clear();
    let code = print(say(&finished)?.as_bytes())?;
    match finished.outcome.failure {
        Some(error) => Err(error.into()),
        None => Ok(code),
    }
}

/// A configuration for each input. Where a folder is named for several, each has one in it, named after the input.
fn configs(args: &Track) -> Result<Vec<RunConfig>, RunError> {
    let config = config(args)?;
    if args.inputs.len() < 2 {
        return Ok(vec![config]);
    }
    if config.out.as_deref() == Some(Path::new("-")) {
        return Err(RunError::usage(
            "the results of several inputs do not go to standard output; name a folder with `--out DIR`",
        ));
    }
    let mut taken = BTreeMap::<OsString, u32>::new();
    let one = |name: &OsString| {
        let stem = Path::new(name).file_stem().unwrap_or(name).to_owned();
        let count = taken.entry(stem.clone()).and_modify(|count| *count += 1).or_insert(1);
        let mut folder = stem;
        if *count > 1 {
            folder.push(format!("-{count}"));
        }
        let input = with_credentials(Locator::from(name.clone()), &args.credentials)?;
        let out = config.out.as_ref().map(|out| out.join(folder));
        Ok(RunConfig { input: Some(input), out, ..config.clone() })
    };
    args.inputs.iter().map(one).collect()
}

/// How the input is to be opened.
pub fn open_options(args: &Track) -> OpenOptions {
    let live = (args.live || args.no_live).then_some(args.live);
    let patience = Patience { stall: args.stall, reconnect: args.reconnect };
    OpenOptions { live, patience, ..OpenOptions::from_env() }
}

/// The configuration file, overridden by the options given.
pub fn config(args: &Track) -> Result<RunConfig, RunError> {
    let file = match &args.config {
        Some(path) => RunConfig::read(path)?,
        None => RunConfig::default(),
    };
    completed(file.overridden_by(said(args)?), args)
}

/// The cameras that the configuration file names, where it does; overridden by the options given.
fn cameras(args: &Track) -> Result<Option<Vec<Camera>>, RunError> {
    let (Some(path), true) = (&args.config, args.inputs.is_empty()) else { return Ok(None) };
    let Some(cameras) = Cameras::read(path)? else { return Ok(None) };
    if args.out.as_deref() == Some(Path::new("-")) {
        return Err(RunError::usage("the results of several cameras do not go to standard output; name a folder"));
    }
    #[cfg(feature = "studio")]
    if args.pick || args.watch {
        return Err(RunError::usage("one camera can be looked at in the browser; give its input in place of the file"));
    }
    let each = cameras.overridden_by(&said(args)?).into_iter();
    let each = each.map(|camera| Ok(Camera { config: completed(camera.config, args)?, ..camera }));
    each.collect::<Result<_, _>>().map(Some)
}

/// Watches several cameras at once, and tells what became of each.
fn watch(cameras: Vec<Camera>, args: &Track) -> anyhow::Result<ExitCode> {
    let all = pursuit::cameras::watch(cameras, &open_options(args), console::stop_flag())?;
    let video = !(args.no_video || args.overlay == Some(Overlay::None));
    let (mut failed, mut told) = (None, serde_json::Map::new());
    for Watched { name, finished } in all {
        let error = match finished {
            Ok(finished) if args.json => {
                told.insert(name.clone(), serde_json::from_str(&json(&finished)?)?);
                finished.outcome.failure
            }
            Ok(finished) => {
                print(console::printable(&format!("{name}\n{}\n", summary(&finished, video)?)).as_bytes())?;
                finished.outcome.failure
            }
            Err(error) => Some(error),
        };
        if let Some(error) = error {
            let code = ExitCode::from(error.exit_code());
            anstream::eprintln!("{}: {}", console::ERROR, console::printable(&format!("camera {name}: {error}")));
            failed.get_or_insert(code);
        }
    }
    if args.json {
        print((serde_json::to_string_pretty(&told)? + "\n").as_bytes())?;
    }
    Ok(console::interrupted().or(failed).unwrap_or(ExitCode::SUCCESS))
}

/// The boxes given, or those about the points given.
fn start_boxes(args: &Track) -> Result<Vec<[f64; 4]>, RunError> {
    let around = |&[x, y]: &[f64; 2]| {
        let half = SURROUNDINGS_PX / 2.0;
        Ok([x - half, y - half, SURROUNDINGS_PX, SURROUNDINGS_PX])
    };
    args.boxes.iter().map(|b| parse_box(b)).chain(args.points.iter().map(around)).collect()
}

/// What the options given say.
fn said(args: &Track) -> Result<RunConfig, RunError> {
    let flag = |given: bool, value: bool| given.then_some(value);
    Ok(RunConfig {
        input: args.inputs.first().cloned().map(Locator::from),
        depth: args.depth.clone(),
        depth_options: depth_options(args)?,
        boxes: start_boxes(args)?,
        tracker: args.tracker.clone(),
        compare: args.compare.clone(),
        detect: args.detect.clone(),
        device: args.device,
        start: StartFrom::ALL.iter().copied().find(|s| args.start.as_deref() == Some(s.as_str())),
        detections: args.detections.clone(),
        many: flag(args.many, true),
        out: args.out.clone(),
        overwrite: flag(args.overwrite, true),
        resume: flag(args.resume, true),
        video: flag(args.no_video || args.overlay == Some(Overlay::None), false),
        overlay: args.overlay.and_then(|style| match style {
            Overlay::Minimal => Some(OverlayStyle::Minimal),
            Overlay::Full => Some(OverlayStyle::Full),
            Overlay::None => None,
        }),
        plots: flag(args.plots, true),
        measure: flag(args.measure, true),
        measure_options: args.measuring.options(),
        formats: args.formats.iter().copied().map(pursuit::sinks::Format::name).map(str::to_owned).collect(),
        segment: args.days.segment,
        keep: args.days.keep,
        events: args.days.options(),
        publish: args.publish.address.clone().map(Locator::new),
        publish_options: args.publish.options(),
        from: args.span.from,
        to: args.span.to,
        stride: args.span.stride,
        region: args.view.region()?,
        resize: args.view.resize()?,
        fps: args.span.fps,
        real_time: flag(args.real_time, true),
        parameters: settings(&args.settings)?,
        read_from: None,
    })
}

/// With credentials and networks, which are kept elsewhere.
fn completed(config: RunConfig, args: &Track) -> Result<RunConfig, RunError> {
    let input = config.input.map(|input| with_credentials(input, &args.credentials)).transpose()?;
    let detector = config.detect.as_deref();
    // Points are followed as such where nobody says by what.
    let of_points = !args.points.is_empty() && config.compare.is_empty();
    let tracker = config.tracker.or_else(|| of_points.then(|| "point".to_owned()));
    let parameters = networks::located(config.parameters, tracker.as_deref().into_iter(), detector);
    let publish = config.publish.map(|address| args.publish.with_password(address)).transpose()?;
    Ok(RunConfig { input, tracker, publish, parameters, ..config })
}

/// How depth images are to be read.
fn depth_options(args: &Track) -> Result<DepthOptions, RunError> {
    let four = |text: &Option<String>, what: &str| text.as_deref().map(|t| numbers(t, what)).transpose();
    let offset = args.depth_offset.as_deref().map(|text| numbers(text, "--depth-offset"));
    Ok(DepthOptions {
        coding: args.depth_coding,
        intrinsics: four(&args.intrinsics, "--intrinsics")?,
        depth_intrinsics: four(&args.depth_intrinsics, "--depth-intrinsics")?,
        offset_mm: offset.transpose()?,
        registered: args.depth_registered.then_some(true),
    })
}

pub fn json(finished: &Finished) -> anyhow::Result<String> {
    let mut value = serde_json::to_value(&finished.facts)?;
    value["out"] = finished.out.as_ref().map(|o| o.display().to_string()).into();
    value["files"] = finished.files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().into();
    Ok(serde_json::to_string_pretty(&value)? + "\n")
}

/// A line for each of the trackers that were compared.
fn compared(facts: &[ComparedFacts]) -> String {
    let share = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
    let mut rows = vec![
        ["tracker", "tracking", "unsure", "occluded", "lost", "update ms", "agrees", "overlap", "false alive"]
            .map(str::to_owned),
    ];
    rows.extend(facts.iter().map(|f| {
        let states = [f.states.tracking, f.states.unsure, f.states.occluded, f.states.lost].map(|n| n.to_string());
        let [tracking, unsure, occluded, lost] = states;
        let false_alive = f.accuracy.filter(|a| a.absent_frames > 0).map(|a| a.false_alive);
        let (update, agrees) = (format!("{:.3}", f.update_ms.p50), share(f.agreement));
        let overlap = share(f.accuracy.map(|a| a.mean_iou));
        [f.tracker.clone(), tracking, unsure, occluded, lost, update, agrees, overlap, share(false_alive)]
    }));
    pursuit::evaluation::aligned(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
}

pub fn summary(finished: &Finished, wants_video: bool) -> anyhow::Result<String> {
    let (facts, states) = (&finished.facts, finished.facts.states);
    let update = &facts.timing.update_ms;
    let mut text = String::new();
    writeln!(
        text,
        "{}: {} frames of {}x{}, {}",
        facts.input.name, facts.frame_count, facts.input.width, facts.input.height, facts.status
    )?;
    writeln!(text, "tracker   {}", facts.recipe.tracker)?;
    if let ("truth", Some(frame)) = (facts.recipe.start, facts.recipe.start_frame) {
        let [left, top, width, height] = facts.recipe.boxes.first().copied().unwrap_or_default();
        writeln!(text, "start     the truth's first box, in frame {frame}: {left:.1},{top:.1},{width:.1},{height:.1}")?;
    }
    if let Some(depth) = &facts.input.depth {
        let pairs = &depth.pairing;
        let moved = if depth.registered { ", moved into the picture" } else { "" };
        write!(
            text,
            "depth     {}{moved}, for {} frames, {} without",
            depth.coding.name(),
            pairs.paired,
            pairs.unpaired
        )?;
        match facts.empty_depth_frames {
            Some(empty @ 1..) => writeln!(text, "; {empty} of those looked at have no data in it")?,
            _ => writeln!(text)?,
        }
    }
    let counts = [states.tracking, states.unsure, states.occluded, states.lost];
    let [tracking, unsure, occluded, lost] = counts;
    writeln!(text, "states    {tracking} tracking, {unsure} unsure, {occluded} occluded, {lost} lost")?;
    let timing = &facts.timing;
    // Where there is a detector, or more than one target, a tracker's update is not what a frame takes.
    let is_part = timing.detect_ms.count > 0 || update.count > timing.frame_ms.count;
    let shown = [("update", update), ("detect", &timing.detect_ms), ("frame", &timing.frame_ms)];
    for (name, t) in shown.into_iter().filter(|(name, t)| t.count > 0 && (is_part || *name == "update")) {
        let (mean, p50, p95, p99) = (t.mean, t.p50, t.p95, t.p99);
        let what = match name {
            "update" if is_part => ", of one target",
            "frame" => ", of all together",
            _ => "",
        };
        writeln!(text, "{name:<9} {mean:.3} ms mean, {p50:.3} median, {p95:.3} p95, {p99:.3} p99{what}")?;
    }
    let latency = &facts.timing.latency_ms;
    if latency.count > 0 {
        let (p50, p95, p99) = (latency.p50, latency.p95, latency.p99);
        writeln!(text, "latency   {p50:.1} ms median, {p95:.1} p95, {p99:.1} p99, from a frame to its results")?;
    }
    if !facts.compared.is_empty() {
        write!(text, "\n{}\n", compared(&facts.compared))?;
    }
    if let Some(a) = facts.accuracy.as_ref().filter(|_| facts.compared.is_empty()) {
        writeln!(text, "accuracy  against the truth that came with the input:")?;
        writeln!(
            text,
            "  followed        {:.1} % of {} visible frames, mean overlap {:.3}",
            100.0 * a.followed,
            a.visible_frames,
            a.mean_iou
        )?;
        writeln!(
            text,
            "  centre RMSE     {:.3} px estimate, {:.3} measured, {:.3} predicted",
            a.rmse_estimate_px, a.rmse_measured_px, a.rmse_predicted_px
        )?;
        writeln!(
            text,
            "  falsely alive   {:.1} % of {} frames without the target",
            100.0 * a.false_alive,
            a.absent_frames
        )?;
    }
    if let Some(measured) = &finished.measured {
        measured.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        text += &super::measure::summary(measured)?;
    }
    if facts.damage_count > 0 {
        writeln!(text, "damage    {} times something could not be read and was left out", facts.damage_count)?;
        facts.damage.iter().try_for_each(|message| writeln!(text, "  {message}"))?;
    }
    if facts.dropped_frames > 0 {
        writeln!(text, "dropped   {} frames that came faster than they could be followed", facts.dropped_frames)?;
    }
    if let Some(stream) = facts.stream.filter(|s| s.stalls + s.breaks > 0) {
        writeln!(
            text,
            "stream    {} stalls, {} breaks, connected again {} times, {:.1} s without a frame at most",
            stream.stalls, stream.breaks, stream.reconnects, stream.longest_gap_s
        )?;
    }
    if let Some(segments) = &facts.segments {
        let (files, clips, removed) = (segments.files.len(), segments.clips, segments.removed);
        writeln!(
            text,
            "segments  {files} files, {clips} clips and pictures of events, {removed} removed for their age"
        )?;
    }
    if let Some(published) = &facts.publish {
        let (all, dropped) = (published.messages, published.dropped);
        writeln!(text, "messages  {} sent to {}, {dropped} dropped", all - dropped, published.broker)?;
    }
    if let Some(why) = pursuit::NO_OVERLAY.filter(|_| wants_video) {
        writeln!(text, "no video  {why}")?;
    }
    writeln!(text, "files")?;
    for file in &finished.files {
        writeln!(text, "  {}", file.display())?;
    }
    Ok(text)
}
