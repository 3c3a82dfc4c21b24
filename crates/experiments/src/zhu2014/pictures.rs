//! The pictures: a path with its turns, its coordinates against time, and the error around a turn.

use super::params::{Setting, variants};
use super::{Filter, Point, STREAM, run_once};
use crate::ExperimentError;
use crate::monte_carlo::{over_seeds, root_mean_square};
use crate::random::Random;
use pursuit_charts::{Axis, Chart, Color, Series};

/// The reading that is the default.
const DEFAULT: &str = "jump anywhere, 5.99";
/// Frames shown before and after a turn's own.
const AROUND: std::ops::RangeInclusive<i64> = -4..=8;

fn named(name: &str) -> Option<Filter> {
    variants(1.0).into_iter().find(|v| v.0 == name).map(|v| Filter::Halves(v.1))
}

/// All pictures of the experiment.
pub(super) fn charts(seeds: u32) -> Result<Vec<(String, Chart)>, ExperimentError> {
    let setting = Setting::ALL[0];
    let standard = Filter::Standard { q: setting.process_variance };
    let jump = named(DEFAULT).unwrap_or(standard);
    let (path, measured, plain) = run_once(&setting, standard, &mut Random::new(STREAM, 0))?;
    let (_, _, ours) = run_once(&setting, jump, &mut Random::new(STREAM, 0))?;
    let plane = |points: &[Point]| points.iter().map(|p| (p.x, p.y)).collect();
    let mut charts = vec![(
        "path".to_owned(),
        Chart::new("zhu2014: a path with 90° turns, one-step predictions", Axis::new("x, px"), Axis::new("y, px"))
            .with_equal_units()
            .with(Series::line("true", Color::Truth, plane(&path.positions)))
            .with(Series::points("measured", Color::Measured, plane(&measured)))
            .with(Series::dashed("predicted, standard", Color::Predicted, plane(&plain.predicted)))
            .with(Series::line("predicted, jump", Color::Estimate, plane(&ours.predicted))),
    )];
    for (axis, name) in [(0, "x"), (1, "y")] {
        let of = |points: &[Point]| points.iter().enumerate().map(|(k, p)| (k as f64, p[axis])).collect();
        let chart = Chart::new(
            format!("zhu2014: {name} against time"),
            Axis::new("time, frames"),
            Axis::new(format!("{name}, px")),
        )
        .with(Series::line("true", Color::Truth, of(&path.positions)))
        .with(Series::points("measured", Color::Measured, of(&measured)))
        .with(Series::dashed("predicted, standard", Color::Predicted, of(&plain.predicted)))
        .with(Series::line("predicted, jump", Color::Estimate, of(&ours.predicted)))
        .with(Series::line("filtered, jump", Color::Other, of(&ours.filtered)));
        charts.push((name.to_owned(), chart));
    }
    charts.push(("error".to_owned(), around_turns(&setting, seeds)?));
    Ok(charts)
}

/// Root mean square error of the prediction by frames since a turn.
fn around_turns(setting: &Setting, seeds: u32) -> Result<Chart, ExperimentError> {
    let mut chart = Chart::new(
        "zhu2014: error of the prediction around 90° turns",
        Axis::new("frames since the turn"),
        Axis::new("RMSE, px"),
    );
    let literal = named("literal: observed velocity, 9.21");
    let halves = named("A(dt/2) A(dt/2), Q/2 each");
    let filters = [
        ("standard", Color::Predicted, Some(Filter::Standard { q: setting.process_variance }), false),
        ("A(dt/2) A(dt/2)", Color::Truth, halves, true),
        ("observed velocity", Color::Measured, literal, false),
        ("jump anywhere", Color::Estimate, named(DEFAULT), false),
        ("IMM", Color::Other, Some(Filter::Models { q: setting.process_variance }), false),
    ];
    for (name, color, filter, dashed) in filters {
        let Some(filter) = filter else { continue };
        let runs = over_seeds(seeds, STREAM, |random| {
            let (path, _, trace) = run_once(setting, filter, random)?;
            let error = |k: usize| Some((trace.predicted.get(k)? - path.positions.get(k)?).norm());
            let mut found = Vec::new();
            for turn in &path.turn_frames {
                for since in AROUND {
                    // Later frames may belong to the next turn.
                    let frame = usize::try_from(*turn as i64 + since).unwrap_or(usize::MAX);
                    let other = path.turn_frames.iter().any(|t| t != turn && (*t..*t + 6).contains(&frame));
                    found.extend(error(frame).filter(|_| !other).map(|e| (since, e)));
                }
            }
            Ok(found)
        })?;
        let at = |since: i64| root_mean_square(runs.iter().flatten().filter(|(s, _)| *s == since).map(|(_, e)| *e));
        let points = AROUND.map(|since| (since as f64, at(since))).collect();
        chart =
            chart.with(if dashed { Series::dashed(name, color, points) } else { Series::line(name, color, points) });
    }
    Ok(chart)
}
