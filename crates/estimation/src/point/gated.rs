//! The gated filter of `gao2007` on both axes.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{PointFilter, PointStart};
use crate::papers::gao2007::{GatedFilter, GatedParams};
use crate::{Gaussian, Innovation, Result};

/// One [`GatedFilter`] for each axis, as the paper has it. What ties the axes together in the noise of a measurement is not
/// used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GatedPoint {
    params: GatedParams,
    start: PointStart,
    axes: [GatedFilter; 2],
}

impl GatedPoint {
    /// A filter first seen at `position` with noise covariance `noise`. The acceleration's variance in `params` is in
    /// (px/s²)²; the recommended `q/R` of .01 a frame is `.01 R / dt⁴`.
    ///
    /// # Errors
    /// Where a parameter is out of range or `noise` is not positive definite.
    pub fn new(
        params: GatedParams,
        start: PointStart,
        position: &SVector<f64, 2>,
        noise: &SMatrix<f64, 2, 2>,
    ) -> Result<Self> {
        let belief = start.at::<4>(position, noise)?;
        let axis = |a: usize| {
            let variances = SVector::from([belief.covariance()[(a, a)], belief.covariance()[(a + 2, a + 2)]]);
            let mean = SVector::from([belief.mean()[a], belief.mean()[a + 2]]);
            GatedFilter::from_belief(params, Gaussian::from_variances(mean, variances)?)
        };
        Ok(Self { params, start, axes: [axis(0)?, axis(1)?] })
    }

    /// The filters of x and y.
    pub const fn axes(&self) -> &[GatedFilter; 2] {
        &self.axes
    }
}

/// Two axes in one belief.
fn joined(axes: &[&Gaussian<2>; 2]) -> Gaussian<4> {
    let mean = SVector::from_fn(|r, _| axes[r % 2].mean()[r / 2]);
    let covariance = SMatrix::from_fn(|r, c| match r % 2 == c % 2 {
        true => axes[r % 2].covariance()[(r / 2, c / 2)],
        false => 0.0,
    });
    Gaussian::trusted(mean, covariance)
}

impl PointFilter for GatedPoint {
    fn predict(&mut self, dt_s: f64) -> Result<()> {
        // Neither axis moves where one of them cannot.
        self.forecast(dt_s)?;
        for axis in &mut self.axes {
            axis.predict(dt_s)?;
        }
        Ok(())
    }

    fn update(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Innovation<2>> {
        let now = self.belief();
        let sensor = super::position_sensor::<4>(&SMatrix::from_diagonal(&noise.diagonal()))?;
        let mut both = now;
        let innovation = both.update(&sensor, position)?;
        for (a, axis) in self.axes.iter_mut().enumerate() {
            axis.update_with_noise(position[a], noise[(a, a)])?;
        }
        Ok(innovation)
    }

    fn belief(&self) -> Gaussian<4> {
        joined(&self.axes.each_ref().map(GatedFilter::belief))
    }

    fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>> {
        let [x, y] = &self.axes;
        Ok(joined(&[&x.forecast(dt_s)?, &y.forecast(dt_s)?]))
    }

    fn restart(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<()> {
        *self = Self::new(self.params, self.start, position, noise)?;
        Ok(())
    }
}
