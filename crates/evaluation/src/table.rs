//! Tables of figures: as text for the terminal, as CSV, Markdown and LaTeX for files.

use crate::columns::{Better, Column, Reading, filled};
use crate::results::{MeanScore, TrackerResults};
use crate::{Comparison, Results};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// One line for every tracker, the best success AUC first, and the best against each of the others.
pub fn text_table(results: &Results) -> String {
    let mut text = Table::of_trackers(results).to_text();
    if let Some(first) = results.comparisons.first() {
        let of_best: Vec<&Comparison> = results.comparisons.iter().filter(|c| c.tracker == first.tracker).collect();
        text += "\n";
        text += &Table::of_comparisons(&of_best, &format!("{} against", first.tracker)).to_text();
    }
    text
}

/// A cell: what is read and, of a figure, what it is compared by.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cell {
    text: String,
    value: Option<f64>,
}

impl Cell {
    /// A text.
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), value: None }
    }

    /// A figure with so many decimals.
    pub fn figure(value: Option<f64>, digits: usize) -> Self {
        Self { text: value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}")), value }
    }
}

/// A table for readers; the first column names the rows.
pub(crate) struct Table {
    heads: Vec<(String, Better)>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table of these columns, each with the end that is the better one.
    pub fn new(heads: &[(&str, Better)], rows: Vec<Vec<Cell>>) -> Self {
        Self { heads: heads.iter().map(|(head, better)| ((*head).to_owned(), *better)).collect(), rows }
    }

    /// A line for every tracker.
    pub fn of_trackers(results: &Results) -> Self {
        let ranking = results.ranking();
        let scores: Vec<(&str, &MeanScore)> =
            ranking.iter().filter_map(|name| Some((*name, &results.trackers.get(*name)?.mean))).collect();
        let columns = filled(scores.iter().map(|(_, s)| *s));
        let mut heads = vec![("tracker".to_owned(), Better::Neither)];
        heads.extend(columns.iter().map(|c| (c.head.to_owned(), c.better)));
        let row = |(name, score): &(&str, &MeanScore)| {
            let cell =
                |c: &&Column| Cell { text: c.text(score).unwrap_or_else(|| "-".to_owned()), value: c.value(score) };
            std::iter::once(Cell::text(*name)).chain(columns.iter().map(cell)).collect()
        };
        Self { rows: scores.iter().map(row).collect(), heads }
    }

    /// Success AUC, as `auc` has it, of every tracker on each of `parts`: sequences, or attributes of sequences.
    fn of_aucs(
        results: &Results,
        head: &str,
        parts: &[&str],
        auc: impl Fn(&TrackerResults, &str) -> Option<f64>,
    ) -> Self {
        let ranking = results.ranking();
        let mut heads = vec![(head.to_owned(), Better::Neither)];
        heads.extend(ranking.iter().map(|name| ((*name).to_owned(), Better::Neither)));
        let row = |part: &&str| {
            let cell = |tracker: &&str| {
                let value = results.trackers.get(*tracker).and_then(|t| auc(t, part));
                Cell { text: value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}")), value }
            };
            std::iter::once(Cell::text(*part)).chain(ranking.iter().map(cell)).collect()
        };
        Self { heads, rows: parts.iter().map(row).collect() }
    }

    /// A line for every comparison of one tracker with another, under the heading `first`.
    pub fn of_comparisons(comparisons: &[&Comparison], first: &str) -> Self {
        let heads = [first, "sequences", "AUC", "difference", "95 % interval", "is"];
        let row = |c: &&Comparison| {
            let [low, high] = c.interval;
            vec![
                Cell::text(c.against.as_str()),
                Cell::text(c.sequences.to_string()),
                Cell::text(format!("{:.3}", c.against_auc)),
                Cell::text(format!("{:+.3}", c.difference)),
                Cell::text(format!("{low:+.3} … {high:+.3}")),
                Cell::text(c.judgement.to_string()),
            ]
        };
        Self {
            heads: heads.iter().map(|h| ((*h).to_owned(), Better::Neither)).collect(),
            rows: comparisons.iter().map(row).collect(),
        }
    }

    pub fn to_text(&self) -> String {
        let heads = self.heads.iter().map(|(head, _)| head.clone()).collect();
        let rows = self.rows.iter().map(|row| row.iter().map(|c| c.text.clone()).collect());
        aligned(&std::iter::once(heads).chain(rows).collect::<Vec<_>>())
    }

    /// A table of GitHub's Markdown, the best figure of each column in bold.
    pub fn to_markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let plain = |text: &str| text.replace('\\', r"\\").replace('|', r"\|").replace(['\n', '\r'], " ");
        let mut text = line(self.heads.iter().map(|(head, _)| plain(head)).collect());
        text += &line((0..self.heads.len()).map(|i| if i == 0 { "---" } else { "---:" }.to_owned()).collect());
        for row in self.marked() {
            text +=
                &line(row.iter().map(|(c, best)| if *best { format!("**{}**", plain(c)) } else { plain(c) }).collect());
        }
        text
    }

    /// A `tabular` of LaTeX with the rules of `booktabs`, the best figure of each column in bold.
    pub fn to_latex(&self) -> String {
        let line = |cells: Vec<String>| format!("{} \\\\\n", cells.join(" & "));
        let mut text =
            format!("\\begin{{tabular}}{{l{}}}\n\\toprule\n", "r".repeat(self.heads.len().saturating_sub(1)));
        text += &line(self.heads.iter().map(|(head, _)| latex(head)).collect());
        text += "\\midrule\n";
        for row in self.marked() {
            text += &line(
                row.iter()
                    .map(|(c, best)| if *best { format!("\\textbf{{{}}}", latex(c)) } else { latex(c) })
                    .collect(),
            );
        }
        text + "\\bottomrule\n\\end{tabular}\n"
    }

    /// Every cell, and whether it is the best of its column; nothing is where there is one row.
    fn marked(&self) -> impl Iterator<Item = Vec<(&str, bool)>> {
        let best: Vec<Option<f64>> = (0..self.heads.len()).map(|i| self.best(i)).collect();
        self.rows.iter().map(move |row| {
            let is_best = |i: usize, cell: &Cell| cell.value.is_some() && cell.value == best.get(i).copied().flatten();
            row.iter().enumerate().map(|(i, cell)| (cell.text.as_str(), is_best(i, cell))).collect()
        })
    }

    fn best(&self, column: usize) -> Option<f64> {
        let values = || self.rows.iter().filter_map(|row| row.get(column)?.value);
        match self.heads.get(column)?.1 {
            _ if self.rows.len() < 2 => None,
            Better::Higher => values().max_by(f64::total_cmp),
            Better::Lower => values().min_by(f64::total_cmp),
            Better::Neither => None,
        }
    }
}

/// The tables for readers, by the name of their files.
pub(crate) fn tables(results: &Results) -> Vec<(&'static str, Table)> {
    let sequences: BTreeSet<&String> = results.trackers.values().flat_map(|t| t.sequences.keys()).collect();
    let sequences: Vec<&str> = sequences.into_iter().map(String::as_str).collect();
    let attributes: Vec<&str> = results.attributes().into_iter().collect();
    let mut tables = vec![
        ("trackers", Table::of_trackers(results)),
        ("sequences", Table::of_aucs(results, "sequence", &sequences, |t, name| Some(t.sequences.get(name)?.auc))),
    ];
    if !attributes.is_empty() {
        let of = |t: &TrackerResults, name: &str| Some(t.attributes.get(name)?.auc);
        tables.push(("attributes", Table::of_aucs(results, "attribute", &attributes, of)));
    }
    tables
}

/// All figures as CSV, by the name of their files.
pub(crate) fn csv_tables(results: &Results) -> Vec<(&'static str, String)> {
    let rows = |of: fn(&TrackerResults) -> Vec<(String, MeanScore)>| -> Vec<(Vec<String>, MeanScore)> {
        let of = |(tracker, t): (&String, &TrackerResults)| {
            of(t).into_iter().map(|(part, score)| (vec![tracker.clone(), part], score)).collect::<Vec<_>>()
        };
        results.trackers.iter().flat_map(of).collect()
    };
    let trackers: Vec<_> = results.trackers.iter().map(|(name, t)| (vec![name.clone()], t.mean.clone())).collect();
    let sequences = rows(|t| t.sequences.iter().map(|(name, s)| (name.clone(), s.into())).collect());
    let attributes = rows(|t| t.attributes.iter().map(|(name, s)| (name.clone(), s.clone())).collect());
    let mut files = vec![
        ("trackers", csv(&["tracker"], &trackers)),
        ("sequences", csv(&["tracker", "sequence"], &sequences)),
        ("comparisons", comparisons(&results.comparisons)),
    ];
    if !attributes.is_empty() {
        files.push(("attributes", csv(&["tracker", "attribute"], &attributes)));
    }
    files
}

/// Comparisons as CSV.
fn comparisons(comparisons: &[Comparison]) -> String {
    let heads = ["tracker", "against", "sequences", "against_auc", "difference", "low", "high", "judgement"];
    let line = |c: &Comparison| {
        let figures = [c.against_auc, c.difference, c.interval[0], c.interval[1]].map(|v| v.to_string());
        let mut line = vec![c.tracker.clone(), c.against.clone(), c.sequences.to_string()];
        line.extend(figures);
        line.push(c.judgement.to_string());
        line
    };
    lines_of_csv(std::iter::once(heads.map(str::to_owned).to_vec()).chain(comparisons.iter().map(line)))
}

/// Figures as CSV: a line for each of `rows`, whose names come first, under the keys of the columns, with all digits.
pub(crate) fn csv(names: &[&str], rows: &[(Vec<String>, MeanScore)]) -> String {
    let columns = filled(rows.iter().map(|(_, score)| score));
    let mut heads: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
    for column in &columns {
        match column.reading {
            Reading::Figure(_) => heads.push(column.key.to_owned()),
            Reading::Span(_) => heads.extend(["low", "high"].map(|end| format!("{}_{end}", column.key))),
        }
    }
    let cell = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    let figures = |score: &MeanScore| -> Vec<String> {
        let of = |column: &&Column| match column.reading {
            Reading::Figure(figure) => vec![cell(figure(score))],
            Reading::Span(span) => {
                let ends = span(score);
                vec![cell(ends.map(|[low, _]| low)), cell(ends.map(|[_, high]| high))]
            }
        };
        columns.iter().flat_map(of).collect()
    };
    let lines = rows.iter().map(|(names, score)| names.iter().cloned().chain(figures(score)).collect::<Vec<_>>());
    lines_of_csv(std::iter::once(heads).chain(lines))
}

/// Lines of CSV, quoted where they must be.
pub(crate) fn lines_of_csv(lines: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for line in lines {
        // Writing to memory cannot fail, and all lines have the length of the first.
        let _ = writer.write_record(&line);
    }
    writer.into_inner().map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

/// Text with what LaTeX reads as commands written out.
fn latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '–' => out.push_str("--"),
            '…' => out.push_str("\\ldots{}"),
            '−' => out.push_str("$-$"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Rows of cells as lines of text, the first column to the left, the others to the right.
pub fn aligned(rows: &[Vec<String>]) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn results() -> Results {
        let mut results = Results::default();
        for (name, auc, error) in [("a_b", 0.5, Some(0.25)), ("c|d", 0.75, None)] {
            let tracker = results.trackers.entry(name.to_owned()).or_default();
            tracker.mean = MeanScore {
                auc,
                rank: Some([1, 2]),
                auc_interval: Some([0.25, auc]),
                calibration_error: error,
                sequences: 3,
                ..MeanScore::default()
            };
        }
        results
    }

    #[test]
    fn columns_without_a_figure_are_left_out() {
        let text = Table::of_trackers(&results()).to_text();
        let lines: Vec<Vec<&str>> = text.lines().map(|l| l.split_whitespace().collect()).collect();
        assert_eq!(lines[0], ["tracker", "rank", "AUC", "95", "%", "P20", "SR50", "NP", "ECE", "sequences"]);
        assert_eq!(lines[1], ["c|d", "1–2", "0.750", "0.250–0.750", "0.000", "0.000", "0.000", "-", "3"]);
    }

    #[test]
    fn markdown_and_latex_mark_the_best_and_escape_names() {
        let table = Table::of_trackers(&results());
        let markdown = table.to_markdown();
        assert!(markdown.contains("| c\\|d | 1–2 | **0.750** |"), "{markdown}");
        assert!(markdown.contains("| a_b | 1–2 | 0.500 |") && markdown.contains("| **0.250** | 3 |"), "{markdown}");
        let latex = table.to_latex();
        assert!(latex.contains("a\\_b & 1--2 & 0.500") && latex.contains("\\textbf{0.750}"), "{latex}");
        assert!(latex.contains("95 \\%") && latex.contains("{lrrrrrrrr}"), "{latex}");
    }

    #[test]
    fn files_of_figures_have_all_digits() {
        let rows: Vec<_> =
            results().trackers.into_iter().map(|(name, t)| (vec![format!("{name},x")], t.mean)).collect();
        let text = csv(&["tracker"], &rows);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "tracker,rank_low,rank_high,auc,auc_interval_low,auc_interval_high,precision20,success50,\
             normalized_precision,calibration_error,sequences"
        );
        assert_eq!(lines[1], "\"a_b,x\",1,2,0.5,0.25,0.5,0,0,0,0.25,3");
        assert_eq!(lines[2], "\"c|d,x\",1,2,0.75,0.25,0.75,0,0,0,,3");
    }
}
