//! The linear filter against the independent reference, step by step.

use crate::common::{assert_close, assert_near, fixture, list, matrix, number, vector};
use nalgebra::SMatrix;
use pursuit_estimation::motion::StepBox;
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel, Transition};
use serde_json::Value;

const TOLERANCE: f64 = 1e-9;

/// One predict and one update (where there is a measurement), every reported quantity compared.
fn check_step<const M: usize, const N: usize>(
    belief: &mut Gaussian<N>,
    transition: &Transition<N>,
    sensor: &LinearMeasurement<M, N>,
    z: &Value,
    step: &Value,
) {
    belief.predict(transition).unwrap();
    assert_close("x prior", belief.mean(), &vector(&step["x_prior"]), TOLERANCE);
    assert_close("P prior", belief.covariance(), &matrix(&step["P_prior"]), TOLERANCE);
    if !z.is_null() {
        let z = vector::<M>(z);
        assert_close("K", &belief.gain(sensor).unwrap(), &matrix(&step["K"]), TOLERANCE);
        let before = belief.innovation(sensor, &z).unwrap();
        let innovation = belief.update(sensor, &z).unwrap();
        assert_eq!(before, innovation);
        assert_close("innovation", innovation.residual(), &vector(&step["innovation"]), TOLERANCE);
        assert_close("S", &innovation.covariance(), &matrix(&step["S"]), TOLERANCE);
        assert_near("nis", innovation.nis(), number(&step["nis"]), TOLERANCE);
        assert_near("loglik", innovation.log_likelihood(), number(&step["loglik"]), TOLERANCE);
    }
    assert_close("x post", belief.mean(), &vector(&step["x_post"]), TOLERANCE);
    assert_close("P post", belief.covariance(), &matrix(&step["P_post"]), TOLERANCE);
}

fn with_control<const M: usize, const N: usize>(name: &str) {
    let data = fixture(name);
    let input = matrix::<N, 2>(&data["B"]);
    let transition = Transition::<N>::new(matrix(&data["F"]), matrix(&data["Q"])).unwrap();
    let sensor = LinearMeasurement::<M, N>::new(matrix(&data["H"]), matrix(&data["R"])).unwrap();
    let mut belief = Gaussian::<N>::new(vector(&data["x0"]), matrix(&data["P0"])).unwrap();
    let mut missed = 0;
    for (k, step) in list(&data["steps"]).iter().enumerate() {
        let transition = transition.with_offset(input * vector::<2>(&data["u"][k])).unwrap();
        check_step(&mut belief, &transition, &sensor, &data["z"][k], step);
        missed += usize::from(data["z"][k].is_null());
    }
    assert!(missed > 0);
}

#[test]
fn four_states_with_control() {
    with_control::<2, 4>("kf_4state_control");
}

#[test]
fn six_states_with_control() {
    with_control::<2, 6>("kf_6state_ca_control");
}

#[test]
fn ball() {
    let data = fixture("kf_ball_seed000");
    let model = StepBox::ball();
    let sensor = model.measurement().unwrap();
    assert_eq!(sensor.matrix(), &matrix::<4, 6>(&data["H"]));
    let mut belief = Gaussian::new(vector(&data["x0"]), matrix(&data["P0"])).unwrap();
    for (k, step) in list(&data["steps"]).iter().enumerate() {
        let transition = model.over(number(&data["dt"][k])).unwrap();
        check_step(&mut belief, &transition, &sensor, &data["z"][k], step);
    }
}

/// Runs the filter until it settles, which is what a steady-state gain is.
fn settles<const M: usize, const N: usize>(case: &Value) {
    let transition = Transition::<N>::new(matrix(&case["F"]), matrix(&case["Q"])).unwrap();
    let sensor = LinearMeasurement::<M, N>::new(matrix(&case["H"]), matrix(&case["R"])).unwrap();
    let mut belief = Gaussian::<N>::new(SMatrix::zeros(), SMatrix::identity()).unwrap();
    for _ in 0..20_000 {
        belief.predict(&transition).unwrap();
        belief.update(&sensor, &SMatrix::zeros()).unwrap();
    }
    assert_close("P post", belief.covariance(), &matrix(&case["P_post"]), TOLERANCE);
    belief.predict(&transition).unwrap();
    assert_close("P prior", belief.covariance(), &matrix(&case["P_prior"]), TOLERANCE);
    assert_close("K", &belief.gain(&sensor).unwrap(), &matrix(&case["K"]), TOLERANCE);
}

#[test]
fn the_filter_settles_on_the_riccati_solution() {
    let data = fixture("dare_gains");
    for case in list(&data["cases"]) {
        match (list(&case["H"]).len(), list(&case["F"]).len()) {
            (4, 6) => settles::<4, 6>(case),
            (2, 6) => settles::<2, 6>(case),
            (2, 4) => settles::<2, 4>(case),
            (1, 2) => settles::<1, 2>(case),
            (1, 3) => settles::<1, 3>(case),
            other => panic!("no case for {other:?}"),
        }
    }
}
