//! The table for the terminal.

use crate::Results;
use std::fmt::Write as _;

/// One line for every tracker, the best success AUC first.
pub fn text_table(results: &Results) -> String {
    let mut rows: Vec<Vec<String>> = vec![header(results)];
    let mut trackers: Vec<_> = results.trackers.iter().collect();
    trackers.sort_by(|a, b| b.1.mean.auc.total_cmp(&a.1.mean.auc).then_with(|| a.0.cmp(b.0)));
    for (name, tracker) in trackers {
        let mean = &tracker.mean;
        let share = |v: f64| format!("{v:.3}");
        let maybe = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), share);
        let fps = mean.fps.map_or_else(|| "-".to_owned(), |v| format!("{v:.1}"));
        let mut row = vec![name.clone(), share(mean.auc), share(mean.precision20), share(mean.success50), fps];
        row.push(maybe(mean.calibration_error));
        if let Some(long) = has_long_term(results).then_some(mean.long_term.as_ref()) {
            row.push(maybe(long.map(|l| l.f)));
            row.push(maybe(long.map(|l| l.detection25.f)));
            row.push(maybe(long.map(|l| l.detection50.f)));
            row.push(maybe(long.and_then(|l| l.false_alive)));
            row.push(maybe(long.and_then(|l| l.right_untold)));
            row.push(maybe(long.and_then(|l| l.wrong_told)));
            row.push(long.map_or_else(|| "-".to_owned(), |l| format!("{}/{}", l.reacquired, l.returns)));
            row.push(long.and_then(|l| l.reacquire_frames).map_or_else(|| "-".to_owned(), |v| format!("{v:.1}")));
        }
        if let Some(vot) = &mean.supervised {
            row.extend([share(vot.accuracy), format!("{:.2}", vot.failures), share(vot.robustness), maybe(vot.eao)]);
        }
        row.push(mean.sequences.to_string());
        rows.push(row);
    }
    aligned(&rows) + &compared(results)
}

/// The best tracker against each of the others.
fn compared(results: &Results) -> String {
    let Some(first) = results.comparisons.first() else { return String::new() };
    let mut rows = vec![
        [format!("{} against", first.tracker), "sequences".to_owned(), "AUC".to_owned(), "difference".to_owned()]
            .to_vec(),
    ];
    rows[0].extend(["95 % interval".to_owned(), "is".to_owned()]);
    for c in results.comparisons.iter().filter(|c| c.tracker == first.tracker) {
        let [low, high] = c.interval;
        rows.push(vec![
            c.against.clone(),
            c.sequences.to_string(),
            format!("{:.3}", c.against_auc),
            format!("{:+.3}", c.difference),
            format!("{low:+.3} … {high:+.3}"),
            c.judgement.to_string(),
        ]);
    }
    format!("\n{}", aligned(&rows))
}

fn has_long_term(results: &Results) -> bool {
    results.trackers.values().any(|t| t.mean.long_term.is_some())
}

fn header(results: &Results) -> Vec<String> {
    let mut names = vec!["tracker", "AUC", "P20", "SR50", "fps", "ECE"];
    if has_long_term(results) {
        names.extend(["F", "F25", "F50", "false alive", "right untold", "wrong told", "returns", "noticed"]);
    }
    if results.trackers.values().any(|t| t.mean.supervised.is_some()) {
        names.extend(["accuracy", "failures", "robustness", "EAO"]);
    }
    names.push("sequences");
    names.into_iter().map(str::to_owned).collect()
}

pub(crate) fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|v| v.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (i, (cell, width)) in row.iter().zip(&widths).enumerate() {
            // Names to the left, figures to the right.
            let _ = if i == 0 { write!(line, "{cell:<width$}") } else { write!(line, "  {cell:>width$}") };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
