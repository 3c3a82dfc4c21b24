//! Ways of moving that can stand beside each other in one estimator, whatever filter each of them needs.

use serde::{Deserialize, Serialize};

use crate::nonlinear::{LinearizedMotion, NonlinearMotion, Unscented};
use crate::{Gaussian, MotionModel, Result};

/// One way of moving: how a belief about `N` components goes on over a step.
///
/// Every linear [`MotionModel`] is one. Nonlinear motion is one as [`Extended`] or [`UnscentedMode`]; a model of a smaller
/// state is one as [`super::Embedded`]. `CurrentStatistical` is one too: it linearises about the mixed belief it is handed.
pub trait Mode<const N: usize> {
    /// The belief after `dt_s` seconds.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite, a parameter is out of range or the result overflows.
    fn predict(&self, belief: &Gaussian<N>, dt_s: f64) -> Result<Gaussian<N>>;

    /// Which of the components this way of moving has an opinion on: all, but for an embedded one.
    fn holds(&self) -> [bool; N] {
        [true; N]
    }
}

impl<const N: usize, Model: MotionModel<N>> Mode<N> for Model {
    fn predict(&self, belief: &Gaussian<N>, dt_s: f64) -> Result<Gaussian<N>> {
        belief.predicted(&self.over(dt_s)?)
    }
}

/// Nonlinear motion, linearised by its slope at the mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extended<Motion>(pub Motion);

impl<const N: usize, Motion: LinearizedMotion<N>> Mode<N> for Extended<Motion> {
    fn predict(&self, belief: &Gaussian<N>, dt_s: f64) -> Result<Gaussian<N>> {
        let mut after = *belief;
        after.predict_extended(&self.0, dt_s)?;
        Ok(after)
    }
}

/// Nonlinear motion through sigma points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnscentedMode<Motion> {
    /// The motion.
    pub motion: Motion,
    /// The spread of the points.
    pub shape: Unscented,
}

impl<const N: usize, Motion: NonlinearMotion<N>> Mode<N> for UnscentedMode<Motion> {
    fn predict(&self, belief: &Gaussian<N>, dt_s: f64) -> Result<Gaussian<N>> {
        let mut after = *belief;
        after.predict_unscented(&self.motion, dt_s, &self.shape)?;
        Ok(after)
    }
}
