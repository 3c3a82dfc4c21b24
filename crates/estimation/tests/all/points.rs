//! The filters of a point: one shape, and each the filter it is named for.

use crate::common::assert_close;
use nalgebra::{SMatrix, SVector, matrix, vector};
use pursuit_estimation::filters::InputEstimator;
use pursuit_estimation::gao2007::{GatedFilter, GatedParams};
use pursuit_estimation::motion::{
    ConstantAcceleration, ConstantVelocity, CoordinatedTurn, CurrentStatistical, KnownTurn, Singer,
};
use pursuit_estimation::point::{
    GatedPoint, HalfIntervalPoint, ImmPoint, InputPoint, ModelPoint, PointFilter, PointStart,
};
use pursuit_estimation::zhu2014::{HalfInterval, HalfIntervalFilter, Jump, Zhu2014Params};
use pursuit_estimation::{
    Embedded, EstimationError, Extended, Gaussian, LinearMeasurement, MotionModel, Result, Sojourn,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

type Two = SVector<f64, 2>;
type Noise = SMatrix<f64, 2, 2>;

const DT_S: f64 = 1.0 / 30.0;
const START: PointStart = PointStart { speed_px_per_s: 300.0, further: 500.0 };

fn noise() -> Noise {
    matrix![1.0, 0.0; 0.0, 2.0]
}

/// Half a second straight on, then a turn; some frames unseen.
fn readings() -> Vec<Option<Two>> {
    (1..60)
        .map(|k| {
            let t = f64::from(k);
            let wobble = vector![(1.7 * t).sin(), (2.9 * t).cos()];
            let path = if k < 25 { vector![4.0 * t, 0.0] } else { vector![100.0, 5.0 * (t - 25.0)] };
            (k % 8 != 5).then_some(path + wobble)
        })
        .collect()
}

/// Everything that holds of every filter; returns the last belief.
fn behaves<F: PointFilter + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned>(
    mut filter: F,
) -> Gaussian<4> {
    let new = filter.clone();
    for z in readings() {
        let before = filter.clone();
        let (ahead, farther) = (filter.forecast(DT_S).unwrap(), filter.forecast(5.0 * DT_S).unwrap());
        assert_eq!(filter, before);
        filter.predict(DT_S).unwrap();
        assert_eq!(filter.belief(), ahead);
        assert!(farther.covariance()[(0, 0)] > ahead.covariance()[(0, 0)]);
        let expected = filter.expected(&noise()).unwrap();
        assert_eq!(*expected.mean(), filter.belief().mean().fixed_rows::<2>(0).into_owned());
        let block = filter.belief().covariance().fixed_view::<2, 2>(0, 0) + noise();
        assert_close("S", expected.covariance(), &block, 1e-12);
        if let Some(z) = z {
            let innovation = filter.update(&z, &noise()).unwrap();
            assert_close("residual", innovation.residual(), &(z - expected.mean()), 1e-9);
            assert_close("S", &innovation.covariance(), expected.covariance(), 1e-9);
        }
        // What is stored goes on as what was not.
        let bytes = postcard::to_stdvec(&filter).unwrap();
        let back = postcard::from_bytes::<F>(&bytes).unwrap();
        assert_eq!(back, filter);
        filter = back;
    }
    let before = filter.clone();
    for dt_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(filter.predict(dt_s), Err(EstimationError::TimeStep { .. })));
        assert!(matches!(filter.forecast(dt_s), Err(EstimationError::TimeStep { .. })));
    }
    assert!(filter.update(&vector![f64::NAN, 0.0], &noise()).is_err());
    assert!(filter.update(&vector![0.0, f64::INFINITY], &noise()).is_err());
    assert!(filter.update(&vector![0.0, 0.0], &-noise()).is_err());
    assert!(filter.expected(&-noise()).is_err());
    assert!(filter.restart(&vector![f64::NAN, 0.0], &noise()).is_err());
    assert!(filter.restart(&vector![0.0, 0.0], &-noise()).is_err());
    assert_eq!(filter, before);
    let last = filter.belief();
    assert!((last.mean().fixed_rows::<2>(0) - vector![100.0, 170.0]).norm() < 6.0, "{}", last.mean());
    assert!((last.mean()[3] - 150.0).abs() < 40.0 && last.mean()[2].abs() < 40.0, "{}", last.mean());
    // Started again where it was first started, it is new.
    filter.restart(&vector![0.0, 0.0], &noise()).unwrap();
    assert_eq!(filter, new);
    assert_eq!(*filter.belief().mean(), SVector::<f64, 4>::zeros());
    assert_eq!(filter.belief().covariance()[(1, 1)], 2.0);
    assert!((filter.belief().covariance()[(2, 2)] - 9e4).abs() < 1e-9);
    last
}

fn at<T>(build: impl Fn(&Two, &Noise) -> Result<T>) -> T {
    build(&vector![0.0, 0.0], &noise()).unwrap()
}

#[test]
fn single_models() {
    let density = 2e4;
    let last = behaves(at(|z, r| ModelPoint::new(ConstantVelocity::<2>::white(density), START, z, r)));
    let mut plain = START.at::<4>(&vector![0.0, 0.0], &noise()).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 2.0]).unwrap();
    for z in readings() {
        plain.predict(&ConstantVelocity::<2>::white(density).over(DT_S).unwrap()).unwrap();
        if let Some(z) = z {
            plain.update(&sensor, &z).unwrap();
        }
    }
    assert_eq!(last, plain);
    behaves(at(|z, r| ModelPoint::new(ConstantAcceleration::<2>::white(2e6), START, z, r)));
    behaves(at(|z, r| ModelPoint::new(KnownTurn { rate_rad_per_s: 0.3, acceleration_density: density }, START, z, r)));
    let singer = Singer::<2> { rate_per_s: 3.0, acceleration_variance: 1e6 };
    behaves(at(|z, r| ModelPoint::new(singer, START, z, r)));
    let current = CurrentStatistical::<2> { rate_per_s: 3.0, max_acceleration: 4000.0 };
    behaves(at(|z, r| ModelPoint::new(current, START, z, r)));
    let turn = Extended(CoordinatedTurn { acceleration_density: density, turn_density: 1.0 });
    behaves(at(|z, r| ModelPoint::new(turn, PointStart { further: 1.0, ..START }, z, r)));
}

#[test]
fn interacting_models() {
    let cv = |density: f64| ConstantVelocity::<2>::white(density);
    let sojourn = Sojourn::new([1.0, 0.3]).unwrap();
    behaves(at(|z, r| ImmPoint::new((cv(10.0), cv(1e5)), sojourn, START, z, r)));
    let small = Embedded::new(cv(10.0), [0, 1, 2, 3], SVector::<f64, 6>::repeat(1.0)).unwrap();
    let imm = at(|z, r| ImmPoint::new((small, ConstantAcceleration::<2>::white(2e6)), sojourn, START, z, r));
    behaves(imm);
    let turn = |rate_rad_per_s: f64| KnownTurn { rate_rad_per_s, acceleration_density: 10.0 };
    let long = Sojourn::new([1.0, 0.3, 1.0]).unwrap();
    behaves(at(|z, r| ImmPoint::new((cv(10.0), cv(1e5), turn(1.0)), long, START, z, r)));
    let longer = Sojourn::new([1.0, 0.3, 1.0, 1.0]).unwrap();
    let four = at(|z, r| ImmPoint::new((cv(10.0), cv(1e5), turn(1.0), turn(-1.0)), longer, START, z, r));
    assert_eq!(four.imm().probabilities().as_slice(), [0.25; 4]);
    behaves(four);
}

#[test]
fn gated_is_one_filter_for_each_axis() {
    // q/R = .01 a frame.
    let params = GatedParams::recommended(0.01 / DT_S.powi(4), 1.0);
    let point = at(|z, r| GatedPoint::new(params, START, z, r));
    let last = behaves(point.clone());
    for a in 0..2 {
        let start = Gaussian::from_variances(vector![0.0, 0.0], vector![noise()[(a, a)], 9e4]).unwrap();
        let mut axis = GatedFilter::from_belief(params, start).unwrap();
        for z in readings() {
            axis.predict(DT_S).unwrap();
            if let Some(z) = z {
                axis.update_with_noise(z[a], noise()[(a, a)]).unwrap();
            }
        }
        assert_eq!(last.mean()[a], axis.belief().mean()[0]);
        assert_eq!(last.mean()[a + 2], axis.belief().mean()[1]);
        assert_eq!(last.covariance()[(a, a + 2)], axis.belief().covariance()[(0, 1)]);
        assert_eq!(last.covariance()[(a, 1 - a)], 0.0);
    }
    assert_eq!(point.axes()[0], point.axes()[0].clone());
}

#[test]
fn half_interval_counts_in_frames() {
    let params = Zhu2014Params {
        process_variance: 0.1,
        half_interval: HalfInterval::JumpAnywhere { jump: Jump::default_for(1.0) },
        ..Zhu2014Params::jump_anywhere()
    };
    let last = behaves(at(|z, r| HalfIntervalPoint::new(params, DT_S, START, z, r)));
    let (r, v) = (noise(), (300.0 * DT_S).powi(2));
    let start = Gaussian::from_variances(SVector::zeros(), vector![r[(0, 0)], r[(1, 1)], v, v]).unwrap();
    let mut frames = HalfIntervalFilter::new(params, start).unwrap();
    let mut manoeuvres = 0;
    for z in readings() {
        frames.predict(1.0).unwrap();
        if let Some(z) = z {
            manoeuvres += i32::from(frames.update_with_noise(&z, &r).unwrap().manoeuvre);
        }
    }
    assert!(manoeuvres > 0);
    let scale = vector![1.0, 1.0, 1.0 / DT_S, 1.0 / DT_S];
    assert_close("mean", last.mean(), &frames.belief().mean().component_mul(&scale), 1e-9);
    assert!((last.covariance()[(0, 2)] - frames.belief().covariance()[(0, 2)] / DT_S).abs() < 1e-9);
    for frame_s in [0.0, f64::NAN] {
        assert!(HalfIntervalPoint::new(params, frame_s, START, &vector![0.0, 0.0], &noise()).is_err());
    }
}

#[test]
fn input_estimation_is_by_steps() {
    let motion = ConstantVelocity::<2>::white(100.0);
    let last = behaves(at(|z, r| InputPoint::new(motion, 9.0, START, z, r)));
    let start = START.at::<4>(&vector![0.0, 0.0], &noise()).unwrap();
    let mut steps = InputEstimator::<2, 4, 2, 10>::new(start, 9.0).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 2.0]).unwrap();
    let h = 0.5 * DT_S * DT_S;
    let input = SMatrix::<f64, 4, 2>::new(h, 0.0, 0.0, h, DT_S, 0.0, 0.0, DT_S);
    let step = motion.over(DT_S).unwrap();
    let mut found = 0;
    for z in readings() {
        match z {
            // A gap clears the window before the next step, whichever way it is told of.
            None => steps.coast(&step).unwrap(),
            Some(z) => found += i32::from(steps.step(&step, &input, &sensor, &z).unwrap().1.is_some()),
        }
    }
    assert!(found > 0);
    assert_eq!(last, *steps.belief());
}

#[test]
fn starts_out_of_range_are_refused() {
    for start in [
        PointStart { speed_px_per_s: 0.0, ..START },
        PointStart { further: f64::NAN, ..START },
        PointStart { further: -1.0, ..START },
    ] {
        assert!(matches!(start.at::<6>(&vector![0.0, 0.0], &noise()), Err(EstimationError::Parameter { .. })));
    }
    let belief = START.at::<6>(&vector![3.0, 4.0], &matrix![1.0, 0.5; 0.5, 2.0]).unwrap();
    assert_eq!(*belief.mean(), vector![3.0, 4.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(belief.covariance()[(0, 1)], 0.5);
    assert_eq!(belief.covariance()[(3, 3)], 9e4);
    assert_eq!(belief.covariance()[(4, 4)], 25e4);
}
