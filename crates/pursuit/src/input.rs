//! Opening an input: media, synthetic scenes, and the wrappers a run needs around them.

use crate::{RunConfig, RunError};
use pursuit_media::depth::DepthFacts;
use pursuit_media::wrappers::{Prefetch, PrefetchStats, Retimed, Trimmed};
use pursuit_media::{OpenOptions, Source, SourceInfo};
use pursuit_scenes::{SceneQuery, SceneSource};

/// Frames decoded ahead of the tracker.
const AHEAD_FRAMES: usize = 8;

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
}

/// Opens the input of `config`.
///
/// # Errors
/// Senseless options, or an input that cannot be read.
pub(crate) fn open(name: &str, config: &RunConfig, options: &OpenOptions) -> Result<OpenedInput, RunError> {
    check(config)?;
    let options = &OpenOptions { depth: config.depth_options, ..options.clone() };
    let mut source = open_both(name, config.depth.as_deref(), options)?;
    // Truth is numbered as the frames of the whole input are.
    let truth = source.info().truth.clone();
    let depth = source.depth_facts().cloned();
    if let Some(fps) = config.fps {
        source = Box::new(Retimed::new(source, fps)?);
    }
    if config.from.is_some() || config.to.is_some() {
        source = Box::new(Trimmed::new(source, config.from.unwrap_or(0), config.to)?);
    }
    let info = SourceInfo { truth, ..source.info().clone() };
    let source = Prefetch::new(source, AHEAD_FRAMES)?;
    Ok(OpenedInput { stats: source.stats(), source, info, depth })
}

/// Opens an input and, where it is named, its depth.
fn open_both(name: &str, depth: Option<&str>, options: &OpenOptions) -> Result<Box<dyn Source>, RunError> {
    match depth {
        None => open_one(name, options),
        Some(depth) if depth.starts_with(SceneQuery::PREFIX) => Err(RunError::usage(format!(
            "`{depth}` gives no depth images; a scene with depth brings its own, so leave --depth out"
        ))),
        Some(depth) if name.starts_with(SceneQuery::PREFIX) => {
            Ok(pursuit_media::with_depth(open_one(name, options)?, depth, options)?)
        }
        Some(depth) => Ok(pursuit_media::open_with_depth(name, depth, options)?),
    }
}

/// Opens one input without wrappers: a scene, or whatever the media layer knows.
pub(crate) fn open_one(name: &str, options: &OpenOptions) -> Result<Box<dyn Source>, RunError> {
    if name.starts_with(SceneQuery::PREFIX) {
        let scene = SceneSource::open(name).map_err(|e| RunError::usage(e.to_string()))?;
        return Ok(Box::new(scene));
    }
    Ok(pursuit_media::open(name, options)?)
}

fn check(config: &RunConfig) -> Result<(), RunError> {
    if let Some(fps) = config.fps.filter(|f| !(f.is_finite() && *f > 0.0)) {
        return Err(RunError::usage(format!(
            "{fps} frames a second make no sense; give a number above 0, for example 25"
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
