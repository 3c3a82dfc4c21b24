//! From passes to the figures of a sequence, and from sequences to those of a tracker.

use crate::comparison::mean_interval;
use crate::metrics::calibration::{ScoreForecast, expected_calibration_error, reliability};
use crate::metrics::long_term::{
    PrecisionRecall, ScoredFrame, best_f, detection, false_alive, precision_recall, precision_recall_curve,
    reacquisition, right_untold, thresholds, wrong_told,
};
use crate::metrics::masks::MaskScore;
use crate::metrics::supervised::{self as vot, BURN_IN, EAO_SPAN, Fragment, SENSITIVITY, Supervised};
use crate::metrics::{geometric_mean, mean, median, one_pass};
use crate::results::{
    Curves, DetectionScore, LongTermScore, MeanScore, SequenceScore, SupervisedScore, TrackerResults,
};
use crate::score::{Scored, supervised};
use crate::{Protocol, RunRecord, Sequence, Trajectory};
use std::collections::{BTreeMap, BTreeSet};

/// Thresholds of the long-term curves (the VOT-LT toolkit's resolution).
const RESOLUTION: usize = 100;

/// Everything about one tracker on one sequence: figures, and what the figures over all sequences are made of.
#[derive(Debug, Clone, Default)]
pub(crate) struct SequenceOutcome {
    pub score: SequenceScore,
    success: Vec<f64>,
    precision: Vec<f64>,
    forecasts: Vec<ScoreForecast>,
    judged: Vec<ScoredFrame>,
    supervised: Vec<Supervised>,
    /// How many passes those are of.
    repetitions: usize,
}

impl SequenceOutcome {
    /// Frames of one supervised pass.
    fn length(&self) -> f64 {
        self.supervised.len() as f64 / self.repetitions.max(1) as f64
    }
}

impl SequenceOutcome {
    /// From the passes of a protocol over a sequence; there is at least one.
    pub fn new(protocol: Protocol, sequence: &Sequence, passes: &[(Trajectory, RunRecord)]) -> Self {
        let scored: Vec<Scored> = passes.iter().map(|(t, r)| Scored::new(sequence, t, r)).collect();
        let over = |figure: &dyn Fn(&Scored) -> f64| mean(&scored.iter().map(figure).collect::<Vec<_>>());
        let curve = |one: fn(&Scored) -> Vec<f64>| average(scored.iter().map(one).collect());
        let updates = pooled_time(passes);
        let forecasts: Vec<ScoreForecast> = scored.iter().flat_map(|s| s.forecasts.iter().copied()).collect();
        let judged = scored.first().map(|s| s.judged.clone()).unwrap_or_default();
        let single_pass = matches!(protocol, Protocol::Ope | Protocol::LongTerm);
        let wants_long_term = single_pass && (protocol == Protocol::LongTerm || sequence.has_absence());
        // Of several passes, which are repetitions then, one behind the other: each begins with a start.
        let runs = if protocol == Protocol::Reset { passes } else { &[] };
        let frames: Vec<Supervised> = runs.iter().flat_map(|(t, r)| supervised(sequence, t, r)).collect();
        let score = SequenceScore {
            auc: over(&|s| one_pass::success_auc(&s.overlaps)),
            precision20: over(&|s| one_pass::precision(&s.center_errors, 20.0)),
            success50: over(&|s| one_pass::success_rate(&s.overlaps, 0.5)),
            fps: updates.map(|u| u.fps()),
            frames: scored.iter().map(|s| s.overlaps.len()).sum(),
            normalized_precision: over(&|s| mean(&one_pass::normalized_precision_curve(&s.normalized_errors))),
            average_overlap: over(&|s| one_pass::average_overlap(&s.overlaps_after_start)),
            success75: over(&|s| one_pass::success_rate(&s.overlaps_after_start, 0.75)),
            median_center_error_px: median(&scored.iter().flat_map(|s| s.center_errors.clone()).collect::<Vec<_>>())
                .filter(|e| e.is_finite()),
            lost: over(&|s| s.lost),
            calibration_error: expected_calibration_error(&reliability(&forecasts)),
            init_ms: Some(mean(&passes.iter().map(|(_, r)| r.init_ms).collect::<Vec<_>>())),
            update: updates,
            masks: MaskScore::over(&passes.iter().flat_map(|(_, r)| r.masks.iter().copied()).collect::<Vec<_>>()),
            long_term: wants_long_term.then(|| long_term(&[&judged])),
            supervised: (protocol == Protocol::Reset).then(|| supervised_score(&frames, passes.len())),
            passes: (passes.len() > 1).then_some(passes.len()),
            error: passes.iter().find_map(|(_, r)| r.error.clone()),
        };
        Self {
            score,
            success: curve(|s| one_pass::success_curve(&s.overlaps).to_vec()),
            precision: curve(|s| one_pass::precision_curve(&s.center_errors).to_vec()),
            forecasts,
            judged,
            supervised: frames,
            repetitions: runs.len(),
        }
    }
}

/// The figures of a tracker over its sequences, and over those with each attribute; `attributes` says which a sequence has.
pub(crate) fn tracker_results(
    parameters: serde_json::Value,
    outcomes: BTreeMap<String, SequenceOutcome>,
    attributes: &BTreeMap<&str, &BTreeSet<String>>,
) -> TrackerResults {
    let all: Vec<&SequenceOutcome> = outcomes.values().collect();
    let mut parts: BTreeMap<String, Vec<&SequenceOutcome>> = BTreeMap::new();
    for (name, outcome) in &outcomes {
        for attribute in attributes.get(name.as_str()).into_iter().flat_map(|set| set.iter()) {
            parts.entry(attribute.clone()).or_default().push(outcome);
        }
    }
    let curves = Curves {
        success: average(all.iter().map(|o| o.success.clone()).collect()),
        precision: average(all.iter().map(|o| o.precision.clone()).collect()),
        eao: eao_curve(&all),
    };
    let (mean, calibration) = (mean_score(&all), reliability(&forecasts(&all)).to_vec());
    let attributes = parts.into_iter().map(|(name, outcomes)| (name, mean_score(&outcomes))).collect();
    let sequences = outcomes.into_iter().map(|(name, outcome)| (name, outcome.score)).collect();
    TrackerResults { mean, sequences, attributes, parameters, curves, calibration }
}

fn forecasts(of: &[&SequenceOutcome]) -> Vec<ScoreForecast> {
    of.iter().flat_map(|o| o.forecasts.iter().copied()).collect()
}

fn eao_curve(of: &[&SequenceOutcome]) -> Vec<f64> {
    vot::eao_curve(&of.iter().flat_map(|o| vot::fragments(&o.supervised)).collect::<Vec<Fragment>>())
}

/// The figures over several sequences.
fn mean_score(all: &[&SequenceOutcome]) -> MeanScore {
    let over = |figure: fn(&SequenceScore) -> f64| mean(&all.iter().map(|o| figure(&o.score)).collect::<Vec<_>>());
    let rate = |figure: fn(&SequenceScore) -> Option<f64>| {
        geometric_mean(&all.iter().filter_map(|o| figure(&o.score)).collect::<Vec<_>>())
    };
    let with_long_term: Vec<&[ScoredFrame]> =
        all.iter().filter(|o| o.score.long_term.is_some()).map(|o| o.judged.as_slice()).collect();
    MeanScore {
        auc: over(|s| s.auc),
        auc_interval: mean_interval(&all.iter().map(|o| o.score.auc).collect::<Vec<_>>()),
        rank: None,
        precision20: over(|s| s.precision20),
        success50: over(|s| s.success50),
        fps: rate(|s| s.fps),
        fps_wall: rate(|s| s.update.map(|u| u.fps_wall())),
        sequences: all.len(),
        normalized_precision: over(|s| s.normalized_precision),
        average_overlap: over(|s| s.average_overlap),
        success75: over(|s| s.success75),
        calibration_error: expected_calibration_error(&reliability(&forecasts(all))),
        masks: MaskScore::mean(&all.iter().filter_map(|o| o.score.masks).collect::<Vec<_>>()),
        long_term: (!with_long_term.is_empty()).then(|| long_term(&with_long_term)),
        supervised: supervised_mean(all, &eao_curve(all)),
    }
}

/// Long-term figures over one or several sequences: precision and recall are averaged over sequences before F is taken
/// (VOT-LT), absent frames and returns are counted together.
fn long_term(sequences: &[&[ScoredFrame]]) -> LongTermScore {
    let points: Vec<PrecisionRecall> = sequences.iter().map(|s| precision_recall(s, |j| j.alive)).collect();
    let point = PrecisionRecall::mean(&points).unwrap_or(PrecisionRecall { precision: 0.0, recall: 0.0 });
    let together: Vec<ScoredFrame> = sequences.concat();
    let thresholds = thresholds(&together.iter().map(|j| j.score).collect::<Vec<_>>(), RESOLUTION);
    let curves: Vec<_> = sequences.iter().map(|s| precision_recall_curve(s, &thresholds)).collect();
    let best = best_f(&curves, &thresholds);
    let returns: Vec<Option<usize>> = sequences.iter().flat_map(|s| reacquisition(s)).collect();
    let delays: Vec<f64> = returns.iter().flatten().map(|d| *d as f64).collect();
    LongTermScore {
        precision: point.precision,
        recall: point.recall,
        f: point.f(),
        f_best: best.map_or(0.0, |(_, p)| p.f()),
        f_best_threshold: best.map(|(t, _)| t).filter(|t| t.is_finite()),
        false_alive: false_alive(&together),
        right_untold: right_untold(&together),
        wrong_told: wrong_told(&together),
        reacquire_frames: median(&delays),
        detection25: detection_score(sequences, 0.25),
        detection50: detection_score(sequences, 0.5),
        returns: returns.len(),
        reacquired: delays.len(),
    }
}

fn detection_score(sequences: &[&[ScoredFrame]], overlap: f64) -> DetectionScore {
    let points: Vec<PrecisionRecall> = sequences.iter().map(|s| detection(s, overlap)).collect();
    let point = PrecisionRecall::mean(&points).unwrap_or(PrecisionRecall { precision: 0.0, recall: 0.0 });
    let f = points.iter().map(PrecisionRecall::f).sum::<f64>() / points.len().max(1) as f64;
    DetectionScore { precision: point.precision, recall: point.recall, f }
}

/// Of the frames of so many passes; failures are those of one.
fn supervised_score(frames: &[Supervised], passes: usize) -> SupervisedScore {
    let passes = passes.max(1) as f64;
    let failures = vot::failures(frames) as f64 / passes;
    SupervisedScore {
        accuracy: vot::accuracy(frames, BURN_IN).0,
        failures,
        robustness: vot::reliability(failures, frames.len() as f64 / passes, SENSITIVITY),
        eao: None,
    }
}

/// Weighted by length, as the toolkit's average accuracy and robustness.
fn supervised_mean(all: &[&SequenceOutcome], eao: &[f64]) -> Option<SupervisedScore> {
    let parts: Vec<(&SupervisedScore, f64)> =
        all.iter().filter_map(|o| Some((o.score.supervised.as_ref()?, o.length()))).collect();
    let frames: f64 = parts.iter().map(|(_, length)| length).sum();
    let weighted = |figure: fn(&SupervisedScore) -> f64| {
        parts.iter().map(|(s, length)| figure(s) * length).sum::<f64>() / frames.max(1.0)
    };
    let failures = weighted(|s| s.failures);
    (!parts.is_empty()).then(|| SupervisedScore {
        accuracy: weighted(|s| s.accuracy),
        failures,
        robustness: vot::reliability(failures, frames / parts.len() as f64, SENSITIVITY),
        eao: vot::expected_average_overlap(eao, EAO_SPAN),
    })
}

/// The pointwise mean of curves of one length.
fn average(curves: Vec<Vec<f64>>) -> Vec<f64> {
    let length = curves.iter().map(Vec::len).min().unwrap_or(0);
    (0..length).map(|i| mean(&curves.iter().map(|c| c[i]).collect::<Vec<_>>())).collect()
}

/// Update times of all passes together; quantiles are averaged.
fn pooled_time(passes: &[(Trajectory, RunRecord)]) -> Option<crate::UpdateTime> {
    let times: Vec<crate::UpdateTime> = passes.iter().filter_map(|(_, r)| r.update).collect();
    let count: usize = times.iter().map(|t| t.count).sum();
    let over = |figure: fn(&crate::UpdateTime) -> f64| {
        times.iter().map(|t| figure(t) * t.count as f64).sum::<f64>() / count.max(1) as f64
    };
    (count > 0).then(|| crate::UpdateTime {
        count,
        mean_ms: over(|t| t.mean_ms),
        wall_ms: over(|t| t.wall_ms),
        p50_ms: over(|t| t.p50_ms),
        p95_ms: over(|t| t.p95_ms),
        p99_ms: over(|t| t.p99_ms),
    })
}
