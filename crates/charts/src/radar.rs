use crate::legend::Legend;
use crate::style;
use crate::text::{escape, width};
use crate::{Color, Series};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;
use std::path::Path;

/// A radar chart: a spoke for each of several kinds, and for every series a polygon through its values on them, from 0 in the
/// middle to a common end.
#[derive(Debug, Clone, PartialEq)]
pub struct Radar {
    title: String,
    spokes: Vec<String>,
    most: f64,
    series: Vec<Series>,
}

impl Radar {
    /// Radius of the outermost ring.
    const RADIUS: f64 = 150.0;
    const MARGIN: f64 = 14.0;
    const TEXT: f64 = 12.5;
    /// Rings.
    const RINGS: usize = 4;

    /// An empty chart with these spokes, the first upward, the others clockwise; `most` is the end of all, > 0.
    pub fn new(title: impl Into<String>, spokes: Vec<String>, most: f64) -> Self {
        let most = if most > 0.0 && most.is_finite() { most } else { 1.0 };
        Self { title: title.into(), spokes, most, series: Vec::new() }
    }

    /// With one more series, a value for each spoke; what is missing or no number interrupts its polygon, what is beyond the ends
    /// is drawn there.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, color: Color, values: &[Option<f64>]) -> Self {
        let point = |i: usize| (i as f64, values.get(i).copied().flatten().unwrap_or(f64::NAN));
        self.series.push(Series::line(name, color, (0..self.spokes.len()).map(point).collect()));
        self
    }

    /// Whether there is anything to draw: fewer than three spokes enclose nothing.
    pub fn is_empty(&self) -> bool {
        self.spokes.len() < 3 || self.series.iter().all(|s| s.finite().next().is_none())
    }

    /// The chart as a file of its own, with title, legend and style; `None` when there is nothing to draw.
    pub fn to_svg(&self) -> Option<String> {
        if self.is_empty() {
            return None;
        }
        let w = self.width();
        let legend = Legend::of(&self.series, Self::MARGIN, w - Self::MARGIN);
        let top = 40.0 + legend.height();
        let h = top + self.height();
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 {w:.0} {h:.0}\" width=\"{w:.0}\" \
             height=\"{h:.0}\" role=\"img\" aria-label=\"{0}\"><style>{1}</style>\
             <rect class=\"paper\" width=\"{w:.0}\" height=\"{h:.0}\"/><text class=\"title\" x=\"14\" y=\"25\">{0}</text>",
            escape(&self.title),
            style::file_style(),
        );
        legend.draw(&mut out, 36.0);
        self.draw(&mut out, (w / 2.0, top + self.height() / 2.0));
        out.push_str("</svg>\n");
        Some(out)
    }

    /// The chart as an element of a page that has [`page_style`](crate::page_style), a caption and a legend; empty when there is
    /// nothing to draw.
    pub fn to_element(&self) -> String {
        if self.is_empty() {
            return String::new();
        }
        let (w, h, title) = (self.width(), self.height(), escape(&self.title));
        let mut out = format!(r#"<svg class="chart" viewBox="0 0 {w:.0} {h:.0}" role="img" aria-label="{title}">"#);
        self.draw(&mut out, (w / 2.0, h / 2.0));
        out.push_str("</svg>");
        out
    }

    /// Writes the chart to a file, and says whether there was anything to write.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<bool> {
        match self.to_svg() {
            Some(svg) => std::fs::write(path, svg).map(|()| true),
            None => Ok(false),
        }
    }

    fn width(&self) -> f64 {
        let widest = self.spokes.iter().map(|s| width(s, Self::TEXT)).fold(0.0, f64::max);
        2.0 * (Self::RADIUS + widest + 14.0 + Self::MARGIN)
    }

    fn height(&self) -> f64 {
        2.0 * (Self::RADIUS + 24.0 + Self::MARGIN)
    }

    /// Where a share of the radius lies on a spoke.
    fn at(&self, (x, y): (f64, f64), spoke: usize, share: f64) -> (f64, f64) {
        let (s, c) = (TAU * spoke as f64 / self.spokes.len() as f64 - FRAC_PI_2).sin_cos();
        (x + Self::RADIUS * share * c, y + Self::RADIUS * share * s)
    }

    fn draw(&self, out: &mut String, middle: (f64, f64)) {
        for ring in 1..=Self::RINGS {
            let share = ring as f64 / Self::RINGS as f64;
            let class = if ring == Self::RINGS { "frame" } else { "grid" };
            let places = (0..self.spokes.len()).map(|i| self.at(middle, i, share));
            let _ = write!(out, r#"<path class="{class}" d="{}Z"/>"#, path(places));
            let (x, y) = self.at(middle, 0, share);
            let value = (100.0 * self.most * share).round() / 100.0;
            let (x, y) = (x + 4.0, y - 2.0);
            let _ = write!(out, r#"<text class="tick" x="{x:.1}" y="{y:.1}">{value}</text>"#);
        }
        for (i, name) in self.spokes.iter().enumerate() {
            let (x, y) = self.at(middle, i, 1.0);
            let _ = write!(out, r#"<path class="grid" d="M{:.1} {:.1}L{x:.1} {y:.1}"/>"#, middle.0, middle.1);
            let (x, y) = self.at(middle, i, 1.0 + 12.0 / Self::RADIUS);
            let side = x - middle.0;
            let anchor = if side.abs() < 8.0 {
                "middle"
            } else if side > 0.0 {
                "start"
            } else {
                "end"
            };
            // Text stands on its baseline: below the middle it is moved down.
            let y = y + 4.0 + 6.0 * ((y - middle.1) / Self::RADIUS).clamp(-1.0, 1.0);
            let _ = write!(
                out,
                r#"<text class="axis" x="{x:.1}" y="{y:.1}" text-anchor="{anchor}">{}</text>"#,
                escape(name)
            );
        }
        for series in &self.series {
            let number = match series.color {
                Color::Number(n) => format!(r#" data-t="{n}""#),
                _ => String::new(),
            };
            let _ = write!(out, r#"<g class="series {}"{number}>"#, series.color.class());
            let dashes = crate::legend::none_if_empty(series.dashes());
            let name = escape(&series.name);
            let _ = write!(
                out,
                r#"<path d="{}" stroke-dasharray="{dashes}"><title>{name}</title></path>"#,
                self.polygon(series, middle)
            );
            for (spoke, value) in series.finite() {
                let (x, y) = self.at(middle, spoke as usize, (value / self.most).clamp(0.0, 1.0));
                let _ =
                    write!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="2.6"><title>{name} {value:.3}</title></circle>"#);
            }
            out.push_str("</g>");
        }
    }

    /// The path of a series: closed where it has all values, else in stretches.
    fn polygon(&self, series: &Series, middle: (f64, f64)) -> String {
        let place = |(spoke, value): &(f64, f64)| {
            value.is_finite().then(|| self.at(middle, *spoke as usize, (value / self.most).clamp(0.0, 1.0)))
        };
        let places: Vec<Option<(f64, f64)>> = series.points.iter().map(place).collect();
        if places.iter().all(Option::is_some) {
            return path(places.into_iter().flatten()) + "Z";
        }
        // Round to the first again, which may continue the last.
        let around: Vec<Option<(f64, f64)>> = places.iter().chain(places.first()).copied().collect();
        around.split(Option::is_none).filter(|s| s.len() > 1).map(|s| path(s.iter().flatten().copied())).collect()
    }
}

fn path(places: impl Iterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    for (i, (x, y)) in places.enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" });
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spokes(n: usize) -> Vec<String> {
        (0..n).map(|i| format!("kind <{i}>")).collect()
    }

    #[test]
    fn values_lie_on_their_spokes() {
        let radar = Radar::new("a & b", spokes(4), 0.5).with(
            "kcf",
            Color::Number(2),
            &[Some(0.5), Some(0.25), Some(0.0), Some(9.0)],
        );
        let places: Vec<(f64, f64)> = [0.5, 0.25, 0.0, 9.0]
            .iter()
            .enumerate()
            .map(|(i, v)| radar.at((0.0, 0.0), i, (v / 0.5f64).min(1.0)))
            .collect();
        let expected = [(0.0, -150.0), (75.0, 0.0), (0.0, 0.0), (-150.0, 0.0)];
        for (got, want) in places.iter().zip(expected) {
            assert!((got.0 - want.0).abs() < 1e-9 && (got.1 - want.1).abs() < 1e-9, "{places:?}");
        }
        let svg = radar.to_svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("a &amp; b") && svg.contains("kind &lt;3&gt;"));
        assert_eq!(svg.matches("<circle").count(), 4);
        assert!(svg.contains(r#"data-t="2""#) && svg.matches("class=\"axis\"").count() == 4);
        assert!(radar.to_element().starts_with("<svg class=\"chart\""));
    }

    #[test]
    fn missing_values_leave_the_polygon_open() {
        let closed = |values: &[Option<f64>]| {
            let radar = Radar::new("", spokes(5), 1.0).with("a", Color::Truth, values);
            let path = radar.polygon(&radar.series[0], (0.0, 0.0));
            (path.ends_with('Z'), path.matches('M').count(), path.matches('L').count())
        };
        assert_eq!(closed(&[Some(0.1); 5]), (true, 1, 4));
        // Two beside each other, and one that joins the first again.
        assert_eq!(closed(&[Some(0.1), Some(0.2), None, None, Some(0.3)]), (false, 2, 2));
        assert_eq!(closed(&[None, Some(0.2), None, Some(f64::NAN), Some(0.3)]), (false, 0, 0));
    }

    #[test]
    fn nothing_to_draw_gives_none() {
        assert_eq!(Radar::new("", spokes(2), 1.0).with("a", Color::Truth, &[Some(0.3); 2]).to_svg(), None);
        let empty = Radar::new("", spokes(3), f64::NAN).with("a", Color::Truth, &[None, Some(f64::INFINITY)]);
        assert_eq!((empty.to_svg(), empty.to_element()), (None, String::new()));
    }
}
