//! The motion of the whole picture from one frame to the next, as a moving camera makes it: by robust fit to sparse flow
//! ([`SparseMotion`]) or by phase correlation ([`PhaseCorrelation`], translation only).

mod fit;
mod phase;
mod sparse;
mod vote;

pub use fit::{GlobalMotion, MotionKind, RobustFit, RobustFitParams};
pub use phase::{PhaseCorrelation, PhaseShift};
pub use sparse::{SparseMotion, SparseMotionParams};

#[cfg(test)]
mod tests;
