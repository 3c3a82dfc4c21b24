//! Every variation of the linear filter against the plain one, where the two must agree.

use crate::common::{assert_close, fixture, list, matrix};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use pursuit_estimation::filters::{
    InputEstimator, LastUpdate, MeasurementNoiseAdaptation, ProcessNoiseScaling, Replay, SquareRoot, SteadyState,
    smooth,
};
use pursuit_estimation::motion::{ConstantVelocity, StepBox};
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, MotionModel, Transition};
use serde_json::Value;

fn steady<const M: usize, const N: usize>(case: &Value) {
    let transition = Transition::<N>::new(matrix(&case["F"]), matrix(&case["Q"])).unwrap();
    let sensor = LinearMeasurement::<M, N>::new(matrix(&case["H"]), matrix(&case["R"])).unwrap();
    let state = SteadyState::solve(&transition, &sensor).unwrap();
    assert_close("P prior", &state.prior_covariance, &matrix(&case["P_prior"]), 1e-9);
    assert_close("P post", &state.posterior_covariance, &matrix(&case["P_post"]), 1e-9);
    assert_close("K", &state.gain, &matrix(&case["K"]), 1e-9);
    if let Value::Array(_) = &case["P_post_deterministic_truth"] {
        let (prior, posterior) = state.error_on(&SMatrix::zeros()).unwrap();
        assert_close("P prior, truth", &prior, &matrix(&case["P_prior_deterministic_truth"]), 1e-9);
        assert_close("P post, truth", &posterior, &matrix(&case["P_post_deterministic_truth"]), 1e-9);
    }
    // The gain's own error on its own noise is the posterior it promises.
    let (_, posterior) = state.error_on(transition.noise()).unwrap();
    assert_close("own noise", &posterior, &state.posterior_covariance, 1e-9);
}

#[test]
fn steady_gains() {
    let data = fixture("dare_gains");
    for case in list(&data["cases"]) {
        match (list(&case["H"]).len(), list(&case["F"]).len()) {
            (4, 6) => steady::<4, 6>(case),
            (2, 6) => steady::<2, 6>(case),
            (2, 4) => steady::<2, 4>(case),
            (1, 2) => steady::<1, 2>(case),
            (1, 3) => steady::<1, 3>(case),
            other => panic!("no case for {other:?}"),
        }
    }
}

#[test]
fn steady_gain_of_an_undetectable_state_is_refused() {
    let transition = ConstantVelocity::<1>::white(1.0).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 2>::select([1], [1.0]).unwrap();
    let result = SteadyState::solve(&transition, &sensor);
    assert!(matches!(result, Err(EstimationError::NoConvergence { .. })), "{result:?}");
}

/// A made-up but fixed sequence of measurements.
fn readings(n: usize) -> Vec<SVector<f64, 2>> {
    (0..n)
        .map(|k| {
            let t = k as f64;
            SVector::from([3.0 * t + (1.7 * t).sin(), 20.0 - t + (2.3 * t).cos()])
        })
        .collect()
}

fn sensor() -> LinearMeasurement<2, 4> {
    let matrix = SMatrix::<f64, 2, 4>::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0);
    LinearMeasurement::new(matrix, SMatrix::<f64, 2, 2>::new(1.0, 0.4, 0.4, 2.0)).unwrap()
}

fn start() -> Gaussian<4> {
    Gaussian::from_variances(SVector::from([0.0, 20.0, 0.0, 0.0]), SVector::from([4.0, 4.0, 25.0, 25.0])).unwrap()
}

#[test]
fn square_root_and_sequential_follow_the_plain_filter() {
    let model = ConstantVelocity::<2>::piecewise(0.3);
    let mut plain = start();
    let mut root = SquareRoot::new(&plain).unwrap();
    let mut one_by_one = plain;
    for (k, z) in readings(60).iter().enumerate() {
        let step = model.over(0.5 + 0.1 * (k % 4) as f64).unwrap();
        plain.predict(&step).unwrap();
        root.predict(&step).unwrap();
        one_by_one.predict(&step).unwrap();
        let expected = plain.update(&sensor(), z).unwrap();
        let innovation = root.update(&sensor(), z).unwrap();
        assert_close("S", &innovation.covariance(), &expected.covariance(), 1e-12);
        assert!((innovation.nis() - expected.nis()).abs() < 1e-12);
        let nis = one_by_one.update_sequentially(&sensor(), z).unwrap();
        assert!((nis - expected.nis()).abs() < 1e-11);
        assert_close("root mean", root.to_gaussian().mean(), plain.mean(), 1e-12);
        assert_close("root covariance", root.to_gaussian().covariance(), plain.covariance(), 1e-12);
        assert_close("sequential mean", one_by_one.mean(), plain.mean(), 1e-12);
        assert_close("sequential covariance", one_by_one.covariance(), plain.covariance(), 1e-12);
        assert_eq!(*root.factor(), root.factor().lower_triangle());
    }
}

#[test]
fn a_missing_component_is_a_sensor_of_the_others() {
    let z = SVector::from([5.0, 17.0]);
    let (mut partial, mut direct) = (start(), start());
    let (nis, used) = partial.update_partial(&sensor(), &[None, Some(z[1])]).unwrap();
    let single = LinearMeasurement::<1, 4>::select([1], [2.0]).unwrap();
    let expected = direct.update(&single, &SVector::<f64, 1>::new(z[1])).unwrap();
    assert_eq!(used, 1);
    assert!((nis - expected.nis()).abs() < 1e-14);
    assert_close("covariance", partial.covariance(), direct.covariance(), 1e-14);
    let mut untouched = start();
    assert_eq!(untouched.update_partial(&sensor(), &[None, None]).unwrap(), (0.0, 0));
    assert_eq!(untouched, start());
    assert!(untouched.update_partial(&sensor(), &[Some(1.0), Some(f64::NAN)]).is_err());
    assert_eq!(untouched, start());
}

#[test]
fn a_late_measurement_is_as_good_as_one_in_time() {
    let model = ConstantVelocity::<2>::white(0.8);
    let z = readings(4);
    let predict = |belief: &mut Gaussian<4>, dt: f64| belief.predict(&model.over(dt).unwrap()).unwrap();
    let mut in_order = start();
    for (z, dt) in z.iter().zip([1.0, 1.0, 0.3, 0.7]) {
        predict(&mut in_order, dt);
        in_order.update(&sensor(), z).unwrap();
    }
    // z[2], taken at t = 2.3, arrives after z[3], taken at t = 3.
    let mut late = start();
    for z in &z[..2] {
        predict(&mut late, 1.0);
        late.update(&sensor(), z).unwrap();
    }
    predict(&mut late, 1.0);
    let prior = late;
    let innovation = late.update(&sensor(), &z[3]).unwrap();
    let last = LastUpdate { prior, measurement: sensor(), innovation };
    late.update_delayed(&last, &model.over(0.7).unwrap(), &sensor(), &z[2]).unwrap();
    assert_close("mean", late.mean(), in_order.mean(), 1e-12);
    assert_close("covariance", late.covariance(), in_order.covariance(), 1e-12);

    let mut replay = Replay::new(model, start(), 0.0, 8).unwrap();
    let arrivals = [(1.0, z[0]), (3.0, z[3]), (2.3, z[2]), (2.0, z[1])];
    let again: Vec<usize> = arrivals.iter().map(|(t, z)| replay.update(*t, &sensor(), z).unwrap()).collect();
    assert_eq!(again, [0, 0, 1, 2]);
    let (time_s, belief) = replay.latest().unwrap();
    assert_eq!(time_s, 3.0);
    assert_close("replayed mean", belief.mean(), in_order.mean(), 1e-12);
    assert_close("replayed covariance", belief.covariance(), in_order.covariance(), 1e-12);
    assert!(matches!(replay.update(-0.5, &sensor(), &z[0]), Err(EstimationError::TimeStep { .. })));
}

/// The smoother's twin: all states and measurements of the run as one big least-squares problem.
#[test]
fn smoother_is_the_batch_solution() {
    const STEPS: usize = 7;
    let step = ConstantVelocity::<2>::white(0.5).over(1.0).unwrap();
    let (z, sensor, start) = (readings(STEPS), sensor(), start());
    let mut filtered = vec![];
    let mut belief = start;
    for (k, z) in z.iter().enumerate() {
        if k > 0 {
            belief.predict(&step).unwrap();
        }
        belief.update(&sensor, z).unwrap();
        filtered.push(belief);
    }
    smooth(&mut filtered, &[step; STEPS - 1]).unwrap();

    let mut information = DMatrix::<f64>::zeros(4 * STEPS, 4 * STEPS);
    let mut evidence = DVector::<f64>::zeros(4 * STEPS);
    let prior = start.covariance().try_inverse().unwrap();
    information.view_mut((0, 0), (4, 4)).copy_from(&prior);
    evidence.rows_mut(0, 4).copy_from(&(prior * start.mean()));
    let r = sensor.noise().try_inverse().unwrap();
    let q = step.noise().try_inverse().unwrap();
    let (h, f) = (sensor.matrix(), step.matrix());
    for k in 0..STEPS {
        let mut block = information.view_mut((4 * k, 4 * k), (4, 4));
        block += h.transpose() * r * h;
        let mut rows = evidence.rows_mut(4 * k, 4);
        rows += h.transpose() * r * z[k];
        if k + 1 < STEPS {
            let mut block = information.view_mut((4 * k, 4 * k), (4, 4));
            block += f.transpose() * q * f;
            let mut block = information.view_mut((4 * k + 4, 4 * k + 4), (4, 4));
            block += q;
            information.view_mut((4 * k, 4 * k + 4), (4, 4)).copy_from(&(-f.transpose() * q));
            information.view_mut((4 * k + 4, 4 * k), (4, 4)).copy_from(&(-q * f));
        }
    }
    let covariance = information.try_inverse().unwrap();
    let means = &covariance * evidence;
    for k in 0..STEPS {
        let mean: SVector<f64, 4> = means.fixed_rows::<4>(4 * k).into_owned();
        let block: SMatrix<f64, 4, 4> = covariance.fixed_view::<4, 4>(4 * k, 4 * k).into_owned();
        assert_close("mean", filtered[k].mean(), &mean, 1e-9);
        assert_close("covariance", filtered[k].covariance(), &block, 1e-9);
    }
    assert!(smooth(&mut filtered, &[step]).is_err());
}

#[test]
fn fading_memory_of_one_is_plain_and_more_forgets() {
    let step = ConstantVelocity::<2>::white(0.5).over(1.0).unwrap();
    let (mut plain, mut fading, mut forgetful) = (start(), start(), start());
    plain.predict(&step).unwrap();
    fading.predict_fading(&step, 1.0).unwrap();
    forgetful.predict_fading(&step, 1.1).unwrap();
    assert_close("plain", fading.covariance(), plain.covariance(), 1e-15);
    assert_close("mean", forgetful.mean(), plain.mean(), 1e-15);
    let inflated = (plain.covariance() - step.noise()) * 1.21 + step.noise();
    assert_close("inflated", forgetful.covariance(), &inflated, 1e-14);
    assert!(fading.predict_fading(&step, 0.9).is_err());
}

/// A small generator for the tests below; sums of twelve uniforms are near enough to normal.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }
}

#[test]
fn measurement_noise_is_learnt() {
    let model = StepBox { variances: [0.01, 0.01, 1.0, 1.0, 0.01, 0.01], measurement_variance_px2: 1.0 };
    let step = model.over(0.1).unwrap();
    let mut sensor = model.measurement().unwrap();
    let mut adaptation = MeasurementNoiseAdaptation::new(*sensor.noise(), 0.005).unwrap();
    let mut belief = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut noise = Noise(7);
    let truth = [9.0_f64, 4.0, 0.25, 1.0];
    for _ in 0..4000 {
        belief.predict(&step).unwrap();
        let z = SVector::<f64, 4>::from_fn(|i, _| truth[i].sqrt() * noise.next());
        belief.update(&sensor, &z).unwrap();
        sensor = adaptation.learn(&belief, &sensor, &z).unwrap();
    }
    for (i, expected) in truth.into_iter().enumerate() {
        let learnt = adaptation.noise()[(i, i)];
        assert!((learnt / expected - 1.0).abs() < 0.3, "component {i}: {learnt} for {expected}");
    }
}

#[test]
fn process_noise_is_scaled_towards_the_truth() {
    let truth = ConstantVelocity::<1>::piecewise(4.0).over(1.0).unwrap();
    let assumed = ConstantVelocity::<1>::piecewise(0.04).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 2>::select([0], [1.0]).unwrap();
    let mut scaling = ProcessNoiseScaling::new(0.02, (1e-3, 1e4)).unwrap();
    let mut belief = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut state = SVector::<f64, 2>::zeros();
    let mut noise = Noise(3);
    for _ in 0..5000 {
        let kick = 2.0 * noise.next();
        state = truth.matrix() * state + SVector::from([0.5 * kick, kick]);
        belief.predict(&scaling.scaled(&assumed).unwrap()).unwrap();
        let innovation = belief.update(&sensor, &SVector::<f64, 1>::new(state[0] + noise.next())).unwrap();
        scaling.learn(&innovation, sensor.noise());
    }
    assert!((40.0..250.0).contains(&scaling.scale()), "{} should be near 100", scaling.scale());
}

#[test]
fn an_input_is_found_and_put_right() {
    let step = ConstantVelocity::<1>::piecewise(0.0025).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 2>::select([0], [0.25]).unwrap();
    let acceleration = SMatrix::<f64, 2, 1>::new(0.5, 1.0);
    let start = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut watching = InputEstimator::<1, 2, 1, 10>::new(start, 9.0).unwrap();
    let mut plain = start;
    let mut noise = Noise(11);
    let (mut state, mut found) = (SVector::<f64, 2>::zeros(), vec![]);
    let mut error = [0.0; 2];
    for k in 0..80 {
        let input = if (40..60).contains(&k) { 0.5 } else { 0.0 };
        state = step.matrix() * state + acceleration * input;
        let z = SVector::<f64, 1>::new(state[0] + 0.5 * noise.next());
        let (_, size) = watching.step(&step, &acceleration, &sensor, &z).unwrap();
        found.extend(size.map(|size| (k, size[0])));
        plain.predict(&step).unwrap();
        plain.update(&sensor, &z).unwrap();
        error[0] += (watching.belief().mean()[0] - state[0]).powi(2);
        error[1] += (plain.mean()[0] - state[0]).powi(2);
    }
    assert!(found.iter().all(|(k, _)| *k >= 40), "{found:?}");
    assert!(found.iter().any(|(k, _)| *k <= 46), "{found:?}");
    assert!(error[0] < 0.2 * error[1], "{error:?}");
    // A failed step changes nothing.
    let before = *watching.belief();
    assert!(watching.step(&step, &acceleration, &sensor, &SVector::<f64, 1>::new(f64::NAN)).is_err());
    assert_eq!(*watching.belief(), before);
}

/// Without noise the innovations of a filter that was exact are the input's effect and nothing else, so that its size,
/// its onset and the state are found exactly, at any step length.
#[test]
fn an_input_without_noise_is_found_exactly() {
    for dt in [0.04_f64, 1.0, 5.0] {
        let step = ConstantVelocity::<1>::piecewise(1e-8 / dt.powi(4)).over(dt).unwrap();
        let sensor = LinearMeasurement::<1, 2>::select([0], [1e-4]).unwrap();
        let input = SMatrix::<f64, 2, 1>::new(0.5 * dt * dt, dt);
        let mut state = SVector::<f64, 2>::from([3.0, -1.0]);
        let start = Gaussian::from_variances(state, SVector::from([1e-6, 1e-6 / (dt * dt)])).unwrap();
        let mut watching = InputEstimator::<1, 2, 1, 10>::new(start, 9.0).unwrap();
        // Weak enough that more than three innovations have seen it once it is significant.
        let acceleration = 0.006 / (dt * dt);
        let mut first = None;
        for k in 0..40 {
            state = step.matrix() * state;
            if k >= 20 {
                state += input * acceleration;
            }
            let z = SVector::<f64, 1>::new(state[0]);
            let (_, found) = watching.step(&step, &input, &sensor, &z).unwrap();
            if let (Some(size), None) = (found, first) {
                first = Some(k);
                assert!((22..29).contains(&k), "{k}");
                assert!((size[0] / acceleration - 1.0).abs() < 1e-9, "{size} for {acceleration}");
                assert!((watching.belief().mean() - state).norm() < 1e-9, "{}", watching.belief().mean());
            }
        }
        assert!(first.is_some());
    }
}

/// A velocity that jumps is seen within a few steps, and costs the filter less than a plain one tuned for the jump.
#[test]
fn a_sudden_turn_is_seen_at_once() {
    let step = ConstantVelocity::<1>::piecewise(0.25e-3).over(1.0).unwrap();
    let tuned = ConstantVelocity::<1>::piecewise(0.14).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 2>::select([0], [0.25]).unwrap();
    let input = SMatrix::<f64, 2, 1>::new(0.5, 1.0);
    let mut noise = Noise(5);
    let (mut errors, mut late) = ([0.0; 2], 0);
    for _ in 0..100 {
        let mut state = SVector::<f64, 2>::from([0.0, 2.0]);
        let start = Gaussian::new(state, SMatrix::identity()).unwrap();
        let mut watching = InputEstimator::<1, 2, 1, 10>::new(start, 9.0).unwrap();
        let mut plain = start;
        let mut seen = None;
        for k in 1..100 {
            state = step.matrix() * state;
            if k == 50 {
                state[1] = -1.5;
            }
            let z = SVector::<f64, 1>::new(state[0] + 0.5 * noise.next());
            let found = watching.step(&step, &input, &sensor, &z).unwrap().1;
            if k >= 50 && found.is_some() {
                seen.get_or_insert(k);
            }
            plain.predict(&tuned).unwrap();
            plain.update(&sensor, &z).unwrap();
            errors[0] += (watching.belief().mean()[0] - state[0]).powi(2);
            errors[1] += (plain.mean()[0] - state[0]).powi(2);
        }
        late += i32::from(seen.is_none_or(|k| k > 53));
    }
    assert!(late <= 2, "{late} of 100 turns were seen late");
    assert!(errors[0] < 0.75 * errors[1], "{errors:?}");
}
