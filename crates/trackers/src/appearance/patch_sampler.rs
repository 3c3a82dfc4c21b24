use multiversion::multiversion;
use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;
use pursuit_vision::patch::normalize;

/// Shrinks boxes to square patches: each pixel of a patch is the exact mean over its part of the box, so that a large box
/// does not alias and a small one is not distorted. Owns its scratch.
#[derive(Debug, Clone, Default)]
pub struct PatchSampler {
    /// Along x: first column, how many, and the weights of a pixel of the patch.
    columns: Vec<Span>,
    weights: Vec<f32>,
    /// A row of the image, summed over the height of a pixel of the patch.
    line: Vec<f32>,
}

/// Which pixels of a line a pixel of the patch takes in.
#[derive(Debug, Clone, Copy)]
struct Span {
    first: usize,
    count: usize,
    /// Where its weights begin.
    weights: usize,
}

impl PatchSampler {
    /// The `side` × `side` means of the part of `gray` under `bbox`, row by row, in grey codes; beyond the image its border
    /// is repeated. A box that is empty or not finite gives zeros.
    pub fn sample(&mut self, gray: ImageView<'_, u8>, bbox: &BBox, side: usize, out: &mut Vec<f32>) {
        out.clear();
        out.resize(side * side, 0.0);
        if !bbox.is_finite() || bbox.is_empty() || side == 0 {
            return;
        }
        let (cell_x, cell_y) = (bbox.width() / side as f64, bbox.height() / side as f64);
        self.columns.clear();
        self.weights.clear();
        for i in 0..side {
            let span = span(bbox.left() + i as f64 * cell_x, cell_x, gray.width(), &mut self.weights);
            self.columns.push(span);
        }
        let from = self.columns.iter().map(|c| c.first).min().unwrap_or(0);
        let to = self.columns.iter().map(|c| c.first + c.count).max().unwrap_or(0);
        let horizontal = self.weights.len();
        for (j, out) in out.chunks_exact_mut(side).enumerate() {
            self.weights.truncate(horizontal);
            let rows = span(bbox.top() + j as f64 * cell_y, cell_y, gray.height(), &mut self.weights);
            self.line.clear();
            self.line.resize(to - from, 0.0);
            for k in 0..rows.count {
                add_row(&gray.row(rows.first + k)[from..to], self.weights[rows.weights + k], &mut self.line);
            }
            for (out, column) in out.iter_mut().zip(&self.columns) {
                let pixels = &self.line[column.first - from..][..column.count];
                let weights = &self.weights[column.weights..][..column.count];
                *out = pixels.iter().zip(weights).map(|(v, w)| v * w).sum();
            }
        }
    }

    /// As [`sample`](Self::sample), less the mean and scaled to length one: the dot product of two such patches is their
    /// normalised cross-correlation. `false` (and zeros) where the box has one value only.
    pub fn normalized(&mut self, gray: ImageView<'_, u8>, bbox: &BBox, side: usize, out: &mut Vec<f32>) -> bool {
        self.sample(gray, bbox, side, out);
        normalize(out)
    }
}

/// The pixels of a line of `n` under `[start, start + length)` and their shares, which add up to one; what lies outside
/// counts for the border's pixel.
fn span(start: f64, length: f64, n: usize, weights: &mut Vec<f32>) -> Span {
    let most = n as f64;
    let (a, b) = (start.clamp(0.0, most - 1.0), (start + length).clamp(0.0, most).max(start.clamp(0.0, most - 1.0)));
    let first = (a.floor() as usize).min(n - 1);
    let last = if b > a { ((b.ceil() as usize).max(first + 1) - 1).min(n - 1) } else { first };
    let begin = weights.len();
    for i in first..=last {
        // The border's pixel stands for all beyond it.
        let from = if i == 0 { f64::NEG_INFINITY } else { i as f64 };
        let to = if i + 1 == n { f64::INFINITY } else { (i + 1) as f64 };
        let share = ((start + length).min(to) - start.max(from)).max(0.0) / length;
        weights.push(share as f32);
    }
    Span { first, count: last - first + 1, weights: begin }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_row(row: &[u8], weight: f32, line: &mut [f32]) {
    for (sum, &v) in line.iter_mut().zip(row) {
        *sum += weight * f32::from(v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn image() -> Image<u8> {
        Image::from_fn(31, 23, |x, y| ((x * 37 + y * y * 11 + x * y * 3) % 251) as u8).unwrap()
    }

    /// The mean over a cell, by many samples.
    fn slow(image: &Image<u8>, left: f64, top: f64, width: f64, height: f64) -> f64 {
        const N: usize = 200;
        let at = |from: f64, length: f64, k: usize| (from + length * (k as f64 + 0.5) / N as f64).floor() as isize;
        let mut sum = 0.0;
        for j in 0..N {
            for i in 0..N {
                sum += f64::from(image.view().clamped(at(left, width, i), at(top, height, j)));
            }
        }
        sum / (N * N) as f64
    }

    #[test]
    fn pixels_are_means_over_parts_of_boxes() {
        let image = image();
        let mut sampler = PatchSampler::default();
        let mut patch = Vec::new();
        for (l, t, w, h) in [
            (3.2, 4.7, 17.0, 11.3),
            (0.0, 0.0, 31.0, 23.0),
            (-6.0, -3.5, 20.0, 12.0),
            (25.0, 18.0, 14.0, 9.0),
            (10.3, 9.1, 2.0, 1.5),
            (50.0, 40.0, 5.0, 5.0),
            (-20.0, 3.0, 10.0, 8.0),
        ] {
            sampler.sample(image.view(), &BBox::from_ltwh(l, t, w, h), 4, &mut patch);
            for (k, got) in patch.iter().enumerate() {
                let (i, j) = ((k % 4) as f64, (k / 4) as f64);
                let want = slow(&image, l + i * w / 4.0, t + j * h / 4.0, w / 4.0, h / 4.0);
                assert!((f64::from(*got) - want).abs() < 1.5, "{l} {t} {w} {h}, {k}: {got} is not {want}");
            }
        }
        // One pixel each: the image itself.
        sampler.sample(image.view(), &BBox::from_ltwh(5.0, 6.0, 8.0, 8.0), 8, &mut patch);
        assert!((0..64).all(|k| (patch[k] - f32::from(image.row(6 + k / 8)[5 + k % 8])).abs() < 1e-3));
    }

    #[test]
    fn senseless_boxes_and_flat_ones_give_zeros() {
        let image = image();
        let mut sampler = PatchSampler::default();
        let mut patch = vec![9.0];
        for bbox in [BBox::from_ltwh(f64::NAN, 0.0, 4.0, 4.0), BBox::from_ltwh(3.0, 3.0, 0.0, 4.0)] {
            assert!(!sampler.normalized(image.view(), &bbox, 3, &mut patch));
            assert_eq!(patch, [0.0; 9]);
        }
        let flat = Image::filled(9, 9, 77).unwrap();
        assert!(!sampler.normalized(flat.view(), &BBox::from_ltwh(1.0, 1.0, 6.0, 6.0), 3, &mut patch));
        assert_eq!(patch, [0.0; 9]);
        assert!(sampler.normalized(image.view(), &BBox::from_ltwh(4.0, 5.0, 12.0, 9.0), 15, &mut patch));
        let norm: f32 = patch.iter().map(|v| v * v).sum();
        assert!((norm - 1.0).abs() < 1e-4 && patch.iter().sum::<f32>().abs() < 1e-3);
    }
}
