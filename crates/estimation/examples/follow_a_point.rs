//! Follows a walker who turns a corner and is hidden for a while, by models that interact.
//!
//! `cargo run -p pursuit-estimation --example follow_a_point`

use pursuit_estimation::motion::{ConstantAcceleration, ConstantVelocity};
use pursuit_estimation::nalgebra::{SMatrix, SVector};
use pursuit_estimation::point::{ImmPoint, PointFilter, PointStart};
use pursuit_estimation::{Embedded, Result, Sojourn};

/// Runs it.
pub fn main() -> Result<()> {
    let dt_s = 1.0 / 30.0;
    // Walks straight on mostly: constant velocity, among the components of constant acceleration.
    let steady = Embedded::new(ConstantVelocity::<2>::white(50.0), [0, 1, 2, 3], SVector::<f64, 6>::repeat(100.0))?;
    let turning = ConstantAcceleration::<2>::white(1e6);
    let sojourn = Sojourn::new([1.0, 0.3])?; // seconds
    let start = PointStart { speed_px_per_s: 200.0, further: 500.0 };
    let noise = SMatrix::<f64, 2, 2>::identity() * 4.0; // px²
    let mut filter = ImmPoint::new((steady, turning), sojourn, start, &SVector::from([0.0, 0.0]), &noise)?;

    for frame in 1..90 {
        let t_s = f64::from(frame) * dt_s;
        let truth = SVector::from([120.0 * t_s.min(1.5), 120.0 * (t_s - 1.5).max(0.0)]);
        let wobble = SVector::from([(5.1 * f64::from(frame)).sin(), (7.3 * f64::from(frame)).cos()]) * 2.0;
        filter.predict(dt_s)?;
        let hidden = (60..70).contains(&frame);
        if !hidden {
            let innovation = filter.update(&(truth + wobble), &noise)?;
            if innovation.nis() > 9.21 {
                println!("frame {frame}: not expected, {:.1} deviations off", innovation.nis().sqrt());
            }
        }
        if frame % 15 == 0 {
            let belief = filter.belief();
            let ahead = filter.forecast(0.5)?;
            println!(
                "frame {frame}: at ({:.0}, {:.0}), true ({:.0}, {:.0}), turning with probability {:.2}; in half a second at \
                 ({:.0} ± {:.0}, {:.0} ± {:.0})",
                belief.mean()[0],
                belief.mean()[1],
                truth[0],
                truth[1],
                filter.imm().probabilities()[1],
                ahead.mean()[0],
                ahead.covariance()[(0, 0)].sqrt(),
                ahead.mean()[1],
                ahead.covariance()[(1, 1)].sqrt(),
            );
        }
        let off = (filter.belief().mean().fixed_rows::<2>(0) - truth).norm();
        assert!(frame < 10 || off < 12.0, "frame {frame}: {off} px off");
    }
    Ok(())
}
