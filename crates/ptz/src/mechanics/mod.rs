//! How a head moves: axes with limits of speed, acceleration and travel, and play in their gears. The same equations make
//! the simulated head and the model by which a controller knows where the real one stands; their parameters differ.

mod axes;
mod axis;
mod limits;
mod travel;

pub use axes::Axes;
pub use axis::{Axis, Goal};
pub use limits::{AxisLimits, HeadLimits};
pub use travel::travel_time_s;
