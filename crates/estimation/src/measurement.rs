//! Linear measurements and what they say against a belief.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::matrix::{divide_by_pivots, factored, require_finite, require_semi_definite};
use crate::{EstimationError, Result};

/// A linear sensor: `z = H x + v`, `v ~ N(0, R)`, of `M` values of a state of `N` components.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "LinearMeasurement")]
pub struct LinearMeasurement<const M: usize, const N: usize> {
    matrix: SMatrix<f64, M, N>,
    noise: SMatrix<f64, M, M>,
    /// The components read, where every row of `H` reads one component as it is and `R` is diagonal.
    #[serde(skip)]
    direct: Option<[usize; M]>,
}

crate::checked!([const M: usize, const N: usize] LinearMeasurement<M, N>);

impl<const M: usize, const N: usize> LinearMeasurement<M, N> {
    fn restored(self) -> Result<Self> {
        Self::new(self.matrix, self.noise)
    }
}

impl<const M: usize, const N: usize> LinearMeasurement<M, N> {
    /// A sensor with measurement matrix `H` and noise covariance `R`.
    ///
    /// `R` may be semi-definite (a perfect sensor); an update then still needs `H P Hᵀ + R` to be regular.
    ///
    /// # Errors
    /// Where either is not finite, or `R` is not symmetric and positive semi-definite.
    pub fn new(matrix: SMatrix<f64, M, N>, noise: SMatrix<f64, M, M>) -> Result<Self> {
        require_finite("the measurement matrix", &matrix)?;
        let noise = require_semi_definite("the measurement noise", &noise)?;
        Ok(Self { matrix, noise, direct: direct(&matrix, &noise) })
    }

    /// A sensor that reads the state's components `indices` directly, each with its own noise variance: the way to
    /// write a partial measurement.
    ///
    /// # Errors
    /// Where an index is not below `N`, or a variance is negative or not finite.
    pub fn select(indices: [usize; M], variances: [f64; M]) -> Result<Self> {
        let mut matrix = SMatrix::<f64, M, N>::zeros();
        for (row, index) in indices.into_iter().enumerate() {
            let missing = EstimationError::Index { what: "the measured component", index, length: N };
            let entry = matrix.get_mut((row, index)).ok_or(missing)?;
            *entry = 1.0;
        }
        let noise = SMatrix::from_diagonal(&SVector::from(variances));
        // A diagonal is a covariance where no variance is negative; the general way says what is wrong with one that is not.
        let sound = variances.iter().all(|v| *v >= 0.0 && v.is_finite());
        if sound { Ok(Self { matrix, noise, direct: Some(indices) }) } else { Self::new(matrix, noise) }
    }

    /// The same sensor with another noise covariance, for example one that grows as a detector grows unsure.
    ///
    /// # Errors
    /// Where `noise` is not finite, symmetric and positive semi-definite.
    pub fn with_noise(mut self, noise: SMatrix<f64, M, M>) -> Result<Self> {
        self.noise = require_semi_definite("the measurement noise", &noise)?;
        self.direct = direct(&self.matrix, &self.noise);
        Ok(self)
    }

    /// `H`, the measurement matrix.
    pub const fn matrix(&self) -> &SMatrix<f64, M, N> {
        &self.matrix
    }

    /// `R`, the covariance of the measurement noise.
    pub const fn noise(&self) -> &SMatrix<f64, M, M> {
        &self.noise
    }

    /// The components of the state that are read, one a row, where each is read as it is and with noise of its own.
    #[inline]
    pub(crate) const fn direct(&self) -> Option<&[usize; M]> {
        self.direct.as_ref()
    }
}

/// See [`LinearMeasurement::direct`].
fn direct<const M: usize, const N: usize>(
    matrix: &SMatrix<f64, M, N>,
    noise: &SMatrix<f64, M, M>,
) -> Option<[usize; M]> {
    let mut components = [0; M];
    for (row, component) in components.iter_mut().enumerate() {
        let entries = matrix.row(row);
        *component = entries.iter().position(|value| *value == 1.0)?;
        let others_are_zero = entries.iter().filter(|value| **value != 0.0).count() == 1;
        if !others_are_zero || (0..M).any(|other| other != row && noise[(row, other)] != 0.0) {
            return None;
        }
    }
    Some(components)
}

/// A pivot of a factor below this fraction of its row is lost in rounding.
const ROOT_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// What a measurement said that the belief did not expect: residual `ν = z − H x`, covariance `S = H P Hᵀ + R`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Innovation")]
pub struct Innovation<const M: usize> {
    residual: SVector<f64, M>,
    /// `S = L D Lᵀ`: `D` on the diagonal, `L` below it. Stored as such, because a sharp `S` is regular only in this form.
    factor: SMatrix<f64, M, M>,
}

crate::checked!([const M: usize] Innovation<M>);

impl<const M: usize> Innovation<M> {
    fn restored(self) -> Result<Self> {
        require_finite("the innovation", &self.residual)?;
        require_finite("the factor of the innovation covariance", &self.factor)?;
        for row in 0..M {
            let pivot = self.factor[(row, row)];
            if pivot <= 0.0 {
                return Err(EstimationError::SingularInnovation { row, pivot });
            }
        }
        Ok(Self { factor: self.factor.lower_triangle(), ..self })
    }
}

impl<const M: usize> Innovation<M> {
    /// An innovation from its residual and covariance.
    ///
    /// # Errors
    /// Where the residual is not finite or the covariance is singular.
    #[inline]
    pub fn new(residual: SVector<f64, M>, covariance: SMatrix<f64, M, M>) -> Result<Self> {
        require_finite("the innovation", &residual)?;
        match factored(&covariance) {
            Ok(factor) => Ok(Self { residual, factor }),
            Err((row, pivot)) => Err(EstimationError::SingularInnovation { row, pivot }),
        }
    }

    /// An innovation whose covariance is `L D Lᵀ`, with `D` on the diagonal of `factor` and `L` below; both sound.
    #[inline]
    pub(crate) const fn from_factor(residual: SVector<f64, M>, factor: SMatrix<f64, M, M>) -> Self {
        Self { residual, factor }
    }

    /// An innovation whose covariance is given by its lower Cholesky factor.
    ///
    /// # Errors
    /// Where the residual is not finite or the factor is singular.
    pub(crate) fn from_cholesky(residual: SVector<f64, M>, lower: SMatrix<f64, M, M>) -> Result<Self> {
        require_finite("the innovation", &residual)?;
        let mut factor = lower;
        for row in 0..M {
            let pivot = lower[(row, row)];
            // A factor made by rotations is right to rounding of its own size, which is the root of the covariance's.
            if !(pivot > ROOT_ROUNDING * lower.row(row).norm() && pivot.is_finite()) {
                return Err(EstimationError::SingularInnovation { row, pivot: pivot * pivot });
            }
            factor.column_mut(row).unscale_mut(pivot);
            factor[(row, row)] = pivot * pivot;
        }
        Ok(Self { residual, factor })
    }

    /// `ν`, measured minus expected.
    pub const fn residual(&self) -> &SVector<f64, M> {
        &self.residual
    }

    /// `S`, the covariance the residual should have.
    pub fn covariance(&self) -> SMatrix<f64, M, M> {
        SMatrix::from_fn(|r, c| {
            let lower = |row: usize, k: usize| if row == k { 1.0 } else { self.factor[(row, k)] };
            (0..=r.min(c)).map(|k| self.factor[(k, k)] * (lower(r, k) * lower(c, k))).sum()
        })
    }

    /// The lower Cholesky factor of `S`.
    pub fn factor(&self) -> SMatrix<f64, M, M> {
        let mut lower = SMatrix::<f64, M, M>::zeros();
        for column in 0..M {
            let root = self.factor[(column, column)].sqrt();
            lower[(column, column)] = root;
            for row in column + 1..M {
                lower[(row, column)] = self.factor[(row, column)] * root;
            }
        }
        lower
    }

    /// `rows · S⁻¹`.
    #[inline]
    pub(crate) fn divide<const R: usize>(&self, rows: &SMatrix<f64, R, M>) -> SMatrix<f64, R, M> {
        divide_by_pivots(rows, &self.factor)
    }

    /// The normalised innovation squared `νᵀ S⁻¹ ν`: χ² with `M` degrees of freedom for a consistent filter.
    #[inline]
    pub fn nis(&self) -> f64 {
        let mut sum = 0.0;
        let mut rest = self.residual;
        for column in 0..M {
            let value = rest[column];
            for row in column + 1..M {
                rest[row] -= self.factor[(row, column)] * value;
            }
            sum += value * value / self.factor[(column, column)];
        }
        sum
    }

    /// The logarithm of the measurement's likelihood, `ln N(ν; 0, S)`.
    pub fn log_likelihood(&self) -> f64 {
        let log_determinant: f64 = self.factor.diagonal().iter().map(|pivot| pivot.ln()).sum();
        -0.5 * (self.nis() + log_determinant + M as f64 * std::f64::consts::TAU.ln())
    }
}
