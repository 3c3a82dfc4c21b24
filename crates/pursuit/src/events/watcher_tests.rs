#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::events::EventOptions;
use pursuit_tracking::Estimate;

const ZONE: &str = "zones = ['door=100,0,200,0,200,200,100,200']\n";
const FPS: f64 = 25.0;

/// What a target does at a time: its left edge and whether it is seen; `None` while there is no such target.
type Doing = Option<(f64, TrackState)>;

/// The events of one target of ten pixels, as words with their times, and the last look.
fn story(options: &str, seconds: f64, doing: impl Fn(f64) -> Doing) -> (Vec<(String, f64)>, Watcher) {
    let rules = toml::from_str::<EventOptions>(options).unwrap().rules().unwrap();
    let (mut watcher, mut told) = (Watcher::new(rules, None), Vec::new());
    for frame in 0..(seconds * FPS) as u64 {
        let time_s = frame as f64 / FPS;
        let record = |(x, state)| Record {
            frame,
            time_s,
            target: TargetId(1),
            class: Some("person".into()),
            estimate: Some(Estimate {
                state,
                ..Estimate::started(time_s, BBox::from_ltwh(x - 5.0, 90.0, 10.0, 20.0), 1.0)
            }),
            update_ms: None,
        };
        let records: Vec<Record> = doing(time_s).map(record).into_iter().collect();
        watcher.look(frame, time_s, &records).unwrap();
        for event in &watcher.watched().events {
            let reason = event.reason.map(|r| format!(" {}", r.as_str())).unwrap_or_default();
            told.push((format!("{}{reason}", event.kind.as_str()), time_s));
        }
    }
    (told, watcher)
}

fn words(told: &[(String, f64)]) -> Vec<&str> {
    told.iter().map(|(word, _)| word.as_str()).collect()
}

const SEEN: TrackState = TrackState::Tracking;

#[test]
fn who_walks_through_enters_dwells_and_leaves() {
    // 20 px/s: in the zone from 5 s to 10 s.
    let options = format!("{ZONE}dwell_s = 3.0\nmargin = 0.0");
    let (told, watcher) = story(&options, 15.0, |t| (t < 14.0).then_some((20.0 * t, SEEN)));
    assert_eq!(words(&told), ["appear", "enter", "dwell", "leave left", "gone"]);
    for ((_, time_s), wanted) in told.iter().zip([0.52, 5.52, 8.0, 10.96, 14.0]) {
        assert!((time_s - wanted).abs() < 0.05, "{told:?}");
    }
    assert!(watcher.watched().occupancies.iter().all(|o| o.present.is_empty() && o.unseen.is_empty()));
}

#[test]
fn a_box_that_shakes_on_the_edge_does_not_flap() {
    let shaking = |t: f64| Some((100.0 + 0.9 * (40.0 * t).sin(), SEEN));
    let (told, _) = story(ZONE, 60.0, shaking);
    assert!(told.len() <= 2, "{told:?}");
    // Once inside, it must be out by a margin of its size.
    let (told, _) = story(ZONE, 60.0, |t| Some((if t < 2.0 { 105.0 } else { 99.8 + 0.7 * (0.5 * t).sin() }, SEEN)));
    assert_eq!(words(&told), ["appear", "enter", "dwell"]);
}

#[test]
fn who_is_not_seen_does_not_count_and_is_told() {
    for state in [TrackState::Occluded, TrackState::Lost] {
        let doing = |t: f64| Some((150.0, if (3.0..8.0).contains(&t) { state } else { SEEN }));
        let (told, watcher) = story(ZONE, 7.0, doing);
        assert_eq!(words(&told), ["appear", "enter", "leave unseen", "lost"]);
        assert!((told[2].1 - 5.0).abs() < 0.05);
        for occupancy in &watcher.watched().occupancies {
            assert_eq!((occupancy.present.len(), occupancy.unseen.as_slice()), (0, [TargetId(1)].as_slice()));
        }
        let (told, watcher) = story(ZONE, 10.0, doing);
        assert_eq!(words(&told)[4..], ["found", "enter"]);
        assert_eq!(watcher.watched().occupancies[1].present, [(TargetId(1), Some("person".into()))]);
    }
}

#[test]
fn who_is_hidden_for_a_moment_stays() {
    let hidden = |t: f64| Some((150.0, if (3.0..4.5).contains(&t) { TrackState::Occluded } else { SEEN }));
    assert_eq!(words(&story(ZONE, 8.0, hidden).0), ["appear", "enter"]);
}

#[test]
fn who_is_given_up_inside_has_left_and_who_was_hardly_seen_was_never_there() {
    let (told, _) = story(ZONE, 8.0, |t| (t < 5.0).then_some((150.0, SEEN)));
    assert_eq!(words(&told), ["appear", "enter", "leave gone", "gone"]);
    let (told, watcher) = story(ZONE, 8.0, |t| (t < 0.3).then_some((150.0, SEEN)));
    assert!(told.is_empty() && watcher.targets.is_empty(), "{told:?}");
}

#[test]
fn a_gap_of_the_stream_is_time_in_which_nobody_was_seen() {
    let rules = toml::from_str::<EventOptions>(ZONE).unwrap().rules().unwrap();
    let mut watcher = Watcher::new(rules, None);
    let look = |watcher: &mut Watcher, frame: u64, time_s: f64, state| {
        let estimate = Estimate { state, ..Estimate::started(time_s, BBox::from_ltwh(150.0, 90.0, 10.0, 20.0), 1.0) };
        let record =
            Record { frame, time_s, target: TargetId(1), class: None, estimate: Some(estimate), update_ms: None };
        watcher.look(frame, time_s, &[record]).unwrap();
        watcher.watched().events.iter().map(|e| e.kind).collect::<Vec<_>>()
    };
    for frame in 0..50 {
        look(&mut watcher, frame, frame as f64 * 0.04, SEEN);
    }
    let lost = look(&mut watcher, 50, 60.0, TrackState::Lost);
    assert_eq!(lost, [Kind::Leave, Kind::Lost]);
}
