//! The result as text: one table, then the sentences of the paper.

use super::result::{Bar, Finding, Reproduction, Row, Spread, Verdict};
use std::fmt;

const HEADINGS: [&str; 8] = ["figure", "paper", "reference", "ours [5 %, 95 %]", "plain, tuned", "IMM", "bar", ""];

impl fmt::Display for Reproduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} ({} seeds)\n", self.paper.name(), self.title, self.seeds)?;
        let cells: Vec<[String; 8]> = self.rows.iter().map(cells).collect();
        let widths: [usize; 8] = std::array::from_fn(|column| {
            let heading = HEADINGS[column].chars().count();
            cells.iter().map(|row| row[column].chars().count()).fold(heading, usize::max)
        });
        line(f, &HEADINGS.map(str::to_owned), &widths)?;
        let mut setting = None;
        for (row, cells) in self.rows.iter().zip(&cells) {
            if setting != Some(&row.setting) {
                writeln!(f, "{}", row.setting)?;
                setting = Some(&row.setting);
            }
            line(f, cells, &widths)?;
        }
        writeln!(f)?;
        for finding in &self.findings {
            writeln!(f, "{finding}")?;
        }
        let (judged, missed) = (self.rows.iter().filter(|r| r.verdict.is_some()).count(), self.missed().count());
        writeln!(f, "\n{} of {judged} bars reached", judged - missed)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.holds { "holds" } else { "DOES NOT HOLD" };
        write!(f, "{verdict}: {}\n    {}", self.claim, self.evidence)
    }
}

fn line(f: &mut fmt::Formatter<'_>, cells: &[String; 8], widths: &[usize; 8]) -> fmt::Result {
    let mut text = String::from("  ");
    for (column, (cell, width)) in cells.iter().zip(widths).enumerate() {
        let gap = " ".repeat(width - cell.chars().count());
        // Words to the left, numbers to the right.
        match column {
            0 | 6 | 7 => text.extend([cell.as_str(), &gap]),
            _ => text.extend([gap.as_str(), cell]),
        }
        text.push_str("  ");
    }
    writeln!(f, "{}", text.trim_end())
}

fn cells(row: &Row) -> [String; 8] {
    let optional = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
    let verdict = match row.verdict {
        Some(Verdict::Pass) => "pass",
        Some(Verdict::Miss) => "MISS",
        None => "",
    };
    [
        format!("  {}", row.figure),
        optional(row.paper),
        optional(row.reference),
        spread(&row.ours),
        optional(row.tuned_plain),
        optional(row.imm),
        row.bar.map_or_else(String::new, |bar| bar.to_string()),
        verdict.to_owned(),
    ]
}

fn spread(value: &Spread) -> String {
    match (value.low, value.high) {
        (Some(low), Some(high)) => format!("{} [{}, {}]", number(value.value), number(low), number(high)),
        _ => number(value.value),
    }
}

/// About four digits, without an exponent where a reader does not need one.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        format!("{value}")
    } else if !(1e-3..1e6).contains(&size) {
        format!("{value:.1e}")
    } else if size >= 100.0 {
        format!("{value:.1}")
    } else if size >= 10.0 {
        format!("{value:.2}")
    } else if size >= 0.1 {
        format!("{value:.3}")
    } else {
        format!("{value:.4}")
    }
}

impl fmt::Display for Bar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(limit) => write!(f, "≤ {}", limit_text(*limit)),
            Self::AtLeast(limit) => write!(f, "≥ {}", limit_text(*limit)),
            Self::Above(limit) => write!(f, "> {}", limit_text(*limit)),
            Self::Within { of, relative } => write!(f, "{} ± {} %", number(*of), limit_text(relative * 100.0)),
        }
    }
}

/// A bar as it was set: no zeros added.
fn limit_text(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { format!("{}", (value * 1e6).round() / 1e6) }
}

#[cfg(test)]
mod tests {
    use super::super::Paper;
    use super::*;

    #[test]
    fn columns_line_up_and_verdicts_are_words() {
        let rows = vec![
            Row::new("turn", "ratio", Spread { value: 0.0617, low: Some(0.05), high: Some(0.0711) })
                .paper(0.059)
                .reference(0.0617)
                .beside(0.07, 0.0501)
                .bar(Bar::AtMost(0.07)),
            Row::new("turn", "RMSE, px", 6.83).bar(Bar::Within { of: 7.0, relative: 0.015 }),
        ];
        let findings = vec![Finding::new("All is well", false, "6.83 is not 7")];
        let title = "a turn".to_owned();
        let paper = Paper::Gao2007;
        let text = Reproduction { paper, title, seeds: 1000, rows, findings, charts: Vec::new() }.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "gao2007: a turn (1000 seeds)");
        assert_eq!(lines[3], "turn", "{text}");
        assert!(lines[4].contains("0.0617 [0.0500, 0.0711]") && lines[4].ends_with("≤ 0.07         pass"), "{text}");
        assert!(lines[5].ends_with("7.000 ± 1.5 %  MISS"), "{text}");
        let place = |line: &str, word: &str| line.find(word).map(|at| line[..at].chars().count());
        assert_eq!(place(lines[4], "pass"), place(lines[5], "MISS"), "{text}");
        assert!(text.contains("DOES NOT HOLD: All is well\n    6.83 is not 7"));
        assert!(text.ends_with("1 of 2 bars reached\n"));
    }

    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.0, "0"),
            (1.926, "1.926"),
            (0.0617, "0.0617"),
            (26.21, "26.21"),
            (1995.0, "1995.0"),
            (3e-14, "3.0e-14"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(Bar::AtMost(1e-9).to_string(), "≤ 1e-9");
        assert_eq!(Bar::AtLeast(0.99).to_string(), "≥ 0.99");
    }
}
