//! Arrays of numpy as matrices of fixed size.

use crate::errors::{ComputationError, UsageError, of_estimation, usage};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pursuit::estimation::{EstimationError, Gaussian, LinearMeasurement, Transition};
use pursuit::nalgebra::{SMatrix, SVector};
use pyo3::prelude::*;

/// An array of numbers, dense, in row-major order.
pub type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// The numbers of `array`, whose shape must be `shape`; `None` stands for any length.
pub fn numbers<'a>(name: &str, array: &'a Array<'_>, shape: &[Option<usize>]) -> PyResult<&'a [f64]> {
    let fits = array.ndim() == shape.len()
        && array.shape().iter().zip(shape).all(|(given, wanted)| wanted.is_none_or(|wanted| *given == wanted));
    if !fits {
        let wanted: Vec<String> = shape.iter().map(|s| s.map_or_else(|| "any".to_owned(), |s| s.to_string())).collect();
        return Err(usage(format!("{name} has shape {:?}, not ({})", array.shape(), wanted.join(", "))));
    }
    array.as_slice().map_err(|_| usage(format!("{name} is not contiguous")))
}

/// The `index`-th matrix of several, or the one there is.
pub fn matrix<const R: usize, const C: usize>(numbers: &[f64], index: usize) -> SMatrix<f64, R, C> {
    let from = if numbers.len() > R * C { index * R * C } else { 0 };
    SMatrix::from_row_slice(&numbers[from..from + R * C])
}

/// The `index`-th vector of several, or the one there is.
pub fn vector<const N: usize>(numbers: &[f64], index: usize) -> SVector<f64, N> {
    let from = if numbers.len() > N { index * N } else { 0 };
    SVector::from_column_slice(&numbers[from..from + N])
}

/// One matrix, or one a step: their number, 1 or `steps`.
pub fn count(name: &str, array: &Array<'_>, steps: usize, what: &str) -> PyResult<usize> {
    match array.shape().first() {
        Some(&1) => Ok(1),
        Some(&many) if many == steps => Ok(many),
        _ => Err(usage(format!(
            "{name} has shape {:?}; give one matrix, or {steps}, one for each {what}",
            array.shape()
        ))),
    }
}

/// Transitions by the matrices `F`, `Q` and displacements `b`: one, or one a step.
pub fn transitions<const N: usize>(f: &[f64], q: &[f64], b: &[f64], steps: usize) -> PyResult<Vec<Transition<N>>> {
    let varies = f.len() > N * N || q.len() > N * N || b.len() > N;
    let one = |k: usize| Transition::new(matrix(f, k), matrix(q, k))?.with_offset(vector(b, k));
    (0..if varies { steps } else { 1 }).map(|k| one(k).map_err(of_estimation)).collect()
}

/// Sensors by the matrices `H` and `R`: one, or one a step.
pub fn sensors<const N: usize, const M: usize>(
    h: &[f64],
    r: &[f64],
    steps: usize,
) -> PyResult<Vec<LinearMeasurement<M, N>>> {
    let varies = h.len() > M * N || r.len() > M * M;
    let one = |k: usize| LinearMeasurement::new(matrix(h, k), matrix(r, k));
    (0..if varies { steps } else { 1 }).map(|k| one(k).map_err(of_estimation)).collect()
}

/// The entry of this step, or the one there is.
pub fn at<T>(all: &[T], step: usize) -> Option<&T> {
    all.get(step).or_else(|| all.first())
}

/// The belief that track `track` starts from.
pub fn start<const N: usize>(x0: &[f64], p0: &[f64], track: usize) -> Result<Gaussian<N>, EstimationError> {
    Gaussian::new(vector(x0, track), matrix(p0, track))
}

/// What went wrong, and where.
#[derive(Debug)]
pub struct Failure {
    pub track: usize,
    pub step: usize,
    pub error: EstimationError,
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let Failure { track, step, error } = failure;
        let message = format!("track {track}, step {step}: {error}");
        match error {
            EstimationError::Overflow { .. } | EstimationError::SingularInnovation { .. } => {
                ComputationError::new_err(message)
            }
            _ => UsageError::new_err(message),
        }
    }
}

/// A measurement by what of it is there: NaN stands for what was not measured.
pub enum Reading<const M: usize> {
    Whole(SVector<f64, M>),
    Part(SVector<f64, M>, [bool; M]),
    Missing,
}

impl<const M: usize> Reading<M> {
    pub fn of(values: &[f64]) -> Self {
        let value = SVector::<f64, M>::from_column_slice(values);
        let there: [bool; M] = std::array::from_fn(|i| !value[i].is_nan());
        match there.iter().filter(|t| **t).count() {
            0 => Self::Missing,
            n if n == M => Self::Whole(value),
            _ => Self::Part(value, there),
        }
    }
}
