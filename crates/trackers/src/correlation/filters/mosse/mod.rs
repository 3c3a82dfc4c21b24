//! The minimum output sum of squared error (bolme2010), with several channels (danelljan2014).

use super::{ResponseFilter, Spectra, fits, mean_power};
use pursuit_geometry::Size;
use pursuit_vision::fourier::spectra::{add_power, add_product, blend, blend_real};
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// The filter that minimises the sum of squared errors of its response over all samples (bolme2010, section 3.3):
/// H* = A / (B + ε) with A = Σ G ⊙ F*, B = Σ F ⊙ F* (eqs. 5, 10–12). With
/// several channels each has its A, B is the sum of their energies and the responses add up (danelljan2014, eq. 4).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "MosseFilter")]
pub struct MosseFilter {
    /// Regularisation ε, relative to the mean of B.
    epsilon: f64,
    /// Standard deviation of the label in cells.
    label_sigma: f64,
    grid: Size,
    channels: usize,
    numerator: Spectra,
    denominator: Vec<f32>,
    /// Mean of B over all frequencies.
    mean_power: f32,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(MosseFilter);

impl MosseFilter {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { grid, label_sigma, channels, .. } = self;
        let numbers = self.numerator.0.len();
        if !fits(grid, channels, label_sigma, &self.numerator) || self.denominator.len() * channels != numbers {
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
    /// G, the spectrum of the wanted response.
    label: Vec<Complex32>,
    spectra: Vec<Complex32>,
    sum: Vec<Complex32>,
    power: Vec<f32>,
}

/// Of a grid of one cell: made anew for the filter's own.
impl Default for Work {
    fn default() -> Self {
        Self::new(Size::new(1, 1), 1.0, 1)
    }
}

impl Work {
    fn new(grid: Size, label_sigma: f64, channels: usize) -> Self {
        let fft = RealFft2::new(grid.width, grid.height);
        let mut scratch = FftScratch::default();
        let mut label = vec![Complex32::default(); fft.spectrum_len()];
        fft.forward(&gaussian_label(grid.width, grid.height, label_sigma, label_sigma), &mut label, &mut scratch);
        let spectra = vec![Complex32::default(); label.len() * channels.max(1)];
        Self { spectra, sum: label.clone(), power: vec![0.0; label.len()], fft, scratch, label }
    }
}

impl MosseFilter {
    /// An untaught filter for `channels` planes of `grid` cells; the wanted response is a Gaussian of `label_sigma` cells.
    pub fn new(epsilon: f64, label_sigma: f64, grid: Size, channels: usize) -> Self {
        let work = Work::new(grid, label_sigma, channels);
        let (numerator, denominator) = (Spectra(work.spectra.clone()), work.power.clone());
        Self { epsilon, label_sigma, grid, channels, numerator, denominator, mean_power: 0.0, work }
    }

    /// A filter with any wanted response, for the fixture.
    #[cfg(test)]
    pub(super) fn with_label(label: &[f64], epsilon: f64, (width, height): (usize, usize)) -> Self {
        let mut filter = Self::new(epsilon, 1.0, Size::new(width, height), 1);
        let plane: Vec<f32> = label.iter().map(|v| *v as f32).collect();
        let Work { fft, label, scratch, .. } = &mut filter.work;
        fft.forward(&plane, label, scratch);
        filter
    }

    /// ε in units of B.
    fn regularization(&self) -> f32 {
        (self.epsilon as f32 * self.mean_power).max(f32::MIN_POSITIVE)
    }
}

impl ResponseFilter for MosseFilter {
    fn respond(&mut self, features: &Planes, response: &mut [f32]) {
        let epsilon = self.regularization();
        let work = &mut self.work;
        work.sum.fill(Complex32::default());
        let bins = work.sum.len();
        for (plane, numerator) in features.planes().zip(self.numerator.0.chunks_exact(bins)) {
            work.fft.forward(plane, &mut work.spectra[..bins], &mut work.scratch);
            add_product(&mut work.sum, &work.spectra[..bins], numerator);
        }
        work.sum.iter_mut().zip(&self.denominator).for_each(|(sum, b)| *sum /= b + epsilon);
        work.fft.inverse(&work.sum, response, &mut work.scratch);
    }

    fn learn(&mut self, features: &Planes, rate: f64) {
        let work = &mut self.work;
        let bins = work.label.len();
        work.power.fill(0.0);
        for (plane, spectrum) in features.planes().zip(work.spectra.chunks_exact_mut(bins)) {
            work.fft.forward(plane, spectrum, &mut work.scratch);
            add_power(&mut work.power, spectrum);
            spectrum.iter_mut().zip(&work.label).for_each(|(f, g)| *f = g * f.conj());
        }
        if rate >= 1.0 {
            self.numerator.0.clone_from(&work.spectra);
            self.denominator.clone_from(&work.power);
        } else {
            blend(&mut self.numerator.0, &work.spectra, rate as f32);
            blend_real(&mut self.denominator, &work.power, rate as f32);
        }
        self.mean_power = mean_power(&work.fft, &self.denominator);
    }

    fn series(&self) -> (&RealFft2, &[Complex32]) {
        (&self.work.fft, &self.work.sum)
    }

    fn shape(&self) -> (Size, usize) {
        (self.grid, self.channels)
    }
}

#[cfg(test)]
mod reference;
