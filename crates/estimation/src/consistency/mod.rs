//! Whether a filter is as sure as it ought to be: χ² bands for NEES and NIS, gates, and a running check.

mod chi_square;

use serde::{Deserialize, Serialize};

pub use chi_square::{chi_square_cumulative, chi_square_quantile};

use crate::error::require;
use crate::{Innovation, Result};

/// A gate on the normalised innovation squared: measurements beyond it are not of this target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gate {
    /// Largest NIS admitted; 9.21 admits 99 % of the true measurements of two components.
    pub threshold: f64,
}

impl Gate {
    /// The gate that admits a true measurement of `components` values with the given `probability`, in (0, 1).
    ///
    /// # Errors
    /// Where `components` is zero or `probability` is outside (0, 1).
    pub fn from_probability(components: usize, probability: f64) -> Result<Self> {
        Ok(Self { threshold: chi_square_quantile(components as f64, probability)? })
    }

    /// Whether a measurement with this innovation may be of the target.
    pub fn admits<const M: usize>(&self, innovation: &Innovation<M>) -> bool {
        innovation.nis() <= self.threshold
    }
}

/// An interval that a consistent filter's average stays in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

impl Band {
    /// The two-sided band of the **average** of `samples` independent χ² values of `degrees` degrees of freedom each:
    /// NEES with the state's length, NIS with the measurement's.
    ///
    /// # Errors
    /// Where a count is zero or `probability` is outside (0, 1).
    pub fn of_average(degrees: usize, samples: usize, probability: f64) -> Result<Self> {
        require("samples", samples as f64, samples > 0, "at least one")?;
        let total = (degrees * samples) as f64;
        let tail = 0.5 * (1.0 - probability);
        Ok(Self {
            lower: chi_square_quantile(total, tail)? / samples as f64,
            upper: chi_square_quantile(total, 1.0 - tail)? / samples as f64,
        })
    }

    /// Whether `value` lies inside.
    pub fn contains(&self, value: f64) -> bool {
        (self.lower..=self.upper).contains(&value)
    }
}

/// A running average of NEES or NIS values with the band it should stay in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Consistency {
    degrees: usize,
    samples: usize,
    sum: f64,
}

impl Consistency {
    /// An empty average of values with `degrees` degrees of freedom.
    pub const fn new(degrees: usize) -> Self {
        Self { degrees, samples: 0, sum: 0.0 }
    }

    /// Takes one more NEES or NIS in.
    pub const fn record(&mut self, value: f64) {
        self.sum += value;
        self.samples += 1;
    }

    /// The average so far; `None` before the first value.
    pub fn average(&self) -> Option<f64> {
        (self.samples > 0).then(|| self.sum / self.samples as f64)
    }

    /// The band of the average at the values recorded so far, if they are independent (NIS over time, NEES over runs).
    ///
    /// # Errors
    /// Where nothing was recorded yet or `probability` is outside (0, 1).
    pub fn band(&self, probability: f64) -> Result<Band> {
        Band::of_average(self.degrees, self.samples, probability)
    }
}
