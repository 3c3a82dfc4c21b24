//! Corrections by sensors so sharp that `H P Hᵀ + R` is singular to rounding although it is not on paper: component by
//! component, so that what one row has told is taken off before the next is looked at.

use nalgebra::{SMatrix, SVector};

use crate::correction::joseph;
use crate::matrix::{cholesky, forward_substitute, times_transpose, times_vector};
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, Result};

/// What a correction came to.
pub(crate) struct Corrected<const M: usize, const N: usize> {
    pub belief: Gaussian<N>,
    pub innovation: Innovation<M>,
    pub gain: SMatrix<f64, N, M>,
}

/// The optimal correction by `residual`: at once where the innovation covariance can be inverted, else one by one.
///
/// # Errors
/// Where a number is not finite or the innovation covariance is singular on paper too.
#[inline]
pub(crate) fn corrected<const M: usize, const N: usize>(
    belief: &Gaussian<N>,
    measurement: &LinearMeasurement<M, N>,
    residual: &SVector<f64, M>,
) -> Result<Corrected<M, N>> {
    let cross = times_transpose(belief.covariance(), measurement.matrix());
    let covariance = times_transpose(&cross.transpose(), measurement.matrix()) + measurement.noise();
    match Innovation::new(*residual, covariance) {
        Ok(innovation) => {
            let gain = innovation.divide(&cross);
            Ok(Corrected { belief: joseph(belief, measurement, residual, &gain)?, innovation, gain })
        }
        Err(singular @ EstimationError::SingularInnovation { .. }) => {
            one_by_one(belief, measurement, residual).ok_or(singular)
        }
        Err(other) => Err(other),
    }
}

/// The same, one component of the whitened measurement after the other. `None` where `R` is singular or a number overflows.
///
/// With `R = C Cᵀ`, the whitened rows `C⁻¹ H` have unit noise. The scalars `s_j` are the pivots of the whitened
/// `S' = L' D' L'ᵀ`, and `S = (C L') D' (C L')ᵀ`.
#[cold]
fn one_by_one<const M: usize, const N: usize>(
    belief: &Gaussian<N>,
    measurement: &LinearMeasurement<M, N>,
    residual: &SVector<f64, M>,
) -> Option<Corrected<M, N>> {
    let root = cholesky(measurement.noise()).ok()?;
    let mut rows = *measurement.matrix();
    for mut column in rows.column_iter_mut() {
        let solved = forward_substitute(&root, &column.clone_owned());
        column.copy_from(&solved);
    }
    let whitened = forward_substitute(&root, residual);
    let mut after = *belief;
    let mut gain = SMatrix::<f64, N, M>::zeros();
    let (mut lower, mut pivots) = (SMatrix::<f64, M, M>::identity(), SVector::<f64, M>::zeros());
    for j in 0..M {
        let row: SMatrix<f64, 1, N> = rows.fixed_rows::<1>(j).into_owned();
        let cross = times_transpose(after.covariance(), &row);
        let pivot = times_vector(&row, &cross)[0] + 1.0;
        for later in j + 1..M {
            lower[(later, j)] = rows.fixed_rows::<1>(later).tr_dot(&cross) / pivot;
        }
        pivots[j] = pivot;
        let own = cross / pivot;
        let unexpected = whitened[j] - (row * (after.mean() - belief.mean()))[0];
        let unit = LinearMeasurement::<1, N>::new(row, SMatrix::<f64, 1, 1>::identity()).ok()?;
        after = joseph(&after, &unit, &SVector::<f64, 1>::new(unexpected), &own).ok()?;
        // K ← (I − k h) K + k eᵀ
        gain -= own * (row * gain);
        let mut column = gain.column_mut(j);
        column += own;
    }
    // Back from whitened components: K C⁻¹, and the unit lower factor of S with its pivots.
    let mut unwhitened = gain.transpose();
    root.tr_solve_lower_triangular_mut(&mut unwhitened);
    let mixed = root * lower;
    let factor = SMatrix::from_fn(|r, c| match r.cmp(&c) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => pivots[c] * root[(c, c)] * root[(c, c)],
        std::cmp::Ordering::Greater => mixed[(r, c)] / root[(c, c)],
    });
    Some(Corrected {
        belief: after,
        innovation: Innovation::from_factor(*residual, factor),
        gain: unwhitened.transpose(),
    })
}
