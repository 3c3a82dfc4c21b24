//! The ball system on real footage, where it is present: `<repository>/../shared/data/ball`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::BBox;
use pursuit_media::{OpenOptions, open};
use pursuit_tracking::{Estimate, TrackState, Tracker, registry};
use std::path::PathBuf;

/// The clip's folder, `None` (said aloud) where it is absent.
fn clip(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/ball").join(name);
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

/// One box a frame; `None` where the ball is hidden or gone.
fn truth(folder: &std::path::Path) -> Vec<Option<BBox>> {
    let text = std::fs::read_to_string(folder.join("pseudo_gt_colour.txt")).unwrap();
    let line = |l: &str| {
        let n: Vec<f64> = l.split(',').map(|v| v.trim().parse().unwrap()).collect();
        (n[2] > 0.0).then(|| BBox::from_ltwh(n[0], n[1], n[2], n[3]))
    };
    text.lines().filter(|l| !l.trim().is_empty()).map(line).collect()
}

/// Detects with `--set color=…` until something is found, then tracks; `None` before.
fn track(path: &std::path::Path, color: &str) -> Vec<Option<Estimate>> {
    let set = || toml::Table::from_iter([("color".to_owned(), toml::Value::String(color.to_owned()))]);
    let mut detector = registry::detector("ball").unwrap().detector(set()).unwrap();
    let recipe = registry::tracker("ball").unwrap().recipe(set()).unwrap();
    let mut source = open(path.to_str().unwrap(), &OpenOptions::default()).unwrap();
    let mut tracker: Option<Box<dyn Tracker>> = None;
    let mut estimates = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        estimates.push(match &mut tracker {
            Some(tracker) => Some(tracker.update(&frame).unwrap()),
            None => detector.detect(&frame).unwrap().first().map(|found| {
                tracker = Some(recipe.init(&frame, found.bbox).unwrap());
                Estimate {
                    bbox: found.bbox,
                    score: found.confidence,
                    state: TrackState::Tracking,
                    prediction: None,
                    measurement: Some(found.bbox),
                    covariance: None,
                    diagnostics: Default::default(),
                }
            }),
        });
    }
    estimates
}

fn is_tracking(estimate: &Option<Estimate>) -> bool {
    estimate.as_ref().is_some_and(|e| e.state == TrackState::Tracking)
}

#[test]
fn a_bouncing_orange_ball() {
    let Some(folder) = clip("orange_bounce") else { return };
    let (estimates, truth) = (track(&folder.join("clip.mp4"), "orange"), truth(&folder));
    let span = 5..=125;
    let overlap = |k: usize| match (&estimates[k], truth[k]) {
        (Some(e), Some(t)) => e.bbox.iou(&t),
        _ => 0.0,
    };
    let frames = span.clone().count() as f64;
    let mean = span.clone().map(overlap).sum::<f64>() / frames;
    let mut errors: Vec<f64> =
        span.clone().filter_map(|k| Some(estimates[k].as_ref()?.bbox.center().distance(truth[k]?.center()))).collect();
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    let tracking = span.filter(|k| is_tracking(&estimates[*k])).count() as f64 / frames;
    println!(
        "orange_bounce, frames 5-125: mean overlap {mean:.3}, median centre error {median:.2} px, tracking {tracking:.3}"
    );
    assert!(mean >= 0.60 && median <= 10.0 && tracking >= 0.95);
    assert!((140..=156).all(|k| !is_tracking(&estimates[k])), "the ball has left by then");
}

#[test]
fn a_yellow_ball_behind_paper_before_yellow_leaves() {
    let Some(folder) = clip("yellow_occluded") else { return };
    let (estimates, truth) = (track(&folder.join("clip.avi"), "yellow"), truth(&folder));
    for k in 23..=29 {
        let state = estimates[k].as_ref().map(|e| e.state);
        assert_eq!(state, Some(TrackState::Occluded), "frame {k}");
    }
    let coasted = |k: usize| estimates[k].as_ref().unwrap().bbox.center().x;
    assert!(coasted(29) < coasted(23) - 50.0, "the prediction coasts on to the left");
    let overlap = |k: usize| estimates[k].as_ref().unwrap().bbox.iou(&truth[k].unwrap());
    let again = (30..33).find(|k| is_tracking(&estimates[*k]) && overlap(*k) > 0.5);
    let seen: Vec<usize> = (0..truth.len()).filter(|k| truth[*k].is_some()).collect();
    let mean =
        seen.iter().map(|k| estimates[*k].as_ref().map_or(0.0, |_| overlap(*k))).sum::<f64>() / seen.len() as f64;
    println!("yellow_occluded: mean overlap while seen {mean:.3}, found again in frame {again:?}");
    assert!(again.is_some() && mean > 0.6);
}
