//! Motion models of the centre, beside a size that changes slowly: the box is measured, the model moves its middle.

use super::{MotionFilter, RelativeNoise, SMALLEST_SIDE_PX, Sight, extent_px};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use nalgebra::{Matrix2, SMatrix, SVector};
use pursuit_estimation::{Gaussian, LinearMeasurement, Result, Transition};
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// A model of a centre's motion, as its parameters.
pub trait CenterModel {
    /// What is believed about the centre; states are ordered by derivative and then by axis.
    type Belief: CenterBelief;

    /// The belief at the start, at rest.
    ///
    /// # Errors
    /// When the place is not finite or a noise is out of range.
    fn start(&self, start: &Start) -> Result<Self::Belief>;

    /// Moves the belief; after an error it is as it was.
    ///
    /// # Errors
    /// When the step cannot be computed.
    fn advance(&self, belief: &mut Self::Belief, step: &Step) -> Result<()>;
}

/// What is believed about a centre.
pub trait CenterBelief {
    /// Corrects it by a measured centre with this variance, in square pixels; after an error it is as it was.
    ///
    /// # Errors
    /// When the step cannot be computed.
    fn correct(&mut self, at: Point, variance: f64) -> Result<()>;

    /// Mean and covariance of the position, and the velocity.
    fn state(&self) -> (Point, Matrix2<f64>, Velocity);
}

/// Where and how a model starts.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// Noise that is common to all models.
    pub noise: RelativeNoise,
    /// The centre.
    pub at: Point,
    /// The length that noise is relative to.
    pub extent_px: f64,
    /// Variance of the centre, in square pixels.
    pub position_variance: f64,
}

impl Start {
    /// Variance of the velocity, in (px/s)².
    pub fn velocity_variance(&self) -> f64 {
        (self.noise.start_speed * self.extent_px).powi(2)
    }
}

/// A step of a model.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Its length.
    pub dt_s: f64,
    /// The length that noise is relative to.
    pub extent_px: f64,
    /// Spectral density of white acceleration, in extents²/s³.
    pub acceleration: f64,
}

impl Step {
    /// Spectral density of white acceleration, in px²/s³.
    pub fn acceleration_density(&self) -> f64 {
        self.acceleration * self.extent_px * self.extent_px
    }
}

/// A box whose centre moves by a model; its width and height are random walks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CenterFilter<M: CenterModel> {
    model: M,
    noise: RelativeNoise,
    center: M::Belief,
    /// Width and height.
    size: Gaussian<2>,
}

impl<M: CenterModel + Clone> CenterFilter<M> {
    /// The model at rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite or a noise is out of range.
    pub fn new(model: &M, noise: RelativeNoise, bbox: BBox) -> Result<Self> {
        let extent_px = extent_px(&bbox);
        let (position_variance, size) = noise.measurement.variances(extent_px, None);
        let size = Gaussian::from_variances(SVector::from([bbox.width(), bbox.height()]), SVector::repeat(size))?;
        let center = model.start(&Start { noise, at: bbox.center(), extent_px, position_variance })?;
        Ok(Self { model: model.clone(), noise, center, size })
    }

    /// Covariance of centre and size, each with some variance added.
    fn spread(&self, position: f64, size: f64) -> BoxCovariance {
        let (_, center, _) = self.center.state();
        let sides = self.size.covariance();
        BoxCovariance::from_fn(|i, j| {
            let own = match (i, j) {
                (0 | 1, 0 | 1) => center[(i, j)],
                (2 | 3, 2 | 3) => sides[(i - 2, j - 2)],
                _ => 0.0,
            };
            let added = if i < 2 { position } else { size };
            if i == j { own + added } else { own }
        })
    }
}

impl<M: CenterModel + Clone> MotionFilter for CenterFilter<M> {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let extent = extent_px(&self.bbox());
        let growth = (self.noise.size_change * extent).powi(2) * dt_s;
        let walk = Transition::new(SMatrix::identity(), SMatrix::identity() * growth)?;
        let size = self.size.predicted(&walk)?;
        let step = Step { dt_s, extent_px: extent, acceleration: self.noise.acceleration };
        self.model.advance(&mut self.center, &step)?;
        self.size = size;
        let bbox = self.bbox();
        let (position, size) = self.noise.measurement.variances(extent_px(&bbox), None);
        Ok(Prior { bbox, innovation_covariance: Some(self.spread(position, size)), dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let extent = extent_px(&self.bbox());
        let (position, size) = self.noise.measurement.variances(extent, sight.sigma_px);
        let mut sides = self.size;
        let sensor = LinearMeasurement::<2, 2>::select([0, 1], [size, size])?;
        sides.update(&sensor, &SVector::from([sight.bbox.width(), sight.bbox.height()]))?;
        self.center.correct(sight.bbox.center(), position)?;
        self.size = sides;
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        // The noise was accepted when the filter was made, so only a box that is not finite can fail; it changes nothing.
        if let Ok(filter) = Self::new(&self.model, self.noise, bbox) {
            *self = filter;
        }
    }

    fn bbox(&self) -> BBox {
        let (center, ..) = self.center.state();
        let side = |i: usize| self.size.mean()[i].max(SMALLEST_SIDE_PX);
        BBox::from_center_size(center, side(0), side(1))
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        Some(self.spread(0.0, 0.0))
    }

    fn velocity(&self) -> Option<Velocity> {
        Some(self.center.state().2)
    }
}

impl<const N: usize> CenterBelief for Gaussian<N> {
    fn correct(&mut self, at: Point, variance: f64) -> Result<()> {
        let sensor = LinearMeasurement::<2, N>::select([0, 1], [variance, variance])?;
        self.update(&sensor, &SVector::from([at.x, at.y])).map(drop)
    }

    fn state(&self) -> (Point, Matrix2<f64>, Velocity) {
        parts(self)
    }
}

/// Mean and covariance of the position, and the velocity.
pub(super) fn parts<const N: usize>(belief: &Gaussian<N>) -> (Point, Matrix2<f64>, Velocity) {
    let (mean, covariance) = (belief.mean(), belief.covariance());
    let covariance = Matrix2::from_fn(|i, j| covariance[(i, j)]);
    (Point::new(mean[0], mean[1]), covariance, Velocity { x: mean[2], y: mean[3] })
}
