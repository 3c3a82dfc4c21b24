use super::grid::{Part, SHIFTS, Scale};
use multiversion::multiversion;
use pursuit_geometry::{BBox, Point};
use pursuit_vision::integral::IntegralImage;
use pursuit_vision::warp::Affine;

/// Cells across, and down, a window: two to a shift, so that every window of a size begins at an even cell and the same
/// comparisons serve all sizes.
pub(super) const SIDE: usize = 2 * SHIFTS;
/// Cells of a view that are looked at together.
const LANES: usize = 8;
/// Windows looked at together.
pub(super) const BLOCK: usize = 64;

/// The grey means of a scale's cells, even and odd columns apart: what windows side by side compare lies side by side.
#[derive(Debug, Clone, Default)]
pub(super) struct Cells {
    planes: [Vec<u8>; 2],
    stride: usize,
    /// Where the columns of cells lie in the image: first and end, and one over their number.
    columns: Vec<(u32, u32, f32)>,
    line: Vec<u32>,
}

/// Which pixels of an image of `n` lie within `radius` of `center`: first and end, at least one.
fn reach(center: f64, radius: f64, n: usize) -> (usize, usize) {
    // Half a pixel more, cut off, is rounding; of what is not negative.
    let first = ((center - radius).clamp(0.0, n as f64 - 1.0) + 0.5) as usize;
    let first = first.min(n - 1);
    let end = ((center + radius).clamp(0.0, n as f64) + 0.5) as usize;
    (first, end.max(first + 1))
}

/// Half the side of the square whose mean a cell is, pixels.
fn radius(side: f64, least: f64) -> f64 {
    (side / SIDE as f64).max(least)
}

impl Cells {
    /// Takes the cells of the windows `part` of `scale`. `integral` is that of the image less its first `origin` columns and
    /// rows.
    pub fn take(&mut self, integral: &IntegralImage, origin: (usize, usize), scale: &Scale, part: &Part, smooth: f64) {
        let (across, down) = (part.right - part.left, part.bottom - part.top);
        let (columns, rows) = (2 * across.saturating_sub(1) + SIDE, 2 * down.saturating_sub(1) + SIDE);
        // Blocks read on beyond the last window.
        self.stride = columns / 2 + BLOCK;
        for plane in &mut self.planes {
            plane.resize(self.stride * rows, 0);
        }
        let size = integral.size();
        let (cell_x, cell_y) = (scale.width as f64 / SIDE as f64, scale.height as f64 / SIDE as f64);
        let (radius_x, radius_y) = (radius(scale.width as f64, smooth), radius(scale.height as f64, smooth));
        self.columns.clear();
        self.columns.extend((0..columns).map(|u| {
            let center = ((2 * part.left + u) as f64 + 0.5) * cell_x - origin.0 as f64;
            let (first, end) = reach(center, radius_x, size.width);
            (first as u32, end as u32, 1.0 / (end - first) as f32)
        }));
        for v in 0..rows {
            let center = ((2 * part.top + v) as f64 + 0.5) * cell_y - origin.1 as f64;
            let (first, end) = reach(center, radius_y, size.height);
            let (Some((above, _)), Some((below, _))) = (integral.row(first), integral.row(end)) else { return };
            self.line.clear();
            self.line.extend(below.iter().zip(above).map(|(b, a)| b.wrapping_sub(*a)));
            let share = 1.0 / (end - first) as f32;
            for (parity, plane) in self.planes.iter_mut().enumerate() {
                let out = &mut plane[v * self.stride..][..columns / 2];
                for (out, &(first, end, inverse)) in out.iter_mut().zip(self.columns.iter().skip(parity).step_by(2)) {
                    let sum = self.line[end as usize].wrapping_sub(self.line[first as usize]);
                    *out = (sum as f32 * inverse * share + 0.5) as u8;
                }
            }
        }
    }

    /// Of cell (`x`, `y`) of the windows of row `row` from `column` on, both counted from the part's first: one value a
    /// window.
    #[inline(always)]
    pub fn block(&self, cell: u16, row: usize, column: usize) -> Option<&[u8; BLOCK]> {
        let (x, y) = (cell as usize % SIDE, cell as usize / SIDE);
        let from = (2 * row + y) * self.stride + x / 2 + column;
        self.planes[x % 2].get(from..from + BLOCK)?.first_chunk()
    }
}

/// The cells `wanted` of one view: a box, warped by `map` (of continuous pixels), each the mean about where its centre
/// goes. `integral` is that of the image less its first `origin` columns and rows.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn view(
    (integral, origin): (&IntegralImage, (usize, usize)),
    bbox: &BBox,
    map: &Affine,
    smooth: f64,
    wanted: &[u16],
    out: &mut [u8; SIDE * SIDE],
) {
    let (size, (sums, stride)) = (integral.size(), integral.sums());
    let (cell_x, cell_y) = (bbox.width() / SIDE as f64, bbox.height() / SIDE as f64);
    let (radius_x, radius_y) = (radius(bbox.width(), smooth), radius(bbox.height(), smooth));
    let sum = |row: u32, column: u32| sums.get(row as usize * stride + column as usize).copied().unwrap_or(0);
    for cells in wanted.chunks(LANES) {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for ((x, y), &i) in x.iter_mut().zip(&mut y).zip(cells) {
            let (u, v) = (f64::from(i % SIDE as u16) + 0.5, f64::from(i / SIDE as u16) + 0.5);
            let at = map.apply(Point::new(bbox.left() + u * cell_x, bbox.top() + v * cell_y));
            (*x, *y) = (at.x - origin.0 as f64, at.y - origin.1 as f64);
        }
        let ((left, right), (top, bottom)) = (reaches(&x, radius_x, size.width), reaches(&y, radius_y, size.height));
        let mut means = [0.0f32; LANES];
        for k in 0..LANES {
            let below = sum(bottom[k], right[k]).wrapping_sub(sum(bottom[k], left[k]));
            let above = sum(top[k], right[k]).wrapping_sub(sum(top[k], left[k]));
            means[k] = below.wrapping_sub(above) as f32;
        }
        for k in 0..LANES {
            let (inverse, share) = (1.0 / (right[k] - left[k]) as f32, 1.0 / (bottom[k] - top[k]) as f32);
            means[k] = means[k] * inverse * share + 0.5;
        }
        for (&i, mean) in cells.iter().zip(means) {
            let Some(out) = out.get_mut(usize::from(i)) else { return };
            *out = mean as u8;
        }
    }
}

/// As [`reach`], of several centres at once.
#[inline(always)]
fn reaches(centers: &[f64; LANES], radius: f64, n: usize) -> ([u32; LANES], [u32; LANES]) {
    let (mut first, mut end) = ([0; LANES], [0; LANES]);
    let (last, n) = ((n as f64 - 1.0).max(0.0), n as f64);
    for k in 0..LANES {
        first[k] = (((centers[k] - radius).max(0.0).min(last) + 0.5) as i32).min(last as i32) as u32;
        end[k] = (((centers[k] + radius).max(0.0).min(n) + 0.5) as i32).max(first[k] as i32 + 1) as u32;
    }
    (first, end)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// Every cell.
    pub const ALL: [u16; SIDE * SIDE] = {
        let mut all = [0; SIDE * SIDE];
        let mut i = 0;
        while i < SIDE * SIDE {
            all[i] = i as u16;
            i += 1;
        }
        all
    };

    #[test]
    fn cells_of_a_scan_equal_each_windows_own() {
        let image = Image::from_fn(90, 70, |x, y| (x * 37 + y * y * 11 + x * y * 3) as u8).unwrap();
        let mut integral = IntegralImage::new();
        let (mut cells, mut alone) = (Cells::default(), [0; SIDE * SIDE]);
        for (width, height, part) in [
            (20, 30, Part { left: 3, right: 30, top: 0, bottom: 17 }),
            (40, 20, Part { left: 0, right: 13, top: 2, bottom: 26 }),
        ] {
            let scale = Scale { width, height, columns: 36, rows: 26 };
            let origin = (2, 0);
            integral.build(image.view().crop(2, 0, 88, 70).unwrap());
            cells.take(&integral, origin, &scale, &part, 1.5);
            for (i, j) in [(0, 0), (5, 3), (part.right - part.left - 1, part.bottom - part.top - 1)] {
                let window = scale.window(part.left + i, part.top + j);
                view((&integral, origin), &window, &Affine::IDENTITY, 1.5, &ALL, &mut alone);
                let seen = |cell: usize| cells.block(cell as u16, j, i).unwrap()[0];
                let differing = (0..SIDE * SIDE).filter(|&c| seen(c) != alone[c]).count();
                // Centres that fall on a half may be rounded either way.
                assert!(differing <= 12, "{differing} cells differ");
            }
        }
    }

    #[test]
    fn reaches_are_those_of_each_alone() {
        for (n, radius) in [(40, 1.5), (7, 3.25), (1, 1.5), (9, 20.0)] {
            for step in -200..400 {
                let at = f64::from(step) / 8.0;
                let (first, end) = reaches(&[at; LANES], radius, n);
                assert_eq!((first[3] as usize, end[3] as usize), reach(at, radius, n), "{at} of {n}");
            }
        }
        assert_eq!(reaches(&[f64::NAN; LANES], 1.5, 40).0[0], 0);
    }

    #[test]
    fn a_cell_is_the_mean_about_its_centre() {
        let image = Image::from_fn(60, 60, |x, y| (4 * x + 3 * (y % 7)) as u8).unwrap();
        let mut integral = IntegralImage::new();
        integral.build(image.view());
        let mut out = [0; SIDE * SIDE];
        // Cells of 2 x 2 pixels, means over 4 x 4.
        view((&integral, (0, 0)), &BBox::from_ltwh(10.0, 8.0, 40.0, 40.0), &Affine::IDENTITY, 1.0, &ALL, &mut out);
        for (x, y) in [(0, 0), (3, 7), (19, 19)] {
            let (left, top) = (10 + 2 * x - 1, 8 + 2 * y - 1);
            let sum: u32 = (top..top + 4).flat_map(|r| &image.row(r)[left..left + 4]).map(|&v| u32::from(v)).sum();
            assert_eq!(out[y * SIDE + x], ((sum as f32) / 16.0 + 0.5) as u8);
        }
        // Far outside there is but the border.
        view((&integral, (0, 0)), &BBox::from_ltwh(1e6, -1e6, 40.0, 40.0), &Affine::IDENTITY, 1.0, &ALL, &mut out);
        assert!(out.iter().all(|&v| v == image.row(0)[59]));
    }
}
