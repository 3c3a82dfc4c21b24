//! Whether a point still looks as it did where it was first taken (Shi and Tomasi 1994, section 4: features are followed by
//! shifts from picture to picture and watched by an affine change since the first).

use crate::error::{VisionError, require_range};
use pursuit_geometry::Point;
use pursuit_imaging::ImageView;

/// Unknowns of an affine change.
const N: usize = 6;
/// Steps in which the change settles.
const STEPS: usize = 8;
/// Where a step moves no pixel of the patch by more it has settled, pixels.
const SETTLED_PX: f64 = 0.02;
/// A change that shrinks or stretches an area by more than this is none that a picture makes.
const MOST_SCALE: f64 = 8.0;
/// No coefficient of the change differs by more from one call to the next: what turns or stretches faster is another thing.
const MOST_STEP: f64 = 0.15;

/// The surroundings of a point in the picture where it was taken, and how they have been turned and stretched since.
#[derive(Debug, Clone, PartialEq)]
pub struct Appearance {
    side: usize,
    /// The patch, less its mean.
    values: Vec<f32>,
    /// Σ of the squares of `values`.
    energy: f64,
    /// What one unit of each unknown changes, without what gain and bias explain.
    slopes: Vec<[f32; N]>,
    /// Inverse of Σ slopes·slopesᵀ.
    inverse: [[f64; N]; N],
    /// From offsets in the patch to offsets in the present picture.
    change: [[f64; 2]; 2],
}

/// How a point looks now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeness {
    /// Correlation of its surroundings with those of the start, after the affine change that fits best, −1 to 1.
    pub correlation: f64,
    /// Where the surroundings of the start are now, continuous pixels.
    pub point: Point,
}

impl Appearance {
    /// What is seen within a square of `side` pixels (odd, 7 to 63) around `point` (continuous pixels); beyond the picture its
    /// border goes on. `None` where there is too little to tell a change by.
    ///
    /// # Errors
    /// A side that is even or out of its range.
    pub fn of(gray: ImageView<'_, u8>, point: Point, side: usize) -> Result<Option<Self>, VisionError> {
        require_range("the side of a patch", side as f64, (7.0, 63.0), "an odd number from 7 to 63 pixels")?;
        if side.is_multiple_of(2) {
            let (name, range) = ("the side of a patch", "an odd number from 7 to 63 pixels");
            return Err(VisionError::Parameter { name, value: side as f64, range });
        }
        if !(point.x.is_finite() && point.y.is_finite()) {
            return Ok(None);
        }
        let identity = [[1.0, 0.0], [0.0, 1.0]];
        let at = |dx: f64, dy: f64| sample(gray, point.x + dx, point.y + dy);
        let mut values: Vec<f32> = offsets(side).map(|(x, y)| at(x, y) as f32).collect();
        let mut slopes: Vec<[f32; N]> = offsets(side)
            .map(|(x, y)| {
                let (gx, gy) = ((at(x + 1.0, y) - at(x - 1.0, y)) / 2.0, (at(x, y + 1.0) - at(x, y - 1.0)) / 2.0);
                [gx * x, gx * y, gy * x, gy * y, gx, gy].map(|v| v as f32)
            })
            .collect();
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
        values.iter_mut().for_each(|v| *v -= mean as f32);
        let energy = values.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>();
        if energy <= 0.0 {
            return Ok(None);
        }
        // What is left is orthogonal to constants and to the patch: a change of light moves nothing.
        for k in 0..N {
            let mean = slopes.iter().map(|s| f64::from(s[k])).sum::<f64>() / slopes.len() as f64;
            let along = slopes.iter().zip(&values).map(|(s, &v)| f64::from(s[k]) * f64::from(v)).sum::<f64>() / energy;
            slopes.iter_mut().zip(&values).for_each(|(s, &v)| s[k] -= (mean + along * f64::from(v)) as f32);
        }
        let mut matrix = [[0.0; N]; N];
        for s in &slopes {
            for (row, a) in matrix.iter_mut().zip(s) {
                row.iter_mut().zip(s).for_each(|(m, b)| *m += f64::from(*a) * f64::from(*b));
            }
        }
        Ok(inverted(matrix).map(|inverse| Self { side, values, energy, slopes, inverse, change: identity }))
    }

    /// From offsets in the patch of the start to offsets in the present picture: rows of the affine change without its shift.
    pub const fn change(&self) -> [[f64; 2]; 2] {
        self.change
    }

    /// Has the next comparison set out from `change`; what no picture makes, or is no number, counts as no change.
    pub fn set_change(&mut self, change: [[f64; 2]; 2]) {
        let [[a, b], [c, d]] = change;
        let scale = (a * d - b * c).abs();
        let sane =
            (1.0 / MOST_SCALE..=MOST_SCALE).contains(&scale) && [a, b, c, d].iter().all(|v| v.abs() <= MOST_SCALE);
        self.change = if sane { change } else { [[1.0, 0.0], [0.0, 1.0]] };
    }

    /// How the surroundings of the start should look in the present picture, every value the mean over `step` × `step` pixels (≥ 1), into
    /// `out`, row by row about the point; returns how many values are in a row, an odd number.
    pub fn template(&self, step: usize, out: &mut Vec<f32>) -> usize {
        let step = step.max(1);
        let cells = self.side / step;
        let cells = if cells % 2 == 1 { cells } else { cells.saturating_sub(1).max(1) };
        out.clear();
        let Some(back) = inverted_two(self.change) else {
            out.resize(cells * cells, 0.0);
            return cells;
        };
        let (reach, middle) = ((self.side / 2) as f64, ((cells * step) as f64 - 1.0) / 2.0);
        for (row, column) in (0..cells * cells).map(|i| (i / cells * step, i % cells * step)) {
            let within = |k: usize| ((column + k % step) as f64 - middle, (row + k / step) as f64 - middle);
            let value = |(x, y): (f64, f64)| {
                self.value(reach + back[0][0] * x + back[0][1] * y, reach + back[1][0] * x + back[1][1] * y)
            };
            let sum: f64 = (0..step * step).map(|k| value(within(k))).sum();
            out.push((sum / (step * step) as f64) as f32);
        }
        cells
    }

    /// The patch of the start between its pixels, bilinear; beyond its border that goes on.
    fn value(&self, x: f64, y: f64) -> f64 {
        let most = (self.side - 1) as f64;
        let (x, y) = (x.clamp(0.0, most), y.clamp(0.0, most));
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = (x - i as f64, y - j as f64);
        let (right, below) = ((i + 1).min(self.side - 1), (j + 1).min(self.side - 1));
        let at = |i: usize, j: usize| f64::from(self.values[j * self.side + i]);
        (1.0 - fy) * ((1.0 - fx) * at(i, j) + fx * at(right, j))
            + fy * ((1.0 - fx) * at(i, below) + fx * at(right, below))
    }

    /// How the surroundings of `point` (continuous pixels) of a later picture look; the change found is where the next call sets
    /// out from. `None` when no affine change leads there.
    pub fn compare(&mut self, gray: ImageView<'_, u8>, point: Point) -> Option<Likeness> {
        if !(point.x.is_finite() && point.y.is_finite()) {
            return None;
        }
        let (mut a, mut d) = (self.change, [0.0f64; 2]);
        let reach = (self.side / 2) as f64;
        let mut correlation = self.projected(gray, point, a, d).0;
        for _ in 0..STEPS {
            let (_, gain, b) = self.projected(gray, point, a, d);
            if gain <= 0.0 {
                break;
            }
            let step: [f64; N] = std::array::from_fn(|k| {
                self.inverse[k].iter().zip(b).map(|(inverse, b)| inverse * b).sum::<f64>() / gain
            });
            // The step moved the patch of the start; the picture's patch is to move the other way (Baker and Matthews 2004).
            let back = inverted_two([[1.0 + step[0], step[1]], [step[2], 1.0 + step[3]]])?;
            let next = product(a, back);
            let moved = [
                d[0] - next[0][0] * step[4] - next[0][1] * step[5],
                d[1] - next[1][0] * step[4] - next[1][1] * step[5],
            ];
            let scale = (next[0][0] * next[1][1] - next[0][1] * next[1][0]).abs();
            let steps = next.iter().flatten().zip(self.change.iter().flatten()).map(|(a, b)| (a - b).abs());
            let sane = (1.0 / MOST_SCALE..=MOST_SCALE).contains(&scale)
                && moved[0].hypot(moved[1]) <= 2.0 * reach
                && steps.fold(0.0, f64::max) <= MOST_STEP;
            let better = if sane { self.projected(gray, point, next, moved).0 } else { f64::NEG_INFINITY };
            // A step that makes it worse is not taken: it has settled, or there is nothing to be found.
            if better < correlation {
                break;
            }
            (a, d, correlation) = (next, moved, better);
            if step[..4].iter().fold(0.0f64, |m, s| m.max(s.abs())) * reach + step[4].hypot(step[5]) < SETTLED_PX {
                break;
            }
        }
        self.change = a;
        Some(Likeness { correlation, point: Point::new(point.x + d[0], point.y + d[1]) })
    }

    /// Of the picture's patch under a change: its correlation with that of the start, its gain, and its part along the slopes.
    fn projected(&self, gray: ImageView<'_, u8>, at: Point, a: [[f64; 2]; 2], d: [f64; 2]) -> (f64, f64, [f64; N]) {
        let (mut sum, mut square, mut common, mut along) = (0.0, 0.0, 0.0, [0.0; N]);
        for (((x, y), &value), slopes) in offsets(self.side).zip(&self.values).zip(&self.slopes) {
            let seen = sample(gray, at.x + d[0] + a[0][0] * x + a[0][1] * y, at.y + d[1] + a[1][0] * x + a[1][1] * y);
            sum += seen;
            square += seen * seen;
            common += seen * f64::from(value);
            along.iter_mut().zip(slopes).for_each(|(b, s)| *b += seen * f64::from(*s));
        }
        let spread = (square - sum * sum / self.values.len() as f64).max(0.0);
        let correlation = if spread > 0.0 { common / (spread * self.energy).sqrt() } else { 0.0 };
        (correlation, common / self.energy, along)
    }
}

/// Offsets of the pixels of a patch from its middle, row by row.
fn offsets(side: usize) -> impl Iterator<Item = (f64, f64)> {
    let reach = (side / 2) as f64;
    (0..side * side).map(move |i| ((i % side) as f64 - reach, (i / side) as f64 - reach))
}

/// The picture between its pixels, bilinear, at continuous pixels; beyond its border that goes on.
fn sample(gray: ImageView<'_, u8>, x: f64, y: f64) -> f64 {
    let (x, y) = (x - 0.5, y - 0.5);
    let (column, row) = (x.floor(), y.floor());
    let (fx, fy) = (x - column, y - row);
    let (i, j) = (column as isize, row as isize);
    let at = |dx: isize, dy: isize| f64::from(gray.clamped(i.saturating_add(dx), j.saturating_add(dy)));
    (1.0 - fy) * ((1.0 - fx) * at(0, 0) + fx * at(1, 0)) + fy * ((1.0 - fx) * at(0, 1) + fx * at(1, 1))
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

fn inverted_two([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    let inverse = [[d, -b], [-c, a]].map(|row| row.map(|v| v / determinant));
    (determinant.abs() > 1e-6 && determinant.is_finite()).then_some(inverse)
}

/// The inverse of a symmetric positive matrix, by elimination; `None` where it has none to speak of.
fn inverted(mut matrix: [[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let largest = (0..N).map(|k| matrix[k][k]).fold(0.0, f64::max);
    let mut inverse: [[f64; N]; N] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for k in 0..N {
        let pivot = matrix[k][k];
        if !(pivot > 1e-9 * largest && pivot > 0.0) {
            return None;
        }
        let (own, own_inverse) = (matrix[k].map(|v| v / pivot), inverse[k].map(|v| v / pivot));
        (matrix[k], inverse[k]) = (own, own_inverse);
        for i in (0..N).filter(|i| *i != k) {
            let factor = matrix[i][k];
            for j in 0..N {
                matrix[i][j] -= factor * own[j];
                inverse[i][j] -= factor * own_inverse[j];
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::{noise, texture};
    use pursuit_imaging::Image;

    const SIDE: usize = 21;

    fn first() -> Image<u8> {
        texture(160, 120, [256, 0, 300_000, 0, 256, 300_000])
    }

    fn appearance(image: &Image<u8>, x: f64, y: f64) -> Appearance {
        Appearance::of(image.view(), Point::new(x, y), SIDE).unwrap().unwrap()
    }

    #[test]
    fn turned_stretched_and_lit_surroundings_are_known_again() {
        // Where a pixel of the second picture lies in the first: sheared, stretched by a tenth, shifted.
        let second = texture(160, 120, [230, 20, 301_000, -25, 240, 302_500]);
        let mut lit = second.clone();
        lit.as_mut_slice().iter_mut().for_each(|v| *v = (f64::from(*v) * 0.6 + 50.0) as u8);
        let (image, start) = (first(), Point::new(80.5, 60.5));
        // The second map is 230 x + 20 y + 301000 = 256 · 80 + 300000 and so on, of centres of pixels.
        let (u, v) = (256.0 * 80.0 - 1000.0, 256.0 * 60.0 - 2500.0);
        let determinant = 230.0 * 240.0 + 20.0 * 25.0;
        let now = Point::new((240.0 * u - 20.0 * v) / determinant + 0.5, (25.0 * u + 230.0 * v) / determinant + 0.5);
        for picture in [&second, &lit] {
            let mut look = appearance(&image, start.x, start.y);
            let off = Point::new(now.x + 0.7, now.y - 0.5);
            let likeness = look.compare(picture.view(), off).unwrap();
            assert!(likeness.correlation > 0.97, "{likeness:?}");
            assert!(likeness.point.distance(now) < 0.1, "{likeness:?} {now:?}");
            // The change is the inverse of the map.
            let expected = [[240.0, -20.0], [25.0, 230.0]].map(|row| row.map(|m| m * 256.0 / determinant));
            for (found, expected) in look.change.iter().flatten().zip(expected.iter().flatten()) {
                assert!((found - expected).abs() < 0.05, "{:?} {expected:?}", look.change);
            }
        }
    }

    #[test]
    fn other_surroundings_are_not_taken_for_those_of_the_start() {
        let image = first();
        let other = Image::from_fn(160, 120, |x, y| noise(x, y, 7) as u8).unwrap();
        let mut most: f64 = -1.0;
        for (x, y) in [(40.0, 40.0), (80.5, 60.5), (120.0, 80.0), (60.0, 90.0)] {
            let likeness = appearance(&image, x, y).compare(other.view(), Point::new(80.0, 60.0));
            most = most.max(likeness.map_or(-1.0, |l| l.correlation));
        }
        assert!(most < 0.5, "{most}");
        let itself = appearance(&image, 80.5, 60.5).compare(image.view(), Point::new(80.5, 60.5)).unwrap();
        assert!(itself.correlation > 0.999 && itself.point == Point::new(80.5, 60.5), "{itself:?}");
    }

    #[test]
    fn slopes_are_what_small_changes_do() {
        // By definition: the derivative of the warped patch by each unknown, less its parts along the patch and constants.
        let image = first();
        let (look, at, step) = (appearance(&image, 70.3, 50.8), Point::new(70.3, 50.8), 0.05);
        let n = look.values.len() as f64;
        for k in 0..N {
            let warped = |sign: f64| -> Vec<f64> {
                let mut p = [0.0; N];
                // Offsets reach ten pixels, so their coefficients change by less.
                p[k] = sign * if k < 4 { step / 10.0 } else { step };
                let place =
                    |(x, y): (f64, f64)| (at.x + x + p[0] * x + p[1] * y + p[4], at.y + y + p[2] * x + p[3] * y + p[5]);
                offsets(SIDE).map(place).map(|(x, y)| sample(image.view(), x, y)).collect()
            };
            let unit = if k < 4 { step / 10.0 } else { step };
            let mut slope: Vec<f64> =
                warped(1.0).iter().zip(warped(-1.0)).map(|(a, b)| (a - b) / (2.0 * unit)).collect();
            let mean = slope.iter().sum::<f64>() / n;
            let along = slope.iter().zip(&look.values).map(|(s, v)| s * f64::from(*v)).sum::<f64>() / look.energy;
            slope.iter_mut().zip(&look.values).for_each(|(s, v)| *s -= mean + along * f64::from(*v));
            // Differences over two pixels are smoother than derivatives of a bilinear picture: alike, not equal.
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let own: Vec<f64> = look.slopes.iter().map(|s| f64::from(s[k])).collect();
            let cosine = dot(&own, &slope) / (dot(&own, &own) * dot(&slope, &slope)).sqrt();
            assert!(cosine > 0.9, "{k}: {cosine}");
        }
    }

    #[test]
    fn where_nothing_can_be_told_there_is_no_appearance() {
        let flat = Image::filled(60, 40, 90_u8).unwrap();
        assert_eq!(Appearance::of(flat.view(), Point::new(30.0, 20.0), SIDE).unwrap(), None);
        let edge = Image::from_fn(60, 40, |x, _| if x > 30 { 200 } else { 20 }).unwrap();
        assert_eq!(Appearance::of(edge.view(), Point::new(30.0, 20.0), SIDE).unwrap(), None);
        assert_eq!(Appearance::of(first().view(), Point::new(f64::NAN, 20.0), SIDE).unwrap(), None);
        for side in [0, 5, 20, 65] {
            assert!(Appearance::of(flat.view(), Point::new(30.0, 20.0), side).is_err(), "{side}");
        }
        let mut look = appearance(&first(), 80.5, 60.5);
        assert_eq!(look.compare(first().view(), Point::new(f64::INFINITY, 0.0)), None);
        assert!(look.compare(flat.view(), Point::new(-1e300, 1e300)).is_none_or(|l| l.correlation == 0.0));
    }
}
