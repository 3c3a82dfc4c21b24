use crate::trial::Told;
use pursuit::BBox;
use std::fmt::Write;

/// The text table of the paper's test system: for every frame and target the actual and the predicted position and how far
/// they are apart. Actual is the truth where the input brings it, else what was measured; a dash where there is none.
pub(super) fn write(told: &Told) -> String {
    let columns =
        ["frame", "time_s", "target", "actual_x", "actual_y", "pred_x", "pred_y", "error_px", "state", "score"];
    let mut text = String::new();
    let mut line = |cells: [String; 10]| {
        let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:>10}")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", cells.join(" "));
    };
    line(columns.map(str::to_owned));
    for row in told.version.rows.iter() {
        let truth = told.info.truth_at(row.frame).bbox();
        for record in &row.records {
            let Some(e) = &record.estimate else { continue };
            let actual = truth.or(e.measurement).map(|b| b.center());
            let predicted = e.prediction.map(|b: BBox| b.center());
            let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
            let error = actual.zip(predicted).map(|(a, p)| (a.x - p.x).hypot(a.y - p.y));
            line([
                row.frame.to_string(),
                format!("{:.4}", row.time_s),
                record.target.to_string(),
                number(actual.map(|p| p.x)),
                number(actual.map(|p| p.y)),
                number(predicted.map(|p| p.x)),
                number(predicted.map(|p| p.y)),
                number(error),
                e.state.to_string(),
                format!("{:.3}", e.score),
            ]);
        }
    }
    text
}
