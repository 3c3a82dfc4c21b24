//! The division-free form: while a manoeuvre lasts, the velocity itself is regressed on time and put in place of the
//! filter's; no ratio, no effect while nothing happens.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::params::{AccelerationNoise, GatedParams, MOST};
use super::{motion, sensor, start};
use crate::motion::ConstantVelocity;
use crate::regression::{Kernel, LeastSquaresSvm};
use crate::{EstimationError, Gaussian, Innovation, MotionModel, Result};

/// One axis of the manoeuvre-gated filter.
///
/// Each prediction first asks whether the last `W` innovations were too large. If so, the velocity is replaced by the
/// regression of the last `N` measured velocities, extrapolated to now; the difference squared is added to the velocity's
/// variance and its correlation with the position is dropped.
///
/// That is done once after a measurement, in the first prediction that follows it: without new measurements the same
/// innovations would open the gate at every step of a gap, and the velocity would be extrapolated further each time.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "State", into = "State")]
pub struct GatedFilter {
    state: State,
    /// Scratch, not state.
    regression: LeastSquaresSvm<1>,
}

/// What the filter remembers, and what is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename = "GatedFilter")]
struct State {
    params: GatedParams,
    belief: Gaussian<2>,
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
    /// Where the position is expected now without the regression, and with it; where a guard compares them.
    rivals: Option<[f64; 2]>,
    /// Means of their squared errors.
    errors: [f64; 2],
}

impl PartialEq for GatedFilter {
    fn eq(&self, other: &Self) -> bool {
        self.state == other.state
    }
}

impl From<GatedFilter> for State {
    fn from(filter: GatedFilter) -> Self {
        filter.state
    }
}

impl TryFrom<State> for GatedFilter {
    type Error = EstimationError;

    fn try_from(state: State) -> Result<Self> {
        state.params.validate()?;
        for (what, got, expected) in [
            ("innovations kept", state.surprises.len(), state.params.window),
            ("velocities kept", state.velocities.len(), state.params.samples),
        ] {
            if got > expected {
                return Err(EstimationError::Length { what, got, expected });
            }
        }
        let (got, expected) = (state.times_s.len(), state.velocities.len());
        if got != expected {
            return Err(EstimationError::Length { what: "times of velocities", got, expected });
        }
        let (time_s, position) = state.last.unwrap_or_default();
        let numbers = state.surprises.iter().chain(&state.times_s).chain(&state.velocities).chain(&state.errors);
        let rivals = state.rivals.iter().flatten();
        if !numbers.chain(rivals).chain(&[time_s, position, state.now_s]).all(|value| value.is_finite()) {
            return Err(EstimationError::NotFinite { what: "the history of the filter" });
        }
        Ok(Self { regression: LeastSquaresSvm::new(state.params.kernel, state.params.gamma)?, state })
    }
}

impl GatedFilter {
    /// A filter at the measured `position`, moving at `velocity` (units/s), with `P₀ = I`.
    ///
    /// # Errors
    /// Where a parameter is out of range or a number is not finite.
    pub fn new(params: GatedParams, position: f64, velocity: f64) -> Result<Self> {
        Self::from_belief(params, start(position, velocity)?)
    }

    /// A filter that starts from a belief about `[position, velocity]`.
    ///
    /// # Errors
    /// Where a parameter is out of range.
    pub fn from_belief(params: GatedParams, belief: Gaussian<2>) -> Result<Self> {
        params.validate()?;
        sensor(params.measurement_variance)?;
        driven(&params).over(1.0)?;
        Ok(Self {
            regression: LeastSquaresSvm::new(params.kernel, params.gamma)?,
            state: State {
                params,
                belief,
                surprises: Vec::with_capacity(params.window),
                times_s: Vec::with_capacity(params.samples),
                velocities: Vec::with_capacity(params.samples),
                last: None,
                now_s: 0.0,
                open: 0,
                opened: false,
                fresh: false,
                rivals: None,
                errors: [0.0; 2],
            },
        })
    }

    /// The belief now, `[position, velocity]`.
    pub const fn belief(&self) -> &Gaussian<2> {
        &self.state.belief
    }

    /// Whether the last prediction replaced the velocity.
    pub const fn manoeuvring(&self) -> bool {
        self.state.opened
    }

    /// Moves the belief by `dt_s` seconds.
    ///
    /// # Errors
    /// Where `dt_s` is not positive and finite or the result overflows; the filter is then as it was.
    pub fn predict(&mut self, dt_s: f64) -> Result<()> {
        let (open, opened) = self.state.gate();
        let belief = self.state.predicted(opened, &mut self.regression, dt_s)?;
        let rivals = self.state.rivals(&mut self.regression, dt_s)?;
        let state = &mut self.state;
        state.rivals = rivals;
        if state.fresh {
            state.open = open.saturating_sub(1);
        }
        (state.belief, state.opened, state.fresh) = (belief, opened, false);
        state.now_s += dt_s;
        Ok(())
    }

    /// The belief after `dt_s` seconds, as [`predict`](Self::predict) would leave it, leaving this one alone.
    ///
    /// # Errors
    /// As [`predict`](Self::predict).
    pub fn forecast(&self, dt_s: f64) -> Result<Gaussian<2>> {
        let (_, opened) = self.state.gate();
        if opened && self.state.params.kernel != Kernel::Linear {
            return self.state.predicted(true, &mut self.regression.clone(), dt_s);
        }
        // A straight line is regressed in place.
        let mut unused = LeastSquaresSvm::new(self.state.params.kernel, self.state.params.gamma)?;
        self.state.predicted(opened, &mut unused, dt_s)
    }

    /// Corrects the belief by a measured `position`. A missing measurement is no call.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the filter is then as it was.
    pub fn update(&mut self, position: f64) -> Result<Innovation<1>> {
        self.update_with_noise(position, self.state.params.measurement_variance)
    }

    /// [`update`](Self::update) by a position of this `variance`, units², in place of the parameters'.
    ///
    /// # Errors
    /// Where `variance` is negative, and as [`Gaussian::update`]; the filter is then as it was.
    pub fn update_with_noise(&mut self, position: f64, variance: f64) -> Result<Innovation<1>> {
        let state = &mut self.state;
        let innovation = state.belief.update(&sensor(variance)?, &SVector::<f64, 1>::new(position))?;
        push(&mut state.surprises, innovation.nis(), state.params.window);
        if let Some(rivals) = state.rivals.take() {
            for (error, expected) in state.errors.iter_mut().zip(rivals) {
                *error += state.params.guard * ((position - expected).powi(2) - *error);
            }
        }
        // The start is not among the differences: its position may come from elsewhere.
        if let Some((time_s, before)) = state.last
            && state.now_s > time_s
        {
            push(&mut state.velocities, (position - before) / (state.now_s - time_s), state.params.samples);
            push(&mut state.times_s, state.now_s, state.params.samples);
        }
        state.last = Some((state.now_s, position));
        state.fresh = true;
        Ok(innovation)
    }
}

impl State {
    /// For how many steps the gate is open, and whether the next prediction goes through it.
    fn gate(&self) -> (usize, bool) {
        let params = &self.params;
        let surprised = self.surprises.len() == params.window
            && self.surprises.iter().sum::<f64>() > params.threshold * params.window as f64;
        let open = if surprised { params.hold } else { self.open };
        let [without, with] = self.errors;
        let trusted = params.guard == 0.0 || with < without;
        (open, self.fresh && open > 0 && self.velocities.len() == params.samples && trusted)
    }

    /// Where the position is expected after `dt_s` seconds without the regression, and with it, of filters that are guarded.
    fn rivals(&self, regression: &mut LeastSquaresSvm<1>, dt_s: f64) -> Result<Option<[f64; 2]>> {
        if self.params.guard == 0.0 || !self.fresh || self.velocities.len() < self.params.samples {
            return Ok(None);
        }
        let (at, velocity) = (self.belief.mean()[0], self.belief.mean()[1]);
        let regressed = self.regressed_velocity(regression, dt_s)?;
        Ok(Some([at + velocity * dt_s, at + regressed * dt_s]).filter(|r| r.iter().all(|v| v.is_finite())))
    }

    /// The belief after `dt_s` seconds; with `opened`, of the regressed velocity.
    fn predicted(&self, opened: bool, regression: &mut LeastSquaresSvm<1>, dt_s: f64) -> Result<Gaussian<2>> {
        let transition = driven(&self.params).over(dt_s)?;
        if !opened {
            return self.belief.predicted(&transition);
        }
        let velocity = self.regressed_velocity(regression, dt_s)?;
        let (mean, covariance) = (self.belief.mean(), self.belief.covariance());
        let variance = covariance[(1, 1)] + (velocity - mean[1]).powi(2);
        let replaced = Gaussian::computed(
            SVector::from([mean[0], velocity]),
            SMatrix::<f64, 2, 2>::new(covariance[(0, 0)], 0.0, 0.0, variance),
        )?;
        replaced.predicted(&transition)
    }

    /// The regression of the velocities at the end of the coming step.
    fn regressed_velocity(&self, regression: &mut LeastSquaresSvm<1>, dt_s: f64) -> Result<f64> {
        let ahead_s = self.now_s + dt_s;
        let mut times = [[0.0]; MOST];
        for (slot, time_s) in times.iter_mut().zip(&self.times_s) {
            // In steps, so that γ means the same at every frame rate.
            *slot = [(time_s - ahead_s) / dt_s];
        }
        let times = &times[..self.times_s.len().min(MOST)];
        if self.params.kernel == Kernel::Linear {
            return Ok(line_at_zero(times, &self.velocities, self.params.gamma));
        }
        regression.fit(times, &self.velocities)?;
        Ok(regression.predict(&[0.0]))
    }
}

/// The motion between measurements.
const fn driven(params: &GatedParams) -> ConstantVelocity<1> {
    match params.noise {
        AccelerationNoise::Held => motion(params.acceleration_variance),
        AccelerationNoise::White => ConstantVelocity::white(params.acceleration_variance),
    }
}

/// What least squares with the linear kernel answers at zero: a ridge regression with a free intercept, whose slope is
/// `Σ (x − x̄)(y − ȳ) / (Σ (x − x̄)² + 1/γ)`.
fn line_at_zero(inputs: &[[f64; 1]], targets: &[f64], gamma: f64) -> f64 {
    let n = inputs.len() as f64;
    let x_mean = inputs.iter().map(|[x]| x).sum::<f64>() / n;
    let y_mean = targets.iter().sum::<f64>() / n;
    let (mut products, mut squares) = (0.0, 1.0 / gamma);
    for ([x], y) in inputs.iter().zip(targets) {
        products += (x - x_mean) * (y - y_mean);
        squares += (x - x_mean) * (x - x_mean);
    }
    y_mean - x_mean * products / squares
}

/// Appends, dropping the oldest beyond `most`.
fn push(values: &mut Vec<f64>, value: f64, most: usize) {
    if values.len() == most {
        values.remove(0);
    }
    values.push(value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_the_regression_with_the_linear_kernel() {
        let inputs = [[-5.5], [-4.0], [-3.2], [-2.0], [-1.0]];
        let targets = [2.0, -1.0, 0.5, 3.0, 7.5];
        for gamma in [1e-3, 1.0, 40.0, 1e6] {
            let mut regression = LeastSquaresSvm::<1>::new(Kernel::Linear, gamma).unwrap();
            regression.fit(&inputs, &targets).unwrap();
            let expected = regression.predict(&[0.0]);
            let found = line_at_zero(&inputs, &targets, gamma);
            assert!((found - expected).abs() < 1e-8 * expected.abs().max(1.0), "{gamma}: {found}, {expected}");
        }
    }

    #[test]
    fn a_forecast_is_the_prediction_and_changes_nothing() {
        let forms = [(0.0, AccelerationNoise::Held), (0.2, AccelerationNoise::White)];
        let kernels = [Kernel::Linear, Kernel::Rbf { sigma2: 30.0 }];
        for (kernel, (guard, noise)) in kernels.into_iter().flat_map(|kernel| forms.map(|form| (kernel, form))) {
            let params = GatedParams { kernel, guard, noise, ..GatedParams::recommended(1e-4, 1.0) };
            let mut filter = GatedFilter::new(params, 0.0, 2.0).unwrap();
            let mut opened = 0;
            for k in 1..40_i32 {
                let before = filter.clone();
                let forecast = filter.forecast(0.7).unwrap();
                assert_eq!(filter, before);
                filter.predict(0.7).unwrap();
                assert_eq!(*filter.belief(), forecast);
                opened += i32::from(filter.manoeuvring());
                if k % 7 != 0 {
                    filter.update(f64::from(20 - (k - 20).abs()) * 1.4).unwrap();
                }
            }
            assert!(opened > 0);
        }
    }

    /// Root mean square error of the predictions after the eighth of `measured`, which come a second apart.
    fn error_of(params: GatedParams, measured: &[f64]) -> f64 {
        let mut filter = GatedFilter::new(params, measured[0], 0.0).unwrap();
        let mut squares = Vec::new();
        for (k, &z) in measured.iter().enumerate().skip(1) {
            filter.predict(1.0).unwrap();
            if k > 8 {
                squares.push((filter.belief().mean()[0] - z).powi(2));
            }
            filter.update(z).unwrap();
        }
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn white_noise_does_not_swing_where_measurements_are_believed() {
        // A walk with a pixel of jitter, which a filter that believes measurements to a hundredth takes for motion.
        let jitter = |k: i32| f64::from((k * 7919 + 13) % 101 - 50) / 50.0;
        let measured: Vec<f64> = (0..200).map(|k| 1.5 * f64::from(k) + jitter(k * k)).collect();
        let held = GatedParams { threshold: 1e9, ..GatedParams::recommended(4.0, 1e-4) };
        let white = GatedParams { noise: AccelerationNoise::White, ..held };
        let (held, white) = (error_of(held, &measured), error_of(white, &measured));
        assert!(white < 0.8 * held, "{white} of {held}");
    }

    #[test]
    fn a_guarded_gate_opens_only_where_the_regression_was_better() {
        let unguarded = GatedParams { threshold: 1e-9, ..GatedParams::recommended(1e-4, 1.0) };
        let guarded = GatedParams { guard: 0.2, ..unguarded };
        // A wild zigzag: regressed velocities are of no use, a filter that hardly moves is.
        let zigzag: Vec<f64> = (0..120).map(|k| if k % 4 < 2 { 3.0 } else { -3.0 }).collect();
        assert!(error_of(guarded, &zigzag) < 0.8 * error_of(unguarded, &zigzag));
        // A turn: the filter goes straight on for long, the regression does not.
        let turn: Vec<f64> = (0..120).map(|k| 2.0 * f64::from(60 - (k - 60_i32).abs())).collect();
        let never = GatedParams { threshold: 1e9, ..unguarded };
        assert!(error_of(guarded, &turn) < 0.8 * error_of(never, &turn));
    }

    #[test]
    fn a_guard_out_of_range_or_a_state_that_cannot_be_is_refused() {
        for guard in [-0.1, 1.1, f64::NAN] {
            assert!(GatedFilter::new(GatedParams { guard, ..GatedParams::recommended(1e-4, 1.0) }, 0.0, 0.0).is_err());
        }
        let params = GatedParams { guard: 0.2, ..GatedParams::recommended(1e-4, 1.0) };
        let mut filter = GatedFilter::new(params, 0.0, 1.0).unwrap();
        for k in 1..12 {
            filter.predict(1.0).unwrap();
            filter.update(f64::from(k)).unwrap();
        }
        filter.predict(1.0).unwrap();
        assert!(filter.state.rivals.is_some());
        let back = |state: State| postcard::from_bytes::<GatedFilter>(&postcard::to_stdvec(&state).unwrap());
        assert_eq!(back(filter.state.clone()).unwrap(), filter);
        assert!(back(State { errors: [f64::NAN, 0.0], ..filter.state.clone() }).is_err());
        assert!(back(State { rivals: Some([0.0, f64::INFINITY]), ..filter.state.clone() }).is_err());
    }
}
