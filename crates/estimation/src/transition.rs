//! How a state moves over one time step, and the models that say so for any step length.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::matrix::{is_finite, require_finite, require_semi_definite};
use crate::motion::spread;
use crate::prediction::Shear;
use crate::{EstimationError, Result};

/// One step of linear motion: `x ← F x + B u + w`, `w ~ N(0, Q)`.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(remote = "Transition")]
pub struct Transition<const N: usize> {
    matrix: SMatrix<f64, N, N>,
    noise: SMatrix<f64, N, N>,
    offset: SVector<f64, N>,
    /// What the others say, for speed.
    #[serde(skip)]
    shear: Option<Shear<N>>,
}

impl<const N: usize> PartialEq for Transition<N> {
    fn eq(&self, other: &Self) -> bool {
        self.matrix == other.matrix && self.noise == other.noise && self.offset == other.offset
    }
}

crate::checked!([const N: usize] Transition<N>);

impl<const N: usize> Transition<N> {
    fn restored(self) -> Result<Self> {
        Self::new(self.matrix, self.noise)?.with_offset(self.offset)
    }
}

impl<const N: usize> Transition<N> {
    /// A step by the transition matrix `F` with process noise covariance `Q`, and no control input.
    ///
    /// # Errors
    /// Where either is not finite, or `Q` is not symmetric and positive semi-definite.
    pub fn new(matrix: SMatrix<f64, N, N>, noise: SMatrix<f64, N, N>) -> Result<Self> {
        require_finite("the transition matrix", &matrix)?;
        let noise = require_semi_definite("the process noise", &noise)?;
        Ok(Self::sound(matrix, noise, SVector::zeros()))
    }

    /// A step from parts that are known to be finite and sound.
    #[inline]
    fn sound(matrix: SMatrix<f64, N, N>, noise: SMatrix<f64, N, N>, offset: SVector<f64, N>) -> Self {
        Self { matrix, noise, offset, shear: Shear::of(&matrix, &noise, &offset) }
    }

    /// A step built from a model whose matrices are sound by construction; only overflow is looked for.
    pub(crate) fn computed(matrix: SMatrix<f64, N, N>, noise: SMatrix<f64, N, N>) -> Result<Self> {
        if !(is_finite(&matrix) && is_finite(&noise)) {
            return Err(EstimationError::Overflow { what: "the transition of a motion model" });
        }
        Ok(Self::sound(matrix, noise, SVector::zeros()))
    }

    /// A step that moves `axes` axes alike and apart, each by the upper triangular `matrix` of `K` orders: component `k` of
    /// axis `d` is at `k · axes + d`. The blocks are sound by construction; only overflow is looked for.
    #[inline]
    pub(crate) fn of_axes<const K: usize>(
        matrix: &SMatrix<f64, K, K>,
        noise: &SMatrix<f64, K, K>,
        axes: usize,
    ) -> Result<Self> {
        if !(is_finite(matrix) && is_finite(noise)) {
            return Err(EstimationError::Overflow { what: "the transition of a motion model" });
        }
        Ok(Self {
            matrix: spread(matrix, axes),
            noise: spread(noise, axes),
            offset: SVector::zeros(),
            shear: Shear::of_axes(matrix, noise, axes),
        })
    }

    /// A step of `[x, y, vx, vy, …]` by `dt_s` that leaves all other components where they are. The caller has seen that
    /// `dt_s` and `noise` are finite and `noise` a covariance.
    #[inline]
    pub(crate) fn moving_centre(dt_s: f64, noise: SMatrix<f64, N, N>) -> Self {
        let mut matrix = SMatrix::<f64, N, N>::identity();
        matrix[(0, 2)] = dt_s;
        matrix[(1, 3)] = dt_s;
        Self { matrix, noise, offset: SVector::zeros(), shear: Shear::moving_centre(dt_s, noise.trace()) }
    }

    /// The same step with the known displacement `B u` (a control input) added to the mean.
    ///
    /// # Errors
    /// Where `offset` is not finite.
    pub fn with_offset(self, offset: SVector<f64, N>) -> Result<Self> {
        require_finite("the control displacement", &offset)?;
        Ok(Self::sound(self.matrix, self.noise, offset))
    }

    /// The same step with another process noise covariance.
    ///
    /// # Errors
    /// Where `noise` is not finite, symmetric and positive semi-definite.
    pub fn with_noise(self, noise: SMatrix<f64, N, N>) -> Result<Self> {
        Ok(Self::sound(self.matrix, require_semi_definite("the process noise", &noise)?, self.offset))
    }

    /// `F`, the transition matrix.
    pub const fn matrix(&self) -> &SMatrix<f64, N, N> {
        &self.matrix
    }

    /// `Q`, the covariance of the process noise gathered over the step.
    pub const fn noise(&self) -> &SMatrix<f64, N, N> {
        &self.noise
    }

    /// `B u`, the known displacement of the step; zero without a control input.
    pub const fn offset(&self) -> &SVector<f64, N> {
        &self.offset
    }

    /// Where `F` differs from the identity, if it is upper triangular.
    #[inline]
    pub(crate) const fn shear(&self) -> Option<&Shear<N>> {
        self.shear.as_ref()
    }
}

/// A model of motion in continuous time, discretised for whatever step the data bring.
pub trait MotionModel<const N: usize> {
    /// The transition over the next `dt_s` seconds.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, or a parameter of the model is out of range.
    fn over(&self, dt_s: f64) -> Result<Transition<N>>;
}
