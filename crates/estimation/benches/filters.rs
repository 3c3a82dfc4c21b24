//! Speed of one step: `cargo bench -p pursuit-estimation --bench filters`. How the linear filter compares with other
//! libraries is `benches/peers.rs` and `benches/compare_peers.py`.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::motion::{ConstantVelocity, PhysicalBox};
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::{Gaussian, Imm, LinearMeasurement, MotionModel, Sojourn, Transition};
use std::hint::black_box;

fn linear<const M: usize, const N: usize>(
    c: &mut Criterion,
    name: &str,
    step: Transition<N>,
    sensor: LinearMeasurement<M, N>,
) {
    let mut belief = Gaussian::<N>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let z = SVector::<f64, M>::repeat(0.1);
    c.bench_function(name, |b| {
        b.iter(|| {
            belief.predict(black_box(&step)).unwrap();
            belief.update(black_box(&sensor), black_box(&z)).unwrap();
        });
    });
}

/// As a tracker uses it: the step is as long as the frames are apart.
fn varying(c: &mut Criterion, name: &str, model: &ConstantVelocity<2>) {
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let mut belief = Gaussian::<4>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let z = SVector::<f64, 2>::repeat(0.1);
    c.bench_function(name, |b| {
        b.iter(|| {
            belief.predict(&black_box(model).over(black_box(1.0 / 30.0)).unwrap()).unwrap();
            belief.update(black_box(&sensor), black_box(&z)).unwrap();
        });
    });
}

fn benches(c: &mut Criterion) {
    let cv = ConstantVelocity::<2>::white(50.0).over(1.0 / 30.0).unwrap();
    linear(c, "linear 4/2", cv, LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap());
    varying(c, "linear 4/2, dt new at each step", &ConstantVelocity::<2>::white(50.0));
    let model = PhysicalBox { acceleration_density: 50.0, size_density: 1.0, position_density: 0.0 };
    let sensor = PhysicalBox::measurement(1.0, 1.0).unwrap();
    linear(c, "linear 6/4", model.over(1.0 / 30.0).unwrap(), sensor);

    let densities = [1.0, 50.0, 2500.0];
    let transitions = densities.map(|density| {
        PhysicalBox { acceleration_density: density, size_density: 1.0, position_density: 0.0 }
            .over(1.0 / 30.0)
            .unwrap()
    });
    let switching = Sojourn::new([1.0; 3]).unwrap().over(1.0 / 30.0).unwrap();
    let start = Gaussian::<6>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut imm = Imm::new(start, [0.4, 0.3, 0.3]).unwrap();
    let z = SVector::<f64, 4>::repeat(0.1);
    c.bench_function("imm 3 models 6/4", |b| {
        b.iter(|| {
            imm.predict(black_box(&transitions), &switching).unwrap();
            imm.update(&sensor, black_box(&z)).unwrap()
        });
    });

    let start = Gaussian::<4>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut particles = ParticleFilter::from_gaussian(1000, &start, ParticleOptions::default(), 1).unwrap();
    let likelihoods: Vec<f64> = (0..1000).map(|i| -0.5 * (f64::from(i) * 0.37).sin().powi(2)).collect();
    c.bench_function("particles 1000, 2-D constant velocity", |b| {
        b.iter(|| {
            particles.predict(black_box(&cv)).unwrap();
            particles.weigh(black_box(&likelihoods)).unwrap();
            particles.resample_if_needed().unwrap()
        });
    });
    let piecewise = ConstantVelocity::<2>::piecewise(50.0).over(1.0 / 30.0).unwrap();
    c.bench_function("particles 1000, piecewise noise, always resampled", |b| {
        b.iter(|| {
            particles.predict(black_box(&piecewise)).unwrap();
            particles.weigh(black_box(&likelihoods)).unwrap();
            particles.resample().unwrap();
        });
    });
}

criterion_group!(filters, benches);
criterion_main!(filters);
