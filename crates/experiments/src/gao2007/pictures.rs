//! The pictures: Fig. 2 to 4 (position against time), and the errors of the same runs.

use super::params::{Bench, PHASE_B, Q_OVER_R_1, Q_OVER_R_B, SIGMA_B};
use super::{IMM, STREAM, trace};
use crate::ExperimentError;
use crate::axis_filters::AxisFilter;
use crate::random::Random;
use nalgebra::SVector;
use pursuit_charts::{Axis, Chart, Color, Series};
use pursuit_estimation::gao2007::LiteralParams;

type Points = [SVector<f64, 1>];

/// All pictures of the experiment: the first seed of each.
pub(super) fn charts() -> Result<Vec<(String, Chart)>, ExperimentError> {
    let turn = Bench::experiment_1();
    let [quiet, noisy] = [("no noise", 0.0), ("σ .82", SIGMA_B)].map(|(n, s)| Bench::setup_b(n, s, PHASE_B));
    let literal = AxisFilter::Literal(LiteralParams::experiment_2(Q_OVER_R_B * quiet.variance, quiet.variance));
    let gated = AxisFilter::Gated { q: Q_OVER_R_1 * turn.variance };
    let mut all = Vec::new();
    for (number, what, bench, q, adaptive) in [
        (2, "straight on, then a sudden turn", &turn, Q_OVER_R_1, gated),
        (3, "a circle", &quiet, Q_OVER_R_B, literal),
        (4, "a circle in noise", &noisy, Q_OVER_R_B, literal),
    ] {
        let measured = bench.path.measured(bench.sigma, &mut Random::new(STREAM, 0));
        let plain = trace(bench, AxisFilter::Plain { q: q * bench.variance }, &measured)?.filtered;
        let adaptive = trace(bench, adaptive, &measured)?.filtered;
        let imm = trace(bench, IMM, &measured)?.filtered;
        let truth = &bench.path.positions;
        let title = format!("gao2007, Fig. {number}: {what}");
        let chart = Chart::new(title.clone(), Axis::new("time, frames"), Axis::new("x, px"))
            .with(Series::line("true", Color::Truth, points(truth)))
            .with(Series::points("measured", Color::Measured, points(&measured)))
            .with(Series::dashed("plain", Color::Predicted, points(&plain)))
            .with(Series::line("adaptive", Color::Estimate, points(&adaptive)));
        let error = Chart::new(format!("{title}, error"), Axis::new("time, frames"), Axis::new("error, px"))
            .with(Series::points("measured", Color::Measured, difference(&measured, truth)))
            .with(Series::dashed("plain", Color::Predicted, difference(&plain, truth)))
            .with(Series::line("adaptive", Color::Estimate, difference(&adaptive, truth)))
            .with(Series::line("IMM", Color::Other, difference(&imm, truth)));
        all.extend([(format!("fig{number}"), chart), (format!("fig{number}_error"), error)]);
    }
    Ok(all)
}

fn points(values: &Points) -> Vec<(f64, f64)> {
    values.iter().enumerate().map(|(k, v)| (k as f64, v[0])).collect()
}

fn difference(values: &Points, truth: &Points) -> Vec<(f64, f64)> {
    values.iter().zip(truth).enumerate().map(|(k, (v, t))| (k as f64, v[0] - t[0])).collect()
}
