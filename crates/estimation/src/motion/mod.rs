//! Motion models with exact discretisation: the process noise of a model in continuous time is integrated over the
//! step, so that two half steps and one whole step agree.
//!
//! Units are whatever the position is measured in (pixels in a tracker) and seconds. States are ordered by derivative
//! and then by axis: `[x, y, vx, vy, ax, ay]`.

mod apart;
mod boxes;
mod integrators;
mod singer;
mod turning;

pub use apart::ApartBox;
pub use boxes::{PhysicalBox, SortBox, StepBox};
pub(crate) use integrators::spread;
pub use integrators::{ConstantAcceleration, ConstantVelocity, Integrators, KinematicNoise, RandomWalk};
pub use singer::{CurrentStatistical, Singer};
pub use turning::{CoordinatedTurn, KnownTurn};
