//! Opening an input: media, synthetic scenes, and the wrappers a run needs around them.

use crate::{Fetched, RunConfig, RunError, part_of};
use pursuit_media::wrappers::{Prefetch, PrefetchStats, Retimed, Strided, Throttled, Trimmed};
use pursuit_media::{Locator, OpenOptions, Source, SourceInfo};
use pursuit_scenes::{SceneQuery, SceneSource};
use std::num::NonZeroU64;

/// Frames decoded ahead of the tracker.
const AHEAD_FRAMES: usize = 8;

/// Fewer of large pictures: these are to take no more than this.
const AHEAD_BYTES: usize = 40 << 20;
/// Of colour as it comes from most inputs.
const BYTES_A_PIXEL: usize = 2;

/// One frame in a quarter of an hour, and what the fastest cameras deliver: outside of it times lose their meaning.
const SENSIBLE_FPS: std::ops::RangeInclusive<f64> = 0.001..=1_000_000.0;

/// An input ready to be read, decoding ahead on its own thread.
pub(crate) struct OpenedInput {
    /// Delivers the frames.
    pub source: Box<dyn Source>,
    /// What is known of it.
    pub info: SourceInfo,
    /// Counts what was decoded and what a live source dropped.
    pub stats: PrefetchStats,
}

/// Opens the input of `config`, or takes the source that is given for it; of one that was followed up to the frame `seen`, what
/// comes after it.
///
/// A source that is given is read on the thread that tracks, when its next frame is wanted.
///
/// # Errors
/// Senseless options, or an input that cannot be read.
pub(crate) fn open(
    (name, given): (&Locator, Option<Box<dyn Source>>),
    config: &RunConfig,
    fetched: &Fetched,
    seen: Option<u64>,
    options: &OpenOptions,
) -> Result<OpenedInput, RunError> {
    check(config)?;
    let default_fps = config.fps.unwrap_or(options.default_fps);
    let options = &OpenOptions { depth: config.depth_options, default_fps, ..options.clone() };
    let (place, depth) = (fetched.place(name), config.depth.as_deref().map(|depth| fetched.place(&depth.into())));
    let (depth, is_given) = (depth.as_ref().map(Locator::reveal), given.is_some());
    let mut source = match (given, depth) {
        (None, depth) => open_both(&place, depth, options)?,
        (Some(source), None) => source,
        (Some(source), Some(depth)) => pursuit_media::with_depth(source, depth, options)?,
    };
    // An input without times of its own has been given this rate already, and knows of its gaps.
    if let Some(fps) = config.fps.filter(|&fps| source.info().fps != Some(fps)) {
        source = Box::new(Retimed::new(source, fps)?);
    }
    if seen.is_some() && source.info().live {
        return Err(RunError::usage("what a live source has shown does not come again; a run of it cannot be resumed"));
    }
    let stride = config.stride.map_or(1, NonZeroU64::get);
    // The next frame of the same stride.
    let from = seen.map_or(config.from, |seen| Some(seen.saturating_add(stride)));
    if from.is_some() || config.to.is_some() {
        source = Box::new(Trimmed::new(source, from.unwrap_or(0), config.to)?);
    }
    if let Some(stride) = config.stride {
        source = Box::new(Strided::new(source, stride));
    }
    if config.real_time == Some(true) && !source.info().live {
        source = Box::new(Throttled::as_camera(source));
    }
    // Cut first and decoded ahead afterwards, so that this happens on the decoder's thread.
    source = part_of(source, config.region, config.resize)?;
    let name = if place == *name { source.info().name.clone() } else { name.to_string() };
    let info = SourceInfo { name, ..source.info().clone() };
    tracing::info!("{}: {} pixels, read by {}", info.name, info.size, info.decoder);
    if is_given {
        return Ok(OpenedInput { source, info, stats: PrefetchStats::default() });
    }
    // Whoever has the program work on one thread wants one processor used.
    let alone = rayon::current_num_threads() == 1;
    let ahead = (AHEAD_BYTES / (BYTES_A_PIXEL * info.size.area()).max(1)).clamp(2, AHEAD_FRAMES);
    let source = Prefetch::new(source, if alone { 0 } else { ahead })?;
    Ok(OpenedInput { stats: source.stats(), source: Box::new(source), info })
}

/// Opens an input and, where it is named, its depth.
fn open_both(name: &Locator, depth: Option<&str>, options: &OpenOptions) -> Result<Box<dyn Source>, RunError> {
    match depth {
        None => open_one(name, options),
        Some(depth) if depth.starts_with(SceneQuery::PREFIX) => Err(RunError::usage(format!(
            "`{depth}` gives no depth images; a scene with depth brings its own, so leave --depth out"
        ))),
        Some(depth) if name.reveal().starts_with(SceneQuery::PREFIX) => {
            Ok(pursuit_media::with_depth(open_one(name, options)?, depth, options)?)
        }
        Some(depth) => Ok(pursuit_media::open_with_depth(name.clone(), depth, options)?),
    }
}

/// Opens one input without wrappers: a scene, or whatever the media layer knows.
pub(crate) fn open_one(name: &Locator, options: &OpenOptions) -> Result<Box<dyn Source>, RunError> {
    if name.reveal().starts_with(SceneQuery::PREFIX) {
        let scene = SceneSource::open(name.reveal()).map_err(|e| RunError::usage(e.to_string()))?;
        return Ok(Box::new(scene));
    }
    Ok(pursuit_media::open(name.clone(), options)?)
}

fn check(config: &RunConfig) -> Result<(), RunError> {
    if let Some(fps) = config.fps.filter(|fps| !SENSIBLE_FPS.contains(fps)) {
        let (least, most) = (SENSIBLE_FPS.start(), SENSIBLE_FPS.end());
        return Err(RunError::usage(format!(
            "{fps} frames a second make no sense; give a number from {least} to {most}, for example 25"
        )));
    }
    match (config.from, config.to) {
        (from, Some(to)) if from.unwrap_or(0) > to => Err(RunError::usage(format!(
            "no frames from {} to {to}; the first must not come after the last",
            from.unwrap_or(0)
        ))),
        _ => Ok(()),
    }
}
