//! Variations of the linear filter: fading memory, steady gain, square root, measurements one component at a time,
//! late measurements, smoothing, noise learnt from innovations, estimated inputs.

mod adaptation;
mod delayed;
mod fading;
mod fixed_lag;
mod input_estimation;
mod robust;
mod sequential;
mod smoother;
mod square_root;
mod steady;

pub use adaptation::{MeasurementNoiseAdaptation, ProcessNoiseScaling};
pub use delayed::{LastUpdate, Replay};
pub use fixed_lag::FixedLag;
pub use input_estimation::InputEstimator;
pub use robust::Robust;
pub use smoother::{smooth, smooth_extended, smooth_unscented};
pub use square_root::SquareRoot;
pub use steady::SteadyState;
