//! Motion models of boxes: what the target is expected to do, for any tracker to use.
//!
//! [`Motion`] is the model that [`MotionParams`] names. All predict over any time step, correct by a measured box, and
//! forecast without changing.

mod bounce;
mod camera;
mod center;
mod constant_velocity;
mod params;
mod partial_occlusion;
mod sampled;

pub use bounce::{ManoeuvreNoise, ManoeuvringBox};
pub use camera::{CameraCompensation, CameraShift};
pub use center::CenterFilter;
pub use constant_velocity::{BoxFilter, BoxNoise, MeasurementNoise, RelativeNoise};
pub use params::{BounceParams, HalfIntervalReading, MotionModel, MotionParams, SamplingParams};
pub use partial_occlusion::{Completion, CutSides, PartialOcclusion, complete};
pub use sampled::SampledBox;

use crate::roles::{Measurement, Prior};
use crate::{BoxCovariance, Forecast, NextSample, Velocity};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::motion::StepBox;
use pursuit_estimation::{EstimationError, Result};
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// What a motion model is told of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// The box measured.
    pub bbox: BBox,
    /// Standard deviation of its centre in pixels, where the localizer can tell.
    pub sigma_px: Option<f64>,
    /// Share of its correction that the velocity takes, `[0, 1]`.
    pub velocity_share: f64,
}

impl Sight {
    /// A box, and the standard deviation of its centre in pixels where that is known; the velocity takes all of its correction.
    pub const fn of(bbox: BBox, sigma_px: Option<f64>) -> Self {
        Self { bbox, sigma_px, velocity_share: 1.0 }
    }
}

impl From<&Measurement> for Sight {
    fn from(m: &Measurement) -> Self {
        Self { velocity_share: m.velocity_share.clamp(0.0, 1.0), ..Self::of(m.bbox, m.sigma_px) }
    }
}

/// Predicts where the box goes and corrects the prediction by what was measured.
pub trait MotionFilter {
    /// Moves the belief `dt_s` seconds on (> 0) and returns the prior.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    fn predict(&mut self, dt_s: f64) -> Result<Prior>;

    /// Corrects the belief by a measurement that is believed.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    fn correct(&mut self, sight: &Sight) -> Result<()>;

    /// Starts anew at `bbox`, at rest. A box that is not finite changes nothing.
    fn restart(&mut self, bbox: BBox);

    /// The box believed now.
    fn bbox(&self) -> BBox;

    /// Covariance of the box believed now.
    fn covariance(&self) -> Option<BoxCovariance>;

    /// Velocity of the centre believed now.
    fn velocity(&self) -> Option<Velocity>;
}

/// The motion model of a target: the one that its parameters name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    params: MotionParams,
    model: Model,
    /// How far the picture has moved since the model was started: the model sees a camera that stands still.
    offset: (f64, f64),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Model {
    Box(Box<BoxFilter>),
    Bounce(Box<PartialOcclusion<ManoeuvringBox>>),
    Center(Box<CenterFilter>),
    Still(StillBox),
    Sampled(Box<SampledBox>),
}

impl Motion {
    /// The model `params` name, at rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite or a noise is out of range.
    pub fn new(params: MotionParams, bbox: BBox) -> Result<Self> {
        let model = match params.model {
            MotionModel::None if bbox.is_finite() => Model::Still(StillBox(bbox)),
            MotionModel::None => return Err(EstimationError::NotFinite { what: "the box" }),
            MotionModel::ConstantVelocity => {
                Model::Box(Box::new(BoxFilter::new(BoxNoise::Relative((&params).into()), bbox)?))
            }
            MotionModel::Ball => Model::Box(Box::new(BoxFilter::new(BoxNoise::PerStep(StepBox::ball()), bbox)?)),
            MotionModel::Bounce => {
                let filter = ManoeuvringBox::new((&params).into(), bbox)?;
                Model::Bounce(Box::new(PartialOcclusion::new(filter, (&params.bounce).into())))
            }
            MotionModel::Qu2010 | MotionModel::Qu2010Simplified => {
                let simplified = params.model == MotionModel::Qu2010Simplified;
                Model::Sampled(Box::new(SampledBox::new(params.sampling.clone(), simplified, bbox)?))
            }
            _ => Model::Center(Box::new(CenterFilter::new(&params, bbox)?)),
        };
        Ok(Self { params, model, offset: (0.0, 0.0) })
    }

    /// Its parameters.
    pub const fn params(&self) -> &MotionParams {
        &self.params
    }

    /// The camera's motion moved the picture, and the target with it, by `(dx, dy)` pixels.
    pub fn carry(&mut self, (dx, dy): (f64, f64)) {
        self.offset = (self.offset.0 + dx, self.offset.1 + dy);
    }

    /// A box as the model sees it, moved into the picture.
    fn in_picture(&self, bbox: &BBox) -> BBox {
        // A camera that stands still changes no bit.
        if self.offset == (0.0, 0.0) { *bbox } else { bbox.translated(self.offset.0, self.offset.1) }
    }

    /// A box in the picture as the model sees it.
    fn in_model(&self, bbox: &BBox) -> BBox {
        if self.offset == (0.0, 0.0) { *bbox } else { bbox.translated(-self.offset.0, -self.offset.1) }
    }

    /// Goes on with other parameters from the box believed now; what was known of its velocity is forgotten.
    ///
    /// # Errors
    /// As [`new`](Self::new); the model is then as before.
    pub fn change(&mut self, params: MotionParams) -> Result<()> {
        *self = Self::new(params, self.bbox())?;
        Ok(())
    }

    /// Where the box will be `seconds` after `time_s`, the time of the last prediction; 0 or less: where it is now.
    ///
    /// # Errors
    /// When the step cannot be computed.
    pub fn forecast(&self, time_s: f64, seconds: f64) -> Result<Forecast> {
        let mut ahead = self.clone();
        let seconds = if seconds > 0.0 { seconds } else { 0.0 };
        if seconds > 0.0 {
            ahead.predict(seconds)?;
        }
        Ok(Forecast {
            time_s: time_s + seconds,
            bbox: ahead.bbox(),
            covariance: ahead.covariance(),
            velocity: ahead.velocity(),
        })
    }

    /// Where the target will be at the next sample, of models that sample.
    pub fn next_sample(&self) -> Option<NextSample> {
        let Model::Sampled(filter) = &self.model else { return None };
        let next = filter.next_sample();
        let (dx, dy) = self.offset;
        Some(NextSample { center: next.center.map(|at| Point::new(at.x + dx, at.y + dy)), ..next })
    }

    fn filter(&self) -> &dyn MotionFilter {
        match &self.model {
            Model::Box(filter) => &**filter,
            Model::Bounce(filter) => &**filter,
            Model::Center(filter) => &**filter,
            Model::Still(filter) => filter,
            Model::Sampled(filter) => &**filter,
        }
    }

    fn filter_mut(&mut self) -> &mut dyn MotionFilter {
        match &mut self.model {
            Model::Box(filter) => &mut **filter,
            Model::Bounce(filter) => &mut **filter,
            Model::Center(filter) => &mut **filter,
            Model::Still(filter) => filter,
            Model::Sampled(filter) => &mut **filter,
        }
    }
}

impl MotionFilter for Motion {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let prior = self.filter_mut().predict(dt_s)?;
        Ok(Prior { bbox: self.in_picture(&prior.bbox), ..prior })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let bbox = self.in_model(&sight.bbox);
        self.filter_mut().correct(&Sight { bbox, ..*sight })
    }

    fn restart(&mut self, bbox: BBox) {
        let bbox = self.in_model(&bbox);
        self.filter_mut().restart(bbox);
    }

    fn bbox(&self) -> BBox {
        self.in_picture(&self.filter().bbox())
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        self.filter().covariance()
    }

    fn velocity(&self) -> Option<Velocity> {
        self.filter().velocity()
    }
}

/// The box measured last, expected to stay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct StillBox(BBox);

impl MotionFilter for StillBox {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        Ok(Prior { bbox: self.0, innovation_covariance: None, dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        if !sight.bbox.is_finite() {
            return Err(EstimationError::NotFinite { what: "the measured box" });
        }
        self.0 = sight.bbox;
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        if bbox.is_finite() {
            self.0 = bbox;
        }
    }

    fn bbox(&self) -> BBox {
        self.0
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        None
    }

    fn velocity(&self) -> Option<Velocity> {
        None
    }
}

/// Sides below this many pixels are not believed: a filter must not shrink a box to nothing.
const SMALLEST_SIDE_PX: f64 = 1.0;

/// `[x, y, w, h]` of a box, as measured.
fn measured(bbox: &BBox) -> SVector<f64, 4> {
    SVector::from([bbox.center().x, bbox.center().y, bbox.width(), bbox.height()])
}

/// The box of a state whose centre is at components 0 and 1 and whose size is at `size` and `size + 1`.
fn box_of<const N: usize>(state: &SVector<f64, N>, size: usize) -> BBox {
    let side = |i: usize| state[i].max(SMALLEST_SIDE_PX);
    BBox::from_center_size(Point::new(state[0], state[1]), side(size), side(size + 1))
}

/// Covariance of centre and size, taken out of that of the whole state.
fn box_covariance<const N: usize>(covariance: &SMatrix<f64, N, N>, size: usize) -> BoxCovariance {
    let at = [0, 1, size, size + 1];
    BoxCovariance::from_fn(|i, j| covariance[(at[i], at[j])])
}

/// The length that noise is relative to: the side of the square of equal area.
fn extent_px(bbox: &BBox) -> f64 {
    bbox.area().sqrt().max(SMALLEST_SIDE_PX)
}

#[cfg(test)]
mod tests;
