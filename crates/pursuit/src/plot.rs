//! Line charts as SVG, a thin layer over the plotting library, so that it can be exchanged in one place.

use crate::RunError;
use kuva::plot::legend::LegendPosition;
use kuva::prelude::{Layout, LinePlot, Plot, ScatterPlot, render_to_svg};
use std::path::Path;

/// A chart of several series over a common axis.
#[derive(Debug, Clone)]
pub struct Chart {
    title: String,
    x_label: String,
    y_label: String,
    series: Vec<Series>,
    y_range: Option<(f64, f64)>,
}

/// One curve or cloud of points.
#[derive(Debug, Clone)]
pub struct Series {
    name: String,
    color: &'static str,
    marks: Marks,
    points: Vec<(f64, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Marks {
    Line { width: f64, dashed: bool },
    Points { size: f64 },
}

/// Colours with a fixed meaning in all our pictures.
pub mod colors {
    /// What was measured.
    pub const MEASURED: &str = "#2ca02c";
    /// What was predicted before the frame was seen.
    pub const PREDICTED: &str = "#d62728";
    /// The estimate.
    pub const ESTIMATE: &str = "#1f77b4";
    /// The truth.
    pub const TRUTH: &str = "#444444";
    /// Anything else to compare with.
    pub const OTHER: &str = "#9467bd";
}

impl Series {
    /// A line through `points`; a coordinate that is not a number breaks it.
    pub fn line(name: impl Into<String>, color: &'static str, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), color, marks: Marks::Line { width: 1.6, dashed: false }, points }
    }

    /// A dashed line.
    pub fn dashed(name: impl Into<String>, color: &'static str, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), color, marks: Marks::Line { width: 1.4, dashed: true }, points }
    }

    /// Separate points.
    pub fn points(name: impl Into<String>, color: &'static str, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), color, marks: Marks::Points { size: 2.5 }, points }
    }

    /// Stretches of finite points.
    fn segments(&self) -> impl Iterator<Item = &[(f64, f64)]> {
        self.points.split(|(x, y)| !(x.is_finite() && y.is_finite())).filter(|s| !s.is_empty())
    }

    fn plots(&self) -> Vec<Plot> {
        match self.marks {
            Marks::Points { size } => {
                let finite: Vec<(f64, f64)> = self.segments().flatten().copied().collect();
                if finite.is_empty() {
                    return Vec::new();
                }
                let plot = ScatterPlot::new().with_data(finite).with_color(self.color).with_size(size);
                vec![plot.with_legend(self.name.clone()).into()]
            }
            Marks::Line { width, dashed } => self
                .segments()
                .enumerate()
                .map(|(i, points)| {
                    let line =
                        LinePlot::new().with_data(points.to_vec()).with_color(self.color).with_stroke_width(width);
                    let line = if dashed { line.with_dashed() } else { line };
                    // One legend entry for the whole series, however often it is broken.
                    if i == 0 { line.with_legend(self.name.clone()).into() } else { line.into() }
                })
                .collect(),
        }
    }
}

impl Chart {
    /// An empty chart.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            series: Vec::new(),
            y_range: None,
        }
    }

    /// The chart with one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The chart with a fixed vertical range.
    #[must_use]
    pub const fn with_y_range(mut self, low: f64, high: f64) -> Self {
        self.y_range = Some((low, high));
        self
    }

    /// The chart as SVG text; `None` when there is no finite point to draw.
    pub fn to_svg(&self) -> Option<String> {
        let plots: Vec<Plot> = self.series.iter().flat_map(Series::plots).collect();
        if plots.is_empty() {
            return None;
        }
        let layout = Layout::auto_from_plots(&plots)
            .with_title(self.title.as_str())
            .with_x_label(self.x_label.as_str())
            .with_y_label(self.y_label.as_str())
            .with_legend_position(LegendPosition::OutsideRightTop)
            .with_width(900.0)
            .with_height(420.0);
        let layout = match self.y_range {
            Some((low, high)) => layout.with_y_axis_min(low).with_y_axis_max(high),
            None => layout,
        };
        Some(render_to_svg(plots, layout))
    }

    /// Writes the chart to a file; without a finite point there is none.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RunError> {
        match self.to_svg() {
            Some(svg) => std::fs::write(path, svg).map_err(RunError::output(path)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_break_lines_and_empty_charts_are_none() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 5.0)];
        let series = Series::line("estimate", colors::ESTIMATE, points);
        assert_eq!(series.segments().count(), 2);
        let svg = Chart::new("t", "x", "y").with(series).to_svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.matches("estimate").count() == 1, "{svg}");
        let empty = Chart::new("t", "x", "y").with(Series::points("p", colors::TRUTH, vec![(f64::NAN, 1.0)]));
        assert!(empty.to_svg().is_none());
    }
}
