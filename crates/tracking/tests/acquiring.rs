//! One target that a detector finds: evidence, rivals, wrong starts, and what a user may do meanwhile.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{at, frame, recipe, recipe_of, scripted, seen};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::many::{Acquiring, AcquisitionParams};
use pursuit_tracking::{Detection, Detector, MultiTracker, TargetId, Track, TrackState, TrackingError};

fn params() -> AcquisitionParams {
    AcquisitionParams::default()
}

fn acquiring(script: impl Fn(u64) -> Vec<Detection> + Send + Sync + 'static) -> Acquiring {
    Acquiring::new(scripted(script), recipe(), params()).unwrap()
}

/// The ball goes right at 4 px a frame.
fn ball(k: u64) -> BBox {
    at(60.0 + 4.0 * k as f64, 60.0)
}

/// Clutter that stands still.
fn clutter() -> BBox {
    at(200.0, 160.0)
}

fn film(k: u64) -> Frame {
    frame(k, &[(clutter(), 90), (ball(k), 200)])
}

fn step(target: &mut impl MultiTracker, frame: &Frame) -> Vec<Track> {
    let mut tracks = Vec::new();
    target.step(frame, &mut tracks).unwrap();
    tracks
}

fn bbox(tracks: &[Track]) -> BBox {
    assert_eq!((tracks.len(), tracks[0].id), (1, TargetId(1)));
    tracks[0].estimate.as_ref().unwrap().bbox
}

#[test]
fn what_is_seen_first_is_followed_at_once_and_the_detector_is_left_in_peace_when_it_is_sure() {
    let detector = scripted(|k| if k < 2 { vec![] } else { vec![seen(ball(k))] });
    let told = detector.told.clone();
    let mut target = Acquiring::new(detector, recipe(), params()).unwrap();
    for k in 0..2 {
        let tracks = step(&mut target, &film(k));
        assert_eq!((tracks[0].id, &tracks[0].estimate, tracks[0].started), (TargetId(1), &None, false));
    }
    let tracks = step(&mut target, &film(2));
    let first = tracks[0].estimate.as_ref().unwrap();
    assert!(tracks[0].started);
    assert_eq!((first.bbox, first.score, first.state, first.prediction), (ball(2), 0.8, TrackState::Tracking, None));
    // From here on as a tracker alone does it.
    let mut alone = recipe().init(&film(2), ball(2)).unwrap();
    for k in 3..40 {
        let tracks = step(&mut target, &film(k));
        assert_eq!(tracks[0].estimate.as_ref().unwrap(), &alone.update(&film(k)).unwrap(), "frame {k}");
        assert!(!tracks[0].started);
    }
    assert!(target.is_confirmed());
    let asked = told.lock().unwrap().len();
    assert!((8..16).contains(&asked), "{asked}: a moving target is confirmed within a few looks");
}

#[test]
fn a_start_that_proves_wrong_gives_way_to_the_one_that_moves() {
    // The clutter is seen in the first frame and now and then, the ball from the third frame on.
    let script = |k: u64| {
        let mut found = Vec::new();
        if k.is_multiple_of(3) {
            found.push(seen(clutter()));
        }
        if k >= 2 {
            found.push(seen(ball(k)));
        }
        found
    };
    let mut target = acquiring(script);
    assert_eq!(bbox(&step(&mut target, &film(0))), clutter());
    let mut changed = None;
    for k in 1..20 {
        let on_ball = bbox(&step(&mut target, &film(k))).iou(&ball(k)) > 0.7;
        if on_ball && changed.is_none() {
            changed = Some(k);
            assert!(!target.is_confirmed(), "it leads before it is sure");
        }
        assert!(on_ball == changed.is_some(), "frame {k}: it does not turn back");
    }
    assert!(changed.is_some_and(|k| k <= 12), "{changed:?}");
    assert!(target.is_confirmed());
}

#[test]
fn a_start_that_is_lost_is_dropped_and_the_search_begins_anew() {
    let detector = scripted(|k| match k {
        0 => vec![seen(at(150.0, 100.0))],
        40.. => vec![seen(ball(k - 40))],
        _ => vec![],
    });
    // What was seen first is black: its tracker never finds it.
    let long_trial = AcquisitionParams { trial_s: 10.0, ..params() };
    let mut target = Acquiring::new(detector, recipe(), long_trial).unwrap();
    let picture = |k: u64| if k < 40 { common::empty(k) } else { frame(k, &[(ball(k - 40), 200)]) };
    let said: Vec<Vec<Track>> = (0..60).map(|k| step(&mut target, &picture(k))).collect();
    let state = |k: usize| said[k][0].estimate.as_ref().map(|e| e.state);
    assert_eq!(state(10), Some(TrackState::Occluded));
    assert_eq!(state(35), None, "lost after a second, and forgotten");
    assert_eq!(said[40][0].estimate.as_ref().unwrap().bbox, ball(0));
    assert!(said[59][0].estimate.as_ref().unwrap().bbox.iou(&ball(19)) > 0.7);
}

#[test]
fn a_still_target_without_rivals_is_taken_after_its_trial() {
    let mut target = acquiring(|_| vec![seen(clutter())]);
    let confirmed: Vec<bool> = (0..40)
        .map(|k| {
            assert_eq!(bbox(&step(&mut target, &film(k))), clutter());
            target.is_confirmed()
        })
        .collect();
    // A second is 25 frames.
    assert_eq!(confirmed.iter().position(|c| *c), Some(25));
    // Nobody is taken who is not seen again.
    let mut target = acquiring(|k| if k == 0 { vec![seen(clutter())] } else { vec![] });
    (0..60).for_each(|k| drop(step(&mut target, &film(k))));
    assert!(!target.is_confirmed());
    assert_eq!(target.hypotheses().count(), 1, "yet it is kept while there is nothing better");
}

#[test]
fn there_are_no_more_hypotheses_than_allowed_and_none_twice() {
    let many = |_| (0..6).map(|i| seen(at(30.0 + 40.0 * i as f64, 160.0))).chain([seen(at(32.0, 160.0))]).collect();
    let picture =
        |k| frame(k, &(0..6).map(|i| (at(30.0 + 40.0 * i as f64, 160.0), 50 + 10 * i as u8)).collect::<Vec<_>>());
    let mut target =
        Acquiring::new(scripted(many), recipe(), AcquisitionParams { most_hypotheses: 3, ..params() }).unwrap();
    step(&mut target, &picture(0));
    let boxes: Vec<BBox> = target.hypotheses().map(|(b, _)| b).collect();
    assert_eq!(boxes, [at(30.0, 160.0), at(70.0, 160.0), at(110.0, 160.0)]);
    let picky = AcquisitionParams { start_from: 0.9, ..params() };
    let mut target = Acquiring::new(scripted(many), recipe(), picky).unwrap();
    assert!(step(&mut target, &picture(0))[0].estimate.is_none());
}

#[test]
fn a_detection_speaks_for_the_hypothesis_it_overlaps_most() {
    // Two balls side by side, both seen; then only the right one, shifted towards the left one.
    let (a, b) = (at(100.0, 60.0), at(118.0, 60.0));
    let script = move |k: u64| if k == 0 { vec![seen(a), seen(b)] } else { vec![seen(at(114.0, 60.0))] };
    let picture = |k| frame(k, &[(a, 100), (b, 200)]);
    let mut target = acquiring(script);
    step(&mut target, &picture(0));
    let before: Vec<f64> = target.hypotheses().map(|(_, nats)| nats).collect();
    step(&mut target, &picture(1));
    let after: Vec<f64> = target.hypotheses().map(|(_, nats)| nats).collect();
    assert!(before[0] == before[1] && after[0] < before[0] - 0.5, "{before:?} {after:?}");
    // A detection of 0.8 at a place where it stands still says next to nothing.
    assert!((after[1] - before[1]).abs() < 0.05, "{before:?} {after:?}");
}

#[test]
fn a_hypothesis_takes_the_detection_it_overlaps_most_and_leaves_the_others() {
    let (a, b) = (at(100.0, 60.0), at(118.0, 60.0));
    // The first detection lies between both and is the second one's; the first one has a better one of its own.
    let script = move |k: u64| if k == 0 { vec![seen(a), seen(b)] } else { vec![seen(at(108.5, 60.0)), seen(a)] };
    let picture = |k| frame(k, &[(a, 100), (b, 200)]);
    let mut target = acquiring(script);
    step(&mut target, &picture(0));
    let before: Vec<f64> = target.hypotheses().map(|(_, nats)| nats).collect();
    step(&mut target, &picture(1));
    let after: Vec<f64> = target.hypotheses().map(|(_, nats)| nats).collect();
    assert!(after.len() == 2 && after.iter().zip(&before).all(|(a, b)| *a > b - 0.3), "{before:?} {after:?}");
}

#[test]
fn the_strongest_rival_leads() {
    // One is never seen again and leads by having come first, one is seen now and then, one always, one stands unseen.
    let still = [at(40.0, 200.0), at(280.0, 200.0)];
    let moving = |k: u64, y: f64| at(60.0 + 4.0 * k as f64, y);
    let script = move |k: u64| match k {
        0 => vec![seen(still[0]), seen(moving(0, 60.0)), seen(moving(0, 120.0)), seen(still[1])],
        _ if k.is_multiple_of(2) => vec![seen(moving(k, 60.0)), seen(moving(k, 120.0))],
        _ => vec![seen(moving(k, 120.0))],
    };
    let picture = |k| frame(k, &[(still[0], 90), (moving(k, 60.0), 150), (moving(k, 120.0), 220), (still[1], 120)]);
    let mut target = acquiring(script);
    let leader = |target: &Acquiring| target.hypotheses().next().map(|h| h.0);
    step(&mut target, &picture(0));
    assert_eq!((leader(&target), target.hypotheses().count()), (Some(still[0]), 4));
    let changed = (1..20).find(|k| {
        step(&mut target, &picture(*k));
        target.hypotheses().count() == 0 || leader(&target).is_some_and(|b| b.iou(&still[0]) < 0.1)
    });
    let k = changed.unwrap();
    // Confirmed by then, or leading still among the others.
    let best = leader(&target).unwrap();
    assert!(best.iou(&moving(k, 120.0)) > 0.3, "frame {k}: {best}");
}

#[test]
fn a_target_is_written_as_its_number() {
    assert_eq!((TargetId(17).to_string(), format!("{:>4}", TargetId(7))), ("17".to_owned(), "   7".to_owned()));
}

/// The ball is there until frame 20, and again from frame `back` on.
fn absent_until(back: u64) -> impl Fn(u64) -> Frame {
    move |k| {
        let mut shown = vec![(clutter(), 90)];
        if k < 20 {
            shown.push((ball(k), 200));
        } else if k >= back {
            shown.push((at(40.0 + 4.0 * (k - back) as f64, 20.0), 210));
        }
        frame(k, &shown)
    }
}

#[test]
fn a_target_lost_for_long_is_detected_again_once_that_is_sure() {
    let picture = absent_until(90);
    let script = |k: u64| match k {
        0..20 => vec![seen(ball(k))],
        // Clutter that stands still is no reason to leave the target's last place.
        20..90 => vec![seen(clutter())],
        _ => vec![seen(at(40.0 + 4.0 * (k - 90) as f64, 20.0)), seen(clutter())],
    };
    let mut target = acquiring(script);
    let said: Vec<Vec<Track>> = (0..110).map(|k| step(&mut target, &picture(k))).collect();
    let last = |k: usize| said[k][0].estimate.clone().unwrap();
    assert_eq!(last(60).state, TrackState::Lost);
    assert_eq!(last(89).state, TrackState::Lost, "clutter is never confirmed");
    let found = (90..110).find(|k| last(*k).state == TrackState::Tracking).unwrap();
    assert!((93..104).contains(&found), "confirmed by several looks: {found}");
    assert!(last(109).bbox.iou(&at(40.0 + 4.0 * 19.0, 20.0)) > 0.7);
    assert!(said.iter().all(|t| t.len() == 1 && t[0].id == TargetId(1)));

    let never = AcquisitionParams { seek_again_after_s: 1e9, ..params() };
    let mut target = Acquiring::new(scripted(script), recipe(), never).unwrap();
    let last = (0..110).map(|k| step(&mut target, &picture(k))).last().unwrap();
    assert_eq!(last[0].estimate.as_ref().unwrap().state, TrackState::Lost, "{last:?}");
}

#[test]
fn what_is_sought_again_is_of_the_same_class() {
    let named = |bbox: BBox, word: &str| Detection { class: Some(word.into()), ..seen(bbox) };
    let returning = |word: &'static str| {
        move |k: u64| match k {
            0..20 => vec![named(ball(k), "sports ball")],
            20..90 => vec![],
            _ => vec![named(at(40.0 + 4.0 * (k - 90) as f64, 20.0), word)],
        }
    };
    let picture = absent_until(90);
    for (word, found) in [("sports ball", true), ("bird", false)] {
        let mut target = acquiring(returning(word));
        let said: Vec<Vec<Track>> = (0..110).map(|k| step(&mut target, &picture(k))).collect();
        assert_eq!(said[109][0].estimate.as_ref().unwrap().state == TrackState::Tracking, found, "{word}");
        let named = |t: &[Track]| t[0].class.as_ref().is_some_and(|c| c.as_str() == "sports ball");
        assert!(said.iter().all(|t| named(t)), "from the first frame to the last");
    }
    // A user who points at something else says nothing of its class; the next that the detector sees tells it.
    let mut target = acquiring(returning("bird"));
    (0..30).for_each(|k| drop(step(&mut target, &picture(k))));
    target.reinit(TargetId(1), &picture(29), clutter()).unwrap();
    assert_eq!(step(&mut target, &picture(30))[0].class, None);
}

#[test]
fn hypotheses_of_a_return_are_dropped_when_the_tracker_finds_its_target_itself() {
    let script = |k: u64| if k < 20 { vec![seen(ball(k))] } else { vec![seen(clutter())] };
    let mut target = acquiring(script);
    let gone = |k: u64| if (20..90).contains(&k) { frame(k, &[(clutter(), 90)]) } else { film(k) };
    for k in 0..80 {
        step(&mut target, &gone(k));
    }
    assert_eq!(target.hypotheses().count(), 1);
    // It comes back where its tracker looks.
    let back = |k: u64| frame(k, &[(clutter(), 90), (ball(19), 200)]);
    let state = |t: &[Track]| t[0].estimate.as_ref().unwrap().state;
    let states: Vec<TrackState> = (80..100).map(|k| state(&step(&mut target, &back(k)))).collect();
    assert!(states.contains(&TrackState::Tracking), "{states:?}");
    assert_eq!(target.hypotheses().count(), 0);
}

#[test]
fn users_add_move_and_remove_targets() {
    let mut target = acquiring(|k| if k < 2 { vec![] } else { vec![seen(ball(k))] });
    step(&mut target, &film(0));
    assert_eq!(target.ids(), [TargetId(1)]);
    assert_eq!(target.add(&*recipe(), &film(0), clutter()).unwrap(), TargetId(2));
    let tracks = step(&mut target, &film(1));
    assert_eq!(tracks.iter().map(|t| (t.id.0, t.estimate.is_some())).collect::<Vec<_>>(), [(1, false), (2, true)]);
    let tracks = step(&mut target, &film(2));
    assert_eq!(tracks.iter().map(|t| (t.id.0, t.started)).collect::<Vec<_>>(), [(1, true), (2, false)]);
    assert!(target.forecast(TargetId(1), 0.1).is_ok() && target.forecast(TargetId(3), 0.1).is_err());

    // Put elsewhere by the user, it is confirmed.
    target.reinit(TargetId(1), &film(2), clutter()).unwrap();
    assert!(target.is_confirmed());
    assert_eq!(bbox(&step(&mut target, &film(3))[..1]), clutter());
    target.reinit(TargetId(1), &film(3), ball(3)).unwrap();
    assert!(bbox(&step(&mut target, &film(4))[..1]).iou(&ball(4)) > 0.7);
    target.remove(TargetId(1)).unwrap();
    assert_eq!(target.ids(), [TargetId(2)]);
    assert_eq!(step(&mut target, &film(5)).iter().map(|t| t.id.0).collect::<Vec<_>>(), [2]);
    target.remove(TargetId(2)).unwrap();
    assert!(matches!(target.remove(TargetId(1)), Err(TrackingError::UnknownTarget { id: 1 })));

    // Removed before it is found, it is not sought any more.
    let mut target = acquiring(|k| vec![seen(ball(k))]);
    target.remove(TargetId(1)).unwrap();
    assert!(step(&mut target, &film(0)).is_empty() && target.ids().is_empty() && !target.is_confirmed());
}

#[test]
fn changes_reach_trackers_started_later_too() {
    let mut target = acquiring(|k| if k < 2 { vec![] } else { vec![seen(ball(k))] });
    step(&mut target, &film(0));
    assert!(target.change(None, &"policy.nonsense = 1".parse().unwrap()).is_err());
    target.change(None, &"policy.lost_after_s = 0".parse().unwrap()).unwrap();
    (2..6).for_each(|k| drop(step(&mut target, &film(k))));
    // Out of sight it is lost at once, which drops a hypothesis.
    assert!(step(&mut target, &common::empty(6))[0].estimate.is_none());

    let mut target = acquiring(|k| vec![seen(ball(k))]);
    (0..3).for_each(|k| drop(step(&mut target, &film(k))));
    target.change(Some(TargetId(1)), &"policy.lost_after_s = 0".parse().unwrap()).unwrap();
    assert!(matches!(target.change(Some(TargetId(5)), &toml()), Err(TrackingError::UnknownTarget { id: 5 })));
    let blind = step(&mut target, &common::empty(3));
    assert!(blind[0].estimate.as_ref().is_none_or(|e| e.bbox != ball(2)), "{blind:?}");

    // One that is confirmed.
    let mut target = acquiring(|k| vec![seen(ball(k))]);
    (0..30).for_each(|k| drop(step(&mut target, &film(k))));
    assert!(target.is_confirmed());
    target.change(Some(TargetId(1)), &"policy.lost_after_s = 0".parse().unwrap()).unwrap();
    assert_eq!(step(&mut target, &common::empty(30))[0].estimate.as_ref().unwrap().state, TrackState::Lost);
}

fn toml() -> toml::Table {
    toml::Table::new()
}

#[test]
fn threads_and_saving_change_nothing() {
    let script = |k: u64| match k {
        0..30 => vec![seen(clutter()), seen(ball(k)), seen(at(280.0, 20.0))],
        90.. => vec![seen(at(40.0 + 4.0 * (k - 90) as f64, 20.0))],
        _ => vec![],
    };
    let picture = absent_until(90);
    let run = |threads: usize, save_at: &[u64]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut target = acquiring(script);
            let mut said = Vec::new();
            for k in 0..110 {
                if save_at.contains(&k) {
                    target = Acquiring::restore(&target.save().unwrap(), scripted(script), &recipe_of).unwrap();
                }
                said.extend(step(&mut target, &picture(k)).into_iter().map(|t| (k, t.id, t.started, t.estimate)));
            }
            said
        })
    };
    let plain = run(1, &[]);
    assert_eq!(plain, run(3, &[]));
    assert_eq!(plain, run(1, &[0, 3, 19, 60, 93]));
    let mut target = acquiring(script);
    (0..3).for_each(|k| drop(step(&mut target, &picture(k))));
    let saved = target.save().unwrap();
    assert!(Acquiring::restore(&saved[..saved.len() - 2], scripted(script), &recipe_of).is_err());
    assert!(Acquiring::restore(&[], scripted(script), &recipe_of).is_err());
}

#[test]
fn senseless_parameters_and_blind_detectors_are_errors() {
    let bad = AcquisitionParams { detected: 1.0, ..params() };
    assert!(matches!(Acquiring::new(scripted(|_| vec![]), recipe(), bad), Err(TrackingError::Parameter(_))));
    struct Blind;
    impl Detector for Blind {
        fn detect(
            &mut self,
            frame: &Frame,
            _: &[pursuit_tracking::Followed],
        ) -> pursuit_tracking::Result<Vec<Detection>> {
            Err(TrackingError::MissingPlane { tracker: "blind".into(), needed: "colour", index: frame.index() })
        }
    }
    let mut target = Acquiring::new(Box::new(Blind), recipe(), params()).unwrap();
    assert!(target.step(&film(0), &mut Vec::new()).is_err());
}

pursuit_tracking::figures! {
    /// What the detector says of a frame.
    struct LightFigures {
        /// How bright it is.
        light;
    }
}

/// Sees what a script says, and the scene in every frame.
struct Watcher {
    script: fn(u64) -> Vec<Detection>,
    asked: std::sync::Arc<std::sync::Mutex<Vec<(u64, usize)>>>,
}

/// The same, which finds everything 30 pixels beside where it is from frame 65 on, and may know that it measures badly then.
struct Astray {
    watcher: Watcher,
    knows: bool,
    index: u64,
}

impl Detector for Astray {
    fn detect(
        &mut self,
        frame: &Frame,
        followed: &[pursuit_tracking::Followed],
    ) -> pursuit_tracking::Result<Vec<Detection>> {
        self.index = frame.index();
        self.watcher.detect(frame, followed)
    }

    fn watches(&self) -> bool {
        true
    }

    fn measures(&self) -> bool {
        !(self.knows && self.index >= 65)
    }
}

#[test]
fn where_a_detector_measures_badly_the_tracker_goes_on() {
    fn place(k: u64) -> BBox {
        at(60.0 + 2.0 * k as f64, 60.0)
    }
    let off = |knows: bool| {
        let script = |k: u64| vec![seen(place(k).translated(0.0, if k < 65 { 0.0 } else { 30.0 }))];
        let watcher = Watcher { script, asked: std::sync::Arc::default() };
        let mut target = Acquiring::new(Box::new(Astray { watcher, knows, index: 0 }), recipe(), params()).unwrap();
        let mut most: f64 = 0.0;
        for k in 0..80 {
            let tracks = step(&mut target, &frame(k, &[(place(k), 200)]));
            let estimate = tracks[0].estimate.as_ref().filter(|_| k >= 65);
            most = estimate.map_or(most, |e| most.max(e.bbox.center().distance(place(k).center())));
        }
        most
    };
    assert!(off(true) < 6.0 && off(false) > 20.0, "{} {}", off(true), off(false));
}

impl Detector for Watcher {
    fn detect(
        &mut self,
        frame: &Frame,
        followed: &[pursuit_tracking::Followed],
    ) -> pursuit_tracking::Result<Vec<Detection>> {
        self.asked.lock().unwrap().push((frame.index(), followed.len()));
        Ok((self.script)(frame.index()))
    }

    fn watches(&self) -> bool {
        true
    }

    fn diagnostics(&self) -> pursuit_tracking::Diagnostics {
        LightFigures { light: 0.5 }.into()
    }
}

#[test]
fn a_detector_that_models_the_scene_measures_every_frame() {
    // From frame 30 on the detector sees more and more: the target had been started on a part.
    fn whole(k: u64) -> BBox {
        let (b, more) = (at(60.0 + 4.0 * k as f64, 60.0), 2.0 * k.saturating_sub(30) as f64);
        BBox::from_ltwh(b.left(), b.top() - more, b.width(), b.height() + 2.0 * more)
    }
    let script = |k: u64| vec![seen(BBox::from_ltwh(250.0, 10.0, 20.0, 20.0)), seen(whole(k))];
    let asked = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let watcher = Watcher { script, asked: asked.clone() };
    let mut target = Acquiring::new(Box::new(watcher), recipe(), params()).unwrap();
    let mut right = 0;
    for k in 0..40 {
        let tracks = step(&mut target, &film(k));
        assert_eq!(tracks.len(), 1, "one is said, frame {k}");
        if let Some(estimate) = &tracks[0].estimate {
            assert_eq!(estimate.diagnostics.get("light"), Some(0.5), "frame {k}");
            right += usize::from(k >= 30 && estimate.bbox.iou(&whole(k)) > 0.6);
        }
    }
    assert!(target.is_confirmed());
    let asked = asked.lock().unwrap();
    assert_eq!(asked.iter().map(|(k, _)| *k).collect::<Vec<_>>(), (0..40).collect::<Vec<_>>());
    // Both are followed, and one is said, whose box grows with its region.
    assert!(asked[25..=30].iter().all(|(_, followed)| *followed == 2), "{asked:?}");
    assert!(right >= 7, "{right}");
}

/// A detector that models the scene and loses sight of it when the head turns.
#[test]
fn what_is_followed_moves_with_the_picture_of_a_head_that_turns() {
    use pursuit_imaging::{CameraPose, Lens};
    let script = |k: u64| if k < 20 { vec![seen(at(160.0, 60.0))] } else { vec![] };
    let boxes = |camera: &str| {
        let watcher = Watcher { script, asked: std::sync::Arc::default() };
        let recipe = recipe().with(&format!("motion.camera = '{camera}'").parse().unwrap()).unwrap();
        let mut target = Acquiring::new(Box::new(watcher), recipe, params()).unwrap();
        let mut said = Vec::new();
        for k in 0..24 {
            let pan_rad = 0.02 * k.max(20) as f64 - 0.4;
            let pose = CameraPose::new(0.0, pan_rad, 0.0, Lens::field_of_view(1.0).unwrap()).unwrap();
            let tracks = step(&mut target, &film(k).with_camera(pose));
            said.extend(tracks[0].estimate.as_ref().map(|e| (e.prediction.unwrap_or(e.bbox).center().x, pose)));
        }
        said
    };
    let by_pose = boxes("pose");
    let (Some((before, _)), Some((now, pose))) = (by_pose.get(by_pose.len() - 5), by_pose.last()) else { panic!() };
    let size = film(0).size();
    let ahead = CameraPose::new(0.0, 0.0, 0.0, Lens::field_of_view(1.0).unwrap()).unwrap();
    let there = pose.point_of(ahead.direction_of(pursuit_geometry::Point::new(*before, 60.0), size), size).unwrap();
    assert!((now - there.x).abs() < 3.0 && before - now > 8.0, "{before} to {now}, {}", there.x);
    let still = boxes("none");
    assert!((still[still.len() - 5].0 - still[still.len() - 1].0).abs() < 3.0);
}
