//! Motion models of the centre, beside a size that changes slowly: the box is measured, the model moves its middle.

use super::constant_velocity::MeasurementNoise;
use super::{HalfIntervalReading, MotionFilter, MotionModel, MotionParams, SMALLEST_SIDE_PX, Sight, extent_px};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use nalgebra::{Matrix2, SMatrix, SVector};
use pursuit_estimation::gao2007::GatedParams;
use pursuit_estimation::motion::{
    ConstantAcceleration, ConstantVelocity, CoordinatedTurn, CurrentStatistical, KnownTurn, Singer,
};
use pursuit_estimation::point::{GatedPoint, HalfIntervalPoint, InputPoint, PointFilter, PointStart};
use pursuit_estimation::zhu2014::Zhu2014Params;
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, MotionModel as Model, Result, Switching, Transition};
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};

/// Modes of the interacting models: quiet, agile, turning clockwise, turning counter-clockwise.
const MODES: usize = 4;

/// A box whose centre moves by one of several models; its width and height are random walks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CenterFilter {
    params: MotionParams,
    center: Center,
    /// Width and height.
    size: Gaussian<2>,
}

/// The belief about the centre; states are ordered by derivative and then by axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "the filter around it is boxed")]
enum Center {
    /// `[x, y, vx, vy, ax, ay]`: constant acceleration, Singer, current statistical.
    Acceleration(Gaussian<6>),
    /// `[x, y, vx, vy, ω]`.
    Turn(Gaussian<5>),
    /// `[x, y, vx, vy]`, four modes.
    Modes(Imm<4, MODES>),
    /// A paper's filter, in a unit of length of its own.
    Paper {
        /// Pixels in that unit.
        unit_px: f64,
        filter: PaperFilter,
    },
}

/// The papers' filters of a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum PaperFilter {
    Gated(Box<GatedPoint>),
    HalfInterval(Box<HalfIntervalPoint>),
    Input(Box<InputPoint>),
}

impl PaperFilter {
    /// The paper's filter that `params` name, first seen at `at` with variance `variance`, both in its unit of length.
    fn new(params: &MotionParams, at: &SVector<f64, 2>, variance: f64, speed: f64) -> Result<Self> {
        let noise = SMatrix::<f64, 2, 2>::identity() * variance;
        // None of the three has a further component.
        let start = PointStart { speed_px_per_s: speed, further: 1.0 };
        Ok(match params.model {
            MotionModel::Gao2007 => {
                // White acceleration of density q has, held over a step, the variance q / dt.
                let acceleration = params.acceleration / params.frame_s;
                let settings =
                    GatedParams { threshold: params.surprise, ..GatedParams::recommended(acceleration, variance) };
                Self::Gated(Box::new(GatedPoint::new(settings, start, at, &noise)?))
            }
            MotionModel::Zhu2014 => {
                let reading = match params.half_interval {
                    HalfIntervalReading::Anywhere => Zhu2014Params::jump_anywhere(),
                    HalfIntervalReading::Literal => Zhu2014Params::literal(),
                };
                let settings = Zhu2014Params { threshold: params.surprise, ..reading };
                Self::HalfInterval(Box::new(HalfIntervalPoint::new(settings, params.frame_s, start, at, &noise)?))
            }
            _ => {
                let motion = ConstantVelocity::white(params.acceleration);
                Self::Input(Box::new(InputPoint::new(motion, params.surprise, start, at, &noise)?))
            }
        })
    }

    fn inner(&self) -> &dyn PointFilter {
        match self {
            Self::Gated(filter) => &**filter,
            Self::HalfInterval(filter) => &**filter,
            Self::Input(filter) => &**filter,
        }
    }

    fn inner_mut(&mut self) -> &mut dyn PointFilter {
        match self {
            Self::Gated(filter) => &mut **filter,
            Self::HalfInterval(filter) => &mut **filter,
            Self::Input(filter) => &mut **filter,
        }
    }
}

impl CenterFilter {
    /// The model that `params` name, at rest at `bbox`.
    ///
    /// # Errors
    /// When the box is not finite or a noise is out of range.
    pub fn new(params: &MotionParams, bbox: BBox) -> Result<Self> {
        let extent = extent_px(&bbox);
        let (position, size) = MeasurementNoise::from(params).variances(extent, None);
        let size = Gaussian::from_variances(SVector::from([bbox.width(), bbox.height()]), SVector::repeat(size))?;
        let (x, y) = (bbox.center().x, bbox.center().y);
        let velocity = (params.start_speed * extent).powi(2);
        let acceleration = (params.largest_acceleration * extent).powi(2);
        let center = match params.model {
            MotionModel::CoordinatedTurn => Center::Turn(Gaussian::from_variances(
                SVector::from([x, y, 0.0, 0.0, 0.0]),
                SVector::from([position, position, velocity, velocity, params.turn_rate.powi(2)]),
            )?),
            MotionModel::Imm => {
                let belief = Gaussian::from_variances(
                    SVector::from([x, y, 0.0, 0.0]),
                    SVector::from([position, position, velocity, velocity]),
                )?;
                Center::Modes(Imm::new(belief, [1.0 / MODES as f64; MODES])?)
            }
            MotionModel::Gao2007 | MotionModel::Zhu2014 | MotionModel::InputEstimation => {
                // The patent's noise is in pixels; the others scale with the target.
                let unit_px = if params.model == MotionModel::Zhu2014 { 1.0 } else { extent };
                let speed = params.start_speed * extent / unit_px;
                let at = SVector::from([x / unit_px, y / unit_px]);
                let filter = PaperFilter::new(params, &at, position / (unit_px * unit_px), speed)?;
                Center::Paper { unit_px, filter }
            }
            _ => Center::Acceleration(Gaussian::from_variances(
                SVector::from([x, y, 0.0, 0.0, 0.0, 0.0]),
                SVector::from([position, position, velocity, velocity, acceleration, acceleration]),
            )?),
        };
        Ok(Self { params: params.clone(), center, size })
    }

    /// Moves the centre by `dt_s` seconds; after an error it is as it was.
    fn advance(&mut self, dt_s: f64) -> Result<()> {
        let extent = extent_px(&self.bbox());
        let p = &self.params;
        let density = p.acceleration * extent * extent;
        match &mut self.center {
            Center::Acceleration(belief) => {
                let rate_per_s = 1.0 / p.manoeuvre_s;
                let largest = p.largest_acceleration * extent;
                let transition = match p.model {
                    MotionModel::Singer => {
                        // Singer's own prior with accelerations uniform up to the largest: σ² = a²/3.
                        Singer::<2>::from_prior(rate_per_s, largest, 0.0, 0.0).over(dt_s)?
                    }
                    MotionModel::CurrentStatistical => {
                        CurrentStatistical::<2> { rate_per_s, max_acceleration: largest }
                            .over_from(belief.mean(), dt_s)?
                    }
                    _ => ConstantAcceleration::<2>::white(p.jerk * extent * extent).over(dt_s)?,
                };
                belief.predict(&transition)
            }
            Center::Turn(belief) => {
                let model = CoordinatedTurn { acceleration_density: density, turn_density: p.turn_change };
                belief.predict_extended(&model, dt_s)
            }
            Center::Modes(modes) => {
                let turn = |rate_rad_per_s| {
                    KnownTurn { rate_rad_per_s, acceleration_density: density * p.quiet_share }.over(dt_s)
                };
                let transitions: [Transition<4>; MODES] = [
                    ConstantVelocity::<2>::white(density * p.quiet_share).over(dt_s)?,
                    ConstantVelocity::<2>::white(density).over(dt_s)?,
                    turn(p.turn_rate)?,
                    turn(-p.turn_rate)?,
                ];
                modes.predict(&transitions, &switching(p.sojourn_s, dt_s)?)
            }
            Center::Paper { filter, .. } => filter.inner_mut().predict(dt_s),
        }
    }

    /// Corrects the centre by a measured one with this variance; after an error it is as it was.
    fn correct_center(&mut self, at: Point, variance: f64) -> Result<()> {
        match &mut self.center {
            Center::Acceleration(belief) => corrected(belief, at, variance),
            Center::Turn(belief) => corrected(belief, at, variance),
            Center::Modes(modes) => {
                let sensor = LinearMeasurement::<2, 4>::select([0, 1], [variance, variance])?;
                modes.update(&sensor, &SVector::from([at.x, at.y])).map(drop)
            }
            Center::Paper { unit_px, filter } => {
                let noise = SMatrix::<f64, 2, 2>::identity() * (variance / (*unit_px * *unit_px));
                let at = SVector::from([at.x / *unit_px, at.y / *unit_px]);
                filter.inner_mut().update(&at, &noise).map(drop)
            }
        }
    }

    /// Mean and covariance of position, and the velocity.
    fn state(&self) -> (Point, Matrix2<f64>, Velocity) {
        fn parts<const N: usize>(belief: &Gaussian<N>) -> (Point, Matrix2<f64>, Velocity) {
            let (mean, covariance) = (belief.mean(), belief.covariance());
            let covariance = Matrix2::from_fn(|i, j| covariance[(i, j)]);
            (Point::new(mean[0], mean[1]), covariance, Velocity { x: mean[2], y: mean[3] })
        }
        match &self.center {
            Center::Acceleration(belief) => parts(belief),
            Center::Turn(belief) => parts(belief),
            Center::Modes(modes) => parts(&modes.combined()),
            Center::Paper { unit_px, filter } => {
                let (at, covariance, velocity) = parts(&filter.inner().belief());
                let velocity = Velocity { x: velocity.x * unit_px, y: velocity.y * unit_px };
                (Point::new(at.x * unit_px, at.y * unit_px), covariance * (unit_px * unit_px), velocity)
            }
        }
    }

    /// Covariance of centre and size, each with some variance added.
    fn spread(&self, position: f64, size: f64) -> BoxCovariance {
        let (_, center, _) = self.state();
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

/// Every mode lasts `sojourn_s` on average and gives way to any other alike.
fn switching(sojourn_s: f64, dt_s: f64) -> Result<Switching<MODES>> {
    let leave = -(-dt_s / sojourn_s).exp_m1();
    let to = leave / (MODES - 1) as f64;
    Switching::per_step(SMatrix::from_fn(|i, j| if i == j { 1.0 - leave } else { to }))
}

/// Corrects a belief by a measured position.
fn corrected<const N: usize>(belief: &mut Gaussian<N>, at: Point, variance: f64) -> Result<()> {
    let sensor = LinearMeasurement::<2, N>::select([0, 1], [variance, variance])?;
    belief.update(&sensor, &SVector::from([at.x, at.y])).map(drop)
}

impl MotionFilter for CenterFilter {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let growth = (self.params.size_change * extent_px(&self.bbox())).powi(2) * dt_s;
        let walk = Transition::new(SMatrix::identity(), SMatrix::identity() * growth)?;
        let size = self.size.predicted(&walk)?;
        self.advance(dt_s)?;
        self.size = size;
        let bbox = self.bbox();
        let (position, size) = MeasurementNoise::from(&self.params).variances(extent_px(&bbox), None);
        Ok(Prior { bbox, innovation_covariance: Some(self.spread(position, size)), dt_s })
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let extent = extent_px(&self.bbox());
        let (position, size) = MeasurementNoise::from(&self.params).variances(extent, sight.sigma_px);
        let mut sides = self.size;
        let sensor = LinearMeasurement::<2, 2>::select([0, 1], [size, size])?;
        sides.update(&sensor, &SVector::from([sight.bbox.width(), sight.bbox.height()]))?;
        self.correct_center(sight.bbox.center(), position)?;
        self.size = sides;
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        // The noise was accepted when the filter was made, so only a box that is not finite can fail; it changes nothing.
        if let Ok(filter) = Self::new(&self.params, bbox) {
            *self = filter;
        }
    }

    fn bbox(&self) -> BBox {
        let (center, ..) = self.state();
        let side = |i: usize| self.size.mean()[i].max(SMALLEST_SIDE_PX);
        BBox::from_center_size(center, side(0), side(1))
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        Some(self.spread(0.0, 0.0))
    }

    fn velocity(&self) -> Option<Velocity> {
        Some(self.state().2)
    }
}
