//! The square-root filter: it carries a Cholesky factor instead of the covariance, which halves the digits lost and
//! cannot turn indefinite (Kaminski, Bryson, Schmidt 1971; array form of Kailath, Sayed, Hassibi 2000, 12.3).

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::matrix::{is_finite, require_finite, semi_definite_factor, times_vector};
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result, Transition};

/// A Gaussian belief held as a mean and the lower triangular factor `L` of its covariance `L Lᵀ`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "SquareRoot")]
pub struct SquareRoot<const N: usize> {
    mean: SVector<f64, N>,
    factor: SMatrix<f64, N, N>,
}

crate::checked!([const N: usize] SquareRoot<N>);

impl<const N: usize> SquareRoot<N> {
    fn restored(self) -> Result<Self> {
        require_finite("the mean", &self.mean)?;
        require_finite("the factor of the covariance", &self.factor)?;
        for row in 0..N {
            let pivot = self.factor[(row, row)];
            require("a diagonal entry of the factor", pivot, pivot >= 0.0, "zero or more")?;
            for column in row + 1..N {
                let entry = self.factor[(row, column)];
                require("an entry above the factor's diagonal", entry, entry == 0.0, "zero")?;
            }
        }
        Ok(self)
    }
}

impl<const N: usize> SquareRoot<N> {
    /// The same belief in square-root form.
    ///
    /// # Errors
    /// Where the belief's covariance is singular.
    pub fn new(belief: &Gaussian<N>) -> Result<Self> {
        Ok(Self { mean: *belief.mean(), factor: belief.factor()? })
    }

    /// The expected state.
    pub const fn mean(&self) -> &SVector<f64, N> {
        &self.mean
    }

    /// `L`, lower triangular with a diagonal of zero or more.
    pub const fn factor(&self) -> &SMatrix<f64, N, N> {
        &self.factor
    }

    /// The same belief with its covariance multiplied out.
    pub fn to_gaussian(&self) -> Gaussian<N> {
        let mut covariance = self.factor * self.factor.transpose();
        crate::matrix::symmetrise(&mut covariance);
        Gaussian::trusted(self.mean, covariance)
    }

    /// Moves the belief through time, as [`Gaussian::predict`].
    ///
    /// # Errors
    /// Where the result overflows; the belief is then as it was.
    pub fn predict(&mut self, transition: &Transition<N>) -> Result<()> {
        let mean = times_vector(transition.matrix(), &self.mean) + transition.offset();
        let mut factor = SMatrix::<f64, N, N>::zeros();
        let moved = transition.matrix() * self.factor;
        let noise = semi_definite_factor(transition.noise());
        for column in moved.column_iter().chain(noise.column_iter()) {
            absorb(&mut factor, column.into_owned());
        }
        self.commit(mean, factor)
    }

    /// Corrects the belief by a measured `value`, as [`Gaussian::update`].
    ///
    /// # Errors
    /// Where `value` is not finite or the innovation covariance is singular; the belief is then as it was.
    pub fn update<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<Innovation<M>> {
        require_finite("the measurement", value)?;
        // [R½  H L]   rotated into   [S½      0 ]
        // [ 0   L ]                  [P Hᵀ S⁻½  L⁺]
        let mut top_left = semi_definite_factor(measurement.noise());
        let mut top_right = measurement.matrix() * self.factor;
        let mut bottom_left = SMatrix::<f64, N, M>::zeros();
        let mut factor = self.factor;
        for i in 0..M {
            // From the last column down: that keeps L lower triangular.
            for j in (0..N).rev() {
                let (c, s) = rotation(top_left[(i, i)], top_right[(i, j)]);
                for r in i..M {
                    rotate(&mut top_left[(r, i)], &mut top_right[(r, j)], c, s);
                }
                for r in 0..N {
                    rotate(&mut bottom_left[(r, i)], &mut factor[(r, j)], c, s);
                }
            }
        }
        let residual = value - times_vector(measurement.matrix(), &self.mean);
        let innovation = Innovation::from_cholesky(residual, top_left)?;
        let whitened = crate::matrix::forward_substitute(&top_left, &residual);
        let mean = self.mean + times_vector(&bottom_left, &whitened);
        for c in 0..N {
            if factor[(c, c)] < 0.0 {
                factor.column_mut(c).neg_mut();
            }
        }
        self.commit(mean, factor)?;
        Ok(innovation)
    }

    fn commit(&mut self, mean: SVector<f64, N>, factor: SMatrix<f64, N, N>) -> Result<()> {
        if !(is_finite(&mean) && is_finite(&factor)) {
            return Err(EstimationError::Overflow { what: "the new belief" });
        }
        *self = Self { mean, factor };
        Ok(())
    }
}

/// Makes `lower lowerᵀ` into `lower lowerᵀ + column columnᵀ`.
fn absorb<const N: usize>(lower: &mut SMatrix<f64, N, N>, mut column: SVector<f64, N>) {
    for i in 0..N {
        let (c, s) = rotation(lower[(i, i)], column[i]);
        for r in i..N {
            rotate(&mut lower[(r, i)], &mut column[r], c, s);
        }
    }
}

/// The rotation that turns `(a, b)` into `(√(a² + b²), 0)`.
fn rotation(a: f64, b: f64) -> (f64, f64) {
    let length = a.hypot(b);
    if length > 0.0 { (a / length, b / length) } else { (1.0, 0.0) }
}

fn rotate(a: &mut f64, b: &mut f64, c: f64, s: f64) {
    (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
}
