//! Line charts as SVG that takes its colours from the page: written by hand, since a chart drawn by a library brings its
//! own colours and would not follow a reader from light to dark.

use super::html::escape;
use std::fmt::Write as _;

/// Width of a chart that stands beside another one.
pub(super) const HALF: f64 = 520.0;
/// Width of a chart over the whole page.
pub(super) const WHOLE: f64 = 800.0;
const LEFT: f64 = 52.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 44.0;

/// Points in order; `None` interrupts the line.
pub(super) type Points = Vec<Option<(f64, f64)>>;

/// One axis of a chart.
pub(super) struct Axis {
    label: &'static str,
    from: f64,
    to: f64,
    ticks: Vec<(f64, String)>,
    logarithmic: bool,
}

impl Axis {
    /// A linear axis with `steps` steps between its ticks.
    pub fn linear(label: &'static str, from: f64, to: f64, steps: usize) -> Self {
        let at = |i: usize| from + (to - from) * i as f64 / steps.max(1) as f64;
        let ticks = (0..=steps).map(|i| (at(i), number(at(i)))).collect();
        Self { label, from, to, ticks, logarithmic: false }
    }

    /// A linear axis over whole numbers with round ticks.
    pub fn counts(label: &'static str, to: usize) -> Self {
        let to = to.max(1) as f64;
        let power = 10f64.powf((to / 5.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| to / s <= 6.0).unwrap_or(power);
        let step = step.max(1.0);
        let ticks = (0..).map(|i| f64::from(i) * step).take_while(|t| *t <= to).map(|t| (t, number(t))).collect();
        Self { label, from: 0.0, to, ticks, logarithmic: false }
    }

    /// A logarithmic axis that holds all values (> 0), a tick at 1, 2 and 5 of every decade.
    pub fn logarithmic(label: &'static str, values: &[f64]) -> Self {
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = values.iter().copied().fold(0.0, f64::max);
        let (lowest, highest) = if lowest <= highest { (lowest, highest) } else { (1.0, 10.0) };
        let (from, to) = (lowest / 1.6, highest * 1.6);
        let decades = from.log10().floor() as i32..=to.log10().ceil() as i32;
        let steps: &[f64] = if to / from > 100.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let ticks = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
        let ticks = ticks.filter(|t| (from..=to).contains(t)).map(|t| (t, number(t))).collect();
        Self { label, from, to, ticks, logarithmic: true }
    }

    /// Where a value lies, 0 … 1.
    fn place(&self, value: f64) -> f64 {
        let scale = |v: f64| if self.logarithmic { v.max(1e-9).log10() } else { v };
        ((scale(value) - scale(self.from)) / (scale(self.to) - scale(self.from))).clamp(0.0, 1.0)
    }
}

/// A line, or dots, in a tracker's colour.
pub(super) struct Series<'a> {
    /// The tracker.
    pub name: &'a str,
    /// Its number, which chooses colour and dashes.
    pub tracker: usize,
    /// Where it goes.
    pub points: Points,
    /// Whether to draw dots with the name beside them rather than a line.
    pub dots: bool,
}

/// A chart of `width` × `height` units, which scales with the page.
pub(super) struct Chart<'a> {
    /// What it shows, for those who cannot see it.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub width: f64,
    pub height: f64,
    pub series: Vec<Series<'a>>,
    /// Spans of x in which the target is away.
    pub bands: Vec<(f64, f64)>,
    /// Whether to draw the diagonal y = x.
    pub diagonal: bool,
}

impl Chart<'_> {
    /// The chart as an `<svg>` element.
    pub fn render(&self) -> String {
        let mut out = String::new();
        let _ = write!(
            out,
            r#"<svg class="chart" viewBox="0 0 {} {}" role="img" aria-label="{}">"#,
            self.width,
            self.height,
            escape(&self.title)
        );
        self.frame(&mut out);
        for series in &self.series {
            let _ = write!(out, r#"<g class="series t{}" data-t="{}">"#, series.tracker % 8, series.tracker);
            if series.dots {
                self.dots(&mut out, series)
            } else {
                self.line(&mut out, series)
            }
            out.push_str("</g>");
        }
        out.push_str("</svg>");
        out
    }

    fn x(&self, value: f64) -> f64 {
        LEFT + self.x.place(value) * (self.width - LEFT - RIGHT)
    }

    fn y(&self, value: f64) -> f64 {
        self.height - BOTTOM - self.y.place(value) * (self.height - TOP - BOTTOM)
    }

    fn frame(&self, out: &mut String) {
        let (bottom, right) = (self.height - BOTTOM, self.width - RIGHT);
        for (from, to) in &self.bands {
            let (x, width) = (self.x(*from), self.x(*to) - self.x(*from));
            let (width, height) = (width.max(1.0), bottom - TOP);
            let _ = write!(
                out,
                r#"<rect class="away" x="{x:.1}" y="{TOP}" width="{width:.1}" height="{height:.1}"><title>target away</title></rect>"#
            );
        }
        for (value, text) in &self.y.ticks {
            let y = self.y(*value);
            let _ = write!(out, r#"<line class="grid" x1="{LEFT}" x2="{right}" y1="{y:.1}" y2="{y:.1}"/>"#);
            let _ = write!(
                out,
                r#"<text class="tick" x="{}" y="{:.1}" text-anchor="end">{text}</text>"#,
                LEFT - 7.0,
                y + 4.0
            );
        }
        for (value, text) in &self.x.ticks {
            let x = self.x(*value);
            let _ = write!(out, r#"<line class="grid" x1="{x:.1}" x2="{x:.1}" y1="{TOP}" y2="{bottom}"/>"#);
            let _ = write!(
                out,
                r#"<text class="tick" x="{x:.1}" y="{:.1}" text-anchor="middle">{text}</text>"#,
                bottom + 17.0
            );
        }
        if self.diagonal {
            let _ = write!(out, r#"<line class="ideal" x1="{LEFT}" y1="{bottom}" x2="{right}" y2="{TOP}"/>"#);
        }
        let middle = (LEFT + right) / 2.0;
        let _ = write!(
            out,
            r#"<text class="axis" x="{middle:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            self.height - 7.0,
            self.x.label
        );
        let centre = (TOP + bottom) / 2.0;
        let _ = write!(
            out,
            r#"<text class="axis" transform="translate(13 {centre:.1}) rotate(-90)" text-anchor="middle">{}</text>"#,
            self.y.label
        );
    }

    fn line(&self, out: &mut String, series: &Series<'_>) {
        let mut path = String::new();
        let mut pen_down = false;
        for point in &series.points {
            if let Some((x, y)) = point {
                let _ = write!(path, "{}{:.1} {:.1}", if pen_down { "L" } else { "M" }, self.x(*x), self.y(*y));
            }
            pen_down = point.is_some();
        }
        // More trackers than colours: later ones are dashed.
        let dash = ["", "7 4", "2 3", "9 3 2 3"][series.tracker / 8 % 4];
        let _ =
            write!(out, r#"<path d="{path}" stroke-dasharray="{dash}"><title>{}</title></path>"#, escape(series.name));
    }

    fn dots(&self, out: &mut String, series: &Series<'_>) {
        for (x, y) in series.points.iter().flatten() {
            let (cx, cy, name) = (self.x(*x), self.y(*y), escape(series.name));
            let _ = write!(
                out,
                r#"<circle cx="{cx:.1}" cy="{cy:.1}" r="6"><title>{name}: {}, {}</title></circle>"#,
                number(*x),
                number(*y)
            );
            let (dx, anchor) = if cx > self.width * 0.7 { (-10.0, "end") } else { (10.0, "start") };
            let _ = write!(out, r#"<text x="{:.1}" y="{:.1}" text-anchor="{anchor}">{name}</text>"#, cx + dx, cy + 4.0);
        }
    }
}

/// A number as short as it can be read.
fn number(value: f64) -> String {
    let digits = if value.abs() >= 10.0 || value == 0.0 { 0 } else { 2 };
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |axis: &Axis| axis.ticks.iter().map(|t| t.1.clone()).collect::<Vec<_>>();
        assert_eq!(labels(&Axis::linear("", 0.0, 1.0, 5)), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(labels(&Axis::counts("", 1234)), ["0", "500", "1000"]);
        assert_eq!(labels(&Axis::counts("", 3)), ["0", "1", "2", "3"]);
        assert_eq!(labels(&Axis::logarithmic("", &[30.0, 100.0])), ["20", "50", "100"]);
        assert_eq!(Axis::logarithmic("", &[]).ticks.len(), 4);
    }

    #[test]
    fn lines_break_where_nothing_is_known() {
        let points = vec![Some((0.0, 0.0)), Some((0.5, 1.0)), None, Some((1.0, 0.5))];
        let (x, y) = (Axis::linear("x", 0.0, 1.0, 2), Axis::linear("y", 0.0, 1.0, 2));
        let series = vec![Series { name: "<a>", tracker: 9, points, dots: false }];
        let title = "t".to_owned();
        let svg =
            Chart { title, x, y, width: HALF, height: 300.0, series, bands: vec![(0.2, 0.4)], diagonal: true }.render();
        let path = svg.split("d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!((path.matches('M').count(), path.matches('L').count()), (2, 1), "{path}");
        assert!(svg.contains("&lt;a&gt;") && svg.contains("class=\"series t1\"") && svg.contains("class=\"away\""));
    }
}
