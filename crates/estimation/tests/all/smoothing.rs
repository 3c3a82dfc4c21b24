//! Extended, unscented and fixed-lag smoothing, against the textbook's equations.

use crate::common::assert_close;
use nalgebra::{SMatrix, SVector, vector};
use pursuit_estimation::filters::{FixedLag, smooth, smooth_extended, smooth_unscented};
use pursuit_estimation::motion::{ConstantVelocity, CoordinatedTurn};
use pursuit_estimation::nonlinear::{LinearizedMotion, NonlinearMotion, Unscented};
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, MotionModel, Transition};

const TURN: CoordinatedTurn = CoordinatedTurn { acceleration_density: 0.5, turn_density: 0.02 };

fn position() -> LinearMeasurement<2, 5> {
    LinearMeasurement::select([0, 1], [1.0, 2.0]).unwrap()
}

/// A circle with a wobble, at uneven times.
fn readings() -> Vec<(f64, SVector<f64, 2>)> {
    (1..30)
        .map(|k| {
            let t = 0.3 * f64::from(k);
            let wobble = vector![(7.0 * t).sin(), (5.0 * t).cos()] * 0.8;
            (0.25 + 0.1 * f64::from(k % 3), vector![20.0 * (0.3 * t).sin(), 20.0 * (1.0 - (0.3 * t).cos())] + wobble)
        })
        .collect()
}

fn start() -> Gaussian<5> {
    Gaussian::from_variances(vector![0.0, 0.0, 5.0, 0.0, 0.2], vector![2.0, 2.0, 4.0, 4.0, 0.04]).unwrap()
}

/// The filtered run: by slopes, or by points of this shape.
fn filtered(shape: Option<&Unscented>) -> (Vec<Gaussian<5>>, Vec<f64>) {
    let (mut belief, mut out, mut dts) = (start(), vec![start()], vec![]);
    for (dt_s, z) in readings() {
        match shape {
            None => belief.predict_extended(&TURN, dt_s).unwrap(),
            Some(shape) => drop(belief.predict_unscented(&TURN, dt_s, shape).unwrap()),
        }
        belief.update(&position(), &z).unwrap();
        out.push(belief);
        dts.push(dt_s);
    }
    (out, dts)
}

#[test]
fn extended_follows_the_textbook() {
    let (run, dts) = filtered(None);
    let mut ours = run.clone();
    smooth_extended(&mut ours, &TURN, &dts).unwrap();
    // Särkkä 2013, algorithm 9.1, as printed.
    let (mut m, mut p) = (*run[run.len() - 1].mean(), *run[run.len() - 1].covariance());
    for k in (0..dts.len()).rev() {
        let f = TURN.jacobian(run[k].mean(), dts[k]);
        let ahead = TURN.advance(run[k].mean(), dts[k]);
        let p_ahead = f * run[k].covariance() * f.transpose() + TURN.noise(run[k].mean(), dts[k]);
        let g = run[k].covariance() * f.transpose() * p_ahead.try_inverse().unwrap();
        (m, p) = (run[k].mean() + g * (m - ahead), run[k].covariance() + g * (p - p_ahead) * g.transpose());
        assert_close("mean", ours[k].mean(), &m, 1e-9);
        assert_close("covariance", ours[k].covariance(), &p, 1e-9);
    }
    assert!(ours[3].covariance()[(0, 0)] < 0.7 * run[3].covariance()[(0, 0)]);
    assert_eq!(ours.last(), run.last());
}

#[test]
fn unscented_follows_the_textbook() {
    for alpha in [0.5, 1.0] {
        let shape = Unscented { alpha, ..Unscented::default() };
        let (run, dts) = filtered(Some(&shape));
        let mut ours = run.clone();
        smooth_unscented(&mut ours, &TURN, &dts, &shape).unwrap();
        // Särkkä 2008 (Särkkä 2013, algorithm 9.3), with the weights written out.
        let spread = alpha * alpha * 5.0;
        let (w_other, w_mean) = (0.5 / spread, (spread - 5.0) / spread);
        let w_centre = w_mean + 1.0 - alpha * alpha + shape.beta;
        let (mut m, mut p) = (*run[run.len() - 1].mean(), *run[run.len() - 1].covariance());
        for k in (0..dts.len()).rev() {
            let points = shape.points(&run[k]).unwrap();
            let all: Vec<_> = std::iter::once(points.centre).chain(points.ahead).chain(points.behind).collect();
            let moved: Vec<_> = all.iter().map(|x| TURN.advance(x, dts[k])).collect();
            let weight = |i: usize, first: f64| if i == 0 { first } else { w_other };
            let ahead: SVector<f64, 5> = moved.iter().enumerate().map(|(i, y)| y * weight(i, w_mean)).sum();
            let mut p_ahead = TURN.noise(run[k].mean(), dts[k]);
            let mut d = SMatrix::<f64, 5, 5>::zeros();
            for (i, (x, y)) in all.iter().zip(&moved).enumerate() {
                p_ahead += (y - ahead) * (y - ahead).transpose() * weight(i, w_centre);
                d += (x - run[k].mean()) * (y - ahead).transpose() * weight(i, w_centre);
            }
            let g = d * p_ahead.try_inverse().unwrap();
            (m, p) = (run[k].mean() + g * (m - ahead), run[k].covariance() + g * (p - p_ahead) * g.transpose());
            assert_close("mean", ours[k].mean(), &m, 1e-8);
            assert_close("covariance", ours[k].covariance(), &p, 1e-8);
        }
    }
}

#[test]
fn the_affine_step_is_the_prediction() {
    let belief = start();
    let by_slope = belief.linearized_extended(&TURN, 0.7).unwrap();
    let mut expected = belief;
    expected.predict_extended(&TURN, 0.7).unwrap();
    let found = belief.predicted(&by_slope).unwrap();
    assert_close("mean", found.mean(), expected.mean(), 1e-13);
    assert_close("covariance", found.covariance(), expected.covariance(), 1e-12);
    let shape = Unscented::default();
    let by_points = belief.linearized_unscented(&TURN, 0.7, &shape).unwrap();
    let mut expected = belief;
    expected.predict_unscented(&TURN, 0.7, &shape).unwrap();
    let found = belief.predicted(&by_points).unwrap();
    assert_close("mean", found.mean(), expected.mean(), 1e-12);
    assert_close("covariance", found.covariance(), expected.covariance(), 1e-12);
    assert!(by_points.noise()[(0, 0)] > TURN.noise(belief.mean(), 0.7)[(0, 0)]);
    for dt_s in [0.0, -1.0, f64::NAN] {
        assert!(matches!(belief.linearized_extended(&TURN, dt_s), Err(EstimationError::TimeStep { .. })));
        assert!(matches!(belief.linearized_unscented(&TURN, dt_s, &shape), Err(EstimationError::TimeStep { .. })));
    }
}

#[test]
fn runs_of_another_length_are_refused() {
    let (mut run, mut dts) = filtered(None);
    let before = run.clone();
    dts.push(0.1);
    let shape = Unscented::default();
    for result in [smooth_extended(&mut run, &TURN, &dts), smooth_unscented(&mut run, &TURN, &dts, &shape)] {
        assert!(matches!(result, Err(EstimationError::Length { got: 30, expected: 29, .. })), "{result:?}");
    }
    dts.pop();
    dts[5] = f64::NAN;
    assert!(smooth_extended(&mut run, &TURN, &dts).is_err());
    assert!(smooth_unscented(&mut run, &TURN, &dts, &shape).is_err());
    assert_eq!(run, before);
}

/// At every step the lagged belief is that of the whole smoother, given the data so far.
#[test]
fn fixed_lag_is_the_smoother_of_the_data_so_far() {
    let model = ConstantVelocity::<2>::white(0.8);
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 2.0]).unwrap();
    let start = Gaussian::from_variances(SVector::zeros(), SVector::<f64, 4>::repeat(9.0)).unwrap();
    for lag in [1, 2, 5, 40] {
        let mut lagged = FixedLag::new(lag, start).unwrap();
        let (mut beliefs, mut steps, mut belief): (Vec<_>, Vec<Transition<4>>, _) = (vec![start], vec![], start);
        for (k, (dt_s, z)) in readings().into_iter().enumerate() {
            let step = model.over(dt_s).unwrap();
            belief.predict(&step).unwrap();
            // A gap now and then.
            if k % 5 != 4 {
                belief.update(&sensor, &z).unwrap();
            }
            beliefs.push(belief);
            steps.push(step);
            let found = lagged.push(&step, &belief).unwrap();
            let mut whole = beliefs.clone();
            smooth(&mut whole, &steps).unwrap();
            assert_eq!(found.is_some(), k + 1 >= lag);
            if let Some(found) = found {
                assert_close("mean", found.mean(), whole[k + 1 - lag].mean(), 1e-12);
                assert_close("covariance", found.covariance(), whole[k + 1 - lag].covariance(), 1e-12);
            }
            let rest = lagged.finish().unwrap();
            let from = if k + 1 >= lag { k + 2 - lag } else { 0 };
            assert_eq!(rest.len(), whole.len() - from);
            for (found, expected) in rest.iter().zip(&whole[from..]) {
                assert_close("rest", found.mean(), expected.mean(), 1e-12);
                assert_close("rest", found.covariance(), expected.covariance(), 1e-12);
            }
        }
    }
    assert!(FixedLag::new(0, start).is_err());
    assert!(FixedLag::new(4097, start).is_err());
    // A step that cannot be gone back over is not taken in.
    let mut lagged = FixedLag::new(1, start).unwrap();
    let stuck = Transition::new(SMatrix::<f64, 4, 4>::zeros(), SMatrix::zeros()).unwrap();
    let before = lagged.clone();
    assert!(matches!(lagged.push(&stuck, &start), Err(EstimationError::NotPositive { .. })));
    assert_eq!(lagged, before);
}
