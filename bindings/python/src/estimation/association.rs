//! Which detection is of which target.

use super::arrays::{Array, matrix, numbers, vector};
use super::sizes::by_state;
use crate::errors::{of_estimation, usage};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pursuit::estimation::Gaussian;
use pursuit::estimation::association::{Assignment, Cost, JointParams, JointProbabilities, NearestNeighbours};
use pursuit::estimation::consistency::Gate;
use pursuit::nalgebra::SVector;
use pyo3::prelude::*;

/// The column of each row of cost (rows, columns), -1 for none, so that the sum is least; infinite costs forbid a pair, and
/// a row that stays without costs `unassigned`. Returns the columns and the sum.
#[pyfunction]
pub fn assign<'py>(py: Python<'py>, cost: Array<'py>, unassigned: f64) -> PyResult<(Bound<'py, PyArray1<i64>>, f64)> {
    let [rows, columns] = *cost.shape() else {
        return Err(usage(format!("cost has shape {:?}, not (rows, columns)", cost.shape())));
    };
    let costs = numbers("cost", &cost, &[Some(rows), Some(columns)])?;
    let (found, total) = py
        .detach(|| {
            let mut assignment = Assignment::new();
            let found = assignment.solve(rows, columns, |r, c| costs[r * columns + c], |_| unassigned)?;
            let found: Vec<i64> = indices(found);
            Ok((found, assignment.total()))
        })
        .map_err(of_estimation)?;
    Ok((PyArray1::from_vec(py, found), total))
}

fn indices(found: &[Option<usize>]) -> Vec<i64> {
    found.iter().map(|column| column.and_then(|c| i64::try_from(c).ok()).unwrap_or(-1)).collect()
}

/// The detection (D, m) of each expected measurement, means (K, m) and covariances (K, m, m); -1 for none. `probability` is
/// the gate's. With `likelihood`, (detection_probability, clutter_density), pairs cost what they are unlikely, else their
/// distance.
#[pyfunction]
pub fn associate<'py>(
    py: Python<'py>,
    means: Array<'py>,
    covariances: Array<'py>,
    detections: Array<'py>,
    probability: f64,
    likelihood: Option<(f64, f64)>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let (targets, m) = sizes(&means)?;
    let means = numbers("means", &means, &[Some(targets), Some(m)])?;
    let covariances = numbers("covariances", &covariances, &[Some(targets), Some(m), Some(m)])?;
    let detections = numbers("detections", &detections, &[None, Some(m)])?;
    let cost = likelihood.map_or(Cost::Distance, |(detection_probability, clutter_density)| Cost::Likelihood {
        detection_probability,
        clutter_density,
    });
    let found = py.detach(|| by_state!(m, nearest(means, covariances, detections, probability, cost)))?;
    Ok(PyArray1::from_vec(py, found))
}

/// The probabilities (K, D + 1) that each target was missed, and that each detection is its own.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "named on the Python side")]
pub fn joint_probabilities<'py>(
    py: Python<'py>,
    means: Array<'py>,
    covariances: Array<'py>,
    detections: Array<'py>,
    probability: f64,
    detection_probability: f64,
    clutter_density: f64,
    most_events: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (targets, m) = sizes(&means)?;
    let means = numbers("means", &means, &[Some(targets), Some(m)])?;
    let covariances = numbers("covariances", &covariances, &[Some(targets), Some(m), Some(m)])?;
    let detections = numbers("detections", &detections, &[None, Some(m)])?;
    let gate = Gate::from_probability(m, probability).map_err(of_estimation)?;
    let params = JointParams { detection_probability, clutter_density, gate, most_events };
    let rows = py.detach(|| by_state!(m, joint(means, covariances, detections, params)))?;
    let width = detections.len() / m + 1;
    PyArray1::from_vec(py, rows).reshape([targets, width])
}

/// Targets and components.
fn sizes(means: &Array<'_>) -> PyResult<(usize, usize)> {
    match *means.shape() {
        [targets, m] if m > 0 => Ok((targets, m)),
        _ => Err(usage(format!("means have shape {:?}, not (targets, m)", means.shape()))),
    }
}

fn expected<const M: usize>(means: &[f64], covariances: &[f64]) -> PyResult<Vec<Gaussian<M>>> {
    let pairs = means.chunks_exact(M).zip(covariances.chunks_exact(M * M));
    pairs
        .map(|(mean, covariance)| Gaussian::new(vector(mean, 0), matrix(covariance, 0)).map_err(of_estimation))
        .collect()
}

fn points<const M: usize>(values: &[f64]) -> Vec<SVector<f64, M>> {
    values.chunks_exact(M).map(SVector::from_column_slice).collect()
}

fn nearest<const M: usize>(
    means: &[f64],
    covariances: &[f64],
    detections: &[f64],
    probability: f64,
    cost: Cost,
) -> PyResult<Vec<i64>> {
    let gate = Gate::from_probability(M, probability).map_err(of_estimation)?;
    let mut associator = NearestNeighbours::new(gate, cost).map_err(of_estimation)?;
    let expected = expected::<M>(means, covariances)?;
    Ok(indices(associator.associate(&expected, &points(detections)).map_err(of_estimation)?))
}

fn joint<const M: usize>(
    means: &[f64],
    covariances: &[f64],
    detections: &[f64],
    params: JointParams,
) -> PyResult<Vec<f64>> {
    let joint = JointProbabilities::new(params).map_err(of_estimation)?;
    let expected = expected::<M>(means, covariances)?;
    let found = joint.of(&expected, &points(detections)).map_err(of_estimation)?;
    Ok((0..expected.len()).filter_map(|target| found.of(target)).flatten().copied().collect())
}
