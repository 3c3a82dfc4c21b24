//! Beliefs about a state: a mean and a covariance, predicted and corrected.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::correction::by_components;
use crate::matrix::{
    cholesky, is_finite, log_determinant, mahalanobis_squared, require_finite, require_positive_definite,
    require_semi_definite, sandwich, times_transpose, times_vector,
};
use crate::sharp::corrected;
use crate::{EstimationError, Innovation, LinearMeasurement, Result, Transition};

/// A Gaussian belief about a state of `N` components: the linear Kalman filter's whole memory.
///
/// The filter is two calls, in any pattern the data ask for:
/// [`predict`](Self::predict) moves the belief through time, [`update`](Self::update) corrects it by a measurement.
/// A missing measurement is no update call; several sensors are several update calls.
///
/// The covariance is always finite and exactly symmetric; [`Gaussian::new`] asks for it to be positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Gaussian")]
pub struct Gaussian<const N: usize> {
    mean: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
}

crate::checked!([const N: usize] Gaussian<N>);

impl<const N: usize> Gaussian<N> {
    // A stored belief may be singular (a noise-free model predicts such), so semi-definite is enough here.
    fn restored(self) -> Result<Self> {
        require_finite("the mean", &self.mean)?;
        Ok(Self { covariance: require_semi_definite("the covariance", &self.covariance)?, ..self })
    }
}

impl<const N: usize> Gaussian<N> {
    /// A belief with `mean` and `covariance`.
    ///
    /// # Errors
    /// Where either is not finite, or the covariance is not symmetric (to 1e-9, relative) or not positive definite.
    pub fn new(mean: SVector<f64, N>, covariance: SMatrix<f64, N, N>) -> Result<Self> {
        require_finite("the mean", &mean)?;
        Ok(Self { mean, covariance: require_positive_definite("the covariance", &covariance)? })
    }

    /// A belief whose components are independent, with the variances given.
    ///
    /// # Errors
    /// Where a number is not finite or a variance is not positive.
    pub fn from_variances(mean: SVector<f64, N>, variances: SVector<f64, N>) -> Result<Self> {
        Self::new(mean, SMatrix::from_diagonal(&variances))
    }

    /// A belief of which the caller knows that it is sound.
    pub(crate) const fn trusted(mean: SVector<f64, N>, covariance: SMatrix<f64, N, N>) -> Self {
        Self { mean, covariance }
    }

    /// A belief computed from sound parts: refused only where the computation overflowed.
    #[inline]
    pub(crate) fn computed(mean: SVector<f64, N>, covariance: SMatrix<f64, N, N>) -> Result<Self> {
        if is_finite(&mean) && is_finite(&covariance) {
            Ok(Self { mean, covariance })
        } else {
            Err(EstimationError::Overflow { what: "the new belief" })
        }
    }

    /// The expected state.
    pub const fn mean(&self) -> &SVector<f64, N> {
        &self.mean
    }

    /// The covariance of the state's error; exactly symmetric.
    pub const fn covariance(&self) -> &SMatrix<f64, N, N> {
        &self.covariance
    }

    /// Moves the belief through time: `x ← F x + B u`, `P ← F P Fᵀ + Q`.
    ///
    /// # Errors
    /// Where the result overflows; the belief is then as it was.
    #[inline]
    pub fn predict(&mut self, transition: &Transition<N>) -> Result<()> {
        match transition.shear() {
            Some(shear) if shear.is_safe(&self.mean, &self.covariance) => {
                shear.apply(transition, &mut self.mean, &mut self.covariance);
            }
            _ => {
                let mean = times_vector(transition.matrix(), &self.mean) + transition.offset();
                let moved = sandwich(transition.matrix(), &self.covariance);
                *self = Self::computed(mean, moved + transition.noise())?;
            }
        }
        Ok(())
    }

    /// The belief after `transition`, leaving this one alone: see [`predict`](Self::predict).
    ///
    /// # Errors
    /// Where the result overflows.
    #[inline]
    pub fn predicted(&self, transition: &Transition<N>) -> Result<Self> {
        let mut after = *self;
        after.predict(transition)?;
        Ok(after)
    }

    /// What a measurement says against this belief, without correcting it: for gating and association.
    ///
    /// # Errors
    /// Where `value` is not finite or the innovation covariance is singular.
    #[inline]
    pub fn innovation<const M: usize>(
        &self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<Innovation<M>> {
        let residual = self.residual(measurement, value)?;
        let cross = times_transpose(&self.covariance, measurement.matrix());
        let covariance = times_transpose(&cross.transpose(), measurement.matrix()) + measurement.noise();
        match Innovation::new(residual, covariance) {
            Err(EstimationError::SingularInnovation { .. }) => Ok(corrected(self, measurement, &residual)?.innovation),
            other => other,
        }
    }

    /// `z − H x`.
    #[inline]
    fn residual<const M: usize>(
        &self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<SVector<f64, M>> {
        require_finite("the measurement", value)?;
        Ok(value - times_vector(measurement.matrix(), &self.mean))
    }

    /// The Kalman gain `K = P Hᵀ S⁻¹` that [`update`](Self::update) would use.
    ///
    /// # Errors
    /// Where the innovation covariance is singular.
    pub fn gain<const M: usize>(&self, measurement: &LinearMeasurement<M, N>) -> Result<SMatrix<f64, N, M>> {
        Ok(corrected(self, measurement, &SVector::zeros())?.gain)
    }

    /// Corrects the belief by a measured `value`, in Joseph form `P ← (I−KH) P (I−KH)ᵀ + K R Kᵀ`.
    ///
    /// A sensor that reads components of the state as they are, each with noise of its own, is taken in component by
    /// component, which is faster and the same up to rounding.
    ///
    /// A partial measurement is a [`LinearMeasurement`] of fewer rows: see [`LinearMeasurement::select`].
    ///
    /// # Errors
    /// Where `value` is not finite or the innovation covariance is singular; the belief is then as it was.
    #[inline]
    pub fn update<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<Innovation<M>> {
        if let Some(components) = measurement.direct() {
            return by_components(&mut self.mean, &mut self.covariance, components, measurement.noise(), value);
        }
        let found = corrected(self, measurement, &self.residual(measurement, value)?)?;
        *self = found.belief;
        Ok(found.innovation)
    }

    /// The normalised estimation error squared, `(x − x̂)ᵀ P⁻¹ (x − x̂)`: χ² with `N` degrees of freedom for a
    /// consistent filter.
    ///
    /// # Errors
    /// Where `truth` is not finite or the covariance is singular.
    pub fn nees(&self, truth: &SVector<f64, N>) -> Result<f64> {
        require_finite("the true state", truth)?;
        Ok(mahalanobis_squared(&self.factor()?, &(truth - self.mean)))
    }

    /// The logarithm of this belief's density at `state`.
    ///
    /// # Errors
    /// Where `state` is not finite or the covariance is singular.
    pub fn log_density(&self, state: &SVector<f64, N>) -> Result<f64> {
        require_finite("the state", state)?;
        let lower = self.factor()?;
        let distance = mahalanobis_squared(&lower, &(state - self.mean));
        Ok(-0.5 * (distance + log_determinant(&lower) + N as f64 * std::f64::consts::TAU.ln()))
    }

    /// The lower Cholesky factor of the covariance.
    ///
    /// # Errors
    /// Where the covariance is singular.
    pub fn factor(&self) -> Result<SMatrix<f64, N, N>> {
        cholesky(&self.covariance).map_err(|(row, pivot)| EstimationError::NotPositive {
            what: "the covariance",
            requirement: "positive definite",
            row,
            pivot,
        })
    }

    /// The belief about `matrix · x`, for example about some of the components.
    ///
    /// # Errors
    /// Where `matrix` is not finite.
    pub fn project<const M: usize>(&self, matrix: &SMatrix<f64, M, N>) -> Result<Gaussian<M>> {
        require_finite("the projection", matrix)?;
        Gaussian::computed(times_vector(matrix, &self.mean), sandwich(matrix, &self.covariance))
    }
}
