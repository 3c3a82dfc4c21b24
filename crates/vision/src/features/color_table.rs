use super::{ColorTerm, srgb_to_lab};
use crate::sampling::Planes;
use multiversion::multiversion;
use pursuit_geometry::Size;
use std::sync::{Arc, LazyLock};

/// Bits kept of each of red, green and blue.
const BITS: usize = 5;
/// Table entries are padded to this many codes, so that adding them up is one vector operation.
const LANES: usize = 16;

/// Channels computed from a pixel's colour alone, by a table over 15-bit colour, averaged over cells.
///
/// Cloning shares the table (half a megabyte).
#[derive(Debug, Clone)]
pub struct ColorTable {
    codes: Arc<[[u8; LANES]]>,
    /// What code 0 and one code stand for, per channel.
    scales: Arc<[(f32, f32)]>,
}

impl ColorTable {
    /// The probabilities of the eleven basic colour terms, less the mean 1/11; see [`ColorTerm`].
    ///
    /// A constant: computed once, every copy shares it.
    pub fn color_names() -> Self {
        static NAMES: LazyLock<ColorTable> = LazyLock::new(|| {
            ColorTable::new([(-1.0 / 11.0, 1.0); 11], |rgb| ColorTerm::probabilities(rgb).map(|p| p - 1.0 / 11.0))
        });
        NAMES.clone()
    }

    /// L*, a*, b*: `L*/100 − ½`, `a*/110`, `b*/110`.
    pub fn lab() -> Self {
        Self::new([(-0.5, 1.0), (-1.0, 2.0), (-1.0, 2.0)], |rgb| {
            let [l, a, b] = srgb_to_lab(rgb);
            [l / 100.0 - 0.5, a / 110.0, b / 110.0]
        })
    }

    /// Value less ½, and saturation as a vector that points towards the hue: `V − ½`, `S cos H`, `S sin H`.
    pub fn hsv() -> Self {
        Self::new([(-0.5, 1.0), (-1.0, 2.0), (-1.0, 2.0)], |rgb| {
            let [h, s, v] = crate::color::rgb_to_hsv(rgb);
            let (hue, saturation) = (f64::from(h).to_radians() * 2.0, f64::from(s) / 255.0);
            [f64::from(v) / 255.0 - 0.5, saturation * hue.cos(), saturation * hue.sin()]
        })
    }

    /// `ranges`: least value and span of each channel; `channels` of the colour in the middle of each table cell.
    fn new<const N: usize>(ranges: [(f64, f64); N], channels: impl Fn([u8; 3]) -> [f64; N]) -> Self {
        const { assert!(N <= LANES) };
        // The middle of the cell, widened so that the first and last cell stand for 0 and 255.
        let level = |code: usize| (code * 255 / ((1 << BITS) - 1)) as u8;
        let mask = (1 << BITS) - 1;
        let entry = |index: usize| {
            let rgb = [level(index >> (2 * BITS)), level((index >> BITS) & mask), level(index & mask)];
            let mut codes = [0; LANES];
            for (code, (value, (least, span))) in codes.iter_mut().zip(channels(rgb).into_iter().zip(ranges)) {
                *code = ((value - least) / span * 255.0).round().clamp(0.0, 255.0) as u8;
            }
            codes
        };
        Self {
            codes: (0..1 << (3 * BITS)).map(entry).collect(),
            scales: ranges.iter().map(|&(least, span)| (least as f32, (span / 255.0) as f32)).collect(),
        }
    }

    /// The number of channels.
    pub fn channels(&self) -> usize {
        self.scales.len()
    }

    /// Means of the channels over cells of `cell_px` pixels of a colour patch (3 planes, 0–255; of a grey patch, its only
    /// plane counts three times). Writes the planes `first..first + channels` of `out`, which must have the grid's size.
    pub fn extract(&self, patch: &Planes, cell_px: usize, out: &mut Planes, first: usize) {
        let (Size { width, .. }, grid) = (patch.size(), out.size());
        let plane = |c: usize| patch.plane(c.min(patch.channels() - 1));
        let share = 1.0 / (cell_px * cell_px) as f32;
        let at_once = (RUN / cell_px).clamp(1, CELLS);
        let mut sums = [[0; LANES]; CELLS];
        for cy in 0..grid.height {
            for left in (0..grid.width).step_by(at_once) {
                let right = (left + at_once).min(grid.width);
                let sums = &mut sums[..right - left];
                sums.fill([0; LANES]);
                for y in cy * cell_px..(cy + 1) * cell_px {
                    let line = y * width + left * cell_px..y * width + right * cell_px;
                    add_codes(&self.codes, [0, 1, 2].map(|c| &plane(c)[line.clone()]), cell_px, sums);
                }
                for (c, (least, step)) in self.scales.iter().enumerate() {
                    let line = &mut out.plane_mut(first + c)[cy * grid.width + left..cy * grid.width + right];
                    line.iter_mut().zip(&*sums).for_each(|(out, sum)| *out = least + step * share * sum[c] as f32);
                }
            }
        }
    }
}

/// Cells worked on at once.
const CELLS: usize = 32;
/// Pixels looked up at once: 256 codes of at most 255 add up to what 16 bits hold.
const RUN: usize = 256;

/// Adds the codes of a line of pixels to the sums of their cells.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_codes(codes: &[[u8; LANES]], [red, green, blue]: [&[f32]; 3], cell_px: usize, sums: &mut [[u32; LANES]]) {
    let mut indices = [0_u16; RUN];
    let pieces = red.chunks(RUN).zip(green.chunks(RUN)).zip(blue.chunks(RUN));
    for ((red, green), blue) in pieces {
        for (index, ((&r, &g), &b)) in indices.iter_mut().zip(red.iter().zip(green).zip(blue)) {
            // Whole numbers end up in the low bits of a float of 2²³ and more: unlike a cast, that runs on vectors.
            let code = |v: f32| {
                let whole = (v + 0.5).clamp(0.0, 255.0).floor();
                ((whole + 8_388_608.0).to_bits() as u16 & 0xff) >> (8 - BITS)
            };
            *index = (code(r) << (2 * BITS)) | (code(g) << BITS) | code(b);
        }
        // A cell wider than a run is alone in its line, and its runs are parts of it.
        let runs = indices[..red.len()].chunks(cell_px.min(RUN));
        for (k, run) in runs.enumerate() {
            let mut sum = [0_u16; LANES];
            for &index in run {
                let codes = codes.get(usize::from(index)).unwrap_or(&[0; LANES]);
                sum.iter_mut().zip(codes).for_each(|(sum, code)| *sum += u16::from(*code));
            }
            let total = &mut sums[if cell_px > RUN { 0 } else { k }];
            total.iter_mut().zip(sum).for_each(|(total, sum)| *total += u32::from(sum));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(rgb: [u8; 3]) -> Planes {
        let mut patch = Planes::new(Size::new(9, 5), 3);
        patch.planes_mut().zip(rgb).for_each(|(plane, v)| plane.fill(f32::from(v)));
        patch
    }

    #[test]
    fn flat_patches_give_the_channels_of_their_color() {
        for rgb in [[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 0, 255], [0, 255, 255]] {
            let lab = srgb_to_lab(rgb);
            let names = ColorTerm::probabilities(rgb).map(|p| p - 1.0 / 11.0);
            let want_lab = [lab[0] / 100.0 - 0.5, lab[1] / 110.0, lab[2] / 110.0];
            let mut out = Planes::new(Size::new(4, 2), 14);
            ColorTable::lab().extract(&flat(rgb), 2, &mut out, 0);
            ColorTable::color_names().extract(&flat(rgb), 2, &mut out, 3);
            for (plane, want) in out.planes().zip(want_lab.into_iter().chain(names)) {
                assert!(plane.iter().all(|v| (f64::from(*v) - want).abs() < 0.005), "{rgb:?}: {plane:?}, {want}");
            }
        }
    }

    #[test]
    fn cells_equal_the_mean_of_their_pixels() {
        for (cell_px, grid) in
            [(1, Size::new(70, 2)), (3, Size::new(100, 2)), (5, Size::new(4, 3)), (300, Size::new(2, 1))]
        {
            let size = Size::new(grid.width * cell_px + 1, grid.height * cell_px + 1);
            let mut patch = Planes::new(size, 3);
            for (c, plane) in patch.planes_mut().enumerate() {
                plane.iter_mut().enumerate().for_each(|(i, v)| *v = ((i * (31 + 12 * c) + i / 7) % 256) as f32);
            }
            let table = ColorTable::lab();
            let mut out = Planes::new(grid, table.channels() + 1);
            table.extract(&patch, cell_px, &mut out, 1);
            for (at, c) in (0..grid.area()).flat_map(|at| (0..table.channels()).map(move |c| (at, c))) {
                let (left, top) = (at % grid.width * cell_px, at / grid.width * cell_px);
                let cells = (0..cell_px * cell_px).map(|k| (top + k / cell_px) * size.width + left + k % cell_px);
                let code = |i: usize| {
                    let [r, g, b] = [0, 1, 2].map(|c| patch.plane(c)[i] as usize >> (8 - BITS));
                    f64::from(table.codes[(r << (2 * BITS)) | (g << BITS) | b][c])
                };
                let (least, step) = table.scales[c];
                let mean = cells.map(code).sum::<f64>() / (cell_px * cell_px) as f64;
                let want = f64::from(least) + f64::from(step) * mean;
                assert!((f64::from(out.plane(1 + c)[at]) - want).abs() < 1e-5, "{cell_px}: {at} {c}");
            }
        }
    }

    #[test]
    fn cells_are_averaged_and_grey_stays_grey() {
        let mut patch = Planes::new(Size::new(4, 2), 1);
        patch.as_mut_slice().copy_from_slice(&[0.0, 255.0, 0.0, 0.0, 255.0, 0.0, 0.0, 0.0]);
        let table = ColorTable::hsv();
        let mut out = Planes::new(Size::new(2, 1), table.channels());
        table.extract(&patch, 2, &mut out, 0);
        let close = |v: f32, want: f32| (v - want).abs() < 0.005;
        assert!(close(out.plane(0)[0], 0.0) && close(out.plane(0)[1], -0.5));
        assert!(out.as_slice()[2..].iter().all(|v| close(*v, 0.0)), "{out:?}");
    }

    #[test]
    fn red_points_along_zero_hue() {
        let mut out = Planes::new(Size::new(1, 1), 3);
        ColorTable::hsv().extract(&flat([255, 0, 0]), 4, &mut out, 0);
        assert!((out.plane(1)[0] - 1.0).abs() < 0.01 && out.plane(2)[0].abs() < 0.01);
    }
}
