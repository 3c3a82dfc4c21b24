//! Opening an input: media, synthetic scenes, and the wrappers a run needs around them.

use crate::{RunConfig, RunError};
use pursuit_media::depth::DepthFacts;
use pursuit_media::wrappers::{Prefetch, PrefetchStats, Retimed, StreamStats, Strided, Trimmed};
use pursuit_media::{Locator, OpenOptions, Source, SourceInfo};
use pursuit_scenes::{SceneQuery, SceneSource};

/// Frames decoded ahead of the tracker.
const AHEAD_FRAMES: usize = 8;

/// One frame in a quarter of an hour, and what the fastest cameras deliver: outside of it times lose their meaning.
const SENSIBLE_FPS: std::ops::RangeInclusive<f64> = 0.001..=1_000_000.0;

/// An input ready to be read, decoding ahead on its own thread.
pub(crate) struct OpenedInput {
    /// Delivers the frames.
    pub source: Prefetch,
    /// What is known of it.
    pub info: SourceInfo,
    /// What was found out about its depth, where it has some.
    pub depth: Option<DepthFacts>,
    /// Counts what was decoded and what a live source dropped.
    pub stats: PrefetchStats,
    /// Counts what befell a live source.
    pub stream: Option<StreamStats>,
}

/// Opens the input of `config`.
///
/// # Errors
/// Senseless options, or an input that cannot be read.
pub(crate) fn open(name: &Locator, config: &RunConfig, options: &OpenOptions) -> Result<OpenedInput, RunError> {
    check(config)?;
    let default_fps = config.fps.unwrap_or(options.default_fps);
    let options = &OpenOptions { depth: config.depth_options, default_fps, ..options.clone() };
    let mut source = open_both(name, config.depth.as_deref(), options)?;
    // Truth is numbered as the frames of the whole input are.
    let truth = source.info().truth.clone();
    let (depth, stream) = (source.depth_facts().cloned(), source.stream_stats());
    // An input without times of its own has been given this rate already, and knows of its gaps.
    if let Some(fps) = config.fps.filter(|&fps| source.info().fps != Some(fps)) {
        source = Box::new(Retimed::new(source, fps)?);
    }
    if config.from.is_some() || config.to.is_some() {
        source = Box::new(Trimmed::new(source, config.from.unwrap_or(0), config.to)?);
    }
    if let Some(stride) = config.stride {
        source = Box::new(Strided::new(source, stride));
    }
    let info = SourceInfo { truth, ..source.info().clone() };
    let source = Prefetch::new(source, AHEAD_FRAMES)?;
    tracing::info!("{}: {} pixels, read by {}", info.name, info.size, info.decoder);
    Ok(OpenedInput { stats: source.stats(), source, info, depth, stream })
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
