//! The plots of a run, drawn from its `trajectory.csv`: x, y, size and score against time.

use crate::RunError;
use pursuit_charts::{Axis, Chart, Color, Series};
use pursuit_tracking::TrackState;
use std::path::{Path, PathBuf};

/// What is drawn of one target.
#[derive(Debug, Default)]
struct Curves {
    score: Vec<(f64, f64)>,
    /// For x, y, width, height: measured, predicted, estimate.
    quantities: [[Vec<(f64, f64)>; 3]; 4],
    /// From when to when the target was not tracked, and in which state it was then.
    spans: Vec<(f64, f64, String)>,
}

impl Curves {
    /// Takes in what the target's state was at a time.
    fn note(&mut self, time: f64, state: &str) {
        match self.spans.last_mut() {
            Some((_, to, last)) if to.is_infinite() && last == state => {}
            Some((_, to, _)) if to.is_infinite() => {
                *to = time;
                self.begin(time, state);
            }
            _ => self.begin(time, state),
        }
    }

    fn begin(&mut self, time: f64, state: &str) {
        if state != TrackState::Tracking.as_str() {
            self.spans.push((time, f64::INFINITY, state.to_owned()));
        }
    }
}

/// More points than this in one plot help nobody: longer runs are thinned evenly.
const MOST_POINTS: usize = 20_000;

/// What is drawn, each in a file of that name; of several targets, with the target's number behind it.
const NAMES: [&str; 5] = ["x", "y", "width", "height", "score"];

/// Whether [`draw`] gives a file this name.
pub(crate) fn is_plot(file: &str) -> bool {
    let Some(stem) = file.strip_suffix(".svg") else { return false };
    let (name, target) = stem.split_once('-').unwrap_or((stem, "0"));
    NAMES.contains(&name) && target.parse::<u64>().is_ok()
}

/// Draws the plots of every target, shaded where it was not tracked, into `folder` and returns the files written.
///
/// # Errors
/// When the trajectory cannot be read back or a plot cannot be written.
pub fn draw(trajectory: &Path, folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    std::fs::create_dir_all(folder).map_err(RunError::output(folder))?;
    let targets = read(trajectory)?;
    let many = targets.len() > 1;
    let mut files = Vec::new();
    for (target, curves) in targets {
        let suffix = if many { format!("-{target}") } else { String::new() };
        for (name, chart) in charts(curves) {
            let path = folder.join(format!("{name}{suffix}.svg"));
            if chart.write(&path).map_err(RunError::output(&path))? {
                files.push(path);
            }
        }
    }
    Ok(files)
}

fn charts(curves: Curves) -> Vec<(&'static str, Chart)> {
    let [x, y, w, h] = curves.quantities;
    let end = curves.score.last().map_or(0.0, |point| point.0);
    let spans = curves.spans;
    let shaded = |chart: Chart| {
        spans.iter().fold(chart, |chart, (from, to, state)| chart.with_band(*from, to.min(end), state.as_str()))
    };
    let chart = |title: &str, label: &str, [measured, predicted, estimate]: [Vec<(f64, f64)>; 3]| {
        shaded(Chart::new(title, Axis::new("time (s)"), Axis::new(label)))
            .with(Series::points("measured", Color::Measured, measured))
            .with(Series::dashed("predicted", Color::Predicted, predicted))
            .with(Series::line("estimate", Color::Estimate, estimate))
    };
    vec![
        ("x", chart("Centre, horizontal", "x (px)", x)),
        ("y", chart("Centre, vertical (down)", "y (px)", y)),
        ("width", chart("Width", "width (px)", w)),
        ("height", chart("Height", "height (px)", h)),
        (
            "score",
            shaded(Chart::new(
                "Score: probability that the box is right",
                Axis::new("time (s)"),
                Axis::new("score").over(0.0, 1.0),
            ))
            .with(Series::line("score", Color::Estimate, curves.score)),
        ),
    ]
}

/// The curves of each target, by its number.
fn read(trajectory: &Path) -> Result<Vec<(String, Curves)>, RunError> {
    let unreadable = |e: csv::Error| RunError::output(trajectory)(std::io::Error::other(e));
    let rows = csv::Reader::from_path(trajectory).map_err(unreadable)?.into_records().count();
    let every = rows.div_ceil(MOST_POINTS).max(1);
    let mut targets: Vec<(String, Curves)> = Vec::new();
    for (i, row) in csv::Reader::from_path(trajectory).map_err(unreadable)?.into_records().enumerate() {
        let row = row.map_err(unreadable)?;
        if i % every != 0 {
            continue;
        }
        let number = |column: usize| row.get(column).and_then(|c| c.parse().ok()).unwrap_or(f64::NAN);
        let target = row.get(2).unwrap_or_default();
        let at = targets.iter().position(|(t, _)| t == target).unwrap_or_else(|| {
            targets.push((target.to_owned(), Curves::default()));
            targets.len() - 1
        });
        let (time, curves) = (number(1), &mut targets[at].1);
        curves.score.push((time, number(8)));
        curves.note(time, row.get(3).unwrap_or_default());
        // Columns of x, y, w, h: measured, predicted, estimate (see `TRAJECTORY_COLUMNS`).
        for (kind, first) in [13, 9, 4].into_iter().enumerate() {
            let [left, top, w, h] = [0, 1, 2, 3].map(|i| number(first + i));
            for (quantity, value) in [left + w / 2.0, top + h / 2.0, w, h].into_iter().enumerate() {
                curves.quantities[quantity][kind].push((time, value));
            }
        }
    }
    Ok(targets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_tracked_is_shaded() {
        let mut curves = Curves::default();
        for (k, state) in ["tracking", "unsure", "unsure", "occluded", "tracking", "lost"].into_iter().enumerate() {
            curves.note(k as f64, state);
        }
        let span = |from, to, state: &str| (from, to, state.to_owned());
        assert_eq!(
            curves.spans,
            [span(1.0, 3.0, "unsure"), span(3.0, 4.0, "occluded"), span(5.0, f64::INFINITY, "lost")]
        );
    }
}
