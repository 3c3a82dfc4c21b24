//! Motion filters of boxes, for any tracker to use.
//!
//! | filter | use |
//! |---|---|
//! | [`BoxFilter`] with [`BoxNoise::Relative`] | targets that change their velocity smoothly; noise scales with the box |
//! | [`BoxFilter`] with [`BoxNoise::PerStep`] | the filter of `ball` as printed |
//! | [`ManoeuvringBox`] | targets that fly, bounce, stop and start: three motion models, weighed by what is measured |
//! | [`PartlySeen`] | wraps another one: infers the whole box where only a part of the target is seen |

mod box_filter;
mod manoeuvring;
mod partly_seen;

pub use box_filter::{BoxFilter, BoxNoise, MeasurementNoise, RelativeNoise};
pub use manoeuvring::{ManoeuvreNoise, ManoeuvringBox};
pub use partly_seen::{PartlySeen, View, complete};

use crate::BoxCovariance;
use nalgebra::{SMatrix, SVector};
use pursuit_geometry::{BBox, Point};

/// What goes wrong inside a motion filter.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Sides below this many pixels are not believed: a filter must not shrink a box to nothing.
const SMALLEST_SIDE_PX: f64 = 1.0;

/// `[x, y, w, h]` of a box, as measured.
fn measured(bbox: &BBox) -> SVector<f64, 4> {
    SVector::from([bbox.center().x, bbox.center().y, bbox.width(), bbox.height()])
}

/// The box of a state whose centre is at components 0 and 1 and whose size is at `size` and `size + 1`.
fn box_of<const N: usize>(state: &SVector<f64, N>, size: usize) -> BBox {
    let side = |i: usize| state[i].max(SMALLEST_SIDE_PX);
    BBox::from_center_size(Point::new(state[0], state[1]), side(size), side(size + 1))
}

/// Covariance of centre and size, taken out of that of the whole state.
fn box_covariance<const N: usize>(covariance: &SMatrix<f64, N, N>, size: usize) -> BoxCovariance {
    let at = [0, 1, size, size + 1];
    BoxCovariance::from_fn(|i, j| covariance[(at[i], at[j])])
}

/// The length that noise is relative to: the side of the square of equal area.
fn extent_px(bbox: &BBox) -> f64 {
    bbox.area().sqrt().max(SMALLEST_SIDE_PX)
}
