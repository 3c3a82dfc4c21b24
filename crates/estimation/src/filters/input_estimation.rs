//! Input estimation (Chan, Hu, Plant, IEEE Trans. AES 1979): a manoeuvre is a constant unknown input, estimated from the
//! innovations of the filter that does not know of it, and put right once it is significant. When it set in is estimated
//! too (Bogler, IEEE Trans. AES 1987): with the window's start for an onset a sudden turn is seen ten steps late.

use nalgebra::{SMatrix, SVector};

use crate::error::require;
use crate::matrix::{cholesky, divide_by_factored, sandwich, symmetrise};
use crate::{Gaussian, Innovation, LinearMeasurement, Result, Transition};

/// One remembered step: how the input's effect carries over, and what was not expected.
#[derive(Debug, Clone, Copy)]
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
#[derive(Debug, Clone)]
pub struct InputEstimator<const M: usize, const N: usize, const U: usize, const W: usize> {
    belief: Gaussian<N>,
    threshold: f64,
    steps: [Option<Step<M, N, U>>; W],
    filled: usize,
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
        Ok(Self { belief, threshold, steps: [None; W], filled: 0 })
    }

    /// The belief now.
    pub const fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    /// One step: predict by `transition`, correct by `value`, then look for an input that has been acting through `input`
    /// `G` since some step of the window (`[dt²/2, dt]` for the acceleration of a constant-velocity model). Returns the innovation, and the input put right
    /// in this step, if any.
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
        let mut belief = self.belief.predicted(transition)?;
        let gain = belief.gain(measurement)?;
        let innovation = belief.update(measurement, value)?;
        let record = Step {
            transition: *transition.matrix(),
            input: *input,
            keep: SMatrix::identity() - gain * measurement.matrix(),
            matrix: *measurement.matrix(),
            innovation,
        };
        let mut steps = self.steps;
        let mut filled = self.filled;
        if filled == W {
            steps.rotate_left(1);
            filled -= 1;
        }
        steps[filled] = Some(record);
        filled += 1;
        let found = estimate(&steps[..filled], self.threshold);
        if let Some(Found { size, spread, effect }) = &found {
            // The state gains the input's effect, and the doubt about its size: without that the correction would be final.
            belief = Gaussian::computed(belief.mean() + effect * size, belief.covariance() + sandwich(effect, spread))?;
            filled = 0;
        }
        *self = Self { belief, threshold: self.threshold, steps, filled };
        Ok((innovation, found.map(|found| found.size)))
    }

    /// A step without a measurement. The window starts over: innovations on both sides of a gap are not comparable.
    ///
    /// # Errors
    /// As [`Gaussian::predict`]; the filter is then as it was.
    pub fn coast(&mut self, transition: &Transition<N>) -> Result<()> {
        self.belief.predict(transition)?;
        self.filled = 0;
        Ok(())
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

/// The most significant of the inputs that may have set in at any of the steps, if it exceeds the threshold.
fn estimate<const M: usize, const N: usize, const U: usize>(
    steps: &[Option<Step<M, N, U>>],
    threshold: f64,
) -> Option<Found<N, U>> {
    let mut best = None;
    let mut highest = threshold;
    let seen = steps.len() + 1;
    for onset in 0..seen.saturating_sub(LEAST) {
        if let Some((significance, found)) = since(&steps[onset..])
            && significance > highest
        {
            (highest, best) = (significance, Some(found));
        }
    }
    best
}

/// The input that set in at the first of the steps, and its own χ².
fn since<const M: usize, const N: usize, const U: usize>(
    steps: &[Option<Step<M, N, U>>],
) -> Option<(f64, Found<N, U>)> {
    // A unit input since the onset shifts the prior by B_k (B ← F (I − K H) B + G) and the innovation by H B_k.
    let mut effect = SMatrix::<f64, N, U>::zeros();
    let mut information = SMatrix::<f64, U, U>::zeros();
    let mut evidence = SVector::<f64, U>::zeros();
    for step in steps.iter().flatten() {
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
