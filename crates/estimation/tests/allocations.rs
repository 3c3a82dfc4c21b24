//! Once it runs, no step of a filter allocates.

#![allow(clippy::unwrap_used, clippy::panic)]

use nalgebra::{SMatrix, SVector};
use pursuit_estimation::association::{Cost, NearestNeighbours};
use pursuit_estimation::consistency::Gate;
use pursuit_estimation::filters::FixedLag;
use pursuit_estimation::gao2007::GatedParams;
use pursuit_estimation::motion::{ConstantVelocity, Singer};
use pursuit_estimation::point::{
    GatedPoint, HalfIntervalPoint, ImmPoint, InputPoint, ModelPoint, PointFilter, PointStart,
};
use pursuit_estimation::zhu2014::Zhu2014Params;
use pursuit_estimation::{Gaussian, MotionModel, Sojourn};

const DT_S: f64 = 0.04;

/// A zigzag, so that gates open.
fn reading(k: u32) -> SVector<f64, 2> {
    let t = f64::from(k % 40);
    SVector::from([6.0 * t.min(40.0 - t), 3.0 * t + (1.7 * f64::from(k)).sin()])
}

#[track_caller]
fn steady(name: &str, filter: &mut impl PointFilter) {
    let noise = SMatrix::<f64, 2, 2>::identity();
    let mut go = |from: u32, to: u32| {
        for k in from..to {
            filter.predict(DT_S).unwrap();
            if k % 9 != 4 {
                filter.update(&reading(k), &noise).unwrap();
            }
            filter.forecast(0.5).unwrap();
            filter.expected(&noise).unwrap();
        }
    };
    go(1, 40);
    let info = allocation_counter::measure(|| go(40, 200));
    assert_eq!(info.count_total, 0, "{name}: {info:?}");
}

#[test]
fn filters_of_a_point() {
    let start = PointStart { speed_px_per_s: 200.0, further: 500.0 };
    let (at, noise) = (SVector::zeros(), SMatrix::identity());
    let cv = |density: f64| ConstantVelocity::<2>::white(density);
    let singer = Singer::<2> { rate_per_s: 1.0, acceleration_variance: 1e5 };
    steady("Singer", &mut ModelPoint::new(singer, start, &at, &noise).unwrap());
    let sojourn = Sojourn::new([1.0, 0.3]).unwrap();
    steady("IMM", &mut ImmPoint::new((cv(10.0), cv(1e5)), sojourn, start, &at, &noise).unwrap());
    let params = GatedParams::recommended(0.01 / DT_S.powi(4), 1.0);
    steady("gao2007", &mut GatedPoint::new(params, start, &at, &noise).unwrap());
    let jump = Zhu2014Params::jump_anywhere();
    steady("zhu2014", &mut HalfIntervalPoint::new(jump, DT_S, start, &at, &noise).unwrap());
    steady("input estimation", &mut InputPoint::new(cv(100.0), 9.0, start, &at, &noise).unwrap());
}

#[test]
fn association_and_fixed_lag() {
    let mut nearest = NearestNeighbours::new(Gate { threshold: 9.21 }, Cost::Distance).unwrap();
    let targets: Vec<_> = (0..20)
        .map(|k| Gaussian::from_variances(SVector::from([f64::from(k), 0.0]), SVector::from([1.0, 1.0])).unwrap())
        .collect();
    let detections: Vec<_> = (0..25).map(|k| SVector::from([f64::from(k) * 0.9, 0.5])).collect();
    let mut go = || nearest.associate(&targets, &detections).unwrap().iter().flatten().count();
    go();
    let info = allocation_counter::measure(|| assert!(go() > 15));
    assert_eq!(info.count_total, 0, "{info:?}");

    let start = Gaussian::<4>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let step = ConstantVelocity::<2>::white(1.0).over(DT_S).unwrap();
    let mut lagged = FixedLag::new(6, start).unwrap();
    for _ in 0..20 {
        lagged.push(&step, &start).unwrap();
    }
    let info = allocation_counter::measure(|| assert!(lagged.push(&step, &start).unwrap().is_some()));
    assert_eq!(info.count_total, 0, "{info:?}");
}
