//! A chart, put together piece by piece.

use crate::draw;
use crate::{Axis, Series};
use std::path::Path;

/// Curves and points over two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) series: Vec<Series>,
    pub(crate) bands: Vec<(f64, f64, String)>,
    pub(crate) diagonal: bool,
    pub(crate) equal: bool,
}

impl Chart {
    /// An empty chart of 900 × 420 units.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        let (width, height) = (900.0, 420.0);
        let (series, bands) = (Vec::new(), Vec::new());
        Self { title: title.into(), x, y, width, height, series, bands, diagonal: false, equal: false }
    }

    /// With one more series, drawn over those before it.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// With a span of x shaded from bottom to top; `name` is shown where the reader points at it.
    #[must_use]
    pub fn with_band(mut self, from: f64, to: f64, name: impl Into<String>) -> Self {
        self.bands.push((from, to, name.into()));
        self
    }

    /// With a dotted diagonal from the lower left corner to the upper right one.
    #[must_use]
    pub const fn with_diagonal(mut self) -> Self {
        self.diagonal = true;
        self
    }

    /// With a unit of x as long as a unit of y (linear axes): for paths in a plane.
    #[must_use]
    pub const fn with_equal_units(mut self) -> Self {
        self.equal = true;
        self
    }

    /// With other proportions. The picture scales with the page; the units are pixels where it does not. At least 200 × 150.
    #[must_use]
    pub const fn sized(mut self, width: f64, height: f64) -> Self {
        (self.width, self.height) = (width.max(200.0), height.max(150.0));
        self
    }

    /// The title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Whether there is anything to draw.
    pub fn is_empty(&self) -> bool {
        self.series.iter().all(|s| s.finite().next().is_none())
    }

    /// The chart as a file of its own, with title, legend and style; `None` when there is no finite point to draw.
    pub fn to_svg(&self) -> Option<String> {
        (!self.is_empty()).then(|| draw::file(self))
    }

    /// The chart as an element for a page that includes [`page_style`](crate::page_style) and says itself what is shown: the
    /// title is only read to those who cannot see. Series of [`Color::Number`](crate::Color::Number) carry their number as
    /// `data-t`.
    pub fn to_element(&self) -> String {
        draw::element(self)
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
}
