//! The filter as printed: `x⁻ = x + a T v`, `v⁻ = a v`, with `a(k)` predicted by regression from the last `N` ratios
//! `v(j) / v(j − 1)`.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::params::{LiteralParams, VelocityReading};
use super::{motion, sensor, start};
use crate::error::require_time_step;
use crate::regression::LeastSquaresSvm;
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, MotionModel, Result, Transition};

/// One axis of the printed filter, equations (9) and (12) to (14).
///
/// Steps should be of one length: a ratio of velocities has no meaning otherwise. A step without a measurement keeps the
/// history as it is.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct LiteralFilter {
    params: LiteralParams,
    measurement: LinearMeasurement<1, 2>,
    belief: Gaussian<2>,
    regression: LeastSquaresSvm<1>,
    ratios: Vec<f64>,
    times: Vec<[f64; 1]>,
    /// The last measured and filtered position and the last velocity, where there are such.
    last_measured: f64,
    last_filtered: f64,
    last_velocity: Option<f64>,
    ratio: f64,
    dt_s: Option<f64>,
}

/// What is stored: read back through the same checks as any outside input.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "LiteralFilter")]
struct Raw {
    params: LiteralParams,
    belief: Gaussian<2>,
    ratios: Vec<f64>,
    last_measured: f64,
    last_filtered: f64,
    last_velocity: Option<f64>,
    ratio: f64,
    dt_s: Option<f64>,
}

impl From<LiteralFilter> for Raw {
    fn from(it: LiteralFilter) -> Self {
        Self {
            params: it.params,
            belief: it.belief,
            ratios: it.ratios,
            last_measured: it.last_measured,
            last_filtered: it.last_filtered,
            last_velocity: it.last_velocity,
            ratio: it.ratio,
            dt_s: it.dt_s,
        }
    }
}

impl TryFrom<Raw> for LiteralFilter {
    type Error = EstimationError;

    fn try_from(raw: Raw) -> Result<Self> {
        let fresh = Self::new(raw.params, raw.last_measured, 0.0)?;
        if raw.ratios.len() > raw.params.samples {
            let (got, expected) = (raw.ratios.len(), raw.params.samples);
            return Err(EstimationError::Length { what: "ratios kept", got, expected });
        }
        let numbers = [raw.last_filtered, raw.ratio, raw.last_velocity.unwrap_or(0.0)];
        if !raw.ratios.iter().chain(&numbers).all(|value| value.is_finite()) {
            return Err(EstimationError::NotFinite { what: "the history of velocities" });
        }
        raw.dt_s.map_or(Ok(()), require_time_step)?;
        let mut ratios = fresh.ratios;
        ratios.extend(raw.ratios);
        Ok(Self {
            belief: raw.belief,
            ratios,
            last_filtered: raw.last_filtered,
            last_velocity: raw.last_velocity,
            ratio: raw.ratio,
            dt_s: raw.dt_s,
            ..fresh
        })
    }
}

impl LiteralFilter {
    /// A filter at the measured `position`, moving at `velocity` (units/s), with `P₀ = I`.
    ///
    /// # Errors
    /// Where a parameter is out of range or a number is not finite.
    pub fn new(params: LiteralParams, position: f64, velocity: f64) -> Result<Self> {
        params.validate()?;
        let samples = params.samples;
        Ok(Self {
            params,
            measurement: sensor(params.measurement_variance)?,
            belief: start(position, velocity)?,
            regression: LeastSquaresSvm::new(params.kernel, params.gamma)?,
            ratios: Vec::with_capacity(samples + 1),
            times: (0..samples).map(|i| [i as f64 - samples as f64]).collect(),
            last_measured: position,
            last_filtered: position,
            // Only a velocity of the state exists before the first difference.
            last_velocity: matches!(params.velocity, VelocityReading::Posterior).then_some(velocity),
            ratio: 1.0,
            dt_s: None,
        })
    }

    /// The belief now, `[position, velocity]`.
    pub const fn belief(&self) -> &Gaussian<2> {
        &self.belief
    }

    /// `a`, the ratio used in the last prediction; 1 until there are `N` samples.
    pub const fn ratio(&self) -> f64 {
        self.ratio
    }

    /// The most recent sample `v(j) / v(j − 1)`, guarded.
    pub fn last_sample(&self) -> Option<f64> {
        self.ratios.last().copied()
    }

    /// Moves the belief by `dt_s` seconds with the transition `[[1, a T], [0, a]]`.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite or the result overflows; the filter is then as it was.
    pub fn predict(&mut self, dt_s: f64) -> Result<()> {
        let noise = *motion(self.params.acceleration_variance).over(dt_s)?.noise();
        let ratio = if self.ratios.len() == self.params.samples {
            self.regression.fit(&self.times, &self.ratios)?;
            self.params.guard.apply(self.regression.predict(&[0.0]))
        } else {
            1.0
        };
        let matrix = SMatrix::<f64, 2, 2>::new(1.0, ratio * dt_s, 0.0, ratio);
        self.belief.predict(&Transition::new(matrix, noise)?)?;
        self.ratio = ratio;
        self.dt_s = Some(self.dt_s.unwrap_or(0.0) + dt_s);
        Ok(())
    }

    /// Corrects the belief by a measured `position`, and learns the next ratio.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the filter is then as it was.
    pub fn update(&mut self, position: f64) -> Result<Innovation<1>> {
        let innovation = self.belief.update(&self.measurement, &SVector::<f64, 1>::new(position))?;
        let filtered = self.belief.mean()[0];
        // Without a prediction in between there is no time for a velocity.
        if let Some(dt_s) = self.dt_s.take() {
            let velocity = match self.params.velocity {
                VelocityReading::Posterior => self.belief.mean()[1],
                VelocityReading::MeasuredDifference => (position - self.last_measured) / dt_s,
                VelocityReading::FilteredDifference => (filtered - self.last_filtered) / dt_s,
            };
            if let Some(before) = self.last_velocity {
                if self.ratios.len() == self.params.samples {
                    self.ratios.remove(0);
                }
                self.ratios.push(self.params.guard.apply(velocity / before));
            }
            self.last_velocity = Some(velocity);
        }
        (self.last_measured, self.last_filtered) = (position, filtered);
        Ok(innovation)
    }
}
