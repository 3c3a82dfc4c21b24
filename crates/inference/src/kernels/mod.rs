//! The kernels of small convolutional networks: plain loops over arrays of sixteen columns, compiled for several
//! instruction sets and chosen at run time.

mod depthwise;
mod map;
mod pointwise;
#[cfg(test)]
mod reference;
mod squeeze;
mod stem;

pub use depthwise::{Depthwise, DepthwiseShape};
pub use map::{Columns, LANES, Map};
pub use pointwise::{Pointwise, PointwiseInput};
pub use squeeze::SqueezeExcite;
pub use stem::Stem;

/// What follows a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// Nothing.
    None,
    /// max(0, x).
    Relu,
    /// min(6, max(0, x)).
    Relu6,
    /// x · clamp(x / 6 + 1/2, 0, 1).
    HardSwish,
}

impl Activation {
    /// The activation of one number.
    #[cfg(test)]
    pub fn of(self, x: f32) -> f32 {
        match self {
            Self::None => x,
            Self::Relu => x.max(0.0),
            Self::Relu6 => x.clamp(0.0, 6.0),
            Self::HardSwish => x * hard_sigmoid(x),
        }
    }

    /// The activation of sixteen numbers: one decision for all.
    #[inline(always)]
    #[allow(clippy::manual_clamp, reason = "two instructions; `clamp` would test for NaN")]
    fn of_lanes(self, x: &mut [f32; LANES]) {
        match self {
            Self::None => {}
            Self::Relu => x.iter_mut().for_each(|v| *v = v.max(0.0)),
            Self::Relu6 => x.iter_mut().for_each(|v| *v = v.max(0.0).min(6.0)),
            Self::HardSwish => x.iter_mut().for_each(|v| *v *= hard_sigmoid(*v)),
        }
    }
}

/// clamp(x / 6 + 1/2, 0, 1).
#[inline(always)]
#[allow(clippy::manual_clamp, reason = "two instructions; `clamp` would test for NaN")]
pub fn hard_sigmoid(x: f32) -> f32 {
    (x * (1.0 / 6.0) + 0.5).max(0.0).min(1.0)
}

/// a · b + c, rounded once where the target has an instruction for it.
#[inline(always)]
fn mul_add<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// sum += factor · x, column by column.
#[inline(always)]
fn add_product<const FUSED: bool>(sum: &mut [f32; LANES], factor: f32, x: &[f32; LANES]) {
    for j in 0..LANES {
        sum[j] = mul_add::<FUSED>(factor, x[j], sum[j]);
    }
}

/// Sixteen neighbouring columns from `at` on.
#[inline(always)]
fn lanes_at(row: &[f32], at: usize) -> &[f32; LANES] {
    window_at(row, at)
}

/// `L` neighbouring columns from `at` on.
#[inline(always)]
fn window_at<const L: usize>(row: &[f32], at: usize) -> &[f32; L] {
    match row[at..].first_chunk() {
        Some(window) => window,
        None => unreachable!("maps are padded to whole lanes and the reach of their kernel"),
    }
}
