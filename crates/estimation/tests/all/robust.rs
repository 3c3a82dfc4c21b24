//! Robust corrections: what they settle on, and what outliers do to them.

use crate::common::assert_close;
use nalgebra::{SMatrix, SVector, matrix, vector};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, MotionModel};

fn belief() -> Gaussian<4> {
    let mut it = Gaussian::new(vector![1.0, 2.0, 0.3, 0.4], SMatrix::identity() * 2.0).unwrap();
    it.predict(&ConstantVelocity::<2>::white(1.0).over(0.5).unwrap()).unwrap();
    it
}

fn sensor() -> LinearMeasurement<2, 4> {
    let direct = LinearMeasurement::select([0, 1], [0.5, 1.5]).unwrap();
    direct.with_noise(matrix![0.5, 0.2; 0.2, 1.5]).unwrap()
}

#[test]
fn the_weight_is_the_fixed_point() {
    for z in [vector![1.2, 2.1], vector![4.0, -1.0], vector![30.0, 50.0], vector![-1e4, 3.0]] {
        for degrees in [0.5, 3.0, 30.0] {
            let mut robust = belief();
            let found = robust.update_robust(&sensor(), &z, degrees).unwrap();
            // The state is the plain correction with R / λ, and λ agrees with that state.
            let mut plain = belief();
            plain.update(&sensor().with_noise(sensor().noise() / found.weight).unwrap(), &z).unwrap();
            assert_close("mean", robust.mean(), plain.mean(), 1e-7);
            assert_close("covariance", robust.covariance(), plain.covariance(), 1e-7);
            let (h, r) = (sensor().matrix().clone_owned(), sensor().noise().try_inverse().unwrap());
            let left = z - h * robust.mean();
            let expected = (left * left.transpose() + h * robust.covariance() * h.transpose()) * r;
            let weight = (degrees + 2.0) / (degrees + expected.trace());
            assert!((weight / found.weight - 1.0).abs() < 1e-7, "{weight} {}", found.weight);
            assert_eq!(found.innovation, belief().innovation(&sensor(), &z).unwrap());
        }
    }
}

#[test]
fn many_degrees_are_the_plain_update() {
    let z = vector![3.0, 1.0];
    let (mut robust, mut plain) = (belief(), belief());
    let found = robust.update_robust(&sensor(), &z, 1e9).unwrap();
    plain.update(&sensor(), &z).unwrap();
    assert!((found.weight - 1.0).abs() < 1e-7);
    assert_close("mean", robust.mean(), plain.mean(), 1e-7);
    assert_close("covariance", robust.covariance(), plain.covariance(), 1e-7);
}

#[test]
fn the_farther_off_the_less_believed() {
    let moved = |z: f64| {
        let mut it = belief();
        let weight = it.update_robust(&sensor(), &vector![1.15 + z, 2.2], 3.0).unwrap().weight;
        (it.mean()[0] - belief().mean()[0], weight)
    };
    let (near, far, absurd) = (moved(2.0), moved(60.0), moved(1e6));
    assert!(near.1 > far.1 && far.1 > absurd.1, "{near:?} {far:?} {absurd:?}");
    assert!(near.0 > 1.0 && far.0 < 3.0 && absurd.0.abs() < 1e-3, "{near:?} {far:?} {absurd:?}");
}

/// One measurement in ten is of something else.
#[test]
fn outliers_cost_little() {
    let step = ConstantVelocity::<2>::white(0.1).over(1.0).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let (mut robust, mut plain) = (belief(), belief());
    let mut errors = [0.0; 2];
    for k in 1..200_i32 {
        let truth = vector![1.0 + 0.3 * f64::from(k), 2.0 + 0.4 * f64::from(k)];
        let wobble = vector![(1.7 * f64::from(k)).sin(), (2.3 * f64::from(k)).cos()];
        let z = truth + if k % 10 == 7 { vector![60.0, -40.0] } else { wobble };
        for (which, belief) in [&mut robust, &mut plain].into_iter().enumerate() {
            belief.predict(&step).unwrap();
            if which == 0 {
                belief.update_robust(&sensor, &z, 4.0).unwrap();
            } else {
                belief.update(&sensor, &z).unwrap();
            }
            errors[which] += (belief.mean().fixed_rows::<2>(0) - truth).norm_squared();
        }
    }
    assert!(errors[0] < 0.01 * errors[1], "{errors:?}");
}

#[test]
fn bad_input_changes_nothing() {
    let mut it = belief();
    for degrees in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            it.update_robust(&sensor(), &vector![0.0, 0.0], degrees),
            Err(EstimationError::Parameter { .. })
        ));
    }
    let z = vector![f64::NAN, 0.0];
    assert!(matches!(it.update_robust(&sensor(), &z, 3.0), Err(EstimationError::NotFinite { .. })));
    let perfect = LinearMeasurement::<2, 4>::select([0, 1], [0.0, 0.0]).unwrap();
    let z: SVector<f64, 2> = vector![0.0, 0.0];
    assert!(matches!(it.update_robust(&perfect, &z, 3.0), Err(EstimationError::NotPositive { .. })));
    let far = it.update_robust(&sensor(), &vector![1e200, 0.0], 3.0);
    assert!(matches!(far, Err(EstimationError::Overflow { .. })), "{far:?}");
    assert_eq!(it, belief());
}
