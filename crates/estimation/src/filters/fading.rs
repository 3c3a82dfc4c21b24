//! Fading memory: old data count for less, so that a model that is wrong in the long run is right for now.

use crate::error::require;
use crate::matrix::sandwich;
use crate::{Gaussian, Result, Transition};

impl<const N: usize> Gaussian<N> {
    /// Moves the belief through time as [`predict`](Self::predict) does, with the old covariance inflated:
    /// `P ← α² F P Fᵀ + Q` (Sorenson and Sacks 1971). `memory_factor` `α` is 1 for the plain filter and little more,
    /// as 1.01, to forget with a time constant of `1 / (2 ln α)` steps.
    ///
    /// # Errors
    /// Where `memory_factor` is below one or not finite, or the result overflows; the belief is then as it was.
    pub fn predict_fading(&mut self, transition: &Transition<N>, memory_factor: f64) -> Result<()> {
        require("memory_factor", memory_factor, memory_factor >= 1.0, "one or more")?;
        let kept = sandwich(transition.matrix(), self.covariance()) * (memory_factor * memory_factor);
        let mean = transition.matrix() * self.mean() + transition.offset();
        *self = Self::computed(mean, kept + transition.noise())?;
        Ok(())
    }
}
