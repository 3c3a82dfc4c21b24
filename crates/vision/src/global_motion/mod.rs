//! The motion of the whole picture from one frame to the next, as a moving camera makes it: by robust fit to sparse flow
//! ([`SparseMotion`]) or by phase correlation ([`PhaseCorrelation`], translation only); [`PictureMotion`] does either from picture to
//! picture.

mod fit;
mod phase;
mod picture;
mod sparse;
mod vote;

pub use fit::{GlobalMotion, MotionKind, RobustFit, RobustFitParams};
pub use phase::{PhaseCorrelation, PhaseShift};
pub use picture::{PictureMotion, PictureShift};
pub use sparse::{SparseMotion, SparseMotionParams};

#[cfg(test)]
mod tests;
