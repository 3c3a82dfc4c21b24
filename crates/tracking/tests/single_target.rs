//! The one loop, with a localizer that says what it is told.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod scripted;

use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_tracking::{Look, TrackState, Tracker, TrackingError, Weighed};
use scripted::{
    Asked, HEIGHT, WIDTH, asked, at, concluded, frame, frame_at, passed, prefer, recipe, show, start, table,
};

/// Moves a target right by `step` px a frame in frames `1..=n`, seen for sure.
fn seen(tracker: &mut dyn Tracker, n: u64, step: f64) {
    for k in 1..=n {
        show(Some((at(100.0 + step * k as f64, 100.0), 0.9)), None);
        assert_eq!(tracker.update(&frame(k)).unwrap().state, TrackState::Tracking);
    }
    asked();
}

#[test]
fn what_is_seen_moves_the_box_and_is_learned() {
    let mut tracker = start("");
    show(Some((at(104.0, 98.0), 0.9)), None);
    let estimate = tracker.update(&frame(1)).unwrap();
    assert_eq!((estimate.state, estimate.score, estimate.time_s), (TrackState::Tracking, 0.9, 0.1));
    assert_eq!(estimate.prediction, Some(at(100.0, 100.0)));
    assert_eq!(estimate.measurement, Some(at(104.0, 98.0)));
    assert!(estimate.bbox.center().distance(at(104.0, 98.0).center()) < 0.1, "{}", estimate.bbox);
    assert!(estimate.covariance.is_some());
    let velocity = estimate.velocity.unwrap();
    assert!((20.0..45.0).contains(&velocity.x) && (velocity.x + 2.0 * velocity.y).abs() < 1e-6, "{velocity:?}");
    let near = Asked::Locate(Look::Near, at(100.0, 100.0));
    assert_eq!(asked(), [near, Asked::Refine(at(104.0, 98.0)), Asked::Adapt(estimate.bbox)]);
}

#[test]
fn the_search_follows_the_prediction_and_the_refined_size_counts() {
    let mut tracker = start("growth = 1.2");
    seen(&mut *tracker, 8, 5.0);
    show(None, None);
    let estimate = tracker.update(&frame(9)).unwrap();
    let prediction = estimate.prediction.unwrap();
    assert!((prediction.center().x - 155.0).abs() < 0.5, "{prediction}");
    assert!((prediction.width() - 24.0).abs() < 0.2, "{prediction}");
    assert_eq!(asked(), [Asked::Locate(Look::Near, prediction)]);
    // Where it was, where the prediction has no part in the search.
    let mut stays = start("search.prediction_gain = 0.0");
    seen(&mut *stays, 8, 5.0);
    show(None, None);
    stays.update(&frame(9)).unwrap();
    let Some(Asked::Locate(Look::Near, place)) = asked().into_iter().next() else { unreachable!() };
    assert!((place.center().x - 150.0).abs() < 0.1, "{place}");
}

#[test]
fn unsure_measurements_move_the_box_but_teach_nothing() {
    let mut tracker = start("");
    show(Some((at(103.0, 100.0), 0.3)), None);
    let estimate = tracker.update(&frame(1)).unwrap();
    assert_eq!((estimate.state, estimate.score), (TrackState::Unsure, 0.3));
    assert!((estimate.bbox.center().x - 113.0).abs() < 0.1);
    assert!(asked().iter().all(|a| !matches!(a, Asked::Adapt(_))));
    // What lies outside the picture moves it too, but is in nobody's sight.
    let mut outside = start("");
    show(Some((at(WIDTH as f64 + 5.0, 100.0), 0.3)), None);
    let estimate = outside.update(&frame(1)).unwrap();
    assert_eq!((estimate.state, estimate.score), (TrackState::Occluded, 0.3));
    assert!(estimate.bbox.left() > 300.0, "{}", estimate.bbox);
    // A policy that does not follow coasts.
    let mut gated = start("policy.model = 'gated'\nsearch.model = 'gate'");
    seen(&mut *gated, 8, 5.0);
    show(Some((at(100.0, 100.0), 0.1)), None);
    let estimate = gated.update(&frame(9)).unwrap();
    assert_eq!(estimate.state, TrackState::Occluded);
    assert_eq!(estimate.bbox, estimate.prediction.unwrap());
}

#[test]
fn a_method_may_ask_to_learn_in_doubt() {
    let mut tracker = start("policy.calibrated.learn_unsure_from = 0.3\npolicy.occluded_below = 0.4");
    for (k, confidence, teaches) in [(1, 0.29, false), (2, 0.3, true)] {
        show(Some((at(103.0, 100.0), confidence)), None);
        assert_eq!(tracker.update(&frame(k)).unwrap().state, TrackState::Unsure);
        let taught: Vec<_> = asked().into_iter().filter(|a| matches!(a, Asked::Adapt(_))).collect();
        // At the box measured, not at the one coasted.
        assert_eq!(taught, if teaches { vec![Asked::Adapt(at(103.0, 100.0))] } else { Vec::new() });
    }
}

#[test]
fn the_localizer_is_told_what_became_of_every_frame() {
    let mut tracker = start("growth = 1.5");
    concluded();
    show(Some((at(102.0, 100.0), 0.9)), None);
    tracker.update(&frame(1)).unwrap();
    show(Some((at(104.0, 100.0), 0.1)), None);
    tracker.peek(&frame(2)).unwrap();
    tracker.update(&frame(2)).unwrap();
    show(None, None);
    tracker.update(&frame(3)).unwrap();
    let refined = |x| Some(at(x, 100.0).scaled(1.5));
    let told =
        [(refined(102.0), TrackState::Tracking), (refined(104.0), TrackState::Unsure), (None, TrackState::Occluded)];
    assert_eq!(concluded(), told, "once a frame, and not for a mere look");
}

#[test]
fn a_believed_measurement_teaches_only_from_its_threshold_on() {
    let mut tracker = start("policy.learn_from = 0.7");
    for (k, confidence, teaches) in [(1, 0.69, false), (2, 0.7, true)] {
        show(Some((at(100.0, 100.0), confidence)), None);
        assert_eq!(tracker.update(&frame(k)).unwrap().state, TrackState::Tracking);
        assert_eq!(asked().iter().any(|a| matches!(a, Asked::Adapt(_))), teaches);
    }
}

#[test]
fn a_lost_target_is_reported_where_it_was_believed_last_and_found_again_elsewhere() {
    let mut tracker = start("");
    seen(&mut *tracker, 5, 4.0);
    show(None, None);
    for k in 6..=15 {
        let estimate = tracker.update(&frame(k)).unwrap();
        assert_eq!(estimate.state, TrackState::Occluded, "{k}");
        assert!((estimate.bbox.left() - (100.0 + 4.0 * k as f64)).abs() < 3.0, "{k}: {}", estimate.bbox);
        assert!(estimate.velocity.is_some());
    }
    let lost = tracker.update(&frame(16)).unwrap();
    assert_eq!((lost.state, lost.score, lost.measurement, lost.velocity), (TrackState::Lost, 0.0, None, None));
    assert!((lost.bbox.left() - 120.0).abs() < 0.1, "{}", lost.bbox);
    asked();
    show(Some((at(1.0, 1.0), 1.0)), Some((at(250.0, 60.0), 0.8)));
    let found = tracker.update(&frame(17)).unwrap();
    assert_eq!((found.state, found.score), (TrackState::Tracking, 0.8));
    // Its old motion says nothing of the new place.
    assert_eq!(found.bbox, at(250.0, 60.0));
    assert_eq!((found.velocity.unwrap().x, found.velocity.unwrap().y), (0.0, 0.0));
    let looks: Vec<Look> =
        asked().iter().filter_map(|a| if let Asked::Locate(look, _) = a { Some(*look) } else { None }).collect();
    assert_eq!(looks.iter().filter(|l| **l == Look::Sweep).count(), 8);
    assert_eq!((looks.len(), looks.last()), (9, Some(&Look::Centred)));
}

#[test]
fn a_find_doubted_on_probation_is_refused_for_a_while() {
    // Frames are a tenth of a second apart.
    let states = |settings: &str| {
        let mut tracker = start(settings);
        show(None, None);
        let lost = (1..=11).map(|k| tracker.update(&frame(k)).unwrap().state).last();
        assert_eq!(lost, Some(TrackState::Lost));
        let (alike, target) = (Some((at(250.0, 60.0), 0.8)), Some((at(30.0, 150.0), 0.8)));
        let mut states = Vec::new();
        let script =
            [(None, alike), (Some((at(250.0, 60.0), 0.1)), None), (None, alike), (None, alike), (None, target)];
        for (k, (near, far)) in (12..).zip(script) {
            show(near, far);
            states.push(tracker.update(&frame(k)).unwrap().state == TrackState::Tracking);
        }
        // It is lost once more, and the time is over.
        show(Some((at(30.0, 150.0), 0.1)), None);
        tracker.update(&frame(17)).unwrap();
        show(None, alike);
        states.push((18..=25).map(|k| tracker.update(&frame(k)).unwrap().state).any(|s| s == TrackState::Tracking));
        states
    };
    let settings = "policy.probation_s = 0.5\npolicy.occluded_below = 0.4\nsearch.refuse_s = ";
    assert_eq!(states(&format!("{settings}1.0")), [true, false, false, false, true, true]);
    assert_eq!(states(&format!("{settings}60.0")), [true, false, false, false, true, false]);
    assert_eq!(states(&format!("{settings}0.0"))[..3], [true, false, true]);
}

#[test]
fn a_target_seen_outside_its_neighbourhood_starts_its_motion_anew() {
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    show(Some((at(20.0, 200.0), 0.9)), None);
    let estimate = tracker.update(&frame(9)).unwrap();
    assert_eq!((estimate.bbox, estimate.velocity.unwrap().x), (at(20.0, 200.0), 0.0));
    // Two and a half sizes about the prediction: just inside it goes on.
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    show(Some((at(145.0 + 20.0, 100.0), 0.9)), None);
    assert!(tracker.update(&frame(9)).unwrap().velocity.unwrap().x > 50.0);
}

#[test]
fn nobody_tracks_what_lies_outside_the_picture() {
    let mut tracker = start("policy.model = 'always'");
    show(Some((at(WIDTH as f64 + 5.0, 100.0), 1.0)), None);
    let estimate = tracker.update(&frame(1)).unwrap();
    assert_eq!((estimate.state, estimate.score), (TrackState::Occluded, 0.0));
    assert!(asked().iter().all(|a| !matches!(a, Asked::Adapt(_))));
    // One that coasted a whole frame beyond the border is lost.
    let mut tracker = start("");
    seen(&mut *tracker, 8, 20.0);
    show(None, None);
    let mut states = Vec::new();
    for k in 9..13 {
        states.push(tracker.update(&frame_at(k, k as f64)).unwrap().state);
    }
    assert_eq!(states.last(), Some(&TrackState::Lost), "{states:?}");
}

#[test]
fn time_is_that_of_the_frames_and_never_runs_backwards() {
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    show(None, None);
    let ahead = |tracker: &mut dyn Tracker, time_s: f64| {
        tracker.boxed_clone().update(&frame_at(9, time_s)).unwrap().prediction.unwrap().center().x
    };
    assert!((ahead(&mut *tracker, 0.9) - 155.0).abs() < 0.5);
    assert!((ahead(&mut *tracker, 1.2) - 170.0).abs() < 1.5);
    for odd in [0.8, 0.3, -5.0, f64::NAN] {
        assert!((ahead(&mut *tracker, odd) - 150.0).abs() < 0.3, "{odd}");
    }
    // A time that is no number leaves the clock where it was.
    tracker.update(&frame_at(9, f64::NAN)).unwrap();
    assert!((ahead(&mut *tracker, 0.9) - 155.0).abs() < 0.7);
}

#[test]
fn frames_of_another_size_are_refused() {
    let mut tracker = start("");
    let other = Frame::new(1, 0.1, Image::filled(64, 48, 0_u8).unwrap());
    let error = tracker.update(&other).unwrap_err();
    assert!(matches!(
        error,
        TrackingError::FrameSize { index: 1, expected, actual }
            if expected == Size::new(WIDTH, HEIGHT) && actual == Size::new(64, 48)
    ));
    assert!(tracker.peek(&other).is_err());
    tracker.reinit(&other, BBox::from_ltwh(10.0, 10.0, 8.0, 8.0)).unwrap();
    show(Some((BBox::from_ltwh(11.0, 10.0, 8.0, 8.0), 0.9)), None);
    let next = Frame::new(2, 0.2, Image::filled(64, 48, 0_u8).unwrap());
    assert_eq!(tracker.update(&next).unwrap().state, TrackState::Tracking);
}

#[test]
fn starting_again_forgets_the_target() {
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    show(None, None);
    (9..30).for_each(|k| {
        tracker.update(&frame(k)).unwrap();
    });
    asked();
    assert!(tracker.reinit(&frame(30), at(900.0, 0.0)).is_err());
    tracker.reinit(&frame(30), at(40.0, 40.0)).unwrap();
    assert_eq!(asked(), [Asked::Restart(at(40.0, 40.0))]);
    show(None, None);
    let estimate = tracker.update(&frame(31)).unwrap();
    assert_eq!((estimate.state, estimate.prediction), (TrackState::Occluded, Some(at(40.0, 40.0))));
    // Its clock runs from the new start; so does the time that it has not been seen.
    for k in 32..=40 {
        assert_eq!(tracker.update(&frame(k)).unwrap().state, TrackState::Occluded, "{k}");
    }
    let lost = tracker.update(&frame(41)).unwrap();
    assert_eq!((lost.state, lost.bbox), (TrackState::Lost, at(40.0, 40.0)));
}

#[test]
fn peeking_says_what_an_update_would_measure_and_changes_nothing() {
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    let before = tracker.save().unwrap();
    show(Some((at(146.0, 100.0), 0.9)), None);
    let seen = tracker.peek(&frame(9)).unwrap().unwrap();
    assert_eq!((seen.bbox, seen.confidence), (at(146.0, 100.0), 0.9));
    assert_eq!(tracker.save().unwrap(), before);
    assert!(asked().iter().all(|a| !matches!(a, Asked::Adapt(_))));
    show(None, None);
    assert_eq!(tracker.peek(&frame(9)).unwrap(), None);
    assert_eq!(tracker.save().unwrap(), before);
}

#[test]
fn forecasts_are_those_of_the_motion_from_the_last_frame_on() {
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    let ahead = tracker.forecast(0.4).unwrap();
    assert!((ahead.time_s - 1.2).abs() < 1e-12);
    assert!((ahead.bbox.center().x - 170.0).abs() < 1.5, "{}", ahead.bbox);
    assert_eq!(tracker.forecast(0.0).unwrap().time_s, 0.8);
}

#[test]
fn groups_change_while_running_and_nothing_else_does() {
    let mut tracker = start("");
    seen(&mut *tracker, 8, 5.0);
    let before = tracker.save().unwrap();
    for bad in ["growth = 1.1", "policy.no = 1", "search.reach = 0.0"] {
        assert!(matches!(tracker.change(&table(bad)), Err(TrackingError::Parameter(_))), "{bad}");
        assert_eq!(tracker.save().unwrap(), before, "{bad}");
    }
    // A change of policy leaves the motion as it is.
    tracker.change(&table("policy.occluded_below = 0.95\npolicy.seen_from = 0.95")).unwrap();
    show(Some((at(145.0, 100.0), 0.9)), None);
    let estimate = tracker.update(&frame(9)).unwrap();
    assert_eq!(estimate.state, TrackState::Unsure);
    assert!((estimate.prediction.unwrap().center().x - 155.0).abs() < 0.5);
    // Another motion model starts at rest from the box believed.
    tracker.change(&table("motion.model = 'none'\nsearch.model = 'near'")).unwrap();
    show(None, None);
    let estimate = tracker.update(&frame(10)).unwrap();
    assert_eq!((estimate.velocity, estimate.covariance), (None, None));
    assert!((estimate.bbox.center().x - 155.0).abs() < 0.5);
    (11..40).for_each(|k| {
        tracker.update(&frame(k)).unwrap();
    });
    asked();
    tracker.update(&frame(40)).unwrap();
    assert!(
        asked().iter().all(|a| matches!(a, Asked::Locate(Look::Near, _))),
        "a lost one is searched for nearby alone"
    );
}

#[test]
fn copies_go_their_own_way() {
    let mut tracker = start("");
    seen(&mut *tracker, 4, 5.0);
    let mut copy = tracker.boxed_clone();
    show(Some((at(20.0, 20.0), 0.9)), None);
    copy.update(&frame(5)).unwrap();
    show(Some((at(125.0, 100.0), 0.9)), None);
    let estimate = tracker.update(&frame(5)).unwrap();
    assert!((estimate.bbox.left() - 125.0).abs() < 0.1);
}

#[test]
fn saved_loops_go_on_alike() {
    let mut tracker = start("motion.model = 'singer'");
    seen(&mut *tracker, 8, 5.0);
    let saved = tracker.save().unwrap();
    let mut restored = recipe("").restore(&saved).unwrap();
    assert_eq!(restored.save().unwrap(), saved);
    for k in 9..20 {
        show((k % 3 > 0).then(|| (at(100.0 + 5.0 * k as f64, 100.0), 0.8)), None);
        assert_eq!(restored.update(&frame(k)).unwrap(), tracker.update(&frame(k)).unwrap(), "{k}");
    }
}

/// Smooth texture, moved by `shift` pixels to the right and half as many down.
fn textured(k: u64, shift: f64) -> Frame {
    let wave = |x: f64, y: f64| (x * 0.11).sin() * (y * 0.13).cos() + (x * 0.037 + y * 0.051).sin() + (y * 0.071).sin();
    let image =
        Image::from_fn(WIDTH, HEIGHT, |x, y| (128.0 + 38.0 * wave(x as f64 - shift, y as f64 - shift / 2.0)) as u8);
    Frame::new(k, k as f64 / 10.0, image.unwrap())
}

#[test]
fn a_camera_that_moves_takes_the_expectation_with_it() {
    for kind in ["flow", "phase"] {
        let recipe = recipe(&format!("motion.camera = '{kind}'"));
        let mut tracker = recipe.init(&textured(0, 0.0), at(100.0, 100.0)).unwrap();
        // The target stands in the world; the picture jumps by 12 px in every frame.
        for k in 1..6 {
            let shift = 12.0 * k as f64;
            let truth = at(100.0 + shift, 100.0 + shift / 2.0);
            show(Some((truth, 0.9)), None);
            let before = tracker.save().unwrap();
            let peeked = tracker.peek(&textured(k, shift)).unwrap().unwrap();
            assert_eq!(tracker.save().unwrap(), before, "{kind}");
            let estimate = tracker.update(&textured(k, shift)).unwrap();
            assert_eq!(Some(peeked.bbox), estimate.measurement);
            let apart = estimate.prediction.unwrap().center().distance(truth.center());
            assert!(apart < 2.0, "{kind}, frame {k}: {apart}");
            let speed = estimate.velocity.unwrap();
            assert!(speed.x.hypot(speed.y) < 25.0, "{kind}: it stands in the world: {speed:?}");
        }
        // Unseen, it is expected where the picture takes it.
        show(None, None);
        let coasted = tracker.update(&textured(6, 72.0)).unwrap().bbox;
        assert!(coasted.center().distance(at(172.0, 136.0).center()) < 4.0, "{kind}: {coasted}");
    }
    let mut still = recipe("").init(&textured(0, 0.0), at(100.0, 100.0)).unwrap();
    show(None, None);
    assert_eq!(still.update(&textured(1, 12.0)).unwrap().prediction, Some(at(100.0, 100.0)));
}

#[test]
fn the_localizer_chooses_between_the_measured_and_the_filtered_box() {
    // A filter that hardly believes what is measured.
    let coarse = "motion.noise_floor_px = 20.0\nmotion.start_speed = 0.1\nmotion.acceleration = 1.0";
    let (far, seen) = (at(112.0, 106.0), Some((at(112.0, 106.0), 0.9)));
    let update = |weighed| {
        let mut tracker = start(coarse);
        prefer(weighed);
        show(seen, None);
        let estimate = tracker.update(&frame(1)).unwrap();
        prefer(Weighed::Filtered);
        (estimate, passed(), tracker)
    };
    let (estimate, (filtered, told), filter) = update(Weighed::Filtered);
    assert_eq!((Some(estimate.bbox), told), (filtered, Some((far, estimate.bbox))));
    assert!(estimate.bbox.center().distance(far.center()) > 3.0, "{}", estimate.bbox);

    let (measured, (_, told), mut tracker) = update(Weighed::Measured);
    assert_eq!((measured.bbox, measured.velocity), (far, estimate.velocity), "the filter keeps its own");
    assert_eq!(told, Some((far, far)));
    let (now, ahead) = (tracker.forecast(0.0).unwrap(), tracker.forecast(0.2).unwrap());
    assert_eq!(now.bbox, far);
    let (own, from) = (filter.forecast(0.2).unwrap().bbox.center(), estimate.bbox.center());
    let (dx, dy) = (own.x - from.x, own.y - from.y);
    assert!((ahead.bbox.center().x - far.center().x - dx).abs() < 1e-9 && dx > 0.0, "{}", ahead.bbox);
    assert!((ahead.bbox.center().y - far.center().y - dy).abs() < 1e-9 && dy > 0.0, "{}", ahead.bbox);
    assert!((ahead.bbox.width() - 20.0).abs() < 0.5);
    let prediction = |tracker: &mut dyn Tracker| tracker.update(&frame(2)).unwrap().prediction.unwrap();
    assert!(prediction(&mut *tracker).center().x < far.center().x - 3.0);

    let (restarted, _, mut tracker) = update(Weighed::Restarted);
    assert_eq!((restarted.bbox, restarted.velocity.unwrap().x), (far, 0.0));
    assert_eq!(prediction(&mut *tracker), far);
}

#[test]
fn the_end_of_a_frame_says_what_was_followed() {
    let mut tracker = start("");
    // In doubt: the box measured, not the one believed.
    show(Some((at(103.0, 100.0), 0.3)), None);
    assert_eq!(tracker.update(&frame(1)).unwrap().state, TrackState::Unsure);
    assert_eq!(passed(), (None, Some((at(103.0, 100.0), at(103.0, 100.0)))));
    show(None, None);
    tracker.update(&frame(2)).unwrap();
    assert_eq!(passed(), (None, None));
    // Looking ahead ends no frame.
    show(Some((at(103.0, 100.0), 0.9)), None);
    tracker.peek(&frame(3)).unwrap();
    assert_eq!(passed(), (None, None));
}
