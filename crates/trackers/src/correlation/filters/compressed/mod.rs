//! The closed form of DSST on features compressed by a projection that follows the template (danelljan2017).

mod compression;
#[cfg(test)]
mod reference;

pub use compression::{CHANNELS, Compression};

use super::{ResponseFilter, Spectra, fits, mean_power};
use pursuit_geometry::Size;
use pursuit_vision::fourier::spectra::{add_power, add_product, blend_real};
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// The translation filter of fDSST (danelljan2017, section 4.1): the closed form of DSST on features compressed by a
/// projection that follows the template.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "CompressedFilter")]
pub struct CompressedFilter {
    /// Regularisation λ, relative to the mean of B.
    lambda: f64,
    /// Standard deviation of the label in cells.
    label_sigma: f64,
    grid: Size,
    /// u, the running average of the features, all channels one after the other.
    template: Vec<f32>,
    compression: Compression,
    /// G conj(Ũ), the compressed channels one after the other.
    numerator: Spectra,
    /// B.
    denominator: Vec<f32>,
    /// Mean of B over all frequencies.
    mean_power: f32,
    #[serde(skip)]
    work: Work,
}

pursuit_estimation::checked!(CompressedFilter);

impl CompressedFilter {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { grid, label_sigma, compression, numerator, .. } = &self;
        let sound = compression.is_consistent()
            && fits(*grid, compression.dimensions(), *label_sigma, numerator)
            && self.template.len() == grid.area() * CHANNELS
            && self.denominator.len() * compression.dimensions() == numerator.0.len();
        if !sound {
            return Err("its filter does not have the size of its grid");
        }
        let work = Work::new(*grid, *label_sigma);
        Ok(Self { work, ..self })
    }
}

/// Plans and what is overwritten at every use.
#[derive(Debug, Clone)]
struct Work {
    fft: RealFft2,
    scratch: FftScratch,
    /// G, the spectrum of the wanted response.
    label: Vec<Complex32>,
    compressed: Planes,
    spectrum: Vec<Complex32>,
    /// The spectrum of the last response.
    sum: Vec<Complex32>,
    power: Vec<f32>,
}

/// Of a grid of one cell: made anew for the filter's own.
impl Default for Work {
    fn default() -> Self {
        Self::new(Size::new(1, 1), 1.0)
    }
}

impl Work {
    fn new(grid: Size, label_sigma: f64) -> Self {
        let fft = RealFft2::new(grid.width, grid.height);
        let mut scratch = FftScratch::default();
        let mut label = vec![Complex32::default(); fft.spectrum_len()];
        fft.forward(&gaussian_label(grid.width, grid.height, label_sigma, label_sigma), &mut label, &mut scratch);
        Self {
            compressed: Planes::default(),
            spectrum: label.clone(),
            sum: label.clone(),
            power: vec![0.0; label.len()],
            fft,
            scratch,
            label,
        }
    }
}

impl CompressedFilter {
    /// An untaught filter for planes of `grid` cells that keeps `dimensions` channels; the wanted response is a Gaussian of
    /// `label_sigma` cells.
    pub fn new(dimensions: usize, lambda: f64, label_sigma: f64, grid: Size) -> Self {
        let (compression, work) = (Compression::new(dimensions), Work::new(grid, label_sigma));
        Self {
            lambda,
            label_sigma,
            grid,
            template: vec![0.0; grid.area() * CHANNELS],
            numerator: Spectra(vec![Complex32::default(); work.label.len() * compression.dimensions()]),
            denominator: work.power.clone(),
            compression,
            mean_power: 0.0,
            work,
        }
    }
}

impl ResponseFilter for CompressedFilter {
    fn respond(&mut self, features: &Planes, response: &mut [f32]) {
        let lambda = (self.lambda as f32 * self.mean_power).max(f32::MIN_POSITIVE);
        let work = &mut self.work;
        self.compression.apply(features.as_slice(), features.size(), &mut work.compressed);
        work.sum.fill(Complex32::default());
        for (plane, numerator) in work.compressed.planes().zip(self.numerator.0.chunks_exact(work.label.len())) {
            work.fft.forward(plane, &mut work.spectrum, &mut work.scratch);
            add_product(&mut work.sum, &work.spectrum, numerator);
        }
        work.sum.iter_mut().zip(&self.denominator).for_each(|(sum, b)| *sum /= b + lambda);
        work.fft.inverse(&work.sum, response, &mut work.scratch);
    }

    fn learn(&mut self, features: &Planes, rate: f64) {
        let work = &mut self.work;
        let (features, size, bins) = (features.as_slice(), features.size(), work.label.len());
        let rate = rate.min(1.0) as f32;
        blend_real(&mut self.template, features, rate);
        self.compression.fit(&self.template);

        self.compression.apply(&self.template, size, &mut work.compressed);
        for (plane, numerator) in work.compressed.planes().zip(self.numerator.0.chunks_exact_mut(bins)) {
            work.fft.forward(plane, numerator, &mut work.scratch);
            numerator.iter_mut().zip(&work.label).for_each(|(u, g)| *u = g * u.conj());
        }
        self.compression.apply(features, size, &mut work.compressed);
        work.power.fill(0.0);
        for plane in work.compressed.planes() {
            work.fft.forward(plane, &mut work.spectrum, &mut work.scratch);
            add_power(&mut work.power, &work.spectrum);
        }
        blend_real(&mut self.denominator, &work.power, rate);
        self.mean_power = mean_power(&work.fft, &self.denominator);
    }

    fn series(&self) -> (&RealFft2, &[Complex32]) {
        (&self.work.fft, &self.work.sum)
    }

    fn shape(&self) -> (Size, usize) {
        (self.grid, CHANNELS)
    }
}
