//! Motion models as matrices.

use crate::errors::{of_estimation, usage};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pursuit::estimation::motion::{Integrators, KinematicNoise, Singer};
use pursuit::estimation::{MotionModel, Transition};
use pyo3::prelude::*;

/// F and Q, (n, n).
type Matrices<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// A point of `axes` axes and `order` derivatives (1 position, 2 velocity, 3 acceleration), state [x, y, …, vx, vy, …],
/// over `dt_s` seconds; `noise` is "white" (spectral density), "piecewise" or "per_step" (variance).
#[pyfunction]
pub fn constant<'py>(
    py: Python<'py>,
    axes: usize,
    order: usize,
    dt_s: f64,
    noise: &str,
    size: f64,
) -> PyResult<Matrices<'py>> {
    let noise = match noise {
        "white" => KinematicNoise::White { density: size },
        "piecewise" => KinematicNoise::Piecewise { variance: size },
        "per_step" => KinematicNoise::PerStep { variance: size },
        other => return Err(usage(format!("there is no noise `{other}`; there are: white, piecewise, per_step"))),
    };
    macro_rules! chain {
        ($axes:literal, $order:literal) => {
            matrices(py, &Integrators::<$axes, $order> { noise }.over(dt_s).map_err(of_estimation)?)
        };
    }
    match (axes, order) {
        (1, 1) => chain!(1, 1),
        (2, 1) => chain!(2, 1),
        (3, 1) => chain!(3, 1),
        (1, 2) => chain!(1, 2),
        (2, 2) => chain!(2, 2),
        (3, 2) => chain!(3, 2),
        (1, 3) => chain!(1, 3),
        (2, 3) => chain!(2, 3),
        (3, 3) => chain!(3, 3),
        _ => Err(usage(format!("{axes} axes of order {order}; there are 1 to 3 axes of order 1 to 3"))),
    }
}

/// Singer's model of `axes` axes, state [x, …, vx, …, ax, …], over `dt_s` seconds.
#[pyfunction]
pub fn singer<'py>(
    py: Python<'py>,
    axes: usize,
    dt_s: f64,
    rate_per_s: f64,
    acceleration_variance: f64,
) -> PyResult<Matrices<'py>> {
    match axes {
        1 => matrices(py, &Singer::<1> { rate_per_s, acceleration_variance }.over(dt_s).map_err(of_estimation)?),
        2 => matrices(py, &Singer::<2> { rate_per_s, acceleration_variance }.over(dt_s).map_err(of_estimation)?),
        3 => matrices(py, &Singer::<3> { rate_per_s, acceleration_variance }.over(dt_s).map_err(of_estimation)?),
        _ => Err(usage(format!("{axes} axes; there are 1 to 3"))),
    }
}

fn matrices<'py, const N: usize>(py: Python<'py>, step: &Transition<N>) -> PyResult<Matrices<'py>> {
    let rows = |matrix: &pursuit::nalgebra::SMatrix<f64, N, N>| {
        PyArray1::from_slice(py, matrix.transpose().as_slice()).reshape([N, N])
    };
    Ok((rows(step.matrix())?, rows(step.noise())?))
}
