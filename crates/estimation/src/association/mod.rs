//! Which detection is of which target: gates, global nearest neighbours, and joint probabilities.
//!
//! Everything here works on **expected measurements**: beliefs about what a sensor would read of each target, its noise
//! included. [`crate::Gaussian::expected`] makes one of a belief and a sensor, [`crate::point::PointFilter::expected`] one of
//! any filter of a point; of an interacting estimator it is that of the mixture.

mod assignment;
mod clusters;
mod hypotheses;
mod joint;
mod nearest;
mod sparse;
mod sparse_joint;
mod weighted;

pub use assignment::Assignment;
pub use hypotheses::GlobalHypothesis;
pub use joint::{JointParams, JointProbabilities, Probabilities};
pub use nearest::{Cost, NearestNeighbours};
pub use sparse::SparseAssignment;
pub use sparse_joint::{Likelihood, SparseJoint};

use nalgebra::SVector;

use crate::matrix::{log_determinant, mahalanobis_squared, require_finite};
use crate::{EstimationError, Gaussian, LinearMeasurement, Result};

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

/// A pair that is possible, and what it costs beside leaving its row and its column alone; negative: it pays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairing {
    /// The row.
    pub row: usize,
    /// The column.
    pub column: usize,
    /// What it costs more than no pair, finite.
    pub cost: f64,
}

/// Whether the pairs are of rows and columns that there are, at costs that are numbers.
fn check(rows: usize, columns: usize, pairs: &[Pairing]) -> Result<()> {
    for pair in pairs {
        if pair.row >= rows || pair.column >= columns {
            let (got, expected) = (pair.row.max(pair.column), rows.max(columns));
            return Err(EstimationError::Length { what: "rows and columns of a pair", got, expected });
        }
        if !pair.cost.is_finite() {
            return Err(EstimationError::NotFinite { what: "the cost of an assignment" });
        }
    }
    Ok(())
}

/// How far every detection is from what is expected of every target: `νᵀ S⁻¹ ν`, and `ln det S` of each target. What else is
/// known of a pair is added by [`add`](Self::add); the associators read it. Keeps its memory from one frame to the next.
#[derive(Debug, Clone, Default)]
pub struct Distances {
    squared: Vec<f64>,
    log_determinants: Vec<f64>,
    detections: usize,
    components: usize,
}

impl Distances {
    /// Of no targets.
    pub const fn new() -> Self {
        Self { squared: Vec::new(), log_determinants: Vec::new(), detections: 0, components: 0 }
    }

    /// Measures every detection against every expected measurement.
    ///
    /// # Errors
    /// Where a detection is not finite or a covariance is singular.
    pub fn fill<const M: usize>(&mut self, expected: &[Gaussian<M>], detections: &[SVector<f64, M>]) -> Result<()> {
        self.squared.clear();
        self.log_determinants.clear();
        (self.detections, self.components) = (detections.len(), M);
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

    /// Of targets whose measurements are expected so, all pairs infinitely far apart: for a caller who measures those that are
    /// near himself, and [`set`](Self::set)s them.
    ///
    /// # Errors
    /// Where a covariance is singular.
    pub fn start<const M: usize>(&mut self, expected: &[Gaussian<M>], detections: usize) -> Result<()> {
        self.squared.clear();
        self.log_determinants.clear();
        (self.detections, self.components) = (detections, M);
        for target in expected {
            self.log_determinants.push(log_determinant(&target.factor()?));
        }
        self.squared.resize(expected.len() * detections, f64::INFINITY);
        Ok(())
    }

    /// The squared distance of a pair; of one that there is not nothing changes.
    pub fn set(&mut self, target: usize, detection: usize, squared: f64) {
        let at = target * self.detections + detection;
        if let Some(slot) = self.squared.get_mut(at).filter(|_| detection < self.detections) {
            *slot = squared;
        }
    }

    /// How many targets there are.
    pub fn targets(&self) -> usize {
        self.log_determinants.len()
    }

    /// How many detections there are.
    pub const fn detections(&self) -> usize {
        self.detections
    }

    /// The squared distance of a pair; infinite where there is no such pair.
    pub fn squared(&self, target: usize, detection: usize) -> f64 {
        let at = target * self.detections + detection;
        self.squared.get(at).copied().filter(|_| detection < self.detections).unwrap_or(f64::INFINITY)
    }

    /// Adds what else speaks against a pair, in the unit of squared distances; infinite forbids it.
    pub fn add(&mut self, target: usize, detection: usize, squared: f64) {
        let at = target * self.detections + detection;
        if let Some(sum) = self.squared.get_mut(at).filter(|_| detection < self.detections) {
            *sum += squared;
        }
    }
}
