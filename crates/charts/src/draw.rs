//! From a chart to SVG.

use crate::axis::Scale;
use crate::chart::Chart;
use crate::labels;
use crate::legend::{Legend, none_if_empty};
use crate::series::{Color, Marks, Series};
use crate::style;
use crate::text::{escape, width};
use crate::ticks::Tick;
use std::fmt::Write as _;

/// Room for a tick's text and the axis' label below the data.
const BELOW: f64 = 44.0;
/// Size of the ticks' text.
const TICK_SIZE: f64 = 12.5;
/// Nearest that the texts of two ticks of x may come.
const APART: f64 = 14.0;

/// A file: title, legend, style and background inside.
pub(crate) fn file(chart: &Chart) -> String {
    let legend = Legend::of(&chart.series, 14.0, chart.width - 14.0);
    let top = 40.0 + legend.height() + if legend.height() > 0.0 { 8.0 } else { 0.0 };
    let plan = Plan::of(chart, top);
    let (w, h) = (plan.width, plan.height);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 {w:.0} {h:.0}\" width=\"{w:.0}\" height=\"{h:.0}\" \
         role=\"img\" aria-label=\"{0}\"><style>{1}</style><rect class=\"paper\" width=\"{w:.0}\" height=\"{h:.0}\"/>\
         <text class=\"title\" x=\"14\" y=\"25\">{0}</text>",
        escape(&chart.title),
        style::file_style(),
    );
    legend.draw(&mut out, 36.0);
    plan.draw(&mut out);
    out.push_str("</svg>\n");
    out
}

/// An element for a page.
pub(crate) fn element(chart: &Chart) -> String {
    let plan = Plan::of(chart, 12.0);
    let title = escape(&chart.title);
    let mut out = format!(
        r#"<svg class="chart" viewBox="0 0 {:.0} {:.0}" role="img" aria-label="{title}">"#,
        plan.width, plan.height
    );
    plan.draw(&mut out);
    out.push_str("</svg>");
    out
}

/// A chart with everything measured.
struct Plan<'a> {
    chart: &'a Chart,
    width: f64,
    height: f64,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: Scale,
    y: Scale,
    x_ticks: Vec<Tick>,
    y_ticks: Vec<Tick>,
}

impl<'a> Plan<'a> {
    fn of(chart: &'a Chart, top: f64) -> Self {
        // Title and legend add to the height, so that the data keep theirs.
        let height = chart.height + top - 12.0;
        let (width, bottom) = (chart.width, height - BELOW);
        let wanted_y = ((bottom - top) / 46.0) as usize;
        let points = || chart.series.iter().flat_map(Series::finite);
        let mut y = chart.y.fitted(points().map(|p| p.1), wanted_y);
        let y_extent = |y: &Scale| y.ticks(wanted_y).iter().map(text_width).fold(0.0, f64::max);
        let left = 30.0 + y_extent(&y).max(22.0);
        let x_axis = if chart.equal { chart.x.clone() } else { chart.x.clone().snug() };
        let most = ((width - left) / 60.0) as usize;
        let mut x = x_axis.fitted(points().map(|p| p.0), most);
        let mut right = width - 16.0;
        if chart.equal {
            // Units that are longer on one axis shrink to those of the other.
            let (unit_x, unit_y) = ((right - left) / (x.to - x.from), (bottom - top) / (y.to - y.from));
            (x, y) = (x.stretched((unit_x / unit_y).max(1.0)), y.stretched((unit_y / unit_x).max(1.0)));
        }
        let x_ticks = roomy_ticks(&x, most, right - left);
        // The last tick's text may hang over the end of the axis by half its width.
        if let Some(last) = x_ticks.last() {
            let end = left + x.place(last.0) * (right - left) + text_width(last) / 2.0;
            right -= (end - width + 4.0).max(0.0);
        }
        let y_ticks = y.ticks(wanted_y);
        let left = left.max(30.0 + y_ticks.iter().map(text_width).fold(0.0, f64::max));
        Self { chart, width, height, left, right, top, bottom, x, y, x_ticks, y_ticks }
    }

    fn draw(&self, out: &mut String) {
        self.surroundings(out);
        for series in &self.chart.series {
            let number = match series.color {
                Color::Number(n) => format!(r#" data-t="{n}""#),
                _ => String::new(),
            };
            let _ = write!(out, r#"<g class="series {}"{number}>"#, series.color.class());
            match series.marks {
                Marks::Line { .. } => self.line(out, series),
                Marks::Points => self.points(out, series),
                Marks::Named => self.dots(out, series),
                Marks::Area => self.area(out, series),
            }
            out.push_str("</g>");
        }
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let across = self.left + self.x.place(x) * (self.right - self.left);
        (across, self.bottom - self.y.place(y) * (self.bottom - self.top))
    }

    fn surroundings(&self, out: &mut String) {
        let (left, right, top, bottom) = (self.left, self.right, self.top, self.bottom);
        for (from, to, name) in &self.chart.bands {
            let (from, to) = (self.at((*from, 0.0)).0, self.at((*to, 0.0)).0);
            let (wide, high, name) = ((to - from).max(1.0), bottom - top, escape(name));
            let _ = write!(
                out,
                r#"<rect class="away" x="{from:.1}" y="{top:.1}" width="{wide:.1}" height="{high:.1}"><title>{name}</title></rect>"#
            );
        }
        for (value, text) in &self.y_ticks {
            let y = self.at((self.x.from, *value)).1;
            let _ = write!(out, r#"<path class="grid" d="M{left:.1} {y:.1}H{right:.1}"/>"#);
            let (x, y) = (left - 7.0, y + 4.3);
            let _ = write!(out, r#"<text class="tick" x="{x:.1}" y="{y:.1}" text-anchor="end">{text}</text>"#);
        }
        for (value, text) in &self.x_ticks {
            let x = self.at((*value, self.y.from)).0;
            let _ = write!(out, r#"<path class="grid" d="M{x:.1} {top:.1}V{bottom:.1}"/>"#);
            let y = bottom + 17.0;
            let _ = write!(out, r#"<text class="tick" x="{x:.1}" y="{y:.1}" text-anchor="middle">{text}</text>"#);
        }
        let _ = write!(out, r#"<path class="frame" d="M{left:.1} {top:.1}V{bottom:.1}H{right:.1}"/>"#);
        if self.chart.diagonal {
            let _ = write!(out, r#"<path class="ideal" d="M{left:.1} {bottom:.1}L{right:.1} {top:.1}"/>"#);
        }
        let (middle, base) = ((left + right) / 2.0, self.height - 8.0);
        let label = escape(&self.chart.x.label);
        let _ = write!(out, r#"<text class="axis" x="{middle:.1}" y="{base:.1}" text-anchor="middle">{label}</text>"#);
        let (middle, label) = ((top + bottom) / 2.0, escape(&self.chart.y.label));
        let _ = write!(
            out,
            r#"<text class="axis" transform="translate(15 {middle:.1}) rotate(-90)" text-anchor="middle">{label}</text>"#
        );
    }

    fn line(&self, out: &mut String, series: &Series) {
        let mut path = String::new();
        for segment in series.segments() {
            let places = thinned(segment.iter().map(|p| self.at(*p)).collect());
            for (i, (x, y)) in places.iter().enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" });
            }
            if places.len() == 1 {
                // A lone point between gaps: a line without length would not be seen.
                path.push_str("h1");
            }
        }
        let (dashes, name) = (none_if_empty(series.dashes()), escape(&series.name));
        let _ = write!(out, r#"<path d="{path}" stroke-dasharray="{dashes}"><title>{name}</title></path>"#);
    }

    fn area(&self, out: &mut String, series: &Series) {
        let mut path = String::new();
        for [upper, lower] in series.areas() {
            let places = |points: &[(f64, f64)]| thinned(points.iter().map(|p| self.at(*p)).collect());
            let back = places(lower).into_iter().rev();
            for (i, (x, y)) in places(upper).into_iter().chain(back).enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" });
            }
            path.push('Z');
        }
        let name = escape(&series.name);
        let _ = write!(out, r#"<path class="area" d="{path}"><title>{name}</title></path>"#);
    }

    fn points(&self, out: &mut String, series: &Series) {
        let mut path = String::new();
        let mut last = String::new();
        for point in series.finite() {
            let (x, y) = self.at(point);
            let mark = format!("M{x:.1} {y:.1}h0");
            if mark != last {
                path.push_str(&mark);
                last = mark;
            }
        }
        let name = escape(&series.name);
        let _ = write!(out, r#"<path class="dots" d="{path}"><title>{name}</title></path>"#);
    }

    fn dots(&self, out: &mut String, series: &Series) {
        let named = self.chart.series.iter().filter(|s| s.marks == Marks::Named);
        let all: Vec<(&Series, (f64, f64))> = named.flat_map(|s| s.finite().map(move |p| (s, p))).collect();
        let dots: Vec<(f64, f64, &str)> =
            all.iter().map(|(s, p)| (self.at(*p).0, self.at(*p).1, s.name.as_str())).collect();
        let places = labels::place(&dots, [self.left, self.top, self.right, self.bottom]);
        let own = all.iter().zip(dots).zip(places).filter(|((all, _), _)| std::ptr::eq(all.0, series));
        for (((_, (x, y)), (cx, cy, name)), (at, base, anchor)) in own {
            let (name, r) = (escape(name), labels::DOT);
            let _ = write!(
                out,
                r#"<circle cx="{cx:.1}" cy="{cy:.1}" r="{r}"><title>{name}: {}, {}</title></circle>"#,
                significant(*x),
                significant(*y)
            );
            let _ = write!(out, r#"<text x="{at:.1}" y="{base:.1}" text-anchor="{anchor}">{name}</text>"#);
        }
    }
}

fn text_width(tick: &Tick) -> f64 {
    width(&tick.1, TICK_SIZE)
}

/// As many ticks, `most` at the most, as their texts have room for on `length`.
fn roomy_ticks(scale: &Scale, most: usize, length: f64) -> Vec<Tick> {
    let fits = |ticks: &[Tick]| {
        ticks.windows(2).all(|pair| {
            let apart = (scale.place(pair[1].0) - scale.place(pair[0].0)) * length;
            apart >= (text_width(&pair[0]) + text_width(&pair[1])) / 2.0 + APART
        })
    };
    (1..=most.max(1)).rev().map(|wanted| scale.ticks(wanted)).find(|ticks| fits(ticks)).unwrap_or_default()
}

/// The first, lowest, highest and last point of every half unit across: what is left out could not be seen.
fn thinned(places: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let column = |x: f64| (2.0 * x).floor();
    if places.len() < 4 || places.windows(2).any(|p| p[1].0 < p[0].0) {
        return places;
    }
    let mut kept = Vec::new();
    for run in places.chunk_by(|a, b| column(a.0) == column(b.0)) {
        let extreme = |order: fn(&f64, &f64) -> std::cmp::Ordering| {
            run.iter().enumerate().min_by(|a, b| order(&a.1.1, &b.1.1)).map_or(0, |(i, _)| i)
        };
        let mut at = [0, extreme(f64::total_cmp), extreme(|a, b| b.total_cmp(a)), run.len() - 1];
        at.sort_unstable();
        let mut chosen = at.to_vec();
        chosen.dedup();
        kept.extend(chosen.into_iter().filter_map(|i| run.get(i).copied()));
    }
    kept
}

/// Three significant digits, no more than are needed.
fn significant(value: f64) -> String {
    let digits = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;

    fn chart() -> Chart {
        Chart::new("t", Axis::new("x").over(0.0, 1.0), Axis::new("y").over(0.0, 1.0))
    }

    #[test]
    fn thinned_columns_keep_ends_and_extremes() {
        let many: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i) / 1000.0, f64::from(i * 7919 % 1000))).collect();
        let kept = thinned(many.clone());
        assert!(kept.len() <= 8, "{kept:?}");
        assert_eq!((kept[0], kept[kept.len() - 1]), (many[0], many[999]));
        let heights: Vec<f64> = kept.iter().map(|p| p.1).collect();
        assert!(heights.contains(&0.0) && heights.contains(&999.0));
        let back = vec![(0.0, 0.0), (0.3, 1.0), (0.2, 2.0), (0.1, 3.0), (0.0, 4.0)];
        assert_eq!(thinned(back.clone()), back);
    }

    #[test]
    fn values_are_placed_from_the_lower_left_corner() {
        let chart = chart();
        let plan = Plan::of(&chart, 12.0);
        assert_eq!(plan.at((0.0, 0.0)), (plan.left, plan.bottom));
        assert_eq!(plan.at((1.0, 1.0)), (plan.right, plan.top));
        assert_eq!(plan.at((7.0, -7.0)), (plan.right, plan.bottom));
        assert_eq!((plan.height, plan.bottom), (420.0, 376.0));
    }

    #[test]
    fn equal_units_are_equal() {
        for path in [vec![(0.0, 0.0), (10.0, 3.0)], vec![(0.0, 0.0), (3.0, 500.0)]] {
            let chart = Chart::new("t", Axis::new("x"), Axis::new("y")).with_equal_units();
            let chart = chart.with(Series::line("p", Color::Truth, path));
            let plan = Plan::of(&chart, 12.0);
            let x = (plan.right - plan.left) / (plan.x.to - plan.x.from);
            let y = (plan.bottom - plan.top) / (plan.y.to - plan.y.from);
            assert!((x / y - 1.0).abs() < 0.02, "{x} {y}");
        }
    }

    #[test]
    fn ticks_have_room() {
        for to in [1.0, 123_456.0, 0.01] {
            let scale = Axis::new("x").over(0.0, to).fitted(std::iter::empty(), 5);
            for length in [100.0, 300.0, 900.0] {
                let ticks = roomy_ticks(&scale, 12, length);
                let room = length * scale.place(ticks[1].0 - ticks[0].0);
                assert!(ticks.len() >= 2 && room > text_width(&ticks[1]) + APART - 1.0, "{to} on {length}: {ticks:?}");
            }
        }
    }

    #[test]
    fn figures_are_short() {
        for (value, text) in [(0.0, "0"), (0.5, "0.5"), (123.4, "123"), (0.012_34, "0.0123"), (-7.0, "-7")] {
            assert_eq!(significant(value), text);
        }
    }
}
