//! The division-free form: while a manoeuvre lasts, the velocity itself is regressed on time and put in place of the
//! filter's; no ratio, no effect while nothing happens.

use nalgebra::{SMatrix, SVector};

use super::params::{GatedParams, MOST};
use super::{motion, sensor, start};
use crate::regression::LeastSquaresSvm;
use crate::{Gaussian, Innovation, LinearMeasurement, MotionModel, Result};

/// One axis of the manoeuvre-gated filter.
///
/// Each prediction first asks whether the last `W` innovations were too large. If so, the velocity is replaced by the
/// regression of the last `N` measured velocities, extrapolated to now; the difference squared is added to the velocity's
/// variance and its correlation with the position is dropped.
///
/// That is done once after a measurement, in the first prediction that follows it: without new measurements the same
/// innovations would open the gate at every step of a gap, and the velocity would be extrapolated further each time.
#[derive(Debug, Clone)]
pub struct GatedFilter {
    params: GatedParams,
    motion: crate::motion::ConstantVelocity<1>,
    measurement: LinearMeasurement<1, 2>,
    belief: Gaussian<2>,
    regression: LeastSquaresSvm<1>,
    /// Normalised innovations squared, the latest `window`.
    surprises: Vec<f64>,
    /// Times and values of measured velocities, the latest `samples`.
    times_s: Vec<f64>,
    velocities: Vec<f64>,
    /// Time and value of the last measurement.
    last: Option<(f64, f64)>,
    now_s: f64,
    open: usize,
    opened: bool,
    /// Whether a measurement came since the last prediction.
    fresh: bool,
}

impl GatedFilter {
    /// A filter at the measured `position`, moving at `velocity` (units/s), with `P₀ = I`.
    ///
    /// # Errors
    /// Where a parameter is out of range or a number is not finite.
    pub fn new(params: GatedParams, position: f64, velocity: f64) -> Result<Self> {
        params.validate()?;
        Ok(Self {
            params,
            motion: motion(params.acceleration_variance),
            measurement: sensor(params.measurement_variance)?,
            belief: start(position, velocity)?,
            regression: LeastSquaresSvm::new(params.kernel, params.gamma)?,
            surprises: Vec::with_capacity(params.window),
            times_s: Vec::with_capacity(params.samples),
            velocities: Vec::with_capacity(params.samples),
            last: None,
            now_s: 0.0,
            open: 0,
            opened: false,
            fresh: false,
        })
    }

    /// The belief now, `[position, velocity]`.
    pub const fn belief(&self) -> &Gaussian<2> {
        &self.belief
    }

    /// Whether the last prediction replaced the velocity.
    pub const fn manoeuvring(&self) -> bool {
        self.opened
    }

    /// Moves the belief by `dt_s` seconds.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite or the result overflows; the filter is then as it was.
    pub fn predict(&mut self, dt_s: f64) -> Result<()> {
        let transition = self.motion.over(dt_s)?;
        let surprised = self.surprises.len() == self.params.window
            && self.surprises.iter().sum::<f64>() > self.params.threshold * self.params.window as f64;
        let open = if surprised { self.params.hold } else { self.open };
        let ready = self.velocities.len() == self.params.samples;
        let opened = self.fresh && open > 0 && ready;
        let mut belief = self.belief;
        if opened {
            belief = self.with_regressed_velocity(dt_s)?;
        }
        belief.predict(&transition)?;
        self.belief = belief;
        self.opened = opened;
        if self.fresh {
            self.open = open.saturating_sub(1);
        }
        self.fresh = false;
        self.now_s += dt_s;
        Ok(())
    }

    /// The belief with its velocity replaced by the regression at the end of the coming step.
    fn with_regressed_velocity(&mut self, dt_s: f64) -> Result<Gaussian<2>> {
        let ahead_s = self.now_s + dt_s;
        let mut times = [[0.0]; MOST];
        for (slot, time_s) in times.iter_mut().zip(&self.times_s) {
            // In steps, so that γ means the same at every frame rate.
            *slot = [(time_s - ahead_s) / dt_s];
        }
        let used = self.times_s.len().min(MOST);
        self.regression.fit(&times[..used], &self.velocities)?;
        let velocity = self.regression.predict(&[0.0]);
        let (mean, covariance) = (self.belief.mean(), self.belief.covariance());
        let variance = covariance[(1, 1)] + (velocity - mean[1]).powi(2);
        Gaussian::computed(
            SVector::from([mean[0], velocity]),
            SMatrix::<f64, 2, 2>::new(covariance[(0, 0)], 0.0, 0.0, variance),
        )
    }

    /// Corrects the belief by a measured `position`. A missing measurement is no call.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the filter is then as it was.
    pub fn update(&mut self, position: f64) -> Result<Innovation<1>> {
        let innovation = self.belief.update(&self.measurement, &SVector::<f64, 1>::new(position))?;
        push(&mut self.surprises, innovation.nis(), self.params.window);
        // The start is not among the differences: its position may come from elsewhere.
        if let Some((time_s, before)) = self.last
            && self.now_s > time_s
        {
            push(&mut self.velocities, (position - before) / (self.now_s - time_s), self.params.samples);
            push(&mut self.times_s, self.now_s, self.params.samples);
        }
        self.last = Some((self.now_s, position));
        self.fresh = true;
        Ok(innovation)
    }
}

/// Appends, dropping the oldest beyond `most`.
fn push(values: &mut Vec<f64>, value: f64, most: usize) {
    if values.len() == most {
        values.remove(0);
    }
    values.push(value);
}
