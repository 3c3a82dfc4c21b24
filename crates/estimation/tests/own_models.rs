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

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn kalman_in_joseph_and_square_root_form() {
    let plain = |step: Transition<4>, sensor: LinearMeasurement<2, 4>| {
        move |belief: &mut Gaussian<4>, z: &SVector<f64, 2>| {
            belief.predict(&step).unwrap();
            belief.update(&sensor, z).unwrap()
        }
    };
    let (step, sensor, start) = (cv(), position(), unit::<4>());
    linear("Kalman, components", (&step, &sensor), (&start, &start), plain(step, sensor), |b| *b);
    // Correlated noise is taken in at once, in Joseph form.
    let correlated = sensor.with_noise(SMatrix::<f64, 2, 2>::new(1.0, 0.6, 0.6, 2.0)).unwrap();
    linear("Kalman, Joseph", (&step, &correlated), (&start, &start), plain(step, correlated), |b| *b);
    let root = SquareRoot::new(&start).unwrap();
    let go = |filter: &mut SquareRoot<4>, z: &SVector<f64, 2>| {
        filter.predict(&step).unwrap();
        filter.update(&correlated, z).unwrap()
    };
    linear("square root", (&step, &correlated), (&start, &root), go, SquareRoot::to_gaussian);
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn constant_acceleration_of_qu2010() {
    let params = Qu2010Params::printed();
    let (step, sensor, start) = (params.motion().over(1.0).unwrap(), params.measurement().unwrap(), unit::<6>());
    let go = |belief: &mut Gaussian<6>, z: &SVector<f64, 2>| {
        belief.predict(&step).unwrap();
        belief.update(&sensor, z).unwrap()
    };
    linear("qu2010", (&step, &sensor), (&start, &start), go, |b| *b);
}

/// Memory that fades by α is exact for a target whose process noise is `Q + (α² − 1) F P Fᵀ`, with the filter's own `P`,
/// which does not depend on the data.
#[test]
#[ignore = "release: 20 000 runs"]
fn fading_memory() {
    const ALPHA: f64 = 1.05;
    let (step, sensor, start) = (cv(), position(), unit::<4>());
    consistent("fading memory", [4, 2], |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        for _ in 0..STEPS {
            let forgotten = step.matrix() * belief.covariance() * step.matrix().transpose() * (ALPHA * ALPHA - 1.0);
            state = random.moved(&step, &state) + random.noise(&forgotten);
            belief.predict_fading(&step, ALPHA).unwrap();
            nis = belief.update(&sensor, &random.measured(&sensor, &state)).unwrap().nis();
        }
        [belief.nees(&state).unwrap(), nis]
    });
}

/// The fixed gain, started from its own stationary error.
#[test]
#[ignore = "release: 20 000 runs"]
fn steady_state() {
    let (step, sensor) = (cv(), position());
    let gain = SteadyState::solve(&step, &sensor).unwrap();
    let settled = Gaussian::new(SVector::zeros(), gain.posterior_covariance).unwrap();
    let expected = sensor.matrix() * gain.prior_covariance * sensor.matrix().transpose() + sensor.noise();
    consistent("steady state", [4, 2], |random| {
        let (mut state, mut estimate, mut nis) = (random.draw(&settled), SVector::<f64, 4>::zeros(), 0.0);
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            let z = random.measured(&sensor, &state);
            let prior = gain.step(&mut estimate, &z).unwrap();
            nis = Innovation::new(z - sensor.matrix() * prior, expected).unwrap().nis();
        }
        [Gaussian::new(estimate, gain.posterior_covariance).unwrap().nees(&state).unwrap(), nis]
    });
}

/// NEES of the smoothed belief half-way; NIS of the filter's last step.
#[test]
#[ignore = "release: 20 000 runs"]
fn smoother() {
    let (step, sensor, start) = (cv(), position(), unit::<4>());
    consistent("smoother", [4, 2], |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        let (mut states, mut beliefs) = (vec![], vec![]);
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            belief.predict(&step).unwrap();
            nis = belief.update(&sensor, &random.measured(&sensor, &state)).unwrap().nis();
            states.push(state);
            beliefs.push(belief);
        }
        smooth(&mut beliefs, &[step; STEPS - 1]).unwrap();
        [beliefs[STEPS / 2].nees(&states[STEPS / 2]).unwrap(), nis]
    });
}

/// Range and bearing from a point well away, where the curvature is small against the doubt.
struct Radar;

const RADAR_NOISE: [f64; 2] = [1.0, 1e-6];

impl NonlinearSensor<2, 5> for Radar {
    fn expected(&self, state: &SVector<f64, 5>) -> SVector<f64, 2> {
        SVector::from([state[0].hypot(state[1]), state[1].atan2(state[0])])
    }

    fn noise(&self) -> SMatrix<f64, 2, 2> {
        SMatrix::from_diagonal(&SVector::from(RADAR_NOISE))
    }
}

impl LinearizedSensor<2, 5> for Radar {
    fn jacobian(&self, state: &SVector<f64, 5>) -> SMatrix<f64, 2, 5> {
        let (x, y) = (state[0], state[1]);
        let square = x * x + y * y;
        let range = square.sqrt();
        SMatrix::from_fn(|r, c| match (r, c) {
            (0, 0) => x / range,
            (0, 1) => y / range,
            (1, 0) => -y / square,
            (1, 1) => x / square,
            _ => 0.0,
        })
    }
}

/// A coordinated turn whose rate is estimated, seen in range and bearing: 10 px a second at 1000 px, 5 frames a second.
fn turning(name: &str, go: impl Fn(&CoordinatedTurn, &mut Gaussian<5>, f64, &SVector<f64, 2>) -> Innovation<2> + Sync) {
    const DT_S: f64 = 0.2;
    let motion = CoordinatedTurn { acceleration_density: 0.5, turn_density: 1e-4 };
    let mean = SVector::from([1000.0, 200.0, 10.0, 0.0, 0.2]);
    let start = Gaussian::from_variances(mean, SVector::from([1.0, 1.0, 0.25, 0.25, 1e-4])).unwrap();
    consistent(name, [5, 2], |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        for _ in 0..STEPS {
            state = motion.advance(&state, DT_S) + random.noise(&motion.noise(&state, DT_S));
            let z = Radar.expected(&state) + random.noise(&Radar.noise());
            nis = go(&motion, &mut belief, DT_S, &z).nis();
        }
        [belief.nees(&state).unwrap(), nis]
    });
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn extended_and_unscented() {
    turning("extended", |motion, belief, dt_s, z| {
        belief.predict_extended(motion, dt_s).unwrap();
        belief.update_extended(&Radar, z).unwrap()
    });
    turning("unscented", |motion, belief, dt_s, z| {
        belief.predict_unscented(motion, dt_s, &Unscented::default()).unwrap();
        belief.update_unscented(&Radar, z, &Unscented::default()).unwrap()
    });
}

/// A target that switches between two accelerations as the model says. The mixture is not Gaussian, and merging its
/// branches is an approximation; with modes this near both are small.
#[test]
#[ignore = "release: 20 000 runs"]
fn interacting_models() {
    let steps = [1.0, 4.0].map(|density| ConstantVelocity::<2>::white(density).over(0.1).unwrap());
    let chances = SMatrix::<f64, 2, 2>::new(0.95, 0.05, 0.1, 0.9);
    let switching = Switching::per_step(chances).unwrap();
    let (sensor, start) = (position(), unit::<4>());
    consistent("IMM", [4, 2], |random| {
        let (mut state, mut nis) = (random.draw(&start), 0.0);
        let mut mode = usize::from(random.uniform() < 1.0 / 3.0);
        let mut imm = Imm::new(start, [2.0 / 3.0, 1.0 / 3.0]).unwrap();
        for _ in 0..STEPS {
            mode = usize::from(random.uniform() < chances[(mode, 1)]);
            state = random.moved(&steps[mode], &state);
            imm.predict(&steps, &switching).unwrap();
            let z = random.measured(&sensor, &state);
            nis = imm.combined().innovation(&sensor, &z).unwrap().nis();
            imm.update(&sensor, &z).unwrap();
        }
        [imm.combined().nees(&state).unwrap(), nis]
    });
}

/// Two thousand particles on a linear model. Their sampling error adds about one part in the effective number to mean and
/// covariance, a tenth of the band's width.
#[test]
#[ignore = "release: 20 000 runs of 2000 particles"]
fn particles() {
    let step = RandomWalk::<1>::white(1.0).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 1>::select([0], [1.0]).unwrap();
    let start = unit::<1>();
    consistent("particles", [1, 1], |random| {
        let (mut state, mut nis) = (random.draw(&start), 0.0);
        let seed = random.0.next_u64();
        let mut filter = ParticleFilter::from_gaussian(2000, &start, ParticleOptions::default(), seed).unwrap();
        for _ in 0..6 {
            state = random.moved(&step, &state);
            filter.predict(&step).unwrap();
            let z = random.measured(&sensor, &state);
            nis = filter.to_gaussian().innovation(&sensor, &z).unwrap().nis();
            let likelihoods: Vec<f64> = filter.states().iter().map(|x| -0.5 * (z[0] - x[0]).powi(2)).collect();
            filter.weigh(&likelihoods).unwrap();
            filter.resample_if_needed().unwrap();
        }
        [filter.to_gaussian().nees(&state).unwrap(), nis]
    });
}

/// The recursion of `zhai2024`: `k s_k / σ²` is χ² with k degrees of freedom, and the next residual against `s_k` nearly
/// with one.
#[test]
#[ignore = "release: 20 000 runs"]
fn variance_recursion() {
    const RESIDUALS: usize = 1000;
    consistent("zhai2024 recursion", [RESIDUALS, 1], |random| {
        let mut estimate = VarianceEstimate::<1>::new(VarianceParams::unbounded(VarianceRule::Corrected)).unwrap();
        let mut normal = || -> f64 {
            2.0 * {
                let n: f64 = StandardNormal.sample(&mut random.0);
                n
            }
        };
        for _ in 0..RESIDUALS {
            estimate.observe(&SVector::<f64, 1>::new(normal())).unwrap();
        }
        let variance = estimate.variance()[0];
        [RESIDUALS as f64 * variance / 4.0, normal().powi(2) / variance]
    });
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn noise_learnt_to_convergence() {
    const LEARNING: usize = 2500;
    const LEARNING_SETS: u64 = 10;
    let (step, start) = (cv(), unit::<4>());
    let sensor = position();
    judged("measurement noise learnt", [4, 2], LEARNING_SETS, |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        let mut adaptation = MeasurementNoiseAdaptation::new(sensor.noise() * 2.0, 0.003).unwrap();
        let mut learnt = sensor.with_noise(*adaptation.noise()).unwrap();
        for _ in 0..LEARNING {
            state = random.moved(&step, &state);
            belief.predict(&step).unwrap();
            let z = random.measured(&sensor, &state);
            nis = belief.update(&learnt, &z).unwrap().nis();
            learnt = adaptation.learn(&belief, &learnt, &z).unwrap();
        }
        [belief.nees(&state).unwrap(), nis]
    });
    // The factor strays in proportion to its weight, and a filter whose Q strays errs more than it believes: with .01, ten
    // times faster, the NEES is 4.4.
    judged("process noise scaled", [4, 2], LEARNING_SETS, |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        let mut scaling = ProcessNoiseScaling::new(0.001, (1e-3, 1e3)).unwrap();
        for _ in 0..LEARNING {
            state = random.moved(&step, &state);
            belief.predict(&scaling.scaled(&step).unwrap()).unwrap();
            let innovation = belief.update(&sensor, &random.measured(&sensor, &state)).unwrap();
            scaling.learn(&innovation, sensor.noise());
            nis = innovation.nis();
        }
        [belief.nees(&state).unwrap(), nis]
    });
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn filters_that_decide() {
    // Nothing happens, and gates open by chance: that is what can make these filters inconsistent.
    let step = ConstantVelocity::<1>::piecewise(0.01).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 2>::select([0], [1.0]).unwrap();
    let start = unit::<2>();
    consistent("gao2007, gated", [2, 1], |random| {
        let mut state = random.draw(&start);
        let mut filter = GatedFilter::new(GatedParams::recommended(0.01, 1.0), 0.0, 0.0).unwrap();
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            filter.predict(1.0).unwrap();
            nis = filter.update(random.measured(&sensor, &state)[0]).unwrap().nis();
        }
        [filter.belief().nees(&state).unwrap(), nis]
    });
    let input = SMatrix::<f64, 2, 1>::new(0.5, 1.0);
    let watching = over_runs("input estimation", [2, 1], SETS, |random| {
        let mut state = random.draw(&start);
        let mut filter = InputEstimator::<1, 2, 1, 10>::new(start, 9.0).unwrap();
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            let z = random.measured(&sensor, &state);
            nis = filter.step(&step, &input, &sensor, &z).unwrap().0.nis();
        }
        [filter.belief().nees(&state).unwrap(), nis]
    });
    // The largest of ten onsets is corrected for as if it had been the only one: a false alarm is believed too much.
    let [nees, nis] = watching.average;
    assert!((2.0..2.3).contains(&nees) && (1.0..1.15).contains(&nis), "input estimation: {nees}, {nis}");
    let step = ConstantVelocity::<2>::per_step(1.0).over(1.0).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let start = unit::<4>();
    consistent("zhu2014, jump anywhere", [4, 2], |random| {
        let mut state = random.draw(&start);
        let mut filter = HalfIntervalFilter::new(Zhu2014Params::jump_anywhere(), start).unwrap();
        let mut nis = 0.0;
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            filter.predict(1.0).unwrap();
            nis = filter.update(&random.measured(&sensor, &state)).unwrap().innovation.nis();
        }
        [filter.belief().nees(&state).unwrap(), nis]
    });
}
