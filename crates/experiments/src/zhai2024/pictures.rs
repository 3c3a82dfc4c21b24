//! The pictures: how the printed recursion grows, a path followed by few particles, and their spread.

use super::params::{COUNTS, NOISES, PositionFrom, Toy};
use super::{Estimates, RESIDUAL_VARIANCE, STREAM, mean, toy};
use crate::ExperimentError;
use crate::random::Random;
use pursuit_charts::{Axis, Chart, Color, Series};

/// Steps of the recursion shown.
const SHOWN: usize = 100;

/// All pictures of the experiment.
pub(super) fn charts(all: &[Estimates]) -> Result<Vec<(String, Chart)>, ExperimentError> {
    let shape = Toy::new(0.5);
    let path = toy::path(&shape, &mut Random::new(STREAM, 0));
    let points = |values: &[nalgebra::Vector2<f64>]| values.iter().map(|p| (p.x, p.y)).collect();
    let mut plane = Chart::new("zhai2024: 20 particles on a smooth path", Axis::new("x, px"), Axis::new("y, px"))
        .with_equal_units()
        .with(Series::line("true", Color::Truth, points(&path)));
    let mut error = Chart::new("zhai2024: error of 20 particles", Axis::new("frame"), Axis::new("error, px"));
    let mut spread =
        Chart::new("zhai2024: the particles' motion noise", Axis::new("frame"), Axis::new("standard deviation, px"));
    let shown = [(0, Color::Predicted), (1, Color::Estimate), (4, Color::Other)];
    for (index, color) in shown {
        let Some((name, noise)) = NOISES.get(index).copied() else { continue };
        let followed =
            toy::follow(&shape, &path, (noise, PositionFrom::Detector), COUNTS[1], &mut Random::new(STREAM, 1))?;
        let distance = followed.estimates.iter().zip(&path).map(|(a, b)| (a - b).norm());
        let numbered = |values: &mut dyn Iterator<Item = f64>| values.enumerate().map(|(k, v)| (k as f64, v)).collect();
        plane = plane.with(Series::line(name, color, points(&followed.estimates)));
        error = error.with(Series::line(name, color, numbered(&mut distance.into_iter())));
        spread = spread.with(Series::line(name, color, numbered(&mut followed.spread_px.iter().copied().skip(1))));
    }
    Ok(vec![
        ("variance".into(), recursion(all)),
        ("path".into(), plane),
        ("error".into(), error),
        ("spread".into(), spread),
    ])
}

/// Mean of both forms over the seeds, and the printed form's expectation.
fn recursion(all: &[Estimates]) -> Chart {
    let at = |of: fn(&Estimates) -> &[f64]| {
        (0..SHOWN).map(|k| ((k + 1) as f64, mean(all.iter().filter_map(|e| of(e).get(k).copied())))).collect()
    };
    let theory = (1..=SHOWN).map(|k| (k as f64, RESIDUAL_VARIANCE * (k as f64 - 1.0) / 2.0)).collect();
    Chart::new("zhai2024, equation (25): variance of residuals with σ² = 4", Axis::new("k"), Axis::new("estimate, px²"))
        .with(Series::dashed("σ² (k − 1)/2", Color::Truth, theory))
        .with(Series::line("as printed", Color::Predicted, at(|e| &e.printed)))
        .with(Series::line("corrected", Color::Estimate, at(|e| &e.corrected)))
}
