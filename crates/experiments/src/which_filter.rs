//! Which filter for which motion: the table of the guide.

use super::filters::{Models, Plain, PositionFilter, Trace, mean_square, position, position_sensor, start, tuned};
use super::monte_carlo::{decades, mean, over_seeds};
use super::motions::Motion;
use super::table::number;
use super::trajectories::noisy;
use crate::ExperimentError;
use nalgebra::{SMatrix, SVector, Vector2};
use pursuit_estimation::filters::InputEstimator;
use pursuit_estimation::gao2007::{GatedFilter, GatedParams};
use pursuit_estimation::motion::{ConstantAcceleration, ConstantVelocity, CurrentStatistical, KnownTurn, Singer};
use pursuit_estimation::zhu2014::{HalfInterval, HalfIntervalFilter, Jump, Zhu2014Params};
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, MotionModel, Transition};
use serde::Serialize;
use std::fmt;

const STREAM: u64 = 31;
const TUNING_STREAM: u64 = 310;
const TUNING_SEEDS: u32 = 40;
/// First frame that counts: the filters start with the velocity unknown.
const SETTLED: usize = 10;
const STEP_S: f64 = 1.0;

type Point = Vector2<f64>;

/// Errors of one filter on every motion.
#[derive(Debug, Clone, Serialize)]
pub struct FilterErrors {
    /// The filter and its settings.
    pub filter: String,
    /// Root mean square error of the one-step prediction over that of the measurement; one for each motion.
    pub predicted: Vec<f64>,
    /// The same of the estimate.
    pub filtered: Vec<f64>,
}

/// Filters against motions.
#[derive(Debug, Clone, Serialize)]
pub struct FilterComparison {
    /// How many seeds the figures are of.
    pub seeds: u32,
    /// The motions, in the order of the figures.
    pub motions: Vec<String>,
    /// The filters.
    pub filters: Vec<FilterErrors>,
}

/// The filters of the table. Settings are the same for every motion but for the tuned one.
#[derive(Debug, Clone, Copy)]
enum Filter {
    Velocity { density: f64 },
    Acceleration { density: f64 },
    Singer,
    Current,
    InputEstimation,
    ImmVelocity { quiet: f64, agile: f64 },
    ImmAcceleration { quiet: f64, agile: f64 },
    ImmTurn,
    Gated,
    Jump,
}

impl Filter {
    fn start(self, sigma_px: f64, first: &Point) -> Result<Box<dyn PositionFilter<2>>, EstimationError> {
        let r = sigma_px * sigma_px;
        let velocity = |q: f64| ConstantVelocity::<2>::white(q).over(STEP_S);
        let acceleration = |q: f64| ConstantAcceleration::<2>::white(q).over(STEP_S);
        let (four, six) = (unknown::<4>(first, r)?, unknown::<6>(first, r)?);
        let sensor = position_sensor::<2, 4>(r)?;
        let sensor_six = position_sensor::<2, 6>(r)?;
        Ok(match self {
            Self::Velocity { density } => Box::new(Plain { transition: velocity(density)?, sensor, belief: four }),
            Self::Acceleration { density } => {
                Box::new(Plain { transition: acceleration(density)?, sensor: sensor_six, belief: six })
            }
            Self::Singer => {
                let model = Singer::<2> { rate_per_s: 0.2, acceleration_variance: 0.25 };
                Box::new(Plain { transition: model.over(STEP_S)?, sensor: sensor_six, belief: six })
            }
            Self::Current => {
                let model = CurrentStatistical::<2> { rate_per_s: 0.1, max_acceleration: 4.0 };
                Box::new(Current { model, sensor: sensor_six, belief: six })
            }
            Self::InputEstimation => {
                Box::new(Input { filter: InputEstimator::new(four, 9.0)?, transition: velocity(1e-3)?, sensor })
            }
            Self::ImmVelocity { quiet, agile } => {
                Box::new(Models::new([velocity(quiet)?, velocity(agile)?], [0.95; 2], sensor, four)?)
            }
            Self::ImmAcceleration { quiet, agile } => {
                let transitions = [forgetful(&velocity(quiet)?)?, acceleration(agile)?];
                Box::new(Models::new(transitions, [0.95; 2], sensor_six, six)?)
            }
            Self::ImmTurn => {
                let turn = |rate_rad_per_s: f64| KnownTurn { rate_rad_per_s, acceleration_density: 1e-3 }.over(STEP_S);
                let transitions = [velocity(1e-3)?, velocity(4.0)?, turn(0.06)?, turn(-0.06)?];
                Box::new(Models::new(transitions, [0.95; 4], sensor, four)?)
            }
            Self::Gated => {
                let axis = |k: usize| GatedFilter::new(GatedParams::recommended(0.01 * r, r), first[k], 0.0);
                Box::new(Axes([axis(0)?, axis(1)?]))
            }
            Self::Jump => {
                let params = Zhu2014Params {
                    process_variance: 0.01,
                    measurement_variance_px2: r,
                    threshold: 9.21,
                    half_interval: HalfInterval::JumpAnywhere { jump: Jump::default_for(STEP_S) },
                };
                Box::new(HalfIntervalFilter::new(params, four)?)
            }
        })
    }
}

/// A start at the first measurement, with velocity (and acceleration) unknown.
fn unknown<const N: usize>(first: &Point, variance: f64) -> Result<Gaussian<N>, EstimationError> {
    let mean = *start::<2, N>(first, &Point::zeros())?.mean();
    let variances = SVector::from_fn(|i, _| match i / 2 {
        0 => variance,
        1 => 25.0,
        _ => 1.0,
    });
    Gaussian::from_variances(mean, variances)
}

/// Constant velocity over the state of constant acceleration: the acceleration is put to zero.
fn forgetful(step: &Transition<4>) -> Result<Transition<6>, EstimationError> {
    let (mut matrix, mut noise) = (SMatrix::<f64, 6, 6>::zeros(), SMatrix::<f64, 6, 6>::zeros());
    matrix.fixed_view_mut::<4, 4>(0, 0).copy_from(step.matrix());
    noise.fixed_view_mut::<4, 4>(0, 0).copy_from(step.noise());
    Transition::new(matrix, noise)
}

/// One gated filter for each axis.
struct Axes([GatedFilter; 2]);

impl PositionFilter<2> for Axes {
    fn step(&mut self, measured: &Point) -> Result<[Point; 2], EstimationError> {
        let [mut before, mut after] = [Point::zeros(); 2];
        for (axis, filter) in self.0.iter_mut().enumerate() {
            let [prior, posterior] = filter.step(&SVector::<f64, 1>::new(measured[axis]))?;
            (before[axis], after[axis]) = (prior[0], posterior[0]);
        }
        Ok([before, after])
    }
}

struct Current {
    model: CurrentStatistical<2>,
    sensor: LinearMeasurement<2, 6>,
    belief: Gaussian<6>,
}

impl PositionFilter<2> for Current {
    fn step(&mut self, measured: &Point) -> Result<[Point; 2], EstimationError> {
        self.belief.predict(&self.model.over_from(self.belief.mean(), STEP_S)?)?;
        let before = position(self.belief.mean());
        self.belief.update(&self.sensor, measured)?;
        Ok([before, position(self.belief.mean())])
    }
}

struct Input {
    filter: InputEstimator<2, 4, 2, 10>,
    transition: Transition<4>,
    sensor: LinearMeasurement<2, 4>,
}

impl PositionFilter<2> for Input {
    fn step(&mut self, measured: &Point) -> Result<[Point; 2], EstimationError> {
        let before = position(self.filter.belief().predicted(&self.transition)?.mean());
        let input =
            SMatrix::<f64, 4, 2>::new(STEP_S * STEP_S / 2.0, 0.0, 0.0, STEP_S * STEP_S / 2.0, STEP_S, 0.0, 0.0, STEP_S);
        self.filter.step(&self.transition, &input, &self.sensor, measured)?;
        Ok([before, position(self.filter.belief().mean())])
    }
}

/// Root mean square errors of prediction and estimate over that of the measurement.
fn errors(motion: Motion, filter: Filter, seeds: u32, stream: u64) -> Result<[f64; 2], ExperimentError> {
    let all = over_seeds(seeds, stream, |random| {
        let path = motion.path(random);
        let measured = noisy(&path, motion.sigma_px(), random);
        let first = measured.first().copied().unwrap_or_default();
        let trace = Trace::of(&mut *filter.start(motion.sigma_px(), &first)?, &measured)?;
        let of = |points: &[Point]| mean_square(points, &path, |k| k >= SETTLED);
        Ok([of(&measured), of(&trace.predicted), of(&trace.filtered)])
    })?;
    let [measured, predicted, filtered] = [0, 1, 2].map(|k| mean(all.iter().map(|e| e[k])));
    Ok([(predicted / measured).sqrt(), (filtered / measured).sqrt()])
}

/// Runs every filter on every motion.
///
/// # Errors
/// [`ExperimentError::Usage`] for no seeds at all; otherwise an error of a filter, which on these inputs is a defect.
pub fn which_filter(seeds: u32) -> Result<FilterComparison, ExperimentError> {
    if seeds == 0 {
        return Err(ExperimentError::usage("a comparison needs one seed at least"));
    }
    let fixed = [
        ("CV, untuned (q .01)", Filter::Velocity { density: 0.01 }),
        ("CA (q .01)", Filter::Acceleration { density: 0.01 }),
        ("Singer (α .2, σ_a .5)", Filter::Singer),
        ("current statistical (α .1, a_max 4)", Filter::Current),
        ("input estimation (10 steps)", Filter::InputEstimation),
        ("IMM CV(.001) + CV(4)", Filter::ImmVelocity { quiet: 1e-3, agile: 4.0 }),
        ("IMM CV(.001) + CA(.3)", Filter::ImmAcceleration { quiet: 1e-3, agile: 0.3 }),
        ("IMM CV(.001) + CV(4) + CT(±.06)", Filter::ImmTurn),
        ("gated LS-SVM, gao2007 (q/R .01)", Filter::Gated),
        ("jump, zhu2014 (Q .01 I)", Filter::Jump),
    ];
    let mut filters = vec![tuned_row(seeds)?];
    for (name, filter) in fixed {
        let [mut predicted, mut filtered] = [Vec::new(), Vec::new()];
        for motion in Motion::ALL {
            let [before, after] = errors(motion, filter, seeds, STREAM)?;
            predicted.push(before);
            filtered.push(after);
        }
        filters.push(FilterErrors { filter: name.to_owned(), predicted, filtered });
    }
    let motions = Motion::ALL.map(|m| m.name().to_owned()).to_vec();
    Ok(FilterComparison { seeds, motions, filters })
}

/// Constant velocity, tuned for the prediction of each motion on seeds of its own.
fn tuned_row(seeds: u32) -> Result<FilterErrors, ExperimentError> {
    let [mut predicted, mut filtered] = [Vec::new(), Vec::new()];
    for motion in Motion::ALL {
        let density = tuned(&decades(1e-6, 1e3, 4), |density| {
            let [before, _] = errors(motion, Filter::Velocity { density }, TUNING_SEEDS, TUNING_STREAM)?;
            Ok(before)
        })?;
        let [before, after] = errors(motion, Filter::Velocity { density }, seeds, STREAM)?;
        predicted.push(before);
        filtered.push(after);
    }
    Ok(FilterErrors { filter: "CV, tuned for each motion".to_owned(), predicted, filtered })
}

impl fmt::Display for FilterComparison {
    /// Two tables in Markdown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (title, of) in [("prediction", 0), ("estimate", 1)] {
            writeln!(f, "RMSE of the {title} over RMSE of the measurement, {} seeds\n", self.seeds)?;
            writeln!(f, "| filter | {} |", self.motions.join(" | "))?;
            writeln!(f, "|---|{}", "---:|".repeat(self.motions.len()))?;
            for row in &self.filters {
                let values = if of == 0 { &row.predicted } else { &row.filtered };
                let cells: Vec<String> = values.iter().map(|v| number(*v)).collect();
                writeln!(f, "| {} | {} |", row.filter, cells.join(" | "))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quiet_filters_suit_lines_and_agile_turns() {
        let quiet = |motion| errors(motion, Filter::Velocity { density: 1e-4 }, 5, STREAM).unwrap()[1];
        let agile = |motion| errors(motion, Filter::Velocity { density: 1.0 }, 5, STREAM).unwrap()[1];
        assert!(quiet(Motion::Straight) < agile(Motion::Straight));
        assert!(quiet(Motion::Turn) > agile(Motion::Turn));
    }

    #[test]
    fn the_table_has_every_filter_and_motion() {
        let comparison = which_filter(1).unwrap();
        assert_eq!((comparison.filters.len(), comparison.motions.len()), (11, 6));
        let text = comparison.to_string();
        assert_eq!(text.lines().filter(|l| l.starts_with("| ")).count(), 24, "{text}");
        assert!(comparison.filters.iter().all(|f| f.predicted.iter().chain(&f.filtered).all(|v| v.is_finite())));
    }

    /// The geometric mean over the motions of the prediction's errors, on the seeds for tuning.
    fn over_motions(filter: Filter) -> f64 {
        let logarithms = Motion::ALL.map(|motion| {
            let [predicted, _] = errors(motion, filter, TUNING_SEEDS, TUNING_STREAM).unwrap();
            predicted.ln()
        });
        mean(logarithms).exp()
    }

    /// The least of a grid of quiet and agile densities, which it prints.
    fn best_of_grid(name: &str, agile: [f64; 5], filter: fn(f64, f64) -> Filter) -> f64 {
        println!("{name}: quiet density down, agile density {agile:?} across");
        let mut best = f64::INFINITY;
        for quiet in [1e-4, 3e-4, 1e-3, 3e-3, 1e-2] {
            let row = agile.map(|agile| over_motions(filter(quiet, agile)));
            println!("{quiet}: {row:.3?}");
            best = row.into_iter().fold(best, f64::min);
        }
        best
    }

    #[test]
    #[ignore = "release: 50 filters on 240 paths each"]
    fn interacting_models_densities_are_near_grid_best() {
        let velocity = |quiet, agile| Filter::ImmVelocity { quiet, agile };
        let acceleration = |quiet, agile| Filter::ImmAcceleration { quiet, agile };
        let best = best_of_grid("CV + CV", [0.25, 1.0, 4.0, 16.0, 64.0], velocity);
        let ours = over_motions(velocity(1e-3, 4.0));
        assert!(ours < 1.05 * best, "{ours} against {best}");
        let best = best_of_grid("CV + CA", [0.02, 0.1, 0.3, 1.0, 4.0], acceleration);
        let ours = over_motions(acceleration(1e-3, 0.3));
        assert!(ours < 1.05 * best, "{ours} against {best}");
    }
}
