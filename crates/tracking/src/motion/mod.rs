//! Motion models of boxes: what the target is expected to do, for any tracker to use.
//!
//! [`Motion`] is the model that [`MotionParams`] names. All predict over any time step, correct by a measured box, and
//! forecast without changing.

mod bounce;
mod camera;
mod center;
mod constant_acceleration;
mod constant_velocity;
mod coordinated_turn;
mod gao2007;
mod imm;
mod input_estimation;
mod paper;
mod params;
mod partial_occlusion;
mod per_frame;
mod sampled;
mod singer;
mod still;
mod zhu2014;

pub use bounce::{BounceParams, ManoeuvringBox};
pub use camera::{CameraCompensation, CameraMotion, CameraShift};
pub use constant_acceleration::ConstantAccelerationParams;
pub use constant_velocity::{Agile, BoxFilter, BoxNoise, MeasurementNoise, RelativeNoise};
pub use coordinated_turn::CoordinatedTurnParams;
pub use gao2007::{Gao2007Params, HeldOrWhite};
pub use imm::ImmParams;
pub use input_estimation::InputEstimationParams;
pub use params::{MotionModel, MotionParams};
pub use partial_occlusion::{Completion, CutSides, PartialOcclusion, complete};
pub use per_frame::{BoxState, PerFrameParams};
pub use sampled::{ExtrapolationParams, SampledBox, SamplingParams};
pub use singer::{CurrentStatisticalParams, SingerParams};
pub use zhu2014::{HalfIntervalReading, Zhu2014Params};

use center::CenterFilter;
use per_frame::PerFrameBox;
use still::StillBox;

use crate::{BoxCovariance, Forecast, Measurement, NextSample, Prior, Velocity};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::Result;
use pursuit_estimation::motion::StepBox;
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

    /// Corrects the belief by measurements of which at most one is the target's, each with the probability that it is; these sum
    /// to one at most. A model that knows no better corrects by what is to be expected of the measurement: the box believed
    /// is then right, and its covariance that of one sure measurement.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    fn correct_shared(&mut self, sights: &[(Sight, f64)]) -> Result<()> {
        let missed = 1.0 - sights.iter().map(|(_, probability)| probability).sum::<f64>();
        let each = sights.iter().map(|(sight, probability)| measured(&sight.bbox) * *probability);
        let mean = each.fold(measured(&self.bbox()) * missed, |sum, part| sum + part);
        self.correct(&Sight::of(box_of(&mean, 2), None))
    }

    /// Starts anew at `bbox`, at rest. A box that is not finite changes nothing.
    fn restart(&mut self, bbox: BBox);

    /// The box believed now.
    fn bbox(&self) -> BBox;

    /// Covariance of the box believed now.
    fn covariance(&self) -> Option<BoxCovariance>;

    /// Velocity of the centre believed now.
    fn velocity(&self) -> Option<Velocity>;

    /// Where the target will be at the next sample, of models that sample.
    fn next_sample(&self) -> Option<NextSample> {
        None
    }
}

/// The motion model of a target: the one that its parameters name.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    params: MotionParams,
    model: Model,
    /// How far the picture has moved since the model was started: the model sees a camera that stands still.
    offset: (f64, f64),
}

impl Clone for Motion {
    fn clone(&self) -> Self {
        Self { params: self.params.clone(), model: self.model.clone(), offset: self.offset }
    }

    fn clone_from(&mut self, source: &Self) {
        self.params.clone_from(&source.params);
        self.model.clone_from(&source.model);
        self.offset = source.offset;
    }
}

macro_rules! filters {
    ($($name:ident: $filter:ty),+ $(,)?) => {
        /// The filter of a model.
        #[derive(Debug, PartialEq, Serialize, Deserialize)]
        enum Model {
            $($name(Box<$filter>)),+
        }

        impl Clone for Model {
            fn clone(&self) -> Self {
                match self { $(Self::$name(filter) => Self::$name(filter.clone())),+ }
            }

            fn clone_from(&mut self, source: &Self) {
                match (self, source) {
                    $((Self::$name(own), Self::$name(other)) => own.clone_from(other),)+
                    (own, other) => *own = other.clone(),
                }
            }
        }

        /// Without a table of functions, so that the small ones become part of what calls them.
        impl MotionFilter for Model {
            fn predict(&mut self, dt_s: f64) -> Result<Prior> {
                match self { $(Self::$name(filter) => filter.predict(dt_s)),+ }
            }

            fn correct(&mut self, sight: &Sight) -> Result<()> {
                match self { $(Self::$name(filter) => filter.correct(sight)),+ }
            }

            fn correct_shared(&mut self, sights: &[(Sight, f64)]) -> Result<()> {
                match self { $(Self::$name(filter) => filter.correct_shared(sights)),+ }
            }

            fn restart(&mut self, bbox: BBox) {
                match self { $(Self::$name(filter) => filter.restart(bbox)),+ }
            }

            fn bbox(&self) -> BBox {
                match self { $(Self::$name(filter) => filter.bbox()),+ }
            }

            fn covariance(&self) -> Option<BoxCovariance> {
                match self { $(Self::$name(filter) => filter.covariance()),+ }
            }

            fn velocity(&self) -> Option<Velocity> {
                match self { $(Self::$name(filter) => filter.velocity()),+ }
            }

            fn next_sample(&self) -> Option<NextSample> {
                match self { $(Self::$name(filter) => filter.next_sample()),+ }
            }
        }

        $(impl From<$filter> for Model {
            fn from(filter: $filter) -> Self {
                Self::$name(Box::new(filter))
            }
        })+
    };
}

filters! {
    Box: BoxFilter,
    ConstantAcceleration: CenterFilter<ConstantAccelerationParams>,
    CoordinatedTurn: CenterFilter<CoordinatedTurnParams>,
    Singer: CenterFilter<SingerParams>,
    CurrentStatistical: CenterFilter<CurrentStatisticalParams>,
    Imm: CenterFilter<ImmParams>,
    Gao2007: CenterFilter<Gao2007Params>,
    Zhu2014: CenterFilter<Zhu2014Params>,
    InputEstimation: CenterFilter<InputEstimationParams>,
    Bounce: PartialOcclusion<ManoeuvringBox>,
    PerFrame: PerFrameBox,
    Sampled: SampledBox,
    Still: StillBox,
}

impl Model {
    /// The model that `params` name, at rest at `bbox`.
    fn new(params: &MotionParams, bbox: BBox) -> Result<Self> {
        let noise = RelativeNoise::from(params);
        Ok(match params.model {
            MotionModel::ConstantVelocity => BoxFilter::new(BoxNoise::Relative(noise), bbox)?.into(),
            MotionModel::ConstantAcceleration => CenterFilter::new(&params.constant_acceleration, noise, bbox)?.into(),
            MotionModel::CoordinatedTurn => CenterFilter::new(&params.coordinated_turn, noise, bbox)?.into(),
            MotionModel::Singer => CenterFilter::new(&params.singer, noise, bbox)?.into(),
            MotionModel::CurrentStatistical => CenterFilter::new(&params.current_statistical, noise, bbox)?.into(),
            MotionModel::Imm => CenterFilter::new(&params.imm, noise, bbox)?.into(),
            MotionModel::Gao2007 => CenterFilter::new(&params.gao2007, noise, bbox)?.into(),
            MotionModel::Zhu2014 => CenterFilter::new(&params.zhu2014, noise, bbox)?.into(),
            MotionModel::InputEstimation => CenterFilter::new(&params.input_estimation, noise, bbox)?.into(),
            MotionModel::Bounce => {
                PartialOcclusion::new(ManoeuvringBox::new(params, bbox)?, (&params.bounce).into()).into()
            }
            MotionModel::Ball => BoxFilter::new(BoxNoise::PerStep(StepBox::ball()), bbox)?.into(),
            MotionModel::Qu2010 => SampledBox::new(params.qu2010.clone(), None, bbox)?.into(),
            MotionModel::Qu2010Simplified => {
                SampledBox::new(params.qu2010.clone(), Some(params.qu2010_simplified.clone()), bbox)?.into()
            }
            MotionModel::PerFrame => PerFrameBox::new(params.per_frame.clone(), bbox)?.into(),
            MotionModel::None => StillBox::new(bbox)?.into(),
        })
    }
}

impl Motion {
    /// The model `params` name, at rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite or a noise is out of range.
    pub fn new(params: MotionParams, bbox: BBox) -> Result<Self> {
        let model = Model::new(&params, bbox)?;
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
}

impl MotionFilter for Motion {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let mut prior = self.model.predict(dt_s);
        if let Ok(prior) = &mut prior {
            prior.bbox = self.in_picture(&prior.bbox);
        }
        prior
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let bbox = self.in_model(&sight.bbox);
        self.model.correct(&Sight { bbox, ..*sight })
    }

    fn correct_shared(&mut self, sights: &[(Sight, f64)]) -> Result<()> {
        if self.offset == (0.0, 0.0) {
            return self.model.correct_shared(sights);
        }
        let seen = |(sight, p): &(Sight, f64)| (Sight { bbox: self.in_model(&sight.bbox), ..*sight }, *p);
        let sights: Vec<_> = sights.iter().map(seen).collect();
        self.model.correct_shared(&sights)
    }

    fn restart(&mut self, bbox: BBox) {
        let bbox = self.in_model(&bbox);
        self.model.restart(bbox);
    }

    fn bbox(&self) -> BBox {
        self.in_picture(&self.model.bbox())
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        self.model.covariance()
    }

    fn velocity(&self) -> Option<Velocity> {
        self.model.velocity()
    }

    fn next_sample(&self) -> Option<NextSample> {
        let next = self.model.next_sample()?;
        let (dx, dy) = self.offset;
        Some(NextSample { center: next.center.map(|at| Point::new(at.x + dx, at.y + dy)), ..next })
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
