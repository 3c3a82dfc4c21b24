//! Tracking by sparse representation: what is seen is written as a sum of few of many templates, and the target is where few suffice.
//! `cst` (zhang2016) has all shifts of its templates.

mod cst;

pub use cst::{CstParams, cst};
