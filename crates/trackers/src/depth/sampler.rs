use pursuit_imaging::ImageView;
use pursuit_vision::sampling::{Planes, Window};

/// Value of a pixel without data until its row has been filled.
const HOLE: f32 = -1.0;

/// Takes windows out of depth images as inverse depth, 0 (far) to 255 (the nearest distance asked about, and nearer).
///
/// Inverse depth, because a sensor that triangulates errs by the same amount of it at any distance (its error grows with the
/// square of the distance: Khoshelham & Elberink 2012, eq. 8): gradients of noise are then as small far away as near.
/// Pixels are interpolated bilinearly among those with data. Runs of pixels without data take the farther of their two ends:
/// what nearer things shade belongs to what lies behind them. Outside the frame the border pixel is repeated.
#[derive(Debug, Clone, Default)]
pub struct DepthSampler {
    /// Of each column of the patch the two columns of the frame, and the second one's weight.
    columns: Vec<(u32, u32, f32)>,
}

impl DepthSampler {
    /// Samples: `out` becomes one plane of the window's patch size, in which 255 is `nearest_mm`. Turned windows are taken as
    /// upright.
    pub fn inverse(&mut self, nearest_mm: u16, depth: ImageView<'_, u16>, window: &Window, out: &mut Planes) {
        let (frame, patch) = (depth.size(), window.patch);
        out.reshape(patch, 1);
        if frame.area() == 0 {
            out.as_mut_slice().fill(0.0);
            return;
        }
        self.columns.clear();
        self.columns
            .extend((0..patch.width).map(|j| taps(window.center.x, window.step_x, j, patch.width, frame.width)));
        let unit = 255.0 * f32::from(nearest_mm);
        let mut filled_above = false;
        for i in 0..patch.height {
            let (above, below, v) = taps(window.center.y, window.step_y, i, patch.height, frame.height);
            let (above, below) = (depth.row(above as usize), depth.row(below as usize));
            let (done, rest) = out.as_mut_slice().split_at_mut(i * patch.width);
            let row = &mut rest[..patch.width];
            for (out, &(left, right, u)) in row.iter_mut().zip(&self.columns) {
                let (left, right) = (left as usize, right as usize);
                *out = blend([above[left], above[right], below[left], below[right]], (u, v), unit);
            }
            if !fill(row) {
                // Nothing in the whole row: as the row above, or far away.
                match done.len().checked_sub(patch.width) {
                    Some(at) if filled_above => row.copy_from_slice(&done[at..]),
                    _ => row.fill(0.0),
                }
            } else {
                filled_above = true;
            }
        }
    }
}

/// The two neighbours of the `k`-th of `n` samples about `center`, inside `0..length`, and the second one's weight.
fn taps(center: f64, step: f64, k: usize, n: usize, length: usize) -> (u32, u32, f32) {
    let at = center + (k as f64 + 0.5 - n as f64 / 2.0) * step - 0.5;
    let low = at.floor();
    let inside = |v: f64| v.clamp(0.0, (length - 1) as f64) as u32;
    let weight = (at - low) as f32;
    (inside(low), inside(low + 1.0), if weight.is_finite() { weight } else { 0.0 })
}

/// Inverse depth between four pixels, of those with data.
#[inline(always)]
fn blend([a, b, c, d]: [u16; 4], (u, v): (f32, f32), unit: f32) -> f32 {
    let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
    let (mut total, mut sum) = (0.0_f32, 0.0_f32);
    for (mm, weight) in [a, b, c, d].into_iter().zip(weights) {
        let weight = if mm > 0 { weight } else { 0.0 };
        total += weight;
        sum += weight * f32::from(mm);
    }
    if sum > 0.0 { (unit * total / sum).min(255.0) } else { HOLE }
}

/// Fills runs of holes with the farther of their two ends; `false` where there is no data at all.
fn fill(row: &mut [f32]) -> bool {
    let mut last: Option<usize> = None;
    for x in 0..row.len() {
        if row[x] < 0.0 {
            continue;
        }
        let start = last.map_or(0, |l| l + 1);
        if start < x {
            let value = last.map_or(row[x], |l| row[l].min(row[x]));
            row[start..x].fill(value);
        }
        last = Some(x);
    }
    let Some(last) = last else { return false };
    let value = row[last];
    row[last + 1..].fill(value);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::{Point, Size};
    use pursuit_imaging::Image;

    fn sample(image: &Image<u16>, window: &Window) -> Vec<f32> {
        let mut out = Planes::default();
        DepthSampler::default().inverse(400, image.view(), window, &mut out);
        assert_eq!((out.size(), out.channels()), (window.patch, 1));
        out.as_slice().to_vec()
    }

    #[test]
    fn whole_pixels_are_inverse_depths() {
        let image = Image::from_fn(6, 4, |x, y| (1000 + 100 * x + 10 * y) as u16).unwrap();
        let got = sample(&image, &Window::new(Point::new(3.0, 2.0), 1.0, Size::new(2, 2)));
        let want = [1210.0, 1310.0, 1220.0, 1320.0].map(|mm: f32| 102_000.0 / mm);
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-3), "{got:?} {want:?}");
        // Between four pixels, and nearer than is possible.
        let got = sample(&image, &Window::new(Point::new(3.5, 2.5), 1.0, Size::new(2, 2)));
        assert!((got[0] - 102_000.0 / 1265.0).abs() < 1e-3, "{}", got[0]);
        assert_eq!(
            sample(&Image::filled(3, 3, 7).unwrap(), &Window::new(Point::new(1.5, 1.5), 1.0, Size::new(1, 1))),
            [255.0]
        );
    }

    #[test]
    fn holes_take_the_farther_end_unmixed() {
        let row = [0, 1000, 0, 0, 2000, 0];
        let image = Image::from_fn(6, 3, |x, y| if y == 1 { row[x] } else { 0 }).unwrap();
        let got = sample(&image, &Window::new(Point::new(3.0, 1.5), 1.0, Size::new(6, 1)));
        assert_eq!(got, [102.0, 102.0, 51.0, 51.0, 51.0, 51.0]);
        // Half a pixel lower the row without data counts for nothing.
        let lower = sample(&image, &Window::new(Point::new(3.0, 2.0), 1.0, Size::new(6, 1)));
        assert_eq!(lower, got);
        // Rows without any data are as those above; above the first of those, far away.
        let all = sample(&image, &Window::new(Point::new(3.0, 1.5), 1.0, Size::new(6, 3)));
        assert_eq!((&all[..6], &all[6..12], &all[12..]), (&[0.0; 6][..], &got[..], &got[..]));
    }

    #[test]
    fn hostile_windows_do_no_harm() {
        let image = Image::filled(5, 4, 900).unwrap();
        for (at, step) in [(1e300, 1.0), (f64::NAN, 1.0), (2.0, f64::INFINITY), (2.0, 0.0), (2.0, -3.0)] {
            let got = sample(&image, &Window::new(Point::new(at, 2.0), step, Size::new(7, 5)));
            assert!(got.iter().all(|v| (v - 102_000.0 / 900.0).abs() < 1e-3), "{at} {step}: {got:?}");
        }
    }
}
