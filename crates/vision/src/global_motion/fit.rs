use crate::VisionError;
use crate::error::require_range;
use crate::warp::Affine;
use pursuit_geometry::Point;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use serde::{Deserialize, Serialize};

/// Which motions of the picture are considered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionKind {
    /// Shifts only.
    Translation,
    /// Shift, rotation and scale.
    #[default]
    Similarity,
}

/// Parameters of [`RobustFit`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RobustFitParams {
    /// Which motions are considered.
    pub kind: MotionKind,
    /// A point that ends farther than this from where the motion takes it does not belong to it, pixels, > 0.
    pub inlier_px: f64,
    /// Hypotheses tried, 1 to 10000. With half of the points wrong 64 pairs miss once in 10⁸ times.
    pub trials: usize,
    /// Share of the points that must agree, 0 to 1; less is no motion of the picture.
    pub least_inliers: f64,
}

impl Default for RobustFitParams {
    fn default() -> Self {
        Self { kind: MotionKind::Similarity, inlier_px: 1.0, trials: 64, least_inliers: 0.3 }
    }
}

/// The motion of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalMotion {
    /// Where a point of the first frame lies in the second, continuous pixels.
    pub second_from_first: Affine,
    /// Points that agree.
    pub inliers: usize,
    /// Points there were.
    pub points: usize,
    /// Root mean square distance of those that agree, pixels.
    pub rms_px: f64,
}

/// Robust fit of a motion to pairs of points: random samples scored by the truncated square (MSAC: Torr and Zisserman
/// 2000), then least squares on the points that agree, until these no longer change. The samples are the same in every
/// call, so equal input gives equal output.
#[derive(Debug, Clone)]
pub struct RobustFit {
    params: RobustFitParams,
    agree: Vec<bool>,
}

impl RobustFit {
    /// Rounds of least squares after the samples.
    const ROUNDS: usize = 10;
    const SEED: u64 = 0x6d6f_7469_6f6e;

    /// A fit.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: RobustFitParams) -> Result<Self, VisionError> {
        require_range("inlier_px", params.inlier_px, (f64::MIN_POSITIVE, f64::MAX), "positive and finite")?;
        require_range("trials", params.trials as f64, (1.0, 10_000.0), "from 1 to 10000")?;
        require_range("least_inliers", params.least_inliers, (0.0, 1.0), "from 0 to 1")?;
        Ok(Self { params, agree: Vec::new() })
    }

    /// The parameters.
    pub const fn params(&self) -> &RobustFitParams {
        &self.params
    }

    /// The motion that takes the first of each pair to the second; `None` when there is none on which enough agree.
    pub fn fit(&mut self, pairs: &[(Point, Point)]) -> Option<GlobalMotion> {
        let best = self.best_sample(pairs)?;
        let mut motion = best;
        self.agree.clear();
        self.agree.resize(pairs.len(), false);
        for _ in 0..Self::ROUNDS {
            let mut changed = false;
            for (agree, pair) in self.agree.iter_mut().zip(pairs) {
                let now = distance(&motion, pair) <= self.params.inlier_px;
                changed |= now != *agree;
                *agree = now;
            }
            if !changed {
                break;
            }
            let chosen = || pairs.iter().zip(&self.agree).filter(|(_, agree)| **agree).map(|(p, _)| p);
            motion = least_squares(self.params.kind, chosen).unwrap_or(best);
        }
        let within = || pairs.iter().map(|p| distance(&motion, p)).filter(|d| *d <= self.params.inlier_px);
        let inliers = within().count();
        let least = match self.params.kind {
            MotionKind::Translation => 1,
            // Two points determine a similarity; only a third confirms it.
            MotionKind::Similarity => 3,
        };
        let enough = inliers >= least && inliers as f64 >= self.params.least_inliers * pairs.len() as f64;
        let rms_px = (within().map(|d| d * d).sum::<f64>() / inliers.max(1) as f64).sqrt();
        enough.then_some(GlobalMotion { second_from_first: motion, inliers, points: pairs.len(), rms_px })
    }

    fn best_sample(&self, pairs: &[(Point, Point)]) -> Option<Affine> {
        let mut generator = Pcg32::seed_from_u64(Self::SEED);
        let limit = self.params.inlier_px * self.params.inlier_px;
        let mut best: Option<(f64, Affine)> = None;
        for _ in 0..self.params.trials {
            let mut pick = || pairs.get(((u64::from(generator.next_u32()) * pairs.len() as u64) >> 32) as usize);
            let (Some(a), Some(b)) = (pick(), pick()) else { break };
            let sample = [a, b];
            let used = if self.params.kind == MotionKind::Translation { 1 } else { 2 };
            let Some(motion) = least_squares(self.params.kind, || sample.into_iter().take(used)) else { continue };
            let cost: f64 = pairs.iter().map(|p| distance(&motion, p).powi(2).min(limit)).sum();
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, motion));
            }
        }
        best.map(|(_, motion)| motion)
    }
}

fn distance(motion: &Affine, &(first, second): &(Point, Point)) -> f64 {
    motion.apply(first).distance(second)
}

/// The motion with the least sum of squares (for similarities Umeyama 1991 without reflection, in closed form).
fn least_squares<'a, I>(kind: MotionKind, pairs: impl Fn() -> I) -> Option<Affine>
where
    I: Iterator<Item = &'a (Point, Point)>,
{
    let n = pairs().count() as f64;
    let mean = |f: &dyn Fn(&(Point, Point)) -> f64| pairs().map(f).sum::<f64>() / n;
    let (px, py) = (mean(&|p| p.0.x), mean(&|p| p.0.y));
    let (qx, qy) = (mean(&|p| p.1.x), mean(&|p| p.1.y));
    if kind == MotionKind::Translation {
        return Affine::translation(qx - px, qy - py);
    }
    let (mut along, mut across, mut spread) = (0.0, 0.0, 0.0);
    for (p, q) in pairs() {
        let (ax, ay, bx, by) = (p.x - px, p.y - py, q.x - qx, q.y - qy);
        along += ax * bx + ay * by;
        across += ax * by - ay * bx;
        spread += ax * ax + ay * ay;
    }
    if spread <= 0.0 {
        return None;
    }
    let (c, s) = (along / spread, across / spread);
    Affine::new([c, -s, qx - c * px + s * py, s, c, qy - s * px - c * py])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scattered(n: usize, seed: u64) -> Vec<Point> {
        let mut generator = Pcg32::seed_from_u64(seed);
        let mut unit = move || f64::from(generator.next_u32()) / f64::from(u32::MAX);
        (0..n).map(|_| Point::new(640.0 * unit(), 480.0 * unit())).collect()
    }

    proptest! {
        #[test]
        fn exact_pairs_give_the_motion_exactly(
            scale in 0.8f64..1.25, angle in -0.5f64..0.5, dx in -40.0f64..40.0, dy in -40.0f64..40.0, seed in any::<u64>(),
        ) {
            let truth = Affine::similarity(scale, angle, dx, dy).unwrap();
            // Four of ten points move together, but otherwise; the six agree on the truth.
            let other = Affine::translation(15.0, -9.0).unwrap();
            let pairs: Vec<_> = scattered(100, seed).into_iter().enumerate()
                .map(|(i, p)| (p, if i % 10 < 6 { truth.apply(p) } else { other.apply(truth.apply(p)) })).collect();
            let motion = RobustFit::new(RobustFitParams::default()).unwrap().fit(&pairs).unwrap();
            prop_assert!(motion.inliers >= 60 && motion.points == 100 && motion.rms_px < 1e-6);
            for (got, want) in motion.second_from_first.coefficients().iter().zip(truth.coefficients()) {
                prop_assert!((got - want).abs() < 1e-6, "{:?} {:?}", motion, truth);
            }
        }
    }

    #[test]
    fn least_squares_gives_the_best_similarity() {
        let at = |x: f64, y: f64| Point::new(x, y);
        let pairs = [(at(0.0, 0.0), at(1.0, 2.0)), (at(2.0, 0.0), at(4.0, 2.0)), (at(0.0, 2.0), at(1.0, 4.0))];
        let shift = least_squares(MotionKind::Translation, || pairs.iter()).unwrap();
        let got = shift.coefficients();
        assert!((got[2] - 4.0 / 3.0).abs() < 1e-12 && (got[5] - 2.0).abs() < 1e-12);
        // No similarity nearby has a smaller sum of squares.
        let best = least_squares(MotionKind::Similarity, || pairs.iter()).unwrap();
        let cost = |m: &Affine| pairs.iter().map(|p| distance(m, p).powi(2)).sum::<f64>();
        for (i, (c, s, x, y)) in
            [(1e-4, 0.0, 0.0, 0.0), (0.0, 1e-4, 0.0, 0.0), (0.0, 0.0, 1e-4, 0.0), (0.0, 0.0, 0.0, 1e-4)]
                .into_iter()
                .enumerate()
        {
            for sign in [1.0, -1.0] {
                let m = best.coefficients();
                let (c, s, x, y) = (sign * c, sign * s, sign * x, sign * y);
                let near = Affine::new([m[0] + c, m[1] - s, m[2] + x, m[3] + s, m[4] + c, m[5] + y]).unwrap();
                assert!(cost(&near) > cost(&best), "{i} {sign}");
            }
        }
    }

    #[test]
    fn too_little_agreement_is_no_motion() {
        let mut fit = RobustFit::new(RobustFitParams::default()).unwrap();
        assert_eq!(fit.fit(&[]), None);
        let same = (Point::new(3.0, 4.0), Point::new(5.0, 6.0));
        assert_eq!(fit.fit(&[same; 5]), None, "a point has no scale");
        let chaos: Vec<_> = scattered(60, 1).into_iter().zip(scattered(60, 2)).collect();
        assert_eq!(fit.fit(&chaos), None);
        let params = RobustFitParams { kind: MotionKind::Translation, ..RobustFitParams::default() };
        let shift = RobustFit::new(params).unwrap().fit(&[same]).unwrap();
        assert_eq!((shift.second_from_first, shift.inliers), (Affine::translation(2.0, 2.0).unwrap(), 1));
        for bad in [
            RobustFitParams { inlier_px: 0.0, ..params },
            RobustFitParams { trials: 0, ..params },
            RobustFitParams { least_inliers: f64::NAN, ..params },
        ] {
            assert!(RobustFit::new(bad).is_err());
        }
    }

    #[test]
    fn equal_input_gives_equal_output() {
        let truth = Affine::similarity(1.02, 0.01, 3.0, -2.0).unwrap();
        let noise = scattered(200, 9);
        let pairs: Vec<_> = scattered(200, 5)
            .into_iter()
            .zip(noise)
            .map(|(p, n)| {
                let q = truth.apply(p);
                (p, Point::new(q.x + (n.x - 320.0) / 640.0, q.y + (n.y - 240.0) / 480.0))
            })
            .collect();
        let mut fit = RobustFit::new(RobustFitParams::default()).unwrap();
        let first = fit.fit(&pairs).unwrap();
        assert_eq!(fit.fit(&pairs), Some(first));
        assert_eq!(first.inliers, 200);
        // Uniform in ±½ both ways: rms √(2/12).
        assert!((first.rms_px - (1.0f64 / 6.0).sqrt()).abs() < 0.03, "{}", first.rms_px);
        let (scale, angle) = (first.second_from_first.scale(), first.second_from_first.angle_rad());
        assert!((scale - 1.02).abs() < 5e-4 && (angle - 0.01).abs() < 5e-4, "{first:?}");
    }
}
