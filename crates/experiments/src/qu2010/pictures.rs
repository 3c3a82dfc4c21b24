//! The pictures: Fig. 3 (both coordinates against time), the path, and how the error settles.

use super::params::Simulation;
use super::{Point, STREAM, Trace, Truth, Walk, filter, initial, walk};
use crate::ExperimentError;
use crate::monte_carlo::{over_seeds, root_mean_square};
use crate::random::Random;
use nalgebra::SVector;
use pursuit_charts::{Axis, Chart, Color, Series};

/// All pictures of the experiment.
pub(super) fn charts(seeds: u32) -> Result<Vec<(String, Chart)>, ExperimentError> {
    let sim = Simulation::QU2010;
    let shown = walk(&sim, Truth::Deterministic, sim.process_variance, &mut Random::new(STREAM, 0))?;
    let trace = Trace::of(&mut filter(&sim, sim.process_variance, SVector::zeros())?, &shown.measured)?;
    let axis = |k: usize, name: &str| against_time(&shown, &trace, k, name);
    Ok(vec![
        ("fig3a_x".into(), axis(0, "x")),
        ("fig3b_y".into(), axis(1, "y")),
        ("path".into(), path(&shown, &trace)),
        ("error".into(), settling(seeds)?),
    ])
}

/// The first twenty steps: with more, an accelerated walk leaves its errors too small to see.
const SHOWN: usize = 20;

fn against_time(walk: &Walk, trace: &Trace<2>, axis: usize, name: &str) -> Chart {
    let of = |points: &[Point]| points.iter().take(SHOWN + 1).enumerate().map(|(k, p)| (k as f64, p[axis])).collect();
    let title = format!("qu2010, Fig. 3: {name} against time, started from zero");
    Chart::new(title, Axis::new("time, s"), Axis::new(name))
        .with(Series::line("true", Color::Truth, of(&walk.truth)))
        .with(Series::points("measured", Color::Measured, of(&walk.measured)))
        .with(Series::dashed("predicted", Color::Predicted, of(&trace.predicted)))
        .with(Series::line("filtered", Color::Estimate, of(&trace.filtered)))
}

fn path(walk: &Walk, trace: &Trace<2>) -> Chart {
    let of = |points: &[Point]| points.iter().take(SHOWN + 1).map(|p| (p.x, p.y)).collect();
    Chart::new("qu2010: the walk", Axis::new("x"), Axis::new("y"))
        .with_equal_units()
        .with(Series::line("true", Color::Truth, of(&walk.truth)))
        .with(Series::points("measured", Color::Measured, of(&walk.measured)))
        .with(Series::dashed("predicted", Color::Predicted, of(&trace.predicted)))
        .with(Series::line("filtered", Color::Estimate, of(&trace.filtered)))
}

/// Root mean square error of both axes over the seeds, step by step.
fn settling(seeds: u32) -> Result<Chart, ExperimentError> {
    let sim = Simulation::QU2010;
    let runs = |mean: SVector<f64, 6>| {
        over_seeds(seeds, STREAM, |random| {
            let walk = walk(&sim, Truth::Deterministic, sim.process_variance, random)?;
            let trace = Trace::of(&mut filter(&sim, sim.process_variance, mean)?, &walk.measured)?;
            let errors = |points: &[Point]| points.iter().zip(&walk.truth).map(|(a, b)| (a - b).norm()).collect();
            Ok::<[Vec<f64>; 3], _>([errors(&walk.measured), errors(&trace.predicted), errors(&trace.filtered)])
        })
    };
    let (zero, known) = (runs(SVector::zeros())?, runs(initial(&sim))?);
    let by_step = |runs: &[[Vec<f64>; 3]], which: usize| -> Vec<(f64, f64)> {
        let at = |k: usize| root_mean_square(runs.iter().filter_map(|r| r[which].get(k).copied()));
        (1..=sim.steps).map(|k| (k as f64, at(k) / 2.0_f64.sqrt())).collect()
    };
    Ok(Chart::new("qu2010: error of one axis against time", Axis::new("time, s"), Axis::new("root mean square error"))
        .with(Series::points("measured", Color::Measured, by_step(&zero, 0)))
        .with(Series::dashed("predicted, from zero", Color::Predicted, by_step(&zero, 1)))
        .with(Series::line("predicted, from the truth", Color::Predicted, by_step(&known, 1)))
        .with(Series::dashed("filtered, from zero", Color::Estimate, by_step(&zero, 2)))
        .with(Series::line("filtered, from the truth", Color::Estimate, by_step(&known, 2))))
}
