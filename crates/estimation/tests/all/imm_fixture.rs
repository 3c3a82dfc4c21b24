//! The interacting multiple model estimator against the independent reference.

use crate::common::{assert_close, assert_near, fixture, list, matrix, number, vector};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, Switching, Transition};

const TOLERANCE: f64 = 1e-9;

#[test]
fn constant_velocity_and_acceleration() {
    let data = fixture("imm_cv_ca");
    let transitions: [Transition<3>; 2] =
        std::array::from_fn(|i| Transition::new(matrix(&data["F"][i]), matrix(&data["Q"][i])).unwrap());
    let sensor = LinearMeasurement::<1, 3>::new(matrix(&data["H"]), matrix(&data["R"])).unwrap();
    let switching = Switching::per_step(matrix::<2, 2>(&data["Pi"])).unwrap();
    let start = Gaussian::new(vector(&data["x0"]), matrix(&data["P0"])).unwrap();
    let mut imm = Imm::new(start, vector::<2>(&data["mu0"]).into()).unwrap();
    for (k, step) in list(&data["steps"]).iter().enumerate() {
        imm.predict(&transitions, &switching).unwrap();
        assert_close("c", imm.probabilities(), &vector(&step["c"]), TOLERANCE);
        assert_close("x prior", imm.combined().mean(), &vector(&step["x_prior"]), TOLERANCE);
        let z = SVector::<f64, 1>::new(number(&data["z"][k][0]));
        for (innovation, expected) in imm.innovations(&sensor, &z).unwrap().iter().zip(list(&step["likelihood"])) {
            assert_near("likelihood", innovation.log_likelihood().exp(), number(expected), TOLERANCE);
        }
        let predicted = *imm.probabilities();
        let evidence = imm.update(&sensor, &z).unwrap();
        let direct: f64 = (0..2).map(|j| predicted[j] * number(&step["likelihood"][j])).sum();
        assert_near("evidence", evidence, direct.ln(), TOLERANCE);
        assert_close("mu", imm.probabilities(), &vector(&step["mu"]), TOLERANCE);
        assert_close("x", imm.combined().mean(), &vector(&step["x"]), TOLERANCE);
        assert_close("P", imm.combined().covariance(), &matrix(&step["P"]), TOLERANCE);
        for j in 0..2 {
            assert_close("x_j", imm.beliefs()[j].mean(), &vector(&step["x_models"][j]), TOLERANCE);
            assert_close("P_j", imm.beliefs()[j].covariance(), &matrix(&step["P_models"][j]), TOLERANCE);
        }
    }
}

#[test]
fn a_measurement_no_mode_expects_leaves_probabilities_finite() {
    let start = Gaussian::new(SVector::<f64, 1>::zeros(), SMatrix::identity()).unwrap();
    let mut imm = Imm::new(start, [0.5, 0.5]).unwrap();
    let still = |q: f64| Transition::new(SMatrix::identity(), SMatrix::<f64, 1, 1>::new(q)).unwrap();
    let switching = Switching::per_step(SMatrix::<f64, 2, 2>::new(0.9, 0.1, 0.1, 0.9)).unwrap();
    let sensor = LinearMeasurement::<1, 1>::select([0], [1.0]).unwrap();
    imm.predict(&[still(0.1), still(10.0)], &switching).unwrap();
    imm.update(&sensor, &SVector::<f64, 1>::new(1e6)).unwrap();
    assert!((imm.probabilities().sum() - 1.0).abs() < 1e-12);
    assert!(imm.probabilities()[1] > 0.999);
    let before = imm;
    assert!(imm.update(&sensor, &SVector::<f64, 1>::new(f64::NAN)).is_err());
    assert_eq!(imm, before);
}

#[test]
fn survives_a_round_trip_through_json() {
    let start = Gaussian::new(SVector::<f64, 2>::new(1.0, 2.0), SMatrix::identity()).unwrap();
    let imm = Imm::new(start, [0.25, 0.75]).unwrap();
    let text = serde_json::to_string(&imm).unwrap();
    assert_eq!(serde_json::from_str::<Imm<2, 2>>(&text).unwrap(), imm);
    assert!(serde_json::from_str::<Imm<2, 3>>(&text).is_err());
}
