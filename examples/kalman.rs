//! The Kalman filter: a belief is predicted, then corrected by what is measured. It errs less than the measurements do, says by how much, and
//! bridges a gap.

use crate::noise::normal;
use pursuit::charts::{Axis, Chart, Color, Series};
use pursuit::estimation::motion::ConstantVelocity;
use pursuit::estimation::{Gaussian, LinearMeasurement, MotionModel};
use pursuit::nalgebra::SVector;
use std::path::Path;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dt_s = 1.0 / 25.0;
    let truth = |t_s: f64| 40.0 * t_s + 30.0 * (1.3 * t_s).sin(); // px, along one axis

    // The state is [position, velocity]; how much the velocity may change is the one thing to choose.
    let model = ConstantVelocity::<1>::white(2000.0); // px²/s³
    let sensor = LinearMeasurement::<1, 2>::select([0], [36.0])?; // variance, px²: deviation 6 px
    let mut belief = Gaussian::from_variances(SVector::from([0.0, 0.0]), SVector::from([36.0, 1e4]))?;

    let (mut measured, mut estimated, mut true_path) = (vec![], vec![], vec![]);
    let (mut band, mut squares) = (vec![], [0.0, 0.0]);
    for k in 1..125 {
        let t_s = k as f64 * dt_s;
        belief.predict(&model.over(dt_s)?)?;
        if !(60..80).contains(&k) {
            let z = truth(t_s) + 6.0 * normal(k);
            belief.update(&sensor, &SVector::from([z]))?;
            measured.push((t_s, z));
            squares[0] += (z - truth(t_s)).powi(2);
            squares[1] += (belief.mean()[0] - truth(t_s)).powi(2);
        }
        let (x, sd) = (belief.mean()[0], belief.covariance()[(0, 0)].sqrt());
        estimated.push((t_s, x));
        band.push((t_s, x - 2.0 * sd, x + 2.0 * sd));
        true_path.push((t_s, truth(t_s)));
    }
    let rmse = squares.map(|s: f64| (s / measured.len() as f64).sqrt());
    println!("root mean square error: measured {:.1} px, estimated {:.1} px", rmse[0], rmse[1]);

    Chart::new("A Kalman filter, and a gap of 0.8 s", Axis::new("time (s)"), Axis::new("x (px)"))
        .with(Series::area("two standard deviations", Color::Estimate, &band))
        .with(Series::points("measured", Color::Measured, measured))
        .with(Series::line("truth", Color::Truth, true_path))
        .with(Series::line("estimate", Color::Estimate, estimated))
        .write(Path::new("kalman.svg"))?;
    Ok(())
}
