//! The experiments of the papers' filters, done again over many seeds: the paper's figure, ours, an independent
//! reference, a tuned plain filter and interacting multiple models side by side, and what of the paper's claims holds.
//!
//! [`run`] is the command `pursuit reproduce`. All results are functions of the options alone: they do not depend on the
//! number of threads.

mod axis_filters;
mod ball;
mod filters;
mod gao2007;
mod monte_carlo;
mod motions;
mod qu2010;
mod random;
mod result;
mod table;
mod trajectories;
mod which_filter;
mod zhai2024;
mod zhu2014;

pub use result::{Bar, Finding, Reproduction, Row, Spread, Verdict};
pub use which_filter::{FilterComparison, FilterErrors, which_filter};

use crate::RunError;
use serde::Serialize;

/// The papers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Paper {
    /// A ball followed by its colour and a linear Kalman filter.
    Ball,
    /// A constant-acceleration filter that predicts a walking person.
    Qu2010,
    /// Depth, a correlation filter and a particle filter: the part that filters.
    Zhai2024,
    /// TLD with a Kalman filter that corrects at manoeuvres: the part that filters.
    Zhu2014,
    /// A Kalman filter whose transition is learnt by support vector regression.
    Gao2007,
}

impl Paper {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Ball, Self::Qu2010, Self::Zhai2024, Self::Zhu2014, Self::Gao2007];

    /// The key that the project knows the paper by.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball",
            Self::Qu2010 => "qu2010",
            Self::Zhai2024 => "zhai2024",
            Self::Zhu2014 => "zhu2014",
            Self::Gao2007 => "gao2007",
        }
    }

    /// How many seeds the bars ask for.
    pub const fn default_seeds(self) -> u32 {
        match self {
            Self::Ball => 200,
            Self::Zhu2014 => 300,
            Self::Qu2010 | Self::Zhai2024 | Self::Gao2007 => 1000,
        }
    }
}

/// How to run an experiment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Options {
    /// How many seeds to average over; [`Paper::default_seeds`] unless given. The particle filter of `zhai2024` runs on a
    /// tenth of them.
    pub seeds: Option<u32>,
}

/// Runs the experiment of one paper.
///
/// # Errors
/// [`RunError::Usage`] for no seeds at all; otherwise an error of a filter, which on these inputs is a defect.
pub fn run(paper: Paper, options: &Options) -> Result<Reproduction, RunError> {
    let seeds = options.seeds.unwrap_or_else(|| paper.default_seeds());
    if seeds == 0 {
        return Err(RunError::usage("an experiment needs one seed at least"));
    }
    match paper {
        Paper::Ball => ball::run(seeds),
        Paper::Qu2010 => qu2010::run(seeds),
        Paper::Zhai2024 => zhai2024::run(seeds),
        Paper::Zhu2014 => zhu2014::run(seeds),
        Paper::Gao2007 => gao2007::run(seeds),
    }
}
