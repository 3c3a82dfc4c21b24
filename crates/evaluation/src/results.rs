//! `results.json`: every figure, for every tracker and sequence.

use crate::metrics::calibration::Bin;
use crate::metrics::masks::MaskScore;
use crate::{Comparison, Protocol, UpdateTime};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The figures of an evaluation.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Results {
    /// Figures by tracker.
    pub trackers: BTreeMap<String, TrackerResults>,
    /// The protocol they were gained under.
    pub protocol: Protocol,
    /// Every tracker against those ranked below it, and against stored results where there are such.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Comparison>,
    /// Sequences that could not be used, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub problems: Vec<String>,
    /// Whether the evaluation was stopped before everything had run; the same call again finishes it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub interrupted: bool,
}

impl Results {
    /// The trackers, the best success AUC first.
    pub fn ranking(&self) -> Vec<&str> {
        let mut names: Vec<(&str, f64)> = self.trackers.iter().map(|(n, t)| (n.as_str(), t.mean.auc)).collect();
        names.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(b.0)));
        names.into_iter().map(|(name, _)| name).collect()
    }

    /// The attributes that sequences of some tracker have.
    pub fn attributes(&self) -> BTreeSet<&str> {
        self.trackers.values().flat_map(|t| t.attributes.keys().map(String::as_str)).collect()
    }
}

/// Figures of one tracker.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrackerResults {
    /// Over all its sequences.
    pub mean: MeanScore,
    /// By sequence.
    pub sequences: BTreeMap<String, SequenceScore>,
    /// Over the sequences with an attribute, by its name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub attributes: BTreeMap<String, MeanScore>,
    /// Every parameter it ran with.
    pub parameters: serde_json::Value,
    /// Curves averaged over sequences.
    pub curves: Curves,
    /// The reliability diagram of `score` over all frames after the starts.
    pub calibration: Vec<Bin>,
}

/// Curves averaged over sequences.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Curves {
    /// Success rate at overlap thresholds 0, .05, …, 1.
    pub success: Vec<f64>,
    /// Precision at centre errors of 0, 1, …, 50 pixels.
    pub precision: Vec<f64>,
    /// Expected average overlap by run length (reset protocol).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub eao: Vec<f64>,
}

/// Figures over all sequences of a tracker.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MeanScore {
    /// Mean of the success AUCs.
    pub auc: f64,
    /// 95 % interval of that mean, by resampling sequences; `None` of fewer than six.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub auc_interval: Option<[f64; 2]>,
    /// The best and the worst rank by success AUC that the comparisons allow: behind every tracker that is clearly better,
    /// ahead of every one that is clearly worse. `None` where there is no other tracker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rank: Option<[usize; 2]>,
    /// Mean of the precisions at 20 px.
    pub precision20: f64,
    /// Mean of the success rates at overlap .5.
    pub success50: f64,
    /// Geometric mean of the frame rates; `None` where no time was measured.
    pub fps: Option<f64>,
    /// Geometric mean of the frame rates on the wall.
    pub fps_wall: Option<f64>,
    /// Sequences counted.
    pub sequences: usize,
    /// Mean of the areas under the normalised precision curve.
    pub normalized_precision: f64,
    /// Mean of GOT-10k's average overlaps (without the first frame).
    pub average_overlap: f64,
    /// Mean of GOT-10k's success rates at .75.
    pub success75: f64,
    /// Expected calibration error of `score` over all frames after the starts.
    pub calibration_error: Option<f64>,
    /// Figures of masks, over the sequences that have them.
    #[serde(flatten)]
    pub masks: Option<MaskScore>,
    /// Long-term figures, over the sequences that have them.
    #[serde(flatten)]
    pub long_term: Option<LongTermScore>,
    /// Supervised figures (reset protocol).
    #[serde(flatten)]
    pub supervised: Option<SupervisedScore>,
}

/// Figures of one tracker on one sequence.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SequenceScore {
    /// Success AUC: mean over thresholds 0, .05, …, 1 of the fraction of annotated frames with overlap above.
    pub auc: f64,
    /// Fraction of annotated frames with a centre error of at most 20 px.
    pub precision20: f64,
    /// Fraction of annotated frames with overlap above .5.
    pub success50: f64,
    /// 1 / mean update time: one thread, frames decoded beforehand, start apart; `None` where no time was measured.
    pub fps: Option<f64>,
    /// Annotated frames that were scored.
    pub frames: usize,
    /// Area under the normalised precision curve (0 … .5 of the target's size).
    pub normalized_precision: f64,
    /// GOT-10k's AO: mean overlap without the first frame.
    pub average_overlap: f64,
    /// GOT-10k's SR at .75.
    pub success75: f64,
    /// Median centre error in pixels; `None` when the tracker had lost the target more often than not.
    pub median_center_error_px: Option<f64>,
    /// Fraction of annotated frames without a box: reported lost, or after an error.
    pub lost: f64,
    /// Expected calibration error of `score`.
    pub calibration_error: Option<f64>,
    /// Time of a start in milliseconds.
    pub init_ms: Option<f64>,
    /// Time of an update.
    pub update: Option<UpdateTime>,
    /// Figures of masks, where the tracker says masks and the true ones are known.
    #[serde(flatten)]
    pub masks: Option<MaskScore>,
    /// Long-term figures: where the target is away at times, and for all sequences under that protocol.
    #[serde(flatten)]
    pub long_term: Option<LongTermScore>,
    /// Supervised figures (reset protocol).
    #[serde(flatten)]
    pub supervised: Option<SupervisedScore>,
    /// Passes averaged over, where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub passes: Option<usize>,
    /// What went wrong, if something did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl From<&SequenceScore> for MeanScore {
    /// The figures of one sequence as those of a set of one.
    fn from(score: &SequenceScore) -> Self {
        Self {
            auc: score.auc,
            auc_interval: None,
            rank: None,
            precision20: score.precision20,
            success50: score.success50,
            fps: score.fps,
            fps_wall: score.update.map(|u| u.fps_wall()),
            sequences: 1,
            normalized_precision: score.normalized_precision,
            average_overlap: score.average_overlap,
            success75: score.success75,
            calibration_error: score.calibration_error,
            masks: score.masks,
            long_term: score.long_term.clone(),
            supervised: score.supervised.clone(),
        }
    }
}

/// Long-term figures. A box is claimed in the frames whose state is `tracking`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LongTermScore {
    /// Mean overlap where a box is claimed.
    pub precision: f64,
    /// Sum of these overlaps over the visible frames.
    pub recall: f64,
    /// Harmonic mean of both.
    pub f: f64,
    /// The best F over score thresholds (VOT-LT).
    pub f_best: f64,
    /// The threshold it is reached at; `None` at ±∞ (all boxes or none).
    pub f_best_threshold: Option<f64>,
    /// Fraction of the frames without the target that are reported `tracking`; `None` without such frames.
    pub false_alive: Option<f64>,
    /// Fraction of the visible frames with a box that overlaps by at least .5 that are not reported `tracking`; `None` without such.
    #[serde(default)]
    pub right_untold: Option<f64>,
    /// Fraction of the visible frames with a box that overlaps by less that are; `None` without such.
    #[serde(default)]
    pub wrong_told: Option<f64>,
    /// Median frames from a reappearance to overlap above .5, over the returns that were noticed.
    pub reacquire_frames: Option<f64>,
    /// The TLD evaluation at overlap above .25.
    #[serde(default)]
    pub detection25: DetectionScore,
    /// The TLD evaluation at overlap above .5.
    #[serde(default)]
    pub detection50: DetectionScore,
    /// How often the target came back.
    pub returns: usize,
    /// How often that was noticed before it left again.
    pub reacquired: usize,
}

/// The TLD evaluation (Kalal, Mikolajczyk and Matas 2012): a claimed box is right or wrong. Over sequences all three are
/// means.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct DetectionScore {
    /// Share of the claimed boxes that are right; 1 when none is claimed.
    pub precision: f64,
    /// Share of the visible frames with a right box.
    pub recall: f64,
    /// Harmonic mean of both.
    pub f: f64,
}

/// Figures of VOT's supervised protocol.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SupervisedScore {
    /// Mean overlap outside burn-in and failures; over sequences weighted by length.
    pub accuracy: f64,
    /// Failures: of the sequence; over sequences their mean weighted by length, as the toolkit has it.
    pub failures: f64,
    /// exp(−30 · failures / frames).
    pub robustness: f64,
    /// Expected average overlap over run lengths 100…356 (over all sequences; `None` where no run is that long).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eao: Option<f64>,
}
