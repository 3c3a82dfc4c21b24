//! Metrics against figures that an independent program computed from the same boxes.

#![allow(clippy::unwrap_used)]

use pursuit_evaluation::metrics::one_pass::{center_errors, overlaps, precision_curve, success_auc, success_curve};
use pursuit_evaluation::metrics::princeton::{Claim, error_types};
use pursuit_evaluation::metrics::{mean, one_pass};
use pursuit_geometry::BBox;
use serde_json::Value;

const TOLERANCE: f64 = 1e-9;

fn fixture() -> Value {
    serde_json::from_str(include_str!("fixtures/metrics.json")).unwrap()
}

fn boxes(value: &Value) -> Vec<BBox> {
    let one = |v: &Value| {
        let n: Vec<f64> = v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        BBox::from_ltwh(n[0], n[1], n[2], n[3])
    };
    value.as_array().unwrap().iter().map(one).collect()
}

fn close(name: &str, ours: &[f64], theirs: &Value) {
    let theirs: Vec<f64> = match theirs {
        Value::Array(all) => all.iter().map(|x| x.as_f64().unwrap()).collect(),
        one => vec![one.as_f64().unwrap()],
    };
    assert_eq!(ours.len(), theirs.len(), "{name}");
    for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        assert!((a - b).abs() <= TOLERANCE, "{name}[{i}]: {a} against {b}");
    }
}

#[test]
fn one_pass_metrics_equal_the_oracle() {
    let f = fixture();
    let (truth, estimates) = (boxes(&f["gt"]), boxes(&f["pred"]));
    let (overlaps, errors) = (overlaps(&truth, &estimates), center_errors(&truth, &estimates));
    close("iou", &overlaps, &f["iou"]);
    close("center_error", &errors, &f["center_error"]);
    close("success", &success_curve(&overlaps), &f["success_gt"]);
    close("auc", &[success_auc(&overlaps)], &f["auc_gt_mean"]);
    close("precision", &precision_curve(&errors), &f["precision"]);
    close("precision20", &[one_pass::precision(&errors, 20.0)], &f["precision20"]);
    close("mean_iou", &[one_pass::average_overlap(&overlaps)], &f["mean_iou"]);
    close("mean_center_error", &[mean(&errors)], &f["mean_center_error"]);
    close("sr50", &[one_pass::success_rate(&overlaps, 0.5)], &f["sr50"]);
    close("fails", &[1.0 - one_pass::success_rate(&overlaps, 0.0)], &f["zero_overlap_fraction"]);
}

#[test]
fn princeton_error_types_equal_the_oracle() {
    let f = fixture();
    let overlaps = overlaps(&boxes(&f["gt"]), &boxes(&f["pred"]));
    let flag = |name: &str, i: usize| f[name][i].as_bool().unwrap();
    let claims: Vec<Claim> = (0..overlaps.len())
        .map(|i| Claim { visible: flag("visible", i), output: flag("output", i), overlap: overlaps[i] })
        .collect();
    let types = error_types(&claims, 0.5);
    close("success", &[types.success], &f["ptb"]["success"]);
    close("type1", &[types.wrong_box], &f["ptb"]["type1"]);
    close("type2", &[types.false_box], &f["ptb"]["type2"]);
    close("type3", &[types.missing_box], &f["ptb"]["type3"]);
}
