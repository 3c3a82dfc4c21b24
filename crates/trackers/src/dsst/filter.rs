use super::Compression;
use crate::correlation::{ResponseFilter, ResponsePeak, Seen, Spectra, mean_power};
use pursuit_geometry::Size;
use pursuit_vision::fourier::spectra::{add_power, add_product, blend_real};
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, gaussian_label, newton_peak};
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// Newton steps towards the peak between the cells.
const NEWTON_STEPS: usize = 3;

/// The translation filter of fDSST (danelljan2017, section 4.1): the closed form of DSST on features compressed by a
/// projection that follows the template.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CompressedFilter {
    /// Regularisation λ, relative to the mean of B.
    lambda: f64,
    /// Standard deviation of the label in cells.
    label_sigma: f64,
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
    work: Option<Box<Work>>,
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
        Self {
            lambda,
            label_sigma,
            template: Vec::new(),
            compression: Compression::new(dimensions),
            numerator: Spectra::default(),
            denominator: Vec::new(),
            mean_power: 0.0,
            work: Some(Box::new(Work::new(grid, label_sigma))),
        }
    }
}

impl ResponseFilter for CompressedFilter {
    fn respond(&mut self, seen: Seen<'_>, response: &mut [f32]) {
        let lambda = (self.lambda as f32 * self.mean_power).max(f32::MIN_POSITIVE);
        let Some(work) = &mut self.work else { return };
        self.compression.apply(seen.features.as_slice(), seen.features.size(), &mut work.compressed);
        work.sum.fill(Complex32::default());
        for (plane, numerator) in work.compressed.planes().zip(self.numerator.0.chunks_exact(work.label.len())) {
            work.fft.forward(plane, &mut work.spectrum, &mut work.scratch);
            add_product(&mut work.sum, &work.spectrum, numerator);
        }
        work.sum.iter_mut().zip(&self.denominator).for_each(|(sum, b)| *sum /= b + lambda);
        work.fft.inverse(&work.sum, response, &mut work.scratch);
    }

    fn learn(&mut self, seen: Seen<'_>, rate: f64) {
        let Some(work) = &mut self.work else { return };
        let (features, size, bins) = (seen.features.as_slice(), seen.features.size(), work.label.len());
        let first = rate >= 1.0 || self.template.len() != features.len();
        let rate = if first { 1.0 } else { rate as f32 };
        self.template.resize(features.len(), 0.0);
        self.denominator.resize(bins, 0.0);
        self.numerator.0.resize(bins * self.compression.dimensions(), Complex32::default());
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

    /// The response between the cells is the trigonometric polynomial through them (danelljan2017, section 4.1).
    fn refine(&self, peak: ResponsePeak) -> ResponsePeak {
        let Some(work) = &self.work else { return peak };
        let (x, y) = (peak.dx.round(), peak.dy.round());
        let fine = newton_peak(&work.fft, &work.sum, x, y, NEWTON_STEPS);
        ResponsePeak { dx: fine.x, dy: fine.y, ..peak }
    }

    fn revive(&mut self, grid: Size, channels: usize) -> Result<(), String> {
        let work = Work::new(grid, self.label_sigma);
        let bins = work.label.len();
        let fits = self.compression.is_consistent()
            && channels == super::CHANNELS
            && self.template.len() == grid.area() * channels
            && self.numerator.0.len() == bins * self.compression.dimensions()
            && self.denominator.len() == bins;
        if !fits {
            return Err("its filter does not have the size of its template".into());
        }
        self.work = Some(Box::new(work));
        Ok(())
    }
}
