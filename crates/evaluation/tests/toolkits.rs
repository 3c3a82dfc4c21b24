//! Metrics against the official toolkits (got10k, which also carries OTB's formulas, and VOT's).
//!
//! `tests/toolkits.py` made the fixture; it makes fresh cases too, named by the variable `PURSUIT_TOOLKIT_CASES`.
#![allow(clippy::unwrap_used, clippy::panic)]
#![allow(clippy::disallowed_methods, reason = "a variable names fresh cases")]

use pursuit_evaluation::metrics::long_term::{ScoredFrame, best_f, precision_recall_curve, thresholds};
use pursuit_evaluation::metrics::one_pass::{self, precision_curve, success_curve};
use pursuit_evaluation::metrics::supervised::{self, BURN_IN, EAO_SPAN, SENSITIVITY, Supervised};
use pursuit_geometry::BBox;
use serde_json::Value;

const TOLERANCE: f64 = 1e-6;

fn cases(kind: &str) -> Vec<Value> {
    let text = match std::env::var_os("PURSUIT_TOOLKIT_CASES") {
        Some(path) => std::fs::read_to_string(path).unwrap(),
        None => include_str!("fixtures/toolkits.json").to_owned(),
    };
    let all: Value = serde_json::from_str(&text).unwrap();
    let cases = all[kind].as_array().unwrap().clone();
    assert!(!cases.is_empty());
    cases
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn close(name: &str, ours: f64, theirs: &Value) {
    let theirs = theirs.as_f64().unwrap();
    assert!((ours - theirs).abs() <= TOLERANCE, "{name}: {ours} against {theirs}");
}

fn all_close(name: &str, ours: &[f64], theirs: &Value) {
    let theirs = theirs.as_array().unwrap();
    assert_eq!(ours.len(), theirs.len(), "{name}");
    ours.iter().zip(theirs).enumerate().for_each(|(i, (a, b))| close(&format!("{name}[{i}]"), *a, b));
}

#[test]
fn one_pass_metrics_equal_got10k_and_otb() {
    for case in cases("one_pass") {
        let boxes = |key: &str| -> Vec<BBox> {
            let one = |v: &Value| {
                let n = numbers(v);
                BBox::from_ltwh(n[0], n[1], n[2], n[3])
            };
            case[key].as_array().unwrap().iter().map(one).collect()
        };
        let (truth, estimate) = (boxes("truth"), boxes("estimate"));
        let (overlaps, errors) = (one_pass::overlaps(&truth, &estimate), one_pass::center_errors(&truth, &estimate));
        all_close("success", &success_curve(&overlaps), &case["success"]);
        all_close("precision", &precision_curve(&errors), &case["precision"]);
        close("auc", one_pass::success_auc(&overlaps), &case["auc"]);
        close("precision20", one_pass::precision(&errors, 20.0), &case["precision20"]);
        close("AO", one_pass::average_overlap(&overlaps[1..]), &case["ao"]);
        close("SR", one_pass::success_rate(&overlaps[1..], 0.5), &case["sr50"]);
    }
}

#[test]
fn supervised_metrics_equal_those_of_vot() {
    let mark = |v: &Value| match (v.as_str(), v.as_f64()) {
        (Some("i"), _) => Supervised::Init,
        (Some("f"), _) => Supervised::Failure,
        (Some("s"), _) => Supervised::Skipped,
        (_, Some(overlap)) => Supervised::Overlap(overlap),
        _ => panic!("{v}"),
    };
    for case in cases("supervised") {
        let marks = case["marks"].as_array().unwrap().iter();
        let sequences: Vec<Vec<Supervised>> = marks.map(|s| s.as_array().unwrap().iter().map(mark).collect()).collect();
        let (mut accuracy, mut failures, mut frames) = (0.0, 0.0, 0.0);
        for (sequence, theirs) in sequences.iter().zip(case["sequences"].as_array().unwrap()) {
            let (length, failed) = (sequence.len() as f64, supervised::failures(sequence) as f64);
            let (mean, count) = supervised::accuracy(sequence, BURN_IN);
            close("accuracy", mean, &theirs["accuracy"]);
            close("frames counted", count as f64, &theirs["count"]);
            close("failures", failed, &theirs["failures"]);
            close("robustness", supervised::reliability(failed, length, SENSITIVITY), &theirs["robustness"]);
            (accuracy, failures, frames) = (accuracy + mean * length, failures + failed * length, frames + length);
        }
        let (failures, length) = (failures / frames, frames / sequences.len() as f64);
        close("mean accuracy", accuracy / frames, &case["mean_accuracy"]);
        close("mean failures", failures, &case["mean_failures"]);
        close("mean robustness", supervised::reliability(failures, length, SENSITIVITY), &case["mean_robustness"]);
        let fragments: Vec<_> = sequences.iter().flat_map(|s| supervised::fragments(s)).collect();
        let curve = supervised::eao_curve(&fragments);
        all_close("EAO curve", &curve, &case["eao_curve"]);
        close("EAO", supervised::expected_average_overlap(&curve, EAO_SPAN).unwrap(), &case["eao"]);
    }
}

#[test]
fn long_term_metrics_equal_those_of_vot() {
    for case in cases("long_term") {
        let (score, overlap) = (numbers(&case["score"]), numbers(&case["overlap"]));
        let visible = case["visible"].as_array().unwrap().iter().map(|v| v.as_bool().unwrap());
        let judged: Vec<ScoredFrame> = visible
            .zip(score.iter().zip(&overlap))
            .map(|(visible, (score, overlap))| ScoredFrame { visible, alive: true, overlap: *overlap, score: *score })
            .collect();
        let thresholds = thresholds(&score, 100);
        let finite: Vec<f64> = thresholds.iter().map(|t| t.clamp(-1e300, 1e300)).collect();
        all_close("thresholds", &finite, &case["thresholds"]);
        let curve = precision_recall_curve(&judged, &thresholds);
        all_close("precision", &curve.iter().map(|p| p.precision).collect::<Vec<_>>(), &case["precision"]);
        all_close("recall", &curve.iter().map(|p| p.recall).collect::<Vec<_>>(), &case["recall"]);
        close("F", best_f(&[curve], &thresholds).unwrap().1.f(), &case["f"]);
    }
}
