//! §5: the "no noise" mode, extrapolation from the last points, and how it fits the paper's Table 1.

use super::{Bar, Finding, Row, number};
use crate::ExperimentError;
use nalgebra::{Vector1, Vector2};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::qu2010::{Extrapolator, Points};
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel};

type Point = Vector2<f64>;

/// Positions that two-point extrapolation solves Table 1 for: integers, as pixels are. Three in a row, then the position
/// that the second row's prediction was made for.
const EARLY: [[f64; 2]; 4] = [[12.0, 119.0], [16.0, 116.0], [34.0, 120.0], [59.0, 113.0]];
const LATE: [[f64; 2]; 4] = [[261.0, 142.0], [277.0, 141.0], [292.0, 140.0], [307.0, 140.0]];

/// What Table 1 prints as predicted.
const PRINTED: [[f64; 2]; 4] = [[20.0, 113.0], [52.0, 124.0], [293.0, 140.0], [307.0, 139.0]];

/// Predictions of the third and fourth of four positions.
fn predictions(points: Points, positions: &[[f64; 2]; 4]) -> Result<Vec<(Point, Point)>, ExperimentError> {
    let mut extrapolator = Extrapolator::new(points);
    let mut found = Vec::new();
    for (time, position) in (0_i32..).zip(positions) {
        let (time, position) = (f64::from(time), Point::from(*position));
        if let Some(predicted) = extrapolator.predict(time) {
            found.push((predicted, position));
        }
        extrapolator.observe(time, &position)?;
    }
    Ok(found)
}

/// The largest difference between two-point extrapolation and a Kalman filter with a perfect sensor (R = 0) and noise on
/// the velocity alone: they are the same rule.
fn limit_differs() -> Result<f64, ExperimentError> {
    let model = ConstantVelocity::<1>::white(0.0).over(1.0)?;
    let noise = nalgebra::Matrix2::new(0.0, 0.0, 0.0, 1.0);
    let model = model.with_noise(noise)?;
    let sensor = LinearMeasurement::<1, 2>::select([0], [0.0])?;
    let values: [f64; 8] = [12.0, 16.0, 34.0, 59.0, 61.0, 40.0, 38.5, 38.0];
    let mut belief = Gaussian::from_variances(Point::new(values[0], 0.0), Point::new(1.0, 1.0))?;
    let mut most = 0.0_f64;
    for (k, value) in values.iter().enumerate().skip(1) {
        belief.predict(&model)?;
        // The first position is known to the unit variance of the start only; from the second on, exactly.
        if k >= 3 {
            most = most.max((belief.mean()[0] - (2.0 * values[k - 1] - values[k - 2])).abs());
        }
        belief.update(&sensor, &Vector1::new(*value))?;
    }
    Ok(most)
}

/// Rows of §5, and what they mean.
pub(super) fn rows() -> Result<(Vec<Row>, Vec<Finding>), ExperimentError> {
    let setting = "§5, simplified mode: two-point extrapolation";
    let mut errors = predictions(Points::Two, &EARLY)?;
    let late = predictions(Points::Two, &LATE)?;
    let rms = |pairs: &[(Point, Point)], of: &dyn Fn(Point) -> f64| {
        (pairs.iter().map(|(a, b)| of(a - b)).sum::<f64>() / pairs.len() as f64).sqrt()
    };
    let distance = |v: Point| v.norm_squared() / 2.0;
    let (early_error, late_error) = (rms(&errors, &distance), rms(&late, &distance));
    errors.extend(late);
    let limit = limit_differs()?;
    let off = errors.iter().zip(PRINTED).map(|((a, _), b)| (a - Point::from(b)).amax()).fold(0.0, f64::max);
    let rows = vec![
        Row::new(setting, "Table 1, largest difference of predictions, px", off).bar(Bar::AtMost(0.0)),
        Row::new(setting, "Table 1, RMSE of x, px", rms(&errors, &|v| v.x * v.x)).reference(7.84),
        Row::new(setting, "Table 1, RMSE of y, px", rms(&errors, &|v| v.y * v.y)).reference(6.54),
        Row::new(setting, "Table 1, early rows, per axis, px", early_error).reference(10.2),
        Row::new(setting, "Table 1, late rows, per axis, px", late_error).reference(0.71),
        Row::new(setting, "largest difference to R = 0, noise on the velocity", limit).bar(Bar::AtMost(1e-9)),
    ];
    let finding = Finding::new(
        "§5: leaving out both noises is a limit of the Kalman filter",
        limit <= 1e-9,
        format!(
            "of several: R = 0 with noise on the velocity is 2 z(k) − z(k−1) exactly (difference {}), which Table 1 agrees \
             with; Q = 0 with R → 0 is a fit over all the past that follows nobody; both zero at once is 0/0",
            number(limit)
        ),
    );
    Ok((rows, vec![finding]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_rows_of_table_1() {
        let found = predictions(Points::Two, &EARLY).unwrap();
        assert_eq!(found[0].0, Point::new(20.0, 113.0));
        assert_eq!(found[1].0, Point::new(52.0, 124.0));
        assert!(limit_differs().unwrap() < 1e-12);
    }
}
