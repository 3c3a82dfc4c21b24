//! What users change, and what is refused.

use super::*;
use crate::lives::{gap, painted};
use crate::street::{Street, crossing};

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
    assert!(many_.change(None, &"association.gate = -1".parse().unwrap()).is_err());
    assert!(many_.change(Some(TargetId(1)), &"association.gate = 1.0".parse().unwrap()).is_err());
    assert!(matches!(
        many_.change(Some(TargetId(8)), &"association.gate = 1.0".parse().unwrap()),
        Err(TrackingError::UnknownTarget { id: 8 })
    ));
    assert_eq!(many_.params().association.gate, params().association.gate);
    let mut bad = params();
    bad.association.gate = f64::NAN;
    assert!(Associating::new(scripted(|_| vec![]), bad).is_err());
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
        found.push(Detection::new(at(50.0, 50.0), f64::NAN));
        found.push(Detection::new(at(50.0, 50.0), 1.5));
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
