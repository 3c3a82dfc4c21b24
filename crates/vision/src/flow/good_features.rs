//! Points that can be followed: corners by the least eigenvalue of the matrix of gradients (Shi and Tomasi 1994, “Good
//! features to track”).

use crate::error::{VisionError, require_range};
use pursuit_geometry::Point;
use pursuit_imaging::ImageView;
use serde::{Deserialize, Serialize};

/// Parameters of [`GoodFeatures`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GoodFeaturesParams {
    /// Most corners, 1 to 100000.
    pub count: usize,
    /// A corner has at least this share of the strongest corner's eigenvalue, 0 to 1.
    pub quality: f64,
    /// And at least this eigenvalue of the mean matrix of gradients, (grey codes per pixel)², ≥ 0: what noise alone has.
    pub min_eigenvalue: f64,
    /// Corners are at least this far apart, pixels, ≥ 0.
    pub min_distance_px: f64,
    /// Side of the square whose gradients count, an odd number from 3 to 31 pixels.
    pub window_px: usize,
}

impl Default for GoodFeaturesParams {
    fn default() -> Self {
        Self { count: 200, quality: 0.01, min_eigenvalue: 1.0, min_distance_px: 8.0, window_px: 7 }
    }
}

/// A corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodFeature {
    /// The middle of its pixel, continuous pixels.
    pub point: Point,
    /// The least eigenvalue of the mean matrix of gradients around it, (grey codes per pixel)².
    pub eigenvalue: f32,
}

/// Finds corners, the strongest first; owns its scratch, so nothing is allocated from picture to picture.
#[derive(Debug, Clone)]
pub struct GoodFeatures {
    params: GoodFeaturesParams,
    /// Σ of the products of gradients over the rows of the window, one a column.
    columns: Vec<[i32; 3]>,
    eigenvalues: Vec<f32>,
    candidates: Vec<(f32, u32)>,
    cells: Vec<Vec<Point>>,
    found: Vec<GoodFeature>,
}

impl GoodFeatures {
    /// A finder.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: GoodFeaturesParams) -> Result<Self, VisionError> {
        require_range("the number of corners", params.count as f64, (1.0, 100_000.0), "from 1 to 100000")?;
        require_range("quality", params.quality, (0.0, 1.0), "from 0 to 1")?;
        require_range("min_eigenvalue", params.min_eigenvalue, (0.0, f64::MAX), "finite and not negative")?;
        require_range("min_distance_px", params.min_distance_px, (0.0, 1e6), "from 0 to 1000000 pixels")?;
        // An even side is no window around a pixel.
        let side = if params.window_px % 2 == 1 { params.window_px as f64 } else { f64::NAN };
        if !(3.0..=31.0).contains(&side) {
            let (value, range) = (params.window_px as f64, "an odd number from 3 to 31 pixels");
            return Err(VisionError::Parameter { name: "window_px", value, range });
        }
        let (columns, eigenvalues, candidates) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { params, columns, eigenvalues, candidates, cells: Vec::new(), found: Vec::new() })
    }

    /// The parameters.
    pub const fn params(&self) -> &GoodFeaturesParams {
        &self.params
    }

    /// The corners of `gray`, none nearer to one of `taken` (continuous pixels) than corners are to each other. A picture
    /// smaller than the window and its gradients has none.
    pub fn find(&mut self, gray: ImageView<'_, u8>, taken: &[Point]) -> &[GoodFeature] {
        self.found.clear();
        let (width, height, reach) = (gray.width(), gray.height(), self.params.window_px / 2);
        // The window, and a pixel more for the gradients.
        if width.min(height) < self.params.window_px + 2 {
            return &self.found;
        }
        self.measure(gray, reach);
        let strongest = self.eigenvalues.iter().copied().fold(0.0, f32::max);
        let least = (self.params.quality as f32 * strongest).max(self.params.min_eigenvalue as f32);
        self.gather(width, height, reach, least);
        self.thin_out(width, height, taken);
        &self.found
    }

    /// The least eigenvalue around every pixel whose window lies in the picture; 0 around others.
    fn measure(&mut self, gray: ImageView<'_, u8>, reach: usize) {
        let (width, height, side) = (gray.width(), gray.height(), 2 * reach + 1);
        self.eigenvalues.clear();
        self.eigenvalues.resize(width * height, 0.0);
        self.columns.clear();
        self.columns.resize(width, [0; 3]);
        // Gradients are differences of neighbours, twice what they are a pixel.
        let scale = 1.0 / (4 * side * side) as f64;
        for bottom in 1..height - 1 {
            add_row(gray, bottom, 1, &mut self.columns);
            if bottom > side {
                add_row(gray, bottom - side, -1, &mut self.columns);
            }
            if bottom < side {
                continue;
            }
            let out = &mut self.eigenvalues[(bottom - reach) * width..][..width];
            let mut sums = [0; 3];
            for right in 1..width - 1 {
                add(&mut sums, self.columns[right], 1);
                if right > side {
                    add(&mut sums, self.columns[right - side], -1);
                }
                if right >= side {
                    out[right - reach] = (least_eigenvalue(sums) * scale) as f32;
                }
            }
        }
    }

    /// Pixels that no neighbour surpasses, the strongest first; of equals the first in reading order.
    fn gather(&mut self, width: usize, height: usize, reach: usize, least: f32) {
        self.candidates.clear();
        let at = |x: usize, y: usize| self.eigenvalues[y * width + x];
        for y in reach + 1..height - reach - 1 {
            for x in reach + 1..width - reach - 1 {
                let own = at(x, y);
                let tops = || (y - 1..=y + 1).all(|v| (x - 1..=x + 1).all(|u| at(u, v) <= own));
                if own >= least && own > 0.0 && tops() {
                    self.candidates.push((own, (y * width + x) as u32));
                }
            }
        }
        self.candidates.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    }

    /// Keeps the strongest that are far enough from those kept before; cells are as wide as corners are apart.
    fn thin_out(&mut self, width: usize, height: usize, taken: &[Point]) {
        let apart = self.params.min_distance_px;
        let cell = apart.max(1.0);
        let columns = (width as f64 / cell) as usize + 1;
        let rows = (height as f64 / cell) as usize + 1;
        self.cells.iter_mut().for_each(Vec::clear);
        self.cells.resize_with(self.cells.len().max(columns * rows), Vec::new);
        let cell_of = |p: Point| (((p.x / cell) as usize).min(columns - 1), ((p.y / cell) as usize).min(rows - 1));
        for &point in taken.iter().filter(|p| p.x.is_finite() && p.y.is_finite()) {
            let (i, j) = cell_of(point);
            self.cells[j * columns + i].push(point);
        }
        for &(eigenvalue, index) in &self.candidates {
            if self.found.len() == self.params.count {
                break;
            }
            let point = Point::new((index as usize % width) as f64 + 0.5, (index as usize / width) as f64 + 0.5);
            let (i, j) = cell_of(point);
            let mut near = (j.saturating_sub(1)..(j + 2).min(rows))
                .flat_map(|v| &self.cells[v * columns..][i.saturating_sub(1)..(i + 2).min(columns)])
                .flatten();
            if near.all(|other| other.distance(point) >= apart) {
                self.cells[j * columns + i].push(point);
                self.found.push(GoodFeature { point, eigenvalue });
            }
        }
    }
}

/// Adds (or takes away, for a sign of −1) the products of the gradients of row `y` to the sums of the columns.
fn add_row(gray: ImageView<'_, u8>, y: usize, sign: i32, columns: &mut [[i32; 3]]) {
    let (above, row, below) = (gray.row(y - 1), gray.row(y), gray.row(y + 1));
    for x in 1..row.len() - 1 {
        let gx = i32::from(row[x + 1]) - i32::from(row[x - 1]);
        let gy = i32::from(below[x]) - i32::from(above[x]);
        add(&mut columns[x], [gx * gx, gx * gy, gy * gy], sign);
    }
}

fn add(sums: &mut [i32; 3], other: [i32; 3], sign: i32) {
    // At most 31² · 255², which 32 bits hold.
    sums.iter_mut().zip(other).for_each(|(s, o)| *s += sign * o);
}

/// The least eigenvalue of the matrix xx, xy, yy.
fn least_eigenvalue([xx, xy, yy]: [i32; 3]) -> f64 {
    let [xx, xy, yy] = [xx, xy, yy].map(f64::from);
    (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt()) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::texture;
    use pursuit_imaging::Image;

    fn finder(params: GoodFeaturesParams) -> GoodFeatures {
        GoodFeatures::new(params).unwrap()
    }

    /// By definition: the eigenvalue of the sum over the window, in double precision.
    fn slow(image: &Image<u8>, x: usize, y: usize, reach: usize) -> f64 {
        let at = |x: usize, y: usize| f64::from(image.row(y)[x]);
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for v in y - reach..=y + reach {
            for u in x - reach..=x + reach {
                let (gx, gy) = ((at(u + 1, v) - at(u - 1, v)) / 2.0, (at(u, v + 1) - at(u, v - 1)) / 2.0);
                (xx, xy, yy) = (xx + gx * gx, xy + gx * gy, yy + gy * gy);
            }
        }
        let n = ((2 * reach + 1) * (2 * reach + 1)) as f64;
        let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
        (trace / 2.0 - (trace * trace / 4.0 - determinant).max(0.0).sqrt()) / n
    }

    #[test]
    fn eigenvalues_equal_the_definition() {
        let image = texture(61, 47, [256, 0, 9000, 0, 256, 4000]);
        for window_px in [3, 7, 11] {
            let reach = window_px / 2;
            let mut finder = finder(GoodFeaturesParams { window_px, ..GoodFeaturesParams::default() });
            finder.find(image.view(), &[]);
            for y in reach + 1..47 - reach - 1 {
                for x in reach + 1..61 - reach - 1 {
                    let (fast, slow) = (f64::from(finder.eigenvalues[y * 61 + x]), slow(&image, x, y, reach));
                    assert!((fast - slow).abs() < 1e-3 + 1e-5 * slow, "{window_px} {x} {y}: {fast} {slow}");
                }
            }
        }
    }

    #[test]
    fn corners_of_squares_are_found_and_edges_are_not() {
        let image = Image::from_fn(80, 60, |x, y| if x.clamp(20, 49) == x && y.clamp(15, 39) == y { 200 } else { 30 });
        let params = GoodFeaturesParams { count: 10, quality: 0.3, window_px: 5, ..GoodFeaturesParams::default() };
        let mut finder = finder(params);
        let found = finder.find(image.unwrap().view(), &[]);
        assert_eq!(found.len(), 4, "{found:?}");
        for corner in [(20.0, 15.0), (50.0, 15.0), (20.0, 40.0), (50.0, 40.0)] {
            let near = |f: &&GoodFeature| f.point.distance(Point::new(corner.0, corner.1)) < 3.0;
            assert_eq!(found.iter().filter(near).count(), 1, "{corner:?} {found:?}");
        }
    }

    #[test]
    fn corners_keep_apart_and_the_strongest_come_first() {
        let image = texture(200, 150, [256, 0, 70_000, 0, 256, 30_000]);
        let params = GoodFeaturesParams { count: 40, min_distance_px: 12.0, ..GoodFeaturesParams::default() };
        let taken = [Point::new(100.0, 75.0), Point::new(f64::NAN, 3.0), Point::new(1e12, -4.0)];
        let mut finder = finder(params);
        let found = finder.find(image.view(), &taken).to_vec();
        assert_eq!(found.len(), 40);
        assert!(found.windows(2).all(|w| w[0].eigenvalue >= w[1].eigenvalue));
        for (i, a) in found.iter().enumerate() {
            assert!(a.point.distance(taken[0]) >= 12.0);
            assert!(found[..i].iter().all(|b| a.point.distance(b.point) >= 12.0));
        }
        assert_eq!(finder.find(image.view(), &taken), found, "a used finder finds the same");
    }

    #[test]
    fn flat_and_tiny_pictures_have_none_and_bad_parameters_are_refused() {
        let mut usual = finder(GoodFeaturesParams::default());
        assert!(usual.find(Image::filled(50, 40, 99).unwrap().view(), &[]).is_empty());
        assert!(usual.find(Image::filled(8, 40, 99).unwrap().view(), &[]).is_empty());
        let params = GoodFeaturesParams::default();
        for bad in [
            GoodFeaturesParams { count: 0, ..params },
            GoodFeaturesParams { quality: 1.5, ..params },
            GoodFeaturesParams { min_eigenvalue: f64::NAN, ..params },
            GoodFeaturesParams { min_distance_px: -1.0, ..params },
            GoodFeaturesParams { window_px: 6, ..params },
            GoodFeaturesParams { window_px: 33, ..params },
        ] {
            assert!(matches!(GoodFeatures::new(bad), Err(VisionError::Parameter { .. })), "{bad:?}");
        }
    }
}
