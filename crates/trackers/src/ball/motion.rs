use super::params::BallMotionMode;
use crate::motion::{BoxFilter, BoxNoise, ManoeuvreNoise, ManoeuvringBox, PartlySeen};
use crate::{BoxCovariance, Measurement, MotionFilter, Prior};
use pursuit_estimation::EstimationError;
use pursuit_estimation::motion::StepBox;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The ball's motion filter, as chosen by [`BallMotionMode`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum BallMotion {
    /// Bounces, and balls that are partly hidden.
    Adaptive(Box<PartlySeen<ManoeuvringBox>>),
    /// As printed.
    Paper(Box<BoxFilter>),
}

impl BallMotion {
    pub(super) fn new(mode: BallMotionMode, bbox: BBox) -> Result<Self, EstimationError> {
        Ok(match mode {
            BallMotionMode::Adaptive => {
                let filter = ManoeuvringBox::new(ManoeuvreNoise::ball(), bbox)?;
                Self::Adaptive(Box::new(PartlySeen::new(filter)))
            }
            BallMotionMode::Paper => Self::Paper(Box::new(BoxFilter::new(BoxNoise::PerStep(StepBox::ball()), bbox)?)),
        })
    }

    fn filter(&self) -> &dyn MotionFilter {
        match self {
            Self::Adaptive(filter) => &**filter,
            Self::Paper(filter) => &**filter,
        }
    }

    fn filter_mut(&mut self) -> &mut dyn MotionFilter {
        match self {
            Self::Adaptive(filter) => &mut **filter,
            Self::Paper(filter) => &mut **filter,
        }
    }
}

impl MotionFilter for BallMotion {
    fn predict(&mut self, dt_s: f64) -> Result<Prior, Failure> {
        self.filter_mut().predict(dt_s)
    }

    fn correct(&mut self, measurement: &Measurement) -> Result<(), Failure> {
        self.filter_mut().correct(measurement)
    }

    fn restart(&mut self, bbox: BBox) {
        self.filter_mut().restart(bbox);
    }

    fn bbox(&self) -> BBox {
        self.filter().bbox()
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        self.filter().covariance()
    }
}
