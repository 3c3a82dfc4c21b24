//! Input estimation (Chan, Hu, Plant, IEEE Trans. AES 1979): a manoeuvre is a constant unknown input, estimated from the
//! innovations of the filter that does not know of it, and put right once it is significant. When it set in is estimated
//! too (Bogler, IEEE Trans. AES 1987): with the window's start for an onset a sudden turn is seen ten steps late.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::matrix::{cholesky, divide_by_factored, require_finite, sandwich, symmetrise};
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result, Transition};

/// One remembered step: how the input's effect carries over, and what was not expected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Step<const M: usize, const N: usize, const U: usize> {
    transition: SMatrix<f64, N, N>,
    input: SMatrix<f64, N, U>,
    keep: SMatrix<f64, N, N>,
    matrix: SMatrix<f64, M, N>,
    innovation: Innovation<M>,
}

/// A Kalman filter of `N` states and `M` measured values that watches for an input of `U` components that set in within
/// the last `W` steps, and at least three steps ago.
///
/// After a correction the window starts over: what it explained must not be explained again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw<M, N, U>", into = "Raw<M, N, U>")]
pub struct InputEstimator<const M: usize, const N: usize, const U: usize, const W: usize> {
    belief: Gaussian<N>,
    threshold: f64,
    steps: [Option<Step<M, N, U>>; W],
    filled: usize,
    /// `F` and `G` of the prediction since the last measurement.
    pending: Option<(SMatrix<f64, N, N>, SMatrix<f64, N, U>)>,
}

/// What is stored: read back through the same checks as any outside input.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename = "InputEstimator")]
struct Raw<const M: usize, const N: usize, const U: usize> {
    belief: Gaussian<N>,
    threshold: f64,
    steps: Vec<Step<M, N, U>>,
    pending: Option<(SMatrix<f64, N, N>, SMatrix<f64, N, U>)>,
}

impl<const M: usize, const N: usize, const U: usize, const W: usize> From<InputEstimator<M, N, U, W>> for Raw<M, N, U> {
    fn from(it: InputEstimator<M, N, U, W>) -> Self {
        let steps = it.steps.into_iter().take(it.filled).flatten().collect();
        Self { belief: it.belief, threshold: it.threshold, steps, pending: it.pending }
    }
}

impl<const M: usize, const N: usize, const U: usize, const W: usize> TryFrom<Raw<M, N, U>>
    for InputEstimator<M, N, U, W>
{
    type Error = EstimationError;

    fn try_from(raw: Raw<M, N, U>) -> Result<Self> {
        let mut it = Self::new(raw.belief, raw.threshold)?;
        if raw.steps.len() > W {
            return Err(EstimationError::Length { what: "steps of the window", got: raw.steps.len(), expected: W });
        }
        for (slot, step) in it.steps.iter_mut().zip(&raw.steps) {
            require_finite("the transition of a step", &step.transition)?;
            require_finite("the input of a step", &step.input)?;
            require_finite("the gain of a step", &step.keep)?;
            require_finite("the sensor of a step", &step.matrix)?;
            *slot = Some(*step);
        }
        if let Some((transition, input)) = &raw.pending {
            require_finite("the pending transition", transition)?;
            require_finite("the pending input", input)?;
        }
        it.filled = raw.steps.len();
        it.pending = raw.pending;
        Ok(it)
    }
}

impl<const M: usize, const N: usize, const U: usize, const W: usize> InputEstimator<M, N, U, W> {
    /// A filter from `belief` that corrects once the χ² of the most significant input exceeds `threshold` (`U` degrees of
    /// freedom; 9 is three sigma for one, of each onset looked at).
    ///
    /// # Errors
    /// Where `threshold` is not positive or the window `W` is shorter than three steps.
    pub fn new(belief: Gaussian<N>, threshold: f64) -> Result<Self> {
        require("threshold", threshold, threshold > 0.0, "positive")?;
        require("the window", W as f64, W >= LEAST, "three steps or more")?;
        Ok(Self { belief, threshold, steps: [None; W], filled: 0, pending: None })
    }

    /// The belief now.
    pub const fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    /// One step: [`predict`](Self::predict) by `transition` and `input`, then [`update`](Self::update) by `value`.
    ///
    /// A missing measurement is [`coast`](Self::coast).
    ///
    /// # Errors
    /// As [`Gaussian::predict`] and [`Gaussian::update`]; the filter is then as it was.
    pub fn step(
        &mut self,
        transition: &Transition<N>,
        input: &SMatrix<f64, N, U>,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<(Innovation<M>, Option<SVector<f64, U>>)> {
        require_finite("the input's effect", input)?;
        let mut prior = self.belief;
        prior.predict(transition)?;
        // As in `predict`: two predictions without an update between are a gap.
        let kept = if self.pending.is_some() { 0 } else { self.filled };
        self.correct(prior, kept, (*transition.matrix(), *input), measurement, value)
    }

    /// Moves the belief through time. An input acts on the step through `input` `G` (`[dt²/2, dt]` for the acceleration of a
    /// constant-velocity model).
    ///
    /// A second prediction without an update between is a gap, and the window starts over as in [`coast`](Self::coast).
    ///
    /// # Errors
    /// Where `input` is not finite, and as [`Gaussian::predict`]; the filter is then as it was.
    pub fn predict(&mut self, transition: &Transition<N>, input: &SMatrix<f64, N, U>) -> Result<()> {
        require_finite("the input's effect", input)?;
        self.belief.predict(transition)?;
        if self.pending.is_some() {
            self.forget();
        }
        self.pending = Some((*transition.matrix(), *input));
        Ok(())
    }

    /// Corrects the belief by `value`, then looks for an input that has been acting since some step of the window. Returns
    /// the innovation, and the input put right in this step, if any.
    ///
    /// # Errors
    /// As [`Gaussian::update`]; the filter is then as it was.
    pub fn update(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<(Innovation<M>, Option<SVector<f64, U>>)> {
        // A second reading at the same time sees no more of the input than the first.
        let moved = self.pending.unwrap_or((SMatrix::identity(), SMatrix::zeros()));
        self.correct(self.belief, self.filled, moved, measurement, value)
    }

    /// Corrects `prior`, to which `moved` (`F` and `G`) has led, and tests the first `kept` steps of the window and this one.
    /// Nothing changes before everything that can fail has succeeded.
    fn correct(
        &mut self,
        prior: Gaussian<N>,
        kept: usize,
        (transition, input): (SMatrix<f64, N, N>, SMatrix<f64, N, U>),
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<(Innovation<M>, Option<SVector<f64, U>>)> {
        let gain = prior.gain(measurement)?;
        let mut belief = prior;
        let innovation = belief.update(measurement, value)?;
        let newest = Step {
            transition,
            input,
            keep: SMatrix::identity() - gain * measurement.matrix(),
            matrix: *measurement.matrix(),
            innovation,
        };
        let full = kept == W;
        let found = estimate(&self.steps[usize::from(full)..kept], &newest, self.threshold);
        if let Some(Found { size, spread, effect }) = &found {
            // The state gains the input's effect, and the doubt about its size: without that the correction would be final.
            belief = Gaussian::computed(belief.mean() + effect * size, belief.covariance() + sandwich(effect, spread))?;
        }
        self.belief = belief;
        self.pending = None;
        if found.is_some() || kept == 0 {
            self.forget();
        }
        if found.is_none() {
            if full {
                self.steps.rotate_left(1);
            }
            self.filled = kept + usize::from(!full);
            self.steps[self.filled - 1] = Some(newest);
        }
        Ok((innovation, found.map(|found| found.size)))
    }

    /// A step without a measurement. The window starts over: innovations on both sides of a gap are not comparable.
    ///
    /// # Errors
    /// As [`Gaussian::predict`]; the filter is then as it was.
    pub fn coast(&mut self, transition: &Transition<N>) -> Result<()> {
        self.belief.predict(transition)?;
        self.pending = None;
        self.forget();
        Ok(())
    }

    /// Empties the window.
    fn forget(&mut self) {
        (self.steps, self.filled) = ([None; W], 0);
    }
}

/// The input that explains the innovations best, where it is significant: its size, covariance, and effect on the state.
struct Found<const N: usize, const U: usize> {
    size: SVector<f64, U>,
    spread: SMatrix<f64, U, U>,
    effect: SMatrix<f64, N, U>,
}

/// Innovations that must have seen an input. What explains one or two of them is mostly noise, and a velocity put right by
/// it predicts the next position worse than no correction does.
const LEAST: usize = 3;

/// The most significant of the inputs that may have set in at any of the steps, the earlier ones or the newest, if it
/// exceeds the threshold.
fn estimate<const M: usize, const N: usize, const U: usize>(
    earlier: &[Option<Step<M, N, U>>],
    newest: &Step<M, N, U>,
    threshold: f64,
) -> Option<Found<N, U>> {
    let mut best = None;
    let mut highest = threshold;
    let onsets = (earlier.len() + 2).saturating_sub(LEAST);
    for onset in 0..onsets {
        if let Some((significance, found)) = since(&earlier[onset..], newest)
            && significance > highest
        {
            (highest, best) = (significance, Some(found));
        }
    }
    best
}

/// The input that set in at the first of the steps, and its own χ².
fn since<const M: usize, const N: usize, const U: usize>(
    earlier: &[Option<Step<M, N, U>>],
    newest: &Step<M, N, U>,
) -> Option<(f64, Found<N, U>)> {
    // A unit input since the onset shifts the prior by B_k (B ← F (I − K H) B + G) and the innovation by H B_k.
    let mut effect = SMatrix::<f64, N, U>::zeros();
    let mut information = SMatrix::<f64, U, U>::zeros();
    let mut evidence = SVector::<f64, U>::zeros();
    for step in earlier.iter().flatten().chain(std::iter::once(newest)) {
        let prior_effect = step.transition * effect + step.input;
        let seen = step.matrix * prior_effect;
        let weighted = step.innovation.divide(&seen.transpose());
        information += weighted * seen;
        evidence += weighted * step.innovation.residual();
        effect = step.keep * prior_effect;
    }
    symmetrise(&mut information);
    let lower = cholesky(&information).ok()?;
    let spread = divide_by_factored(&SMatrix::<f64, U, U>::identity(), &lower);
    let size = spread * evidence;
    Some((size.dot(&evidence), Found { size, spread, effect }))
}
