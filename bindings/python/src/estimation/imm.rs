//! The interacting multiple model estimator over N tracks x T steps.

use super::arrays::{Array, Failure, Reading, count, matrix, numbers, sensors, start};
use super::sizes::by_small_size;
use crate::errors::{of_estimation, usage};
use numpy::{PyArray2, PyArray3, PyArray4, PyArrayMethods, PyUntypedArrayMethods};
use pursuit::estimation::{Imm, Switching, Transition};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Means (N, T, n), covariances (N, T, n, n), mode probabilities (N, T, K) and log-likelihoods (N, T).
type Mixed<'py> =
    (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray4<f64>>, Bound<'py, PyArray3<f64>>, Bound<'py, PyArray2<f64>>);

struct Given<'a> {
    z: &'a [f64],
    steps: usize,
    f: &'a [f64],
    q: &'a [f64],
    h: &'a [f64],
    r: &'a [f64],
    switching: &'a [f64],
    probabilities: &'a [f64],
    x0: &'a [f64],
    p0: &'a [f64],
}

struct Outputs<'a> {
    means: &'a mut [f64],
    covariances: &'a mut [f64],
    modes: &'a mut [f64],
    likelihoods: &'a mut [f64],
}

/// Filters measurements (N, T, m), NaN where nothing was measured, by K models: F, Q (K, n, n); H (1, m, n), R (1, m, m),
/// switching (K, K), row = from; probabilities (K); x0 (1 or N, n), P0 (1 or N, n, n).
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "named on the Python side")]
pub fn imm_filter<'py>(
    py: Python<'py>,
    z: Array<'py>,
    f: Array<'py>,
    q: Array<'py>,
    h: Array<'py>,
    r: Array<'py>,
    switching: Array<'py>,
    probabilities: Array<'py>,
    x0: Array<'py>,
    p0: Array<'py>,
) -> PyResult<Mixed<'py>> {
    let [tracks, steps, m] = *z.shape() else {
        return Err(usage(format!("z has shape {:?}, not (N, T, m)", z.shape())));
    };
    let (n, k) = (x0.shape().last().copied().unwrap_or(0), probabilities.len());
    let (xs, ps) = (count("x0", &x0, tracks, "track")?, count("P0", &p0, tracks, "track")?);
    let given = Given {
        z: numbers("z", &z, &[Some(tracks), Some(steps), Some(m)])?,
        steps,
        f: numbers("F", &f, &[Some(k), Some(n), Some(n)])?,
        q: numbers("Q", &q, &[Some(k), Some(n), Some(n)])?,
        h: numbers("H", &h, &[Some(1), Some(m), Some(n)])?,
        r: numbers("R", &r, &[Some(1), Some(m), Some(m)])?,
        switching: numbers("switching", &switching, &[Some(k), Some(k)])?,
        probabilities: numbers("probabilities", &probabilities, &[Some(k)])?,
        x0: numbers("x0", &x0, &[Some(xs), Some(n)])?,
        p0: numbers("P0", &p0, &[Some(ps), Some(n), Some(n)])?,
    };
    let means = PyArray3::<f64>::zeros(py, [tracks, steps, n], false);
    let covariances = PyArray4::<f64>::zeros(py, [tracks, steps, n, n], false);
    let modes = PyArray3::<f64>::zeros(py, [tracks, steps, k], false);
    let likelihoods = PyArray2::<f64>::zeros(py, [tracks, steps], false);
    {
        let (mut a, mut c) = (means.readwrite(), covariances.readwrite());
        let (mut p, mut l) = (modes.readwrite(), likelihoods.readwrite());
        let outputs = Outputs {
            means: a.as_slice_mut()?,
            covariances: c.as_slice_mut()?,
            modes: p.as_slice_mut()?,
            likelihoods: l.as_slice_mut()?,
        };
        py.detach(|| by_small_size!(n, m, by_modes(&given, outputs)))?;
    }
    Ok((means, covariances, modes, likelihoods))
}

fn by_modes<const N: usize, const M: usize>(given: &Given<'_>, outputs: Outputs<'_>) -> PyResult<()> {
    match given.probabilities.len() {
        2 => run::<N, M, 2>(given, outputs),
        3 => run::<N, M, 3>(given, outputs),
        k => Err(usage(format!("{k} models; there are estimators of 2 and 3"))),
    }
}

fn run<const N: usize, const M: usize, const K: usize>(given: &Given<'_>, outputs: Outputs<'_>) -> PyResult<()> {
    let steps = given.steps;
    if steps == 0 {
        return Ok(());
    }
    let models = (0..K).map(|k| {
        Transition::<N>::new(matrix(&given.f[k * N * N..][..N * N], 0), matrix(&given.q[k * N * N..][..N * N], 0))
    });
    let models: Vec<_> = models.collect::<Result<_, _>>().map_err(of_estimation)?;
    let models: [Transition<N>; K] = models.try_into().map_err(|_| usage("a model is missing"))?;
    let switching = Switching::<K>::per_step(matrix(given.switching, 0)).map_err(of_estimation)?;
    let sensor = sensors::<N, M>(given.h, given.r, 1)?[0];
    let probabilities: [f64; K] = std::array::from_fn(|k| given.probabilities[k]);
    let rows = outputs.means.par_chunks_mut(steps * N).zip(outputs.covariances.par_chunks_mut(steps * N * N));
    let rows = rows.zip(outputs.modes.par_chunks_mut(steps * K)).zip(outputs.likelihoods.par_chunks_mut(steps));
    let filtered = rows.zip(given.z.par_chunks(steps * M)).enumerate().map(|(track, (out, z))| {
        let (((mean, covariance), modes), likelihood) = out;
        let failed = |step| move |error| Failure { track, step, error };
        let belief = start::<N>(given.x0, given.p0, track).map_err(failed(0))?;
        let mut imm = Imm::new(belief, probabilities).map_err(failed(0))?;
        for step in 0..steps {
            imm.predict(&models, &switching).map_err(failed(step))?;
            likelihood[step] = match Reading::<M>::of(&z[step * M..][..M]) {
                Reading::Whole(value) => imm.update(&sensor, &value).map_err(failed(step))?,
                Reading::Part(..) | Reading::Missing => 0.0,
            };
            let combined = imm.combined();
            mean[step * N..][..N].copy_from_slice(combined.mean().as_slice());
            covariance[step * N * N..][..N * N].copy_from_slice(combined.covariance().as_slice());
            modes[step * K..][..K].copy_from_slice(imm.probabilities().as_slice());
        }
        Ok(())
    });
    filtered.collect::<Result<(), Failure>>().map_err(PyErr::from)
}
