use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use serde::{Deserialize, Serialize};

/// Bins of each channel.
const BINS: usize = 16;
/// Cells of a box, each with histograms of its own: what is above is told from what is below.
const CELLS: usize = 4;
/// Histograms: three channels of each cell.
const HISTOGRAMS: usize = 3 * CELLS;
/// Points along a side of the grid that they are made of; even, so that every point is in one cell.
const SIDE: usize = 12;

/// How the colours in a box are distributed: 16 bins of red, green and blue in each quarter, each histogram summing to one;
/// empty where the quarter lies outside of the frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f32>", into = "Vec<f32>")]
pub struct QuarterColors(Box<[[f32; BINS]; HISTOGRAMS]>);

impl From<QuarterColors> for Vec<f32> {
    fn from(colors: QuarterColors) -> Self {
        colors.0.as_flattened().to_vec()
    }
}

impl TryFrom<Vec<f32>> for QuarterColors {
    type Error = &'static str;

    fn try_from(values: Vec<f32>) -> Result<Self, Self::Error> {
        let rows = values.as_chunks::<BINS>().0;
        let sound = values.len() == BINS * HISTOGRAMS
            && values.iter().all(|v| (0.0..=1.0).contains(v))
            && rows.iter().all(|row| row.iter().sum::<f32>() <= 1.0 + 1e-4);
        let mut colors = Self::empty();
        if !sound {
            return Err("its colour histograms do not sum to one");
        }
        colors.0.iter_mut().zip(rows).for_each(|(to, from)| *to = *from);
        Ok(colors)
    }
}

impl QuarterColors {
    /// Nothing at all.
    pub fn empty() -> Self {
        Self(Box::new([[0.0; BINS]; HISTOGRAMS]))
    }

    /// Becomes the colours in `bbox`.
    pub fn measure(&mut self, color: ImageView<'_, Rgb8>, bbox: &BBox) {
        self.0.iter_mut().for_each(|h| h.fill(0.0));
        let size = color.size();
        let mut counts = [0.0_f32; CELLS];
        let at = |low: f64, length: f64, k: usize, n: usize| {
            let v = low + (k as f64 + 0.5) * length / SIDE as f64;
            (v >= 0.0 && v < n as f64).then_some(v as usize)
        };
        for i in 0..SIDE {
            let Some(y) = at(bbox.top(), bbox.height(), i, size.height) else { continue };
            let row = color.row(y);
            for j in 0..SIDE {
                let Some(x) = at(bbox.left(), bbox.width(), j, size.width) else { continue };
                let cell = 2 * (2 * i / SIDE) + 2 * j / SIDE;
                counts[cell] += 1.0;
                for (channel, value) in row[x].iter().enumerate() {
                    self.0[3 * cell + channel][usize::from(*value) * BINS / 256] += 1.0;
                }
            }
        }
        for (k, histogram) in self.0.iter_mut().enumerate() {
            let count = counts[k / 3];
            if count > 0.0 {
                histogram.iter_mut().for_each(|b| *b /= count);
            }
        }
    }

    /// The mean Bhattacharyya coefficient of the histograms of another box with these, `[0, 1]`.
    pub fn similarity(&self, other: &Self) -> f64 {
        let one = |(a, b): (&[f32; BINS], &[f32; BINS])| a.iter().zip(b).map(|(a, b)| (a * b).sqrt()).sum::<f32>();
        let sum: f32 = self.0.iter().zip(other.0.iter()).map(one).sum();
        f64::from(sum / HISTOGRAMS as f32).min(1.0)
    }

    /// Takes in `rate` (`[0, 1]`) of another box's.
    pub fn blend(&mut self, other: &Self, rate: f64) {
        let rate = rate as f32;
        let pairs = self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened());
        pairs.for_each(|(a, b)| *a += rate * (b - *a));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn of(upper: Rgb8, lower: Rgb8) -> QuarterColors {
        let image = Image::from_fn(24, 24, |_, y| if y < 12 { upper } else { lower }).unwrap();
        let mut colors = QuarterColors::empty();
        colors.measure(image.view(), &BBox::from_ltwh(0.0, 0.0, 24.0, 24.0));
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
        assert_eq!(colors.0[0][12], 1.0);
        assert_eq!(colors.0[11][12], 1.0);
    }

    #[test]
    fn what_lies_outside_is_like_nothing() {
        let image = Image::filled(24, 24, [100, 100, 100]).unwrap();
        let mut half = QuarterColors::empty();
        half.measure(image.view(), &BBox::from_ltwh(12.0, 0.0, 24.0, 24.0));
        let whole = of([100; 3], [100; 3]);
        assert!((half.similarity(&whole) - 0.5).abs() < 1e-6);
        let mut blended = whole.clone();
        blended.blend(&half, 0.5);
        assert!((blended.0[0][6] - 1.0).abs() < 1e-6 && (blended.0[3][6] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn histograms_that_cannot_be_are_refused() {
        let whole = of([100; 3], [100; 3]);
        assert_eq!(QuarterColors::try_from(Vec::from(whole.clone())).unwrap(), whole);
        assert!(QuarterColors::try_from(vec![0.5; BINS * HISTOGRAMS]).is_err());
        assert!(QuarterColors::try_from(vec![0.0; 3]).is_err());
    }
}
