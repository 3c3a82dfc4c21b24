//! Where a velocity jumps: a bounce, a blow, a kick.
//!
//! Around each place that stands out, a path with a kink (a parabola whose velocity jumps) is held against a smooth one with a
//! number more (a polynomial of fourth order). Only where the kink explains what the smooth path does not is there a jump: what
//! merely turns fast is not one.

use super::Place;
use super::likelihood::Scale;
use nalgebra::{SMatrix, SVector, Vector2};

/// Places on each side of a kink.
const SIDE: usize = 6;
/// Fourth differences of independent errors of variance 1 have this variance.
const FOURTH: f64 = 70.0;
/// Trajectories are written to a thousandth of a pixel.
const LEAST_ERROR: f64 = 3e-4;
/// A place stands out from this many standard deviations on.
const STANDS_OUT: f64 = 2.5;
/// How many times the variance of a measurement the kink has to explain more than the smooth path.
const EXPLAINS: f64 = 60.0;
/// What the kink may leave unexplained, in variances a number.
const LEAVES: f64 = 4.0;

/// A jump of the velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Break {
    /// The first place after it.
    pub place: usize,
    /// When it was, in seconds.
    pub time_s: f64,
    /// The standard deviation of that.
    pub error_s: f64,
}

/// Jumps of the velocity, in order of time.
pub(super) fn find(places: &[Place], scale: &Scale) -> Vec<Break> {
    let mut at: Vec<Vector2<f64>> = places.iter().map(|p| p.at / scale.length).collect();
    let t: Vec<f64> = places.iter().map(|p| p.time_s / scale.step_s).collect();
    // A ball that is blurred along its way is measured worse along it than across: each axis has its own error, which is 1
    // from here on.
    let errors = [0, 1].map(|axis| error_of(&fourth(&at).map(|d| d[axis].abs()).collect::<Vec<_>>()));
    at.iter_mut().for_each(|p| p.component_div_assign(&Vector2::from(errors)));
    let limit = STANDS_OUT * FOURTH.sqrt();
    let mut found: Vec<(usize, Kink)> = Vec::new();
    for (i, difference) in fourth(&at).enumerate() {
        if difference.amax() < limit {
            continue;
        }
        for k in (i + 1..i + 5).filter(|k| *k >= 1) {
            let Some(kink) = kink(&t, &at, k) else { continue };
            // Kinks that are near each other are one: the one that leaves least.
            match found.last_mut().filter(|(last, _)| k.abs_diff(*last) < SIDE) {
                Some(last) if last.1.remains > kink.remains => *last = (k, kink),
                Some(_) => {}
                None => found.push((k, kink)),
            }
        }
    }
    let one = |(place, kink): (usize, Kink)| Break {
        place,
        time_s: kink.moment * scale.step_s,
        error_s: kink.error * scale.step_s,
    };
    found.into_iter().map(one).collect()
}

/// The fourth differences of places.
fn fourth(at: &[Vector2<f64>]) -> impl Iterator<Item = Vector2<f64>> {
    at.windows(5).map(|w| w[0] - w[1] * 4.0 + w[2] * 6.0 - w[3] * 4.0 + w[4])
}

/// The standard deviation of a measurement by the fourth differences on its axis: by their lower quartile, which jumps do not
/// move though they are in every second difference. That of |χ| in one dimension is 0.3186.
fn error_of(differences: &[f64]) -> f64 {
    let mut sizes = differences.to_vec();
    let quarter = sizes.len() / 4;
    let quartile = if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(quarter, f64::total_cmp).1 };
    (quartile / 0.3186 / FOURTH.sqrt()).max(LEAST_ERROR)
}

/// A kink between two places, in steps and standard deviations of a measurement.
struct Kink {
    moment: f64,
    error: f64,
    /// The sum of squares that it leaves.
    remains: f64,
}

/// The kink between places `k − 1` and `k`; none where it does not explain the places around better than a smooth path, or there
/// are too few places to tell.
fn kink(t: &[f64], at: &[Vector2<f64>], k: usize) -> Option<Kink> {
    let from = k.saturating_sub(SIDE);
    let to = (k + SIDE).min(t.len());
    if k < from + 4 || to < k + 4 || t[to - 1] - t[from] > 3.0 * (2 * SIDE) as f64 {
        return None;
    }
    let (t, at, k) = (&t[from..to], &at[from..to], k - from);
    let span = 0.5 * (t[t.len() - 1] - t[0]);
    let middle = 0.5 * (t[k - 1] + t[k]);
    let (smooth, _) = fitted(t, at, |t| {
        let s = (t - middle) / span;
        SVector::<f64, 5>::from([1.0, s, s * s, s.powi(3), s.powi(4)])
    })?;
    if smooth < EXPLAINS {
        return None;
    }
    let with_kink = |moment: f64, at: &[Vector2<f64>]| {
        fitted(t, at, |t| {
            let s = (t - middle) / span;
            SVector::<f64, 4>::from([1.0, s, s * s, ((t - moment) / span).max(0.0)])
        })
    };
    // The moment lies somewhere between both places: where least is left over, by the golden section.
    let left = |moment: f64| with_kink(moment, at).map_or(f64::INFINITY, |f| f.0);
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (t[k - 1], t[k]);
    for _ in 0..24 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if left(a) < left(b) { high = b } else { low = a }
    }
    let moment = 0.5 * (low + high);
    let (remains, coefficients) = with_kink(moment, at)?;
    let jump = (coefficients.row(3) / span).norm();
    // Were it later, the places behind it would lie back by the jump; what of that no other coefficient can make up for tells
    // the moment.
    let behind: Vec<Vector2<f64>> = t.iter().map(|t| Vector2::repeat(f64::from(u8::from(*t > moment)))).collect();
    let (told, _) = with_kink(moment, &behind)?;
    let variance = 1.0_f64.max(remains / (2.0 * t.len() as f64 - 9.0).max(1.0));
    let error = (variance / (0.5 * told).max(1e-9)).sqrt() / jump.max(f64::MIN_POSITIVE);
    let explained = remains < LEAVES * 2.0 * t.len() as f64 && smooth - remains > EXPLAINS && smooth > 2.0 * remains;
    explained.then_some(Kink { moment, error, remains })
}

/// The least sum of squares that functions of time leave of the places, and their coefficients.
fn fitted<const N: usize>(
    t: &[f64],
    at: &[Vector2<f64>],
    functions: impl Fn(f64) -> SVector<f64, N>,
) -> Option<(f64, SMatrix<f64, N, 2>)> {
    let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SMatrix::<f64, N, 2>::zeros());
    for (t, at) in t.iter().zip(at) {
        let row = functions(*t);
        normal += row * row.transpose();
        right += row * at.transpose();
    }
    let solved = normal.cholesky()?.solve(&right);
    let left = t.iter().zip(at).map(|(t, at)| (at - solved.transpose() * functions(*t)).norm_squared()).sum();
    Some((left, solved))
}
