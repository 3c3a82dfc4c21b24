//! Births, gaps, deaths, and what appearance adds.

use super::*;

#[test]
fn a_candidate_is_confirmed_by_m_of_n_and_forgotten_otherwise() {
    // Seen in frames 0, 1 and 4: three of five.
    let pattern = |k: u64| if [0, 1, 4].contains(&k) { vec![seen(at(100.0, 100.0))] } else { vec![] };
    let mut many_ = many(pattern, params());
    for k in 0..4 {
        assert!(step(&mut many_, k).is_empty(), "frame {k}");
        assert_eq!(many_.candidates().count(), 1);
    }
    let tracks = step(&mut many_, 4);
    assert_eq!(states(&tracks), [(1, TrackState::Tracking)]);
    assert!(tracks[0].started);
    assert_eq!(many_.candidates().count(), 0);
    assert!(!step(&mut many_, 5)[0].started);

    // Seen in frames 0 and 1 alone: after the third miss three of five cannot come any more.
    let mut many_ = many(|k| if k < 2 { vec![seen(at(100.0, 100.0))] } else { vec![] }, params());
    let candidates: Vec<usize> = (0..6)
        .map(|k| {
            assert!(step(&mut many_, k).is_empty());
            many_.candidates().count()
        })
        .collect();
    assert_eq!(candidates, [1, 1, 1, 1, 0, 0]);

    // One of one: at once, with the detection's own confidence.
    let mut many_ = many(|_| vec![seen(at(100.0, 100.0))], with("birth.hits.hits = 1\nbirth.hits.looks = 1"));
    let tracks = step(&mut many_, 0);
    assert_eq!(estimate(&tracks, 1).score, 0.8);
    assert_eq!((estimate(&tracks, 1).bbox, tracks[0].started), (at(100.0, 100.0), true));
}

#[test]
fn weak_detections_continue_targets_and_start_none() {
    let weak = |k: u64| Detection::new(at(100.0, 100.0), if k < 3 { 0.6 } else { 0.3 });
    let mut many_ = many(move |k| vec![weak(k), Detection::new(at(200.0, 50.0), 0.4)], params());
    for k in 0..3 {
        step(&mut many_, k);
    }
    let tracks = step(&mut many_, 3);
    assert_eq!((states(&tracks), estimate(&tracks, 1).score), (vec![(1, TrackState::Tracking)], 0.3));
    assert_eq!(many_.candidates().count(), 0, "0.4 is below birth_from");
    let mut many_ = many(move |k| vec![weak(k)], with("association.least_confidence = 0.5"));
    (0..3).for_each(|k| drop(step(&mut many_, k)));
    assert_eq!(states(&step(&mut many_, 3)), [(1, TrackState::Occluded)], "0.3 is passed over");
}

#[test]
fn what_is_too_unsure_is_no_hit() {
    let fades = |k: u64| vec![Detection::new(at(100.0, 100.0), if k == 0 { 0.6 } else { 0.4 })];
    for (from, targets) in [("0.4", 1), ("0.5", 0)] {
        let mut many_ = many(fades, with(&format!("birth.hits.from = {from}")));
        (0..8).for_each(|k| drop(step(&mut many_, k)));
        assert_eq!(many_.ids().len(), targets, "from {from}");
    }
}

#[test]
fn a_target_seen_twice_is_one_target() {
    let twice = |_| vec![seen(at(100.0, 100.0)), seen(at(103.0, 100.0))];
    let mut many_ = many(twice, params());
    for k in 0..10 {
        assert!(step(&mut many_, k).len() <= 1);
    }
    assert_eq!(many_.candidates().count(), 0);
    // Two that stand beside each other are two.
    let mut many_ = many(|_| vec![seen(at(100.0, 100.0)), seen(at(112.0, 100.0))], params());
    (0..3).for_each(|k| drop(step(&mut many_, k)));
    assert_eq!(many_.ids(), [TargetId(1), TargetId(2)]);
}

/// Seen until frame 10, away until frame `back`, then seen where it would have gone on to.
pub fn gap(back: u64) -> impl Fn(u64) -> Vec<Detection> + Send + Sync + Clone {
    move |k| if k < 10 || k >= back { vec![seen(at(60.0 + 2.0 * k as f64, 100.0))] } else { vec![] }
}

#[test]
fn unseen_targets_are_coasted_then_lost_then_given_up() {
    let mut many_ = many(gap(1000), with("death.unseen.after_s = 2.0"));
    let mut seen_states = Vec::new();
    for k in 0..70 {
        let tracks = step(&mut many_, k);
        if k == 12 {
            let coasted = estimate(&tracks, 1);
            assert!(coasted.bbox.iou(&at(84.0, 100.0)) > 0.6, "it goes on at 2 px a frame: {coasted:?}");
            assert!(coasted.measurement.is_none() && coasted.velocity.unwrap().x > 40.0);
            assert!(coasted.score > 0.0 && coasted.score < 0.35);
        }
        if k == 50 {
            let lost = estimate(&tracks, 1);
            assert!(lost.bbox.iou(&at(78.0, 100.0)) > 0.8, "the last believed box: {lost:?}");
            assert_eq!((lost.score, lost.velocity), (0.0, None));
        }
        seen_states.push(tracks.first().map(|t| t.estimate.as_ref().unwrap().state));
    }
    // Lost after a second (25 frames) without being seen, given up after two.
    assert_eq!(seen_states[2..10], [Some(TrackState::Tracking); 8]);
    assert_eq!(seen_states[10..35], [Some(TrackState::Occluded); 25]);
    assert_eq!(seen_states[35..59], [Some(TrackState::Lost); 24]);
    assert!(seen_states[61..].iter().all(Option::is_none), "{:?}", &seen_states[58..]);
}

#[test]
fn targets_die_of_frames_missed() {
    let mut many_ = many(gap(1000), with("death.model = 'misses'\ndeath.misses.most = 4"));
    let alive: Vec<usize> = (0..20).map(|k| step(&mut many_, k).len()).collect();
    assert_eq!((alive[9], alive[13], alive[14]), (1, 1, 0), "seen in frame 9, missed in five: {alive:?}");
}

#[test]
fn lost_targets_are_detected_again_under_their_id() {
    let mut many_ = many(gap(40), params());
    for k in 0..40 {
        step(&mut many_, k);
    }
    let tracks = step(&mut many_, 40);
    assert_eq!(states(&tracks), [(1, TrackState::Tracking)]);
    assert_eq!(estimate(&tracks, 1).bbox, at(140.0, 100.0), "a lost target starts anew where it is found");
    // Out of reach it is another one.
    let far = |k: u64| if k < 10 { vec![seen(at(60.0, 100.0))] } else { vec![seen(at(250.0, 100.0))] };
    let mut many_ = many(far, params());
    (0..14).for_each(|k| drop(step(&mut many_, k)));
    assert_eq!(states(&step(&mut many_, 14)), [(1, TrackState::Occluded), (2, TrackState::Tracking)]);
}

#[test]
fn a_target_that_leaves_the_picture_is_gone_for_good() {
    let leaving = |k: u64| if k < 20 { vec![seen(at(280.0 + 2.0 * k as f64, 100.0))] } else { vec![] };
    let mut many_ = many(leaving, with("death.unseen.after_s = 60.0"));
    let alive = (0..60).map(|k| step(&mut many_, k).len()).collect::<Vec<_>>();
    assert_eq!((alive[19], alive[22]), (1, 1));
    // Outside of the picture a second passes four times as fast.
    assert!(alive[40..].iter().all(|n| *n == 0), "{alive:?}");
    // An id is not used again.
    let again = move |k: u64| if (k / 60).is_multiple_of(2) { leaving(k % 60) } else { vec![] };
    let mut many_ = many(again, params());
    let ids: Vec<u64> = (0..180).flat_map(|k| step(&mut many_, k)).map(|t| t.id.0).collect();
    assert_eq!((ids.first(), ids.last()), (Some(&1), Some(&2)));
}

#[test]
fn the_detector_hears_of_targets_that_are_followed() {
    let script = |k: u64| if k < 10 { vec![seen(at(60.0 + 2.0 * k as f64, 100.0))] } else { vec![] };
    let detector = scripted(script);
    let told = detector.told.clone();
    let mut many = Associating::new(detector, params()).unwrap();
    (0..60).for_each(|k| drop(step(&mut many, k)));
    let told = told.lock().unwrap();
    assert_eq!(told.len(), 60, "it is asked at every frame");
    assert!(told[..3].iter().all(Vec::is_empty), "candidates are not followed yet");
    assert!(told[3..11].iter().all(|t| t.len() == 1 && t[0].measured));
    assert!(told[8][0].bbox.iou(&at(76.0, 100.0)) > 0.7, "where it is expected now: {:?}", told[8]);
    assert!(told[11..36].iter().all(|t| t.len() == 1 && !t[0].measured));
    assert!(told[36..].iter().all(Vec::is_empty), "lost ones are nowhere");
}

/// One target, painted in every frame, detected until frame 10.
pub fn painted(k: u64) -> pursuit_imaging::Frame {
    frame(k, &[(at(60.0 + 2.0 * k as f64, 100.0), 200)])
}

#[test]
fn appearance_answers_when_no_detection_is_associated() {
    let run = |params: ManyParams, appearance: bool| {
        let mut many = many(gap(1000), params);
        if appearance {
            many = many.with_appearance(recipe());
        }
        let mut tracks = Vec::new();
        let mut seen_states = Vec::new();
        for k in 0..80 {
            many.step(&painted(k), &mut tracks).unwrap();
            if let Some(t) = tracks.first() {
                let e = t.estimate.as_ref().unwrap();
                assert!(e.state != TrackState::Tracking || e.bbox.iou(&at(60.0 + 2.0 * k as f64, 100.0)) > 0.7);
                seen_states.push(e.state);
            }
        }
        seen_states
    };
    assert_eq!(run(params(), false)[8], TrackState::Occluded);
    let followed = run(params(), true);
    // 2 s of trust after the detection in frame 9, which stands at place 7: then it counts as unseen.
    assert_eq!(followed[..58], [TrackState::Tracking; 58]);
    assert_eq!(followed[58], TrackState::Occluded, "{followed:?}");
    assert_eq!(run(with("appearance_s = 0.4"), true)[18], TrackState::Occluded);
}

#[test]
fn detected_targets_have_one_belief() {
    // What appearance sees beside a detection corrects nothing, so that it changes no box.
    let run = |many: Associating| {
        let mut many = many;
        let mut said = Vec::new();
        for k in 0..40 {
            let mut tracks = Vec::new();
            many.step(&painted(k), &mut tracks).unwrap();
            said.extend(tracks.into_iter().filter_map(|t| t.estimate).map(|e| (e.bbox, e.covariance, e.velocity)));
        }
        said
    };
    let detected = || many(|k| vec![seen(at(60.0 + 2.0 * k as f64, 101.0))], params());
    let alone = run(detected());
    assert!(alone.len() > 30);
    assert_eq!(alone, run(detected().with_appearance(recipe())));
}

#[test]
fn appearance_must_be_sure_enough() {
    let last = |changes: &str| {
        let mut many = many(gap(20), with(changes)).with_appearance(recipe());
        let mut tracks = Vec::new();
        (0..15).for_each(|k| many.step(&painted(k), &mut tracks).unwrap());
        states(&tracks)
    };
    // It sees with a probability of 0.9.
    assert_eq!(last("appearance_from = 0.85"), [(1, TrackState::Tracking)]);
    assert_eq!(last("appearance_from = 0.95"), [(1, TrackState::Occluded)]);
}

#[test]
fn appearance_that_strays_is_put_back_on_the_detection() {
    // The detector sees the target at 60; the patch that its tracker took is somewhere else from frame 5 on.
    let detector = scripted(|k| if k < 12 { vec![seen(at(60.0, 100.0))] } else { vec![] });
    let mut many = Associating::new(detector, params()).unwrap().with_appearance(recipe());
    let picture = |k: u64| match k {
        0..5 => frame(k, &[(at(60.0, 100.0), 200)]),
        _ => frame(k, &[(at(60.0, 100.0), 120), (at(80.0, 100.0), 200)]),
    };
    let mut tracks = Vec::new();
    for k in 0..16 {
        many.step(&picture(k), &mut tracks).unwrap();
    }
    let e = tracks[0].estimate.as_ref().unwrap();
    assert_eq!(e.state, TrackState::Tracking);
    assert!(e.bbox.iou(&at(60.0, 100.0)) > 0.8, "the tracker follows the new shade: {e:?}");
}

#[test]
fn a_target_is_what_its_detections_are_taken_for_most() {
    // A dog that the detector takes for a cat in every third frame.
    let word = |k: u64| if k.is_multiple_of(3) { "cat" } else { "dog" };
    let mut many_ = many(move |k| vec![named(at(100.0, 100.0), word(k))], params());
    let last = (0..12).map(|k| step(&mut many_, k)).last().unwrap();
    assert_eq!((states(&last), class(&last, 1)), (vec![(1, TrackState::Tracking)], Some("dog")));
    let saved = many_.save().unwrap();
    let mut again = Associating::restore(&saved, scripted(|_| vec![]), &recipe_of).unwrap();
    assert_eq!(class(&step(&mut again, 12), 1), Some("dog"), "also where nothing is seen");
    // Detectors without words name nothing.
    let mut many_ = many(|_| vec![seen(at(100.0, 100.0))], params());
    let last = (0..5).map(|k| step(&mut many_, k)).last().unwrap();
    assert_eq!(class(&last, 1), None);
}

#[test]
fn of_two_that_meet_and_turn_back_each_keeps_to_its_class() {
    let script = |names: bool| {
        move |k: u64| {
            let away = 1.5 * (k as f64 - 15.0).abs();
            let (dog, person) = (at(99.0 - away, 100.0), at(101.0 + away, 100.0));
            if names { vec![named(dog, "dog"), named(person, "person")] } else { vec![seen(dog), seen(person)] }
        }
    };
    let farthest = |names: bool| {
        let mut many_ = many(script(names), params());
        let tracks: Vec<Vec<Track>> = (0..31).map(|k| step(&mut many_, k)).collect();
        let x = |k: usize| estimate(&tracks[k], 1).bbox.center().x;
        (x(5) - x(25)).abs()
    };
    let (by_words, by_motion) = (farthest(true), farthest(false));
    assert!(by_words < 3.0, "{by_words}");
    assert!(by_motion > 20.0, "nothing but the words tells them apart: {by_motion}");
}

#[test]
fn turning_cameras_are_taken_out_once_for_all() {
    use pursuit_geometry::{Point, Size};
    use pursuit_imaging::{CameraPose, Lens};
    // Two things stand still in front of a camera that jerks to and fro.
    let pose = |k: u64| {
        let pan = if (k / 5).is_multiple_of(2) { 0.0 } else { 0.25 };
        CameraPose::new(k as f64 / common::FPS, pan, 0.0, Lens::field_of_view(1.0).unwrap()).unwrap()
    };
    let size = Size::new(common::WIDTH, common::HEIGHT);
    let seen_by = move |k: u64, x: f64| {
        let there = pose(0).direction_of(Point::new(x, 100.0), size);
        pose(k).point_of(there, size).map(|p| seen(at(p.x, p.y)))
    };
    let ids = |camera: &str| {
        let script = move |k| [200.0, 250.0].into_iter().filter_map(|x| seen_by(k, x)).collect();
        let mut many = many(script, with(&format!("motion.camera = '{camera}'\nassociation.reach = 1.5")));
        let mut tracks = Vec::new();
        (0..40).for_each(|k| many.step(&empty(k).with_camera(pose(k)), &mut tracks).unwrap());
        tracks.last().unwrap().id.0
    };
    assert_eq!(ids("pose"), 2);
    assert!(ids("none") > 2, "it is the turn that tells where they went");
}

/// One is seen until second 1 and goes on out of sight; from second 1.5 a detector sees it again, larger, so that it is taken for another.
fn seen_anew(changes: &str) -> Vec<u64> {
    let mut many = Associating::fed(with(changes)).unwrap();
    let mut ids = Vec::new();
    for k in 0..26 {
        let t = f64::from(k) / 10.0;
        let bbox = at(100.0, 100.0);
        let other = BBox::from_center_size(bbox.center(), 1.35 * bbox.width(), 1.35 * bbox.height());
        let found = if t < 1.0 {
            vec![seen(bbox)]
        } else if t < 1.5 {
            vec![]
        } else {
            vec![seen(other)]
        };
        let tracks = many.update(t, None, &found).unwrap();
        ids = tracks.iter().map(|t| t.id.0).collect();
    }
    ids
}

#[test]
fn doubles_go_on_under_the_older_id() {
    // Nothing that large is taken for the one that was lost.
    let never = "association.gate = 1.0\nbirth.crowding = 1.0\n";
    assert_eq!(seen_anew(never), [1, 2], "both are kept");
    let merged = format!("{never}doubles.model = 'overlap'\ndoubles.overlap.above = 0.5");
    assert_eq!(seen_anew(&merged), [1]);
    let apart = format!("{never}doubles.model = 'overlap'\ndoubles.overlap.above = 0.9");
    assert_eq!(seen_anew(&apart), [1, 2], "they overlap by .55");
}
