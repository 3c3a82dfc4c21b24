//! Least-squares support vector regression (Suykens et al. 2002): ridge regression in the feature space of a kernel, with
//! a free intercept.
//!
//! `[0 1ᵀ; 1 Ω + I/γ] [b; α] = [0; y]`, `y(x) = Σ α_i k(x, x_i) + b`. Solved by one Cholesky factorisation of `Ω + I/γ`,
//! which is positive definite for every Mercer kernel.

use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::{EstimationError, Result};

/// A kernel `k(x, x')`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Kernel {
    /// `xᵀ x'`: a straight line, extrapolated as one.
    Linear,
    /// `exp(−|x − x'|² / σ²)`: far from the samples the answer falls back to `b`, near their mean.
    Rbf {
        /// `σ²`, in the inputs' units squared. > 0.
        sigma2: f64,
    },
    /// `(c + xᵀ x')^degree`.
    Polynomial {
        /// `c` ≥ 0.
        offset: f64,
        /// The degree, 1 or more.
        degree: u32,
    },
}

impl Kernel {
    /// Refuses parameters that do not make a kernel.
    pub(crate) fn validate(&self) -> Result<()> {
        match *self {
            Self::Linear => Ok(()),
            Self::Rbf { sigma2 } => require("sigma2", sigma2, sigma2 > 0.0, "positive"),
            Self::Polynomial { offset, degree } => {
                require("offset", offset, offset >= 0.0, "zero or more")?;
                require("degree", f64::from(degree), (1..=64).contains(&degree), "from 1 to 64")
            }
        }
    }

    /// `k(a, b)`.
    pub fn evaluate<const D: usize>(&self, a: &[f64; D], b: &[f64; D]) -> f64 {
        let product = || a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        match *self {
            Self::Linear => product(),
            Self::Rbf { sigma2 } => {
                let distance: f64 = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum();
                (-distance / sigma2).exp()
            }
            Self::Polynomial { offset, degree } => {
                let base = offset + product();
                (0..degree).fold(1.0, |power, _| power * base)
            }
        }
    }
}

/// A regression of a number on `D` inputs. Holds its buffers, so that fitting again to as many samples allocates nothing.
#[derive(Debug, Clone)]
pub struct LeastSquaresSvm<const D: usize> {
    kernel: Kernel,
    gamma: f64,
    inputs: Vec<[f64; D]>,
    multipliers: Vec<f64>,
    intercept: f64,
    factor: Vec<f64>,
    ones: Vec<f64>,
}

impl<const D: usize> LeastSquaresSvm<D> {
    /// A regression not fitted yet: it answers zero everywhere.
    ///
    /// `gamma` `γ` > 0 weighs fit against flatness: γ → ∞ interpolates, γ → 0 answers the mean.
    ///
    /// # Errors
    /// Where `gamma` or a kernel parameter is out of range.
    pub fn new(kernel: Kernel, gamma: f64) -> Result<Self> {
        kernel.validate()?;
        require("gamma", gamma, gamma > 0.0, "positive")?;
        Ok(Self {
            kernel,
            gamma,
            inputs: Vec::new(),
            multipliers: Vec::new(),
            intercept: 0.0,
            factor: Vec::new(),
            ones: Vec::new(),
        })
    }

    /// Fits `targets` at `inputs`.
    ///
    /// # Errors
    /// Where there are no samples, the lengths differ, a number is not finite, or the kernel matrix is singular to
    /// rounding (γ too large for samples that coincide). The regression is then not fitted: fit again before use.
    pub fn fit(&mut self, inputs: &[[f64; D]], targets: &[f64]) -> Result<()> {
        let n = inputs.len();
        if n == 0 || targets.len() != n {
            return Err(EstimationError::Length {
                what: "targets of a regression, one per input and at least one",
                got: targets.len(),
                expected: n.max(1),
            });
        }
        if !inputs.iter().flatten().chain(targets).all(|value| value.is_finite()) {
            return Err(EstimationError::NotFinite { what: "a sample of the regression" });
        }
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        self.factorise()?;
        self.multipliers.clear();
        self.multipliers.extend_from_slice(targets);
        self.ones.clear();
        self.ones.resize(n, 1.0);
        solve(&self.factor, &mut self.multipliers);
        solve(&self.factor, &mut self.ones);
        // b = 1ᵀA⁻¹y / 1ᵀA⁻¹1, α = A⁻¹y − b A⁻¹1
        self.intercept = self.multipliers.iter().sum::<f64>() / self.ones.iter().sum::<f64>();
        for (multiplier, one) in self.multipliers.iter_mut().zip(&self.ones) {
            *multiplier -= self.intercept * one;
        }
        Ok(())
    }

    /// The lower Cholesky factor of `Ω + I/γ`, row by row.
    fn factorise(&mut self) -> Result<()> {
        let n = self.inputs.len();
        self.factor.clear();
        self.factor.resize(n * n, 0.0);
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.kernel.evaluate(&self.inputs[i], &self.inputs[j]);
                if i == j {
                    sum += 1.0 / self.gamma;
                }
                let full = sum;
                let (before, row) = self.factor.split_at_mut(i * n);
                let other = if i == j { &row[..j] } else { &before[j * n..j * n + j] };
                sum -= row[..j].iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
                if i == j {
                    if !(sum > f64::EPSILON * full && sum.is_finite()) {
                        return Err(EstimationError::NotPositive {
                            what: "the kernel matrix",
                            requirement: "positive definite",
                            row: i,
                            pivot: sum,
                        });
                    }
                    row[j] = sum.sqrt();
                } else {
                    row[j] = sum / before[j * n + j];
                }
            }
        }
        Ok(())
    }

    /// `y(x)`.
    pub fn predict(&self, input: &[f64; D]) -> f64 {
        let terms = self.inputs.iter().zip(&self.multipliers);
        self.intercept + terms.map(|(sample, weight)| weight * self.kernel.evaluate(input, sample)).sum::<f64>()
    }

    /// `b`, the intercept.
    pub const fn intercept(&self) -> f64 {
        self.intercept
    }

    /// `α`, one multiplier per sample; they sum to zero.
    pub fn multipliers(&self) -> &[f64] {
        &self.multipliers
    }
}

/// `(L Lᵀ)⁻¹ values` in place, for a lower factor stored row by row.
fn solve(factor: &[f64], values: &mut [f64]) {
    let n = values.len();
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| factor[i * n + k] * values[k]).sum();
        values[i] = (values[i] - sum) / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| factor[k * n + i] * values[k]).sum();
        values[i] = (values[i] - sum) / factor[i * n + i];
    }
}
