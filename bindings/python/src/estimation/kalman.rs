//! Kalman filters and smoothers over N tracks x T steps.

use super::arrays::{Array, Failure, Reading, at, count, matrix, numbers, sensors, start, transitions, vector};
use super::sizes::{by_size, by_state};
use numpy::{PyArray2, PyArray3, PyArray4, PyArrayMethods, PyUntypedArrayMethods};
use pursuit::estimation::filters::smooth as smooth_run;
use pursuit::estimation::motion::CoordinatedTurn;
use pursuit::estimation::nonlinear::Unscented;
use pursuit::estimation::{EstimationError, Gaussian, LinearMeasurement, Transition};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Means (N, T, n), covariances (N, T, n, n) and log-likelihoods (N, T).
type Filtered<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray4<f64>>, Bound<'py, PyArray2<f64>>);
/// Means and covariances.
type Smoothed<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray4<f64>>);

/// How the state moves from step to step.
enum Motion<const N: usize> {
    Linear(Vec<Transition<N>>),
    /// Five components; extended or unscented, over these seconds.
    Turn {
        model: CoordinatedTurn,
        unscented: bool,
        dts_s: Vec<f64>,
    },
}

/// One run for all tracks.
struct Job<'a, const N: usize, const M: usize> {
    z: &'a [f64],
    steps: usize,
    motion: Motion<N>,
    sensors: Vec<LinearMeasurement<M, N>>,
    x0: &'a [f64],
    p0: &'a [f64],
    predict_first: bool,
}

/// Filters measurements (N, T, m): NaN where nothing was measured. F, Q (1 or T, n, n), b (1 or T, n), H (1 or T, m, n),
/// R (1 or T, m, m), x0 (1 or N, n), P0 (1 or N, n, n). With `turn`, (acceleration_density, turn_density, unscented), F
/// holds the seconds of each step in its first entry.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "named on the Python side")]
pub fn kalman_filter<'py>(
    py: Python<'py>,
    z: Array<'py>,
    f: Array<'py>,
    q: Array<'py>,
    b: Array<'py>,
    h: Array<'py>,
    r: Array<'py>,
    x0: Array<'py>,
    p0: Array<'py>,
    predict_first: bool,
    turn: Option<(f64, f64, bool)>,
) -> PyResult<Filtered<'py>> {
    let [tracks, steps, m] = *z.shape() else {
        return Err(crate::errors::usage(format!("z has shape {:?}, not (N, T, m)", z.shape())));
    };
    let n = x0.shape().last().copied().unwrap_or(0);
    let (fs, qs, bs) = (count("F", &f, steps, "step")?, count("Q", &q, steps, "step")?, count("b", &b, steps, "step")?);
    let (hs, rs) = (count("H", &h, steps, "step")?, count("R", &r, steps, "step")?);
    let (xs, ps) = (count("x0", &x0, tracks, "track")?, count("P0", &p0, tracks, "track")?);
    let z = numbers("z", &z, &[Some(tracks), Some(steps), Some(m)])?;
    let f = numbers("F", &f, &[Some(fs), Some(n), Some(n)])?;
    let q = numbers("Q", &q, &[Some(qs), Some(n), Some(n)])?;
    let b = numbers("b", &b, &[Some(bs), Some(n)])?;
    let h = numbers("H", &h, &[Some(hs), Some(m), Some(n)])?;
    let r = numbers("R", &r, &[Some(rs), Some(m), Some(m)])?;
    let x0 = numbers("x0", &x0, &[Some(xs), Some(n)])?;
    let p0 = numbers("P0", &p0, &[Some(ps), Some(n), Some(n)])?;
    let means = PyArray3::<f64>::zeros(py, [tracks, steps, n], false);
    let covariances = PyArray4::<f64>::zeros(py, [tracks, steps, n, n], false);
    let likelihoods = PyArray2::<f64>::zeros(py, [tracks, steps], false);
    {
        let (mut a, mut c, mut l) = (means.readwrite(), covariances.readwrite(), likelihoods.readwrite());
        let outputs = (a.as_slice_mut()?, c.as_slice_mut()?, l.as_slice_mut()?);
        let given = (z, steps, f, q, b, h, r, x0, p0, predict_first);
        py.detach(|| match turn {
            Some(turn) if n == 5 => by_turn(m, given, turn, outputs),
            Some(_) => Err(crate::errors::usage(format!("x0 has {n} components; a turn has 5: x, y, vx, vy, rate"))),
            None => by_size!(n, m, filter(given, outputs)),
        })?;
    }
    Ok((means, covariances, likelihoods))
}

type Given<'a> = (&'a [f64], usize, &'a [f64], &'a [f64], &'a [f64], &'a [f64], &'a [f64], &'a [f64], &'a [f64], bool);
type Outputs<'a> = (&'a mut [f64], &'a mut [f64], &'a mut [f64]);

fn filter<const N: usize, const M: usize>(given: Given<'_>, outputs: Outputs<'_>) -> PyResult<()> {
    let (z, steps, f, q, b, h, r, x0, p0, predict_first) = given;
    let motion = Motion::Linear(transitions(f, q, b, steps)?);
    run(&Job::<N, M> { z, steps, motion, sensors: sensors(h, r, steps)?, x0, p0, predict_first }, outputs)
}

fn by_turn(m: usize, given: Given<'_>, turn: (f64, f64, bool), outputs: Outputs<'_>) -> PyResult<()> {
    match m {
        1 => turning::<1>(given, turn, outputs),
        2 => turning::<2>(given, turn, outputs),
        3 => turning::<3>(given, turn, outputs),
        4 => turning::<4>(given, turn, outputs),
        m => Err(crate::errors::usage(format!("a measurement of {m} components; there are filters of 1 to 4"))),
    }
}

fn turning<const M: usize>(given: Given<'_>, turn: (f64, f64, bool), outputs: Outputs<'_>) -> PyResult<()> {
    let (z, steps, f, _, _, h, r, x0, p0, predict_first) = given;
    let dts_s = f.chunks_exact(25).filter_map(|step| step.first().copied()).collect();
    let model = CoordinatedTurn { acceleration_density: turn.0, turn_density: turn.1 };
    let motion = Motion::Turn { model, unscented: turn.2, dts_s };
    run(&Job::<5, M> { z, steps, motion, sensors: sensors(h, r, steps)?, x0, p0, predict_first }, outputs)
}

fn run<const N: usize, const M: usize>(
    job: &Job<'_, N, M>,
    (means, covariances, likelihoods): Outputs<'_>,
) -> PyResult<()> {
    if job.steps == 0 {
        return Ok(());
    }
    let steps = job.steps;
    let outputs = means.par_chunks_mut(steps * N).zip(covariances.par_chunks_mut(steps * N * N));
    let outputs = outputs.zip(likelihoods.par_chunks_mut(steps)).zip(job.z.par_chunks(steps * M));
    let filtered = outputs.enumerate().map(|(track, (((mean, covariance), likelihood), z))| {
        let failed = |step| move |error| Failure { track, step, error };
        let mut belief = start::<N>(job.x0, job.p0, track).map_err(failed(0))?;
        let rows = mean.chunks_exact_mut(N).zip(covariance.chunks_exact_mut(N * N)).zip(likelihood);
        for (step, (((mean, covariance), likelihood), z)) in rows.zip(z.chunks_exact(M)).enumerate() {
            if step > 0 || job.predict_first {
                predict(&mut belief, &job.motion, step).map_err(failed(step))?;
            }
            if let Some(sensor) = at(&job.sensors, step) {
                *likelihood = correct(&mut belief, sensor, z).map_err(failed(step))?;
            }
            mean.copy_from_slice(belief.mean().as_slice());
            // Symmetric to the last bit: rows and columns are the same.
            covariance.copy_from_slice(belief.covariance().as_slice());
        }
        Ok(())
    });
    filtered.collect::<Result<(), Failure>>().map_err(PyErr::from)
}

fn predict<const N: usize>(belief: &mut Gaussian<N>, motion: &Motion<N>, step: usize) -> Result<(), EstimationError> {
    match motion {
        Motion::Linear(transitions) => at(transitions, step).map_or(Ok(()), |t| belief.predict(t)),
        Motion::Turn { model, unscented, dts_s } => {
            let dt_s = at(dts_s, step).copied().unwrap_or(0.0);
            let mut five =
                Gaussian::<5>::new(vector(belief.mean().as_slice(), 0), matrix(belief.covariance().as_slice(), 0))?;
            if *unscented {
                five.predict_unscented(model, dt_s, &Unscented::default())?;
            } else {
                five.predict_extended(model, dt_s)?;
            }
            *belief = Gaussian::new(vector(five.mean().as_slice(), 0), matrix(five.covariance().as_slice(), 0))?;
            Ok(())
        }
    }
}

/// The log-likelihood of the measurement: zero where there is none, NaN where a part of it is missing.
fn correct<const N: usize, const M: usize>(
    belief: &mut Gaussian<N>,
    sensor: &LinearMeasurement<M, N>,
    z: &[f64],
) -> Result<f64, EstimationError> {
    match Reading::<M>::of(z) {
        Reading::Whole(value) => Ok(belief.update(sensor, &value)?.log_likelihood()),
        Reading::Part(value, there) => {
            let parts = std::array::from_fn(|i| there[i].then_some(value[i]));
            belief.update_partial(sensor, &parts)?;
            Ok(f64::NAN)
        }
        Reading::Missing => Ok(0.0),
    }
}

/// Smooths filtered means (N, T, n) and covariances (N, T, n, n); F, Q (1 or T, n, n) and b (1 or T, n) lead into each step.
#[pyfunction]
pub fn smooth<'py>(
    py: Python<'py>,
    means: Array<'py>,
    covariances: Array<'py>,
    f: Array<'py>,
    q: Array<'py>,
    b: Array<'py>,
) -> PyResult<Smoothed<'py>> {
    let [tracks, steps, n] = *means.shape() else {
        return Err(crate::errors::usage(format!("means have shape {:?}, not (N, T, n)", means.shape())));
    };
    let (fs, qs, bs) = (count("F", &f, steps, "step")?, count("Q", &q, steps, "step")?, count("b", &b, steps, "step")?);
    let means = numbers("means", &means, &[Some(tracks), Some(steps), Some(n)])?;
    let covariances = numbers("covariances", &covariances, &[Some(tracks), Some(steps), Some(n), Some(n)])?;
    let f = numbers("F", &f, &[Some(fs), Some(n), Some(n)])?;
    let q = numbers("Q", &q, &[Some(qs), Some(n), Some(n)])?;
    let b = numbers("b", &b, &[Some(bs), Some(n)])?;
    let smoothed = PyArray3::<f64>::zeros(py, [tracks, steps, n], false);
    let sure = PyArray4::<f64>::zeros(py, [tracks, steps, n, n], false);
    if steps > 0 {
        let (mut a, mut c) = (smoothed.readwrite(), sure.readwrite());
        let outputs = (a.as_slice_mut()?, c.as_slice_mut()?);
        py.detach(|| by_state!(n, smooth_all((means, covariances, steps), (f, q, b), outputs)))?;
    }
    Ok((smoothed, sure))
}

fn smooth_all<const N: usize>(
    (means, covariances, steps): (&[f64], &[f64], usize),
    (f, q, b): (&[f64], &[f64], &[f64]),
    (out_means, out_covariances): (&mut [f64], &mut [f64]),
) -> PyResult<()> {
    let into = transitions::<N>(f, q, b, steps)?;
    let between: Vec<Transition<N>> = (1..steps).filter_map(|step| at(&into, step).copied()).collect();
    let outputs = out_means.par_chunks_mut(steps * N).zip(out_covariances.par_chunks_mut(steps * N * N));
    let given = means.par_chunks(steps * N).zip(covariances.par_chunks(steps * N * N));
    let smoothed = outputs.zip(given).enumerate().map(|(track, ((out_mean, out_covariance), (mean, covariance)))| {
        let failed = |step| move |error| Failure { track, step, error };
        let beliefs = (0..steps).map(|k| {
            let (mean, covariance) = (vector(&mean[k * N..][..N], 0), matrix(&covariance[k * N * N..][..N * N], 0));
            Gaussian::<N>::new(mean, covariance).map_err(failed(k))
        });
        let mut beliefs: Vec<_> = beliefs.collect::<Result<_, _>>()?;
        smooth_run(&mut beliefs, &between).map_err(failed(0))?;
        for (k, belief) in beliefs.iter().enumerate() {
            out_mean[k * N..][..N].copy_from_slice(belief.mean().as_slice());
            out_covariance[k * N * N..][..N * N].copy_from_slice(belief.covariance().as_slice());
        }
        Ok(())
    });
    smoothed.collect::<Result<(), Failure>>().map_err(PyErr::from)
}
