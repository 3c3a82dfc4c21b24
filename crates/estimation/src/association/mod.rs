//! Which detection is of which target: gates, global nearest neighbours, and joint probabilities.
//!
//! Everything here works on **expected measurements**: beliefs about what a sensor would read of each target, its noise
//! included. [`crate::Gaussian::expected`] makes one of a belief and a sensor, [`crate::point::PointFilter::expected`] one of
//! any filter of a point; of an interacting estimator it is that of the mixture.

mod assignment;
mod joint;
mod nearest;
mod weighted;

pub use assignment::Assignment;
pub use joint::{JointParams, JointProbabilities, Probabilities};
pub use nearest::{Cost, NearestNeighbours};

use nalgebra::SVector;

use crate::matrix::{log_determinant, mahalanobis_squared, require_finite};
use crate::{Gaussian, LinearMeasurement, Result};

impl<const N: usize> Gaussian<N> {
    /// The measurement that `sensor` is expected to give, with its covariance `S = H P Hᵀ + R`.
    ///
    /// # Errors
    /// Where the result overflows.
    pub fn expected<const M: usize>(&self, sensor: &LinearMeasurement<M, N>) -> Result<Gaussian<M>> {
        let seen = self.project(sensor.matrix())?;
        Gaussian::computed(*seen.mean(), seen.covariance() + sensor.noise())
    }
}

/// The detections that no target was given: indices below `detections` that `matches` does not name.
pub fn unmatched(matches: &[Option<usize>], detections: usize) -> impl Iterator<Item = usize> {
    (0..detections).filter(|index| !matches.contains(&Some(*index)))
}

/// Distance squared of every detection to every expected measurement, target by target, and `ln det S` of each target.
#[derive(Debug, Clone)]
struct Distances {
    squared: Vec<f64>,
    log_determinants: Vec<f64>,
}

impl Distances {
    const fn new() -> Self {
        Self { squared: Vec::new(), log_determinants: Vec::new() }
    }

    fn fill<const M: usize>(&mut self, expected: &[Gaussian<M>], detections: &[SVector<f64, M>]) -> Result<()> {
        self.squared.clear();
        self.log_determinants.clear();
        for detection in detections {
            require_finite("a detection", detection)?;
        }
        for target in expected {
            let lower = target.factor()?;
            self.log_determinants.push(log_determinant(&lower));
            self.squared.extend(detections.iter().map(|z| mahalanobis_squared(&lower, &(z - target.mean()))));
        }
        Ok(())
    }
}
