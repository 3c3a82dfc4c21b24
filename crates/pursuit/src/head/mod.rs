//! Pan-tilt heads in the run loop: a head as a sink, frames that say how it stood, and worlds for simulated cameras.
//!
//! [`steer`] makes of a [`Pilot`](pursuit_ptz::drivers::Pilot) both ends: a [`HeadSink`], which tells it of the first target of
//! each frame and of where the tracker expects that, and [`Poses`], which says of each frame how the head stood when it was
//! taken, for trackers with `motion.camera = pose`. [`follow`] puts both into a run.

#[cfg(feature = "encode")]
mod film;
mod grid_map;
mod known_world;
mod sink;
mod steering;

#[cfg(feature = "encode")]
pub use film::Film;
pub use grid_map::grid_map;
pub use known_world::{KnownTarget, KnownWorld};
pub use sink::HeadSink;
pub use steering::{Poses, compensated, follow, steer};

use crate::{RunConfig, RunError};
use pursuit_tracking::many::{Acquiring, MultiTracker};

/// What finds one target and follows it as a run of `config` does, which names a detector: for the pictures of a simulated camera.
///
/// # Errors
/// As [`RunConfig::methods`], and where no detector is named.
pub fn finder(config: &RunConfig) -> Result<Box<dyn MultiTracker>, RunError> {
    let methods = config.methods()?;
    let detector =
        methods.detector.ok_or_else(|| RunError::usage("no detector is named; add one, `--detect motion`"))?;
    Ok(Box::new(Acquiring::new(detector, methods.recipe, methods.acquire)?))
}
