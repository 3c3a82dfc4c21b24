//! The one-dimensional scale filter of DSST and fDSST: which of a row of sizes looks most like the target.

mod filter;
mod samples;

pub use filter::ScaleFilter;
pub(crate) use samples::dot;
