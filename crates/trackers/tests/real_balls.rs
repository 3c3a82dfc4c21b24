//! The ball system on real footage, where it is present: `<repository>/../shared/data/ball`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_media::{OpenOptions, open};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, TrackState, Tracker};
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
    track_changed(path, color, |frame| frame)
}

/// The same on frames changed by `change`.
fn track_changed(path: &std::path::Path, color: &str, change: impl Fn(Frame) -> Frame) -> Vec<Option<Estimate>> {
    let set = || toml::Table::from_iter([("color".to_owned(), toml::Value::String(color.to_owned()))]);
    let mut detector = registry::detector("ball").unwrap().detector(&set()).unwrap();
    let recipe = registry::tracker("ball").unwrap().recipe(&set()).unwrap();
    let mut source = open(path.to_str().unwrap(), &OpenOptions::default()).unwrap();
    let mut tracker: Option<Box<dyn Tracker>> = None;
    let mut estimates = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        let frame = change(frame);
        estimates.push(match &mut tracker {
            Some(tracker) => Some(tracker.update(&frame).unwrap()),
            None => detector.detect(&frame, &[]).unwrap().first().map(|found| {
                tracker = Some(recipe.init(&frame, found.bbox).unwrap());
                Estimate::started(frame.time_s(), found.bbox, found.confidence)
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

/// The frame with every pixel changed.
fn repainted(frame: &Frame, paint: impl Fn(Rgb8) -> Rgb8) -> Frame {
    let (view, size) = (frame.color(), frame.size());
    let image = Image::from_fn(size.width, size.height, |x, y| paint(view.row(y)[x])).unwrap();
    Frame::new(frame.index(), frame.time_s(), image)
}

/// Turns the hue by `degrees`, keeping saturation and value.
fn turned(rgb: Rgb8, degrees: f64) -> Rgb8 {
    let [r, g, b] = rgb.map(f64::from);
    let (value, least) = (r.max(g).max(b), r.min(g).min(b));
    let chroma = value - least;
    if chroma == 0.0 {
        return rgb;
    }
    let sector = if value == r {
        (g - b) / chroma
    } else if value == g {
        2.0 + (b - r) / chroma
    } else {
        4.0 + (r - g) / chroma
    };
    let channel = |offset: f64| {
        let k = (offset + sector + degrees / 60.0).rem_euclid(6.0);
        value - chroma * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    [channel(5.0), channel(3.0), channel(1.0)].map(|c| c.round() as u8)
}

/// Every second pixel of every second row, as a camera of half the resolution sees it.
fn halved(frame: &Frame) -> Frame {
    let (view, size) = (frame.color(), frame.size());
    let mean = |x: usize, y: usize, c: usize| {
        let sum: u32 =
            [(0, 0), (1, 0), (0, 1), (1, 1)].iter().map(|(i, j)| u32::from(view.row(2 * y + j)[2 * x + i][c])).sum();
        (sum / 4) as u8
    };
    let image = Image::from_fn(size.width / 2, size.height / 2, |x, y| [mean(x, y, 0), mean(x, y, 1), mean(x, y, 2)]);
    Frame::new(frame.index(), frame.time_s(), image.unwrap())
}

/// A change of every frame.
type Change = Box<dyn Fn(Frame) -> Frame>;

#[test]
fn the_same_clips_in_other_colours_and_sizes() {
    let turn = |degrees: f64| -> Change { Box::new(move |f| repainted(&f, |p| turned(p, degrees))) };
    let dim = || -> Change { Box::new(|f| repainted(&f, |p| p.map(|c| (f64::from(c) * 0.45) as u8))) };
    let pale = || -> Change {
        Box::new(|f| {
            repainted(&f, |p| {
                let most = p.iter().copied().max().map_or(0.0, f64::from);
                p.map(|c| (most - 0.6 * (most - f64::from(c))).round() as u8)
            })
        })
    };
    let half = || -> Change { Box::new(|f| halved(&f)) };
    let orange = [
        ("turned to yellow", "yellow", turn(30.0), 1.0),
        ("turned to green", "green", turn(95.0), 1.0),
        ("turned to blue", "blue", turn(190.0), 1.0),
        ("turned to red", "red", turn(-24.0), 1.0),
        ("45 % light", "orange", dim(), 1.0),
        ("60 % saturation", "orange", pale(), 1.0),
        ("half size", "orange", half(), 0.5),
    ];
    let yellow = [
        ("turned to green", "green", turn(80.0), 1.0),
        ("turned to blue", "blue", turn(170.0), 1.0),
        ("turned to red", "red", turn(-44.0), 1.0),
        ("45 % light", "yellow", dim(), 1.0),
        ("60 % saturation", "yellow", pale(), 1.0),
        ("half size", "yellow", half(), 0.5),
    ];
    for (folder, file, first, variants) in
        [("orange_bounce", "clip.mp4", 5, &orange[..]), ("yellow_occluded", "clip.avi", 0, &yellow[..])]
    {
        let Some(folder) = clip(folder) else { return };
        let truth = truth(&folder);
        for (name, color, change, scale) in variants {
            let estimates = track_changed(&folder.join(file), color, change);
            let seen: Vec<usize> = (first..truth.len()).filter(|k| truth[*k].is_some()).collect();
            let overlap = |k: usize| {
                let truth = truth[k].unwrap();
                let (l, t, w, h) = truth.ltwh();
                let truth = BBox::from_ltwh(l * scale, t * scale, w * scale, h * scale);
                estimates[k].as_ref().map_or(0.0, |e| e.bbox.iou(&truth))
            };
            let mean = seen.iter().map(|k| overlap(*k)).sum::<f64>() / seen.len() as f64;
            let tracked = seen.iter().filter(|k| is_tracking(&estimates[**k])).count() as f64 / seen.len() as f64;
            // The truth ends a frame or two before the last sliver leaves the picture.
            let gone =
                (0..estimates.len()).filter(|k| truth.get(*k).is_none_or(Option::is_none) && !(133..136).contains(k));
            let wrong = gone.filter(|k| is_tracking(&estimates[*k])).count();
            println!(
                "{file} {name}: mean overlap {mean:.2}, tracking {tracked:.2}, tracking what is not there {wrong}"
            );
            assert!(mean >= 0.6 && tracked >= 0.9 && wrong == 0, "{file} {name}");
        }
    }
}
