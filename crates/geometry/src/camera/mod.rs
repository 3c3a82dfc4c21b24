//! Between pixels and directions: a camera without distortion, and the head that turns it. Angles are in radians.
//!
//! A ray is written by its parts to the right, **downward** and ahead in the camera; its tangents are the first two for each
//! unit ahead.

mod direction;
mod pinhole;

pub use direction::Direction;
pub use pinhole::Pinhole;
