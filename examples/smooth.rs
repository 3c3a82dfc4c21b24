//! Smoothing: after the fact every moment is known better, because what came after it speaks too.

use crate::noise::normal;
use pursuit::charts::{Axis, Chart, Color, Series};
use pursuit::estimation::filters::smooth;
use pursuit::estimation::motion::ConstantAcceleration;
use pursuit::estimation::{Gaussian, LinearMeasurement, MotionModel};
use pursuit::nalgebra::SVector;
use std::path::Path;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dt_s = 1.0 / 60.0;
    let height = |t_s: f64| 400.0 * t_s - 0.5 * 981.0 * t_s * t_s; // cm: thrown upward
    let velocity = |t_s: f64| 400.0 - 981.0 * t_s;

    let step = ConstantAcceleration::<1>::white(1e4).over(dt_s)?; // cm²/s⁵
    let sensor = LinearMeasurement::<1, 3>::select([0], [1.0])?; // deviation 1 cm
    let mut belief = Gaussian::from_variances(SVector::from([0.0, 0.0, 0.0]), SVector::from([1.0, 1e6, 1e7]))?;
    let (mut beliefs, mut differences, mut last) = (vec![belief], vec![], 0.0);
    for k in 1..50 {
        belief.predict(&step)?;
        let measured = height(k as f64 * dt_s) + normal(k);
        belief.update(&sensor, &SVector::from([measured]))?;
        beliefs.push(belief);
        differences.push(((k as f64 - 0.5) * dt_s, (measured - last) / dt_s));
        last = measured;
    }
    let filtered = beliefs.clone();
    smooth(&mut beliefs, &vec![step; filtered.len() - 1])?;

    let speeds = |beliefs: &[Gaussian<3>]| -> Vec<(f64, f64)> {
        beliefs.iter().enumerate().skip(1).map(|(k, b)| (k as f64 * dt_s, b.mean()[1])).collect()
    };
    let rmse = |points: &[(f64, f64)]| {
        let squares: f64 = points.iter().map(|(t, v)| (v - velocity(*t)).powi(2)).sum();
        (squares / points.len() as f64).sqrt()
    };
    let (filtered, smoothed) = (speeds(&filtered), speeds(&beliefs));
    let each = [&differences, &filtered, &smoothed].map(|points| rmse(points));
    println!(
        "error of the velocity: differences {:.0} cm/s, filtered {:.0}, smoothed {:.1}",
        each[0], each[1], each[2]
    );

    Chart::new("How fast is a thrown ball?", Axis::new("time (s)"), Axis::new("velocity (cm/s)").over(-600.0, 600.0))
        .with(Series::points("differences of measurements", Color::Measured, differences))
        .with(Series::line("filtered", Color::Predicted, filtered))
        .with(Series::line("smoothed", Color::Estimate, smoothed))
        .write(Path::new("smooth.svg"))?;
    Ok(())
}
