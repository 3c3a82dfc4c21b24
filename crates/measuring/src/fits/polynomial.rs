//! Lines and parabolas: each axis by its own least squares.

use super::{Found, Sample};
use nalgebra::{SMatrix, SVector};

pub(super) const LINE: &[(&str, i32)] = &[("x0", 0), ("vx", 1), ("y0", 0), ("vy", 1), ("speed", 1)];
pub(super) const PARABOLA: &[(&str, i32)] =
    &[("x0", 0), ("vx", 1), ("ax", 2), ("y0", 0), ("vy", 1), ("ay", 2), ("acceleration", 2)];

/// Coefficients of `1, t, t² / 2 …` on one axis with their covariance, and what is left over.
struct OnAxis<const N: usize> {
    values: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
    residuals: Vec<f64>,
}

fn on_axis<const N: usize>(samples: &[Sample], axis: usize) -> Option<OnAxis<N>> {
    let span = samples.last()?.t.max(f64::MIN_POSITIVE);
    let row = |t: f64| SVector::<f64, N>::from_fn(|i, _| (t / span).powi(i as i32));
    let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for s in samples {
        let (row, weight) = (row(s.t), 1.0 / s.variance[axis]);
        normal += row * row.transpose() * weight;
        right += row * (s.at[axis] * weight);
    }
    let factor = normal.cholesky()?;
    let solved = factor.solve(&right);
    let residuals: Vec<f64> = samples.iter().map(|s| s.at[axis] - row(s.t).dot(&solved)).collect();
    let squares: f64 = residuals.iter().zip(samples).map(|(r, s)| r * r / s.variance[axis]).sum();
    let freedom = samples.len().checked_sub(N).filter(|f| *f > 0)? as f64;
    // From powers of t/span to derivatives at the first time.
    let derivative = SVector::<f64, N>::from_fn(|i, _| (1..=i).product::<usize>() as f64 / span.powi(i as i32));
    let scale = SMatrix::<f64, N, N>::from_diagonal(&derivative);
    let covariance = scale * factor.inverse() * scale * (squares / freedom);
    Some(OnAxis { values: scale * solved, covariance, residuals })
}

/// Both axes, and how large the highest derivative is as a vector.
fn both<const N: usize>(samples: &[Sample]) -> Option<Found> {
    let [x, y] = [on_axis::<N>(samples, 0)?, on_axis::<N>(samples, 1)?];
    let (mut values, mut variances) = (Vec::new(), Vec::new());
    for axis in [&x, &y] {
        values.extend(axis.values.iter());
        variances.extend(axis.covariance.diagonal().iter());
    }
    let top = N - 1;
    let (a, b) = (x.values[top], y.values[top]);
    let size = a.hypot(b).max(f64::MIN_POSITIVE);
    values.push(size);
    variances.push((a * a * x.covariance[(top, top)] + b * b * y.covariance[(top, top)]) / (size * size));
    let rows = samples.iter().zip(x.residuals.into_iter().zip(y.residuals));
    Some(Found { values, variances, residuals: rows.map(|(s, (rx, ry))| (s.t, vec![rx, ry])).collect() })
}

pub(super) fn line(samples: &[Sample]) -> Option<Found> {
    both::<2>(samples)
}

pub(super) fn parabola(samples: &[Sample]) -> Option<Found> {
    both::<3>(samples)
}
