//! Charts as SVG: lines and points over linear or logarithmic axes, radar charts, with round ticks, a legend that lies outside the
//! data, and colours that follow the reader from light to dark.
//!
//! [`Chart::to_svg`] makes a file that stands alone: title, legend and style inside. [`Chart::to_element`] makes an element
//! for a page that has its own captions and legend; the page includes [`page_style`] once.
//!
//! ```
//! use pursuit_charts::{Axis, Chart, Color, Series};
//!
//! let path = (0..50).map(|i| (f64::from(i) / 25.0, (f64::from(i) / 8.0).sin())).collect();
//! let chart = Chart::new("A swing", Axis::new("time (s)"), Axis::new("angle (rad)"))
//!     .with(Series::line("estimate", Color::Estimate, path));
//! assert!(chart.to_svg().is_some_and(|svg| svg.starts_with("<svg")));
//! ```

mod axis;
mod chart;
mod draw;
mod heat_map;
mod labels;
mod legend;
mod radar;
mod series;
mod style;
mod text;
mod ticks;

pub use axis::Axis;
pub use chart::Chart;
pub use heat_map::HeatMap;
pub use radar::Radar;
pub use series::{Color, Series};
pub use style::page_style;
pub use text::escape;
