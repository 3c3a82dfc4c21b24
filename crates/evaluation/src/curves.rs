//! The curves over all sequences: charts for the report, and files to draw them anew.

use crate::Results;
use crate::results::TrackerResults;
use crate::table::lines_of_csv;
use pursuit_charts::{Axis, Chart, Color, Series};

/// Points in order.
type Points = Vec<(f64, f64)>;

/// A curve for each tracker.
pub(crate) struct Curves {
    /// Name of its files.
    pub file: &'static str,
    /// Heading on the page.
    pub title: &'static str,
    /// What is drawn, in a few words.
    pub note: &'static str,
    /// All of them.
    pub chart: Chart,
    /// What x and y are, as columns of CSV.
    columns: [&'static str; 2],
    /// By tracker, the best success AUC first.
    points: Vec<(String, Points)>,
}

impl Curves {
    /// The points as CSV: `tracker`, x, y.
    pub fn to_csv(&self) -> String {
        let heads = std::iter::once("tracker").chain(self.columns).map(str::to_owned).collect();
        let lines = self.points.iter().flat_map(|(tracker, points)| {
            points.iter().map(move |(x, y)| vec![tracker.clone(), x.to_string(), y.to_string()])
        });
        lines_of_csv(std::iter::once(heads).chain(lines))
    }
}

/// What there is to draw of the results.
pub(crate) fn all(results: &Results) -> Vec<Curves> {
    let ranked: Vec<(&str, &TrackerResults)> =
        results.ranking().into_iter().filter_map(|name| Some((name, results.trackers.get(name)?))).collect();
    let share = |label: &str| Axis::new(label).over(0.0, 1.0);
    let chart = |title: &str, x: Axis, y: Axis| Chart::new(title, x, y).sized(520.0, 360.0);
    let spread = |values: &[f64], step: f64| values.iter().enumerate().map(|(i, v)| (i as f64 * step, *v)).collect();
    let of_all = |points: &dyn Fn(&TrackerResults) -> Points| -> Vec<(String, Points)> {
        ranked.iter().map(|(name, t)| ((*name).to_owned(), points(t))).collect()
    };
    let lines = |chart: Chart, points: &[(String, Points)]| {
        let line = |(number, (name, points)): (usize, &(String, Points))| {
            Series::line(name, Color::Number(number), points.clone())
        };
        points.iter().enumerate().map(line).fold(chart, Chart::with)
    };
    let success = of_all(&|t| spread(&t.curves.success, 0.05));
    let precision = of_all(&|t| spread(&t.curves.precision, 1.0));
    let reliability =
        of_all(&|t| t.calibration.iter().filter(|b| b.frames > 0).map(|b| (b.mean_score, b.hit_rate)).collect());
    let speed = of_all(&|t| t.mean.fps.map(|fps| (fps, t.mean.auc)).into_iter().collect());
    let eao = of_all(&|t| spread(&t.curves.eao, 1.0));
    let mut all = vec![
        Curves {
            file: "success",
            title: "Success",
            note: "fraction of frames whose overlap exceeds a threshold",
            chart: lines(chart("success plot", share("overlap threshold"), share("success rate")), &success),
            columns: ["overlap_threshold", "success_rate"],
            points: success,
        },
        Curves {
            file: "precision",
            title: "Precision",
            note: "fraction of frames whose centre is this close",
            chart: lines(
                chart("precision plot", Axis::new("centre error, px").over(0.0, 50.0), share("precision")),
                &precision,
            ),
            columns: ["center_error_px", "precision"],
            points: precision,
        },
    ];
    let dots = speed.iter().enumerate().filter(|(_, (_, points))| !points.is_empty());
    let dots = dots.map(|(number, (name, points))| Series::named(name, Color::Number(number), points.clone()));
    let empty =
        chart("speed against accuracy", Axis::new("updates a second, one thread").logarithmic(), share("success AUC"));
    let drawn = dots.fold(empty, Chart::with);
    if !drawn.is_empty() {
        all.push(Curves {
            file: "speed",
            title: "Speed and accuracy",
            note: "up and to the right is better",
            chart: drawn,
            columns: ["fps", "auc"],
            points: speed,
        });
    }
    all.push(Curves {
        file: "reliability",
        title: "Reliability",
        note: "an honest score lies on the diagonal",
        chart: lines(
            chart("reliability diagram", share("score"), share("frames with overlap ≥ ½")).with_diagonal(),
            &reliability,
        ),
        columns: ["mean_score", "hit_rate"],
        points: reliability,
    });
    let longest = eao.iter().map(|(_, points)| points.len()).max().unwrap_or(0);
    if longest > 1 {
        let frames = Axis::new("frames").whole().over(0.0, (longest - 1) as f64);
        all.push(Curves {
            file: "eao",
            title: "Expected average overlap",
            note: "by the number of frames since a start",
            chart: lines(chart("expected average overlap", frames, share("overlap")), &eao),
            columns: ["frames", "overlap"],
            points: eao,
        });
    }
    all
}
