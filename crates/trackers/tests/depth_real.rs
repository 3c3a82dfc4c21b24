//! The depth-aware trackers on real footage, where it is there: a toy with hands over it, and a mug that leaves the sight of
//! a moving camera. Thresholds were fitted with these two clips in view, so these are no figures to quote.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may panic, and says what it skips")]

use pursuit_media::depth::DepthOptions;
use pursuit_media::{OpenOptions, Truth, open};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, TrackState};
use std::path::PathBuf;

fn clip(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rgbd").join(name);
    let there = folder.join("frames.csv").is_file();
    if !there {
        eprintln!("skipped: {} is not there", folder.display());
    }
    there.then_some(folder)
}

fn follow(tracker: &str, folder: &std::path::Path, depth: DepthOptions) -> Vec<(Estimate, Truth)> {
    let options = OpenOptions { depth, ..OpenOptions::default() };
    let mut source = open(folder.to_str().unwrap(), &options).unwrap();
    let truth = source.info().truth.clone().unwrap();
    let first = source.next_frame().unwrap().unwrap();
    let recipe = registry::tracker(tracker).unwrap().default_recipe();
    let mut tracker = recipe.init(&first, truth[0].bbox().unwrap()).unwrap();
    std::iter::from_fn(|| source.next_frame().unwrap())
        .zip(&truth[1..])
        .map(|(frame, truth)| (tracker.update(&frame).unwrap(), *truth))
        .collect()
}

#[test]
fn a_toy_is_followed_under_hands() {
    let Some(folder) = clip("soft_toy_hand") else { return };
    for tracker in ["depth-occlusion", "depth-occlusion-fused"] {
        let said = follow(tracker, &folder, DepthOptions::default());
        let overlap = |(e, t): &(Estimate, Truth)| t.bbox().map(|b| b.iou(&e.bbox));
        let overlaps: Vec<f64> = said.iter().filter_map(overlap).collect();
        let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
        assert!(mean >= 0.65, "{tracker}: {mean:.3}");
    }
}

#[test]
fn a_mug_that_leaves_is_found_again() {
    let Some(folder) = clip("mug_kitchen") else { return };
    // Its depth is not registered; the numbers are those of its description.
    let depth = DepthOptions {
        intrinsics: Some([525.0, 525.0, 320.0, 240.0]),
        depth_intrinsics: Some([585.0, 585.0, 320.0, 240.0]),
        offset_mm: Some([-18.0, 0.0, 0.0]),
        ..DepthOptions::default()
    };
    let said = follow("depth-occlusion-fused", &folder, depth);
    let (mut row, mut longest) = (0, 0);
    for (estimate, truth) in &said {
        row = if *truth == Truth::Absent && estimate.state == TrackState::Tracking { row + 1 } else { 0 };
        longest = longest.max(row);
    }
    assert!(longest <= 5, "called tracked for {longest} frames while out of view");
    let gone = said.iter().rposition(|(_, t)| *t == Truth::Absent).unwrap();
    let whole = |t: &Truth| t.bbox().is_some_and(|b| b.bottom() <= 480.0 && b.right() <= 640.0);
    let back = gone + said[gone..].iter().position(|(_, t)| whole(t)).unwrap();
    let found = said[back..]
        .iter()
        .position(|(e, t)| e.state == TrackState::Tracking && t.bbox().is_some_and(|b| b.iou(&e.bbox) > 0.5));
    assert!(found.is_some_and(|frames| frames <= 15), "{found:?}");
}
