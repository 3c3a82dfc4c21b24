//! `zhu2014`: a constant-velocity filter that goes over an interval again, in halves, when the measurement at its end
//! shows that the target manoeuvred inside it.

mod params;

pub use params::{HalfInterval, Jump, Zhu2014Params};

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::require_time_step;
use crate::matrix::sandwich;
use crate::motion::ConstantVelocity;
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, MotionModel, Result, Transition};

/// The patent's filter: state `[x, y, vx, vy]`, measured `[x, y]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "HalfIntervalFilter")]
pub struct HalfIntervalFilter {
    params: Zhu2014Params,
    belief: Gaussian<4>,
    /// The belief at the last measurement and the time since, for going over the interval again.
    interval: Option<(Gaussian<4>, f64)>,
}

crate::checked!(HalfIntervalFilter);

impl HalfIntervalFilter {
    fn restored(self) -> Result<Self> {
        if let Some((_, dt_s)) = self.interval {
            require_time_step(dt_s)?;
        }
        Ok(Self { interval: self.interval, ..Self::new(self.params, self.belief)? })
    }
}

/// The sensor of positions, by the variance of the parameters.
fn sensor(params: &Zhu2014Params) -> Result<LinearMeasurement<2, 4>> {
    let variance = params.measurement_variance_px2;
    LinearMeasurement::select([0, 1], [variance, variance])
}

/// What an update found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The innovation against the plain prediction: what the manoeuvre was judged by.
    pub innovation: Innovation<2>,
    /// Whether the interval was gone over again.
    pub manoeuvre: bool,
}

impl HalfIntervalFilter {
    /// A filter that starts from `belief`.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn new(params: Zhu2014Params, belief: Gaussian<4>) -> Result<Self> {
        params.validate()?;
        sensor(&params)?;
        Ok(Self { params, belief, interval: None })
    }

    /// The belief now.
    pub const fn belief(&self) -> &Gaussian<4> {
        &self.belief
    }

    fn transition(&self, dt_s: f64) -> Result<Transition<4>> {
        ConstantVelocity::<2>::per_step(self.params.process_variance).over(dt_s)
    }

    /// The belief after `dt_s` seconds, leaving this one alone.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite or the result overflows.
    pub fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>> {
        self.belief.predicted(&self.transition(dt_s)?)
    }

    /// Moves the belief by `dt_s` seconds, as the plain filter does.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite; the filter is then as it was.
    pub fn predict(&mut self, dt_s: f64) -> Result<()> {
        let predicted = self.forecast(dt_s)?;
        // After a gap only the last step is gone over again: the belief at its start is the prediction so far.
        self.interval = Some((self.belief, dt_s));
        self.belief = predicted;
        Ok(())
    }

    /// Corrects the belief by a measured position; goes over the interval again first, if it held a manoeuvre.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the filter is then as it was.
    pub fn update(&mut self, position_px: &SVector<f64, 2>) -> Result<Outcome> {
        self.update_by(&sensor(&self.params)?, position_px)
    }

    /// [`update`](Self::update) by a position of this `noise`, px², in place of the parameters'.
    ///
    /// # Errors
    /// Where `noise` is no covariance, and as [`Gaussian::update`]; the filter is then as it was.
    pub fn update_with_noise(&mut self, position_px: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Outcome> {
        self.update_by(&sensor(&self.params)?.with_noise(*noise)?, position_px)
    }

    fn update_by(&mut self, sensor: &LinearMeasurement<2, 4>, position_px: &SVector<f64, 2>) -> Result<Outcome> {
        let innovation = self.belief.innovation(sensor, position_px)?;
        let surprised = innovation.nis() > self.params.threshold;
        let mut belief = self.belief;
        let mut manoeuvre = false;
        if let Some((before, dt_s)) = self.interval
            && surprised
        {
            belief = again(&self.params, &before, dt_s, position_px)?;
            manoeuvre = true;
        }
        belief.update(sensor, position_px)?;
        self.belief = belief;
        self.interval = None;
        Ok(Outcome { innovation, manoeuvre })
    }
}

/// The prediction over an interval of `dt_s` seconds from `before` that ends at the measured `position_px` and held a
/// manoeuvre.
///
/// # Errors
/// Where `dt_s` is not positive and finite, or a parameter is out of range.
pub fn again(
    params: &Zhu2014Params,
    before: &Gaussian<4>,
    dt_s: f64,
    position_px: &SVector<f64, 2>,
) -> Result<Gaussian<4>> {
    params.validate()?;
    if !position_px.iter().all(|value| value.is_finite()) {
        return Err(EstimationError::NotFinite { what: "the measurement" });
    }
    let model = ConstantVelocity::<2>::per_step(params.process_variance);
    let whole = model.over(dt_s)?;
    match params.half_interval {
        HalfInterval::HalfNoise => halves(before, &model.over(0.5 * dt_s)?.with_noise(whole.noise() * 0.5)?),
        HalfInterval::FullNoise => halves(before, &model.over(0.5 * dt_s)?),
        HalfInterval::ObservedVelocity => {
            let plain = before.predicted(&whole)?;
            let (from, velocity) = (before.mean().fixed_rows::<2>(0), before.mean().fixed_rows::<2>(2));
            let observed = (position_px - from) / dt_s;
            let there = from + (velocity + observed) * (0.5 * dt_s);
            Gaussian::computed(SVector::from([there[0], there[1], observed[0], observed[1]]), *plain.covariance())
        }
        HalfInterval::JumpAtMiddle { jump } => jumped(before, &whole, deviation(jump, before), dt_s, 0.25),
        // The mean of (1 − τ)² over a uniform instant τ is a third; of (1 − τ), a half, as in the middle.
        HalfInterval::JumpAnywhere { jump } => jumped(before, &whole, deviation(jump, before), dt_s, 1.0 / 3.0),
    }
}

fn halves(before: &Gaussian<4>, half: &Transition<4>) -> Result<Gaussian<4>> {
    before.predicted(half)?.predicted(half)
}

fn deviation(jump: Jump, before: &Gaussian<4>) -> f64 {
    jump.least_px_per_s.max(jump.speed_fraction * before.mean()[2].hypot(before.mean()[3]))
}

/// The plain prediction with the covariance of a velocity jump: `s² [[m dt², dt/2], [dt/2, 1]]` per axis, where `m` is
/// the mean square of the fraction of the interval that is left after the jump.
fn jumped(
    before: &Gaussian<4>,
    whole: &Transition<4>,
    deviation: f64,
    dt_s: f64,
    mean_square_left: f64,
) -> Result<Gaussian<4>> {
    let variance = deviation * deviation;
    let mut noise = sandwich(whole.matrix(), before.covariance()) + whole.noise();
    for axis in 0..2 {
        noise[(axis, axis)] += variance * mean_square_left * dt_s * dt_s;
        noise[(axis, axis + 2)] += variance * 0.5 * dt_s;
        noise[(axis + 2, axis)] += variance * 0.5 * dt_s;
        noise[(axis + 2, axis + 2)] += variance;
    }
    Gaussian::computed(*before.predicted(whole)?.mean(), noise)
}
