//! The legend: above the data, in as many rows as it needs.

use crate::series::{Marks, Series};
use crate::text::{escape, width};
use std::fmt::Write as _;

/// Height of a row.
pub(crate) const ROW: f64 = 20.0;
const SWATCH: f64 = 24.0;
const SIZE: f64 = 12.5;

/// Entries with their places: left edge, and row from 0.
pub(crate) struct Legend<'a>(Vec<(&'a Series, f64, usize)>);

impl<'a> Legend<'a> {
    /// The legend of `series` between `left` and `right`; there is none of a lone series, which the axes explain.
    pub fn of(series: &'a [Series], left: f64, right: f64) -> Self {
        let entries: Vec<&Series> =
            series.iter().filter(|s| s.marks != Marks::Named && s.finite().next().is_some()).collect();
        if entries.len() < 2 {
            return Self(Vec::new());
        }
        let (mut x, mut row) = (left, 0);
        let place = |series: &'a Series| {
            let extent = SWATCH + 7.0 + width(&series.name, SIZE);
            if x > left && x + extent > right {
                (x, row) = (left, row + 1);
            }
            let at = (series, x, row);
            x += extent + 20.0;
            at
        };
        Self(entries.into_iter().map(place).collect())
    }

    /// Its height.
    pub fn height(&self) -> f64 {
        self.0.last().map_or(0.0, |(.., row)| (*row + 1) as f64 * ROW)
    }

    /// Draws it with its upper edge at `top`.
    pub fn draw(&self, out: &mut String, top: f64) {
        for (series, x, row) in &self.0 {
            let y = top + (*row as f64 + 0.5) * ROW;
            let _ = write!(out, r#"<g class="legend"><g class="series {}">"#, series.color.class());
            let _ = match series.marks {
                Marks::Points => write!(out, r#"<path class="dots" d="M{:.1} {y:.1}h0"/>"#, x + SWATCH / 2.0),
                Marks::Area => {
                    let (top, high) = (y - 5.0, 10.0);
                    write!(out, r#"<path class="area" d="M{x:.1} {top:.1}h{SWATCH}v{high}h-{SWATCH}Z"/>"#)
                }
                Marks::Line { .. } | Marks::Named => {
                    let dashes = series.dashes();
                    write!(out, r#"<path d="M{x:.1} {y:.1}h{SWATCH}" stroke-dasharray="{}"/>"#, none_if_empty(dashes))
                }
            };
            let (x, y, name) = (x + SWATCH + 7.0, y + 4.3, escape(&series.name));
            let _ = write!(out, r#"</g><text x="{x:.1}" y="{y:.1}">{name}</text></g>"#);
        }
    }
}

/// The value that SVG wants where there are no dashes.
pub(crate) fn none_if_empty(dashes: &'static str) -> &'static str {
    if dashes.is_empty() { "none" } else { dashes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Color;

    fn series(name: &str) -> Series {
        Series::line(name, Color::Truth, vec![(0.0, 0.0)])
    }

    #[test]
    fn entries_wrap_and_never_leave_the_width() {
        let all: Vec<Series> = (0..7).map(|i| series(&format!("a series of number {i}"))).collect();
        let legend = Legend::of(&all, 50.0, 500.0);
        assert_eq!(legend.height(), 4.0 * ROW);
        for (series, x, _) in &legend.0 {
            assert!(*x >= 50.0 && x + SWATCH + 7.0 + width(&series.name, SIZE) <= 500.0, "{x}");
        }
        for pair in legend.0.windows(2) {
            let apart = pair[1].1 - (pair[0].1 + SWATCH + 7.0 + width(&pair[0].0.name, SIZE));
            assert!(pair[0].2 < pair[1].2 || apart >= 19.9, "{apart}");
        }
        // A name wider than the chart stands alone in its row.
        let wide = [series("a"), series(&"wide".repeat(50)), series("b")];
        assert_eq!(Legend::of(&wide, 0.0, 300.0).0.iter().map(|e| e.2).collect::<Vec<_>>(), [0, 1, 2]);
    }

    #[test]
    fn lone_empty_and_named_series_have_no_entry() {
        let empty = Series::line("empty", Color::Truth, vec![(f64::NAN, 0.0)]);
        let named = Series::named("named", Color::Truth, vec![(0.0, 0.0)]);
        assert_eq!(Legend::of(&[series("a"), empty, named], 0.0, 300.0).height(), 0.0);
    }
}
