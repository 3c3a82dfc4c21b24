//! Two targets cross in clutter; detections are given to them all at once, then by joint probabilities.
//!
//! `cargo run -p pursuit-estimation --example many_targets`

use pursuit_estimation::association::{Cost, JointParams, JointProbabilities, NearestNeighbours, unmatched};
use pursuit_estimation::consistency::Gate;
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::nalgebra::SVector;
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel, Result};

/// Runs it.
pub fn main() -> Result<()> {
    let step = ConstantVelocity::<2>::white(0.5).over(1.0)?;
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0])?;
    let gate = Gate::from_probability(2, 0.999)?;
    let cost = Cost::Likelihood { detection_probability: 0.9, clutter_density: 1e-4 };
    let mut nearest = NearestNeighbours::new(gate, cost)?;
    let params = JointParams { detection_probability: 0.9, clutter_density: 1e-4, gate, most_events: 100_000 };
    let joint = JointProbabilities::new(params)?;

    let paths = |k: f64| [SVector::from([3.0 * k, 2.0 * k]), SVector::from([3.0 * k, 80.0 - 2.0 * k])];
    let start = |at: SVector<f64, 2>, vy: f64| {
        Gaussian::from_variances(SVector::from([at[0], at[1], 3.0, vy]), SVector::from([1.0, 1.0, 0.5, 0.5]))
    };
    let [a, b] = paths(0.0);
    let mut assigned = [start(a, 2.0)?, start(b, -2.0)?];
    let mut weighted = assigned;
    for k in 1..40 {
        let k = f64::from(k);
        let wobble = SVector::from([(1.7 * k).sin(), (2.3 * k).cos()]);
        let truth = paths(k);
        // Now and then one is missed; something else is always there.
        let mut detections = vec![SVector::from([3.0 * k + 30.0 * (5.0 * k).sin(), 40.0 + 30.0 * (3.0 * k).cos()])];
        detections.extend(truth.iter().enumerate().filter(|(i, _)| k % 7.0 != *i as f64).map(|(_, at)| at + wobble));

        for belief in assigned.iter_mut().chain(&mut weighted) {
            belief.predict(&step)?;
        }
        let expected = [assigned[0].expected(&sensor)?, assigned[1].expected(&sensor)?];
        let matches = nearest.associate(&expected, &detections)?;
        if k == 10.0 {
            println!(
                "frame 10: {matches:?}, of nobody: {:?}",
                unmatched(matches, detections.len()).collect::<Vec<_>>()
            );
        }
        for (belief, found) in assigned.iter_mut().zip(matches) {
            if let Some(value) = found.and_then(|index| detections.get(index)) {
                belief.update(&sensor, value)?;
            }
        }
        let expected = [weighted[0].expected(&sensor)?, weighted[1].expected(&sensor)?];
        let probabilities = joint.of(&expected, &detections)?;
        for (target, belief) in weighted.iter_mut().enumerate() {
            if let Some(each) = probabilities.of(target) {
                belief.update_weighted(&sensor, &detections, each)?;
            }
        }
    }
    for (name, beliefs) in [("assigned", assigned), ("weighted", weighted)] {
        for (belief, truth) in beliefs.iter().zip(paths(39.0)) {
            let off = (belief.mean().fixed_rows::<2>(0) - truth).norm();
            println!("{name}: {off:.2} px off at the end");
            assert!(off < 5.0, "{name}: {off}");
        }
    }
    Ok(())
}
