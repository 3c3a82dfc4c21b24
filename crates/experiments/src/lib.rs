//! The experiments of the papers' filters, done again over many seeds: the paper's figure, ours, an independent
//! reference, a tuned plain filter and interacting multiple models side by side, and what of the paper's claims holds.
//!
//! [`run`] is the command `pursuit reproduce`. All results are functions of the options alone: they do not depend on the
//! number of threads.

mod axis_filters;
mod ball;
mod error;
mod filters;
mod gao2007;
mod monte_carlo;
mod motions;
mod paper;
mod qu2010;
mod random;
mod result;
mod table;
mod trajectories;
mod which_filter;
mod zhai2024;
mod zhu2014;

pub use error::ExperimentError;
pub use paper::Paper;
pub use result::{Bar, Finding, Reproduction, Row, Spread, Verdict};
pub use which_filter::{FilterComparison, FilterErrors, which_filter};
pub use zhai2024::{ClipFigures, DepthClips, depth_clips};
pub use zhu2014::{AbsenceClip, absence_clips};

use std::path::PathBuf;

/// How to run an experiment.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    /// How many seeds to average over; [`Paper::default_seeds`] unless given. The particle filter of `zhai2024` runs on a
    /// tenth of them, and so do its clips.
    pub seeds: Option<u32>,
    /// Of `zhai2024`: a folder of sequences with depth, of the Princeton Tracking Benchmark or others, to compare on as well.
    pub dataset: Option<PathBuf>,
}

/// Runs the experiment of one paper.
///
/// # Errors
/// [`ExperimentError::Usage`] for no seeds at all; otherwise an error of a filter, which on these inputs is a defect.
pub fn run(paper: Paper, options: &Options) -> Result<Reproduction, ExperimentError> {
    let seeds = options.seeds.unwrap_or_else(|| paper.default_seeds());
    if seeds == 0 {
        return Err(ExperimentError::usage("an experiment needs one seed at least"));
    }
    if options.dataset.is_some() && paper != Paper::Zhai2024 {
        return Err(ExperimentError::usage(format!("the experiment of {paper} takes no data set; zhai2024 does")));
    }
    match paper {
        Paper::Ball => ball::run(seeds),
        Paper::Qu2010 => qu2010::run(seeds),
        Paper::Zhai2024 => zhai2024::run(seeds, options.dataset.as_deref()),
        Paper::Zhu2014 => zhu2014::run(seeds),
        Paper::Gao2007 => gao2007::run(seeds),
    }
}
