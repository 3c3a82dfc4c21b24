use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use serde::{Deserialize, Serialize};

/// Cells of a box, each with histograms of its own: what is above is told from what is below.
const CELLS: usize = 4;
/// Histograms: three channels of each cell.
const HISTOGRAMS: usize = 3 * CELLS;

/// How the colours in a box are distributed: histograms of red, green and blue in each quarter, each summing to one; empty
/// where the quarter lies outside of the frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "QuarterColors", transparent)]
pub struct QuarterColors(Vec<f32>);

pursuit_estimation::checked!(QuarterColors);

impl QuarterColors {
    fn restored(self) -> Result<Self, &'static str> {
        let values = &self.0;
        let bins = values.len() / HISTOGRAMS;
        let sound = bins > 0
            && values.len() == bins * HISTOGRAMS
            && values.iter().all(|v| (0.0..=1.0).contains(v))
            && values.chunks_exact(bins).all(|row| row.iter().sum::<f32>() <= 1.0 + 1e-4);
        if sound { Ok(self) } else { Err("its colour histograms do not sum to one") }
    }
}

impl QuarterColors {
    /// Nothing at all, in histograms of `bins` bins, at least 1.
    pub fn empty(bins: usize) -> Self {
        Self(vec![0.0; bins.max(1) * HISTOGRAMS])
    }

    /// Bins of each histogram.
    pub const fn bins(&self) -> usize {
        self.0.len() / HISTOGRAMS
    }

    /// Becomes the colours in `bbox`, of a grid of `side` × `side` points, an even number.
    pub fn measure(&mut self, color: ImageView<'_, Rgb8>, bbox: &BBox, side: usize) {
        self.0.fill(0.0);
        let (size, bins) = (color.size(), self.bins());
        let mut counts = [0.0_f32; CELLS];
        let at = |low: f64, length: f64, k: usize, n: usize| {
            let v = low + (k as f64 + 0.5) * length / side as f64;
            (v >= 0.0 && v < n as f64).then_some(v as usize)
        };
        for i in 0..side {
            let Some(y) = at(bbox.top(), bbox.height(), i, size.height) else { continue };
            let row = color.row(y);
            for j in 0..side {
                let Some(x) = at(bbox.left(), bbox.width(), j, size.width) else { continue };
                let cell = 2 * (2 * i / side) + 2 * j / side;
                counts[cell] += 1.0;
                for (channel, value) in row[x].iter().enumerate() {
                    self.0[(3 * cell + channel) * bins + usize::from(*value) * bins / 256] += 1.0;
                }
            }
        }
        for (k, histogram) in self.0.chunks_exact_mut(bins).enumerate() {
            let count = counts[k / 3];
            if count > 0.0 {
                histogram.iter_mut().for_each(|b| *b /= count);
            }
        }
    }

    /// The mean Bhattacharyya coefficient of the histograms of another box with these, `[0, 1]`.
    pub fn similarity(&self, other: &Self) -> f64 {
        let one = |(a, b): (&[f32], &[f32])| a.iter().zip(b).map(|(a, b)| (a * b).sqrt()).sum::<f32>();
        let sum: f32 = self.0.chunks_exact(self.bins()).zip(other.0.chunks_exact(other.bins())).map(one).sum();
        f64::from(sum / HISTOGRAMS as f32).min(1.0)
    }

    /// Takes in `rate` (`[0, 1]`) of another box's.
    pub fn blend(&mut self, other: &Self, rate: f64) {
        let rate = rate as f32;
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += rate * (b - *a));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn of(upper: Rgb8, lower: Rgb8) -> QuarterColors {
        let image = Image::from_fn(24, 24, |_, y| if y < 12 { upper } else { lower }).unwrap();
        let mut colors = QuarterColors::empty(16);
        colors.measure(image.view(), &BBox::from_ltwh(0.0, 0.0, 24.0, 24.0), 12);
        colors
    }

    #[test]
    fn quarters_are_told_apart() {
        let (a, b) = ([200, 10, 10], [10, 10, 200]);
        let colors = of(a, b);
        assert!((colors.similarity(&colors) - 1.0).abs() < 1e-6);
        // Upside down only green is alike.
        assert!((colors.similarity(&of(b, a)) - 1.0 / 3.0).abs() < 1e-6);
        assert!((colors.similarity(&of(a, a)) - 2.0 / 3.0).abs() < 1e-6);
        assert_eq!(colors.0[12], 1.0);
        assert_eq!(colors.0[11 * 16 + 12], 1.0);
    }

    #[test]
    fn what_lies_outside_is_like_nothing() {
        let image = Image::filled(24, 24, [100, 100, 100]).unwrap();
        let mut half = QuarterColors::empty(16);
        half.measure(image.view(), &BBox::from_ltwh(12.0, 0.0, 24.0, 24.0), 12);
        let whole = of([100; 3], [100; 3]);
        assert!((half.similarity(&whole) - 0.5).abs() < 1e-6);
        let mut blended = whole.clone();
        blended.blend(&half, 0.5);
        assert!((blended.0[6] - 1.0).abs() < 1e-6 && (blended.0[3 * 16 + 6] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn histograms_that_cannot_be_are_refused() {
        let whole = of([100; 3], [100; 3]);
        assert_eq!(whole.clone().restored().unwrap(), whole);
        assert!(QuarterColors(vec![0.5; 16 * HISTOGRAMS]).restored().is_err());
        assert!(QuarterColors(vec![0.0; 3]).restored().is_err() && QuarterColors(vec![0.0; 25]).restored().is_err());
        assert!(QuarterColors(Vec::new()).restored().is_err());
        assert_eq!(QuarterColors(vec![0.5; 24]).restored().unwrap().bins(), 2);
    }
}
