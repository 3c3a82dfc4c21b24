//! Particle filters over N tracks x T steps.

use super::arrays::{Array, Failure, Reading, at, count, numbers, sensors, start, transitions};
use super::sizes::by_small_size;
use crate::errors::usage;
use numpy::{PyArray2, PyArray3, PyArray4, PyArrayMethods, PyUntypedArrayMethods};
use pursuit::estimation::Gaussian;
use pursuit::estimation::particle::{ParticleFilter, ParticleOptions, Resampling};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Means (N, T, n), covariances (N, T, n, n) and effective sample sizes (N, T).
type Sampled<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray4<f64>>, Bound<'py, PyArray2<f64>>);

struct Given<'a> {
    z: &'a [f64],
    steps: usize,
    f: &'a [f64],
    q: &'a [f64],
    h: &'a [f64],
    r: &'a [f64],
    x0: &'a [f64],
    p0: &'a [f64],
    particles: usize,
    options: ParticleOptions,
    seed: u64,
}

/// Filters measurements (N, T, m) by samples: F, Q (1 or T, n, n), H (1 or T, m, n), R (1 or T, m, m), x0 (1 or N, n),
/// P0 (1 or N, n, n). Every track has random numbers of its own, from `seed` and its number.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "named on the Python side")]
pub fn particle_filter<'py>(
    py: Python<'py>,
    z: Array<'py>,
    f: Array<'py>,
    q: Array<'py>,
    h: Array<'py>,
    r: Array<'py>,
    x0: Array<'py>,
    p0: Array<'py>,
    particles: usize,
    resampling: &str,
    threshold: f64,
    regularisation: f64,
    seed: u64,
) -> PyResult<Sampled<'py>> {
    let [tracks, steps, m] = *z.shape() else {
        return Err(usage(format!("z has shape {:?}, not (N, T, m)", z.shape())));
    };
    let resampling = match resampling {
        "systematic" => Resampling::Systematic,
        "stratified" => Resampling::Stratified,
        "residual" => Resampling::Residual,
        "multinomial" => Resampling::Multinomial,
        other => {
            return Err(usage(format!(
                "there is no resampling `{other}`; there are: systematic, stratified, residual, multinomial"
            )));
        }
    };
    if !(1..=10_000_000).contains(&particles) {
        return Err(usage(format!("{particles} particles; give 1 to 10000000")));
    }
    let n = x0.shape().last().copied().unwrap_or(0);
    let (fs, qs) = (count("F", &f, steps, "step")?, count("Q", &q, steps, "step")?);
    let (hs, rs) = (count("H", &h, steps, "step")?, count("R", &r, steps, "step")?);
    let (xs, ps) = (count("x0", &x0, tracks, "track")?, count("P0", &p0, tracks, "track")?);
    let given = Given {
        z: numbers("z", &z, &[Some(tracks), Some(steps), Some(m)])?,
        steps,
        f: numbers("F", &f, &[Some(fs), Some(n), Some(n)])?,
        q: numbers("Q", &q, &[Some(qs), Some(n), Some(n)])?,
        h: numbers("H", &h, &[Some(hs), Some(m), Some(n)])?,
        r: numbers("R", &r, &[Some(rs), Some(m), Some(m)])?,
        x0: numbers("x0", &x0, &[Some(xs), Some(n)])?,
        p0: numbers("P0", &p0, &[Some(ps), Some(n), Some(n)])?,
        particles,
        options: ParticleOptions { resampling, threshold, regularisation },
        seed,
    };
    let means = PyArray3::<f64>::zeros(py, [tracks, steps, n], false);
    let covariances = PyArray4::<f64>::zeros(py, [tracks, steps, n, n], false);
    let sizes = PyArray2::<f64>::zeros(py, [tracks, steps], false);
    {
        let (mut a, mut c, mut s) = (means.readwrite(), covariances.readwrite(), sizes.readwrite());
        let outputs = (a.as_slice_mut()?, c.as_slice_mut()?, s.as_slice_mut()?);
        py.detach(|| by_small_size!(n, m, run(&given, outputs)))?;
    }
    Ok((means, covariances, sizes))
}

fn run<const N: usize, const M: usize>(
    given: &Given<'_>,
    (means, covariances, sizes): (&mut [f64], &mut [f64], &mut [f64]),
) -> PyResult<()> {
    let steps = given.steps;
    if steps == 0 {
        return Ok(());
    }
    let motion = transitions::<N>(given.f, given.q, &[0.0; N], steps)?;
    let sensors = sensors::<N, M>(given.h, given.r, steps)?;
    let rows = means.par_chunks_mut(steps * N).zip(covariances.par_chunks_mut(steps * N * N));
    let rows = rows.zip(sizes.par_chunks_mut(steps)).zip(given.z.par_chunks(steps * M));
    let filtered = rows.enumerate().map(|(track, (((mean, covariance), size), z))| {
        let failed = |step| move |error| Failure { track, step, error };
        let belief = start::<N>(given.x0, given.p0, track).map_err(failed(0))?;
        let seed = given.seed.wrapping_add(track as u64);
        let mut filter =
            ParticleFilter::from_gaussian(given.particles, &belief, given.options, seed).map_err(failed(0))?;
        for step in 0..steps {
            let (Some(motion), Some(sensor)) = (at(&motion, step), at(&sensors, step)) else { continue };
            filter.predict(motion).map_err(failed(step))?;
            if let Reading::Whole(value) = Reading::<M>::of(&z[step * M..][..M]) {
                let noise = Gaussian::new(value, *sensor.noise()).map_err(failed(step))?;
                // A state that cannot be weighed is as unlikely as any.
                let weigh = |state: &_| noise.log_density(&(sensor.matrix() * state)).unwrap_or(f64::NEG_INFINITY);
                filter.weigh_by(weigh).map_err(failed(step))?;
            }
            size[step] = filter.effective_sample_size();
            let belief = filter.to_gaussian();
            mean[step * N..][..N].copy_from_slice(belief.mean().as_slice());
            covariance[step * N * N..][..N * N].copy_from_slice(belief.covariance().as_slice());
            filter.resample_if_needed().map_err(failed(step))?;
        }
        Ok(())
    });
    filtered.collect::<Result<(), Failure>>().map_err(PyErr::from)
}
