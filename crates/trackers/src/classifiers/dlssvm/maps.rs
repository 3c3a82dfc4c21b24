//! The explicit feature map (ning2016, section 3.3): maps of the canvas, quantised, each level a unary code of bits, so that the inner
//! product of two windows is the intersection kernel of their levels (maji2009).

use super::super::canvas::{Canvas, LANES, Place, Shape};
use super::DlssvmParams;
use multiversion::multiversion;
use pursuit_vision::features::ColorTable;
use pursuit_vision::sampling::Planes;

/// Bits of a pixel that a level takes.
const NIBBLE: usize = 4;

/// How windows are turned into features.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Grid {
    /// Cells across and down a window: one pixel of each is looked at.
    pub across: usize,
    pub down: usize,
    pub cell: usize,
    /// Maps, and bits of a level.
    pub maps: usize,
    pub bits: usize,
    /// The first pixel of a pattern on the canvas, in both directions: such that the middle window is one of its windows.
    phase: usize,
    /// Pixels of a pattern, and its windows, across and down.
    pub pixels: (usize, usize),
    pub windows: usize,
}

impl Grid {
    pub fn new(shape: &Shape, params: &DlssvmParams, colored: bool) -> Self {
        let (cell, size) = (params.cell_px, shape.size());
        let phase = shape.middle().x % cell;
        let pixels = |side: usize| (side - phase).div_ceil(cell);
        Self {
            across: shape.width / cell,
            down: shape.height / cell,
            cell,
            maps: if colored { 4 } else { 2 },
            bits: params.bits,
            phase,
            pixels: (pixels(size.width), pixels(size.height)),
            windows: (shape.windows() - phase).div_ceil(cell),
        }
    }

    /// Features of a window.
    pub const fn features(&self) -> usize {
        self.across * self.down * self.maps * self.bits
    }

    /// The window of a pattern nearest to one of the canvas, and back.
    pub fn window_at(&self, at: Place) -> Place {
        let inside = |v: usize| (v.saturating_sub(self.phase) / self.cell).min(self.windows - 1);
        Place { x: inside(at.x), y: inside(at.y) }
    }

    pub const fn on_canvas(&self, window: Place) -> Place {
        Place { x: self.phase + window.x * self.cell, y: self.phase + window.y * self.cell }
    }

    /// Whether a pixel's levels are such as the maps have.
    pub fn is_sound(&self, levels: u16) -> bool {
        let level = |map: usize| usize::from(levels >> (NIBBLE * map)) & 15;
        (0..4).all(|map| level(map) <= if map < self.maps { self.bits } else { 0 })
    }
}

/// The maps of a canvas as levels, one pixel's in 16 bits, and as planes of bits. Overwritten at every use.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Maps {
    levels: Vec<u16>,
    width: usize,
    /// Planes of bits, bit after bit and map after map, and what lanes beyond the last row may read.
    planes: Vec<f32>,
    colors: Planes,
    table: Option<ColorTable>,
    ranks: Ranks,
}

impl Maps {
    /// Quantises the canvas.
    pub fn look(&mut self, canvas: &Canvas, grid: &Grid, params: &DlssvmParams) {
        let (gray, width) = canvas.pixels();
        self.width = width;
        let level = |share: f32| ((share * (grid.bits + 1) as f32) as usize).min(grid.bits) as u16;
        let ranks = self.ranks.of(gray, width, params.rank_px);
        let most = 1.0 / ((2 * params.rank_px + 1).pow(2) - 1) as f32;
        self.levels.clear();
        let pixels = gray.iter().zip(ranks);
        self.levels.extend(pixels.map(|(v, r)| level(f32::from(*v) / 255.0) | level(f32::from(*r) * most) << NIBBLE));
        if let Some(colors) = canvas.colors().filter(|_| grid.maps == 4) {
            let table = self.table.get_or_insert_with(ColorTable::lab);
            self.colors.reshape(colors.size(), table.channels());
            table.extract(colors, 1, &mut self.colors, 0);
            // The table's colours are in parts of 110.
            let scale = 110.0 / (2.0 * params.color_span as f32);
            let [a, b] = [1, 2].map(|c| self.colors.plane(c));
            for ((levels, a), b) in self.levels.iter_mut().zip(a).zip(b) {
                let [a, b] = [a, b].map(|v| level((0.5 + scale * v).max(0.0)));
                *levels |= a << (2 * NIBBLE) | b << (3 * NIBBLE);
            }
        }
    }

    /// The levels at the pixels of a pattern.
    pub fn pattern(&self, grid: &Grid, out: &mut Vec<u16>) {
        out.clear();
        let rows = self.levels.chunks_exact(self.width).skip(grid.phase).step_by(grid.cell);
        rows.for_each(|row| out.extend(row.iter().skip(grid.phase).step_by(grid.cell)));
    }

    /// Makes the planes of the whole canvas.
    pub fn expand(&mut self, grid: &Grid) {
        expand(&self.levels, grid, &mut self.planes);
    }

    /// The sums of weighted bits of the windows of the canvas from `at` to the right.
    pub fn rate(&self, grid: &Grid, weights: &[f32], at: Place, out: &mut [f32; LANES]) {
        let plane = self.levels.len();
        add_bits(&self.planes, (plane, self.width), weights, grid, at.y * self.width + at.x, grid.cell, out);
    }
}

/// Planes of the bits of `levels`.
pub(super) fn expand(levels: &[u16], grid: &Grid, planes: &mut Vec<f32>) {
    planes.resize(grid.maps * grid.bits * levels.len() + LANES, 0.0);
    for (k, plane) in planes.chunks_exact_mut(levels.len()).take(grid.maps * grid.bits).enumerate() {
        let (shift, least) = (NIBBLE * (k / grid.bits), (k % grid.bits + 1) as u16);
        threshold(levels, shift as u32, least, plane);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn threshold(levels: &[u16], shift: u32, least: u16, out: &mut [f32]) {
    for (out, level) in out.iter_mut().zip(levels) {
        *out = if (level >> shift) & 15 >= least { 1.0 } else { 0.0 };
    }
}

/// The sums of weighted bits of the windows of a pattern from `at` to the right.
pub(super) fn rate_pattern(planes: &[f32], grid: &Grid, weights: &[f32], at: Place, out: &mut [f32; LANES]) {
    let (width, height) = grid.pixels;
    add_bits(planes, (width * height, width), weights, grid, at.y * width + at.x, 1, out);
}

/// The bits of a window of a pattern, by their definition.
pub(super) fn bits(levels: &[u16], grid: &Grid, at: Place, out: &mut Vec<f32>) {
    out.clear();
    for (map, bit) in (0..grid.maps).flat_map(|map| (1..=grid.bits as u16).map(move |bit| (map, bit))) {
        for y in at.y..at.y + grid.down {
            let row = &levels[y * grid.pixels.0 + at.x..][..grid.across];
            out.extend(row.iter().map(|l| if (l >> (NIBBLE * map)) & 15 >= bit { 1.0 } else { 0.0 }));
        }
    }
}

/// Correlates planes of bits with weights, at [`LANES`] windows side by side.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_bits(
    planes: &[f32],
    (area, stride): (usize, usize),
    weights: &[f32],
    grid: &Grid,
    first: usize,
    step: usize,
    out: &mut [f32; LANES],
) {
    let mut sums = [0.0f32; LANES];
    for (k, weights) in weights.chunks_exact(grid.across * grid.down).enumerate() {
        for (j, weights) in weights.chunks_exact(grid.across).enumerate() {
            let row = &planes[k * area + first + j * step * stride..];
            for (i, weight) in weights.iter().enumerate() {
                let lanes = &row[i * step..i * step + LANES];
                for l in 0..LANES {
                    sums[l] += weight * lanes[l];
                }
            }
        }
    }
    *out = sums;
}

/// The local rank transform (zabih1994): how many pixels about each are darker than it.
#[derive(Debug, Clone, Default)]
struct Ranks {
    padded: Vec<u8>,
    counts: Vec<u8>,
}

impl Ranks {
    /// In squares of half side `reach`, at most 7; beyond the border it is repeated.
    fn of(&mut self, gray: &[u8], width: usize, reach: usize) -> &[u8] {
        let Self { padded, counts } = self;
        let (rows, wide) = (gray.len() / width, width + 2 * reach);
        padded.clear();
        for y in 0..rows + 2 * reach {
            let row = &gray[y.saturating_sub(reach).min(rows - 1) * width..][..width];
            padded.extend(std::iter::repeat_n(row[0], reach));
            padded.extend_from_slice(row);
            padded.extend(std::iter::repeat_n(row[width - 1], reach));
        }
        counts.clear();
        counts.resize(gray.len(), 0);
        for ((y, counts), row) in counts.chunks_exact_mut(width).enumerate().zip(gray.chunks_exact(width)) {
            for dy in 0..=2 * reach {
                let around = &padded[(y + dy) * wide..][..wide];
                (0..=2 * reach).for_each(|dx| add_darker(&around[dx..dx + width], row, counts));
            }
        }
        counts
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_darker(around: &[u8], row: &[u8], counts: &mut [u8]) {
    for ((count, a), v) in counts.iter_mut().zip(around).zip(row) {
        *count += u8::from(a < v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_by_their_definition() {
        let (width, height, reach) = (13usize, 9usize, 2isize);
        let gray: Vec<u8> = (0..width * height).map(|k| (k * 67 % 101) as u8).collect();
        let mut ranks = Ranks::default();
        let got = ranks.of(&gray, width, reach as usize);
        let at = |x: isize, y: isize| {
            let (x, y) = (x.clamp(0, width as isize - 1) as usize, y.clamp(0, height as isize - 1) as usize);
            gray[y * width + x]
        };
        for (y, x) in (0..height as isize).flat_map(|y| (0..width as isize).map(move |x| (y, x))) {
            let about = (-reach..=reach).flat_map(|j| (-reach..=reach).map(move |i| (i, j)));
            let want = about.filter(|(i, j)| at(x + i, y + j) < at(x, y)).count();
            assert_eq!(usize::from(got[y as usize * width + x as usize]), want, "{x} {y}");
        }
    }

    #[test]
    fn products_of_bits_are_intersections_of_levels() {
        let shape = Shape { width: 8, height: 8, reach: 16 };
        let grid = Grid::new(&shape, &DlssvmParams::default(), true);
        let (wide, high) = grid.pixels;
        let levels: Vec<u16> = (0..wide * high)
            .map(|k| (0..4).fold(0, |all, map| all | ((k * (7 + map) / 3 % 5) as u16) << (4 * map)))
            .collect();
        let (a, b) = (Place { x: 3, y: 1 }, Place { x: 9, y: 6 });
        let [mut first, mut second] = [Vec::new(), Vec::new()];
        bits(&levels, &grid, a, &mut first);
        bits(&levels, &grid, b, &mut second);
        assert_eq!(first.len(), grid.features());
        let product: f32 = first.iter().zip(&second).map(|(a, b)| a * b).sum();
        let level = |p: Place, i: usize, j: usize, map: usize| levels[(p.y + j) * wide + p.x + i] >> (4 * map) & 15;
        let cells = (0..grid.down).flat_map(|j| (0..grid.across).map(move |i| (i, j)));
        let all = cells.flat_map(|(i, j)| (0..4).map(move |map| (i, j, map)));
        let want: u16 = all.map(|(i, j, map)| level(a, i, j, map).min(level(b, i, j, map))).sum();
        assert_eq!(product, f32::from(want));
        // The lanes are the same sums.
        let (mut planes, mut lanes) = (Vec::new(), [0.0; LANES]);
        expand(&levels, &grid, &mut planes);
        rate_pattern(&planes, &grid, &first, Place { x: 0, y: b.y }, &mut lanes);
        assert_eq!(lanes[b.x], product);
    }
}
