//! `qu2010` §4: a constant-acceleration filter predicts a simulated walk.
//!
//! The paper prints no numbers, one sentence: the *predicted* value is nearer the truth than the measured one. Two
//! readings of the truth are tried, with process noise of the printed `Q` (A) and without (B).

mod params;
mod pictures;
mod simplified;

use super::Paper;
use super::filters::{Models, Plain, Trace, mean_square, position_sensor, tuned};
use super::monte_carlo::{decades, mean, over_seeds, share, with_quantiles};
use super::random::Random;
use super::result::{Bar, Finding, Reproduction, Row, Spread};
use super::table::number;
use crate::ExperimentError;
use nalgebra::{SMatrix, SVector, Vector2};
use params::{Comparison, Simulation};
use pursuit_estimation::filters::SteadyState;
use pursuit_estimation::motion::ConstantAcceleration;
use pursuit_estimation::{EstimationError, MotionModel};

/// Stream of the random numbers of the table, and of those that filters are tuned on.
const STREAM: u64 = 2010;
const TUNING_STREAM: u64 = 20_100;

type Point = Vector2<f64>;

/// What moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Truth {
    /// Driven by noise of covariance `Q`.
    Driven,
    /// Constant acceleration.
    Deterministic,
}

impl Truth {
    const ALL: [Self; 2] = [Self::Driven, Self::Deterministic];

    const fn name(self) -> &'static str {
        match self {
            Self::Driven => "A: the truth has process noise Q",
            Self::Deterministic => "B: the truth has none",
        }
    }
}

/// A walk and its measurements; index 0 is the start, which is known and not measured.
struct Walk {
    truth: Vec<Point>,
    measured: Vec<Point>,
}

fn walk(sim: &Simulation, truth: Truth, process_variance: f64, random: &mut Random) -> Result<Walk, ExperimentError> {
    let step = ConstantAcceleration::<2>::per_step(process_variance).over(sim.step_s)?;
    let (driven, noise) = (f64::from(u8::from(truth == Truth::Driven)), process_variance.sqrt());
    let sigma = sim.measurement_variance.sqrt();
    let mut state = initial(sim);
    let mut walk = Walk { truth: vec![state.fixed_rows::<2>(0).into()], measured: vec![sim.start.into()] };
    for _ in 0..sim.steps {
        state = step.matrix() * state + SVector::from_fn(|_, _| driven * noise * random.normal());
        let at: Point = state.fixed_rows::<2>(0).into();
        walk.truth.push(at);
        walk.measured.push(at + Point::from_fn(|_, _| sigma * random.normal()));
    }
    Ok(walk)
}

fn initial(sim: &Simulation) -> SVector<f64, 6> {
    let ([x, y], [vx, vy], [ax, ay]) = (sim.start, sim.velocity, sim.acceleration);
    SVector::from([x, y, vx, vy, ax, ay])
}

/// The filter of equations (4) to (9) with `Q = q E₆`, started from `mean` and `P₀ = E₆`.
fn filter(sim: &Simulation, q: f64, mean: SVector<f64, 6>) -> Result<Plain<2, 6>, EstimationError> {
    let transition = ConstantAcceleration::<2>::per_step(q).over(sim.step_s)?;
    let belief = pursuit_estimation::Gaussian::from_variances(mean, SVector::repeat(1.0))?;
    Ok(Plain { transition, sensor: position_sensor(sim.measurement_variance)?, belief })
}

/// Two constant-acceleration models, one of the paper's noise and a quiet one.
fn models(sim: &Simulation) -> Result<Models<2, 6, 2>, EstimationError> {
    let step = |q: f64| ConstantAcceleration::<2>::per_step(q).over(sim.step_s);
    let transitions = [step(Comparison::QUIET_VARIANCE)?, step(sim.process_variance)?];
    let belief = filter(sim, sim.process_variance, initial(sim))?.belief;
    Models::new(transitions, [Comparison::STAY; 2], position_sensor(sim.measurement_variance)?, belief)
}

/// Mean square errors of one seed.
#[derive(Debug, Clone, Copy)]
struct Errors {
    measured: f64,
    predicted: f64,
    filtered: f64,
}

fn errors(walk: &Walk, trace: &Trace<2>, steps: std::ops::RangeInclusive<usize>) -> Errors {
    let of = |path: &[Point]| mean_square(path, &walk.truth, |k| steps.contains(&k));
    Errors { measured: of(&walk.measured), predicted: of(&trace.predicted), filtered: of(&trace.filtered) }
}

/// Root mean square over all seeds relative to that of the measurement, with the quantiles over the seeds.
fn ratio(all: &[Errors], of: impl Fn(&Errors) -> f64) -> Spread {
    let whole = mean(all.iter().map(&of)) / mean(all.iter().map(|e| e.measured));
    with_quantiles(whole.sqrt(), all.iter().map(|e| (of(e) / e.measured).sqrt()))
}

/// The errors of the printed filter (or of another `q`) over the seeds, walks driven by noise of the same `q`.
fn printed(seeds: u32, truth: Truth, q: f64, steps: usize) -> Result<Vec<Errors>, ExperimentError> {
    let sim = Simulation::QU2010;
    over_seeds(seeds, STREAM, |random| {
        let walk = walk(&sim, truth, q, random)?;
        let trace = Trace::of(&mut filter(&sim, q, initial(&sim))?, &walk.measured)?;
        Ok(errors(&walk, &trace, 1..=steps))
    })
}

/// The same from a zero state, after it has settled.
fn from_zero(seeds: u32, truth: Truth) -> Result<Vec<Errors>, ExperimentError> {
    let sim = Simulation::QU2010;
    over_seeds(seeds, STREAM, |random| {
        let walk = walk(&sim, truth, sim.process_variance, random)?;
        let trace = Trace::of(&mut filter(&sim, sim.process_variance, SVector::zeros())?, &walk.measured)?;
        Ok(errors(&walk, &trace, Comparison::BURN_IN + 1..=sim.steps))
    })
}

/// Errors of the tuned plain filter, its `q`, and the errors of the interacting models, on walks of the printed noise.
fn beside(seeds: u32, truth: Truth) -> Result<(Vec<Errors>, f64, Vec<Errors>), ExperimentError> {
    let sim = Simulation::QU2010;
    let plain = |seeds, stream, q| {
        over_seeds(seeds, stream, |random| {
            let walk = walk(&sim, truth, sim.process_variance, random)?;
            let trace = Trace::of(&mut filter(&sim, q, initial(&sim))?, &walk.measured)?;
            Ok(errors(&walk, &trace, 1..=sim.steps))
        })
    };
    let q = tuned(&decades(1e-8, 10.0, 2), |q| {
        let all = plain(Comparison::TUNING_SEEDS, TUNING_STREAM, q)?;
        Ok(mean(all.iter().map(|e| e.predicted)))
    })?;
    let imm = over_seeds(seeds, STREAM, |random| {
        let walk = walk(&sim, truth, sim.process_variance, random)?;
        let trace = Trace::of(&mut models(&sim)?, &walk.measured)?;
        Ok(errors(&walk, &trace, 1..=sim.steps))
    })?;
    Ok((plain(seeds, STREAM, q)?, q, imm))
}

/// The rows of one reading of the truth, and the tuned `q`.
fn rows(seeds: u32, truth: Truth) -> Result<(Vec<Row>, f64), ExperimentError> {
    let sim = Simulation::QU2010;
    // The independent reference: prediction at N = 50 and 20, filtered at both, from zero, seeds with a better estimate.
    let [predicted, predicted_20, filtered, filtered_20, zero, zero_filtered, better] = match truth {
        Truth::Driven => [1.926, 1.860, 0.884, 0.872, 1.969, 0.890, 0.994],
        Truth::Deterministic => [1.494, 1.455, 0.848, 0.839, 1.515, 0.852, 1.0],
    };
    let q = sim.process_variance;
    let (all, short, settled) =
        (printed(seeds, truth, q, sim.steps)?, printed(seeds, truth, q, 20)?, from_zero(seeds, truth)?);
    let (plain, tuned_q, imm) = beside(seeds, truth)?;
    let row = |figure: &str, ours: Spread, reference: f64| Row::new(truth.name(), figure, ours).reference(reference);
    let (p, f) = (|e: &Errors| e.predicted, |e: &Errors| e.filtered);
    let better_predicted = share(&all, |e| e.predicted < e.measured);
    let better_filtered = share(&all, |e| e.filtered < e.measured);
    let rows = vec![
        row("predicted / measured RMSE, 50 steps", ratio(&all, p), predicted)
            .beside(ratio(&plain, p).value, ratio(&imm, p).value)
            .bar(Bar::Within { of: predicted, relative: 0.02 }),
        row("predicted / measured RMSE, must exceed 1", ratio(&all, p), predicted).bar(Bar::Above(1.0)),
        row("filtered / measured RMSE, 50 steps", ratio(&all, f), filtered)
            .beside(ratio(&plain, f).value, ratio(&imm, f).value)
            .bar(Bar::Within { of: filtered, relative: 0.015 }),
        row("predicted / measured RMSE, 20 steps", ratio(&short, p), predicted_20),
        row("filtered / measured RMSE, 20 steps", ratio(&short, f), filtered_20),
        row("predicted / measured, from zero, settled", ratio(&settled, p), zero),
        row("filtered / measured, from zero, settled", ratio(&settled, f), zero_filtered),
        row("share of seeds, prediction better", better_predicted.into(), 0.0).bar(Bar::AtMost(0.0)),
        row("share of seeds, estimate better", better_filtered.into(), better),
    ];
    Ok((rows, tuned_q))
}

/// Prediction over measurement of the settled filter, exactly: no random numbers.
fn settled(q: f64, truth: Truth) -> Result<f64, ExperimentError> {
    let sim = Simulation::QU2010;
    let transition = ConstantAcceleration::<2>::per_step(q).over(sim.step_s)?;
    let steady = SteadyState::solve(&transition, &position_sensor::<2, 6>(sim.measurement_variance)?)?;
    let noise = match truth {
        Truth::Driven => *transition.noise(),
        Truth::Deterministic => SMatrix::zeros(),
    };
    let (prior, _) = steady.error_on(&noise)?;
    Ok((prior[(0, 0)] / sim.measurement_variance).sqrt())
}

/// [`settled`] for smaller noise, in both readings.
fn sweep() -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    for (q, driven, deterministic) in Comparison::SWEEP {
        for (truth, letter, reference) in [(Truth::Driven, "A", driven), (Truth::Deterministic, "B", deterministic)] {
            let figure = format!("{letter}, q = {q}: predicted / measured");
            rows.push(Row::new("other Q = q I, settled, exact", figure, settled(q, truth)?).reference(reference));
        }
    }
    Ok(rows)
}

/// What holds of the paper's sentence about prediction and measurement.
fn findings(table: &[Row], tuned_q: [f64; 2]) -> Result<Vec<Finding>, ExperimentError> {
    let row =
        |truth: Truth, start: &str| table.iter().find(|r| r.setting == truth.name() && r.figure.starts_with(start));
    let ours = |start: &str| Truth::ALL.map(|t| row(t, start).map_or(f64::NAN, |r| r.ours.value));
    let tuned = |start: &str| Truth::ALL.map(|t| row(t, start).and_then(|r| r.tuned_plain).unwrap_or(f64::NAN));
    let imm = |start: &str| Truth::ALL.map(|t| row(t, start).and_then(|r| r.imm).unwrap_or(f64::NAN));
    let both = |values: [f64; 2]| format!("{} (process noise) and {} (none)", number(values[0]), number(values[1]));
    let (predicted, filtered) = ("predicted / measured RMSE, 50", "filtered / measured RMSE, 50");
    let shares = ours("share of seeds, prediction");
    let small = [settled(0.003, Truth::Driven)?, settled(0.01, Truth::Deterministic)?];
    Ok(vec![
        Finding::new(
            "§4: the error of the *predicted* value is clearly below that of the measured one (Q = 0.3 I, R = 2 I)",
            ours(predicted).iter().all(|r| *r < 1.0),
            format!(
                "one-step prediction / measurement is {}; in {} and {} of the seeds the prediction is the better one",
                both(ours(predicted)),
                number(shares[0]),
                number(shares[1]),
            ),
        ),
        Finding::new(
            "the error of the *filtered* value of equation (5) is below that of the measured one",
            ours(filtered).iter().all(|r| *r < 1.0),
            format!("filtered / measurement is {}", both(ours(filtered))),
        ),
        Finding::new(
            "a smaller Q makes the sentence true of the prediction",
            small.iter().all(|r| *r < 1.0),
            format!(
                "from q = .003 on where the walk has that little noise ({}), from q = .01 on without noise ({})",
                number(small[0]),
                number(small[1])
            ),
        ),
        Finding::new(
            "on the walk with the printed process noise some better filter predicts better than the camera measures",
            tuned(predicted)[0] < 1.0 || imm(predicted)[0] < 1.0,
            format!(
                "the best q found is {}, and prediction / measurement stays at {} (interacting models: {}); without process \
                 noise the best q found is {} and the ratio {} ({})",
                number(tuned_q[0]),
                number(tuned(predicted)[0]),
                number(imm(predicted)[0]),
                number(tuned_q[1]),
                number(tuned(predicted)[1]),
                number(imm(predicted)[1]),
            ),
        ),
    ])
}

/// Runs the experiment.
pub(super) fn run(seeds: u32) -> Result<Reproduction, ExperimentError> {
    let (mut table, q_driven) = rows(seeds, Truth::Driven)?;
    let (deterministic, q_deterministic) = rows(seeds, Truth::Deterministic)?;
    table.extend(deterministic);
    let mut findings = findings(&table, [q_driven, q_deterministic])?;
    table.extend(sweep()?);
    let (rows, more) = simplified::rows()?;
    table.extend(rows);
    findings.extend(more);
    Ok(Reproduction {
        paper: Paper::Qu2010,
        title: "a constant-acceleration filter predicts a simulated walk".into(),
        seeds,
        rows: table,
        findings,
        charts: pictures::charts(seeds)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_follow_the_papers_numbers() {
        let sim = Simulation::QU2010;
        let walk = walk(&sim, Truth::Deterministic, 0.3, &mut Random::new(0, 0)).unwrap();
        assert_eq!(walk.truth.len(), 51);
        assert_eq!(walk.truth[1], Point::new(16.9, 15.5));
        assert!((walk.truth[2] - Point::new(19.6, 15.0)).norm() < 1e-12);
    }

    #[test]
    fn estimate_beats_measurement_and_prediction_does_not() {
        for truth in Truth::ALL {
            let all = printed(20, truth, 0.3, 50).unwrap();
            assert!(ratio(&all, |e| e.predicted).value > 1.3);
            assert!(ratio(&all, |e| e.filtered).value < 0.95);
        }
    }
}
