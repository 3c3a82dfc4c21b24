//! Does a score of .8 come true in eight of ten frames? Scores of many frames against how often their boxes were right.

use pursuit::charts::{Axis, Chart, Color, Series};
use pursuit::tracking::TrackState;
use pursuit::{open, recipe, track};
use std::path::Path;

/// Scenes in which the target is hidden, leaves, is in another light, or has a double.
const SCENES: [&str; 4] = ["occluding-bar", "leave-and-return", "lighting-step", "look-alike"];
/// Scores are put into so many bins of equal width.
const BINS: usize = 5;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut bins = [(0.0, 0.0, 0.0); BINS]; // frames, sum of scores, right boxes
    let (mut away, mut told) = (0, 0);
    for scene in SCENES {
        for seed in 0..4 {
            let input = format!("scene:{scene}?seed={seed}&duration=5");
            let truth = open(input.as_str())?;
            let target = truth.info().truth_at(0).bbox().ok_or("the scene begins without its target")?;
            for (k, estimate) in (0..).zip(track(open(input.as_str())?, &*recipe("kcf")?, target)).skip(1) {
                let e = estimate?;
                let there = truth.info().truth_at(k).bbox();
                let is_right = there.is_some_and(|b| b.iou(&e.bbox) >= 0.5);
                let bin = &mut bins[((e.score * BINS as f64) as usize).min(BINS - 1)];
                *bin = (bin.0 + 1.0, bin.1 + e.score, bin.2 + f64::from(u8::from(is_right)));
                if there.is_none() {
                    away += 1;
                    told += i32::from(e.state == TrackState::Tracking);
                }
            }
        }
    }
    println!("of {away} frames without the target {told} are called tracking");
    let points = bins.iter().filter(|bin| bin.0 > 0.0).map(|(n, score, right)| (score / n, right / n)).collect();
    Chart::new(
        "What `kcf` says, and how often it comes true",
        Axis::new("score").over(0.0, 1.0),
        Axis::new("share of right boxes").over(0.0, 1.0),
    )
    .with_diagonal()
    .with(Series::line("boxes", Color::Estimate, points))
    .write(Path::new("honesty.svg"))?;
    Ok(())
}
