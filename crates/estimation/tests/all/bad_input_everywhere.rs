//! What every filter does with bad input: a typed error, and a filter that is as it was.

use nalgebra::{SMatrix, SVector};
use pursuit_estimation::filters::{
    InputEstimator, LastUpdate, MeasurementNoiseAdaptation, Replay, SquareRoot, SteadyState, smooth,
};
use pursuit_estimation::gao2007::{GatedFilter, GatedParams, LiteralFilter, LiteralParams};
use pursuit_estimation::motion::{
    ConstantAcceleration, ConstantVelocity, CoordinatedTurn, CurrentStatistical, KnownTurn, PhysicalBox, RandomWalk,
    Singer, SortBox, StepBox,
};
use pursuit_estimation::nonlinear::{LinearizedMotion, LinearizedSensor, NonlinearMotion, NonlinearSensor, Unscented};
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::qu2010::{Extrapolator, Points};
use pursuit_estimation::zhai2024::{LikelihoodNoiseFilter, VarianceEstimate, VarianceParams, VarianceRule};
use pursuit_estimation::zhu2014::{HalfIntervalFilter, Zhu2014Params};
use pursuit_estimation::{
    EstimationError, Gaussian, Imm, LinearMeasurement, MotionModel, Result, Sojourn, Switching, Transition,
};

type Two = SVector<f64, 2>;
type Four = SVector<f64, 4>;

const STEPS_S: [f64; 5] = [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
const VALUES: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

fn start() -> Gaussian<4> {
    Gaussian::from_variances(Four::from([1.0, 2.0, 3.0, 4.0]), Four::repeat(2.0)).unwrap()
}

fn step() -> Transition<4> {
    ConstantVelocity::<2>::white(1.0).over(0.5).unwrap()
}

fn sensor() -> LinearMeasurement<2, 4> {
    LinearMeasurement::select([0, 1], [1.0, 1.0]).unwrap()
}

/// Perfect, and reading one component twice: no innovation of it can be inverted.
fn singular() -> LinearMeasurement<2, 4> {
    LinearMeasurement::select([0, 0], [0.0, 0.0]).unwrap()
}

/// A transition that overflows any state.
fn blow() -> Transition<4> {
    Transition::new(SMatrix::identity() * 1e200, SMatrix::zeros()).unwrap()
}

#[track_caller]
fn not_finite<T: std::fmt::Debug>(result: Result<T>) {
    assert!(matches!(result, Err(EstimationError::NotFinite { .. })), "{result:?}");
}

#[track_caller]
fn overflow<T: std::fmt::Debug>(result: Result<T>) {
    assert!(matches!(result, Err(EstimationError::Overflow { .. })), "{result:?}");
}

#[track_caller]
fn not_invertible<T: std::fmt::Debug>(result: Result<T>) {
    assert!(matches!(result, Err(EstimationError::NotInvertible { .. })), "{result:?}");
}

#[track_caller]
fn impossible<T: std::fmt::Debug>(result: Result<T>) {
    assert!(matches!(result, Err(EstimationError::Impossible { .. })), "{result:?}");
}

#[track_caller]
fn time_step<T: std::fmt::Debug>(result: Result<T>) {
    assert!(matches!(result, Err(EstimationError::TimeStep { .. })), "{result:?}");
}

#[track_caller]
fn singular_innovation<T: std::fmt::Debug>(result: Result<T>) {
    assert!(matches!(result, Err(EstimationError::SingularInnovation { .. })), "{result:?}");
}

/// Calls `bad` on `filter`, which must end as `look` saw it at first.
#[track_caller]
fn unchanged<F, L: PartialEq + std::fmt::Debug, T>(
    filter: &mut F,
    look: impl Fn(&F) -> L,
    bad: impl FnOnce(&mut F) -> Result<T>,
) -> Result<T> {
    let before = look(filter);
    let result = bad(filter);
    assert_eq!(look(filter), before);
    result
}

#[test]
fn every_motion_model_refuses_a_step_that_is_none() {
    for dt_s in STEPS_S {
        time_step(ConstantVelocity::<2>::white(1.0).over(dt_s));
        time_step(ConstantVelocity::<2>::piecewise(1.0).over(dt_s));
        time_step(ConstantAcceleration::<1>::per_step(1.0).over(dt_s));
        time_step(RandomWalk::<3>::white(1.0).over(dt_s));
        time_step(Singer::<1> { rate_per_s: 1.0, acceleration_variance: 1.0 }.over(dt_s));
        time_step(KnownTurn { rate_rad_per_s: 1.0, acceleration_density: 1.0 }.over(dt_s));
        time_step(StepBox::ball().over(dt_s));
        time_step(PhysicalBox { acceleration_density: 1.0, size_density: 1.0, position_density: 0.0 }.over(dt_s));
        time_step(SortBox::sort2016(1.0).unwrap().over(dt_s));
        let current = CurrentStatistical::<1> { rate_per_s: 1.0, max_acceleration: 1.0 };
        time_step(current.over_from(&SVector::<f64, 3>::zeros(), dt_s));
        time_step(Sojourn::new([1.0, 1.0]).unwrap().over(dt_s));
    }
}

#[test]
fn kalman_fading_sequential_and_delayed() {
    let mut it = start();
    overflow(unchanged(&mut it, |b| *b, |b| b.predict(&blow())));
    overflow(unchanged(&mut it, |b| *b, |b| b.predict_fading(&blow(), 1.1)));
    assert!(unchanged(&mut it, |b| *b, |b| b.predict_fading(&step(), f64::NAN)).is_err());
    let correlated = sensor().with_noise(SMatrix::<f64, 2, 2>::new(1.0, 0.5, 0.5, 1.0)).unwrap();
    let last = {
        let prior = it;
        let innovation = it.update(&sensor(), &Two::zeros()).unwrap();
        LastUpdate { prior, measurement: sensor(), innovation }
    };
    for bad in VALUES {
        // The second component, so that a filter which takes them one by one has begun.
        let z = Two::from([1.0, bad]);
        not_finite(unchanged(&mut it, |b| *b, |b| b.update(&sensor(), &z)));
        not_finite(unchanged(&mut it, |b| *b, |b| b.update(&correlated, &z)));
        not_finite(unchanged(&mut it, |b| *b, |b| b.update_sequentially(&sensor(), &z)));
        not_finite(unchanged(&mut it, |b| *b, |b| b.update_delayed(&last, &step(), &sensor(), &z)));
    }
    singular_innovation(unchanged(&mut it, |b| *b, |b| b.update(&singular(), &Two::zeros())));
    singular_innovation(unchanged(&mut it, |b| *b, |b| b.update_sequentially(&singular(), &Two::zeros())));
    singular_innovation(unchanged(&mut it, |b| *b, |b| b.update_delayed(&last, &step(), &singular(), &Two::zeros())));
    let stuck = Transition::new(SMatrix::<f64, 4, 4>::zeros(), SMatrix::identity()).unwrap();
    not_invertible(unchanged(&mut it, |b| *b, |b| b.update_delayed(&last, &stuck, &sensor(), &Two::zeros())));

    let mut replay = Replay::new(ConstantVelocity::<2>::white(1.0), start(), 0.0, 4).unwrap();
    replay.update(1.0, &sensor(), &Two::zeros()).unwrap();
    let look = |r: &Replay<_, 2, 4>| r.latest().map(|(time_s, belief)| (time_s, *belief));
    not_finite(unchanged(&mut replay, look, |r| r.update(f64::NAN, &sensor(), &Two::zeros())));
    time_step(unchanged(&mut replay, look, |r| r.update(-1.0, &sensor(), &Two::zeros())));
    not_finite(unchanged(&mut replay, look, |r| r.update(0.5, &sensor(), &Two::from([f64::NAN, 0.0]))));
    singular_innovation(unchanged(&mut replay, look, |r| r.update(0.5, &singular(), &Two::zeros())));

    let mut run = vec![start(), Gaussian::from_variances(Four::repeat(1e300), Four::repeat(1e300)).unwrap()];
    assert!(unchanged(&mut run, Clone::clone, |run| smooth(run, &[blow()])).is_err());
}

#[test]
fn square_root_and_steady_state() {
    let mut root = SquareRoot::new(&start()).unwrap();
    let mut far = SquareRoot::new(&Gaussian::from_variances(Four::repeat(1e200), Four::repeat(1.0)).unwrap()).unwrap();
    overflow(unchanged(&mut far, |b| *b, |b| b.predict(&blow())));
    not_finite(unchanged(&mut root, |b| *b, |b| b.update(&sensor(), &Two::from([f64::NAN, 0.0]))));
    singular_innovation(unchanged(&mut root, |b| *b, |b| b.update(&singular(), &Two::zeros())));

    let steady = SteadyState::solve(&step(), &sensor()).unwrap();
    let mut state = Four::repeat(1.0);
    not_finite(unchanged(&mut state, |s| *s, |s| steady.step(s, &Two::from([0.0, f64::NAN]))));
    let mut huge = Four::repeat(f64::MAX);
    overflow(unchanged(&mut huge, |s| *s, |s| steady.step(s, &Two::repeat(-f64::MAX))));
}

#[test]
fn adaptation_and_input_estimation() {
    let mut learnt = MeasurementNoiseAdaptation::new(*sensor().noise(), 0.1).unwrap();
    assert!(unchanged(&mut learnt, |a| *a, |a| a.learn(&start(), &sensor(), &Two::from([f64::NAN, 0.0]))).is_err());

    let input = SMatrix::<f64, 4, 2>::new(0.1, 0.0, 0.0, 0.1, 0.5, 0.0, 0.0, 0.5);
    let mut watching = InputEstimator::<2, 4, 2, 5>::new(start(), 9.0).unwrap();
    watching.step(&step(), &input, &sensor(), &Two::zeros()).unwrap();
    let look = |w: &InputEstimator<2, 4, 2, 5>| format!("{w:?}");
    for bad in VALUES {
        let z = Two::from([bad, 0.0]);
        not_finite(unchanged(&mut watching, look, |w| w.step(&step(), &input, &sensor(), &z)));
    }
    singular_innovation(unchanged(&mut watching, look, |w| w.step(&step(), &input, &singular(), &Two::zeros())));
    overflow(unchanged(&mut watching, look, |w| w.step(&blow(), &input, &sensor(), &Two::zeros())));
    overflow(unchanged(&mut watching, look, |w| w.coast(&blow())));
}

#[test]
fn interacting_models() {
    let switching = Switching::per_step(SMatrix::<f64, 2, 2>::new(0.9, 0.1, 0.1, 0.9)).unwrap();
    let mut imm = Imm::new(start(), [0.5, 0.5]).unwrap();
    overflow(unchanged(&mut imm, |i| *i, |i| i.predict(&[step(), blow()], &switching)));
    not_finite(unchanged(&mut imm, |i| *i, |i| i.update(&sensor(), &Two::from([f64::NAN, 0.0]))));
    singular_innovation(unchanged(&mut imm, |i| *i, |i| i.update(&singular(), &Two::zeros())));
    singular_innovation(unchanged(&mut imm, |i| *i, |i| i.update_each(&[sensor(), singular()], &Two::zeros())));
    // So far away that the distance overflows: no mode can be told from another. And the same with one mode left.
    for chances in [[0.5, 0.5], [1.0, 0.0]] {
        for far in [1e155, 1e200, -1e300] {
            let mut imm = Imm::new(start(), chances).unwrap();
            impossible(unchanged(&mut imm, |i| *i, |i| i.update(&sensor(), &Two::from([far, 0.0]))));
        }
    }
    assert!(Imm::new(start(), [0.5, 0.6]).is_err());
    assert!(Imm::new(start(), [f64::NAN, 0.5]).is_err());
}

/// A sensor that can be made to misbehave.
struct Sensor {
    noise: SMatrix<f64, 1, 1>,
    reading: f64,
}

impl NonlinearSensor<1, 5> for Sensor {
    fn expected(&self, state: &SVector<f64, 5>) -> SVector<f64, 1> {
        SVector::<f64, 1>::new(self.reading * state[0])
    }

    fn noise(&self) -> SMatrix<f64, 1, 1> {
        self.noise
    }
}

impl LinearizedSensor<1, 5> for Sensor {
    fn jacobian(&self, _: &SVector<f64, 5>) -> SMatrix<f64, 1, 5> {
        SMatrix::<f64, 1, 5>::from_fn(|_, c| if c == 0 { self.reading } else { 0.0 })
    }
}

/// Motion that answers with numbers that are not finite, or with noise that is no covariance.
struct Broken(f64);

impl NonlinearMotion<5> for Broken {
    fn advance(&self, state: &SVector<f64, 5>, _: f64) -> SVector<f64, 5> {
        state * self.0
    }

    fn noise(&self, _: &SVector<f64, 5>, _: f64) -> SMatrix<f64, 5, 5> {
        SMatrix::identity() * self.0
    }
}

impl LinearizedMotion<5> for Broken {
    fn jacobian(&self, _: &SVector<f64, 5>, _: f64) -> SMatrix<f64, 5, 5> {
        SMatrix::identity() * self.0
    }
}

#[test]
fn extended_and_unscented() {
    let motion = CoordinatedTurn { acceleration_density: 1.0, turn_density: 1.0 };
    let mut it = Gaussian::new(SVector::<f64, 5>::repeat(1.0), SMatrix::identity()).unwrap();
    let shape = Unscented::default();
    let one = |value: f64| SVector::<f64, 1>::new(value);
    let noise = |value: f64| SMatrix::<f64, 1, 1>::new(value);
    for dt_s in STEPS_S {
        time_step(unchanged(&mut it, |b| *b, |b| b.predict_extended(&motion, dt_s)));
        time_step(unchanged(&mut it, |b| *b, |b| b.predict_unscented(&motion, dt_s, &shape).map(|_| ())));
    }
    for value in VALUES {
        not_finite(unchanged(&mut it, |b| *b, |b| b.predict_extended(&Broken(value), 1.0)));
        not_finite(unchanged(&mut it, |b| *b, |b| b.predict_unscented(&Broken(value), 1.0, &shape).map(|_| ())));
        let sound = Sensor { noise: noise(1.0), reading: 1.0 };
        not_finite(unchanged(&mut it, |b| *b, |b| b.update_extended(&sound, &one(value))));
        not_finite(unchanged(&mut it, |b| *b, |b| b.update_unscented(&sound, &one(value), &shape)));
        let broken = Sensor { noise: noise(1.0), reading: value };
        not_finite(unchanged(&mut it, |b| *b, |b| b.update_extended(&broken, &one(1.0))));
        not_finite(unchanged(&mut it, |b| *b, |b| b.update_unscented(&broken, &one(1.0), &shape)));
    }
    let negative = |result: Result<()>| {
        assert!(matches!(result, Err(EstimationError::NotPositive { .. })), "{result:?}");
    };
    negative(unchanged(&mut it, |b| *b, |b| b.predict_extended(&Broken(-1.0), 1.0)));
    negative(unchanged(&mut it, |b| *b, |b| b.predict_unscented(&Broken(-1.0), 1.0, &shape).map(|_| ())));
    let sensor = Sensor { noise: noise(-0.5), reading: 1.0 };
    negative(unchanged(&mut it, |b| *b, |b| b.update_extended(&sensor, &one(1.0)).map(|_| ())));
    negative(unchanged(&mut it, |b| *b, |b| b.update_unscented(&sensor, &one(1.0), &shape).map(|_| ())));
    // A perfect sensor of nothing.
    let blind = Sensor { noise: noise(0.0), reading: 0.0 };
    singular_innovation(unchanged(&mut it, |b| *b, |b| b.update_extended(&blind, &one(1.0))));
    singular_innovation(unchanged(&mut it, |b| *b, |b| b.update_unscented(&blind, &one(1.0), &shape)));
    let flat = Unscented { alpha: 0.0, ..shape };
    assert!(unchanged(&mut it, |b| *b, |b| b.predict_unscented(&motion, 1.0, &flat).map(|_| ())).is_err());
}

#[test]
fn particles() {
    let mut it = ParticleFilter::from_gaussian(50, &start(), ParticleOptions::default(), 1).unwrap();
    let look = |p: &ParticleFilter<4>| (p.states().to_vec(), p.weights().to_vec(), p.log_weights().to_vec());
    let far = Transition::new(SMatrix::identity() * f64::MAX, SMatrix::zeros()).unwrap();
    overflow(unchanged(&mut it, look, |p| p.predict(&far)));
    not_finite(unchanged(&mut it, look, |p| p.predict_with(|state, _| state * f64::NAN)));
    assert!(unchanged(&mut it, look, |p| p.weigh(&[0.0; 49])).is_err());
    assert!(unchanged(&mut it, look, |p| p.weigh_plain(&[-1.0; 50])).is_err());
    for bad in [f64::NAN, f64::INFINITY] {
        not_finite(unchanged(&mut it, look, |p| p.weigh(&[bad; 50])));
        not_finite(unchanged(&mut it, look, |p| p.weigh_by(|_| bad)));
    }
    impossible(unchanged(&mut it, look, |p| p.weigh(&[f64::NEG_INFINITY; 50])));
    impossible(unchanged(&mut it, look, |p| p.weigh_plain(&[0.0; 50])));
    impossible(unchanged(&mut it, look, |p| p.weigh_by(|_| f64::NEG_INFINITY)));
    let turn = CoordinatedTurn { acceleration_density: 1.0, turn_density: 1.0 };
    let start = Gaussian::new(SVector::<f64, 5>::repeat(1.0), SMatrix::identity()).unwrap();
    let mut five = ParticleFilter::from_gaussian(5, &start, ParticleOptions::default(), 1).unwrap();
    for dt_s in STEPS_S {
        time_step(unchanged(&mut five, |p| p.states().to_vec(), |p| p.predict_nonlinear(&turn, dt_s)));
    }
    assert!(unchanged(&mut five, |p| p.states().to_vec(), |p| p.predict_nonlinear(&Broken(-1.0), 1.0)).is_err());
    assert!(ParticleFilter::from_gaussian(0, &start, ParticleOptions::default(), 1).is_err());
}

#[test]
fn the_papers_filters() {
    let mut gated = GatedFilter::new(GatedParams::recommended(0.01, 1.0), 0.0, 1.0).unwrap();
    let mut literal = LiteralFilter::new(LiteralParams::experiment_2(0.01, 1.0), 0.0, 1.0).unwrap();
    for k in 1..12 {
        gated.predict(1.0).unwrap();
        gated.update(f64::from(k * k)).unwrap();
        literal.predict(1.0).unwrap();
        literal.update(f64::from(k * k)).unwrap();
    }
    let (look, literally) = (|f: &GatedFilter| format!("{f:?}"), |f: &LiteralFilter| *f.belief());
    let mut jump = HalfIntervalFilter::new(Zhu2014Params::jump_anywhere(), start()).unwrap();
    jump.predict(1.0).unwrap();
    for dt_s in STEPS_S {
        time_step(unchanged(&mut gated, look, |f| f.predict(dt_s)));
        time_step(unchanged(&mut literal, literally, |f| f.predict(dt_s)));
        time_step(unchanged(&mut jump, |f| *f, |f| f.predict(dt_s)));
    }
    for bad in VALUES {
        not_finite(unchanged(&mut gated, look, |f| f.update(bad)));
        not_finite(unchanged(&mut literal, literally, |f| f.update(bad)));
        not_finite(unchanged(&mut jump, |f| *f, |f| f.update(&Two::from([0.0, bad]))));
    }
    assert!(GatedFilter::new(GatedParams::recommended(0.01, -1.0), 0.0, 0.0).is_err());
    assert!(GatedFilter::new(GatedParams::recommended(0.01, 1.0), f64::NAN, 0.0).is_err());
    let negative = Zhu2014Params { process_variance: -1.0, ..Zhu2014Params::jump_anywhere() };
    assert!(HalfIntervalFilter::new(negative, start()).is_err());

    let mut points = Extrapolator::new(Points::Two);
    points.observe(1.0, &Two::zeros()).unwrap();
    time_step(unchanged(&mut points, |p| *p, |p| p.observe(1.0, &Two::zeros())));
    time_step(unchanged(&mut points, |p| *p, |p| p.observe(f64::NAN, &Two::zeros())));
    not_finite(unchanged(&mut points, |p| *p, |p| p.observe(2.0, &Two::from([f64::NAN, 0.0]))));

    let params = VarianceParams::unbounded(VarianceRule::Corrected);
    let mut variance = VarianceEstimate::<1>::new(params).unwrap();
    not_finite(unchanged(&mut variance, |v| *v, |v| v.observe(&SVector::<f64, 1>::new(f64::NAN))));
    let mut learning =
        LikelihoodNoiseFilter::new(10, Two::zeros(), VarianceParams::for_target(20.0), ParticleOptions::default(), 1)
            .unwrap();
    let look = |f: &LikelihoodNoiseFilter| (f.particles().states().to_vec(), *f.predicted_px(), f.variance_px2());
    for dt_s in STEPS_S {
        time_step(unchanged(&mut learning, look, |f| f.predict(dt_s)));
    }
    not_finite(unchanged(&mut learning, look, |f| f.correct(&Two::from([f64::NAN, 0.0]))));
}
