//! Filters are as sure as they ought to be: NEES and NIS inside their bands over 1000 runs, each on its own model; and
//! covariances stay symmetric and positive whatever the numbers.

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use pursuit_estimation::consistency::Consistency;
use pursuit_estimation::filters::SquareRoot;
use pursuit_estimation::motion::{
    ConstantAcceleration, ConstantVelocity, KnownTurn, PhysicalBox, RandomWalk, Singer, SortBox, StepBox,
};
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel};
use pursuit_testkit::SplitMix;

const RUNS: u64 = 1000;
const STEPS: usize = 30;

/// Simulates a model by a single particle, filters it, and looks at NEES at the end and NIS at the last step. The band
/// is of 99.9 %: eight models with two statistics each must not fail by chance.
fn consistent<const M: usize, const N: usize>(
    name: &str,
    model: &impl MotionModel<N>,
    sensor: &LinearMeasurement<M, N>,
    dt_s: f64,
) {
    let step = model.over(dt_s).unwrap();
    let noise = Gaussian::new(SVector::zeros(), *sensor.noise()).unwrap();
    let start = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let (mut nees, mut nis) = (Consistency::new(N), Consistency::new(M));
    for run in 0..RUNS {
        let options = ParticleOptions::default();
        let mut truth = ParticleFilter::from_gaussian(1, &start, options, run).unwrap();
        let errors = ParticleFilter::from_gaussian(STEPS, &noise, options, run + 1_000_000).unwrap();
        let mut belief = start;
        let mut last = 0.0;
        for error in errors.states() {
            truth.predict(&step).unwrap();
            belief.predict(&step).unwrap();
            let z = sensor.matrix() * truth.states()[0] + error;
            last = belief.update(sensor, &z).unwrap().nis();
        }
        nis.record(last);
        nees.record(belief.nees(&truth.states()[0]).unwrap());
    }
    for (what, record) in [("NEES", nees), ("NIS", nis)] {
        let (average, band) = (record.average().unwrap(), record.band(0.999).unwrap());
        assert!(band.contains(average), "{name}: {what} {average} outside {band:?}");
    }
}

#[test]
fn each_filter_on_its_own_model() {
    let position = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 2.0]).unwrap();
    let six = LinearMeasurement::<2, 6>::select([0, 1], [1.0, 2.0]).unwrap();
    let two = LinearMeasurement::<2, 2>::select([0, 1], [1.0, 2.0]).unwrap();
    consistent("random walk", &RandomWalk::<2>::white(0.5), &two, 0.1);
    consistent("constant velocity", &ConstantVelocity::<2>::white(3.0), &position, 0.1);
    consistent("constant acceleration", &ConstantAcceleration::<2>::white(3.0), &six, 0.1);
    consistent("Singer", &Singer::<2> { rate_per_s: 0.5, acceleration_variance: 4.0 }, &six, 0.1);
    let turn = KnownTurn { rate_rad_per_s: 0.8, acceleration_density: 1.0 };
    consistent("turn", &turn, &position, 0.1);
    let ball = StepBox::ball();
    consistent("ball", &ball, &ball.measurement().unwrap(), 1.0 / 30.0);
    let physical = PhysicalBox { acceleration_density: 20.0, size_density: 0.5, position_density: 0.0 };
    consistent("box", &physical, &PhysicalBox::measurement(1.0, 2.0).unwrap(), 0.04);
    let sort = SortBox::sort2016(1.0).unwrap();
    consistent("SORT box", &sort, &sort.measurement().unwrap(), 1.0);
}

/// A filter that is ten times too sure is caught.
#[test]
#[should_panic(expected = "outside")]
fn a_wrong_model_is_caught() {
    struct Sure;
    impl MotionModel<4> for Sure {
        fn over(&self, dt_s: f64) -> pursuit_estimation::Result<pursuit_estimation::Transition<4>> {
            ConstantVelocity::<2>::white(1.0).over(dt_s)
        }
    }
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let truth = ConstantVelocity::<2>::white(10.0).over(0.5).unwrap();
    let step = Sure.over(0.5).unwrap();
    let start = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut nees = Consistency::new(4);
    for run in 0..200 {
        let mut state = ParticleFilter::from_gaussian(1, &start, ParticleOptions::default(), run).unwrap();
        let mut belief = start;
        for _ in 0..STEPS {
            state.predict(&truth).unwrap();
            belief.predict(&step).unwrap();
            belief.update(&sensor, &(sensor.matrix() * state.states()[0])).unwrap();
        }
        nees.record(belief.nees(&state.states()[0]).unwrap());
    }
    let band = nees.band(0.999).unwrap();
    assert!(band.contains(nees.average().unwrap()), "outside {band:?}");
}

/// A number spread evenly over decades, from a counter: no state to carry.
fn spread(counter: u64, low: f64, high: f64) -> f64 {
    (low.ln() + (high / low).ln() * SplitMix::after(counter).unit()).exp()
}

/// Symmetric to the bit; every variance positive; no eigenvalue of the correlations below zero beyond rounding.
#[track_caller]
fn assert_sound<const N: usize>(covariance: &SMatrix<f64, N, N>, when: u64) {
    assert_eq!(*covariance, covariance.transpose(), "step {when}");
    let scale = covariance.diagonal().map(f64::sqrt);
    assert!(scale.iter().all(|value| *value > 0.0 && value.is_finite()), "step {when}: {covariance}");
    let mut rest = SMatrix::<f64, N, N>::from_fn(|r, c| covariance[(r, c)] / (scale[r] * scale[c]));
    for k in 0..N {
        let pivot = rest[(k, k)];
        assert!(pivot > 0.0, "step {when}: pivot {k} {pivot:e} of {covariance}");
        for j in k + 1..N {
            for i in j..N {
                let step = rest[(i, k)] * rest[(j, k)] / pivot;
                rest[(i, j)] -= step;
            }
        }
    }
}

/// dt from 1e-6 to 1e3 s and R over twelve decades, changing at every step.
fn harsh(steps: u64) {
    let model = ConstantVelocity::<2>::white(1.0);
    let mut plain = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut root = SquareRoot::new(&plain).unwrap();
    for k in 0..steps {
        let step = model.over(spread(3 * k, 1e-6, 1e3)).unwrap();
        let (a, b) = (spread(3 * k + 1, 1e-6, 1e6), spread(3 * k + 2, 1e-6, 1e6));
        let sensor = LinearMeasurement::<2, 4>::select([0, 1], [a, b]).unwrap();
        plain.predict(&step).unwrap();
        assert_sound(plain.covariance(), k);
        plain.update(&sensor, &SVector::zeros()).unwrap();
        assert_sound(plain.covariance(), k);
        root.predict(&step).unwrap();
        root.update(&sensor, &SVector::zeros()).unwrap();
        assert!(root.factor().diagonal().iter().all(|value| *value > 0.0), "step {k}");
    }
}

/// The same where the axes are coupled: by a turn, by noise that is correlated, and by a sensor that reads one of them
/// alone, so that the filter takes all of its ways.
fn harsh_and_coupled(steps: u64) {
    let mut belief = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    for k in 0..steps {
        let turn = KnownTurn { rate_rad_per_s: spread(5 * k, 1e-3, 10.0), acceleration_density: 1.0 };
        belief.predict(&turn.over(spread(5 * k + 1, 1e-6, 1e3)).unwrap()).unwrap();
        assert_sound(belief.covariance(), k);
        let (a, b) = (spread(5 * k + 2, 1e-6, 1e6), spread(5 * k + 3, 1e-6, 1e6));
        let direct = LinearMeasurement::<2, 4>::select([0, 1], [a, b]).unwrap();
        match k % 3 {
            0 => {
                let shared = 0.9 * (a * b).sqrt();
                let sensor = direct.with_noise(SMatrix::<f64, 2, 2>::new(a, shared, shared, b)).unwrap();
                belief.update(&sensor, &SVector::zeros()).unwrap();
            }
            1 => {
                belief.update(&direct, &SVector::zeros()).unwrap();
            }
            _ => {
                let single = LinearMeasurement::<1, 4>::select([(k as usize / 3) % 4], [a]).unwrap();
                belief.update(&single, &SVector::zeros()).unwrap();
            }
        }
        assert_sound(belief.covariance(), k);
    }
}

#[test]
fn harsh_numbers_leave_covariances_sound() {
    harsh(20_000);
    harsh_and_coupled(20_000);
}

/// The same over 10⁶ steps: `cargo test --release -p pursuit-estimation --test all consistency -- --ignored`.
#[test]
#[ignore = "release: a million steps"]
fn harsh_numbers_leave_covariances_sound_for_a_million_steps() {
    harsh(1_000_000);
    harsh_and_coupled(1_000_000);
}

proptest! {
    /// From any positive definite covariance, of any conditioning up to 1e12, a step leaves a sound one.
    #[test]
    fn any_step_leaves_a_sound_covariance(
        entries in proptest::array::uniform16(-1.0_f64..1.0),
        decades in proptest::array::uniform4(-6.0_f64..6.0),
        dt_s in -6.0_f64..3.0,
        noise in proptest::array::uniform2(-6.0_f64..6.0),
    ) {
        let mix = SMatrix::<f64, 4, 4>::from_row_slice(&entries);
        let scale = SMatrix::<f64, 4, 4>::from_diagonal(&SVector::from(decades).map(|d| 10.0_f64.powf(0.5 * d)));
        let covariance = scale * (mix * mix.transpose() + SMatrix::identity() * 1e-3) * scale;
        let mut belief = Gaussian::new(SVector::zeros(), covariance).unwrap();
        let sensor = LinearMeasurement::<2, 4>::select([0, 1], noise.map(|d| 10.0_f64.powf(d))).unwrap();
        belief.predict(&ConstantVelocity::<2>::white(1.0).over(10.0_f64.powf(dt_s)).unwrap()).unwrap();
        assert_sound(belief.covariance(), 0);
        belief.update(&sensor, &SVector::from([1.0, -1.0])).unwrap();
        assert_sound(belief.covariance(), 1);
    }
}
