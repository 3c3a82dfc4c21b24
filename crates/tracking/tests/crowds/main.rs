//! Crowds, hostile boxes and long runs: time and memory stay bounded, and nobody is lost.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod crowd;

use crowd::Crowd;
use pursuit_geometry::BBox;
use pursuit_parameters::Parameters;
use pursuit_testkit::SplitMix;
use pursuit_tracking::many::{Associating, AssociationModel, ManyParams};
use pursuit_tracking::{Detection, MultiTracker, Track, TrackState, TrackingError};
use std::collections::BTreeMap;

fn params(changes: &str) -> ManyParams {
    ManyParams::default().with("many", &changes.parse().unwrap()).unwrap()
}

fn by(model: AssociationModel, changes: &str) -> Associating {
    Associating::fed(params(&format!("association.model = '{}'\n{changes}", model.as_str()))).unwrap()
}

/// What must hold of any answer: ids ascend, no detection is of two targets for certain, each is one that there was.
fn check(tracks: &[Track], detections: &[Detection], shares: bool) {
    assert!(tracks.windows(2).all(|w| w[0].id < w[1].id));
    let mut taken = vec![false; detections.len()];
    for track in tracks {
        let estimate = track.estimate.as_ref().unwrap();
        assert!(estimate.bbox.is_finite() && (0.0..=1.0).contains(&estimate.score), "{estimate:?}");
        if let Some(detection) = track.detection {
            assert!(shares || !std::mem::replace(&mut taken[detection], true), "{detection} is of two");
        }
    }
}

/// Walkers far apart, who go to the right.
fn apart(walkers: usize, frame: u64) -> Vec<Detection> {
    let one = |k: usize| {
        let (x, y) = ((k % 70) as f64 * 120.0, (k / 70) as f64 * 150.0);
        Detection::new(BBox::from_ltwh(100.0 + x + 1.5 * frame as f64, 50.0 + y, 30.0, 75.0), 0.9)
    };
    (0..walkers).map(one).collect()
}

#[test]
fn nothing_is_allocated_once_everybody_is_known() {
    for model in AssociationModel::ALL.iter().copied() {
        let mut many = by(model, "");
        let frames: Vec<Vec<Detection>> = (0..60).map(|k| apart(100, k)).collect();
        let mut go = |from: usize, to: usize| {
            for k in from..to {
                let tracks = many.update(k as f64 / 25.0, None, &frames[k]).unwrap();
                assert!(k < 20 || tracks.len() == 100);
            }
        };
        go(0, 30);
        let info = allocation_counter::measure(|| go(30, 60));
        assert_eq!(info.count_total, 0, "{model:?}: {info:?}");
    }
}

#[test]
fn five_thousand_keep_their_ids() {
    for model in [AssociationModel::Nearest, AssociationModel::Joint, AssociationModel::Hypotheses] {
        let mut many = by(model, "");
        for k in 0..12 {
            let found = apart(5000, k);
            let tracks = many.update(k as f64 / 25.0, None, &found).unwrap();
            check(tracks, &found, false);
            if k > 8 {
                assert_eq!(tracks.len(), 5000, "{model:?}, frame {k}");
                assert!(tracks.iter().all(|t| t.detection == Some(t.id.0 as usize - 1)), "{model:?}, frame {k}");
            }
        }
        assert_eq!(many.last_id(), 5000);
    }
}

/// Boxes that are not where anybody walks, from a seed: none, alike, on top of each other, of no and of enormous size.
fn hostile(numbers: &mut SplitMix, many: usize) -> Vec<Detection> {
    let kind = numbers.below(6);
    let one = |k: usize| {
        let (x, y) = (-5000.0 + 3.0 * k as f64, -900.0 + 10.0 * numbers.unit());
        let bbox = match kind {
            0 => BBox::from_ltwh(-4000.0, -800.0, 30.0, 75.0),
            1 => BBox::from_ltwh(x, y, 0.0, 75.0),
            2 => BBox::from_ltwh(-9e8, -9e8, 1e8 * numbers.unit(), 8e8),
            3 => BBox::from_ltwh(x, y, 30.0 * numbers.unit() + 1e-9, 1e-9),
            4 => BBox::from_ltwh(x, y, -5.0, -8.0),
            _ => BBox::from_ltwh(x, y, 30.0 + numbers.unit(), 75.0),
        };
        Detection::new(bbox, numbers.unit())
    };
    (0..many).map(one).collect()
}

#[test]
fn hostile_boxes_change_nobody_else() {
    for model in AssociationModel::ALL.iter().copied() {
        let mut many = by(model, "");
        let mut numbers = SplitMix(9);
        for k in 0..60 {
            let mut found = apart(30, k);
            if k > 15 {
                found.extend(hostile(&mut numbers, 60));
            }
            let time_s = k as f64 / 25.0;
            let before = many.save().unwrap();
            for bad in [f64::NAN, f64::INFINITY, -1e300] {
                let mut refused = found.clone();
                refused.push(Detection::new(BBox::from_ltwh(bad, 0.0, 30.0, 75.0), 0.9));
                let answer = many.update(time_s, None, &refused);
                assert!(matches!(answer, Err(TrackingError::Detection { .. })), "{model:?}: {bad}");
            }
            assert_eq!(many.save().unwrap(), before, "{model:?}: what is refused changes nothing");
            let tracks = many.update(time_s, None, &found).unwrap();
            check(tracks, &found, model == AssociationModel::Joint);
            if k > 12 {
                let walkers = tracks.iter().filter(|t| t.id.0 <= 30).collect::<Vec<_>>();
                assert_eq!(walkers.len(), 30, "{model:?}, frame {k}");
                assert!(walkers.iter().all(|t| t.detection == Some(t.id.0 as usize - 1)), "{model:?}, frame {k}");
            }
        }
    }
}

/// Boxes of which each overlaps dozens of others, all in one cluster, and each a target.
#[test]
fn one_cluster_of_hundreds_ends() {
    for model in AssociationModel::ALL.iter().copied() {
        let mut many = by(model, "birth.crowding = 1.0\nbirth.model = 'immediate'");
        for k in 0..5 {
            let mut numbers = SplitMix(100 + k);
            let place = |nth: usize, numbers: &mut SplitMix| {
                let (x, y) = ((nth % 20) as f64 * 10.0, (nth / 20) as f64 * 25.0);
                BBox::from_ltwh(x + numbers.unit(), y + numbers.unit(), 30.0, 75.0)
            };
            let found: Vec<_> = (0..400).map(|nth| Detection::new(place(nth, &mut numbers), 0.9)).collect();
            let tracks = many.update(k as f64 / 25.0, None, &found).unwrap();
            check(tracks, &found, model == AssociationModel::Joint);
            assert!(tracks.len() >= 400, "{model:?}: {}", tracks.len());
        }
    }
}

/// Goes through a small crowd for long; what is kept does not grow.
fn long(model: AssociationModel, frames: u64) {
    let crowd = Crowd { missed: 0.15, false_alarms: 0.2, ..Crowd::of(6) };
    let mut many = by(model, "");
    let (mut most, mut seen) = (0, 0);
    for k in 0..frames {
        let found = crowd.detections(k);
        let tracks = many.update(Crowd::time_s(k), Some(crowd.size), &found).unwrap();
        check(tracks, &found, model == AssociationModel::Joint);
        seen += tracks.iter().filter(|t| t.estimate.as_ref().unwrap().state == TrackState::Tracking).count();
        assert!(tracks.len() <= 40, "{model:?}, frame {k}: {}", tracks.len());
        if k == 500 {
            most = 4 * many.save().unwrap().len();
        }
    }
    let kept = many.save().unwrap().len();
    assert!(kept <= most.max(200_000), "{model:?}: {kept} bytes, {most} at most");
    assert!(seen as f64 > 0.6 * 6.0 * frames as f64, "{model:?}: {seen} of {}", 6 * frames);
}

#[test]
fn long_runs_keep_no_more() {
    AssociationModel::ALL.iter().for_each(|model| long(*model, 1500));
}

#[test]
#[ignore = "release: a million frames"]
fn a_million_frames_keep_no_more() {
    long(AssociationModel::Nearest, 1_000_000);
    [AssociationModel::Joint, AssociationModel::Hypotheses].into_iter().for_each(|model| long(model, 100_000));
}

#[test]
fn a_crowd_goes_on_from_what_was_saved() {
    for model in AssociationModel::ALL.iter().copied() {
        let crowd = Crowd { missed: 0.1, false_alarms: 0.1, ..Crowd::of(40) };
        let mut many = by(model, "");
        let said = |many: &mut Associating, k: u64| {
            let tracks = many.update(Crowd::time_s(k), Some(crowd.size), &crowd.detections(k)).unwrap();
            tracks.iter().map(|t| (t.id, t.detection, t.estimate.clone())).collect::<Vec<_>>()
        };
        for k in 0..40 {
            said(&mut many, k);
        }
        let saved = many.save().unwrap();
        let none = |name: &str| Err(TrackingError::UnknownTarget { id: name.len() as u64 });
        let mut again = Associating::restore_fed(&saved, &none).unwrap();
        assert_eq!(again.save().unwrap(), saved, "{model:?}");
        for k in 40..60 {
            assert_eq!(said(&mut again, k), said(&mut many, k), "{model:?}, frame {k}");
        }
    }
}

/// How often a walker's id changes in a crowd.
fn switches(model: AssociationModel) -> usize {
    let crowd = Crowd { missed: 0.15, false_alarms: 0.1, ..Crowd::of(40) };
    let mut many = by(model, "");
    let (mut last, mut switches) = (BTreeMap::new(), 0);
    for k in 0..250 {
        let found = crowd.detections(k);
        for track in many.update(Crowd::time_s(k), Some(crowd.size), &found).unwrap() {
            let Some(detection) = track.detection else { continue };
            let own = |walker: &usize| crowd.place(*walker, k).iou(&found[detection].bbox);
            let walker = (0..crowd.walkers).max_by(|a, b| own(a).total_cmp(&own(b))).unwrap();
            if own(&walker) > 0.5 {
                switches += usize::from(last.insert(walker, track.id).is_some_and(|before| before != track.id));
            }
        }
    }
    switches
}

#[test]
fn hypotheses_switch_no_more_than_the_nearest_do() {
    let (nearest, hypotheses) = (switches(AssociationModel::Nearest), switches(AssociationModel::Hypotheses));
    assert!(hypotheses <= nearest + nearest / 10, "{hypotheses}, {nearest} by the nearest");
}
