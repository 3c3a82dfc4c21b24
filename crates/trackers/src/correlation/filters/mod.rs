//! Filters that answer a window's features with a plane whose peak is the target's displacement.

pub mod circulant;
pub mod compressed;
pub mod kernel;
pub mod mosse;
pub mod regularised;
pub mod reliable;
mod spectra;

pub use circulant::{CirculantCoder, SparseCodeParams};
pub use compressed::CompressedFilter;
pub use kernel::{Kernel, KernelFilter};
pub use mosse::MosseFilter;
pub use regularised::RegularisedFilter;
pub use reliable::ReliableFilter;
pub use spectra::{Spectra, mean_power};

use super::params::{ReliabilityParams, SolverParams};
use pursuit_geometry::Size;
use pursuit_vision::fourier::{Complex32, RealFft2};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

/// A filter that answers a window's features with a plane whose peak is the target's displacement.
pub trait ResponseFilter {
    /// The response to `features`; `response` has one entry for each cell, the first one means no displacement. Changes
    /// nothing but scratch.
    fn respond(&mut self, features: &Planes, response: &mut [f32]);

    /// Learns features centred on the target, `rate` (0–1) new and the rest as before; 1 forgets everything.
    fn learn(&mut self, features: &Planes, rate: f64);

    /// The Fourier series of the last response, which tells its values between the cells.
    fn series(&self) -> (&RealFft2, &[Complex32]);

    /// The grid and the number of channels it is made for.
    fn shape(&self) -> (Size, usize);

    /// What responses are multiplied by such that the peak of a filter that fits is 1.
    fn peak_unit(&self) -> f64 {
        1.0
    }

    /// Confines what is learnt from now on to the cells that are 1, of a plane of zeros and ones; without any, and by filters that are
    /// never confined, that is not heeded.
    fn confine(&mut self, _cells: &[f32]) {}
}

/// Which filter: a small value, saved with the tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum FilterKind {
    /// The minimum output sum of squared error (bolme2010; with several channels danelljan2014).
    Mosse {
        /// Regularisation as a share of the mean energy of a frequency.
        lambda: f64,
    },
    /// Kernel ridge regression (henriques2015).
    Kernel {
        /// The kernel.
        kernel: Kernel,
        /// Regularisation λ.
        lambda: f64,
    },
    /// The closed form on compressed features (danelljan2017).
    Compressed {
        /// Channels kept.
        dimensions: usize,
        /// Regularisation as a share of the mean energy of a frequency.
        lambda: f64,
    },
    /// Confined to the target (galoogahi2017, li2018).
    Regularised(SolverParams),
    /// Confined to the target's cells, each channel for itself (lukezic2017).
    Reliable(ReliabilityParams),
    /// A sparse code of shifted templates (zhang2016).
    Circulant(SparseCodeParams),
}

impl FilterKind {
    /// An untaught filter on `channels` planes of `grid` cells for a target of `target` cells (width, height) in the middle,
    /// with a Gaussian label of `label_sigma` cells.
    pub fn make(&self, grid: Size, channels: usize, target: (f64, f64), label_sigma: f64) -> Filter {
        match self {
            Self::Mosse { lambda } => Filter::Mosse(Box::new(MosseFilter::new(*lambda, label_sigma, grid, channels))),
            Self::Kernel { kernel, lambda } => {
                Filter::Kernel(Box::new(KernelFilter::new(*kernel, *lambda, label_sigma, grid, channels)))
            }
            Self::Compressed { dimensions, lambda } => {
                Filter::Compressed(Box::new(CompressedFilter::new(*dimensions, *lambda, label_sigma, grid)))
            }
            Self::Regularised(solver) => Filter::Regularised(Box::new(RegularisedFilter::new(
                solver.clone(),
                grid,
                channels,
                target,
                label_sigma,
            ))),
            Self::Reliable(params) => {
                Filter::Reliable(Box::new(ReliableFilter::new(params.clone(), grid, channels, target, label_sigma)))
            }
            Self::Circulant(code) => {
                Filter::Circulant(Box::new(CirculantCoder::new(code.clone(), grid, channels, label_sigma)))
            }
        }
    }
}

/// The filter of a [`FilterKind`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Filter {
    /// The minimum output sum of squared error.
    Mosse(Box<MosseFilter>),
    /// Kernel ridge regression.
    Kernel(Box<KernelFilter>),
    /// The closed form on compressed features.
    Compressed(Box<CompressedFilter>),
    /// Confined to the target.
    Regularised(Box<RegularisedFilter>),
    /// Confined to the target's cells, each channel for itself.
    Reliable(Box<ReliableFilter>),
    /// A sparse code of shifted templates.
    Circulant(Box<CirculantCoder>),
}

impl Deref for Filter {
    type Target = dyn ResponseFilter;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Mosse(f) => &**f,
            Self::Kernel(f) => &**f,
            Self::Compressed(f) => &**f,
            Self::Regularised(f) => &**f,
            Self::Reliable(f) => &**f,
            Self::Circulant(f) => &**f,
        }
    }
}

impl DerefMut for Filter {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Mosse(f) => &mut **f,
            Self::Kernel(f) => &mut **f,
            Self::Compressed(f) => &mut **f,
            Self::Regularised(f) => &mut **f,
            Self::Reliable(f) => &mut **f,
            Self::Circulant(f) => &mut **f,
        }
    }
}

/// Whether `spectra` are those of `channels` planes of `grid` cells, and the grid and label are possible: for states read
/// from outside.
fn fits(grid: Size, channels: usize, label_sigma: f64, spectra: &Spectra) -> bool {
    let sides = 1..=4096;
    let possible = sides.contains(&grid.width) && sides.contains(&grid.height) && (1..=1024).contains(&channels);
    possible
        && label_sigma.is_finite()
        && label_sigma > 0.0
        && spectra.0.len() == (grid.width / 2 + 1) * grid.height * channels
}
