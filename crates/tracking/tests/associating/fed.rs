//! Detections from outside, without pixels.

use super::*;
use pursuit_geometry::Size;

const PICTURE: Option<Size> = Some(Size::new(640, 480));

fn fed() -> Associating {
    Associating::fed(ManyParams::default()).unwrap()
}

/// A walker and something unsure before it.
fn walker(k: u64) -> [Detection; 2] {
    let sure = Detection { class: Some("person".into()), ..Detection::new(at(50.0 + 2.0 * k as f64, 100.0), 0.95) };
    [Detection::new(at(300.0, 20.0), 0.05), sure]
}

#[test]
fn tracks_name_the_detection_they_were_given() {
    let mut many = fed();
    for k in 0..20 {
        let tracks = many.update(k as f64 / 10.0, PICTURE, &walker(k)).unwrap();
        if k > 4 {
            assert_eq!((tracks.len(), tracks[0].detection), (1, Some(1)), "what is passed over counts too");
            assert_eq!(tracks[0].estimate.as_ref().unwrap().bbox, walker(k)[1].bbox, "the measured box");
            assert_eq!(tracks[0].class.as_ref().map(Class::as_str), Some("person"));
        }
    }
    let tracks = many.update(2.0, PICTURE, &[]).unwrap();
    assert_eq!((tracks[0].detection, tracks[0].estimate.as_ref().unwrap().state), (None, TrackState::Occluded));
}

#[test]
fn what_cannot_be_is_refused_and_nothing_changes() {
    let mut many = fed();
    for k in 0..10 {
        many.update(k as f64 / 10.0, PICTURE, &walker(k)).unwrap();
    }
    let before = many.save().unwrap();
    let bad = |bbox, confidence| [Detection::new(bbox, confidence)];
    for found in [
        bad(BBox::from_ltwh(f64::NAN, 0.0, 5.0, 5.0), 0.5),
        bad(BBox::from_ltwh(0.0, 0.0, f64::INFINITY, 5.0), 0.5),
        bad(BBox::from_ltwh(0.0, 0.0, 1e300, 5.0), 0.5),
        bad(at(0.0, 0.0), f64::NAN),
        bad(at(0.0, 0.0), 1.5),
    ] {
        let refused = many.update(1.0, PICTURE, &found);
        assert!(matches!(refused, Err(TrackingError::Detection { at: 0, index: 10, .. })), "{found:?}");
    }
    for time_s in [0.5, f64::NAN] {
        assert!(matches!(many.update(time_s, PICTURE, &[]), Err(TrackingError::Time { .. })));
    }
    let other = Some(Size::new(10, 10));
    assert!(matches!(many.update(1.0, other, &[]), Err(TrackingError::FrameSize { .. })));
    assert_eq!(many.save().unwrap(), before);
    let mut again = Associating::restore_fed(&before, &recipe_of).unwrap();
    let said = |many: &mut Associating| {
        let tracks = many.update(1.0, PICTURE, &walker(10)).unwrap();
        tracks.iter().map(|t| (t.id, t.detection, t.estimate.clone())).collect::<Vec<_>>()
    };
    assert_eq!(said(&mut again), said(&mut many));
}

#[test]
fn boxes_without_area_or_all_alike_are_borne() {
    let mut many = fed();
    for k in 0..30 {
        let mut found = vec![Detection::new(at(100.0, 100.0), 0.9); 60];
        found.push(Detection::new(BBox::from_ltwh(5.0, 5.0, 0.0, 7.0), 0.9));
        assert!(many.update(k as f64 / 10.0, None, &found).unwrap().len() <= 60);
    }
    assert!(many.last_id() >= 1);
}

/// A target is seen until second 1; from second 2 another is seen beside it. How many ids there are then.
fn newcomer(fps: f64, beside_px: f64) -> u64 {
    let mut many = fed();
    let frames = (4.0 * fps) as u64;
    for k in 0..frames {
        let t = k as f64 / fps;
        let first = (t < 1.0).then(|| Detection::new(at(100.0, 100.0), 0.97));
        let other = (t >= 2.0).then(|| Detection::new(at(100.0 + beside_px, 100.0), 0.97));
        many.update(t, PICTURE, &Vec::from_iter(first.into_iter().chain(other))).unwrap();
    }
    many.last_id()
}

#[test]
fn newcomers_beside_a_lost_target_are_others() {
    for fps in [7.0, 10.0, 25.0] {
        let size = at(0.0, 0.0).area().sqrt();
        assert_eq!(newcomer(fps, 2.0 * size), 2, "{fps} frames/s");
        assert_eq!(newcomer(fps, 0.1 * size), 1, "in its place it is itself, {fps} frames/s");
    }
}
