//! Small fixed-size kernels of the filters. Column-major loops over arrays whose lengths are known at compile time, so
//! that the compiler unrolls and vectorises them; nothing here allocates.
//!
//! Products skip exact zeros of their right factor: transition and measurement matrices are mostly zeros, the test is
//! well predicted because the pattern does not change from step to step, and a NaN is not zero and so still spreads.

use nalgebra::{SMatrix, SVector};

use crate::{EstimationError, Result};

/// `left · rightᵀ`, skipping the zeros of `right`.
#[inline]
pub(crate) fn times_transpose<const R: usize, const K: usize, const C: usize>(
    left: &SMatrix<f64, R, K>,
    right: &SMatrix<f64, C, K>,
) -> SMatrix<f64, R, C> {
    let mut out = SMatrix::<f64, R, C>::zeros();
    for c in 0..C {
        let mut column = [0.0; R];
        for k in 0..K {
            let weight = right.data.0[k][c];
            if weight != 0.0 {
                for r in 0..R {
                    column[r] += left.data.0[k][r] * weight;
                }
            }
        }
        out.data.0[c] = column;
    }
    out
}

/// `matrix · vector`.
#[inline]
pub(crate) fn times_vector<const R: usize, const C: usize>(
    matrix: &SMatrix<f64, R, C>,
    vector: &SVector<f64, C>,
) -> SVector<f64, R> {
    let mut out = SVector::<f64, R>::zeros();
    for c in 0..C {
        let weight = vector.data.0[0][c];
        for r in 0..R {
            out.data.0[0][r] += matrix.data.0[c][r] * weight;
        }
    }
    out
}

/// `outer · symmetric · outerᵀ`, exactly symmetric.
#[inline]
pub(crate) fn sandwich<const R: usize, const N: usize>(
    outer: &SMatrix<f64, R, N>,
    symmetric: &SMatrix<f64, N, N>,
) -> SMatrix<f64, R, R> {
    let half = times_transpose(symmetric, outer);
    let mut out = times_transpose(&half.transpose(), outer);
    symmetrise(&mut out);
    out
}

/// Replaces a matrix by the mean of itself and its transpose.
#[inline]
pub(crate) fn symmetrise<const N: usize>(matrix: &mut SMatrix<f64, N, N>) {
    for c in 0..N {
        for r in c + 1..N {
            let mean = 0.5 * (matrix.data.0[c][r] + matrix.data.0[r][c]);
            matrix.data.0[c][r] = mean;
            matrix.data.0[r][c] = mean;
        }
    }
}

/// Whether every entry is finite.
#[inline]
pub(crate) fn is_finite<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> bool {
    // A product with zero is NaN for infinities and NaN, and zero otherwise: one pass without branches.
    let mut sums = [0.0; R];
    for column in &matrix.data.0 {
        for r in 0..R {
            sums[r] += column[r] * 0.0;
        }
    }
    sums.iter().sum::<f64>() == 0.0
}

/// Refuses a matrix with a component that is not finite.
#[inline]
pub(crate) fn require_finite<const R: usize, const C: usize>(
    what: &'static str,
    matrix: &SMatrix<f64, R, C>,
) -> Result<()> {
    if is_finite(matrix) { Ok(()) } else { Err(EstimationError::NotFinite { what }) }
}

/// A pivot below this fraction of its diagonal entry is lost in rounding.
pub(crate) const PIVOT_ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The lower Cholesky factor of a symmetric matrix (its lower triangle is read), or the row and value of the pivot
/// that is not positive beyond rounding.
#[inline]
pub(crate) fn cholesky<const N: usize>(
    matrix: &SMatrix<f64, N, N>,
) -> std::result::Result<SMatrix<f64, N, N>, (usize, f64)> {
    let mut lower = SMatrix::<f64, N, N>::zeros();
    for c in 0..N {
        let mut pivot = matrix.data.0[c][c];
        for k in 0..c {
            pivot -= lower.data.0[k][c] * lower.data.0[k][c];
        }
        // Written so that a NaN pivot fails too.
        let sound = pivot > PIVOT_ROUNDING * matrix.data.0[c][c] && pivot.is_finite();
        if !sound {
            return Err((c, pivot));
        }
        let root = pivot.sqrt();
        lower.data.0[c][c] = root;
        let inverse = 1.0 / root;
        for r in c + 1..N {
            let mut sum = matrix.data.0[c][r];
            for k in 0..c {
                sum -= lower.data.0[k][r] * lower.data.0[k][c];
            }
            lower.data.0[c][r] = sum * inverse;
        }
    }
    Ok(lower)
}

/// `S = L D Lᵀ` in one matrix: `D` on the diagonal and, below it, `L` whose own diagonal is one. Or the row and value of
/// the pivot that is not positive beyond rounding. The lower triangle is read.
#[inline]
pub(crate) fn factored<const M: usize>(
    matrix: &SMatrix<f64, M, M>,
) -> std::result::Result<SMatrix<f64, M, M>, (usize, f64)> {
    let mut out = SMatrix::<f64, M, M>::zeros();
    for c in 0..M {
        // D_k L_ck, for the columns before.
        let mut scaled = [0.0; M];
        let mut pivot = matrix.data.0[c][c];
        for k in 0..c {
            scaled[k] = out.data.0[k][k] * out.data.0[k][c];
            pivot -= scaled[k] * out.data.0[k][c];
        }
        // Written so that a NaN pivot fails too.
        let sound = pivot > PIVOT_ROUNDING * matrix.data.0[c][c] && pivot.is_finite();
        if !sound {
            return Err((c, pivot));
        }
        out.data.0[c][c] = pivot;
        let inverse = 1.0 / pivot;
        for r in c + 1..M {
            let mut sum = matrix.data.0[c][r];
            for k in 0..c {
                sum -= out.data.0[k][r] * scaled[k];
            }
            out.data.0[c][r] = sum * inverse;
        }
    }
    Ok(out)
}

/// `rows · (L D Lᵀ)⁻¹` for what [`factored`] returns.
#[inline]
pub(crate) fn divide_by_pivots<const R: usize, const M: usize>(
    rows: &SMatrix<f64, R, M>,
    factor: &SMatrix<f64, M, M>,
) -> SMatrix<f64, R, M> {
    let mut out = *rows;
    for j in 0..M {
        for i in 0..j {
            let weight = factor.data.0[i][j];
            for r in 0..R {
                out.data.0[j][r] -= out.data.0[i][r] * weight;
            }
        }
    }
    for j in (0..M).rev() {
        let inverse = 1.0 / factor.data.0[j][j];
        for r in 0..R {
            out.data.0[j][r] *= inverse;
        }
        for i in j + 1..M {
            let weight = factor.data.0[j][i];
            for r in 0..R {
                out.data.0[j][r] -= out.data.0[i][r] * weight;
            }
        }
    }
    out
}

/// `rows · (L Lᵀ)⁻¹` for a lower Cholesky factor `L`: every row of `rows` solved at once, column by column.
#[inline]
pub(crate) fn divide_by_factored<const R: usize, const M: usize>(
    rows: &SMatrix<f64, R, M>,
    lower: &SMatrix<f64, M, M>,
) -> SMatrix<f64, R, M> {
    let mut out = *rows;
    for j in 0..M {
        for i in 0..j {
            let weight = lower.data.0[i][j];
            for r in 0..R {
                out.data.0[j][r] -= out.data.0[i][r] * weight;
            }
        }
        let inverse = 1.0 / lower.data.0[j][j];
        for r in 0..R {
            out.data.0[j][r] *= inverse;
        }
    }
    for j in (0..M).rev() {
        for i in j + 1..M {
            let weight = lower.data.0[j][i];
            for r in 0..R {
                out.data.0[j][r] -= out.data.0[i][r] * weight;
            }
        }
        let inverse = 1.0 / lower.data.0[j][j];
        for r in 0..R {
            out.data.0[j][r] *= inverse;
        }
    }
    out
}

/// `L⁻¹ · vector` by forward substitution.
#[inline]
pub(crate) fn forward_substitute<const M: usize>(
    lower: &SMatrix<f64, M, M>,
    vector: &SVector<f64, M>,
) -> SVector<f64, M> {
    let mut out = *vector;
    for j in 0..M {
        let value = out.data.0[0][j] / lower.data.0[j][j];
        out.data.0[0][j] = value;
        for r in j + 1..M {
            out.data.0[0][r] -= lower.data.0[j][r] * value;
        }
    }
    out
}

/// `residualᵀ (L Lᵀ)⁻¹ residual`.
#[inline]
pub(crate) fn mahalanobis_squared<const M: usize>(lower: &SMatrix<f64, M, M>, residual: &SVector<f64, M>) -> f64 {
    forward_substitute(lower, residual).data.0[0].iter().map(|value| value * value).sum()
}

/// `ln det(L Lᵀ)`.
#[inline]
pub(crate) fn log_determinant<const M: usize>(lower: &SMatrix<f64, M, M>) -> f64 {
    (0..M).map(|i| 2.0 * lower.data.0[i][i].ln()).sum()
}

/// Relative difference of mirrored entries that counts as rounding, not as asymmetry.
const SYMMETRY_TOLERANCE: f64 = 1e-9;

/// Refuses a matrix that is not finite and symmetric; returns it exactly symmetric.
pub(crate) fn require_symmetric<const N: usize>(
    what: &'static str,
    matrix: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>> {
    require_finite(what, matrix)?;
    for column in 0..N {
        for row in column + 1..N {
            let (a, b) = (matrix[(row, column)], matrix[(column, row)]);
            let scale = (matrix[(row, row)].abs().sqrt() * matrix[(column, column)].abs().sqrt()).max(a.abs());
            if (a - b).abs() > SYMMETRY_TOLERANCE * scale {
                return Err(EstimationError::NotSymmetric { what, row, column });
            }
        }
    }
    let mut out = *matrix;
    symmetrise(&mut out);
    Ok(out)
}

/// Refuses a matrix that is not finite, symmetric and positive definite.
pub(crate) fn require_positive_definite<const N: usize>(
    what: &'static str,
    matrix: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>> {
    let out = require_symmetric(what, matrix)?;
    match cholesky(&out) {
        Ok(_) => Ok(out),
        Err((row, pivot)) => Err(EstimationError::NotPositive { what, requirement: "positive definite", row, pivot }),
    }
}

/// Pivots of a semi-definite matrix may fall this far below zero by rounding, as a fraction of the diagonal entry.
const SEMI_DEFINITE_TOLERANCE: f64 = 1e-10;

/// Refuses a matrix that is not finite, symmetric and positive semi-definite.
///
/// An `L D Lᵀ` factorisation where a vanishing pivot must leave a vanishing column: `a_ij² ≤ a_ii a_jj` holds for
/// every semi-definite matrix.
pub(crate) fn require_semi_definite<const N: usize>(
    what: &'static str,
    matrix: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>> {
    let out = require_symmetric(what, matrix)?;
    let refuse = |row, pivot| EstimationError::NotPositive { what, requirement: "positive semi-definite", row, pivot };
    let mut rest = out;
    for c in 0..N {
        let (pivot, diagonal) = (rest[(c, c)], out[(c, c)]);
        let tolerance = SEMI_DEFINITE_TOLERANCE * diagonal;
        if diagonal < 0.0 || pivot < -tolerance {
            return Err(refuse(c, pivot));
        }
        if pivot <= tolerance {
            for r in c + 1..N {
                let bound = SEMI_DEFINITE_TOLERANCE.sqrt() * (diagonal * out[(r, r)].max(0.0)).sqrt();
                if rest[(r, c)].abs() > 2.0 * bound {
                    return Err(refuse(c, pivot));
                }
            }
            continue;
        }
        for j in c + 1..N {
            for i in j..N {
                let step = rest[(i, c)] * rest[(j, c)] / pivot;
                rest[(i, j)] -= step;
            }
        }
    }
    Ok(out)
}

/// A lower factor of a positive semi-definite matrix; a vanishing pivot gives a column of zeros.
pub(crate) fn semi_definite_factor<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let mut lower = SMatrix::<f64, N, N>::zeros();
    for c in 0..N {
        let pivot = matrix[(c, c)] - (0..c).map(|k| lower[(c, k)] * lower[(c, k)]).sum::<f64>();
        // A relative floor: what is left of a singular direction is rounding, and its column would be noise.
        if pivot <= 1e-14 * matrix[(c, c)] {
            continue;
        }
        let root = pivot.sqrt();
        lower[(c, c)] = root;
        for r in c + 1..N {
            let sum: f64 = (0..c).map(|k| lower[(r, k)] * lower[(c, k)]).sum();
            lower[(r, c)] = (matrix[(r, c)] - sum) / root;
        }
    }
    lower
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector3};

    #[test]
    fn products_agree_with_nalgebra() {
        let a = Matrix3x2::new(1.0, 0.0, -2.0, 0.5, 0.0, 3.0);
        let p = Matrix2::new(2.0, 0.3, 0.3, 1.0);
        assert!((times_transpose(&p, &a) - p * a.transpose()).norm() < 1e-15);
        assert!((sandwich(&a, &p) - a * p * a.transpose()).norm() < 1e-14);
        let m = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0);
        let l = cholesky(&m).unwrap();
        assert!((l * l.transpose() - m).norm() < 1e-14);
        let v = Vector3::new(1.0, -2.0, 0.5);
        let direct = (v.transpose() * m.try_inverse().unwrap() * v)[0];
        assert!((mahalanobis_squared(&l, &v) - direct).abs() < 1e-14);
        assert!((log_determinant(&l) - m.determinant().ln()).abs() < 1e-14);
        let rows = a.transpose();
        assert!((divide_by_factored(&rows, &l) - rows * m.try_inverse().unwrap()).norm() < 1e-14);
    }

    #[test]
    fn semi_definite_is_told_from_indefinite() {
        let rank_one = Matrix2::new(0.25, 0.5, 0.5, 1.0);
        assert!(require_semi_definite("Q", &rank_one).is_ok());
        assert!(require_positive_definite("P", &rank_one).is_err());
        assert!(require_semi_definite("Q", &Matrix2::zeros()).is_ok());
        assert!(require_semi_definite("Q", &Matrix2::new(0.0, 1.0, 1.0, 4.0)).is_err());
        assert!(require_semi_definite("Q", &Matrix2::new(1.0, 2.0, 2.0, 1.0)).is_err());
        assert!(require_semi_definite("Q", &Matrix2::new(1.0, 0.1, 0.2, 1.0)).is_err());
        assert!(require_semi_definite("Q", &Matrix2::new(f64::NAN, 0.0, 0.0, 1.0)).is_err());
    }
}
