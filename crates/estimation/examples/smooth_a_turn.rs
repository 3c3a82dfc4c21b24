//! Annotates a turn after the fact: an unscented filter, its smoother, and a smoother that lags half a second behind.
//!
//! `cargo run -p pursuit-estimation --example smooth_a_turn`

use pursuit_estimation::filters::{FixedLag, smooth_unscented};
use pursuit_estimation::motion::CoordinatedTurn;
use pursuit_estimation::nalgebra::SVector;
use pursuit_estimation::nonlinear::Unscented;
use pursuit_estimation::{Gaussian, LinearMeasurement, Result};

/// Runs it.
pub fn main() -> Result<()> {
    let (dt_s, shape) = (0.1, Unscented::default());
    let motion = CoordinatedTurn { acceleration_density: 4.0, turn_density: 0.05 };
    let sensor = LinearMeasurement::<2, 5>::select([0, 1], [9.0, 9.0])?;
    let truth = |k: usize| {
        let angle = 0.06 * k as f64;
        SVector::from([100.0 * angle.sin(), 100.0 * (1.0 - angle.cos())])
    };
    let start = Gaussian::from_variances(
        SVector::from([0.0, 0.0, 50.0, 0.0, 0.0]),
        SVector::from([9.0, 9.0, 400.0, 400.0, 1.0]),
    )?;
    let mut belief = start;
    let mut filtered = vec![start];
    let mut lagged = FixedLag::new(5, start)?;
    let mut late = Vec::new();
    for k in 1..100 {
        let step = belief.linearized_unscented(&motion, dt_s, &shape)?;
        belief.predict_unscented(&motion, dt_s, &shape)?;
        let t = k as f64;
        let error = SVector::from([(5.3 * t * t).sin(), (3.7 * t * t).cos()]) * 4.2;
        belief.update(&sensor, &(truth(k) + error))?;
        late.extend(lagged.push(&step, &belief)?);
        filtered.push(belief);
    }
    late.extend(lagged.finish()?);
    let mut smoothed = filtered.clone();
    smooth_unscented(&mut smoothed, &motion, &[dt_s; 99], &shape)?;

    let rmse = |beliefs: &[Gaussian<5>]| {
        let squares = beliefs.iter().enumerate().map(|(k, b)| (b.mean().fixed_rows::<2>(0) - truth(k)).norm_squared());
        (squares.sum::<f64>() / beliefs.len() as f64).sqrt()
    };
    let [now, half_a_second, whole] = [rmse(&filtered), rmse(&late), rmse(&smoothed)];
    println!("RMSE: filtered {now:.2} px, half a second late {half_a_second:.2} px, all smoothed {whole:.2} px");
    assert_eq!(late.len(), filtered.len());
    assert!(whole < half_a_second && half_a_second < now);
    Ok(())
}
