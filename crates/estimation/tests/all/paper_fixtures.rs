//! The papers' filters against the independent reference.

use crate::common::{assert_close, assert_near, fixture, list, matrix, number, numbers, vector};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::filters::SteadyState;
use pursuit_estimation::gao2007::{
    GatedFilter, GatedParams, LiteralFilter, LiteralParams, RatioGuard, VelocityReading,
};
use pursuit_estimation::qu2010::{Extrapolator, Points, Qu2010Params};
use pursuit_estimation::regression::{Kernel, LeastSquaresSvm};
use pursuit_estimation::zhai2024::{VarianceEstimate, VarianceParams, VarianceRule};
use pursuit_estimation::zhu2014::{HalfInterval, HalfIntervalFilter, Jump, Zhu2014Params, again};
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel, Transition};
use serde_json::Value;

fn kernel(value: &Value) -> Kernel {
    match value["type"].as_str().unwrap() {
        "linear" => Kernel::Linear,
        "rbf" => Kernel::Rbf { sigma2: number(&value["sigma2"]) },
        "poly" => Kernel::Polynomial {
            offset: number(&value["c"]),
            degree: u32::try_from(value["degree"].as_u64().unwrap()).unwrap(),
        },
        other => panic!("no kernel {other}"),
    }
}

fn regression<const D: usize>(case: &Value) {
    let rows =
        |value: &Value| -> Vec<[f64; D]> { list(value).iter().map(|row| numbers(row).try_into().unwrap()).collect() };
    let inputs = rows(&case["X"]);
    let mut model = LeastSquaresSvm::new(kernel(&case["kernel"]), number(&case["gamma"])).unwrap();
    model.fit(&inputs, &numbers(&case["y"])).unwrap();
    let tolerance = if number(&case["cond"]) < 1e6 { 1e-9 } else { 1e-6 };
    assert_near("b", model.intercept(), number(&case["b"]), tolerance);
    for (a, b) in model.multipliers().iter().zip(numbers(&case["alpha"])) {
        assert_near("alpha", *a, b, tolerance);
    }
    for (x, y) in rows(&case["X_test"]).iter().zip(numbers(&case["y_test"])) {
        assert_near("y", model.predict(x), y, tolerance);
    }
    for (x, y) in inputs.iter().zip(numbers(&case["fitted"])) {
        assert_near("fitted", model.predict(x), y, tolerance);
    }
}

#[test]
fn least_squares_support_vectors() {
    let data = fixture("lssvm");
    for case in list(&data["cases"]) {
        match list(&case["X"][0]).len() {
            1 => regression::<1>(case),
            2 => regression::<2>(case),
            other => panic!("no case for {other} inputs"),
        }
    }
    let mut model = LeastSquaresSvm::<1>::new(Kernel::Linear, 1.0).unwrap();
    assert!(model.fit(&[], &[]).is_err());
    assert!(model.fit(&[[1.0]], &[f64::NAN]).is_err());
    assert!(LeastSquaresSvm::<1>::new(Kernel::Rbf { sigma2: 0.0 }, 1.0).is_err());
}

#[test]
fn gao2007_literal() {
    let data = fixture("lssvm_adaptive_kf");
    for run in list(&data["sequences"]) {
        let config = &run["config"];
        let params = LiteralParams {
            acceleration_variance: 0.0025,
            measurement_variance: number(&data["R"]),
            samples: config["N"].as_u64().unwrap() as usize,
            gamma: number(&config["gamma"]),
            kernel: match config["kernel"].as_str().unwrap() {
                "linear" => Kernel::Linear,
                "rbf" => Kernel::Rbf { sigma2: number(&config["kp"]) },
                other => panic!("no kernel {other}"),
            },
            velocity: match config["veldef"].as_str().unwrap() {
                "posterior_velocity" => VelocityReading::Posterior,
                "measurement_difference" => VelocityReading::MeasuredDifference,
                "filtered_position_difference" => VelocityReading::FilteredDifference,
                other => panic!("no velocity {other}"),
            },
            guard: match config["guard"].as_str().unwrap() {
                "none" => RatioGuard::None,
                "clamp" => RatioGuard::Clamp { low: number(&config["lo"]), high: number(&config["hi"]) },
                other => panic!("no guard {other}"),
            },
        };
        let z = numbers(&run["z"]);
        let mut filter = LiteralFilter::new(params, z[0], number(&run["v0"])).unwrap();
        for k in 1..z.len() {
            filter.predict(1.0).unwrap();
            assert_near("a", filter.ratio(), number(&run["a_used"][k]), 1e-8);
            assert_near("x prior", filter.belief().mean()[0], number(&run["x_prior"][k]), 1e-8);
            filter.update(z[k]).unwrap();
            assert_near("x post", filter.belief().mean()[0], number(&run["x_post"][k]), 1e-8);
            assert_near("v post", filter.belief().mean()[1], number(&run["v_post"][k]), 1e-8);
            if let Some(sample) = filter.last_sample() {
                assert_near("sample", sample, number(&run["a_sample"][k]), 1e-8);
            }
        }
    }
}

#[test]
fn gao2007_gated() {
    let data = fixture("lssvm_gated_kf");
    for run in list(&data["sequences"]) {
        let r = number(&run["R"]);
        let params = GatedParams::recommended(number(&run["q_over_R"]) * r, r);
        let z = numbers(&run["z"]);
        let mut filter = GatedFilter::new(params, z[0], number(&run["v0"])).unwrap();
        let mut opened = 0;
        for k in 1..z.len() {
            filter.predict(1.0).unwrap();
            opened += u64::from(filter.manoeuvring());
            assert_near("x prior", filter.belief().mean()[0], number(&run["x_prior"][k]), 1e-9);
            filter.update(z[k]).unwrap();
            assert_near("x post", filter.belief().mean()[0], number(&run["x_post"][k]), 1e-9);
        }
        assert_eq!(opened, run["gate_open_steps"].as_u64().unwrap());
    }
}

#[test]
fn gao2007_bad_input_changes_nothing() {
    let mut filter = GatedFilter::new(GatedParams::recommended(0.01, 1.0), 0.0, 1.0).unwrap();
    filter.predict(1.0).unwrap();
    let before = *filter.belief();
    assert!(filter.predict(0.0).is_err());
    assert!(filter.update(f64::NAN).is_err());
    assert_eq!(*filter.belief(), before);
    let bad = GatedParams { samples: 1, ..GatedParams::recommended(0.01, 1.0) };
    assert!(GatedFilter::new(bad, 0.0, 0.0).is_err());
}

#[test]
fn zhu2014_half_intervals() {
    let data = fixture("half_step_seed003");
    let before = Gaussian::<4>::new(vector(&data["x"]), matrix(&data["P"])).unwrap();
    let z = vector::<2>(&data["z"]);
    let dt = number(&data["dt"]);
    let jump = Jump::fixed(10.0);
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    for (name, half_interval) in [
        ("half_Q_each", HalfInterval::FullNoise),
        ("half_Q_half", HalfInterval::HalfNoise),
        ("mid_replace", HalfInterval::ObservedVelocity),
        ("mid_jump_sD10", HalfInterval::JumpAtMiddle { jump }),
        ("uniform_jump_sD10", HalfInterval::JumpAnywhere { jump }),
    ] {
        let params = Zhu2014Params { half_interval, threshold: 1e-9, ..Zhu2014Params::jump_anywhere() };
        let expected = &data["variants"][name];
        let mut belief = again(&params, &before, dt, &z).unwrap();
        assert_close(name, belief.mean(), &vector(&expected["x_prior"]), 1e-9);
        assert_close(name, belief.covariance(), &matrix(&expected["P_prior"]), 1e-9);
        assert_close(name, &belief.gain(&sensor).unwrap(), &matrix(&expected["K"]), 1e-9);
        belief.update(&sensor, &z).unwrap();
        assert_close(name, belief.mean(), &vector(&expected["x_post"]), 1e-9);
        assert_close(name, belief.covariance(), &matrix(&expected["P_post"]), 1e-9);
        // The whole filter, with a threshold that everything exceeds, does the same.
        let mut filter = HalfIntervalFilter::new(params, before).unwrap();
        filter.predict(dt).unwrap();
        let std = &data["variants"]["std"];
        assert_close("std", filter.belief().mean(), &vector(&std["x_prior"]), 1e-9);
        assert_close("std", filter.belief().covariance(), &matrix(&std["P_prior"]), 1e-9);
        let outcome = filter.update(&z).unwrap();
        assert!(outcome.manoeuvre);
        assert_near("nis", outcome.innovation.nis(), number(&data["nis"]), 1e-9);
        assert_close(name, filter.belief().mean(), belief.mean(), 1e-12);
    }
    // Below the threshold it is the plain filter.
    let params = Zhu2014Params { threshold: 1e9, ..Zhu2014Params::jump_anywhere() };
    let mut filter = HalfIntervalFilter::new(params, before).unwrap();
    filter.predict(dt).unwrap();
    assert!(!filter.update(&z).unwrap().manoeuvre);
    assert_close("std", filter.belief().mean(), &vector(&data["variants"]["std"]["x_post"]), 1e-9);
}

/// Equation (6) taken at its word is no change at all.
#[test]
fn zhu2014_two_half_transitions_are_one() {
    let model = pursuit_estimation::motion::ConstantVelocity::<2>::per_step(1.0);
    for dt in [1e-3, 1.0 / 30.0, 1.0, 17.0] {
        let half = model.over(dt / 2.0).unwrap();
        assert_close("A", &(half.matrix() * half.matrix()), model.over(dt).unwrap().matrix(), 1e-12);
    }
}

#[test]
fn qu2010_simulation() {
    let data = fixture("seed001_simulation");
    let params = Qu2010Params::printed();
    let step = params.motion().over(1.0).unwrap();
    assert_close("F", step.matrix(), &matrix(&data["F"]), 1e-12);
    assert_close("Q", step.noise(), &matrix(&data["Q"]), 1e-12);
    let sensor = params.measurement().unwrap();
    for run in list(&data["sims"]) {
        let mut belief = Gaussian::<6>::new(vector(&data["x0"]), matrix(&data["P0"])).unwrap();
        let mut squares = [[0.0; 2]; 3];
        let steps = list(&run["z"]).len();
        for k in 0..steps {
            let (z, truth) = (vector::<2>(&run["z"][k]), vector::<6>(&run["truth"][k]));
            belief.predict(&step).unwrap();
            assert_close("x prior", belief.mean(), &vector(&run["x_prior"][k]), 1e-9);
            let prior = *belief.mean();
            belief.update(&sensor, &z).unwrap();
            assert_close("x post", belief.mean(), &vector(&run["x_post"][k]), 1e-9);
            for axis in 0..2 {
                squares[0][axis] += (z[axis] - truth[axis]).powi(2);
                squares[1][axis] += (prior[axis] - truth[axis]).powi(2);
                squares[2][axis] += (belief.mean()[axis] - truth[axis]).powi(2);
            }
        }
        for (sums, name) in squares.iter().zip(["rmse_meas_xy", "rmse_pred_xy", "rmse_filt_xy"]) {
            for axis in 0..2 {
                assert_near(name, (sums[axis] / steps as f64).sqrt(), number(&run[name][axis]), 1e-9);
            }
        }
    }
}

#[test]
fn qu2010_extrapolation() {
    let data = fixture("seed001_degenerate");
    let x = numbers(&data["x"]);
    for (points, name) in [(Points::Two, "linear_pred"), (Points::Three, "quadratic_pred")] {
        let mut extrapolator = Extrapolator::new(points);
        for (k, x) in x.iter().enumerate() {
            let predicted = extrapolator.predict(k as f64 / 25.0).map(|position| position[0]);
            assert_eq!(predicted.is_none(), data[name][k].is_null(), "{name} {k}");
            if let Some(predicted) = predicted {
                assert_near(name, predicted, number(&data[name][k]), 1e-9);
            }
            extrapolator.observe(k as f64 / 25.0, &SVector::from([*x, 0.0])).unwrap();
        }
        let before = extrapolator;
        assert!(extrapolator.observe(0.0, &SVector::from([0.0, 0.0])).is_err());
        assert_eq!(extrapolator, before);
    }
    // Table 1: both axes of the rows that the two-point rule gives, rounded as printed.
    let mut extrapolator = Extrapolator::new(Points::Two);
    for (k, (x, y)) in [(12.0, 119.0), (16.0, 116.0), (34.0, 120.0), (59.0, 113.0)].into_iter().enumerate() {
        if k >= 2 {
            let printed = &data["table1"]["predicted"][k - 2];
            let predicted = extrapolator.predict(k as f64).unwrap();
            assert_eq!((predicted[0], predicted[1]), (number(&printed[0]), number(&printed[1])));
        }
        extrapolator.observe(k as f64, &SVector::from([x, y])).unwrap();
    }
}

/// Without measurement noise, the limits of section 5.
#[test]
fn qu2010_degenerate_gains() {
    let data = fixture("seed001_degenerate");
    let gains = &data["gains_R0"];
    fn check<const N: usize>(noise: SMatrix<f64, N, N>, expected: &Value) {
        let matrix = SMatrix::<f64, N, N>::from_fn(|i, j| match j.wrapping_sub(i) {
            0 | 1 => 1.0,
            2 => 0.5,
            _ => 0.0,
        });
        let step = Transition::new(matrix, noise).unwrap();
        let sensor = LinearMeasurement::<1, N>::select([0], [0.0]).unwrap();
        let steady = SteadyState::solve(&step, &sensor).unwrap();
        assert_close("K", &steady.gain, &vector(expected), 1e-9);
    }
    check::<2>(SMatrix::identity(), &gains["CV_QI"]);
    check::<3>(SMatrix::identity(), &gains["CA_QI"]);
    check::<2>(SMatrix::from_diagonal(&SVector::from([0.0, 1.0])), &gains["CV_velocity_noise_only"]);
    let direction = SVector::from([0.0, -0.5, 1.0]);
    check::<3>(direction * direction.transpose(), &gains["CA_deadbeat"]);
}

#[test]
fn zhai2024_variance() {
    let data = fixture("mle_variance");
    for (name, rule) in [
        ("correct", VarianceRule::Corrected),
        ("batch", VarianceRule::Corrected),
        ("as_printed", VarianceRule::Printed),
        ("ema02", VarianceRule::Exponential { weight: 0.2 }),
        ("window10", VarianceRule::Window { length: 10 }),
    ] {
        let mut estimate = VarianceEstimate::new(VarianceParams::unbounded(rule)).unwrap();
        for (residual, expected) in list(&data["residuals"]).iter().zip(list(&data[name])) {
            let variance = estimate.observe(&vector::<2>(residual)).unwrap();
            assert_close(name, &variance, &vector(expected), 1e-12);
        }
    }
    let bounded = VarianceParams::for_target(20.0);
    let mut estimate = VarianceEstimate::<1>::new(bounded).unwrap();
    assert_eq!(estimate.variance()[0], 1.0);
    assert_eq!(estimate.observe(&SVector::<f64, 1>::new(1e3)).unwrap()[0], 100.0);
    assert!(estimate.observe(&SVector::<f64, 1>::new(f64::NAN)).is_err());
    assert_eq!(estimate.count(), 1);
}

/// The printed recursion grows as `(k − 1) / 2` times the true variance: with residuals of size one, exactly.
#[test]
fn zhai2024_printed_recursion_diverges() {
    let mut printed = VarianceEstimate::new(VarianceParams::unbounded(VarianceRule::Printed)).unwrap();
    for k in 1..=1000 {
        let variance = printed.observe(&SVector::<f64, 1>::new(if k % 2 == 0 { 1.0 } else { -1.0 })).unwrap();
        assert_near("s_k", variance[0], (f64::from(k) - 1.0) / 2.0, 1e-12);
    }
}
