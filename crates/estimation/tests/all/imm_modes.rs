//! Interacting modes of unequal size and of nonlinear motion, against plain references.

use crate::common::{assert_close, assert_near};
use nalgebra::{SMatrix, SVector, vector};
use pursuit_estimation::motion::{
    ConstantAcceleration, ConstantVelocity, CoordinatedTurn, CurrentStatistical, KnownTurn, Singer,
};
use pursuit_estimation::nonlinear::{LinearizedSensor, NonlinearSensor, Unscented};
use pursuit_estimation::{
    Embedded, EstimationError, Extended, Gaussian, Imm, LinearMeasurement, Mode, MotionModel, Sojourn, Switching,
    Transition, UnscentedMode,
};

const DT_S: f64 = 0.2;

fn full<const N: usize>(seed: f64) -> Gaussian<N> {
    let mix = SMatrix::<f64, N, N>::from_fn(|r, c| (seed + 1.7 * r as f64 + 0.9 * (c * c) as f64).sin());
    let covariance = mix * mix.transpose() + SMatrix::identity() * 0.05;
    Gaussian::new(SVector::from_fn(|r, _| seed + r as f64), (covariance + covariance.transpose()) * 0.5).unwrap()
}

fn switching() -> Switching<2> {
    Switching::per_step(SMatrix::<f64, 2, 2>::new(0.9, 0.1, 0.25, 0.75)).unwrap()
}

/// The mixture of two, written out.
fn mixed<const N: usize>(
    a: (&SVector<f64, N>, &SMatrix<f64, N, N>),
    b: (&SVector<f64, N>, &SMatrix<f64, N, N>),
    w: [f64; 2],
) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
    let mean = a.0 * w[0] + b.0 * w[1];
    let (da, db) = (a.0 - mean, b.0 - mean);
    (mean, (a.1 + da * da.transpose()) * w[0] + (b.1 + db * db.transpose()) * w[1])
}

#[test]
fn modes_of_one_size_are_as_transitions() {
    let models = [ConstantVelocity::<2>::white(0.1), ConstantVelocity::<2>::white(9.0)];
    let mut by_modes = Imm::from_beliefs([full::<4>(0.3), full::<4>(1.1)], [0.3, 0.7]).unwrap();
    let mut by_transitions = by_modes;
    by_modes.predict_modes(&[&models[0], &models[1]], &switching(), DT_S).unwrap();
    by_transitions.predict(&models.map(|m| m.over(DT_S).unwrap()), &switching()).unwrap();
    assert_eq!(by_modes, by_transitions);
}

#[test]
fn an_embedded_transition_moves_its_part_and_forgets_the_rest() {
    let small = KnownTurn { rate_rad_per_s: 0.7, acceleration_density: 2.0 }.over(DT_S).unwrap();
    let small = small.with_offset(vector![1.0, 2.0, 3.0, 4.0]).unwrap();
    let at = [4, 1, 0, 3];
    let rest = SVector::<f64, 6>::from_fn(|r, _| 10.0 + r as f64);
    let large = small.embedded(at, &rest).unwrap();
    for r in 0..4 {
        assert_eq!(large.offset()[at[r]], small.offset()[r]);
        for c in 0..4 {
            assert_eq!(large.matrix()[(at[r], at[c])], small.matrix()[(r, c)]);
            assert_eq!(large.noise()[(at[r], at[c])], small.noise()[(r, c)]);
        }
    }
    for other in [2, 5] {
        assert!(large.matrix().row(other).iter().chain(large.matrix().column(other).iter()).all(|v| *v == 0.0));
        assert_eq!(large.noise()[(other, other)], rest[other]);
        assert_eq!(large.offset()[other], 0.0);
    }
    // The same as a mode.
    struct Given(Transition<4>);
    impl MotionModel<4> for Given {
        fn over(&self, _: f64) -> pursuit_estimation::Result<Transition<4>> {
            Ok(self.0)
        }
    }
    let mode = Embedded::new(Given(small), at, rest).unwrap();
    assert_eq!(Mode::<6>::holds(&mode), [true, true, false, true, true, false]);
    let belief = full::<6>(0.4);
    let (a, b) = (mode.predict(&belief, DT_S).unwrap(), belief.predicted(&large).unwrap());
    assert_close("mean", a.mean(), b.mean(), 1e-13);
    assert_close("covariance", a.covariance(), b.covariance(), 1e-13);
}

#[test]
fn embeddings_that_are_none_are_refused() {
    let model = ConstantVelocity::<1>::white(1.0);
    let rest = SVector::<f64, 3>::repeat(1.0);
    assert!(matches!(Embedded::new(model, [0, 3], rest), Err(EstimationError::Index { index: 3, length: 3, .. })));
    assert!(matches!(Embedded::new(model, [1, 1], rest), Err(EstimationError::Parameter { .. })));
    assert!(matches!(Embedded::new(model, [0, 1], -rest), Err(EstimationError::Parameter { .. })));
    let step = model.over(1.0).unwrap();
    assert!(step.embedded([0, 3], &rest).is_err());
    assert!(step.embedded([0, 0], &rest).is_err());
    assert!(step.embedded([0, 1], &-rest).is_err());
}

/// One step of unbiased mixing by hand: what the small mode lacks comes from the large one in the large one's mixture.
#[test]
fn what_a_small_mode_lacks_is_not_asked_of_it() {
    let small = Embedded::new(ConstantVelocity::<1>::white(0.1), [0, 1], vector![0.0, 0.0, 5.0]).unwrap();
    let large = ConstantAcceleration::<1>::white(2.0);
    let (a, b) = (full::<3>(0.2), full::<3>(0.9));
    let mu = [0.4, 0.6];
    let mut imm = Imm::from_beliefs([a, b], mu).unwrap();
    imm.predict_modes(&[&small, &large], &switching(), DT_S).unwrap();
    let chances = [[0.9, 0.1], [0.25, 0.75]];
    let c = [0, 1].map(|j| chances[0][j] * mu[0] + chances[1][j] * mu[1]);
    assert_close("c", imm.probabilities(), &SVector::from(c), 1e-14);
    let weights = |j: usize| [chances[0][j] * mu[0] / c[j], chances[1][j] * mu[1] / c[j]];

    // The large mode: a with its acceleration from b, uncorrelated.
    let (mut mean, mut covariance) = (*a.mean(), *a.covariance());
    mean[2] = b.mean()[2];
    covariance.row_mut(2).fill(0.0);
    covariance.column_mut(2).fill(0.0);
    covariance[(2, 2)] = b.covariance()[(2, 2)];
    let (mean, covariance) = mixed((&mean, &covariance), (b.mean(), b.covariance()), weights(1));
    let step = large.over(DT_S).unwrap();
    assert_close("large mean", imm.beliefs()[1].mean(), &(step.matrix() * mean), 1e-13);
    let expected = step.matrix() * covariance * step.matrix().transpose() + step.noise();
    assert_close("large covariance", imm.beliefs()[1].covariance(), &expected, 1e-13);

    // The small mode: positions and velocities of both.
    let (mean, covariance) = mixed((a.mean(), a.covariance()), (b.mean(), b.covariance()), weights(0));
    let step = ConstantVelocity::<1>::white(0.1).over(DT_S).unwrap();
    let two = step.matrix() * mean.fixed_rows::<2>(0);
    assert_close("small mean", imm.beliefs()[0].mean(), &vector![two[0], two[1], 0.0], 1e-13);
    let block = step.matrix() * covariance.fixed_view::<2, 2>(0, 0) * step.matrix().transpose() + step.noise();
    assert_close(
        "small covariance",
        &imm.beliefs()[0].covariance().fixed_view::<2, 2>(0, 0).into_owned(),
        &block,
        1e-13,
    );
    assert_eq!(imm.beliefs()[0].covariance()[(2, 2)], 5.0);
    assert_eq!(imm.beliefs()[0].covariance()[(0, 2)], 0.0);
}

/// On a target that accelerates steadily the plain mixture with zeros pulls the acceleration down; this one does not.
#[test]
fn an_acceleration_is_not_pulled_to_zero() {
    let (cv, ca) = (ConstantVelocity::<1>::white(1.0), ConstantAcceleration::<1>::white(1e-3));
    let sensor = LinearMeasurement::<1, 3>::select([0], [0.04]).unwrap();
    let start = Gaussian::from_variances(vector![0.0, 0.0, 0.0], vector![1.0, 10.0, 10.0]).unwrap();
    let embedded = Embedded::new(cv, [0, 1], vector![0.0, 0.0, 0.01]).unwrap();
    let (mut unbiased, mut zeros) = (Imm::new(start, [0.5, 0.5]).unwrap(), Imm::new(start, [0.5, 0.5]).unwrap());
    let even = Switching::per_step(SMatrix::<f64, 2, 2>::new(0.95, 0.05, 0.05, 0.95)).unwrap();
    let steps = [cv.over(DT_S).unwrap().embedded([0, 1], &vector![0.0, 0.0, 0.01]).unwrap(), ca.over(DT_S).unwrap()];
    for k in 1..80 {
        let z = SVector::<f64, 1>::new(0.5 * 2.0 * (f64::from(k) * DT_S).powi(2));
        unbiased.predict_modes(&[&embedded, &ca], &even, DT_S).unwrap();
        unbiased.update(&sensor, &z).unwrap();
        zeros.predict(&steps, &even).unwrap();
        zeros.update(&sensor, &z).unwrap();
    }
    let [found, pulled] = [unbiased, zeros].map(|imm| imm.beliefs()[1].mean()[2]);
    println!("{found} {pulled}");
    assert!((found - 2.0).abs() < 0.1, "{found}");
    assert!((pulled - 2.0).abs() > 3.0 * (found - 2.0).abs(), "{pulled}, {found}");
}

struct Range(f64);

impl NonlinearSensor<2, 5> for Range {
    fn expected(&self, state: &SVector<f64, 5>) -> SVector<f64, 2> {
        vector![state[0].hypot(state[1]), state[1].atan2(state[0])]
    }

    fn noise(&self) -> SMatrix<f64, 2, 2> {
        SMatrix::from_diagonal(&vector![1.0, 1e-4]) * self.0
    }
}

impl LinearizedSensor<2, 5> for Range {
    fn jacobian(&self, s: &SVector<f64, 5>) -> SMatrix<f64, 2, 5> {
        let square = s[0] * s[0] + s[1] * s[1];
        let range = square.sqrt();
        let mut out = SMatrix::zeros();
        (out[(0, 0)], out[(0, 1)]) = (s[0] / range, s[1] / range);
        (out[(1, 0)], out[(1, 1)]) = (-s[1] / square, s[0] / square);
        out
    }
}

/// Modes that never switch are filters side by side, each weighed by its own likelihoods.
#[test]
fn nonlinear_modes_are_the_nonlinear_filters() {
    let turn = CoordinatedTurn { acceleration_density: 0.5, turn_density: 0.01 };
    let shape = Unscented::default();
    let mean = vector![100.0, 50.0, 5.0, -2.0, 0.3];
    let start = Gaussian::from_variances(mean, vector![4.0, 4.0, 1.0, 1.0, 0.01]).unwrap();
    let stay = Switching::per_step(SMatrix::<f64, 2, 2>::identity()).unwrap();
    for unscented in [false, true] {
        let mut imm = Imm::new(start, [0.5, 0.5]).unwrap();
        let (mut a, mut b, mut logs, mut total) = (start, start, [0.5_f64.ln(); 2], 0.0);
        for k in 1..20 {
            let z = vector![111.0 + f64::from(k), 0.46 - 0.01 * f64::from(k)];
            imm.predict_modes(&[&Extended(turn), &UnscentedMode { motion: turn, shape }], &stay, DT_S).unwrap();
            a.predict_extended(&turn, DT_S).unwrap();
            b.predict_unscented(&turn, DT_S, &shape).unwrap();
            let found = if unscented {
                logs[0] += a.update_unscented(&Range(1.0), &z, &shape).unwrap().log_likelihood();
                logs[1] += b.update_unscented(&Range(1.0), &z, &shape).unwrap().log_likelihood();
                imm.update_unscented(&Range(1.0), &z, &shape).unwrap()
            } else {
                logs[0] += a.update_extended(&Range(1.0), &z).unwrap().log_likelihood();
                logs[1] += b.update_extended(&Range(1.0), &z).unwrap().log_likelihood();
                imm.update_extended(&Range(1.0), &z).unwrap()
            };
            total += found;
            assert_eq!([imm.beliefs()[0], imm.beliefs()[1]], [a, b]);
        }
        // The evidence of the whole run is the mean of the modes' own.
        assert_near("evidence", total, logs[0].exp().ln_1p().max((logs[0].exp() + logs[1].exp()).ln()), 1e-6);
        let share = 1.0 / (1.0 + (logs[1] - logs[0]).exp());
        assert_near("probability", imm.probabilities()[0], share, 1e-9);
    }
}

#[test]
fn the_current_model_looks_at_the_mixed_acceleration() {
    let current = CurrentStatistical::<2> { rate_per_s: 0.3, max_acceleration: 20.0 };
    let singer = Singer::<2> { rate_per_s: 0.3, acceleration_variance: 4.0 };
    let belief = full::<6>(0.7);
    let moved = Mode::predict(&current, &belief, DT_S).unwrap();
    assert_eq!(moved, belief.predicted(&current.over_from(belief.mean(), DT_S).unwrap()).unwrap());
    let mut imm = Imm::new(belief, [0.5, 0.5]).unwrap();
    imm.predict_modes(&[&current, &singer], &switching(), DT_S).unwrap();
    assert_close("mean", imm.beliefs()[0].mean(), moved.mean(), 1e-12);
}

#[test]
fn a_failing_mode_leaves_the_estimator_as_it_was() {
    let models = [ConstantVelocity::<2>::white(0.1), ConstantVelocity::<2>::white(-9.0)];
    let mut imm = Imm::from_beliefs([full::<4>(0.3), full::<4>(1.1)], [0.3, 0.7]).unwrap();
    let before = imm;
    assert!(imm.predict_modes(&[&models[0], &models[1]], &switching(), DT_S).is_err());
    assert!(imm.predict_modes(&[&models[0], &models[0]], &switching(), f64::NAN).is_err());
    assert!(imm.update_with(|j, _| Ok([1.0, f64::NAN][j])).is_err());
    assert!(imm.update_with(|j, _| Ok([1.0, f64::INFINITY][j])).is_err());
    assert_eq!(imm, before);
    let log = imm.update_with(|j, _| Ok([0.25_f64, 0.5][j].ln())).unwrap();
    assert_near("likelihood", log, (0.3 * 0.25 + 0.7 * 0.5_f64).ln(), 1e-14);
    assert_near("weight", imm.probabilities()[0], 0.3 * 0.25 / (0.3 * 0.25 + 0.7 * 0.5), 1e-14);
    assert_eq!(Sojourn::new([1.0, 2.5]).unwrap().mean_s(), &vector![1.0, 2.5]);
}
