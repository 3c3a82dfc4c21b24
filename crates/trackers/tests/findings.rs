//! A localizer learns from the look that the loop decided on, though it looked elsewhere since.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_trackers::ball::BallParams;
use pursuit_trackers::person::PersonParams;
use pursuit_trackers::pursuit::PursuitParams;
use pursuit_trackers::tld::TldParams;
use pursuit_tracking::{Localizer, LocalizerRecipe, Look, Search};

/// A yellow disc with stripes of its own before others, slow and grey; it grows brighter.
fn frame(k: u64, target: BBox) -> Frame {
    let image = Image::from_fn(320, 240, |x, y| {
        let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
        let (u, v) = ((x - target.center().x) / target.width(), (y - target.center().y) / target.height());
        if u * u + v * v < 0.25 {
            let shade = 8 * k as i16 + (20.0 * (14.0 * u + 9.0 * v).sin()) as i16;
            return [(225 + shade) as u8, (185 + shade) as u8, 40];
        }
        [(110.0 + 25.0 * (0.11 * x + 0.05 * y).sin() + 20.0 * (0.13 * y - 0.04 * x).cos()) as u8; 3]
    });
    Frame::new(k, k as f64 / 25.0, image.unwrap())
}

fn search(expected: BBox) -> Search {
    Search { expected, region: expected.scaled(2.5), gate: None, look: Look::Near, keep_inside: false }
}

/// What is learned of a target that moved a little, after a look elsewhere or without one.
fn learned<P: LocalizerRecipe>(params: &P, elsewhere: bool) -> (Vec<u8>, Vec<u8>) {
    let (first, moved) = (BBox::from_ltwh(60.0, 70.0, 44.0, 44.0), BBox::from_ltwh(64.0, 73.0, 44.0, 44.0));
    let mut localizer = params.localizer(&frame(0, first), first).unwrap();
    let frame = frame(1, moved);
    let before = postcard::to_stdvec(&localizer).unwrap();
    let (measurement, finding) = localizer.locate(&frame, &search(first)).unwrap().unwrap();
    if elsewhere {
        localizer.locate(&frame, &search(BBox::from_ltwh(220.0, 150.0, 44.0, 44.0))).unwrap();
    }
    localizer.adapt(&frame, measurement.bbox, &finding).unwrap();
    (before, postcard::to_stdvec(&localizer).unwrap())
}

fn check<P: LocalizerRecipe>(params: &P) {
    let ((before, once), (_, again)) = (learned(params, false), learned(params, true));
    assert!(before != once, "nothing was learned");
    assert!(once == again, "another look changed what was learned");
}

#[test]
fn the_ball_is_learned_where_it_was_found() {
    check(&BallParams::default());
}

#[test]
fn the_detector_learns_from_its_own_scan() {
    check(&TldParams::default());
}

#[test]
fn witnesses_learn_what_both_believed() {
    check(&PursuitParams::default());
}

#[test]
fn a_person_is_learned_where_found() {
    check(&PersonParams::default());
}
