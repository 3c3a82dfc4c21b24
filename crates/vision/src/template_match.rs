//! Where a picture looks like a template: the correlation coefficient at every place of a window.

use crate::window::PixelWindow;
use pursuit_geometry::Point;
use pursuit_imaging::ImageView;

/// A place that looks more like the template than those around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// The middle of the template there, continuous pixels of the picture.
    pub center: Point,
    /// Correlation coefficient with the template, −1 to 1.
    pub correlation: f64,
}

/// Looks for a template in a picture. Owns its scratch, and allocates nothing once it has been as large as it becomes.
#[derive(Debug, Clone, Default)]
pub struct TemplateMatcher {
    /// Means over cells of the window, row by row.
    cells: Vec<f32>,
    /// Σ and Σ of squares of the cells above and to the left, one more row and column than `cells`.
    sums: Vec<(f64, f64)>,
    line: Vec<f32>,
    scores: Vec<f32>,
    found: Vec<Match>,
}

impl TemplateMatcher {
    /// The places of `window` of `gray` that look most like `template`, the best first, `most` at most: each is better than its
    /// neighbours, and correlates by more than 0. The template is `side` × `side` values, each the mean over `step` × `step` pixels, and is
    /// looked for at every `step`-th pixel, wholly inside of the window.
    pub fn find(
        &mut self,
        gray: ImageView<'_, u8>,
        window: &PixelWindow,
        template: &[f32],
        (side, step): (usize, usize),
        most: usize,
    ) -> &[Match] {
        self.found.clear();
        let Some(view) = gray.crop(window.x, window.y, window.width, window.height) else { return &self.found };
        if side == 0 || step == 0 || template.len() != side * side {
            return &self.found;
        }
        let (width, height) = (view.width() / step, view.height() / step);
        let mean = template.iter().sum::<f32>() / (side * side) as f32;
        let energy = template.iter().map(|v| f64::from(v - mean).powi(2)).sum::<f64>();
        if width < side || height < side || energy <= 0.0 {
            return &self.found;
        }
        self.reduce(view, (width, height), step);
        let (across, down) = (width - side + 1, height - side + 1);
        self.scores.clear();
        for y in 0..down {
            self.line.clear();
            self.line.resize(across, 0.0);
            for (j, row) in template.chunks_exact(side).enumerate() {
                let cells = &self.cells[(y + j) * width..][..width];
                for (i, value) in row.iter().enumerate() {
                    let weight = value - mean;
                    self.line.iter_mut().zip(&cells[i..]).for_each(|(sum, cell)| *sum += weight * cell);
                }
            }
            let n = (side * side) as f64;
            for (x, &common) in self.line.iter().enumerate() {
                let (sum, squares) = self.window_sums((x, y), side, width);
                let spread = squares - sum * sum / n;
                // Less than one code of noise over the window tells nothing.
                let score = if spread > n { f64::from(common) / (spread * energy).sqrt() } else { 0.0 };
                self.scores.push(score as f32);
            }
        }
        self.choose((across, down), most, |x, y| {
            let middle = |from: usize, at: usize| from as f64 + step as f64 * (at as f64 + side as f64 / 2.0);
            Point::new(middle(window.x, x), middle(window.y, y))
        });
        &self.found
    }

    fn reduce(&mut self, view: ImageView<'_, u8>, (width, height): (usize, usize), step: usize) {
        self.cells.clear();
        self.sums.clear();
        self.sums.resize(width + 1, (0.0, 0.0));
        for y in 0..height {
            let mut left = (0.0, 0.0);
            self.sums.push(left);
            for x in 0..width {
                let rows = (y * step..(y + 1) * step).map(|row| &view.row(row)[x * step..(x + 1) * step]);
                let sum: u32 = rows.map(|row| row.iter().map(|&v| u32::from(v)).sum::<u32>()).sum();
                let value = sum as f32 / (step * step) as f32;
                self.cells.push(value);
                left = (left.0 + f64::from(value), left.1 + f64::from(value).powi(2));
                let above = self.sums[y * (width + 1) + x + 1];
                self.sums.push((above.0 + left.0, above.1 + left.1));
            }
        }
    }

    fn window_sums(&self, (x, y): (usize, usize), side: usize, width: usize) -> (f64, f64) {
        let at = |x: usize, y: usize| self.sums[y * (width + 1) + x];
        let (a, b, c, d) = (at(x, y), at(x + side, y), at(x, y + side), at(x + side, y + side));
        (d.0 - b.0 - c.0 + a.0, d.1 - b.1 - c.1 + a.1)
    }

    fn choose(&mut self, (across, down): (usize, usize), most: usize, center: impl Fn(usize, usize) -> Point) {
        for y in 0..down {
            for x in 0..across {
                let score = self.scores[y * across + x];
                // The last of equal neighbours is the better one, so that a plateau is found once.
                let better = |(nx, ny): (usize, usize)| {
                    let other = self.scores[ny * across + nx];
                    other > score || (other == score && (ny, nx) > (y, x))
                };
                let around = (y.saturating_sub(1)..=(y + 1).min(down - 1))
                    .flat_map(|ny| (x.saturating_sub(1)..=(x + 1).min(across - 1)).map(move |nx| (nx, ny)));
                let correlation = f64::from(score);
                let worst = self.found.last().map_or(0.0, |m| m.correlation);
                if score <= 0.0 || (self.found.len() >= most && correlation <= worst) || around.into_iter().any(better)
                {
                    continue;
                }
                let place = self.found.partition_point(|m| m.correlation >= correlation);
                self.found.insert(place, Match { center: center(x, y), correlation });
                self.found.truncate(most);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::texture;
    use crate::patch::correlation;
    use pursuit_imaging::Image;

    fn picture() -> Image<u8> {
        texture(120, 90, [256, 0, 300_000, 0, 256, 300_000])
    }

    /// Means over `step` × `step` pixels from (`x`, `y`) on.
    fn patch(image: &Image<u8>, (x, y): (usize, usize), side: usize, step: usize) -> Vec<f32> {
        let mean = |x: usize, y: usize| {
            let sum: u32 = (0..step * step).map(|k| u32::from(image.row(y + k / step)[x + k % step])).sum();
            sum as f32 / (step * step) as f32
        };
        (0..side * side).map(|i| mean(x + i % side * step, y + i / side * step)).collect()
    }

    #[test]
    fn every_place_is_compared_as_the_definition_says() {
        let image = picture();
        for (side, step, window) in [(7, 1, (10, 5, 60, 50)), (5, 3, (0, 0, 120, 90)), (9, 2, (31, 20, 80, 60))] {
            let window = PixelWindow { x: window.0, y: window.1, width: window.2, height: window.3 };
            let template = patch(&image, (window.x + 4 * step, window.y + 6 * step), side, step);
            let mut matcher = TemplateMatcher::default();
            let found = matcher.find(image.view(), &window, &template, (side, step), 5).to_vec();
            let (across, down) = (window.width / step - side + 1, window.height / step - side + 1);
            let score = |x: usize, y: usize| {
                let there = patch(&image, (window.x + x * step, window.y + y * step), side, step);
                f64::from(correlation(&template, &there))
            };
            let all: Vec<f64> = (0..across * down).map(|i| score(i % across, i / across)).collect();
            for (i, slow) in all.iter().enumerate() {
                assert!((slow - f64::from(matcher.scores[i])).abs() < 2e-3, "{side} {step} {i}: {slow}");
            }
            let best = found.first().unwrap();
            let middle = |from: usize, at: usize| (from + at * step) as f64 + (side * step) as f64 / 2.0;
            assert_eq!(best.center, Point::new(middle(window.x, 4), middle(window.y, 6)));
            assert!(best.correlation > 0.999 && found.len() == 5);
            assert!(found.windows(2).all(|pair| pair[0].correlation >= pair[1].correlation));
        }
    }

    #[test]
    fn plain_ground_and_what_does_not_fit_are_no_match() {
        let (flat, image) = (Image::from_fn(60, 40, |_, _| 77).unwrap(), picture());
        let template = patch(&image, (40, 40), 9, 1);
        let mut matcher = TemplateMatcher::default();
        let whole = PixelWindow { x: 0, y: 0, width: 60, height: 40 };
        assert!(matcher.find(flat.view(), &whole, &template, (9, 1), 5).is_empty());
        assert!(matcher.find(flat.view(), &whole, &[77.0; 81], (9, 1), 5).is_empty());
        let small = PixelWindow { x: 0, y: 0, width: 8, height: 40 };
        assert!(matcher.find(image.view(), &small, &template, (9, 1), 5).is_empty());
        assert!(matcher.find(image.view(), &whole, &template, (0, 1), 5).is_empty());
        assert!(matcher.find(image.view(), &whole, &template, (9, 0), 5).is_empty());
        let outside = PixelWindow { x: 100, y: 80, width: 60, height: 40 };
        assert!(matcher.find(image.view(), &outside, &template, (9, 1), 5).is_empty());
    }
}
