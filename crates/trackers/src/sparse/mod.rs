//! Tracking by sparse representation: what is seen is written as a sum of few of many templates, and the target is where few suffice.
//! `cst` (zhang2016) has all shifts of its templates, `l1` (mei2011, bao2012) samples of where the target may be.

mod cst;
mod l1;

pub use cst::{CstParams, cst};
pub use l1::{L1CodeParams, L1Finding, L1MoveParams, L1Params, L1ScoreParams, L1Tracker, L1UpdateParams, l1};
