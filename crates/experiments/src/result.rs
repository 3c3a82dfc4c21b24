//! What an experiment says: figures beside those of the paper and of an independent reference, their bars, and the claims
//! that hold or do not.

use super::Paper;
use crate::ExperimentError;
use pursuit_charts::Chart;
use serde::Serialize;
use std::path::Path;

/// A paper's experiment, done again.
#[derive(Debug, Clone, Serialize)]
pub struct Reproduction {
    /// Which paper.
    pub paper: Paper,
    /// Its experiment in one line.
    pub title: String,
    /// How many seeds the figures are of.
    pub seeds: u32,
    /// The figures, in the order of the paper.
    pub rows: Vec<Row>,
    /// The paper's sentences, and whether they hold.
    pub findings: Vec<Finding>,
    /// Pictures that correspond to the paper's, by file name without ending.
    #[serde(skip)]
    pub charts: Vec<(String, Chart)>,
}

/// One figure.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// The setting that it belongs to: a motion, a reading of the paper.
    pub setting: String,
    /// What it is.
    pub figure: String,
    /// The paper's own number.
    pub paper: Option<f64>,
    /// The number of an independent computation that shares no code with this one.
    pub reference: Option<f64>,
    /// Our number.
    pub ours: Spread,
    /// The same figure for a plain Kalman filter whose process noise was tuned on other seeds.
    pub tuned_plain: Option<f64>,
    /// The same figure for interacting multiple models.
    pub imm: Option<f64>,
    /// What ours must reach.
    pub bar: Option<Bar>,
    /// Whether it does.
    pub verdict: Option<Verdict>,
}

/// A number and, where it is of many seeds, how it varies among them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The number itself.
    pub value: f64,
    /// Its 5 % quantile over the seeds.
    pub low: Option<f64>,
    /// Its 95 % quantile over the seeds.
    pub high: Option<f64>,
}

impl From<f64> for Spread {
    fn from(value: f64) -> Self {
        Self { value, low: None, high: None }
    }
}

/// What a figure must reach.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bar {
    /// No more than this.
    AtMost(f64),
    /// No less than this.
    AtLeast(f64),
    /// More than this.
    Above(f64),
    /// Near a value.
    Within {
        /// The value.
        of: f64,
        /// How far off it may be, as a fraction of it.
        relative: f64,
    },
}

impl Bar {
    /// Whether `value` reaches the bar; what is not a number does not.
    pub fn judge(self, value: f64) -> Verdict {
        let pass = match self {
            Self::AtMost(limit) => value <= limit,
            Self::AtLeast(limit) => value >= limit,
            Self::Above(limit) => value > limit,
            Self::Within { of, relative } => (value - of).abs() <= relative * of.abs(),
        };
        if pass { Verdict::Pass } else { Verdict::Miss }
    }
}

/// Whether a bar was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It was.
    Pass,
    /// It was not.
    Miss,
}

/// A sentence of the paper, put to the test.
#[derive(Debug, Clone, Serialize)]
pub struct Finding {
    /// What the paper says, or what follows from it.
    pub claim: String,
    /// Whether it holds.
    pub holds: bool,
    /// The numbers that show it.
    pub evidence: String,
}

impl Row {
    /// A row with our number only.
    pub(crate) fn new(setting: impl Into<String>, figure: impl Into<String>, ours: impl Into<Spread>) -> Self {
        Self {
            setting: setting.into(),
            figure: figure.into(),
            paper: None,
            reference: None,
            ours: ours.into(),
            tuned_plain: None,
            imm: None,
            bar: None,
            verdict: None,
        }
    }

    /// With the paper's number.
    pub(crate) const fn paper(mut self, value: f64) -> Self {
        self.paper = Some(value);
        self
    }

    /// With the independent reference's number.
    pub(crate) const fn reference(mut self, value: f64) -> Self {
        self.reference = Some(value);
        self
    }

    /// With the independent reference's number, where there is one.
    pub(crate) const fn reference_if(mut self, value: Option<f64>) -> Self {
        self.reference = value;
        self
    }

    /// With what a tuned plain filter and interacting multiple models make of the same.
    pub(crate) const fn beside(mut self, tuned_plain: f64, imm: f64) -> Self {
        self.tuned_plain = Some(tuned_plain);
        self.imm = Some(imm);
        self
    }

    /// With a bar, judged at once.
    pub(crate) fn bar(mut self, bar: Bar) -> Self {
        self.verdict = Some(bar.judge(self.ours.value));
        self.bar = Some(bar);
        self
    }

    /// With a bar where there is one.
    pub(crate) fn bar_if(self, bar: Option<Bar>) -> Self {
        match bar {
            Some(bar) => self.bar(bar),
            None => self,
        }
    }
}

impl Finding {
    pub(crate) fn new(claim: impl Into<String>, holds: bool, evidence: impl Into<String>) -> Self {
        Self { claim: claim.into(), holds, evidence: evidence.into() }
    }
}

impl Reproduction {
    /// The rows that miss their bar.
    pub fn missed(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.verdict == Some(Verdict::Miss))
    }

    /// Writes `results.json` and the pictures into `folder`, which is made if need be.
    ///
    /// # Errors
    /// [`ExperimentError::Output`] when something cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ExperimentError> {
        std::fs::create_dir_all(folder).map_err(ExperimentError::output(folder))?;
        let path = folder.join("results.json");
        let text = self.to_json().map_err(|e| ExperimentError::output(&path)(e.into()))?;
        std::fs::write(&path, text).map_err(ExperimentError::output(&path))?;
        for (name, chart) in &self.charts {
            let path = folder.join(format!("{name}.svg"));
            chart.write(&path).map_err(ExperimentError::output(&path))?;
        }
        Ok(())
    }

    /// The rows and findings as JSON; a figure that is not a number is `null`.
    ///
    /// # Errors
    /// Where the serialiser fails, which it does not on these types.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_judge() {
        assert_eq!(Bar::AtMost(0.3).judge(0.3), Verdict::Pass);
        assert_eq!(Bar::AtLeast(0.3).judge(0.29), Verdict::Miss);
        assert_eq!(Bar::Above(1.0).judge(1.0), Verdict::Miss);
        assert_eq!(Bar::Within { of: 2.0, relative: 0.02 }.judge(1.961), Verdict::Pass);
        assert_eq!(Bar::Within { of: 2.0, relative: 0.02 }.judge(1.959), Verdict::Miss);
        assert_eq!(Bar::AtMost(1.0).judge(f64::NAN), Verdict::Miss);
    }

    #[test]
    fn a_missed_bar_is_found_and_written() {
        let reproduction = Reproduction {
            paper: Paper::Ball,
            title: "t".into(),
            seeds: 1,
            rows: vec![
                Row::new("s", "good", 1.0).bar(Bar::AtMost(2.0)),
                Row::new("s", "bad", 3.0).bar(Bar::AtMost(2.0)),
                Row::new("s", "free", 3.0),
            ],
            findings: vec![Finding::new("c", false, "e")],
            charts: Vec::new(),
        };
        assert_eq!(reproduction.missed().map(|r| r.figure.as_str()).collect::<Vec<_>>(), ["bad"]);
        let folder = tempfile::tempdir().unwrap();
        reproduction.write(folder.path()).unwrap();
        let text = std::fs::read_to_string(folder.path().join("results.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["rows"][1]["verdict"], "miss");
        assert_eq!(json["rows"][1]["bar"]["at_most"], 2.0);
        assert_eq!(json["findings"][0]["holds"], false);
    }
}
