//! Every filter on its own model: NEES and NIS in their 95 % bands over 1000 runs.
//!
//! A run is one path with its measurements; the statistics are those of its **last step**, so that runs are independent and
//! the average of 1000 is χ²/1000 with 1000 times the degrees of freedom. One consistent filter in twenty falls outside of a
//! 95 % band, so twenty sets of 1000 runs are made, none of them chosen: sixteen of the twenty must lie inside (a consistent
//! filter fails that once in 400; of ten sets, where runs are long, eight), and the average of all must lie in the 99.9 % band of 20 000.
//!
//! Filters that are not exact on their model, and by how much, are at the end.
//!
//! `cargo test --release -p pursuit-estimation --test own_models -- --ignored --nocapture` prints the averages.

#![allow(clippy::unwrap_used, clippy::panic)]
mod adaptive;
mod linear;
mod nonlinear;
mod particles;

use nalgebra::{SMatrix, SVector};
use pursuit_estimation::consistency::Band;
use pursuit_estimation::filters::{
    InputEstimator, MeasurementNoiseAdaptation, ProcessNoiseScaling, SquareRoot, SteadyState, smooth,
};
use pursuit_estimation::gao2007::{GatedFilter, GatedParams};
use pursuit_estimation::motion::{ConstantVelocity, CoordinatedTurn, RandomWalk};
use pursuit_estimation::nonlinear::{LinearizedSensor, NonlinearMotion, NonlinearSensor, Unscented};
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::qu2010::Qu2010Params;
use pursuit_estimation::zhai2024::{VarianceEstimate, VarianceParams, VarianceRule};
use pursuit_estimation::zhu2014::{HalfIntervalFilter, Zhu2014Params};
use pursuit_estimation::{Gaussian, Imm, Innovation, LinearMeasurement, MotionModel, Switching, Transition};
use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

const RUNS: u64 = 1000;
const SETS: u64 = 20;
const STEPS: usize = 40;

struct Random(Pcg64Mcg);

impl Random {
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A draw of a Gaussian of mean zero, whose covariance may be singular.
    fn noise<const N: usize>(&mut self, covariance: &SMatrix<f64, N, N>) -> SVector<f64, N> {
        // Gaussian elimination; a pivot that vanishes is a direction without noise.
        let (mut rest, mut sum) = (*covariance, SVector::zeros());
        for k in 0..N {
            let normal: f64 = StandardNormal.sample(&mut self.0);
            if rest[(k, k)] > 1e-12 * covariance[(k, k)] {
                let column = rest.column(k) / rest[(k, k)].sqrt();
                rest -= column * column.transpose();
                sum += column * normal;
            }
        }
        sum
    }

    fn draw<const N: usize>(&mut self, belief: &Gaussian<N>) -> SVector<f64, N> {
        belief.mean() + self.noise(belief.covariance())
    }

    fn moved<const N: usize>(&mut self, step: &Transition<N>, state: &SVector<f64, N>) -> SVector<f64, N> {
        step.matrix() * state + step.offset() + self.noise(step.noise())
    }

    fn measured<const M: usize, const N: usize>(
        &mut self,
        sensor: &LinearMeasurement<M, N>,
        state: &SVector<f64, N>,
    ) -> SVector<f64, M> {
        sensor.matrix() * state + self.noise(sensor.noise())
    }
}

/// What twenty sets of runs came to: of NEES and NIS, how many sets lie inside their band, and the average of all.
struct Found {
    inside: [usize; 2],
    average: [f64; 2],
    degrees: [usize; 2],
    runs: usize,
}

/// Runs `run` (its generator to NEES and NIS of the last step) in `sets` of 1000.
fn over_runs(name: &str, degrees: [usize; 2], sets: u64, run: impl Fn(&mut Random) -> [f64; 2] + Sync) -> Found {
    let averages: Vec<[f64; 2]> = (0..sets)
        .map(|set| {
            let all: Vec<[f64; 2]> = (0..RUNS)
                .into_par_iter()
                .map(|seed| run(&mut Random(Pcg64Mcg::seed_from_u64(set * RUNS + seed))))
                .collect();
            [0, 1].map(|which| all.iter().map(|found| found[which]).sum::<f64>() / RUNS as f64)
        })
        .collect();
    let average = [0, 1].map(|which| averages.iter().map(|found| found[which]).sum::<f64>() / sets as f64);
    let inside = [0, 1].map(|which| {
        let band = Band::of_average(degrees[which], RUNS as usize, 0.95).unwrap();
        averages.iter().filter(|found| band.contains(found[which])).count()
    });
    println!(
        "{name}: NEES {:.3} of {} ({} of {sets} sets in the band), NIS {:.3} of {} ({} of {sets}); first set {:.3}, {:.3}",
        average[0], degrees[0], inside[0], average[1], degrees[1], inside[1], averages[0][0], averages[0][1],
    );
    Found { inside, average, degrees, runs: (sets * RUNS) as usize }
}

fn consistent(name: &str, degrees: [usize; 2], run: impl Fn(&mut Random) -> [f64; 2] + Sync) {
    judged(name, degrees, SETS, run);
}

fn judged(name: &str, degrees: [usize; 2], sets: u64, run: impl Fn(&mut Random) -> [f64; 2] + Sync) {
    let found = over_runs(name, degrees, sets, run);
    for (which, what) in ["NEES", "NIS"].into_iter().enumerate() {
        let band = Band::of_average(found.degrees[which], found.runs, 0.999).unwrap();
        let inside = found.inside[which];
        assert!(5 * inside as u64 >= 4 * sets, "{name}: {what} in the band in {inside} of {sets} sets");
        assert!(band.contains(found.average[which]), "{name}: {what} {} outside {band:?}", found.average[which]);
    }
}

fn cv() -> Transition<4> {
    ConstantVelocity::<2>::white(3.0).over(0.1).unwrap()
}

fn position() -> LinearMeasurement<2, 4> {
    LinearMeasurement::select([0, 1], [1.0, 2.0]).unwrap()
}

fn unit<const N: usize>() -> Gaussian<N> {
    Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap()
}

/// A linear filter that can predict and update, on the model of `step` and `sensor`.
fn linear<const M: usize, const N: usize, Filter: Clone + Sync>(
    name: &str,
    (step, sensor): (&Transition<N>, &LinearMeasurement<M, N>),
    (start, filter): (&Gaussian<N>, &Filter),
    go: impl Fn(&mut Filter, &SVector<f64, M>) -> Innovation<M> + Sync,
    belief: impl Fn(&Filter) -> Gaussian<N> + Sync,
) {
    consistent(name, [N, M], |random| {
        let (mut state, mut filter) = (random.draw(start), filter.clone());
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(step, &state);
            nis = go(&mut filter, &random.measured(sensor, &state)).nis();
        }
        [belief(&filter).nees(&state).unwrap(), nis]
    });
}
