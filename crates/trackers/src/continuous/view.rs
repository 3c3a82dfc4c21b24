//! What is seen of a window: gradients and colours on grids of their own cells, as functions of the continuous place.

use super::blocks::{Block, channels_mut};
use super::coefficients::{count, order_of};
use super::interpolation::interpolation;
use super::params::{CompressionModel, ContinuousParams};
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use pursuit_vision::features::{ColorTable, IntensityHistogram};
use pursuit_vision::fourier::{Complex32, FftScratch, HannEnds, RealFft2, hann_plane};
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};

/// Channels of oriented gradients.
const GRADIENTS: usize = 31;
/// Bins of brightness, which stand for the names of colours in grey frames.
const BRIGHTNESS: usize = 8;
/// Colour names.
const NAMES: usize = 11;

/// The blocks of features of a square patch of `side` pixels, before they are compressed.
pub(super) fn raw_blocks(params: &ContinuousParams, names: bool, side: usize) -> [Block; 2] {
    let order = |cell_px: usize| order_of(side / cell_px.max(1));
    [
        Block { channels: GRADIENTS, order: order(params.window.cell_px) },
        Block { channels: if names { NAMES } else { BRIGHTNESS }, order: order(params.window.color_cell_px) },
    ]
}

/// The blocks of a sample: once they are compressed, where they are.
pub(super) fn sample_blocks(params: &ContinuousParams, names: bool, side: usize) -> [Block; 2] {
    let [gradients, colors] = raw_blocks(params, names, side);
    let compression = &params.compression;
    match compression.model {
        CompressionModel::None => [gradients, colors],
        CompressionModel::Learned => [
            Block { channels: compression.gradient_channels.min(gradients.channels), ..gradients },
            Block { channels: compression.color_channels.min(colors.channels), ..colors },
        ],
    }
}

/// Takes samples; scratch, not state.
#[derive(Debug, Clone)]
pub(super) struct View {
    sampler: Sampler,
    hog: Hog,
    names: Option<ColorTable>,
    brightness: IntensityHistogram,
    patch: Planes,
    /// Gradients, then colours; each with a mean square of one.
    features: [Planes; 2],
    grids: [Grid; 2],
    fft: FftScratch,
}

/// From a plane of cells to Fourier coefficients.
#[derive(Debug, Clone)]
struct Grid {
    plan: RealFft2,
    hann: Vec<f32>,
    /// Bin and factor of each coefficient.
    factors: Vec<(usize, Complex32)>,
    plane: Vec<f32>,
    bins: Vec<Complex32>,
}

impl Grid {
    fn new(spline: f64, n: usize, at: &[(usize, isize)]) -> Self {
        let plan = RealFft2::new(n, n);
        let place = |&(u, v): &(usize, isize)| u * n + v.rem_euclid(n as isize) as usize;
        let factors = interpolation(spline, n, at);
        Self {
            hann: hann_plane(n, n, HannEnds::Positive),
            factors: at.iter().map(place).zip(factors).collect(),
            plane: vec![0.0; n * n],
            bins: vec![Complex32::default(); plan.spectrum_len()],
            plan,
        }
    }

    /// The coefficients of `self.plane`.
    fn transform(&mut self, fft: &mut FftScratch, out: &mut [Complex32]) {
        weigh(&mut self.plane, &self.hann);
        self.plan.forward(&self.plane, &mut self.bins, fft);
        for (out, (bin, factor)) in out.iter_mut().zip(&self.factors) {
            *out = self.bins[*bin] * factor;
        }
    }
}

impl View {
    /// For square patches of `side` pixels; `at` are the frequencies of the coefficients.
    pub(super) fn new(params: &ContinuousParams, names: bool, side: usize, at: &[(usize, isize)]) -> Self {
        let cells = [params.window.cell_px, params.window.color_cell_px];
        let grid = |cell_px: usize| {
            let n = side / cell_px.max(1);
            Grid::new(params.spline, n, &at[..count(order_of(n)).min(at.len())])
        };
        Self {
            sampler: Sampler::new(),
            hog: Hog::new(HogLayout::Felzenszwalb31, cells[0]),
            names: names.then(ColorTable::color_names),
            brightness: IntensityHistogram { bins: BRIGHTNESS, cell_px: cells[1] },
            patch: Planes::default(),
            features: Default::default(),
            grids: cells.map(grid),
            fft: FftScratch::default(),
        }
    }

    /// Gradients of the window looked at last.
    pub(super) const fn gradients(&self) -> &Planes {
        &self.features[0]
    }

    /// The features of the window looked at last.
    pub(super) const fn features(&self) -> &[Planes; 2] {
        &self.features
    }

    /// Looks at a window.
    pub(super) fn look(&mut self, frame: &Frame, window: &Window) {
        let Self { sampler, hog, names, brightness, patch, features: [gradients, colors], grids, .. } = self;
        if names.is_some() {
            sampler.color(frame.color(), window, patch);
        } else {
            sampler.gray(frame.gray(), window, patch);
        }
        hog.extract(patch, gradients);
        let Size { width, height } = grids[1].plan.size();
        match names {
            Some(names) => {
                colors.reshape(Size::new(width, height), NAMES);
                names.extract(patch, brightness.cell_px, colors, 0);
            }
            None => {
                colors.reshape(Size::new(width, height), BRIGHTNESS);
                brightness.extract(patch, colors, 0);
            }
        }
        // danelljan2017eco, released code: features of one kind have the same energy in every sample.
        for planes in [gradients, colors] {
            let energy: f32 = planes.as_slice().iter().map(|v| v * v).sum();
            let scale = if energy > 0.0 { (planes.as_slice().len() as f32 / energy).sqrt() } else { 0.0 };
            planes.as_mut_slice().iter_mut().for_each(|v| *v *= scale);
        }
    }

    /// Coefficients of all features of the window looked at last.
    pub(super) fn raw(&mut self, blocks: &[Block], out: &mut [Complex32]) {
        let mut channels = channels_mut(blocks, out);
        for (planes, grid) in self.features.iter().zip(&mut self.grids) {
            for (plane, out) in planes.planes().zip(&mut channels) {
                grid.plane.copy_from_slice(plane);
                grid.transform(&mut self.fft, out);
            }
        }
    }

    /// Coefficients of the features of the window looked at last, compressed by `matrix`, which is empty where they are not.
    pub(super) fn sample(&mut self, blocks: &[Block], matrix: &[f32], out: &mut [Complex32]) {
        if matrix.is_empty() {
            return self.raw(blocks, out);
        }
        let (mut rows, mut out) = (matrix, out);
        for ((planes, grid), block) in self.features.iter().zip(&mut self.grids).zip(blocks) {
            let (own, rest) = rows.split_at(planes.channels() * block.channels);
            let (sample, out_rest) = out.split_at_mut(block.len());
            for (row, out) in own.chunks_exact(planes.channels()).zip(sample.chunks_exact_mut(block.each())) {
                grid.plane.fill(0.0);
                for (weight, plane) in row.iter().zip(planes.planes()) {
                    add_plane(&mut grid.plane, plane, *weight);
                }
                grid.transform(&mut self.fft, out);
            }
            (rows, out) = (rest, out_rest);
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn weigh(plane: &mut [f32], weights: &[f32]) {
    plane.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn add_plane(sum: &mut [f32], plane: &[f32], weight: f32) {
    sum.iter_mut().zip(plane).for_each(|(s, v)| *s += weight * v);
}
