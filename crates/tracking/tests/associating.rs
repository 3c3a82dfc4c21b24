//! The four phases: identities through crossings, births and deaths, false alarms and misses.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{at, empty, frame, frame_at, recipe, recipe_of, scripted, seen};
use pursuit_geometry::BBox;
use pursuit_tracking::many::{Associating, AssociationParams};
use pursuit_tracking::{Detection, Estimate, MultiTracker, TargetId, Track, TrackState, TrackingError};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

fn params() -> AssociationParams {
    AssociationParams::default()
}

fn with(changes: &str) -> AssociationParams {
    use pursuit_tracking::parameters::Parameters;
    params().with("many", &changes.parse().unwrap()).unwrap()
}

fn many(script: impl Fn(u64) -> Vec<Detection> + Send + Sync + 'static, params: AssociationParams) -> Associating {
    Associating::new(scripted(script), params).unwrap()
}

fn step(many: &mut Associating, k: u64) -> Vec<Track> {
    let mut tracks = Vec::new();
    many.step(&empty(k), &mut tracks).unwrap();
    tracks
}

fn states(tracks: &[Track]) -> Vec<(u64, TrackState)> {
    tracks.iter().map(|t| (t.id.0, t.estimate.as_ref().unwrap().state)).collect()
}

fn estimate(tracks: &[Track], id: u64) -> &Estimate {
    tracks.iter().find(|t| t.id.0 == id).unwrap().estimate.as_ref().unwrap()
}

/// A number in [0, 1).
fn uniform(random: &mut Pcg64Mcg) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Where a walker is at a time in seconds.
type Path = fn(f64) -> Option<(f64, f64)>;

/// Walkers that cross, in front of clutter: each is missed and each frame has false alarms at the rates given.
struct Street {
    walkers: Vec<Path>,
    missed: f64,
    false_alarms: f64,
    jitter_px: f64,
}

impl Street {
    fn truth(&self, k: u64) -> Vec<Option<BBox>> {
        let t = k as f64 / common::FPS;
        self.walkers.iter().map(|w| w(t).map(|(x, y)| at(x, y))).collect()
    }

    fn detections(&self, k: u64, seed: u64) -> Vec<Detection> {
        let mut random = Pcg64Mcg::new(u128::from(seed) << 64 | u128::from(2 * k + 1));
        let mut found = Vec::new();
        for bbox in self.truth(k).into_iter().flatten() {
            let (dx, dy) = (uniform(&mut random) - 0.5, uniform(&mut random) - 0.5);
            if uniform(&mut random) >= self.missed {
                found.push(seen(bbox.translated(2.0 * self.jitter_px * dx, 2.0 * self.jitter_px * dy)));
            }
        }
        while uniform(&mut random) < self.false_alarms {
            found.push(seen(at(320.0 * uniform(&mut random), 200.0 * uniform(&mut random))));
        }
        // A detector has no order to rely on.
        found.sort_by(|a, b| a.bbox.left().total_cmp(&b.bbox.left()));
        found
    }
}

/// How a run went: switches of identity, frames missed of those visible, boxes that are nobody's, ids handed out.
#[derive(Debug, Default, PartialEq)]
struct Score {
    switches: usize,
    missed: usize,
    visible: usize,
    false_tracks: usize,
    ids: usize,
}

fn walk(street: Street, seed: u64, frames: u64, params: AssociationParams) -> Score {
    let street = std::sync::Arc::new(street);
    let script = street.clone();
    let mut many = many(move |k| script.detections(k, seed), params);
    let (mut score, mut last) = (Score::default(), BTreeMap::<usize, u64>::new());
    for k in 0..frames {
        let tracks = step(&mut many, k);
        let alive = || tracks.iter().filter(|t| t.estimate.as_ref().unwrap().state == TrackState::Tracking);
        score.ids = score.ids.max(tracks.iter().map(|t| t.id.0 as usize).max().unwrap_or(0));
        let truth = street.truth(k);
        // As CLEAR MOT matches: what was matched stays so while it overlaps, the rest goes by overlap.
        let overlap = |i: usize, t: &Track| truth[i].map_or(0.0, |b| b.iou(&t.estimate.as_ref().unwrap().bbox));
        let walkers = || (0..truth.len()).filter(|i| truth[*i].is_some());
        let stays =
            |i: &usize| alive().find(|t| Some(&t.id.0) == last.get(i) && overlap(*i, t) > 0.4).map(|t| (*i, t.id.0));
        let mut track_of: BTreeMap<usize, u64> = walkers().filter_map(|i| stays(&i)).collect();
        for track in alive() {
            let best = walkers().max_by(|a, b| overlap(*a, track).total_cmp(&overlap(*b, track)));
            score.false_tracks += usize::from(best.is_none_or(|i| overlap(i, track) < 0.2));
            let free = walkers().filter(|i| !track_of.contains_key(i) && overlap(*i, track) > 0.4);
            let nearest = free.max_by(|a, b| overlap(*a, track).total_cmp(&overlap(*b, track)));
            if let Some(i) = nearest.filter(|_| !track_of.values().any(|id| *id == track.id.0)) {
                track_of.insert(i, track.id.0);
            }
        }
        for walker in (0..truth.len()).filter(|i| truth[*i].is_some()) {
            score.visible += 1;
            match track_of.get(&walker) {
                Some(id) => score.switches += usize::from(last.insert(walker, *id).is_some_and(|was| was != *id)),
                None => score.missed += 1,
            }
        }
    }
    score
}

fn crossing() -> Street {
    Street {
        walkers: vec![
            |t| Some((30.0 + 40.0 * t, 60.0 + 12.0 * t)),
            |t| Some((280.0 - 40.0 * t, 60.0 + 14.0 * t)),
            |t| Some((150.0 + 2.0 * t, 190.0 - 28.0 * t)),
            |t| Some((60.0, 150.0 + 5.0 * t.sin())),
        ],
        missed: 0.0,
        false_alarms: 0.0,
        jitter_px: 0.5,
    }
}

#[test]
fn crossing_targets_keep_their_identities() {
    for seed in 0..5 {
        let score = walk(crossing(), seed, 150, params());
        assert_eq!((score.switches, score.ids, score.false_tracks), (0, 4, 0), "seed {seed}: {score:?}");
        // Four walkers go unreported for the two frames before they are confirmed.
        assert_eq!(score.missed, 8, "seed {seed}: {score:?}");
    }
}

/// Ten runs in which one detection in five is missing and nearly every other frame has a false alarm.
fn hard(params: &AssociationParams) -> Score {
    let mut total = Score::default();
    for seed in 0..10 {
        let street = Street { missed: 0.2, false_alarms: 0.3, jitter_px: 1.5, ..crossing() };
        let score = walk(street, seed, 150, params.clone());
        total.switches += score.switches;
        total.missed += score.missed;
        total.visible += score.visible;
        total.false_tracks += score.false_tracks;
        total.ids += score.ids;
    }
    total
}

#[test]
fn misses_and_false_alarms_are_borne() {
    let total = hard(&params());
    assert_eq!((total.visible, total.switches, total.false_tracks, total.ids), (6000, 0, 0, 40), "{total:?}");
    // Nothing can report what was not detected as measured.
    let missed = total.missed as f64 / total.visible as f64;
    assert!(missed > 0.19 && missed < 0.22, "{total:?}");
    let unmodelled = hard(&with("motion.model = 'none'"));
    assert!(unmodelled.switches > 5, "it is the prediction that tells them apart: {unmodelled:?}");
}

#[test]
fn the_overlap_may_have_a_say() {
    for seed in 0..3 {
        let score = walk(crossing(), seed, 150, with("iou_weight = 4.0"));
        assert_eq!((score.switches, score.ids), (0, 4), "seed {seed}: {score:?}");
    }
}

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
    let mut many_ = many(|_| vec![seen(at(100.0, 100.0))], with("confirm_hits = 1\nconfirm_looks = 1"));
    let tracks = step(&mut many_, 0);
    assert_eq!(estimate(&tracks, 1).score, 0.8);
    assert_eq!((estimate(&tracks, 1).bbox, tracks[0].started), (at(100.0, 100.0), true));
}

#[test]
fn weak_detections_continue_targets_and_start_none() {
    let weak = |k: u64| Detection { bbox: at(100.0, 100.0), confidence: if k < 3 { 0.6 } else { 0.3 } };
    let mut many_ = many(move |k| vec![weak(k), Detection { bbox: at(200.0, 50.0), confidence: 0.4 }], params());
    for k in 0..3 {
        step(&mut many_, k);
    }
    let tracks = step(&mut many_, 3);
    assert_eq!((states(&tracks), estimate(&tracks, 1).score), (vec![(1, TrackState::Tracking)], 0.3));
    assert_eq!(many_.candidates().count(), 0, "0.4 is below birth_from");
    let mut many_ = many(move |k| vec![weak(k)], with("least_confidence = 0.5"));
    (0..3).for_each(|k| drop(step(&mut many_, k)));
    assert_eq!(states(&step(&mut many_, 3)), [(1, TrackState::Occluded)], "0.3 is passed over");
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
fn gap(back: u64) -> impl Fn(u64) -> Vec<Detection> + Send + Sync + Clone {
    move |k| if k < 10 || k >= back { vec![seen(at(60.0 + 2.0 * k as f64, 100.0))] } else { vec![] }
}

#[test]
fn unseen_targets_are_coasted_then_lost_then_given_up() {
    let mut many_ = many(gap(1000), with("dies_after_s = 2.0"));
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
    let mut many_ = many(leaving, with("dies_after_s = 60.0"));
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
fn painted(k: u64) -> pursuit_imaging::Frame {
    frame(k, &[(at(60.0 + 2.0 * k as f64, 100.0), 200)])
}

#[test]
fn appearance_answers_when_no_detection_is_associated() {
    let run = |params: AssociationParams, appearance: bool| {
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
fn users_add_move_and_remove_targets() {
    let mut many = many(|_| vec![], params());
    let mut tracks = Vec::new();
    let id = many.add(&*recipe(), &painted(0), at(60.0, 100.0)).unwrap();
    assert_eq!(id, TargetId(1));
    for k in 1..100 {
        many.step(&painted(k), &mut tracks).unwrap();
        let e = tracks[0].estimate.as_ref().unwrap();
        assert_eq!(e.state, TrackState::Tracking, "frame {k}: its appearance is always trusted");
        assert!(e.bbox.iou(&at(60.0 + 2.0 * k as f64, 100.0)) > 0.7 && !tracks[0].started);
    }
    for k in 100..300 {
        many.step(&empty(k), &mut tracks).unwrap();
    }
    assert_eq!(states(&tracks), [(1, TrackState::Lost)], "what a user pointed at is never given up");
    let beyond = BBox::from_ltwh(900.0, 0.0, 5.0, 5.0);
    assert!(matches!(many.reinit(id, &painted(20), beyond), Err(TrackingError::StartBox { .. })));
    many.reinit(id, &frame_at(300, 12.0, &[(at(200.0, 50.0), 90)]), at(200.0, 50.0)).unwrap();
    many.step(&frame_at(301, 12.04, &[(at(202.0, 50.0), 90)]), &mut tracks).unwrap();
    assert_eq!(states(&tracks), [(1, TrackState::Tracking)]);
    assert!(estimate(&tracks, 1).bbox.iou(&at(202.0, 50.0)) > 0.7);
    assert!(many.add(&*recipe(), &painted(20), beyond).is_err());
    assert!(matches!(
        many.reinit(TargetId(7), &painted(0), at(60.0, 100.0)),
        Err(TrackingError::UnknownTarget { id: 7 })
    ));
    many.remove(id).unwrap();
    assert!(matches!(many.remove(id), Err(TrackingError::UnknownTarget { id: 1 })));
    assert!(many.ids().is_empty());
}

#[test]
fn parameters_change_for_all_targets_at_once() {
    let mut many_ = many(gap(1000), params());
    (0..11).for_each(|k| drop(step(&mut many_, k)));
    many_.change(None, &"policy.lost_after_s = 0.05\nmotion.model = 'constant-acceleration'".parse().unwrap()).unwrap();
    assert_eq!(many_.params().policy.lost_after_s, 0.05);
    assert_eq!(states(&step(&mut many_, 11)), [(1, TrackState::Lost)]);
    assert!(many_.change(None, &"gate = -1".parse().unwrap()).is_err());
    assert!(many_.change(Some(TargetId(1)), &"gate = 1.0".parse().unwrap()).is_err());
    assert!(matches!(
        many_.change(Some(TargetId(8)), &"gate = 1.0".parse().unwrap()),
        Err(TrackingError::UnknownTarget { id: 8 })
    ));
    assert_eq!(many_.params().gate, params().gate);
    assert!(Associating::new(scripted(|_| vec![]), AssociationParams { gate: f64::NAN, ..params() }).is_err());
}

#[test]
fn forecasts_go_on_with_the_motion() {
    let mut many = many(gap(1000), params());
    (0..10).for_each(|k| drop(step(&mut many, k)));
    let forecast = many.forecast(TargetId(1), 0.4).unwrap();
    assert!((forecast.bbox.center().x - 98.0).abs() < 4.0, "{forecast:?}");
    assert!((forecast.time_s - (9.0 / common::FPS + 0.4)).abs() < 1e-9);
    assert!(many.forecast(TargetId(2), 0.4).is_err());
}

#[test]
fn threads_and_saving_change_nothing() {
    let street = || Street { missed: 0.3, false_alarms: 0.4, jitter_px: 1.5, ..crossing() };
    let script = || {
        let street = street();
        move |k| street.detections(k, 3)
    };
    let film = |k: u64| {
        let truth = street().truth(k);
        frame(k, &truth.iter().flatten().enumerate().map(|(i, b)| (*b, 60 + 40 * i as u8)).collect::<Vec<_>>())
    };
    let run = |threads: usize, save_at: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut many = many(script(), params()).with_appearance(recipe());
            let mut said = Vec::new();
            for k in 0..40 {
                if k == save_at {
                    let saved = many.save().unwrap();
                    many = Associating::restore(&saved, scripted(script()), &recipe_of).unwrap();
                }
                let mut tracks = Vec::new();
                many.step(&film(k), &mut tracks).unwrap();
                said.extend(tracks.into_iter().map(|t| (k, t.id, t.started, t.estimate)));
            }
            said
        })
    };
    let plain = run(1, 1000);
    assert!(plain.len() > 100);
    assert_eq!(plain, run(3, 1000));
    assert_eq!(plain, run(1, 17));

    let mut many = many(script(), params()).with_appearance(recipe());
    (0..20).for_each(|k| many.step(&film(k), &mut Vec::new()).unwrap());
    let saved = many.save().unwrap();
    let restore = |bytes: &[u8]| Associating::restore(bytes, scripted(script()), &recipe_of);
    assert!(restore(&saved[..saved.len() - 3]).is_err() && restore(&[]).is_err());
    assert_eq!(restore(&saved).unwrap().ids(), many.ids());
}

#[test]
fn what_no_box_can_be_is_passed_over() {
    let odd = |_| {
        let bad = [
            BBox::from_ltwh(f64::NAN, 0.0, 5.0, 5.0),
            BBox::from_ltwh(10.0, 10.0, 0.0, 5.0),
            BBox::from_ltwh(1e9, 0.0, 5.0, 5.0),
            BBox::from_ltwh(0.0, 0.0, f64::INFINITY, 5.0),
        ];
        let mut found: Vec<Detection> = bad.map(seen).into();
        found.push(Detection { bbox: at(50.0, 50.0), confidence: f64::NAN });
        found.push(Detection { bbox: at(50.0, 50.0), confidence: 1.5 });
        found
    };
    let mut many = many(odd, params());
    (0..5).for_each(|k| assert!(step(&mut many, k).is_empty()));
    assert_eq!(many.candidates().count(), 0);
}

#[test]
fn frames_of_another_size_are_refused_and_time_may_stand_still() {
    let mut many = many(|_| vec![seen(at(100.0, 100.0))], params());
    (0..5).for_each(|k| drop(step(&mut many, k)));
    let mut tracks = Vec::new();
    many.step(&frame_at(5, 0.0, &[]), &mut tracks).unwrap();
    many.step(&frame_at(6, f64::NAN, &[]), &mut tracks).unwrap();
    assert_eq!(states(&tracks), [(1, TrackState::Tracking)]);
    let small = pursuit_imaging::Image::filled(10, 10, 0u8).unwrap();
    let other = pursuit_imaging::Frame::new(7, 0.3, pursuit_imaging::Pixels::Gray8(small.into()));
    assert!(matches!(many.step(&other, &mut tracks), Err(TrackingError::FrameSize { index: 7, .. })));
}

#[test]
fn an_error_of_the_detector_ends_the_step() {
    struct Blind;
    impl pursuit_tracking::Detector for Blind {
        fn detect(
            &mut self,
            frame: &pursuit_imaging::Frame,
            _: &[pursuit_tracking::Followed],
        ) -> pursuit_tracking::Result<Vec<Detection>> {
            Err(TrackingError::MissingPlane { tracker: "blind".into(), needed: "colour", index: frame.index() })
        }
    }
    let mut many = Associating::new(Box::new(Blind), params()).unwrap();
    assert!(matches!(many.step(&empty(3), &mut Vec::new()), Err(TrackingError::MissingPlane { index: 3, .. })));
}
