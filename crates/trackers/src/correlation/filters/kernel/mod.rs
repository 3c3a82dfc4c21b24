//! Kernel ridge regression over all cyclic shifts (henriques2015).

#[cfg(test)]
mod reference;
mod similarity;

pub use similarity::Kernel;

use super::{ResponseFilter, Spectra, fits};
use pursuit_geometry::Size;
use pursuit_vision::fourier::spectra::{add_conj_product, blend, energy, energy_real};
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// Kernel ridge regression over all cyclic shifts of a patch, solved in the Fourier domain (henriques2015).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "KernelFilter")]
pub struct KernelFilter {
    kernel: Kernel,
    /// Regularisation λ.
    lambda: f64,
    /// Standard deviation of the label in cells.
    label_sigma: f64,
    grid: Size,
    channels: usize,
    /// x̂, the template's spectra.
    model: Spectra,
    /// Sum of squares of the template.
    model_norm: f64,
    /// α̂, the spectrum of the dual coefficients.
    alpha: Spectra,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(KernelFilter);

impl KernelFilter {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { grid, label_sigma, channels, .. } = self;
        if !fits(grid, channels, label_sigma, &self.model) || !fits(grid, 1, label_sigma, &self.alpha) {
            return Err("its filter does not have the size of its grid");
        }
        Ok(Self { work: Work::new(grid, label_sigma, channels), ..self })
    }
}

/// Plans and what is overwritten at every use.
#[derive(Debug, Clone)]
struct Work {
    fft: RealFft2,
    scratch: FftScratch,
    /// ŷ.
    label: Vec<Complex32>,
    spectra: Vec<Complex32>,
    sum: Vec<Complex32>,
    plane: Vec<f32>,
}

/// Of a grid of one cell: made anew for the filter's own.
impl Default for Work {
    fn default() -> Self {
        Self::new(Size::new(1, 1), 1.0, 1)
    }
}

impl KernelFilter {
    /// An untaught filter for `channels` planes of `grid` cells; the label is a Gaussian of `label_sigma` cells.
    pub fn new(kernel: Kernel, lambda: f64, label_sigma: f64, grid: Size, channels: usize) -> Self {
        let work = Work::new(grid, label_sigma, channels);
        let zero = |n: usize| Spectra(vec![Complex32::default(); n]);
        let (model, alpha) = (zero(work.spectra.len()), zero(work.sum.len()));
        Self { kernel, lambda, label_sigma, grid, channels, model, model_norm: 0.0, alpha, work }
    }
}

impl Work {
    fn new(grid: Size, label_sigma: f64, channels: usize) -> Self {
        let fft = RealFft2::new(grid.width, grid.height);
        let (mut scratch, zero) = (FftScratch::default(), Complex32::default());
        let plane = gaussian_label(grid.width, grid.height, label_sigma, label_sigma);
        let mut label = vec![zero; fft.spectrum_len()];
        fft.forward(&plane, &mut label, &mut scratch);
        let spectra = vec![zero; label.len() * channels];
        Self { sum: label.clone(), fft, scratch, label, spectra, plane }
    }

    /// Spectra of all planes.
    fn transform(&mut self, features: &Planes) {
        let n = self.sum.len();
        for (plane, spectrum) in features.planes().zip(self.spectra.chunks_exact_mut(n)) {
            self.fft.forward(plane, spectrum, &mut self.scratch);
        }
    }

    /// Into `sum` the spectrum of the kernel correlation of `model` (of the features themselves where there is none) with
    /// the features transformed last: eqs. 29–31 with the sum over channels of section 7.1.
    fn kernel_correlation(&mut self, kernel: Kernel, model: Option<&[Complex32]>, norms: f64) {
        let bins = self.sum.len();
        self.sum.fill(Complex32::default());
        let model = model.unwrap_or(&self.spectra);
        for (x, z) in model.chunks_exact(bins).zip(self.spectra.chunks_exact(bins)) {
            add_conj_product(&mut self.sum, x, z);
        }
        let values = self.plane.len() * (self.spectra.len() / bins);
        self.fft.inverse(&self.sum, &mut self.plane, &mut self.scratch);
        kernel.apply(&mut self.plane, values as f64, norms);
        self.fft.forward(&self.plane, &mut self.sum, &mut self.scratch);
    }
}

impl ResponseFilter for KernelFilter {
    fn respond(&mut self, features: &Planes, response: &mut [f32]) {
        let work = &mut self.work;
        work.transform(features);
        let norms = self.model_norm + energy_real(features.as_slice());
        work.kernel_correlation(self.kernel, Some(&self.model.0), norms);
        // Eq. 22: f̂ = k̂ˣᶻ ⊙ α̂.
        work.sum.iter_mut().zip(&self.alpha.0).for_each(|(k, a)| *k *= a);
        work.fft.inverse(&work.sum, response, &mut work.scratch);
    }

    fn learn(&mut self, features: &Planes, rate: f64) {
        let work = &mut self.work;
        work.transform(features);
        work.kernel_correlation(self.kernel, None, 2.0 * energy_real(features.as_slice()));
        // Eq. 17: α̂ = ŷ / (k̂ˣˣ + λ). Of the autocorrelation's spectrum only the real part is not rounding.
        let lambda = self.lambda as f32;
        work.sum.iter_mut().zip(&work.label).for_each(|(k, y)| *k = y / (k.re + lambda));
        if rate >= 1.0 {
            self.model.0.clone_from(&work.spectra);
            self.alpha.0.clone_from(&work.sum);
        } else {
            blend(&mut self.model.0, &work.spectra, rate as f32);
            blend(&mut self.alpha.0, &work.sum, rate as f32);
        }
        self.model_norm = spectral_norm(&work.fft, &self.model.0);
    }

    fn series(&self) -> (&RealFft2, &[Complex32]) {
        (&self.work.fft, &self.work.sum)
    }

    fn shape(&self) -> (Size, usize) {
        (self.grid, self.channels)
    }
}

/// Sum of squares of the planes whose spectra are given (Parseval).
fn spectral_norm(fft: &RealFft2, spectra: &[Complex32]) -> f64 {
    let Size { width, height } = fft.size();
    let columns = spectra.chunks_exact(height).enumerate();
    columns.map(|(u, bins)| fft.multiplicity(u % fft.columns()) as f64 * energy(bins)).sum::<f64>()
        / (width * height) as f64
}
