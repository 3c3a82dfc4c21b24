//! Filters that learn their noise, and filters that decide.

use super::*;

/// The recursion of `zhai2024`: `k s_k / σ²` is χ² with k degrees of freedom, and the next residual against `s_k` nearly
/// with one.
#[test]
#[ignore = "release: 20 000 runs"]
fn variance_recursion() {
    const RESIDUALS: usize = 1000;
    consistent("zhai2024 recursion", [RESIDUALS, 1], |random| {
        let mut estimate = VarianceEstimate::<1>::new(VarianceParams::unbounded(VarianceRule::Corrected)).unwrap();
        let mut normal = || -> f64 {
            2.0 * {
                let n: f64 = StandardNormal.sample(&mut random.0);
                n
            }
        };
        for _ in 0..RESIDUALS {
            estimate.observe(&SVector::<f64, 1>::new(normal())).unwrap();
        }
        let variance = estimate.variance()[0];
        [RESIDUALS as f64 * variance / 4.0, normal().powi(2) / variance]
    });
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn noise_learnt_to_convergence() {
    const LEARNING: usize = 2500;
    const LEARNING_SETS: u64 = 10;
    let (step, start) = (cv(), unit::<4>());
    let sensor = position();
    judged("measurement noise learnt", [4, 2], LEARNING_SETS, |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        let mut adaptation = MeasurementNoiseAdaptation::new(sensor.noise() * 2.0, 0.003).unwrap();
        let mut learnt = sensor.with_noise(*adaptation.noise()).unwrap();
        for _ in 0..LEARNING {
            state = random.moved(&step, &state);
            belief.predict(&step).unwrap();
            let z = random.measured(&sensor, &state);
            nis = belief.update(&learnt, &z).unwrap().nis();
            learnt = adaptation.learn(&belief, &learnt, &z).unwrap();
        }
        [belief.nees(&state).unwrap(), nis]
    });
    // The factor strays in proportion to its weight, and a filter whose Q strays errs more than it believes: with .01, ten
    // times faster, the NEES is 4.4.
    judged("process noise scaled", [4, 2], LEARNING_SETS, |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        let mut scaling = ProcessNoiseScaling::new(0.001, (1e-3, 1e3)).unwrap();
        for _ in 0..LEARNING {
            state = random.moved(&step, &state);
            belief.predict(&scaling.scaled(&step).unwrap()).unwrap();
            let innovation = belief.update(&sensor, &random.measured(&sensor, &state)).unwrap();
            scaling.learn(&innovation, sensor.noise());
            nis = innovation.nis();
        }
        [belief.nees(&state).unwrap(), nis]
    });
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn filters_that_decide() {
    // Nothing happens, and gates open by chance: that is what can make these filters inconsistent.
    let step = ConstantVelocity::<1>::piecewise(0.01).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 2>::select([0], [1.0]).unwrap();
    let start = unit::<2>();
    consistent("gao2007, gated", [2, 1], |random| {
        let mut state = random.draw(&start);
        let mut filter = GatedFilter::new(GatedParams::recommended(0.01, 1.0), 0.0, 0.0).unwrap();
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            filter.predict(1.0).unwrap();
            nis = filter.update(random.measured(&sensor, &state)[0]).unwrap().nis();
        }
        [filter.belief().nees(&state).unwrap(), nis]
    });
    let input = SMatrix::<f64, 2, 1>::new(0.5, 1.0);
    let watching = over_runs("input estimation", [2, 1], SETS, |random| {
        let mut state = random.draw(&start);
        let mut filter = InputEstimator::<1, 2, 1, 10>::new(start, 9.0).unwrap();
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            let z = random.measured(&sensor, &state);
            nis = filter.step(&step, &input, &sensor, &z).unwrap().0.nis();
        }
        [filter.belief().nees(&state).unwrap(), nis]
    });
    // The largest of ten onsets is corrected for as if it had been the only one: a false alarm is believed too much.
    let [nees, nis] = watching.average;
    assert!((2.0..2.3).contains(&nees) && (1.0..1.15).contains(&nis), "input estimation: {nees}, {nis}");
    let step = ConstantVelocity::<2>::per_step(1.0).over(1.0).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let start = unit::<4>();
    consistent("zhu2014, jump anywhere", [4, 2], |random| {
        let mut state = random.draw(&start);
        let mut filter = HalfIntervalFilter::new(Zhu2014Params::jump_anywhere(), start).unwrap();
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            filter.predict(1.0).unwrap();
            nis = filter.update(&random.measured(&sensor, &state)).unwrap().innovation.nis();
        }
        [filter.belief().nees(&state).unwrap(), nis]
    });
}
