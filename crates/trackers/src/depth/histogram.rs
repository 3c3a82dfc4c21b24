use super::{HistogramParams, samples};
use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;
use serde::{Deserialize, Serialize};

/// Bins of a histogram of depths (zhai2024, eq. 26).
pub const BINS: usize = 32;

/// How the depths in a box are distributed: 32 bins that sum to one; without any data all are zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "DepthHistogram", transparent)]
pub struct DepthHistogram([f64; BINS]);

pursuit_estimation::checked!(DepthHistogram);

impl DepthHistogram {
    fn restored(self) -> Result<Self, &'static str> {
        let sum: f64 = self.0.iter().sum();
        let sound = self.0.iter().all(|b| (0.0..=1.0).contains(b)) && sum <= 1.0 + 1e-6;
        if sound { Ok(self) } else { Err("its depth histogram does not sum to one") }
    }
}

impl DepthHistogram {
    /// Of the depths in `bbox`. A depth counts for the two bins about it in proportion, so that a surface that moves across
    /// the border of two bins changes its histogram smoothly.
    pub fn of(params: &HistogramParams, depth: ImageView<'_, u16>, bbox: &BBox) -> Self {
        let mut bins = [0.0; BINS];
        let mut total = 0.0;
        for mm in samples(depth, bbox, params.side).filter(|mm| *mm > 0) {
            let at = f64::from(mm) / 1000.0 * (BINS as f64 / params.range_m) - 0.5;
            let at = at.clamp(0.0, (BINS - 1) as f64);
            let low = at as usize;
            let share = at - low as f64;
            bins[low] += 1.0 - share;
            bins[(low + 1).min(BINS - 1)] += share;
            total += 1.0;
        }
        if total > 0.0 {
            bins.iter_mut().for_each(|b| *b /= total);
        }
        Self(bins)
    }

    /// The Bhattacharyya coefficient with another one, `[0, 1]` (zhai2024, eq. 26).
    pub fn similarity(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a * b).sqrt()).sum::<f64>().min(1.0)
    }

    /// Takes in `rate` (`[0, 1]`) of another one, unless that is empty.
    pub fn blend(&mut self, other: &Self, rate: f64) {
        if other.0.iter().any(|b| *b > 0.0) {
            self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += rate * (b - *a));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_estimation::zhai2024::bhattacharyya_coefficient;
    use pursuit_imaging::Image;

    fn of(near: u16, far: u16) -> DepthHistogram {
        let image = Image::from_fn(24, 24, |x, _| if x < 12 { near } else { far }).unwrap();
        DepthHistogram::of(&HistogramParams::default(), image.view(), &BBox::from_ltwh(0.0, 0.0, 24.0, 24.0))
    }

    #[test]
    fn depths_count_for_the_bins_about_them() {
        // 1.125 m is the middle of the fifth bin, 2.25 m lies between the ninth and the tenth.
        let bins = of(1125, 2250).0;
        let want = |k: usize| match k {
            4 => 0.5,
            8 | 9 => 0.25,
            _ => 0.0,
        };
        assert!(bins.iter().enumerate().all(|(k, b)| (b - want(k)).abs() < 1e-12), "{bins:?}");
        let far = of(60, 60_000).0;
        assert_eq!((far[0], far[BINS - 1]), (0.5, 0.5));
        let half = of(0, 1125).0;
        assert_eq!(half[4], 1.0, "what has no data does not count");
        assert_eq!(of(0, 0).0, [0.0; BINS]);
    }

    #[test]
    fn similarity_is_the_coefficient_of_bhattacharyya() {
        let (a, b) = (of(1125, 2250), of(1125, 1125));
        let want = bhattacharyya_coefficient(&a.0, &b.0).unwrap();
        assert!((a.similarity(&b) - want).abs() < 1e-12 && (want - 0.5_f64.sqrt()).abs() < 1e-12);
        assert!((a.similarity(&a) - 1.0).abs() < 1e-12);
        assert_eq!(a.similarity(&of(5000, 5000)), 0.0);
    }

    #[test]
    fn blending_keeps_the_sum() {
        let (mut a, b) = (of(1125, 1125), of(1125, 2250));
        a.blend(&b, 0.5);
        assert!((a.0[4] - 0.75).abs() < 1e-12 && (a.0.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let before = a;
        a.blend(&of(0, 0), 0.5);
        assert_eq!(a, before);
        assert!(DepthHistogram([0.5; BINS]).restored().is_err() && a.restored().is_ok());
    }
}
