use super::cells::Histogram;
use super::{SIGNED, UNSIGNED};
use crate::sampling::Planes;
use multiversion::multiversion;
use pursuit_geometry::Size;

/// Added to a block's energy; gradients count in grey levels (felzenszwalb2010, released code).
const EPSILON: f32 = 1e-4;
/// Where normalised histograms are clipped (α, felzenszwalb2010, section 6.2; dalal2005, L2-Hys).
const CLIP: f32 = 0.2;
/// Weight of the texture channels: 1/√18 (felzenszwalb2010, released code: 0.2357).
const TEXTURE: f32 = 0.235_702_26;

/// The energies and norms that histograms are divided by; kept between calls as scratch.
///
/// Block norms stand on a `(width + 1) × (height + 1)` grid: the block right of and below cell (i, j) at row i + 1, column
/// j + 1. The outermost blocks are repeated along the border.
#[derive(Debug, Clone, Default)]
pub(super) struct Norms {
    energies: Vec<f32>,
    /// One over the L2 norm of each block.
    inverse: Vec<f32>,
    /// One over the L2 norm of each block after normalising and clipping.
    inverse_clipped: Vec<f32>,
}

impl Norms {
    /// Norms of the blocks of unsigned histograms.
    pub(super) fn compute(&mut self, cells: &[Histogram], grid: Size) {
        self.energies.clear();
        self.energies.extend(cells.iter().map(|h| unsigned(h).map(|v| v * v).iter().sum::<f32>()));
        self.inverse.clear();
        for y in 0..=grid.height {
            for x in 0..=grid.width {
                let energy: f32 = block(y, x, grid).iter().map(|&cell| self.energies[cell]).sum();
                self.inverse.push(1.0 / (energy + EPSILON).sqrt());
            }
        }
    }

    /// Norms after clipping, from the norms before.
    fn compute_clipped(&mut self, cells: &[Histogram], grid: Size) {
        self.inverse_clipped.clear();
        for y in 0..=grid.height {
            for x in 0..=grid.width {
                let norm = self.inverse[y * (grid.width + 1) + x];
                let clipped_energy =
                    |&cell: &usize| unsigned(&cells[cell]).map(|v| (v * norm).min(CLIP).powi(2)).iter().sum::<f32>();
                let energy: f32 = block(y, x, grid).iter().map(clipped_energy).sum();
                self.inverse_clipped.push(1.0 / (energy + EPSILON).sqrt());
            }
        }
    }
}

/// The histogram without regard to sign.
#[inline(always)]
fn unsigned(histogram: &Histogram) -> [f32; UNSIGNED] {
    std::array::from_fn(|o| histogram[o] + histogram[o + UNSIGNED])
}

/// The four cells of the block whose lower right cell is (y, x), moved inside the grid.
#[inline(always)]
fn block(y: usize, x: usize, grid: Size) -> [usize; 4] {
    let first = |k: usize, n: usize| k.saturating_sub(1).min(n.saturating_sub(2));
    let (top, left) = (first(y, grid.height), first(x, grid.width));
    let (bottom, right) = ((top + 1).min(grid.height - 1), (left + 1).min(grid.width - 1));
    [(top, left), (top, right), (bottom, left), (bottom, right)].map(|(y, x)| y * grid.width + x)
}

/// The four blocks around cell (y, x): top left, top right, bottom left, bottom right.
#[inline(always)]
fn around(inverse_norms: &[f32], stride: usize, y: usize, x: usize) -> [f32; 4] {
    let (top, bottom) = (y * stride + x, (y + 1) * stride + x);
    [inverse_norms[top], inverse_norms[top + 1], inverse_norms[bottom], inverse_norms[bottom + 1]]
}

/// 18 signed, 9 unsigned, 4 texture channels.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn felzenszwalb(cells: &[Histogram], norms: &Norms, out: &mut Planes) {
    let Size { width, height } = out.size();
    let area = width * height;
    let values = out.as_mut_slice();
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            let norms = around(&norms.inverse, width + 1, y, x);
            let mut histogram = [0.0_f32; 27];
            histogram[..SIGNED].copy_from_slice(&cells[at][..SIGNED]);
            for o in 0..UNSIGNED {
                histogram[SIGNED + o] = histogram[o] + histogram[o + UNSIGNED];
            }
            let mut features = [0.0_f32; 31];
            for (k, norm) in norms.into_iter().enumerate() {
                let mut texture = 0.0;
                for o in 0..27 {
                    let clipped = (histogram[o] * norm).min(CLIP);
                    features[o] += 0.5 * clipped;
                    texture += if o < SIGNED { clipped } else { 0.0 };
                }
                features[27 + k] = TEXTURE * texture;
            }
            for (feature, plane) in features.iter().zip(values.chunks_exact_mut(area)) {
                plane[at] = *feature;
            }
        }
    }
}

/// 4 blocks × 9 unsigned channels: clipped, then normalised again within the block (L2-Hys).
pub(super) fn dalal(cells: &[Histogram], norms: &mut Norms, out: &mut Planes) {
    let grid = out.size();
    norms.compute_clipped(cells, grid);
    let values = out.as_mut_slice();
    for y in 0..grid.height {
        for x in 0..grid.width {
            let at = y * grid.width + x;
            let histogram = unsigned(&cells[at]);
            let first = around(&norms.inverse, grid.width + 1, y, x);
            let second = around(&norms.inverse_clipped, grid.width + 1, y, x);
            for k in 0..4 {
                for o in 0..UNSIGNED {
                    values[(k * UNSIGNED + o) * grid.area() + at] = (histogram[o] * first[k]).min(CLIP) * second[k];
                }
            }
        }
    }
}
