//! What trackers remember of how a target looks.

mod color_histogram;
mod initial_template;
mod support;

pub use color_histogram::ColorHistogram;
pub use initial_template::InitialTemplate;
pub use support::Support;
