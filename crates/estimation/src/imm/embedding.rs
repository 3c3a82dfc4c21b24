//! Models of a small state among the components of a larger one.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::Mode;
use crate::error::require;
use crate::{EstimationError, Gaussian, Result, Transition};

/// A way of moving of `S` components that stands for some of `N`, as constant velocity does beside constant acceleration.
///
/// The other components are put to zero at every step, with a variance of their own and no correlation: what this way of
/// moving knows of them. When modes are mixed it is asked for them no more (see [`super::Imm::predict_modes`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    try_from = "Raw<M, S, N>",
    into = "Raw<M, S, N>",
    bound(serialize = "M: Clone + Serialize", deserialize = "M: Deserialize<'de>")
)]
pub struct Embedded<M, const S: usize, const N: usize> {
    mode: M,
    indices: [usize; S],
    rest: SVector<f64, N>,
}

/// What is stored: read back through the same checks as any outside input.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "Embedded")]
struct Raw<M, const S: usize, const N: usize> {
    mode: M,
    indices: SVector<usize, S>,
    rest: SVector<f64, N>,
}

impl<M, const S: usize, const N: usize> From<Embedded<M, S, N>> for Raw<M, S, N> {
    fn from(it: Embedded<M, S, N>) -> Self {
        Self { mode: it.mode, indices: SVector::from(it.indices), rest: it.rest }
    }
}

impl<M, const S: usize, const N: usize> TryFrom<Raw<M, S, N>> for Embedded<M, S, N> {
    type Error = EstimationError;

    fn try_from(raw: Raw<M, S, N>) -> Result<Self> {
        Self::new(raw.mode, raw.indices.into(), raw.rest)
    }
}

/// Refuses indices that are not of a state of `length` components, or name one twice.
fn require_distinct(indices: &[usize], length: usize) -> Result<()> {
    for (k, &index) in indices.iter().enumerate() {
        if index >= length {
            return Err(EstimationError::Index { what: "the component to embed into", index, length });
        }
        let twice = indices[..k].contains(&index);
        require("a component to embed into", index as f64, !twice, "named once only")?;
    }
    Ok(())
}

impl<M, const S: usize, const N: usize> Embedded<M, S, N> {
    /// `mode`, whose component `k` is component `indices[k]` of the larger state; `rest_variances` are those of the other
    /// components (entries at `indices` do not matter). A variance of zero is allowed, but leaves a covariance that the
    /// unscented filter cannot draw points of.
    ///
    /// # Errors
    /// Where an index is not below `N` or named twice, or a variance is negative or not finite.
    pub fn new(mode: M, indices: [usize; S], rest_variances: SVector<f64, N>) -> Result<Self> {
        require_distinct(&indices, N)?;
        for &variance in rest_variances.iter() {
            require("the variance of a component that is not embedded", variance, variance >= 0.0, "zero or more")?;
        }
        Ok(Self { mode, indices, rest: rest_variances })
    }

    /// The small model.
    pub const fn mode(&self) -> &M {
        &self.mode
    }
}

impl<M: Mode<S>, const S: usize, const N: usize> Mode<N> for Embedded<M, S, N> {
    fn predict(&self, belief: &Gaussian<N>, dt_s: f64) -> Result<Gaussian<N>> {
        let (x, p, at) = (belief.mean(), belief.covariance(), &self.indices);
        let small = Gaussian::trusted(SVector::from_fn(|r, _| x[at[r]]), SMatrix::from_fn(|r, c| p[(at[r], at[c])]));
        let moved = self.mode.predict(&small, dt_s)?;
        let (mut mean, mut covariance) = (SVector::zeros(), SMatrix::from_diagonal(&self.rest));
        for r in 0..S {
            mean[at[r]] = moved.mean()[r];
            for c in 0..S {
                covariance[(at[r], at[c])] = moved.covariance()[(r, c)];
            }
        }
        Gaussian::computed(mean, covariance)
    }

    fn holds(&self) -> [bool; N] {
        std::array::from_fn(|component| self.indices.contains(&component))
    }
}

impl<const S: usize> Transition<S> {
    /// The same step over a larger state: component `k` of this one is component `indices[k]` of that. The other
    /// components are put to zero, with `rest_variances` (entries at `indices` do not matter).
    ///
    /// # Errors
    /// Where an index is not below `N` or named twice, or a variance is negative or not finite.
    pub fn embedded<const N: usize>(
        &self,
        indices: [usize; S],
        rest_variances: &SVector<f64, N>,
    ) -> Result<Transition<N>> {
        require_distinct(&indices, N)?;
        let (mut matrix, mut noise) = (SMatrix::<f64, N, N>::zeros(), SMatrix::from_diagonal(rest_variances));
        let mut offset = SVector::<f64, N>::zeros();
        for r in 0..S {
            offset[indices[r]] = self.offset()[r];
            for c in 0..S {
                matrix[(indices[r], indices[c])] = self.matrix()[(r, c)];
                noise[(indices[r], indices[c])] = self.noise()[(r, c)];
            }
        }
        Transition::new(matrix, noise)?.with_offset(offset)
    }
}
