//! Every filter can be stored and read back, goes on as if it had not been, and refuses what was tampered with.

use nalgebra::{SMatrix, SVector, matrix, vector};
use pursuit_estimation::association::{JointParams, JointProbabilities};
use pursuit_estimation::consistency::Gate;
use pursuit_estimation::filters::{
    FixedLag, InputEstimator, LastUpdate, MeasurementNoiseAdaptation, ProcessNoiseScaling, Replay, SquareRoot,
    SteadyState,
};
use pursuit_estimation::fitting::Recording;
use pursuit_estimation::gao2007::{GatedFilter, GatedParams, LiteralFilter, LiteralParams};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::qu2010::{Extrapolator, Points};
use pursuit_estimation::zhai2024::{LikelihoodNoiseFilter, VarianceEstimate, VarianceParams, VarianceRule};
use pursuit_estimation::zhu2014::{HalfIntervalFilter, Zhu2014Params};
use pursuit_estimation::{
    Embedded, Gaussian, Imm, Innovation, LinearMeasurement, MotionModel, Sojourn, Switching, Transition,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bytes give the value that was stored, to the last bit; text can be read back too.
#[track_caller]
fn kept<T: Serialize + DeserializeOwned + std::fmt::Debug>(value: &T) -> T {
    let bytes = postcard::to_stdvec(value).unwrap();
    let back: T = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(postcard::to_stdvec(&back).unwrap(), bytes);
    let text = serde_json::to_string(value).unwrap();
    // Numbers in text may be off by their last digit, but they are read.
    serde_json::from_str::<T>(&text).unwrap();
    // Cut short, it is no value.
    assert!(postcard::from_bytes::<T>(&bytes[..bytes.len() - 1]).is_err());
    back
}

/// The stored text with one entry changed, at a path of keys and indices.
#[track_caller]
fn refused<T: Serialize + DeserializeOwned + std::fmt::Debug>(value: &T, path: &str, put: serde_json::Value) {
    let mut json = serde_json::to_value(value).unwrap();
    let slot =
        json.pointer_mut(path).unwrap_or_else(|| panic!("no {path} in {}", serde_json::to_string(value).unwrap()));
    *slot = put;
    let result = serde_json::from_value::<T>(json);
    assert!(result.is_err(), "{path}: {result:?}");
}

/// The stored text with its first `from` changed: for what holds numbers that a tree of values cannot.
#[track_caller]
fn refused_text<T: Serialize + DeserializeOwned + std::fmt::Debug>(value: &T, from: &str, to: &str) {
    let text = serde_json::to_string(value).unwrap();
    assert!(text.contains(from), "no {from} in {text}");
    let result = serde_json::from_str::<T>(&text.replacen(from, to, 1));
    assert!(result.is_err(), "{from}: {result:?}");
}

fn belief() -> Gaussian<4> {
    let mut it = Gaussian::from_variances(vector![1.0, 2.0, 3.0, 4.0], vector![2.0, 3.0, 4.0, 5.0]).unwrap();
    it.predict(&step()).unwrap();
    it
}

fn step() -> Transition<4> {
    ConstantVelocity::<2>::white(1.0).over(0.5).unwrap()
}

fn sensor() -> LinearMeasurement<2, 4> {
    LinearMeasurement::select([0, 1], [1.0, 2.0]).unwrap()
}

fn z(k: u32) -> SVector<f64, 2> {
    vector![2.0 * f64::from(k) + (1.3 * f64::from(k)).sin(), 3.0 - f64::from(k)]
}

#[test]
fn linear_filters() {
    let mut root = SquareRoot::new(&belief()).unwrap();
    root.update(&sensor(), &z(1)).unwrap();
    assert_eq!(kept(&root), root);
    refused(&root, "/factor/4", 1.0.into());
    refused(&root, "/factor/0", (-1.0).into());
    refused(&root, "/mean/0", serde_json::Value::Null);

    let innovation = belief().update(&sensor(), &z(1)).unwrap();
    assert_eq!(kept(&innovation), innovation);
    refused(&innovation, "/factor/0", 0.0.into());
    let sharp = {
        let mut it = Gaussian::from_variances(vector![0.0], vector![1e6]).unwrap();
        it.update(&LinearMeasurement::<2, 1>::select([0, 0], [1e-10, 1e-10]).unwrap(), &z(1)).unwrap()
    };
    assert_eq!(kept::<Innovation<2>>(&sharp), sharp);
    let last = LastUpdate { prior: belief(), measurement: sensor(), innovation };
    assert_eq!(kept(&last), last);
    let steady = SteadyState::solve(&step(), &sensor()).unwrap();
    assert_eq!(kept(&steady), steady);

    let mut learnt = MeasurementNoiseAdaptation::new(*sensor().noise(), 0.1).unwrap();
    learnt.learn(&belief(), &sensor(), &z(2)).unwrap();
    assert_eq!(kept(&learnt), learnt);
    refused(&learnt, "/weight", 0.0.into());
    refused(&learnt, "/noise/0", (-1.0).into());
    let mut scaling = ProcessNoiseScaling::new(0.1, (0.5, 20.0)).unwrap();
    scaling.learn(&Innovation::new(vector![9.0, 1.0], matrix![2.0, 0.0; 0.0, 3.0]).unwrap(), sensor().noise());
    assert_eq!(kept(&scaling), scaling);
    assert!(scaling.scale() > 1.0);
    refused(&scaling, "/scale", 21.0.into());
    refused(&scaling, "/scale", 0.4.into());
    refused(&scaling, "/limits/0", 30.0.into());
    // Limits that one lies outside of: a new one starts at one all the same.
    kept(&ProcessNoiseScaling::new(0.1, (5.0, 20.0)).unwrap());
}

#[test]
fn histories() {
    let mut replay = Replay::<_, 2, 4>::new(ConstantVelocity::<2>::white(1.0), belief(), 0.0, 3).unwrap();
    for k in 1..6 {
        replay.update(f64::from(k), &sensor(), &z(k)).unwrap();
    }
    let mut back = kept(&replay);
    assert_eq!(back, replay);
    assert_eq!(back.update(4.5, &sensor(), &z(9)).unwrap(), replay.update(4.5, &sensor(), &z(9)).unwrap());
    assert_eq!(back, replay);
    refused(&replay, "/depth", 0.into());
    refused(&replay, "/depth", 2.into());
    refused(&replay, "/depth", 70_000.into());
    refused(&replay, "/entries", serde_json::json!([]));
    refused(&replay, "/entries/1/time_s", 99.0.into());
    refused(&replay, "/entries/1/reading/1/0", serde_json::Value::Null);
    assert!(Replay::<_, 2, 4>::new(ConstantVelocity::<2>::white(1.0), belief(), 0.0, usize::MAX).is_err());

    let mut lagged = FixedLag::new(3, belief()).unwrap();
    for k in 0..5 {
        let back = kept(&lagged);
        assert_eq!(back, lagged);
        let mut after = belief();
        after.update(&sensor(), &z(k)).unwrap();
        lagged.push(&step(), &after).unwrap();
    }
    refused(&lagged, "/lag", 2.into());
    refused(&lagged, "/lag", 0.into());
    let track = Recording::new(vec![0.0, 1.0], vec![Some(z(1)), None]).unwrap();
    assert_eq!(kept(&track), track);
    refused(&track, "/times_s/1", 0.0.into());
}

#[test]
fn interacting_models() {
    let switching = Switching::per_step(matrix![0.9, 0.1; 0.2, 0.8]).unwrap();
    assert_eq!(kept(&switching), switching);
    refused(&switching, "/0", 0.5.into());
    let sojourn = Sojourn::new([1.0, 2.5, 0.3]).unwrap();
    assert_eq!(kept(&sojourn), sojourn);
    refused(&sojourn, "/0", 0.0.into());
    let imm = Imm::from_beliefs([belief(), belief()], [0.25, 0.75]).unwrap();
    assert_eq!(kept(&imm), imm);
    refused(&imm, "/probabilities/0", 0.5.into());
    let small = Embedded::new(ConstantVelocity::<1>::white(1.0), [2, 0], SVector::<f64, 3>::repeat(1.5)).unwrap();
    assert_eq!(kept(&small), small);
    refused(&small, "/indices/0", 3.into());
    refused(&small, "/indices/0", 0.into());
    let params = JointParams {
        detection_probability: 0.9,
        clutter_density: 0.1,
        gate: Gate { threshold: 9.0 },
        most_events: 10,
    };
    let joint = JointProbabilities::new(params).unwrap();
    assert_eq!(kept(&joint), joint);
    refused(&joint, "/detection_probability", 1.0.into());
}

#[test]
fn watching_for_inputs() {
    let input = SMatrix::<f64, 4, 2>::new(0.1, 0.0, 0.0, 0.1, 0.5, 0.0, 0.0, 0.5);
    let mut watching = InputEstimator::<2, 4, 2, 5>::new(belief(), 9.0).unwrap();
    for k in 0..9 {
        watching.predict(&step(), &input).unwrap();
        let mut back = kept(&watching);
        assert_eq!(back, watching);
        assert_eq!(back.update(&sensor(), &z(k)).unwrap(), watching.update(&sensor(), &z(k)).unwrap());
        assert_eq!(kept(&watching), watching);
    }
    let mut quiet = InputEstimator::<2, 4, 2, 5>::new(belief(), 1e9).unwrap();
    quiet.step(&step(), &input, &sensor(), &z(0)).unwrap();
    refused(&quiet, "/threshold", 0.0.into());
    refused(&quiet, "/steps/0/innovation/factor/0", (-1.0).into());
    quiet.predict(&step(), &input).unwrap();
    refused(&quiet, "/pending/0/0", serde_json::Value::Null);
    for k in 1..5 {
        quiet.step(&step(), &input, &sensor(), &z(k)).unwrap();
    }
    let mut json = serde_json::to_value(&quiet).unwrap();
    let first = json["steps"][0].clone();
    let steps = json["steps"].as_array_mut().unwrap();
    while steps.len() <= 5 {
        steps.push(first.clone());
    }
    assert!(serde_json::from_value::<InputEstimator<2, 4, 2, 5>>(json).is_err());
}

#[test]
fn particles() {
    let mut filter = ParticleFilter::from_gaussian(30, &belief(), ParticleOptions::default(), 7).unwrap();
    filter.predict(&step()).unwrap();
    let logs: Vec<f64> = (0..30).map(|k| if k == 3 { f64::NEG_INFINITY } else { -900.0 * f64::from(k % 2) }).collect();
    filter.weigh(&logs).unwrap();
    let mut back = kept(&filter);
    for filter in [&mut back, &mut filter] {
        filter.resample().unwrap();
        filter.predict(&step()).unwrap();
    }
    assert_eq!(back.states(), filter.states());
    refused_text(&filter, "\"weights\":[", "\"weights\":[0.5,");
    refused_text(&filter, "\"log_weights\":[", "\"log_weights\":[null,");
    refused_text(&filter, "\"states\":[", "\"states\":[[0.0,0.0,0.0,0.0],");
    refused_text(&filter, "\"threshold\":0.5", "\"threshold\":1.5");
    // Weights and their logarithms that do not agree; equal ones do.
    let equal = format!("{}", 1.0 / 30.0);
    refused_text(&filter, &equal, "0.03333433333333333");
    refused_text(&filter, &format!("{}", -(30.0_f64.ln())), "-3.3");
}

#[test]
fn the_papers_filters() {
    let mut gated = GatedFilter::new(GatedParams::recommended(0.01, 1.0), 0.0, 1.0).unwrap();
    let mut literal = LiteralFilter::new(LiteralParams::experiment_2(0.01, 1.0), 0.0, 1.0).unwrap();
    let mut jump = HalfIntervalFilter::new(Zhu2014Params::jump_anywhere(), belief()).unwrap();
    for k in 1..12 {
        gated.predict(1.0).unwrap();
        literal.predict(1.0).unwrap();
        jump.predict(1.0).unwrap();
        (gated, literal, jump) = (kept(&gated), kept(&literal), kept(&jump));
        let at = f64::from(k * k);
        gated.update(at).unwrap();
        literal.update(at).unwrap();
        jump.update(&z(k)).unwrap();
        (gated, literal, jump) = (kept(&gated), kept(&literal), kept(&jump));
    }
    // Against filters that were never stored.
    let mut straight = GatedFilter::new(GatedParams::recommended(0.01, 1.0), 0.0, 1.0).unwrap();
    let mut printed = LiteralFilter::new(LiteralParams::experiment_2(0.01, 1.0), 0.0, 1.0).unwrap();
    for k in 1..12 {
        straight.predict(1.0).unwrap();
        straight.update(f64::from(k * k)).unwrap();
        printed.predict(1.0).unwrap();
        printed.update(f64::from(k * k)).unwrap();
    }
    assert_eq!(straight, gated);
    assert_eq!(printed.belief(), literal.belief());
    refused(&gated, "/params/window", 0.into());
    refused(&gated, "/params/window", 2.into());
    refused(&gated, "/velocities", serde_json::json!([1.0]));
    refused(&gated, "/times_s", serde_json::json!([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    refused(&gated, "/now_s", serde_json::Value::Null);
    refused(&literal, "/params/samples", 1.into());
    refused(&literal, "/ratios", serde_json::json!([1.0, 1.0, 1.0]));
    refused(&literal, "/dt_s", (-1.0).into());
    jump.predict(1.0).unwrap();
    refused(&jump, "/interval/1", 0.0.into());
    refused(&jump, "/params/threshold", 0.0.into());

    let mut points = Extrapolator::new(Points::Three);
    for k in 0..5 {
        points.observe(f64::from(k), &z(k)).unwrap();
        assert_eq!(kept(&points), points);
    }
    refused(&points, "/seen/0/0", 1.0.into());
    let params = VarianceParams { rule: VarianceRule::Window { length: 3 }, ..VarianceParams::for_target(20.0) };
    let mut variance = VarianceEstimate::<2>::new(params).unwrap();
    variance.observe(&z(3)).unwrap();
    assert_eq!(kept(&variance), variance);
    refused(&variance, "/recent", serde_json::json!([]));
    refused(&variance, "/variance/0", (-1.0).into());
    refused(&variance, "/params/floor", (-1.0).into());
    let mut learning = LikelihoodNoiseFilter::new(10, z(0), params, ParticleOptions::default(), 1).unwrap();
    learning.predict(0.1).unwrap();
    learning.correct(&z(1)).unwrap();
    let mut back = kept(&learning);
    for filter in [&mut back, &mut learning] {
        filter.predict(0.1).unwrap();
    }
    assert_eq!(back.particles().states(), learning.particles().states());
    refused_text(&learning, "\"since_s\":0.1", "\"since_s\":-0.1");
    refused_text(&learning, "\"estimate_px\":[", "\"estimate_px\":[null,");
}
