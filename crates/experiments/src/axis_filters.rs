//! One-axis filters by name: what stands in the benches of `gao2007`.

use super::filters::{Models, Plain, PositionFilter, position, position_sensor, start};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::filters::InputEstimator;
use pursuit_estimation::gao2007::{GatedFilter, GatedParams, LiteralFilter, LiteralParams};
use pursuit_estimation::motion::{ConstantAcceleration, ConstantVelocity, CurrentStatistical, Singer};
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, MotionModel, Transition};

type Scalar = SVector<f64, 1>;

/// All experiments run at one frame per time unit.
pub(crate) const STEP_S: f64 = 1.0;

/// A filter of one axis and its settings. Process noise is given as the paper's
/// `Q = q [[T⁴/4, T³/2], [T³/2, T²]]`; `variance` is always `R`.
#[derive(Debug, Clone, Copy)]
pub(crate) enum AxisFilter {
    /// Constant velocity.
    Plain { q: f64 },
    /// `gao2007` as printed, in one of its readings.
    Literal(LiteralParams),
    /// The gated, division-free form.
    Gated { q: f64 },
    /// Singer's model; the acceleration's rate and variance.
    Singer { rate: f64, variance: f64 },
    /// The "current" statistical model; rate and largest acceleration.
    Current { rate: f64, most: f64 },
    /// Input estimation over ten steps.
    InputEstimation { q: f64, threshold: f64 },
    /// Two interacting constant-velocity models.
    ImmVelocity { quiet: f64, agile: f64, stay: [f64; 2] },
    /// Constant velocity and constant acceleration, interacting.
    ImmAcceleration { quiet: f64, agile: f64, stay: [f64; 2] },
}

impl AxisFilter {
    /// The filter, started at the first measurement with the true velocity and unit covariance, as the paper starts.
    pub fn start(
        self,
        variance: f64,
        first: &Scalar,
        velocity: f64,
    ) -> Result<Box<dyn PositionFilter<1>>, EstimationError> {
        let speed = Scalar::new(velocity);
        let velocity_model = |q: f64| ConstantVelocity::<1>::piecewise(q).over(STEP_S);
        let belief: Gaussian<2> = start(first, &speed)?;
        let third: Gaussian<3> = start(first, &speed)?;
        Ok(match self {
            Self::Plain { q } => {
                Box::new(Plain { transition: velocity_model(q)?, sensor: position_sensor(variance)?, belief })
            }
            Self::Literal(params) => {
                let params = LiteralParams { measurement_variance: variance, ..params };
                Box::new(LiteralFilter::new(params, first[0], velocity)?)
            }
            Self::Gated { q } => {
                let params = GatedParams::recommended(q, variance);
                Box::new(GatedFilter::new(params, first[0], velocity)?)
            }
            Self::Singer { rate, variance: acceleration } => {
                let model = Singer::<1> { rate_per_s: rate, acceleration_variance: acceleration };
                Box::new(Plain { transition: model.over(STEP_S)?, sensor: position_sensor(variance)?, belief: third })
            }
            Self::Current { rate, most } => {
                let model = CurrentStatistical::<1> { rate_per_s: rate, max_acceleration: most };
                Box::new(Current { model, sensor: position_sensor(variance)?, belief: third })
            }
            Self::InputEstimation { q, threshold } => Box::new(Input {
                filter: InputEstimator::new(belief, threshold)?,
                transition: velocity_model(q)?,
                sensor: position_sensor(variance)?,
            }),
            Self::ImmVelocity { quiet, agile, stay } => {
                let transitions = [velocity_model(quiet)?, velocity_model(agile)?];
                Box::new(Models::new(transitions, stay, position_sensor(variance)?, belief)?)
            }
            Self::ImmAcceleration { quiet, agile, stay } => {
                let transitions = [forgetful(quiet)?, ConstantAcceleration::<1>::piecewise(agile).over(STEP_S)?];
                Box::new(Models::new(transitions, stay, position_sensor(variance)?, third)?)
            }
        })
    }
}

/// Constant velocity over the state of constant acceleration: the acceleration is put to zero.
fn forgetful(q: f64) -> Result<Transition<3>, EstimationError> {
    let step = ConstantVelocity::<1>::piecewise(q).over(STEP_S)?;
    let (mut matrix, mut noise) = (SMatrix::<f64, 3, 3>::zeros(), SMatrix::<f64, 3, 3>::zeros());
    matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(step.matrix());
    noise.fixed_view_mut::<2, 2>(0, 0).copy_from(step.noise());
    Transition::new(matrix, noise)
}

impl PositionFilter<1> for GatedFilter {
    fn step(&mut self, measured: &Scalar) -> Result<[Scalar; 2], EstimationError> {
        self.predict(STEP_S)?;
        let before = position(self.belief().mean());
        self.update(measured[0])?;
        Ok([before, position(self.belief().mean())])
    }
}

impl PositionFilter<1> for LiteralFilter {
    fn step(&mut self, measured: &Scalar) -> Result<[Scalar; 2], EstimationError> {
        self.predict(STEP_S)?;
        let before = position(self.belief().mean());
        self.update(measured[0])?;
        Ok([before, position(self.belief().mean())])
    }
}

/// The "current" statistical model: its transition depends on the state.
struct Current {
    model: CurrentStatistical<1>,
    sensor: LinearMeasurement<1, 3>,
    belief: Gaussian<3>,
}

impl PositionFilter<1> for Current {
    fn step(&mut self, measured: &Scalar) -> Result<[Scalar; 2], EstimationError> {
        self.belief.predict(&self.model.over_from(self.belief.mean(), STEP_S)?)?;
        let before = position(self.belief.mean());
        self.belief.update(&self.sensor, measured)?;
        Ok([before, position(self.belief.mean())])
    }
}

/// Input estimation, window of ten steps.
struct Input {
    filter: InputEstimator<1, 2, 1, 10>,
    transition: Transition<2>,
    sensor: LinearMeasurement<1, 2>,
}

impl PositionFilter<1> for Input {
    fn step(&mut self, measured: &Scalar) -> Result<[Scalar; 2], EstimationError> {
        let before = position(self.filter.belief().predicted(&self.transition)?.mean());
        let input = SVector::<f64, 2>::new(STEP_S * STEP_S / 2.0, STEP_S);
        self.filter.step(&self.transition, &input, &self.sensor, measured)?;
        Ok([before, position(self.filter.belief().mean())])
    }
}
