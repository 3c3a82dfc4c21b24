//! Channel features of patches, averaged over square cells: colour names, Lab, hue–saturation–value, grey, and
//! histograms of intensity.

mod color_table;
mod focal_colors;
mod intensity;
mod lab;

pub use color_table::ColorTable;
pub use focal_colors::ColorTerm;
pub use intensity::{IntensityHistogram, cell_means};
pub use lab::srgb_to_lab;
