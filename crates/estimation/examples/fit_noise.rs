//! Finds how agile targets are and how good a detector is, from what it recorded.
//!
//! `cargo run -p pursuit-estimation --example fit_noise`

use pursuit_estimation::Result;
use pursuit_estimation::fitting::{LinearFilter, Recording, fit};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::nalgebra::SVector;

/// Runs it.
pub fn main() -> Result<()> {
    let mut tracks = Vec::new();
    for track in 0..4 {
        let phase = f64::from(track);
        // A wandering path, read with an error of about one pixel; every ninth frame is missed.
        let times_s: Vec<f64> = (0..200).map(|k| f64::from(k) / 30.0).collect();
        let values = (0..200).map(|k| {
            let t = f64::from(k) / 30.0;
            let path = SVector::from([200.0 * (0.9 * t + phase).sin(), 150.0 * (1.3 * t - phase).cos()]);
            let error = SVector::from([(17.0 * t * t).sin(), (23.0 * t * t + phase).cos()]) * 1.4;
            (k % 9 != 8).then_some(path + error)
        });
        tracks.push(Recording::new(times_s, values.collect())?);
    }
    let found = fit(&tracks, [1e3, 10.0], |&[density, variance]| {
        LinearFilter::new(ConstantVelocity::<2>::white(density), variance, [1e5])
    })?;
    let [density, variance] = found.parameters;
    println!("acceleration density {density:.0} px²/s³, measurement variance {variance:.2} px²");
    if let Some([a, b]) = found.deviations {
        println!("known to {:.0} % and {:.0} %, after {} evaluations", 100.0 * a, 100.0 * b, found.evaluations);
    }
    assert!((0.4..2.0).contains(&variance));
    Ok(())
}
