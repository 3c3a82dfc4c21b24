use crate::style;
use crate::text::{escape, width};
use std::fmt::Write as _;
use std::path::Path;

/// A table of values as cells, coloured by how far each is above or below zero.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    title: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<f64>)>,
    most: f64,
}

impl HeatMap {
    const CELL: (f64, f64) = (52.0, 24.0);
    const TOP: f64 = 40.0;
    const MARGIN: f64 = 14.0;
    const TEXT: f64 = 12.5;

    /// An empty map with these columns; a value of `most` or more, or of its negative or less, has the full colour.
    pub fn new(title: impl Into<String>, columns: Vec<String>, most: f64) -> Self {
        let most = if most > 0.0 { most } else { 1.0 };
        Self { title: title.into(), columns, rows: Vec::new(), most }
    }

    /// With one more row below those before it: a value for each column from the left on. What is not a number, or is
    /// missing, leaves its cell empty; what is too much is left out.
    #[must_use]
    pub fn with_row(mut self, name: impl Into<String>, values: Vec<f64>) -> Self {
        self.rows.push((name.into(), values));
        self
    }

    /// The map as a file of its own, with title and style; `None` when there is no number to draw.
    pub fn to_svg(&self) -> Option<String> {
        let holds = |(_, values): &(String, Vec<f64>)| values.iter().take(self.columns.len()).any(|v| v.is_finite());
        self.rows.iter().any(holds).then(|| self.draw())
    }

    /// Writes the map to a file, and says whether there was anything to write.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<bool> {
        match self.to_svg() {
            Some(svg) => std::fs::write(path, svg).map(|()| true),
            None => Ok(false),
        }
    }

    fn draw(&self) -> String {
        let names = self.rows.iter().map(|(name, _)| width(name, Self::TEXT)).fold(0.0, f64::max);
        let heads = self.columns.iter().map(|name| width(name, Self::TEXT)).fold(0.0, f64::max);
        let cell_width = Self::CELL.0.max(heads + 8.0);
        let (left, top) = (Self::MARGIN + names + 10.0, Self::TOP + 22.0);
        let w = (left + cell_width * self.columns.len() as f64 + Self::MARGIN)
            .max(2.0 * Self::MARGIN + width(&self.title, 15.0));
        let h = top + Self::CELL.1 * self.rows.len() as f64 + Self::MARGIN;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 {w:.0} {h:.0}\" width=\"{w:.0}\" \
             height=\"{h:.0}\" role=\"img\" aria-label=\"{0}\"><style>{1}.chart .above{{fill:#2b8a3e}}\
             .chart .below{{fill:#d6302a}}.chart .value{{text-anchor:middle}}</style>\
             <rect class=\"paper\" width=\"{w:.0}\" height=\"{h:.0}\"/><text class=\"title\" x=\"14\" y=\"25\">{0}</text>",
            escape(&self.title),
            style::file_style(),
        );
        let middle = |column: usize| left + cell_width * (column as f64 + 0.5);
        for (k, name) in self.columns.iter().enumerate() {
            let _ = write!(
                out,
                "<text class=\"value\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                middle(k),
                top - 8.0,
                escape(name)
            );
        }
        for (k, (name, values)) in self.rows.iter().enumerate() {
            let y = top + Self::CELL.1 * k as f64;
            let _ = write!(out, "<text x=\"14\" y=\"{:.1}\">{}</text>", y + 16.0, escape(name));
            for (k, value) in values.iter().take(self.columns.len()).enumerate().filter(|(_, v)| v.is_finite()) {
                let class = if *value < 0.0 { "below" } else { "above" };
                // The full colour leaves the number readable on light and dark.
                let opacity = 0.75 * (value.abs() / self.most).min(1.0);
                let x = middle(k) - 0.5 * cell_width;
                let _ = write!(
                    out,
                    "<rect class=\"{class}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" opacity=\"{opacity:.2}\"/>\
                     <text class=\"value\" x=\"{:.1}\" y=\"{:.1}\">{value:+.1}</text>",
                    x + 1.0,
                    y + 1.0,
                    cell_width - 2.0,
                    Self::CELL.1 - 2.0,
                    middle(k),
                    y + 16.0
                );
            }
        }
        out.push_str("</svg>\n");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_coloured_by_sign_and_size() {
        let columns = vec!["a".to_owned(), "b < c".to_owned()];
        let map = HeatMap::new("gains & losses", columns, 10.0)
            .with_row("one", vec![5.0, -20.0, 7.0])
            .with_row("two", vec![f64::NAN, 0.0]);
        let svg = map.to_svg().unwrap();
        assert_eq!(
            (svg.matches("<rect class=\"above\"").count(), svg.matches("<rect class=\"below\"").count()),
            (2, 1)
        );
        assert!(svg.contains("opacity=\"0.38\"") && svg.contains("opacity=\"0.75\"") && svg.contains(">-20.0<"));
        assert!(svg.contains("b &lt; c") && svg.contains("gains &amp; losses") && !svg.contains("+7.0"));
    }

    #[test]
    fn nothing_to_draw_gives_none() {
        let map = HeatMap::new("", vec!["a".to_owned()], 0.0);
        assert_eq!(map.to_svg(), None);
        assert_eq!(map.with_row("x", vec![f64::NAN, 3.0]).to_svg(), None);
    }
}
