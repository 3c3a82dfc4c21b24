//! What `point` is for: where a spot of a surface is to a fraction of a pixel, while it turns, grows and is lit otherwise, and that it is
//! hidden when it is.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_testkit::{lattice, value_noise};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, TrackState, Tracker};

/// A surface that turns by `turn` radians and grows by `growth` a frame about the middle of the picture while it moves, is lit by `light` of
/// a frame more, and has something pass before it.
#[derive(Clone, Copy, Default)]
struct Surface {
    turn: f64,
    growth: f64,
    light: f64,
    hidden: Option<(u64, u64)>,
}

const MIDDLE: Point = Point::new(160.0, 120.0);
const SPOT: Point = Point::new(143.3, 101.6);

impl Surface {
    fn turned(self, k: u64) -> (f64, f64, f64) {
        let (angle, scale) = (self.turn * k as f64, (1.0 + self.growth).powi(k as i32));
        (scale * angle.cos(), scale * angle.sin(), 0.9 * k as f64)
    }

    /// Where a point of frame 0 is.
    fn at(self, point: Point, k: u64) -> Point {
        let (c, s, moved) = self.turned(k);
        let (x, y) = (point.x - MIDDLE.x, point.y - MIDDLE.y);
        Point::new(MIDDLE.x + c * x - s * y + moved, MIDDLE.y + s * x + c * y)
    }

    fn frame(self, k: u64) -> Frame {
        let (c, s, moved) = self.turned(k);
        let square = c * c + s * s;
        let covered = self.hidden.is_some_and(|(from, to)| (from..to).contains(&k));
        let spot = self.at(SPOT, k);
        let image = Image::from_fn(320, 240, |x, y| {
            let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
            if covered && (x - spot.x).abs() < 45.0 {
                return (60.0 + 140.0 * value_noise((x, y), 5.0, |t| t, |i, j| lattice(i, j, 77))) as u8;
            }
            let (u, v) = (x - MIDDLE.x - moved, y - MIDDLE.y);
            let place = (MIDDLE.x + (c * u + s * v) / square, MIDDLE.y + (c * v - s * u) / square);
            let coarse = value_noise(place, 14.0, |t| t * t * (3.0 - 2.0 * t), |i, j| lattice(i, j, 5));
            let fine = value_noise(place, 5.0, |t| t * t * (3.0 - 2.0 * t), |i, j| lattice(i, j, 6));
            ((40.0 + 110.0 * coarse + 50.0 * fine) * (1.0 + self.light * k as f64)).clamp(0.0, 255.0) as u8
        });
        Frame::new(k, k as f64 / 30.0, image.unwrap())
    }

    fn tracker(self, spot: Point, side: f64) -> Box<dyn Tracker> {
        let recipe = registry::tracker("point").unwrap().recipe(&toml::Table::new()).unwrap();
        recipe.init(&self.frame(0), BBox::from_center_size(spot, side, side)).unwrap()
    }

    fn follow(self, frames: u64) -> Vec<Estimate> {
        let mut tracker = self.tracker(SPOT, 31.0);
        (1..frames).map(|k| tracker.update(&self.frame(k)).unwrap()).collect()
    }

    fn error(self, k: u64, estimate: &Estimate) -> f64 {
        estimate.bbox.center().distance(self.at(SPOT, k))
    }
}

#[test]
fn a_spot_is_followed_to_a_fraction_of_a_pixel() {
    for (surface, most) in [
        (Surface::default(), 0.1),
        (Surface { turn: 0.012, ..Surface::default() }, 0.25),
        (Surface { growth: 0.006, ..Surface::default() }, 0.25),
        (Surface { turn: -0.008, growth: -0.004, light: -0.006, hidden: None }, 0.25),
    ] {
        for (k, estimate) in (1..).zip(surface.follow(60)) {
            let error = surface.error(k, &estimate);
            assert!(estimate.state == TrackState::Tracking && error < most, "{k}: {error} {estimate:?}");
            assert_eq!((estimate.bbox.width(), estimate.bbox.height()), (31.0, 31.0), "a point does not grow");
        }
    }
}

#[test]
fn a_spot_that_is_covered_is_not_told_and_is_found_again() {
    let surface = Surface { turn: 0.004, hidden: Some((20, 40)), ..Surface::default() };
    let told = surface.follow(70);
    for (k, estimate) in (1..).zip(&told) {
        let tracking = estimate.state == TrackState::Tracking;
        match k {
            ..20 => assert!(tracking, "{k}: {estimate:?}"),
            20..40 => assert!(!tracking, "{k}: something else is there: {estimate:?}"),
            45.. => assert!(tracking && surface.error(k, estimate) < 0.5, "{k}: {estimate:?}"),
            _ => {}
        }
    }
}

#[test]
fn a_spot_that_left_the_picture_is_not_told() {
    let surface = Surface::default();
    let mut tracker = surface.tracker(Point::new(296.0, 70.0), 31.0);
    for k in 1..70 {
        let estimate = tracker.update(&surface.frame(k)).unwrap();
        let there = 296.0 + 0.9 * k as f64;
        assert!(there < 322.0 || estimate.state != TrackState::Tracking, "{k}: {estimate:?}");
        assert!(there > 300.0 || estimate.state == TrackState::Tracking, "{k}: {estimate:?}");
    }
}

#[test]
fn plain_ground_is_no_spot() {
    let plain = |k: u64| Frame::new(k, k as f64 / 30.0, Image::from_fn(160, 120, |_, _| 90u8).unwrap());
    let recipe = registry::tracker("point").unwrap().recipe(&toml::Table::new()).unwrap();
    let mut tracker = recipe.init(&plain(0), BBox::from_ltwh(60.0, 40.0, 31.0, 31.0)).unwrap();
    for k in 1..20 {
        assert_ne!(tracker.update(&plain(k)).unwrap().state, TrackState::Tracking, "{k}");
    }
}

#[test]
fn a_warm_tracker_allocates_nothing() {
    let surface = Surface { hidden: Some((30, 50)), ..Surface::default() };
    let mut tracker = surface.tracker(SPOT, 31.0);
    let frames: Vec<Frame> = (0..70).map(|k| surface.frame(k)).collect();
    frames.iter().for_each(|frame| {
        frame.gray();
    });
    frames[1..45].iter().for_each(|frame| assert!(tracker.update(frame).is_ok()));
    let used = allocation_counter::measure(|| {
        frames[45..].iter().for_each(|frame| assert!(tracker.update(frame).is_ok()));
    });
    assert_eq!(used.count_total, 0, "{used:?}");
}
