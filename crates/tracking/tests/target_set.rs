//! Independent targets: ids, coming and going, and that company changes nothing.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{at, frame, recipe, recipe_of};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::many::{Clock, Reading};
use pursuit_tracking::{Estimate, MultiTracker, TargetId, TargetSet, Track, TrackState, TrackingError};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

const FRAMES: u64 = 10;

/// Five targets in rows of their own, each at its own speed.
fn truth(k: u64) -> Vec<(BBox, u8)> {
    (0..5).map(|i| (at(40.0 + (2.0 + i as f64) * k as f64, 20.0 + 40.0 * i as f64), 50 + 20 * i as u8)).collect()
}

fn frames() -> Vec<Frame> {
    (0..FRAMES).map(|k| frame(k, &truth(k))).collect()
}

fn look(set: &mut TargetSet, frame: &Frame) -> Vec<(u64, Estimate)> {
    let mut tracks = vec![Track {
        id: TargetId(99),
        estimate: None,
        started: true,
        elapsed: Default::default(),
        class: None,
        detection: None,
    }];
    set.step(frame, &mut tracks).unwrap();
    assert!(tracks.iter().all(|t| !t.started));
    tracks.into_iter().map(|t| (t.id.0, t.estimate.unwrap())).collect()
}

#[test]
fn company_and_threads_change_nothing() {
    let (frames, recipe) = (frames(), recipe());
    let alone: Vec<Vec<Estimate>> = truth(0)
        .iter()
        .map(|(bbox, _)| {
            let mut tracker = recipe.init(&frames[0], *bbox).unwrap();
            frames[1..].iter().map(|f| tracker.update(f).unwrap()).collect()
        })
        .collect();
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let together = pool.install(|| {
            let mut set = TargetSet::new();
            for (bbox, _) in truth(0) {
                set.add(&*recipe, &frames[0], bbox).unwrap();
            }
            frames[1..].iter().map(|f| look(&mut set, f)).collect::<Vec<_>>()
        });
        for (k, estimates) in together.iter().enumerate() {
            assert_eq!(estimates.len(), 5);
            for (i, (id, estimate)) in estimates.iter().enumerate() {
                assert_eq!((*id, estimate), (i as u64 + 1, &alone[i][k]), "frame {}", k + 1);
                assert!(estimate.bbox.iou(&truth(k as u64 + 1)[i].0) > 0.8, "target {id}, frame {}", k + 1);
            }
        }
    }
}

#[test]
fn ids_are_never_used_again() {
    let (frames, recipe) = (frames(), recipe());
    let mut set = TargetSet::new();
    assert!(look(&mut set, &frames[0]).is_empty() && set.is_empty());
    for i in 0..3 {
        assert_eq!(set.add(&*recipe, &frames[0], truth(0)[i].0).unwrap(), TargetId(i as u64 + 1));
    }
    look(&mut set, &frames[1]);
    let mut second = set.take(TargetId(2)).unwrap();
    assert!(matches!(set.remove(TargetId(2)), Err(TrackingError::UnknownTarget { id: 2 })));
    assert!(matches!(set.take(TargetId(7)), Err(TrackingError::UnknownTarget { id: 7 })));
    assert_eq!((set.ids(), set.len()), (vec![TargetId(1), TargetId(3)], 2));
    assert!(set.contains(TargetId(3)) && !set.contains(TargetId(2)) && !set.is_empty());
    // A tracker that has left goes on by itself.
    assert!(second.update(&frames[2]).unwrap().bbox.iou(&truth(2)[1].0) > 0.8);
    look(&mut set, &frames[2]);

    assert_eq!(set.add(&*recipe, &frames[2], truth(2)[4].0).unwrap(), TargetId(4));
    let outside = BBox::from_ltwh(9000.0, 0.0, 5.0, 5.0);
    assert!(matches!(set.add(&*recipe, &frames[2], outside), Err(TrackingError::StartBox { .. })));
    assert_eq!(set.insert(second), TargetId(5), "the refused box took no id, and 2 is not used again");
    let said = look(&mut set, &frames[3]);
    for ((id, estimate), (expected, target)) in said.iter().zip([(1, 0), (3, 2), (4, 4), (5, 1)]) {
        assert_eq!(*id, expected);
        assert!(estimate.bbox.iou(&truth(3)[target].0) > 0.8, "target {id}");
    }
    set.remove(TargetId(1)).unwrap();
    assert_eq!(set.ids(), [3, 4, 5].map(TargetId));
}

#[test]
fn a_target_is_put_elsewhere_and_changed_in_place() {
    let (frames, recipe) = (frames(), recipe());
    let mut set = TargetSet::new();
    let (a, b) =
        (set.add(&*recipe, &frames[0], truth(0)[0].0).unwrap(), set.add(&*recipe, &frames[0], truth(0)[1].0).unwrap());
    set.reinit(a, &frames[0], truth(0)[3].0).unwrap();
    assert!(matches!(set.reinit(TargetId(9), &frames[0], truth(0)[3].0), Err(TrackingError::UnknownTarget { id: 9 })));
    let said = look(&mut set, &frames[1]);
    assert!(said[0].1.bbox.iou(&truth(1)[3].0) > 0.8 && said[1].1.bbox.iou(&truth(1)[1].0) > 0.8);

    // One frame out of sight is enough to be lost, for the target that this is changed for.
    set.change(Some(b), &"policy.lost_after_s = 0".parse().unwrap()).unwrap();
    let unknown = set.change(None, &"policy.nonsense = 0".parse().unwrap());
    assert!(matches!(unknown, Err(TrackingError::Parameter(_))), "{unknown:?}");
    assert!(matches!(set.change(Some(TargetId(9)), &toml()), Err(TrackingError::UnknownTarget { id: 9 })));
    let states = |said: Vec<(u64, Estimate)>| said.iter().map(|(_, e)| e.state).collect::<Vec<_>>();
    assert_eq!(states(look(&mut set, &common::empty(2))), [TrackState::Occluded, TrackState::Lost]);
    set.change(None, &"policy.lost_after_s = 0".parse().unwrap()).unwrap();
    assert_eq!(states(look(&mut set, &common::empty(3))), [TrackState::Lost, TrackState::Lost]);

    assert!(set.get_mut(TargetId(9)).is_none());
    set.get_mut(b).unwrap().reinit(&frames[4], truth(4)[2].0).unwrap();
    assert!(look(&mut set, &frames[5])[1].1.bbox.iou(&truth(5)[2].0) > 0.8);
}

fn toml() -> toml::Table {
    toml::Table::new()
}

#[test]
fn forecasts_are_the_trackers_own() {
    let (frames, recipe) = (frames(), recipe());
    let mut set = TargetSet::new();
    let id = set.add(&*recipe, &frames[0], truth(0)[2].0).unwrap();
    frames[1..].iter().for_each(|f| drop(look(&mut set, f)));
    let forecast = set.forecast(id, 0.4).unwrap();
    // Ten frames on at 4 px a frame.
    let want = truth(FRAMES - 1)[2].0.center().x + 40.0;
    assert!((forecast.bbox.center().x - want).abs() < 2.0, "{forecast:?}");
    assert!(matches!(set.forecast(TargetId(2), 0.1), Err(TrackingError::UnknownTarget { id: 2 })));
}

#[test]
fn an_error_of_one_tracker_is_reported() {
    let frames = frames();
    let mut set = TargetSet::new();
    set.add(&*recipe(), &frames[0], truth(0)[0].0).unwrap();
    let small = pursuit_imaging::Image::filled(10, 10, 0u8).unwrap();
    let other = Frame::new(1, 0.1, pursuit_imaging::Pixels::Gray8(small.into()));
    assert!(matches!(set.step(&other, &mut Vec::new()), Err(TrackingError::FrameSize { index: 1, .. })));
}

#[test]
fn a_saved_set_goes_on_as_the_one_it_was_saved_from() {
    let (frames, recipe) = (frames(), recipe());
    let mut set = TargetSet::new();
    for (bbox, _) in truth(0) {
        set.add(&*recipe, &frames[0], bbox).unwrap();
    }
    set.remove(TargetId(5)).unwrap();
    set.remove(TargetId(2)).unwrap();
    look(&mut set, &frames[1]);
    let saved = set.save().unwrap();
    let mut restored = TargetSet::restore(&saved, &recipe_of).unwrap();
    for frame in &frames[2..] {
        assert_eq!(look(&mut set, frame), look(&mut restored, frame));
    }
    assert_eq!(restored.ids(), [1, 3, 4].map(TargetId));
    assert_eq!(restored.add(&*recipe, &frames[9], truth(9)[0].0).unwrap(), TargetId(6), "5 had been handed out");

    assert!(TargetSet::restore(&saved[..saved.len() - 1], &recipe_of).is_err());
    assert!(TargetSet::restore(b"nonsense", &recipe_of).is_err());
    let unknown = TargetSet::restore(&saved, &|name| {
        Err(TrackingError::UnknownName { kind: "tracker", name: name.to_owned(), available: String::new() })
    });
    assert!(matches!(unknown.err(), Some(TrackingError::UnknownName { name, .. }) if name == "shade"));
}

/// Goes on by 5 ms on the wall and 3 on the processor whenever it is read.
#[derive(Default)]
struct Counting(AtomicU64);

impl Clock for Counting {
    fn now(&self) -> Reading {
        let n = self.0.fetch_add(1, Ordering::Relaxed);
        Reading { wall: Duration::from_millis(5 * n), thread: Duration::from_millis(3 * n) }
    }
}

#[test]
fn every_update_is_timed_by_the_clock_given() {
    let frames = frames();
    let mut set = TargetSet::timed_by(Arc::new(Counting::default()));
    set.add(&*recipe(), &frames[0], truth(0)[0].0).unwrap();
    let mut tracks = Vec::new();
    set.step(&frames[1], &mut tracks).unwrap();
    assert_eq!((tracks[0].elapsed.wall_ms, tracks[0].elapsed.thread_ms), (5.0, 3.0));
}
