//! Bad input is a typed error that leaves the belief as it was.

use nalgebra::{SMatrix, SVector, matrix, vector};
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, Transition};

fn belief() -> Gaussian<2> {
    Gaussian::new(vector![1.0, 2.0], matrix![2.0, 0.5; 0.5, 1.0]).unwrap()
}

#[test]
fn measurement_that_is_not_finite() {
    let sensor = LinearMeasurement::<1, 2>::select([0], [1.0]).unwrap();
    for z in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut it = belief();
        assert!(matches!(it.update(&sensor, &vector![z]), Err(EstimationError::NotFinite { .. })));
        assert_eq!(it, belief());
    }
}

#[test]
fn singular_innovation() {
    // The same component read twice by perfect sensors.
    let sensor = LinearMeasurement::<2, 2>::select([0, 0], [0.0, 0.0]).unwrap();
    let mut it = belief();
    let result = it.update(&sensor, &vector![1.0, 1.0]);
    assert!(matches!(result, Err(EstimationError::SingularInnovation { row: 1, .. })), "{result:?}");
    assert_eq!(it, belief());
}

#[test]
fn covariance_that_is_not_positive_definite() {
    let x = vector![0.0, 0.0];
    let not_positive = Gaussian::new(x, matrix![1.0, 2.0; 2.0, 1.0]);
    assert!(matches!(not_positive, Err(EstimationError::NotPositive { .. })));
    assert!(matches!(Gaussian::new(x, SMatrix::zeros()), Err(EstimationError::NotPositive { .. })));
    let lopsided = Gaussian::new(x, matrix![1.0, 0.1; 0.2, 1.0]);
    assert!(matches!(lopsided, Err(EstimationError::NotSymmetric { .. })));
    assert!(matches!(
        Gaussian::new(vector![f64::NAN, 0.0], SMatrix::identity()),
        Err(EstimationError::NotFinite { .. })
    ));
    assert!(Transition::new(SMatrix::<f64, 2, 2>::identity(), matrix![1.0, 2.0; 2.0, 1.0]).is_err());
    let beyond = LinearMeasurement::<1, 2>::select([2], [1.0]);
    assert!(matches!(beyond, Err(EstimationError::Index { index: 2, length: 2, .. })), "{beyond:?}");
    assert!(LinearMeasurement::<1, 2>::select([0], [-1.0]).is_err());
}

#[test]
fn overflow_in_a_prediction() {
    let mut it = Gaussian::from_variances(vector![1e200, 0.0], vector![1e200, 1.0]).unwrap();
    let before = it;
    let blow = Transition::new(SMatrix::<f64, 2, 2>::identity() * 1e200, SMatrix::zeros()).unwrap();
    assert!(matches!(it.predict(&blow), Err(EstimationError::Overflow { .. })));
    assert_eq!(it, before);
}

#[test]
fn stored_beliefs_are_checked_when_read() {
    let text = serde_json::to_string(&belief()).unwrap();
    assert_eq!(serde_json::from_str::<Gaussian<2>>(&text).unwrap(), belief());
    let broken = text.replace("2.0,0.5", "2.0,-9.5");
    assert_ne!(broken, text);
    assert!(serde_json::from_str::<Gaussian<2>>(&broken).is_err());
}

#[test]
fn nees_of_the_mean_is_zero_and_grows_with_distance() {
    let it = belief();
    assert_eq!(it.nees(it.mean()).unwrap(), 0.0);
    assert!((it.nees(&(it.mean() + SVector::from([0.0, 2.0]))).unwrap() - 4.0 * 2.0 / 1.75).abs() < 1e-12);
}
