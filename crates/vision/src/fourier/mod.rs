//! Frequency-domain correlation: two-dimensional real Fourier transforms, windows, spectra, peaks and their quality.
//!
//! Choose ([`good_size`]), construct ([`RealFft2::new`]) and execute ([`RealFft2::forward`]) are three things; scratch is
//! passed in, so that nothing is allocated per frame. Spectra of real planes are stored as half of their bins, column by
//! column: see [`RealFft2`].

mod peak;
mod plan;
mod quality;
#[cfg(test)]
pub(crate) mod reference;
mod size;
pub mod spectra;
mod window;

pub use peak::{Peak, highest, newton_peak, parabola_peak, signed_shift};
pub use plan::{FftScratch, RealFft2};
pub(crate) use quality::sidelobe_ratio;
pub use quality::{PeakQuality, average_peak_to_correlation_energy, peak_to_sidelobe_ratio};
pub use rustfft::num_complex::Complex32;
pub use size::good_size;
pub use window::{HannEnds, gaussian_label, hann, hann_plane};
