//! The depth-aware tracker in worlds with depth: it says when it is hidden, is back at once, and does not mind the light.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image, Pixels};
use pursuit_scenes::{Scene, TargetTruth};
use pursuit_trackers::registry;
use pursuit_tracking::{Doubt, Estimate, Recipe, TrackState, Tracker};

fn recipe(name: &str, settings: &str) -> Box<dyn Recipe> {
    registry::tracker(name).unwrap().recipe(&settings.parse().unwrap()).unwrap()
}

fn scene(query: &str) -> Box<dyn Scene> {
    pursuit_scenes::open(&format!("scene:rgbd-occlusion?{query}")).unwrap()
}

fn frame(scene: &dyn Scene, k: u64) -> (Frame, TargetTruth) {
    let time_s = scene.frame_time_s(k);
    let moment = scene.render(time_s);
    let truth = moment.targets[0];
    (moment.into_frame(k, time_s, &scene.home()), truth)
}

/// What a tracker says of every frame after the first, with the truth.
fn follow(recipe: &dyn Recipe, scene: &dyn Scene, change: impl Fn(Frame) -> Frame) -> Vec<(Estimate, TargetTruth)> {
    let (first, truth) = frame(scene, 0);
    let mut tracker = recipe.init(&change(first), truth.extent.unwrap()).unwrap();
    (1..scene.frame_count())
        .map(|k| {
            let (frame, truth) = frame(scene, k);
            (tracker.update(&change(frame)).unwrap(), truth)
        })
        .collect()
}

#[test]
fn a_hidden_target_is_back_at_once() {
    for (seed, keys) in [(3, "hidden=20"), (4, "hidden=15&occluder=similar"), (5, "hidden=25&nearer=400&pan=20")] {
        let scene = scene(&format!("seed={seed}&width=240&height=160&duration=3&{keys}"));
        let said = follow(&*recipe("depth-occlusion", ""), &*scene, |f| f);
        let hidden: Vec<_> = said.iter().filter(|(_, t)| t.visible_fraction < 0.1).collect();
        assert!(hidden.len() > 8, "{seed}: {} hidden frames", hidden.len());
        let told = hidden.iter().filter(|(e, _)| e.state != TrackState::Tracking).count();
        assert!(10 * told >= 9 * hidden.len(), "{seed}: {told} of {}", hidden.len());
        let last = said.iter().rposition(|(_, t)| t.visible_fraction < 0.1).unwrap();
        let back = last + said[last..].iter().position(|(_, t)| t.visible_fraction >= 0.8).unwrap();
        let relocked = said[back..]
            .iter()
            .position(|(e, t)| e.state == TrackState::Tracking && e.bbox.iou(&t.extent.unwrap()) > 0.5);
        assert!(relocked.is_some_and(|frames| frames <= 5), "{seed}: {relocked:?}");
        let (end, truth) = said.last().unwrap();
        assert!(end.state == TrackState::Tracking && end.bbox.iou(&truth.extent.unwrap()) > 0.6, "{seed}: {end:?}");
    }
}

#[test]
fn the_size_follows_the_distance() {
    let scene = scene("seed=7&width=240&height=160&duration=3&cover=0&approach=300&size=30");
    let said = follow(&*recipe("depth-occlusion", ""), &*scene, |f| f);
    let (end, truth) = said.last().unwrap();
    let grown = truth.extent.unwrap().width() / 30.0;
    assert!(grown > 1.5, "{grown}");
    assert!((end.bbox.width() / truth.extent.unwrap().width() - 1.0).abs() < 0.08, "{end:?} {truth:?}");
    let fixed = follow(&*recipe("depth-occlusion", "scale_from_depth = false"), &*scene, |f| f);
    assert!((fixed.last().unwrap().0.bbox.width() - 30.0).abs() < 1.0);
}

#[test]
fn the_light_does_not_matter() {
    for seed in [8, 31, 10_077, 20_001] {
        let run = |light: &str| {
            let scene = scene(&format!("seed={seed}&width=240&height=160&duration=2&hidden=12&light={light}"));
            follow(&*recipe("depth-occlusion", ""), &*scene, |f| f)
        };
        let steady = run("steady");
        for light in ["dark", "flicker", "black"] {
            for ((a, _), (b, _)) in steady.iter().zip(run(light)) {
                assert!(a.bbox.center().distance(b.bbox.center()) < 1.0, "{seed} {light}: {a:?} {b:?}");
                assert!((a.bbox.width() - b.bbox.width()).abs() < 1.0, "{seed} {light}: {a:?} {b:?}");
                assert_eq!(a.state, b.state, "{seed} {light}");
            }
        }
    }
}

#[test]
fn the_picture_stands_in_where_depth_is_missing() {
    let scene = scene("seed=9&width=240&height=160&duration=3&cover=0");
    // From frame 20 to 50 there is none, or only zeros.
    let without = |f: Frame| match f.index() {
        20..35 => Frame::new(f.index(), f.time_s(), f.pixels().clone()),
        35..50 => {
            let size = f.size();
            let zeros = pursuit_imaging::Image::filled(size.width, size.height, 0_u16).unwrap();
            f.with_depth(zeros).unwrap()
        }
        _ => f,
    };
    // And a start without depth, which comes later.
    let late = |f: Frame| if f.index() < 10 { Frame::new(f.index(), f.time_s(), f.pixels().clone()) } else { f };
    for (name, said) in [
        ("gap", follow(&*recipe("depth-occlusion", ""), &*scene, without)),
        ("late", follow(&*recipe("depth-occlusion", ""), &*scene, late)),
    ] {
        for (k, (estimate, truth)) in said.iter().enumerate() {
            assert!(estimate.bbox.iou(&truth.extent.unwrap()) > 0.5, "{name} {k}: {estimate:?} {truth:?}");
        }
        let seen = said.iter().filter(|(e, _)| e.state == TrackState::Tracking).count();
        assert!(10 * seen >= 9 * said.len(), "{name}: {seen} of {}", said.len());
    }
    // Depth that comes later is used: the tracker says how far away its target is.
    let said = follow(&*recipe("depth-occlusion", ""), &*scene, late);
    let metres = |k: usize| said[k].0.diagnostics.get("depth_m");
    assert_eq!(metres(5), None);
    assert!((metres(60).unwrap() - 2.2).abs() < 0.3, "{:?}", metres(60));
}

#[test]
fn an_occluded_target_is_not_learned() {
    let scene = scene("seed=3&width=240&height=160&duration=3&hidden=20");
    let (first, truth) = frame(&*scene, 0);
    let mut tracker: Box<dyn Tracker> = recipe("depth-occlusion", "").init(&first, truth.extent.unwrap()).unwrap();
    let likeness =
        |tracker: &mut dyn Tracker, f: &Frame| tracker.peek(f).unwrap().and_then(|m| m.diagnostics.get("response"));
    let mut before = None;
    for k in 1..scene.frame_count() {
        let (frame, truth) = frame(&*scene, k);
        let estimate = tracker.update(&frame).unwrap();
        if truth.visible_fraction >= 0.99 && estimate.state == TrackState::Tracking {
            before = likeness(&mut *tracker, &frame).or(before);
        }
        if truth.visible_fraction < 0.1 {
            break;
        }
    }
    // After the occlusion it answers as before.
    let mut after = None;
    for k in 1..scene.frame_count() {
        let (frame, truth) = frame(&*scene, k);
        if k < 50 {
            continue;
        }
        let estimate = tracker.update(&frame).unwrap();
        if truth.visible_fraction >= 0.99 && estimate.state == TrackState::Tracking {
            after = estimate.diagnostics.get("response");
            break;
        }
    }
    let (before, after) = (before.unwrap(), after.unwrap());
    assert!(after > 0.6 * before, "{before} {after}");
}

#[test]
fn a_target_behind_something_nearer_is_covered() {
    let scene = scene("seed=3&width=240&height=160&duration=3&hidden=20");
    let (first, truth) = frame(&*scene, 0);
    let mut tracker: Box<dyn Tracker> = recipe("depth-occlusion", "").init(&first, truth.extent.unwrap()).unwrap();
    let (mut hidden, mut covered) = (0, 0);
    for k in 1..scene.frame_count() {
        let (frame, truth) = frame(&*scene, k);
        let estimate = tracker.update(&frame).unwrap();
        if estimate.state == TrackState::Tracking {
            assert_eq!(estimate.doubt, None, "frame {k}");
        } else if truth.visible_fraction < 0.1 {
            hidden += 1;
            covered += usize::from(estimate.doubt == Some(Doubt::Covered));
        }
    }
    assert!(hidden > 5 && 2 * covered > hidden, "{covered} of {hidden}");
}

#[test]
fn a_warm_tracker_allocates_nothing() {
    let scene = scene("seed=3&width=240&height=160&duration=2.5&hidden=15");
    let frames: Vec<(Frame, TargetTruth)> = (0..scene.frame_count()).map(|k| frame(&*scene, k)).collect();
    // Grey is made once a frame, by whoever asks first.
    frames.iter().for_each(|(f, _)| assert!(f.gray().size().area() > 0));
    let mut tracker = recipe("depth-occlusion", "").init(&frames[0].0, frames[0].1.extent.unwrap()).unwrap();
    frames[1..20].iter().for_each(|(f, _)| assert!(tracker.update(f).is_ok()));
    // The first occluded frame makes room for its places.
    let used = allocation_counter::measure(|| {
        frames[20..].iter().for_each(|(f, _)| assert!(tracker.update(f).is_ok()));
    });
    assert!(used.count_total <= 8, "{used:?}");
}

/// A frame with a bumpy square of 40 px about `(x, 80)`, 1.5 m away before a wavy wall.
fn jostled(k: u64, x: f64) -> (Frame, BBox) {
    let bbox = BBox::from_center_size(Point::new(x, 80.0), 40.0, 40.0);
    let depth = Image::from_fn(320, 160, |i, j| {
        let (u, v) = (i as f64 + 0.5 - bbox.left(), j as f64 + 0.5 - bbox.top());
        let mm = if (0.0..40.0).contains(&u) && (0.0..40.0).contains(&v) {
            1500.0 + 25.0 * (u / 5.0).sin() * (v / 7.0).cos() + u + 0.5 * v
        } else {
            2500.0 + 40.0 * (i as f64 / 11.0).sin() + 30.0 * (j as f64 / 9.0).cos()
        };
        mm as u16
    });
    let grey = Image::filled(320, 160, 128_u8).unwrap();
    let frame = Frame::new(k, k as f64 / 30.0, Pixels::Gray8(grey.into()));
    (frame.with_depth(depth.unwrap()).unwrap(), bbox)
}

/// By how much the box overlaps a target that went to the right and leapt back by `leap` pixels, a frame after that.
fn after_a_leap(settings: &str, leap: f64) -> f64 {
    let mut x = 60.0;
    let (first, bbox) = jostled(0, x);
    let mut tracker = recipe("depth-occlusion", settings).init(&first, bbox).unwrap();
    for k in 1..=12 {
        x += 12.0;
        assert!(tracker.update(&jostled(k, x).0).unwrap().bbox.iou(&jostled(k, x).1) > 0.7, "{k}");
    }
    x -= leap;
    tracker.update(&jostled(13, x).0).unwrap();
    let (frame, bbox) = jostled(14, x);
    tracker.update(&frame).unwrap().bbox.iou(&bbox)
}

#[test]
fn a_leap_back_is_sought_where_it_was() {
    for leap in [20.0, 35.0, 40.0] {
        let overlap = after_a_leap("", leap);
        assert!(overlap > 0.9, "{leap} px: {overlap}");
    }
    // Near the prediction alone it is out of sight.
    assert_eq!(after_a_leap("look_back = false", 35.0), 0.0);
}
