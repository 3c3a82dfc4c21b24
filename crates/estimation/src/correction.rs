//! The two ways a belief is corrected by a linear measurement: any sensor at once in Joseph form, and components that
//! are read directly, one after the other.

use nalgebra::{SMatrix, SVector};

use crate::matrix::{PIVOT_ROUNDING, require_finite, sandwich, times_transpose, times_vector};
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result};

/// `P ← (I−KH) P (I−KH)ᵀ + K R Kᵀ` and `x ← x + K ν`, for any gain: the Joseph form holds for gains that are not optimal
/// too.
#[inline]
pub(crate) fn joseph<const M: usize, const N: usize>(
    belief: &Gaussian<N>,
    measurement: &LinearMeasurement<M, N>,
    residual: &SVector<f64, M>,
    gain: &SMatrix<f64, N, M>,
) -> Result<Gaussian<N>> {
    let mean = belief.mean() + times_vector(gain, residual);
    let keep = SMatrix::<f64, N, N>::identity() - times_transpose(gain, &measurement.matrix().transpose());
    let covariance = sandwich(&keep, belief.covariance()) + sandwich(gain, measurement.noise());
    Gaussian::computed(mean, covariance)
}

/// The optimal correction by components of the state that are read directly, each with noise of its own, in place: the
/// same as all at once, up to rounding, with `M` divisions in place of an inverse.
///
/// With `c` the measured column of `P`, `r` its noise and `s = c_i + r`, the Joseph form of one component with its optimal
/// gain `c / s` is `P_ab − c_a c_b / s` off the measured row and column, and `c r / s` on them. The latter is a product: the
/// difference that costs the short form its digits where `r` is small against `P` is done on paper.
///
/// The `s` and the gains of the components still to come are the pivots and columns of `S = L D Lᵀ`.
///
/// # Errors
/// As [`Gaussian::update`]; mean and covariance are then as they were.
#[inline]
pub(crate) fn by_components<const M: usize, const N: usize>(
    mean: &mut SVector<f64, N>,
    covariance: &mut SMatrix<f64, N, N>,
    components: &[usize; M],
    noise: &SMatrix<f64, M, M>,
    value: &SVector<f64, M>,
) -> Result<Innovation<M>> {
    require_finite("the measurement", value)?;
    let before = (*mean, *covariance);
    // What each variance was last reduced from by a difference: its digits are lost below this size. A component that was
    // read keeps them all, as a product does.
    let mut reduced_from: [f64; N] = std::array::from_fn(|a| covariance.data.0[a][a]);
    let (x, p) = (&mut mean.data.0[0], &mut covariance.data.0);
    let (mut residual, mut factor) = (SVector::<f64, M>::zeros(), SMatrix::<f64, M, M>::zeros());
    for j in 0..M {
        let (i, r, read) = (components[j], noise.data.0[j][j], value.data.0[0][j]);
        let column = p[i];
        let pivot = column[i] + r;
        // Written so that a NaN pivot fails too.
        let sound = pivot > PIVOT_ROUNDING * (reduced_from[i] + r) && pivot < f64::INFINITY;
        if !sound {
            (*mean, *covariance) = before;
            return Err(EstimationError::SingularInnovation { row: j, pivot });
        }
        let inverse = 1.0 / pivot;
        residual.data.0[0][j] = read - before.0.data.0[0][i];
        factor.data.0[j][j] = pivot;
        for later in j + 1..M {
            factor.data.0[j][later] = column[components[later]] * inverse;
        }
        let unexpected = (read - x[i]) * inverse;
        let kept = r * inverse;
        for b in 0..N {
            x[b] += column[b] * unexpected;
            let weight = column[b];
            // Axes that are not correlated with this one stay as they are.
            if weight != 0.0 && b != i {
                for a in 0..N {
                    // In this order the product is symmetric to the last bit.
                    p[b][a] -= (column[a] * weight) * inverse;
                }
                p[b][i] = weight * kept;
            }
        }
        p[i] = column.map(|c| c * kept);
        reduced_from[i] = p[i][i];
    }
    // An overflow off the diagonal is one on it too.
    if !(0..N).map(|a| x[a] + p[a][a]).sum::<f64>().is_finite() {
        (*mean, *covariance) = before;
        return Err(EstimationError::Overflow { what: "the new belief" });
    }
    Ok(Innovation::from_factor(residual, factor))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2, vector};

    /// The twin: the textbook's form, with an inverse.
    fn textbook<const M: usize, const N: usize>(
        belief: &Gaussian<N>,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
        let (h, r, p) = (measurement.matrix(), measurement.noise(), belief.covariance());
        let gain = p * h.transpose() * (h * p * h.transpose() + r).try_inverse().unwrap();
        let keep = SMatrix::<f64, N, N>::identity() - gain * h;
        (belief.mean() + gain * (value - h * belief.mean()), keep * p * keep.transpose() + gain * r * gain.transpose())
    }

    /// A full covariance, from a counter.
    fn full<const N: usize>(seed: f64) -> Gaussian<N> {
        let mix = SMatrix::<f64, N, N>::from_fn(|r, c| (seed + 1.7 * r as f64 + 0.9 * (c * c) as f64).sin());
        let covariance = mix * mix.transpose() + SMatrix::identity() * 0.05;
        Gaussian::new(SVector::from_fn(|r, _| seed + r as f64), (covariance + covariance.transpose()) * 0.5).unwrap()
    }

    fn agree<const M: usize, const N: usize>(sensor: &LinearMeasurement<M, N>, direct: bool) {
        assert_eq!(sensor.direct().is_some(), direct);
        for seed in 0..50 {
            let before = full::<N>(0.37 * f64::from(seed));
            let value = SVector::<f64, M>::from_fn(|r, _| (f64::from(seed) + r as f64).cos());
            let mut after = before;
            let innovation = after.update(sensor, &value).unwrap();
            let (mean, covariance) = textbook(&before, sensor, &value);
            assert!((after.mean() - mean).abs().max() < 1e-11);
            assert!((after.covariance() - covariance).abs().max() < 1e-11);
            assert_eq!(*after.covariance(), after.covariance().transpose());
            let alone = before.innovation(sensor, &value).unwrap();
            assert_eq!(innovation.residual(), alone.residual());
            assert!((innovation.covariance() - alone.covariance()).abs().max() < 1e-12);
            assert!((innovation.nis() - alone.nis()).abs() < 1e-10 * alone.nis().max(1.0));
            assert!((innovation.log_likelihood() - alone.log_likelihood()).abs() < 1e-10 * alone.nis().max(1.0));
        }
    }

    #[test]
    fn both_ways_follow_the_textbook() {
        agree(&LinearMeasurement::<2, 4>::select([0, 1], [1.0, 0.3]).unwrap(), true);
        agree(&LinearMeasurement::<4, 6>::select([5, 0, 4, 1], [1.0, 0.3, 0.01, 9.0]).unwrap(), true);
        agree(&LinearMeasurement::<2, 4>::select([3, 3], [1.0, 0.3]).unwrap(), true);
        agree(&LinearMeasurement::<1, 3>::select([2], [0.0]).unwrap(), true);
        let select = *LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap().matrix();
        let correlated = LinearMeasurement::new(select, Matrix2::new(1.0, 0.4, 0.4, 2.0)).unwrap();
        agree(&correlated, false);
        agree(&LinearMeasurement::new(select * 2.0, Matrix2::identity()).unwrap(), false);
        agree(&LinearMeasurement::new(SMatrix::<f64, 2, 4>::repeat(1.0), Matrix2::identity()).unwrap(), false);
        // The noise decides too, whenever it is set.
        assert!(correlated.with_noise(Matrix2::identity()).unwrap().direct().is_some());
    }

    #[test]
    fn what_a_sharp_sensor_leaves_is_its_own_noise() {
        // Against a variance of 1e12 the noise is below rounding: 1 − K is zero, and P (1 − K) would be.
        let mut belief = Gaussian::from_variances(vector![0.0, 0.0], vector![1e12, 1.0]).unwrap();
        let sensor = LinearMeasurement::<1, 2>::select([0], [1e-6]).unwrap();
        belief.update(&sensor, &vector![3.0]).unwrap();
        assert!((belief.covariance()[(0, 0)] / 1e-6 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_failure_half_way_changes_nothing() {
        // The second component cannot be taken in once the first is known.
        let covariance = Matrix2::new(2.0, 2.0, 2.0, 2.0 + 1e-18);
        let mut belief = Gaussian::trusted(Vector2::new(1.0, 2.0), covariance);
        let before = belief;
        let sensor = LinearMeasurement::<2, 2>::select([0, 1], [0.0, 0.0]).unwrap();
        let failure = belief.update(&sensor, &vector![5.0, 6.0]);
        assert!(matches!(failure, Err(EstimationError::SingularInnovation { row: 1, .. })), "{failure:?}");
        assert_eq!(belief, before);
        // Products of variances overflow before the variances do.
        let mut belief = Gaussian::trusted(Vector2::zeros(), Matrix2::new(1e200, 9e199, 9e199, 1e200));
        let before = belief;
        let failure = belief.update(&LinearMeasurement::<1, 2>::select([0], [1.0]).unwrap(), &vector![5.0]);
        assert!(matches!(failure, Err(EstimationError::Overflow { .. })), "{failure:?}");
        assert_eq!(belief, before);
    }
}
