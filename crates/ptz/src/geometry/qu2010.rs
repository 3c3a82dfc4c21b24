//! The paper `qu2010`'s angle of view, its equations (1) to (3).
//!
//! With `X_max = r tan θ_x` and `X_c = r tan α`: `α = atan(X_c tan θ_x / X_max)`, and likewise `β` from `Y_c`. `X_c` and
//! `Y_c` are offsets from the middle of the picture, y down, so the head turns by `(α, −β)`. `α` is exact. `β` takes no
//! account of the pan: at the corner of a picture 60° wide it turns 2.9° too far.

use super::{Direction, Lens};
use pursuit_geometry::Point;

/// `α` and `β` of a pixel, degrees: to the right and **downward**, as printed.
///
/// # Panics
/// Never; a pixel that is not finite gives angles that are not.
pub fn angles_deg(lens: &Lens, pixel: Point) -> (f64, f64) {
    let (x, y) = lens.offset(pixel);
    (x.atan().to_degrees(), y.atan().to_degrees())
}

/// By how much the paper turns the head to bring `pixel` to the middle of the picture.
pub fn turn(lens: &Lens, pixel: Point) -> Direction {
    let (alpha, beta) = angles_deg(lens, pixel);
    Direction::new(alpha, -beta)
}
