//! The kernels of small convolutional networks: loops over vectors of sixteen columns, compiled for several instruction
//! sets and chosen at run time. The vectors are named as such: left to itself, the compiler makes pieces of windows that overlap.

mod attention;
mod convolution;
mod depthwise;
mod functions;
mod map;
mod panels;
mod pointwise;
#[cfg(test)]
mod reference;
mod squeeze;
mod winograd;

pub use attention::{Attention, LayerNorm};
pub use convolution::Convolution;
pub use depthwise::{Depthwise, DepthwiseShape};
pub use map::{Columns, LANES, Map};
pub use panels::TOGETHER;
pub use pointwise::{Pointwise, PointwiseInput};
pub use squeeze::{Excitation, SqueezeExcite, means};
pub use winograd::{Winograd, WinogradInput};

use fearless_simd::{Simd, f32x16, prelude::*};

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
    /// x (1 + erf(x / √2)) / 2.
    Gelu,
    /// 1 / (1 + exp(−x)), kept from 0.0001 to 0.9999.
    Probability,
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
            Self::Gelu => functions::reference::gelu(x),
            Self::Probability => (1.0 / (1.0 + (-x).exp())).clamp(1e-4, 0.9999),
        }
    }

    /// The activation of `N` times sixteen numbers.
    #[inline(always)]
    fn of_lanes<S: Simd, const N: usize>(self, mut x: [f32x16<S>; N]) -> [f32x16<S>; N] {
        match self {
            Self::None => {}
            Self::Relu => {
                for i in 0..N {
                    x[i] = x[i].max(0.0);
                }
            }
            Self::Relu6 => {
                for i in 0..N {
                    x[i] = x[i].max(0.0).min(6.0);
                }
            }
            Self::HardSwish => {
                for i in 0..N {
                    x[i] *= (x[i] * (1.0 / 6.0) + 0.5).max(0.0).min(1.0);
                }
            }
            Self::Gelu => {
                for i in 0..N {
                    x[i] = functions::gelu(x[i]);
                }
            }
            Self::Probability => {
                for i in 0..N {
                    x[i] = (1.0 / (functions::exp(-x[i]) + 1.0)).max(1e-4).min(0.9999);
                }
            }
        }
        x
    }
}

/// clamp(x / 6 + 1/2, 0, 1).
#[inline(always)]
#[allow(clippy::manual_clamp, reason = "two instructions; `clamp` would test for NaN")]
pub fn hard_sigmoid(x: f32) -> f32 {
    (x * (1.0 / 6.0) + 0.5).max(0.0).min(1.0)
}

/// Sixteen neighbouring columns from `at` on.
#[inline(always)]
fn lanes_at<S: Simd>(simd: S, row: &[f32], at: usize) -> f32x16<S> {
    f32x16::load_array_ref(simd, window_at(row, at))
}

/// `L` neighbouring columns from `at` on.
#[inline(always)]
fn window_at<const L: usize>(row: &[f32], at: usize) -> &[f32; L] {
    match row[at..].first_chunk() {
        Some(window) => window,
        None => unreachable!("maps are padded to whole lanes and the reach of their kernel"),
    }
}
