//! A swing: `c + A sin(2π t / T + φ)`. The frequency is looked for where sine and cosine explain most (Lomb 1976, with a free
//! mean), then all four numbers are improved by Gauss and Newton's steps.

use super::{Found, Sample};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use std::f64::consts::TAU;

pub(super) const NAMES: &[(&str, i32)] =
    &[("centre", 0), ("amplitude", 0), ("period", -1), ("frequency", -3), ("phase", -2)];

/// How many frequencies are tried between 0 and 1 over the whole span.
const FINE: f64 = 6.0;
/// The search looks at this many samples and frequencies at the most.
const MOST_SAMPLES: usize = 2_000;
const MOST_FREQUENCIES: usize = 20_000;

pub(super) fn fit(samples: &[Sample], axis: usize) -> Option<Found> {
    let span = samples.last()?.t;
    let every = samples.len().div_ceil(MOST_SAMPLES);
    let thinned: Vec<Sample> = samples.iter().step_by(every).copied().collect();
    // Half a period is the least of which anything can be said; two samples a period the most.
    let highest = 0.5 * (thinned.len() as f64 - 1.0) / span;
    let count = ((highest - 0.5 / span) * FINE * span) as usize;
    let mut best = (f64::INFINITY, 0.0);
    for i in 0..count.min(MOST_FREQUENCIES) {
        let frequency = (0.5 + i as f64 / FINE) / span;
        if let Some(left) = left_over(&thinned, axis, frequency)
            && left < best.0
        {
            best = (left, frequency);
        }
    }
    let (mut linear, mut w) = (solved(samples, axis, best.1)?, TAU * best.1);
    // Centre, sine, cosine and frequency together.
    let mut normal = Matrix4::zeros();
    for _ in 0..50 {
        normal = Matrix4::zeros();
        let mut right = Vector4::zeros();
        for s in samples {
            let (sin, cos) = (w * s.t).sin_cos();
            let row = Vector4::new(1.0, sin, cos, s.t * (linear[1] * cos - linear[2] * sin));
            let missing = s.at[axis] - (linear[0] + linear[1] * sin + linear[2] * cos);
            normal += row * row.transpose() / s.variance[axis];
            right += row * (missing / s.variance[axis]);
        }
        let step = normal.cholesky()?.solve(&right);
        linear += step.fixed_rows::<3>(0);
        w += step[3];
        if step[3].abs() < 1e-13 * w {
            break;
        }
    }
    if !(w * span > 0.4 * TAU && w.is_finite()) {
        return None;
    }
    let residual = |s: &Sample| {
        let (sin, cos) = (w * s.t).sin_cos();
        s.at[axis] - (linear[0] + linear[1] * sin + linear[2] * cos)
    };
    let squares: f64 = samples.iter().map(|s| residual(s).powi(2) / s.variance[axis]).sum();
    let freedom = samples.len().checked_sub(4).filter(|f| *f > 0)? as f64;
    let covariance = normal.cholesky()?.inverse() * (squares / freedom);
    let amplitude = linear[1].hypot(linear[2]);
    if amplitude <= 0.0 {
        return None;
    }
    let (sin, cos) = (linear[1] / amplitude, linear[2] / amplitude);
    let of = |row: Vector4<f64>| (row.transpose() * covariance * row)[0];
    let period = TAU / w;
    let by_frequency = of(Vector4::new(0.0, 0.0, 0.0, 1.0));
    Some(Found {
        values: vec![linear[0], amplitude, period, w / TAU, cos.atan2(sin)],
        variances: vec![
            covariance[(0, 0)],
            of(Vector4::new(0.0, sin, cos, 0.0)),
            by_frequency * (period / w).powi(2),
            by_frequency / (TAU * TAU),
            of(Vector4::new(0.0, -cos, sin, 0.0)) / (amplitude * amplitude),
        ],
        residuals: samples.iter().map(|s| (s.t, vec![residual(s)])).collect(),
    })
}

/// Centre, sine and cosine at a frequency.
fn solved(samples: &[Sample], axis: usize, frequency: f64) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for s in samples {
        let (sin, cos) = (TAU * frequency * s.t).sin_cos();
        let row = Vector3::new(1.0, sin, cos);
        normal += row * row.transpose() / s.variance[axis];
        right += row * (s.at[axis] / s.variance[axis]);
    }
    Some(normal.cholesky()?.solve(&right))
}

fn left_over(samples: &[Sample], axis: usize, frequency: f64) -> Option<f64> {
    let linear = solved(samples, axis, frequency)?;
    let one = |s: &Sample| {
        let (sin, cos) = (TAU * frequency * s.t).sin_cos();
        (s.at[axis] - linear.dot(&Vector3::new(1.0, sin, cos))).powi(2) / s.variance[axis]
    };
    Some(samples.iter().map(one).sum())
}
