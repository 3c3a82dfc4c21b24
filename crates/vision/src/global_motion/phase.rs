use super::vote::{self, Shift, elect};
use crate::VisionError;
use crate::error::require_size;
use crate::flow::Pyramid;
use crate::fourier::{
    Complex32, FftScratch, RealFft2, good_size, highest, parabola_peak, sidelobe_ratio, signed_shift,
};
use pursuit_geometry::Size;
use pursuit_imaging::ImageView;

/// A shift of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseShift {
    /// How far the picture moved to the right, pixels of the frame.
    pub dx: f64,
    /// How far the picture moved down, pixels of the frame.
    pub dy: f64,
    /// Height of the peak: 1 for a pure shift without noise, towards 0 where nothing agrees.
    pub peak: f64,
    /// How many standard deviations the peak stands above the rest of the plane.
    pub peak_to_sidelobe: f64,
}

/// Estimates the shift of the picture by phase correlation (Kuglin and Hines 1975) on a small level of the frames'
/// pyramids; owns plans and scratch.
///
/// The normalised cross-power spectrum is weighted with a Gaussian, so that the peak is a Gaussian about a cell wide
/// whose top lies between cells. An object that moves by itself has its own peak, which may be the higher one, for its
/// outline moves with it: blocks of the picture vote among the highest peaks, and the shift that most of the picture made
/// is the one told.
#[derive(Debug, Clone)]
pub struct PhaseCorrelation {
    longest_side: usize,
    work: Option<Work>,
}

/// What depends on the size of the level.
#[derive(Debug, Clone)]
struct Work {
    plan: RealFft2,
    across: Vec<f32>,
    down: Vec<f32>,
    /// Energy of the noise in a bin.
    noise: f32,
    /// Weight of every bin.
    weights: Vec<f32>,
    plane: Vec<f32>,
    /// The plane less the peaks already taken.
    rest: Vec<f32>,
    spectra: [Vec<Complex32>; 2],
    scratch: FftScratch,
}

/// Standard deviation of the peak, cells.
const PEAK_SIGMA: f64 = 0.75;
/// Cells that two peaks are apart at least: nearer ones belong to one motion.
const APART: usize = 2;
/// Peaks lower than this, relative to the highest, do not stand for election.
const LEAST_PEAK: f32 = 0.2;
/// Cells about the peak that do not belong to the sidelobe.
const SIDELOBE: usize = 5;

impl PhaseCorrelation {
    /// An estimator that works on the largest level whose sides are not above `longest_side` pixels (at least 32);
    /// 160 is a good value for a camera's shake.
    pub fn new(longest_side: usize) -> Self {
        Self { longest_side: longest_side.max(32), work: None }
    }

    /// The shift from the frame of `from` to that of `to`; `None` when either is a plane of one value.
    ///
    /// # Errors
    /// When the two frames are not equally large.
    pub fn estimate(&mut self, from: &Pyramid, to: &Pyramid) -> Result<Option<PhaseShift>, VisionError> {
        require_size("the second frame", to.size(), from.size())?;
        let fits = |v: &ImageView<'_, u8>| v.width().max(v.height()) <= self.longest_side;
        let last = from.levels().min(to.levels()).saturating_sub(1);
        let l = (0..last).find(|&l| from.level(l).as_ref().is_some_and(fits)).unwrap_or(last);
        let (Some(first), Some(second)) = (from.level(l), to.level(l)) else { return Ok(None) };
        let shift = self.work_for(first.size()).shift(first, second);
        let factor = (1usize << l) as f64;
        Ok(shift.map(|s| PhaseShift { dx: s.dx * factor, dy: s.dy * factor, ..s }))
    }

    fn work_for(&mut self, size: Size) -> &mut Work {
        let size = Size::new(largest_good(size.width), largest_good(size.height));
        let stale = self.work.as_ref().is_none_or(|w| w.plan.size() != size);
        if stale {
            self.work = None;
        }
        self.work.get_or_insert_with(|| Work::new(size))
    }
}

/// A window that is 1 but for raised cosines over an eighth of the length at either end (Tukey's): the picture must not
/// wrap around, but unlike under Hann's window what moves in its middle counts no more than the rest.
fn tapered(n: usize) -> Vec<f32> {
    let taper = (n / 8).max(1);
    let value = |i: usize| {
        let from_end = i.min(n - 1 - i);
        let phase = std::f64::consts::PI * (from_end as f64 + 0.5) / taper as f64;
        if from_end >= taper { 1.0 } else { (0.5 * (1.0 - phase.cos())) as f32 }
    };
    (0..n).map(value).collect()
}

/// The largest length at most `n` whose transform is fast.
fn largest_good(n: usize) -> usize {
    (1..=n).rev().find(|&m| good_size(m) == m).unwrap_or(1)
}

impl Work {
    fn new(size: Size) -> Self {
        let plan = RealFft2::new(size.width, size.height);
        let weight = |k: usize, n: usize| {
            // The transform of a Gaussian of standard deviation σ at k/n cycles per cell.
            let cycles = k.min(n - k) as f64 / n as f64;
            (-2.0 * (std::f64::consts::PI * PEAK_SIGMA * cycles).powi(2)).exp()
        };
        let mut weights: Vec<f32> = (0..plan.columns())
            .flat_map(|u| (0..size.height).map(move |v| (u, v)))
            .map(|(u, v)| (weight(u, size.width) * weight(v, size.height)) as f32)
            .collect();
        // The mean of the picture says nothing of its motion.
        weights[0] = 0.0;
        // Noise of a code a pixel has this energy in every bin.
        let energy = |window: &[f32]| window.iter().map(|w| w * w).sum::<f32>();
        let (across, down) = (tapered(size.width), tapered(size.height));
        let spectrum = vec![Complex32::default(); plan.spectrum_len()];
        Self {
            noise: energy(&across) * energy(&down),
            across,
            down,
            weights,
            plane: vec![0.0; size.area()],
            rest: vec![0.0; size.area()],
            spectra: [spectrum.clone(), spectrum],
            scratch: FftScratch::default(),
            plan,
        }
    }

    fn shift(&mut self, first: ImageView<'_, u8>, second: ImageView<'_, u8>) -> Option<PhaseShift> {
        for (image, spectrum) in [first, second].into_iter().zip(&mut self.spectra) {
            windowed(image, &self.across, &self.down, &mut self.plane);
            self.plan.forward(&self.plane, spectrum, &mut self.scratch);
        }
        let [a, b] = &mut self.spectra;
        let strongest = a.iter().chain(b.iter()).map(Complex32::norm_sqr).fold(0.0, f32::max);
        if strongest <= 1e-6 {
            return None;
        }
        let mut total = 0.0;
        for (i, ((a, b), weight)) in a.iter_mut().zip(b.iter()).zip(&self.weights).enumerate() {
            let cross = a.conj() * b;
            // Bins in which noise is all there is have no phase to tell.
            let factor = weight / (cross.norm() + self.noise);
            total += cross.norm() * factor * self.plan.multiplicity(i / self.down.len()) as f32;
            *a = cross * factor;
        }
        self.plan.inverse(a, &mut self.plane, &mut self.scratch);
        let Size { width, height } = self.plan.size();
        let (x, y) = self.elected(first, second);
        let peak = parabola_peak(&self.plane, width, x, y);
        let signed = |v: f64, n: usize| if 2.0 * v >= n as f64 { v - n as f64 } else { v };
        let peak_to_sidelobe = sidelobe_ratio(&self.plane, width, (x, y), SIDELOBE);
        // All bins in phase make a peak of 1.
        let value = peak.value * self.plane.len() as f64 / f64::from(total);
        Some(PhaseShift { dx: signed(peak.x, width), dy: signed(peak.y, height), peak: value, peak_to_sidelobe })
    }

    /// The cell of that peak of the plane for which most blocks of the picture vote.
    fn elected(&mut self, first: ImageView<'_, u8>, second: ImageView<'_, u8>) -> (usize, usize) {
        let Size { width, height } = self.plan.size();
        let (mut cells, mut shifts) = ([(0, 0); vote::MOST], [Shift::default(); vote::MOST]);
        let mut known = 0;
        self.rest.copy_from_slice(&self.plane);
        let (_, _, top) = highest(&self.plane, width);
        while known < vote::MOST {
            let (x, y, value) = highest(&self.rest, width);
            if value < LEAST_PEAK * top || value <= 0.0 {
                break;
            }
            if is_peak(&self.plane, width, (x, y)) {
                cells[known] = (x, y);
                shifts[known] = (signed_shift(x, width), signed_shift(y, height));
                known += 1;
            }
            for (x, y) in around((x, y), APART, self.plan.size()) {
                self.rest[y * width + x] = f32::NEG_INFINITY;
            }
        }
        cells[elect(first, second, &shifts[..known])]
    }
}

/// The cells at most `far` columns and rows away from one, in a plane that wraps around.
fn around((x, y): (usize, usize), far: usize, size: Size) -> impl Iterator<Item = (usize, usize)> {
    let rows = (0..=2 * far).map(move |j| (y + j + far * (size.height - 1)) % size.height);
    rows.flat_map(move |y| (0..=2 * far).map(move |i| ((x + i + far * (size.width - 1)) % size.width, y)))
}

/// Whether no neighbour of the cell is higher.
fn is_peak(plane: &[f32], width: usize, (x, y): (usize, usize)) -> bool {
    let size = Size::new(width, plane.len() / width);
    around((x, y), 1, size).all(|(i, j)| plane[j * width + i] <= plane[y * width + x])
}

/// The middle of `image` less its mean, under the window.
fn windowed(image: ImageView<'_, u8>, across: &[f32], down: &[f32], plane: &mut [f32]) {
    let (left, top) = ((image.width() - across.len()) / 2, (image.height() - down.len()) / 2);
    let rows = || (0..down.len()).map(|y| &image.row(top + y)[left..left + across.len()]);
    let sum: u64 = rows().flatten().map(|&v| u64::from(v)).sum();
    let mean = sum as f32 / plane.len() as f32;
    for ((row, out), down) in rows().zip(plane.chunks_exact_mut(across.len())).zip(down) {
        for ((v, out), across) in row.iter().zip(out).zip(across) {
            *out = (f32::from(*v) - mean) * across * down;
        }
    }
}
