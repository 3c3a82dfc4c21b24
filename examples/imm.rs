//! Interacting models: who mostly goes straight on and now and then turns is followed by two models at once, each with its probability.

use crate::noise::normal;
use pursuit::charts::{Axis, Chart, Color, Series};
use pursuit::estimation::Sojourn;
use pursuit::estimation::motion::ConstantVelocity;
use pursuit::estimation::point::{ImmPoint, ModelPoint, PointFilter, PointStart};
use pursuit::nalgebra::{SMatrix, SVector};
use std::path::Path;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dt_s = 1.0 / 25.0;
    let noise = SMatrix::<f64, 2, 2>::identity() * 9.0; // px²
    let origin = SVector::from([0.0, 0.0]);
    let start = PointStart { speed_px_per_s: 200.0, further: 500.0 };

    let calm = ConstantVelocity::<2>::white(50.0); // hardly turns, px²/s³
    let agile = ConstantVelocity::<2>::white(50_000.0); // may turn at once
    let mut one = ModelPoint::new(calm, start, &origin, &noise)?;
    let sojourn = Sojourn::new([2.0, 0.2])?; // how long each lasts on average, seconds
    let mut two = ImmPoint::new((calm, agile), sojourn, start, &origin, &noise)?;

    let mut errors = [vec![], vec![]];
    let mut agile_probability = vec![];
    for k in 1..150 {
        let t_s = k as f64 * dt_s;
        // To the right, and after three seconds down.
        let truth = SVector::from([150.0 * t_s.min(3.0), 150.0 * (t_s - 3.0).max(0.0)]);
        let measured = truth + 3.0 * SVector::from([normal(2 * k), normal(2 * k + 1)]);
        one.predict(dt_s)?;
        one.update(&measured, &noise)?;
        two.predict(dt_s)?;
        two.update(&measured, &noise)?;
        for (belief, errors) in [one.belief(), two.belief()].iter().zip(&mut errors) {
            errors.push((t_s, (belief.mean().fixed_rows::<2>(0) - truth).norm()));
        }
        agile_probability.push((t_s, 20.0 * two.imm().probabilities()[1]));
    }
    let worst = |errors: &[(f64, f64)]| errors.iter().skip(25).map(|e| e.1).fold(0.0, f64::max);
    println!("worst error: one calm model {:.0} px, two that interact {:.0} px", worst(&errors[0]), worst(&errors[1]));

    let [one, two] = errors;
    Chart::new("A right angle after three seconds", Axis::new("time (s)"), Axis::new("error (px)"))
        .with(Series::line("one calm model", Color::Predicted, one))
        .with(Series::line("two that interact", Color::Estimate, two))
        .with(Series::dashed("probability of the agile one (20: certain)", Color::Other, agile_probability))
        .write(Path::new("imm.svg"))?;
    Ok(())
}
