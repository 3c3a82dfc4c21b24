//! What is asked of a configuration before a run begins: where results go, what they go on from, and what makes no sense together.

use crate::config::RunConfig;
use crate::resume::Earlier;
use crate::run_folder::Destination;
use crate::{RunError, measure, run_folder};
use pursuit_media::Locator;
use std::path::Path;

/// Refuses what makes no sense of a run in segments.
pub(super) fn check_segments(config: &RunConfig) -> Result<(), RunError> {
    let Some(segment) = config.segment else {
        return match config.keep {
            Some(_) if config.events.clips != Some(true) => {
                Err(RunError::usage("old segments are what `--keep` removes; add their length, `--segment 1h`"))
            }
            _ => Ok(()),
        };
    };
    let problem = if segment.seconds() < 1.0 {
        "a segment is a second long at least"
    } else if config.out.as_deref() == Some(Path::new("-")) {
        "standard output is not cut into segments; name a folder with `--out DIR`"
    } else if config.plots == Some(true) || config.measure == Some(true) {
        "plots and measurements are of one trajectory; leave `--segment` out, or make them of a segment afterwards"
    } else {
        return Ok(());
    };
    Err(RunError::usage(problem))
}

/// Refuses before anything is followed what could not be measured after it.
pub(super) fn check_measure(config: &RunConfig, destination: Option<&Destination>) -> Result<(), RunError> {
    let Some(destination) = destination else {
        return Err(RunError::usage("what goes to standard output is not measured; name a folder with `--out DIR`"));
    };
    let options = &config.measure_options;
    measure::Destination::new(destination.path(), &options.formats, false).map(drop)?;
    options.check(config.input.as_ref().map(Locator::path))
}

/// Where results go; none is standard output, which takes one format.
pub(super) fn destination(config: &RunConfig, input: &Locator) -> Result<Option<Destination>, RunError> {
    let out = config.out.as_deref();
    if out != Some(Path::new("-")) {
        let overwrite = config.overwrite == Some(true);
        if config.resume == Some(true) {
            let folder = run_folder::earlier(out, overwrite, input);
            return Destination::new(Some(&folder), true, input, config.files()).map(Some);
        }
        return Destination::new(out, overwrite, input, config.files()).map(Some);
    }
    if config.plots == Some(true) || config.video == Some(true) || !config.formats.is_empty() {
        return Err(RunError::usage(
            "standard output takes JSON lines alone; give a folder with `--out DIR` for plots, videos and further formats",
        ));
    }
    Ok(None)
}

/// The run to go on with, where that is asked for and there is something left of it.
pub(super) fn earlier(config: &RunConfig, destination: Option<&Destination>) -> Result<Option<Earlier>, RunError> {
    match destination {
        _ if config.resume != Some(true) => Ok(None),
        Some(destination) => Earlier::find(destination.path(), config),
        None => Err(RunError::usage("what went to standard output cannot be resumed; name a folder with `--out DIR`")),
    }
}
