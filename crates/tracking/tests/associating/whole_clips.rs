//! Whole clips at once.

use super::*;
use pursuit_tracking::many::{Looked, OfflineParams, offline};

fn clip(seen: impl Fn(usize) -> bool) -> Vec<Looked> {
    let look = |k: usize| {
        let walker = Detection::new(at(40.0 + 3.0 * k as f64, 80.0), 0.9);
        Looked { time_s: k as f64 / 10.0, detections: if seen(k) { vec![walker] } else { vec![] } }
    };
    (0..40).map(look).collect()
}

#[test]
fn births_are_back_dated_and_gaps_filled() {
    let frames = clip(|k| (5..30).contains(&k) && !(15..18).contains(&k));
    let placed = offline(ManyParams::default(), &OfflineParams::default(), None, &frames).unwrap();
    for (k, frame) in placed.iter().enumerate() {
        if !(5..30).contains(&k) {
            assert!(frame.is_empty(), "frame {k}");
            continue;
        }
        let [one] = frame.as_slice() else { panic!("frame {k}: {frame:?}") };
        assert_eq!((one.id, one.detection), (TargetId(1), (!(15..18).contains(&k)).then_some(0)), "frame {k}");
        assert!(one.bbox.iou(&at(40.0 + 3.0 * k as f64, 80.0)) > 0.99, "frame {k}: {one:?}");
    }
    let apart = OfflineParams { gap_s: 0.2, ..OfflineParams::default() };
    let placed = offline(ManyParams::default(), &apart, None, &frames).unwrap();
    assert!(placed[15..18].iter().all(Vec::is_empty), "the gap is longer");
}

#[test]
fn what_was_seen_too_seldom_is_none() {
    let placed = |shortest| {
        let params = OfflineParams { shortest, ..OfflineParams::default() };
        offline(ManyParams::default(), &params, None, &clip(|k| k < 12)).unwrap()
    };
    assert_eq!(placed(12)[0].len(), 1);
    assert!(placed(13).iter().all(Vec::is_empty));
    let none = OfflineParams { gap_s: f64::NAN, ..OfflineParams::default() };
    assert!(offline(ManyParams::default(), &none, None, &[]).is_err());
}
