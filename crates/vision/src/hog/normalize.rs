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

/// What histograms are divided by; kept between calls as scratch.
///
/// For each cell and each of the four blocks of 2×2 cells around it (top left, top right, bottom left, bottom right) one
/// plane with one over the block's norm; the outermost blocks are repeated along the border.
#[derive(Debug, Clone, Default)]
pub(super) struct Norms {
    energies: Vec<f32>,
    /// One over the norm of each block, one row and column fewer than cells (but at least one).
    blocks: Vec<f32>,
    inverse: Vec<f32>,
}

impl Norms {
    /// Norms of the blocks of unsigned histograms: 18 `planes` of cells.
    pub(super) fn compute(&mut self, planes: &[f32], grid: Size) {
        self.energies.resize(grid.area(), 0.0);
        cell_energies(planes, &mut self.energies);
        let Size { width, height } = grid;
        let (across, down) = ((width - 1).max(1), (height - 1).max(1));
        self.blocks.resize(across * down, 0.0);
        for (y, blocks) in self.blocks.chunks_exact_mut(across).enumerate() {
            let row = |y: usize| &self.energies[y * width..(y + 1) * width];
            block_norms(row(y), row((y + 1).min(height - 1)), blocks);
        }
        self.inverse.resize(4 * grid.area(), 0.0);
        for (k, inverse) in self.inverse.chunks_exact_mut(grid.area()).enumerate() {
            for (y, line) in inverse.chunks_exact_mut(width).enumerate() {
                let y = (y + k / 2).saturating_sub(1).min(down - 1);
                let blocks = &self.blocks[y * across..(y + 1) * across];
                // The block to the left of the first cell is the first one, the block to the right of the last the last.
                let shift = usize::from(k.is_multiple_of(2) && width > 1);
                line[shift..shift + across].copy_from_slice(blocks);
                line[if shift == 1 { 0 } else { width - 1 }] = blocks[if shift == 1 { 0 } else { across - 1 }];
            }
        }
    }
}

/// One over the norms of the blocks between two rows of cells.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn block_norms(above: &[f32], below: &[f32], out: &mut [f32]) {
    let n = out.len();
    let right = usize::from(above.len() > n);
    let (a, b, c, d) = (&above[..n], &above[right..][..n], &below[..n], &below[right..][..n]);
    for x in 0..n {
        out[x] = 1.0 / (a[x] + b[x] + c[x] + d[x] + EPSILON).sqrt();
    }
}

/// Calls `visit(cell, block)` for the `k`-th block around each cell, moved inside the grid.
fn for_each_block(grid: Size, k: usize, mut visit: impl FnMut(usize, [usize; 4])) {
    let first = |at: usize, n: usize| at.saturating_sub(1).min(n.saturating_sub(2));
    for y in 0..grid.height {
        let top = first(y + k / 2, grid.height);
        let bottom = (top + 1).min(grid.height - 1);
        for x in 0..grid.width {
            let left = first(x + k % 2, grid.width);
            let right = (left + 1).min(grid.width - 1);
            let cells = [(top, left), (top, right), (bottom, left), (bottom, right)].map(|(y, x)| y * grid.width + x);
            visit(y * grid.width + x, cells);
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn cell_energies(planes: &[f32], energies: &mut [f32]) {
    let area = energies.len();
    energies.fill(0.0);
    for o in 0..UNSIGNED {
        let (there, back) = (&planes[o * area..][..area], &planes[(o + UNSIGNED) * area..][..area]);
        for ((energy, a), b) in energies.iter_mut().zip(there).zip(back) {
            *energy += (a + b) * (a + b);
        }
    }
}

/// 18 signed, 9 unsigned, 4 texture channels, 31 planes of `out`.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn felzenszwalb(planes: &[f32], norms: &Norms, out: &mut Planes) {
    let area = out.size().area();
    let norm = |k: usize| &norms.inverse[k * area..][..area];
    let (n0, n1, n2, n3) = (norm(0), norm(1), norm(2), norm(3));
    let (features, texture) = out.as_mut_slice().split_at_mut((SIGNED + UNSIGNED) * area);
    texture.fill(0.0);
    let (t0, rest) = texture.split_at_mut(area);
    let (t1, rest) = rest.split_at_mut(area);
    let (t2, t3) = rest.split_at_mut(area);
    let t3 = &mut t3[..area];
    for o in 0..SIGNED {
        let (histogram, feature) = (&planes[o * area..][..area], &mut features[o * area..][..area]);
        for i in 0..area {
            let h = histogram[i];
            let (a, b, c, d) =
                ((h * n0[i]).min(CLIP), (h * n1[i]).min(CLIP), (h * n2[i]).min(CLIP), (h * n3[i]).min(CLIP));
            feature[i] = 0.5 * ((a + b) + (c + d));
            t0[i] += TEXTURE * a;
            t1[i] += TEXTURE * b;
            t2[i] += TEXTURE * c;
            t3[i] += TEXTURE * d;
        }
    }
    for o in 0..UNSIGNED {
        let (there, back) = (&planes[o * area..][..area], &planes[(o + UNSIGNED) * area..][..area]);
        let feature = &mut features[(SIGNED + o) * area..][..area];
        for i in 0..area {
            let h = there[i] + back[i];
            let (a, b, c, d) =
                ((h * n0[i]).min(CLIP), (h * n1[i]).min(CLIP), (h * n2[i]).min(CLIP), (h * n3[i]).min(CLIP));
            feature[i] = 0.5 * ((a + b) + (c + d));
        }
    }
}

/// 4 blocks × 9 unsigned channels: clipped, then normalised again within the block (L2-Hys).
pub(super) fn dalal(planes: &[f32], norms: &Norms, out: &mut Planes) {
    let grid = out.size();
    let area = grid.area();
    let unsigned = |cell: usize, o: usize| planes[o * area + cell] + planes[(o + UNSIGNED) * area + cell];
    for (k, block) in out.as_mut_slice().chunks_exact_mut(UNSIGNED * area).enumerate() {
        for_each_block(grid, k, |at, cells| {
            let norm = norms.inverse[k * area + at];
            let clipped = |cell: usize, o: usize| (unsigned(cell, o) * norm).min(CLIP);
            let energy: f32 = cells.iter().flat_map(|&c| (0..UNSIGNED).map(move |o| clipped(c, o).powi(2))).sum();
            let again = 1.0 / (energy + EPSILON).sqrt();
            (0..UNSIGNED).for_each(|o| block[o * area + at] = clipped(at, o) * again);
        });
    }
}
