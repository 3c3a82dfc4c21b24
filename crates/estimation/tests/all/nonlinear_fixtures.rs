//! Turn models, Singer's model and the unscented filter against the independent reference.

use crate::common::{assert_close, fixture, list, matrix, number, vector};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::motion::{CoordinatedTurn, KnownTurn, Singer};
use pursuit_estimation::nonlinear::{LinearizedMotion, LinearizedSensor, NonlinearMotion, NonlinearSensor, Unscented};
use pursuit_estimation::{Gaussian, MotionModel};

/// The fixtures order states by axis, `[x, vx, y, vy]`; we order by derivative.
const FROM_AXES: [usize; 5] = [0, 2, 1, 3, 4];

/// Our turn in the fixture's order, with the fixture's own process noise.
struct ByAxis {
    turn: CoordinatedTurn,
    noise: SMatrix<f64, 5, 5>,
}

impl NonlinearMotion<5> for ByAxis {
    fn advance(&self, state: &SVector<f64, 5>, dt_s: f64) -> SVector<f64, 5> {
        let ours = SVector::from(FROM_AXES.map(|i| state[i]));
        let moved = self.turn.advance(&ours, dt_s);
        SVector::from(FROM_AXES.map(|i| moved[i]))
    }

    fn noise(&self, _: &SVector<f64, 5>, _: f64) -> SMatrix<f64, 5, 5> {
        self.noise
    }
}

/// Range and bearing from the origin.
struct RangeBearing(SMatrix<f64, 2, 2>);

impl NonlinearSensor<2, 5> for RangeBearing {
    fn expected(&self, state: &SVector<f64, 5>) -> SVector<f64, 2> {
        SVector::from([state[0].hypot(state[2]), state[2].atan2(state[0])])
    }

    fn noise(&self) -> SMatrix<f64, 2, 2> {
        self.0
    }

    fn difference(&self, a: &SVector<f64, 2>, b: &SVector<f64, 2>) -> SVector<f64, 2> {
        use std::f64::consts::{PI, TAU};
        SVector::from([a[0] - b[0], (a[1] - b[1] + PI).rem_euclid(TAU) - PI])
    }
}

impl LinearizedSensor<2, 5> for RangeBearing {
    fn jacobian(&self, state: &SVector<f64, 5>) -> SMatrix<f64, 2, 5> {
        let (x, y) = (state[0], state[2]);
        let range = x.hypot(y);
        let mut slope = SMatrix::<f64, 2, 5>::zeros();
        (slope[(0, 0)], slope[(0, 2)]) = (x / range, y / range);
        (slope[(1, 0)], slope[(1, 2)]) = (-y / (range * range), x / (range * range));
        slope
    }
}

#[test]
fn singer() {
    let data = fixture("motion_models");
    for case in list(&data["singer"]) {
        let model =
            Singer::<1> { rate_per_s: number(&case["alpha"]), acceleration_variance: number(&case["sigma_a2"]) };
        let step = model.over(number(&case["T"])).unwrap();
        assert_close("F", step.matrix(), &matrix(&case["F"]), 1e-13);
        // Entries of Q span many decades: each to its own size, not to one.
        for (a, b) in step.noise().iter().zip(matrix::<3, 3>(&case["Q"]).iter()) {
            assert!((a - b).abs() <= 1e-11 * b.abs(), "{case}: {a} is not {b}");
        }
    }
}

#[test]
fn coordinated_turn() {
    let data = fixture("motion_models");
    for case in list(&data["ct"]) {
        let model = KnownTurn { rate_rad_per_s: number(&case["omega"]), acceleration_density: 1.0 };
        let ours = *model.over(number(&case["T"])).unwrap().matrix();
        let reordered = SMatrix::<f64, 4, 4>::from_fn(|r, c| ours[(FROM_AXES[r], FROM_AXES[c])]);
        assert_close("F", &reordered, &matrix(&case["F"]), 1e-9);
    }
}

#[test]
fn unscented_turn() {
    let data = fixture("ukf_ct");
    let dt = number(&data["dt"]);
    let unscented =
        Unscented { alpha: number(&data["alpha"]), beta: number(&data["beta"]), kappa: number(&data["kappa"]) };
    let motion =
        ByAxis { turn: CoordinatedTurn { acceleration_density: 0.0, turn_density: 0.0 }, noise: matrix(&data["Q"]) };
    let sensor = RangeBearing(matrix(&data["R"]));
    let start = Gaussian::<5>::new(vector(&data["x0"]), matrix(&data["P0"])).unwrap();

    let points = unscented.points(&start).unwrap();
    let expected = &data["sigma_points_0"];
    assert_close("centre", &points.centre, &vector(&expected[0]), 1e-12);
    for i in 0..5 {
        assert_close("ahead", &points.ahead[i], &vector(&expected[1 + i]), 1e-12);
        assert_close("behind", &points.behind[i], &vector(&expected[6 + i]), 1e-12);
    }

    for redraw in [true, false] {
        let mut belief = start;
        let steps = &data[if redraw { "steps_redraw" } else { "steps_no_redraw" }];
        for (z, step) in list(&data["z"]).iter().zip(list(steps)) {
            let moved = belief.predict_unscented(&motion, dt, &unscented).unwrap();
            assert_close("x prior", belief.mean(), &vector(&step["x_prior"]), 1e-8);
            assert_close("P prior", belief.covariance(), &matrix(&step["P_prior"]), 1e-8);
            let z = vector::<2>(z);
            let innovation = if redraw {
                belief.update_unscented(&sensor, &z, &unscented).unwrap()
            } else {
                belief.update_unscented_with(&moved, &sensor, &z, &unscented).unwrap()
            };
            assert_close("y", innovation.residual(), &vector(&step["y"]), 1e-8);
            assert_close("S", &innovation.covariance(), &matrix(&step["S"]), 1e-8);
            assert_close("x post", belief.mean(), &vector(&step["x_post"]), 1e-8);
            assert_close("P post", belief.covariance(), &matrix(&step["P_post"]), 1e-8);
        }
    }
}

/// The turn in the fixture's order, with a slope by differences.
impl LinearizedMotion<5> for ByAxis {
    fn jacobian(&self, state: &SVector<f64, 5>, dt_s: f64) -> SMatrix<f64, 5, 5> {
        let ours = SVector::from(FROM_AXES.map(|i| state[i]));
        let slope = self.turn.jacobian(&ours, dt_s);
        SMatrix::from_fn(|r, c| slope[(FROM_AXES[r], FROM_AXES[c])])
    }
}

/// With little doubt both linearisations see the same tangent.
#[test]
fn extended_and_unscented_agree_when_sure() {
    let motion = ByAxis {
        turn: CoordinatedTurn { acceleration_density: 0.0, turn_density: 0.0 },
        noise: SMatrix::identity() * 1e-8,
    };
    let sensor = RangeBearing(SMatrix::identity() * 1e-8);
    let state = SVector::from([120.0, 4.0, 80.0, -3.0, 0.2]);
    let mut extended = Gaussian::new(state, SMatrix::identity() * 1e-6).unwrap();
    let mut unscented = extended;
    let z = sensor.expected(&motion.advance(&state, 0.5)) + SVector::from([1e-4, -1e-5]);
    extended.predict_extended(&motion, 0.5).unwrap();
    unscented.predict_unscented(&motion, 0.5, &Unscented::default()).unwrap();
    assert_close("prior", extended.covariance(), unscented.covariance(), 1e-9);
    extended.update_extended(&sensor, &z).unwrap();
    unscented.update_unscented(&sensor, &z, &Unscented::default()).unwrap();
    // The unscented mean keeps the curvature term, which is of the order of the variance.
    assert_close("mean", extended.mean(), unscented.mean(), 1e-6);
    assert_close("covariance", extended.covariance(), unscented.covariance(), 1e-9);
}

#[test]
fn a_bearing_across_the_cut_is_no_surprise() {
    let sensor = RangeBearing(SMatrix::from_diagonal(&SVector::from([1.0, 1e-4])));
    let state = SVector::from([-100.0, 0.0, 0.5, 0.0, 0.0]);
    let mut belief = Gaussian::new(state, SMatrix::identity()).unwrap();
    let z = SVector::from([100.0, -3.13]);
    let innovation = belief.update_unscented(&sensor, &z, &Unscented::default()).unwrap();
    assert!(innovation.nis() < 2.0, "{}", innovation.nis());
}
