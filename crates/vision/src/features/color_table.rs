use super::{ColorTerm, srgb_to_lab};
use crate::sampling::Planes;
use pursuit_geometry::Size;
use std::sync::Arc;

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
    pub fn color_names() -> Self {
        Self::new([(-1.0 / 11.0, 1.0); 11], |rgb| ColorTerm::probabilities(rgb).map(|p| p - 1.0 / 11.0))
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

    /// The codes of one colour, for [`value`](Self::value).
    #[inline]
    fn entry(&self, r: f32, g: f32, b: f32) -> &[u8; LANES] {
        // A float cast saturates, so the index is always inside.
        let code = |v: f32| usize::from((v + 0.5) as u8 >> (8 - BITS));
        &self.codes[(code(r) << (2 * BITS)) | (code(g) << BITS) | code(b)]
    }

    /// Means of the channels over cells of `cell_px` pixels of a colour patch (3 planes, 0–255; of a grey patch, its only
    /// plane counts three times). Writes the planes `first..first + channels` of `out`, which must have the grid's size.
    pub fn extract(&self, patch: &Planes, cell_px: usize, out: &mut Planes, first: usize) {
        let (Size { width, .. }, grid) = (patch.size(), out.size());
        let plane = |c: usize| patch.plane(c.min(patch.channels() - 1));
        let (red, green, blue) = (plane(0), plane(1), plane(2));
        let share = 1.0 / (cell_px * cell_px) as f32;
        for cy in 0..grid.height {
            for cx in 0..grid.width {
                let mut sums = [0_u32; LANES];
                for y in cy * cell_px..(cy + 1) * cell_px {
                    let line = y * width + cx * cell_px..y * width + (cx + 1) * cell_px;
                    for ((&r, &g), &b) in red[line.clone()].iter().zip(&green[line.clone()]).zip(&blue[line]) {
                        for (sum, code) in sums.iter_mut().zip(self.entry(r, g, b)) {
                            *sum += u32::from(*code);
                        }
                    }
                }
                let at = cy * grid.width + cx;
                for (c, ((least, step), sum)) in self.scales.iter().zip(sums).enumerate() {
                    out.plane_mut(first + c)[at] = least + step * share * sum as f32;
                }
            }
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
