//! Measurements taken in one component at a time: the same answer as all at once, with divisions in place of an
//! inverse, and with any of the components missing.

use nalgebra::{SMatrix, SVector};

use crate::matrix::{cholesky, forward_substitute};
use crate::{EstimationError, Gaussian, LinearMeasurement, Result};

impl<const N: usize> Gaussian<N> {
    /// Corrects the belief by those components of a measurement that are there; `None` is a component that is missing.
    ///
    /// Correlated noise is whitened first, so the result equals [`update`](Self::update) with a sensor of those rows
    /// alone. All missing changes nothing. Returns the normalised innovation squared of what was used, and how many
    /// components that were.
    ///
    /// # Errors
    /// Where a component is not finite or an innovation is singular; the belief is then as it was.
    pub fn update_partial<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &[Option<f64>; M],
    ) -> Result<(f64, usize)> {
        let (sensor, present) = whitened(measurement, value)?;
        let mut belief = *self;
        let mut nis = 0.0;
        for (row, &reading) in present.iter().enumerate() {
            let Some(reading) = reading else { continue };
            let matrix: SMatrix<f64, 1, N> = sensor.matrix().fixed_rows::<1>(row).into_owned();
            let noise = SMatrix::<f64, 1, 1>::new(sensor.noise()[(row, row)]);
            let scalar = LinearMeasurement::new(matrix, noise)?;
            nis += belief.update(&scalar, &SVector::<f64, 1>::new(reading))?.nis();
        }
        *self = belief;
        Ok((nis, present.iter().flatten().count()))
    }

    /// Corrects the belief one component at a time; the same as [`update`](Self::update) up to rounding. Returns the
    /// normalised innovation squared.
    ///
    /// # Errors
    /// As [`update_partial`](Self::update_partial).
    pub fn update_sequentially<const M: usize>(
        &mut self,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<f64> {
        let all: [Option<f64>; M] = std::array::from_fn(|i| Some(value[i]));
        Ok(self.update_partial(measurement, &all)?.0)
    }
}

/// A sensor with uncorrelated noise that says the same, and its readings.
fn whitened<const M: usize, const N: usize>(
    measurement: &LinearMeasurement<M, N>,
    value: &[Option<f64>; M],
) -> Result<(LinearMeasurement<M, N>, [Option<f64>; M])> {
    let noise = measurement.noise();
    let correlated = (0..M).any(|i| (0..i).any(|j| value[i].is_some() && value[j].is_some() && noise[(i, j)] != 0.0));
    if !correlated {
        return Ok((*measurement, *value));
    }
    // Missing components are cut off from the others, so that one factorisation of fixed size serves every pattern.
    let among = |i: usize, j: usize| value[i].is_some() && value[j].is_some();
    let noise = SMatrix::<f64, M, M>::from_fn(|i, j| match (i == j, among(i, j)) {
        (_, true) => noise[(i, j)],
        (true, false) => 1.0,
        (false, false) => 0.0,
    });
    let lower = cholesky(&noise).map_err(|(row, pivot)| EstimationError::SingularInnovation { row, pivot })?;
    let mut matrix = *measurement.matrix();
    for mut column in matrix.column_iter_mut() {
        let solved = forward_substitute(&lower, &column.clone_owned());
        column.copy_from(&solved);
    }
    let readings = SVector::<f64, M>::from_fn(|i, _| value[i].unwrap_or(0.0));
    let solved = forward_substitute(&lower, &readings);
    let readings = std::array::from_fn(|i| value[i].map(|_| solved[i]));
    Ok((LinearMeasurement::new(matrix, SMatrix::identity())?, readings))
}
