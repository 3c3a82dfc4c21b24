//! `zhu2014`: the filter of equation (6), and the tracker.
//!
//! Equation (6): what going over an interval in halves does for a filter whose target turned inside it.
//!
//! Figures are root mean square errors of the one-step prediction, relative to those of the standard filter with the same
//! `Q`: over the five frames after a turn's own ("after a turn") and over the frames that belong to no turn ("quiet").

mod params;
mod pictures;
mod tracking;

pub use tracking::{AbsenceClip, absence_clips};

use super::Paper;
use super::filters::{Models, Plain, PositionFilter, Trace, position, position_sensor, start, tuned};
use super::monte_carlo::{decades, mean, over_seeds, quantile_of, root_mean_square, share};
use super::random::Random;
use super::result::{Bar, Finding, Reproduction, Row};
use super::table::number;
use super::trajectories::{TurningPath, noisy};
use crate::ExperimentError;
use nalgebra::{SMatrix, Vector2};
use params::{AFTER, BOOTSTRAP, JUMP_CHANCE, JUMP_DEVIATION, SIGMA_PX, Setting, TUNING, TUNING_SEEDS, variants};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::zhu2014::{HalfIntervalFilter, Zhu2014Params};
use pursuit_estimation::{EstimationError, Imm, MotionModel, Switching};

const STREAM: u64 = 2014;
const TUNING_STREAM: u64 = 20_140;
const BOOTSTRAP_STREAM: u64 = 20_141;
/// One frame per time unit.
const STEP_S: f64 = 1.0;

type Point = Vector2<f64>;

/// A filter of the experiment.
#[derive(Debug, Clone, Copy)]
enum Filter {
    Standard { q: f64 },
    Halves(Zhu2014Params),
    Models { q: f64 },
}

impl PositionFilter<2> for HalfIntervalFilter {
    fn step(&mut self, measured: &Point) -> Result<[Point; 2], EstimationError> {
        self.predict(STEP_S)?;
        let before = position(self.belief().mean());
        self.update(measured)?;
        Ok([before, position(self.belief().mean())])
    }
}

impl Filter {
    fn start(self, first: &Point, velocity: &Point) -> Result<Box<dyn PositionFilter<2>>, EstimationError> {
        let belief = start(first, velocity)?;
        let model = |q: f64| ConstantVelocity::<2>::per_step(q).over(STEP_S);
        let sensor = position_sensor(SIGMA_PX * SIGMA_PX)?;
        Ok(match self {
            Self::Standard { q } => Box::new(Plain { transition: model(q)?, sensor, belief }),
            Self::Halves(params) => Box::new(HalfIntervalFilter::new(params, belief)?),
            Self::Models { q } => {
                let quiet = model(q)?;
                let jump = quiet.with_noise(quiet.noise() + jump_noise())?;
                let chances = SMatrix::from_fn(|_, to| if to == 0 { 1.0 - JUMP_CHANCE } else { JUMP_CHANCE });
                let modes = Imm::new(belief, [1.0 - JUMP_CHANCE, JUMP_CHANCE])?;
                let switching = Switching::per_step(chances)?;
                Box::new(Models { transitions: [quiet, jump], switching, sensor, modes })
            }
        })
    }
}

/// Covariance of a velocity jump at an instant uniform over a step of one: `s² [[1/3, 1/2], [1/2, 1]]` on each axis.
fn jump_noise() -> SMatrix<f64, 4, 4> {
    let variance = JUMP_DEVIATION * JUMP_DEVIATION;
    SMatrix::from_fn(|row, column| match (row % 2 == column % 2, row / 2, column / 2) {
        (false, _, _) => 0.0,
        (true, 0, 0) => variance / 3.0,
        (true, 1, 1) => variance,
        _ => variance / 2.0,
    })
}

/// Mean squares of one seed.
#[derive(Debug, Clone, Copy)]
struct Errors {
    after: f64,
    quiet: f64,
    turn: f64,
    all: f64,
    filtered: f64,
}

fn run_once(
    setting: &Setting,
    filter: Filter,
    random: &mut Random,
) -> Result<(TurningPath, Vec<Point>, Trace<2>), ExperimentError> {
    let path = TurningPath::new(&setting.turns(), random);
    let measured = noisy(&path.positions, SIGMA_PX, random);
    let first = measured.first().copied().unwrap_or_default();
    let trace = Trace::of(&mut *filter.start(&first, &path.velocity)?, &measured)?;
    Ok((path, measured, trace))
}

fn errors(setting: &Setting, filter: Filter, seeds: u32, stream: u64) -> Result<Vec<Errors>, ExperimentError> {
    over_seeds(seeds, stream, |random| {
        let (path, _, trace) = run_once(setting, filter, random)?;
        let squares = |points: &[Point]| -> Vec<f64> {
            points.iter().zip(&path.positions).map(|(a, b)| (a - b).norm_squared()).collect()
        };
        let (predicted, filtered) = (squares(&trace.predicted), squares(&trace.filtered));
        let over = |squares: &[f64], counts: &dyn Fn(usize) -> bool| {
            // Frame 0 is the start, not a prediction.
            mean(squares.iter().enumerate().skip(1).filter(|(k, _)| counts(*k)).map(|(_, s)| *s))
        };
        let turn = |k: usize| path.turn_frames.contains(&k);
        Ok(Errors {
            after: over(&predicted, &|k| path.follows_turn(k, AFTER) && !turn(k)),
            quiet: over(&predicted, &|k| !path.follows_turn(k, AFTER) && !turn(k)),
            turn: over(&predicted, &turn),
            all: over(&predicted, &|_| true),
            filtered: over(&filtered, &|_| true),
        })
    })
}

/// Ratio of the root mean squares of two filters over all seeds.
fn ratio(ours: &[Errors], standard: &[Errors], of: impl Fn(&Errors) -> f64 + Copy) -> f64 {
    (mean(ours.iter().map(of)) / mean(standard.iter().map(of))).sqrt()
}

/// The 95 % interval of [`ratio`] after a turn, by drawing seeds with replacement.
fn interval(ours: &[Errors], standard: &[Errors]) -> [f64; 2] {
    let mut random = Random::new(BOOTSTRAP_STREAM, 0);
    let count = ours.len();
    let drawn: Vec<f64> = (0..BOOTSTRAP)
        .map(|_| {
            let (mut a, mut b) = (0.0, 0.0);
            for _ in 0..count {
                let seed = (random.uniform(0.0, count as f64) as usize).min(count - 1);
                a += ours[seed].after;
                b += standard[seed].after;
            }
            (a / b).sqrt()
        })
        .collect();
    [0.025, 0.975].map(|at| quantile_of(drawn.iter().copied(), at))
}

/// `q` of the standard filter that predicts best over all frames, on seeds of its own.
fn tuned_standard(setting: &Setting) -> Result<f64, ExperimentError> {
    let (low, high, per_decade) = TUNING;
    tuned(&decades(low, high, per_decade), |q| {
        Ok(mean(errors(setting, Filter::Standard { q }, TUNING_SEEDS, TUNING_STREAM)?.iter().map(|e| e.all)))
    })
}

/// The bars: after a turn, by setting, for the default reading.
fn bars(column: usize, name: &str) -> Option<Bar> {
    match (column, name) {
        (0, "jump anywhere, 5.99") => Some(Bar::AtMost(0.70)),
        (1, "jump anywhere, 5.99") => Some(Bar::AtMost(0.63)),
        (2, "jump anywhere, 5.99") => Some(Bar::AtMost(0.80)),
        (3, "jump anywhere, 9.21") => Some(Bar::AtMost(0.42)),
        _ => None,
    }
}

/// All rows of one setting.
fn rows(column: usize, setting: &Setting, seeds: u32) -> Result<Vec<Row>, ExperimentError> {
    let q = setting.process_variance;
    let standard = errors(setting, Filter::Standard { q }, seeds, STREAM)?;
    let tuned_q = tuned_standard(setting)?;
    let plain = errors(setting, Filter::Standard { q: tuned_q }, seeds, STREAM)?;
    let imm = errors(setting, Filter::Models { q }, seeds, STREAM)?;
    let after = |e: &Errors| e.after;
    let quiet = |e: &Errors| e.quiet;
    let mut rows = Vec::new();
    for (name, params, references) in variants(q) {
        let ours = errors(setting, Filter::Halves(params), seeds, STREAM)?;
        let bar = bars(column, name);
        let figure = format!("{name}: after a turn");
        rows.push(
            Row::new(setting.name, figure, ratio(&ours, &standard, after))
                .reference_if(references[column])
                .beside(ratio(&plain, &standard, after), ratio(&imm, &standard, after))
                .bar_if(bar),
        );
        let quiet_bar = (column == 0 && bar.is_some()).then_some(Bar::AtMost(1.03));
        rows.push(
            Row::new(setting.name, format!("{name}: quiet"), ratio(&ours, &standard, quiet))
                .beside(ratio(&plain, &standard, quiet), ratio(&imm, &standard, quiet))
                .bar_if(quiet_bar),
        );
        if bar.is_none() || column > 0 {
            continue;
        }
        let [_, upper] = interval(&ours, &standard);
        let pairs: Vec<(f64, f64)> = ours.iter().zip(&standard).map(|(a, b)| (a.after, b.after)).collect();
        rows.extend([
            Row::new(setting.name, format!("{name}: upper end of the 95 % interval"), upper)
                .reference(0.675)
                .bar(Bar::AtMost(0.75)),
            Row::new(setting.name, format!("{name}: share of seeds better"), share(&pairs, |(a, b)| a < b))
                .bar(Bar::AtLeast(0.99)),
            Row::new(setting.name, format!("{name}: the turn's own frame"), ratio(&ours, &standard, |e| e.turn))
                .reference(1.0),
            Row::new(setting.name, format!("{name}: filtered, all frames"), ratio(&ours, &standard, |e| e.filtered)),
        ]);
    }
    let own = root_mean_square(standard.iter().map(|e| e.turn.sqrt()));
    let row = Row::new(setting.name, "standard filter, the turn's own frame, px", own);
    rows.push(row.reference_if((column == 0).then_some(8.56)));
    rows.push(Row::new(setting.name, "tuned plain filter: its q", tuned_q));
    Ok(rows)
}

/// The largest difference between `A(dt/2) A(dt/2)` and `A(dt)`, over several steps.
fn halves_differ() -> Result<f64, ExperimentError> {
    let model = ConstantVelocity::<2>::per_step(1.0);
    let mut most = 0.0_f64;
    for dt_s in [1e-3, 1.0 / 30.0, 0.04, 1.0, 7.3] {
        let (half, whole) = (model.over(dt_s / 2.0)?, model.over(dt_s)?);
        most = most.max((half.matrix() * half.matrix() - whole.matrix()).abs().max());
    }
    Ok(most)
}

/// Runs the experiment.
pub(super) fn run(seeds: u32) -> Result<Reproduction, ExperimentError> {
    let difference = halves_differ()?;
    let mut table = vec![
        Row::new("equation (6) without a manoeuvre", "largest |A(dt/2) A(dt/2) − A(dt)|", difference)
            .bar(Bar::AtMost(1e-12)),
    ];
    for (column, setting) in Setting::ALL.iter().enumerate() {
        table.extend(rows(column, setting, seeds)?);
    }
    let value = |setting: usize, figure: &str| {
        let found = table.iter().find(|r| r.setting == Setting::ALL[setting].name && r.figure == figure);
        found.map_or(f64::NAN, |r| r.ours.value)
    };
    let literal = value(0, "A(dt/2) A(dt/2), Q/2 each: after a turn");
    let (jump, literal_velocity) =
        (value(0, "jump anywhere, 5.99: after a turn"), value(0, "literal: observed velocity, 9.21: after a turn"));
    let own = value(0, "jump anywhere, 5.99: the turn's own frame");
    let mut findings = vec![
        Finding::new(
            "[0061]: A(k, k−1/2) A(k−1/2, k−1) instead of A(k, k−1) corrects the prediction at a manoeuvre",
            (literal - 1.0).abs() > 0.05,
            format!(
                "the product is A(k, k−1) itself (difference {}); with Q/2 in each half the error after a 90° turn is {} \
                 of the standard filter's",
                number(difference),
                number(literal)
            ),
        ),
        Finding::new(
            "a velocity jump at an unknown instant within the interval, on detection, does",
            jump < 0.75,
            format!(
                "{} of the error in the five frames after a 90° turn; taking the observed velocity for the second half: {}",
                number(jump),
                number(literal_velocity)
            ),
        ),
        Finding::new(
            "the prediction of the turn's own frame improves",
            own < 0.99,
            format!("{} of the standard filter's error: nothing has been measured yet that could tell", number(own)),
        ),
    ];
    let (of_trackers, found) = tracking::run(seeds)?;
    table.extend(of_trackers);
    findings.extend(found);
    Ok(Reproduction {
        paper: Paper::Zhu2014,
        title: "half intervals at manoeuvres, on a target that turns sharply; TLD with and without the filter".into(),
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
    fn jumps_gain_and_halves_do_not() {
        let setting = Setting::ALL[0];
        let standard = errors(&setting, Filter::Standard { q: 1.0 }, 20, STREAM).unwrap();
        let found: Vec<f64> = variants(1.0)
            .into_iter()
            .map(|(_, params, _)| {
                ratio(&errors(&setting, Filter::Halves(params), 20, STREAM).unwrap(), &standard, |e| e.after)
            })
            .collect();
        assert!((found[0] - 1.0).abs() < 0.01, "{found:?}");
        assert!(found[4] < 0.75, "{found:?}");
    }

    #[test]
    fn halving_is_exact() {
        assert!(halves_differ().unwrap() <= 1e-15);
    }
}
