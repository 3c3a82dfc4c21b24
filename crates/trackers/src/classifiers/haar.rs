use super::canvas::{Canvas, LANES, Place, Shape};
use crate::appearance::draw;
use multiversion::multiversion;
use serde::{Deserialize, Serialize};

/// Features of windows: weighted sums of the grey codes under rectangles (viola2001).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Bank {
    features: Vec<Haar>,
}

/// One feature, of up to four rectangles.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Haar {
    rects: [Rect; 4],
    count: usize,
}

/// A part of the window and what a grey code there counts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Rect {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    weight: f32,
}

/// A number in [0, 1).
pub(super) fn unit(random: &mut u64) -> f64 {
    (draw(random) >> 11) as f64 / (1u64 << 53) as f64
}

/// A whole number below `n`.
pub(super) fn below(random: &mut u64, n: usize) -> usize {
    (draw(random) % n.max(1) as u64) as usize
}

impl Haar {
    /// Two to four rectangles anywhere, with weights in [−1, 1] (babenko2011, section 4.1): the weights make the sums means.
    pub fn random(shape: &Shape, random: &mut u64) -> Self {
        let count = 2 + below(random, 3);
        let mut rects = [Rect::default(); 4];
        for rect in &mut rects[..count] {
            let (x, y) = (below(random, shape.width - 2), below(random, shape.height - 2));
            let (width, height) = (1 + below(random, shape.width - x - 1), 1 + below(random, shape.height - y - 1));
            let weight = (2.0 * unit(random) - 1.0) / (width * height) as f64;
            *rect = Rect { x, y, width, height, weight: weight as f32 };
        }
        Self { rects, count }
    }

    /// The difference between equal parts of a rectangle, as a mean in [−1, 1].
    fn difference(kind: usize, (x, y, width, height): (usize, usize, usize, usize)) -> Self {
        let part = |x, y, width: usize, height: usize, sign: f64| {
            // All light parts together have the weight of all dark ones.
            Rect { x, y, width, height, weight: (sign / (255.0 * (width * height) as f64)) as f32 }
        };
        let (w2, h2, w3, h3) = (width / 2, height / 2, (width / 3).max(1), (height / 3).max(1));
        let (w4, h4) = ((width / 4).max(1), (height / 4).max(1));
        let parts: &[Rect] = &match kind {
            0 => [part(x, y, w2, height, 1.0), part(x + w2, y, w2, height, -1.0), Rect::default(), Rect::default()],
            1 => [part(x, y, width, h2, 1.0), part(x, y + h2, width, h2, -1.0), Rect::default(), Rect::default()],
            2 => [
                part(x, y, w3, height, 0.5),
                part(x + w3, y, w3, height, -1.0),
                part(x + 2 * w3, y, w3, height, 0.5),
                Rect::default(),
            ],
            3 => [
                part(x, y, width, h3, 0.5),
                part(x, y + h3, width, h3, -1.0),
                part(x, y + 2 * h3, width, h3, 0.5),
                Rect::default(),
            ],
            4 => [
                part(x, y, w2, h2, 0.5),
                part(x + w2, y + h2, w2, h2, 0.5),
                part(x + w2, y, w2, h2, -0.5),
                part(x, y + h2, w2, h2, -0.5),
            ],
            _ => {
                let inner = part(x + w4, y + h4, width - 2 * w4, height - 2 * h4, -1.0);
                [part(x, y, width, height, 1.0), inner, Rect::default(), Rect::default()]
            }
        };
        let count = parts.iter().filter(|r| r.weight != 0.0).count();
        Self { rects: [parts[0], parts[1], parts[2], parts[3]], count }
    }

    fn is_sound(&self, shape: &Shape) -> bool {
        let fits = |from: usize, length: usize, all: usize| length > 0 && from < all && length <= all - from;
        let inside =
            |r: &Rect| r.weight.is_finite() && fits(r.x, r.width, shape.width) && fits(r.y, r.height, shape.height);
        self.rects.get(..self.count).is_some_and(|rects| !rects.is_empty() && rects.iter().all(inside))
    }

    /// In the window at `at`.
    pub fn value(&self, canvas: &Canvas, at: Place) -> f32 {
        let (sums, stride) = canvas.sums();
        let mut value = 0.0;
        for r in &self.rects[..self.count] {
            let [a, b, c, d] = corners(r, at, stride);
            let sum = sums[d].wrapping_sub(sums[b]).wrapping_sub(sums[c]).wrapping_add(sums[a]);
            value += r.weight * sum as f32;
        }
        value
    }

    /// In the windows from `at` on to the right.
    pub fn lanes(&self, canvas: &Canvas, at: Place, out: &mut [f32; LANES]) {
        let (sums, stride) = canvas.sums();
        out.fill(0.0);
        for r in &self.rects[..self.count] {
            let line = |from: usize| &sums[from..from + LANES];
            let [a, b, c, d] = corners(r, at, stride).map(line);
            add_rect(a, b, c, d, r.weight, out);
        }
    }
}

fn corners(r: &Rect, at: Place, stride: usize) -> [usize; 4] {
    let above = (at.y + r.y) * stride + at.x + r.x;
    let below = above + r.height * stride;
    [above, above + r.width, below, below + r.width]
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_rect(a: &[u32], b: &[u32], c: &[u32], d: &[u32], weight: f32, out: &mut [f32; LANES]) {
    let (a, b, c, d) = (&a[..LANES], &b[..LANES], &c[..LANES], &d[..LANES]);
    for i in 0..LANES {
        let sum = d[i].wrapping_sub(b[i]).wrapping_sub(c[i]).wrapping_add(a[i]);
        // Sums of a canvas fit a signed number, which is quicker to make a float of.
        out[i] += weight * (sum as i32) as f32;
    }
}

/// Kinds of differences.
const KINDS: usize = 6;

impl Bank {
    /// Features drawn at random.
    pub fn random(shape: &Shape, count: usize, random: &mut u64) -> Self {
        Self { features: (0..count).map(|_| Haar::random(shape, random)).collect() }
    }

    /// Differences of six kinds about a grid of 4 × 4 points, of two sizes (hare2011, section 4: 192 features).
    pub fn grid(shape: &Shape) -> Self {
        let mut features = Vec::with_capacity(192);
        for share in [0.2, 0.4] {
            for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
                let rect = |side: usize, k: usize| {
                    let length = ((share * side as f64).round() as usize).max(4);
                    let middle = side as f64 * (0.2 + 0.2 * k as f64);
                    let from = (middle - length as f64 / 2.0).round().clamp(0.0, (side - length) as f64) as usize;
                    (from, length)
                };
                let ((x, width), (y, height)) = (rect(shape.width, column), rect(shape.height, row));
                features.extend((0..KINDS).map(|kind| Haar::difference(kind, (x, y, width, height))));
            }
        }
        Self { features }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.features.len()
    }

    /// The `k`-th.
    pub fn get(&self, k: usize) -> &Haar {
        &self.features[k]
    }

    /// Puts another in the place of the `k`-th.
    pub fn replace(&mut self, k: usize, feature: Haar) {
        self.features[k] = feature;
    }

    /// All features of a window.
    pub fn values(&self, canvas: &Canvas, at: Place, out: &mut [f32]) {
        out.iter_mut().zip(&self.features).for_each(|(out, feature)| *out = feature.value(canvas, at));
    }

    /// Whether a state that was read has `count` features of windows of `shape`.
    pub fn is_sound(&self, shape: &Shape, count: usize) -> bool {
        self.features.len() == count && self.features.iter().all(|f| f.is_sound(shape))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::BBox;
    use pursuit_imaging::{Frame, Image};

    const SHAPE: Shape = Shape { width: 21, height: 34, reach: 16 };

    fn canvas() -> Canvas {
        let image = Image::from_fn(90, 90, |x, y| ((x * x * 7 + y * 13 + x * y) % 251) as u8).unwrap();
        let mut canvas = Canvas::default();
        canvas.look(&Frame::new(0, 0.0, image), &SHAPE, &BBox::from_ltwh(30.0, 30.0, 21.0, 34.0));
        canvas
    }

    /// By its definition.
    fn slow(feature: &Haar, canvas: &Canvas, at: Place) -> f64 {
        let (pixels, stride) = canvas.pixels();
        let sum = |r: &Rect| -> f64 {
            let rows = (at.y + r.y..at.y + r.y + r.height).map(|y| &pixels[y * stride + at.x + r.x..][..r.width]);
            rows.flatten().map(|v| f64::from(*v)).sum()
        };
        feature.rects[..feature.count].iter().map(|r| f64::from(r.weight) * sum(r)).sum()
    }

    #[test]
    fn values_are_weighted_sums_of_pixels() {
        let (canvas, mut random) = (canvas(), 7);
        let all = [Bank::random(&SHAPE, 60, &mut random), Bank::grid(&SHAPE)];
        for feature in all.iter().flat_map(|bank| &bank.features) {
            assert!(feature.is_sound(&SHAPE), "{feature:?}");
            let mut lanes = [0.0; LANES];
            feature.lanes(&canvas, Place { x: 1, y: 9 }, &mut lanes);
            for (i, lane) in lanes.into_iter().enumerate() {
                let at = Place { x: 1 + i, y: 9 };
                let want = slow(feature, &canvas, at);
                assert!((f64::from(feature.value(&canvas, at)) - want).abs() < 1e-3, "{feature:?}");
                assert!((f64::from(lane) - want).abs() < 1e-3, "{feature:?}");
            }
        }
    }

    #[test]
    fn differences_are_zero_on_one_value_and_at_most_one() {
        let mut canvas = Canvas::default();
        let flat = Frame::new(0, 0.0, Image::filled(90, 90, 200_u8).unwrap());
        canvas.look(&flat, &SHAPE, &BBox::from_ltwh(30.0, 30.0, 21.0, 34.0));
        let bank = Bank::grid(&SHAPE);
        assert_eq!(bank.len(), 192);
        for feature in &bank.features {
            assert!(feature.value(&canvas, SHAPE.middle()).abs() < 1e-4, "{feature:?}");
            let most: f32 = feature.rects.iter().map(|r| r.weight.max(0.0) * (255 * r.width * r.height) as f32).sum();
            assert!((most - 1.0).abs() < 1e-4, "{feature:?}");
        }
    }
}
