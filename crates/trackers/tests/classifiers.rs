//! What `struck`, `dlssvm`, `mil`, `boosting` and `online-forest` are for: a target of another texture than what is around it, which blurs, darkens
//! and is covered in part; and no allocation.
#![cfg(feature = "zoo")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_testkit::{lattice, value_noise};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, TrackState, Tracker};

const NAMES: [&str; 5] = ["struck", "dlssvm", "mil", "boosting", "online-forest"];

/// A textured target before another texture.
#[derive(Clone, Copy, Default)]
struct Scene {
    /// Share of the light that is gone at the end.
    dimming: f64,
    /// Share of the target that something in front of it covers from frame 15 to 30.
    covered: f64,
    /// The target is gone from this frame on; 0: it stays.
    gone_from: u64,
}

impl Scene {
    fn truth(k: u64) -> BBox {
        let k = k as f64;
        BBox::from_center_size(Point::new(90.0 + 2.0 * k, 90.0 + 25.0 * (k / 11.0).sin()), 44.0, 36.0)
    }

    fn frame(self, k: u64) -> Frame {
        let target = Self::truth(k);
        let light = 1.0 - self.dimming * k as f64 / 50.0;
        let is_there = self.gone_from == 0 || k < self.gone_from;
        let edge = target.left() + self.covered * target.width();
        let image = Image::from_fn(320, 200, |x, y| {
            let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
            let noise = |x: f64, y: f64, seed: u64| value_noise((x, y), 6.0, |t| t, |i, j| lattice(i, j, seed));
            let cover = (15..30).contains(&k) && x < edge && x > edge - 60.0;
            let value = match target.contains(Point::new(x, y)) && is_there {
                true if !cover => 40.0 + 200.0 * noise(x - target.left(), y - target.top(), 9),
                _ => 70.0 + 90.0 * noise(x, y, 2),
            };
            (light * value) as u8
        });
        let frame = Frame::new(k, k as f64 / 30.0, image.unwrap());
        // What is derived of a frame is its own.
        frame.gray();
        frame.color();
        frame
    }

    /// The same with a target of this colour.
    fn tinted(self, k: u64, tint: [f64; 3]) -> Frame {
        let (gray, target) = (self.frame(k), Self::truth(k));
        let image = Image::from_fn(320, 200, |x, y| {
            let value = gray.gray().row(y)[x];
            let inside = target.contains(Point::new(x as f64 + 0.5, y as f64 + 0.5));
            if inside { tint.map(|t| (t * f64::from(value)) as u8) } else { [value; 3] }
        });
        Frame::new(k, k as f64 / 30.0, image.unwrap())
    }

    fn tracker(self, name: &str, set: &str) -> Box<dyn Tracker> {
        let recipe = registry::tracker(name).unwrap().recipe(&set.parse().unwrap()).unwrap();
        recipe.init(&self.frame(0), Self::truth(0)).unwrap()
    }

    fn follow(self, name: &str, frames: u64) -> Vec<Estimate> {
        let mut tracker = self.tracker(name, "");
        (1..frames).map(|k| tracker.update(&self.frame(k)).unwrap()).collect()
    }
}

#[test]
fn warm_trackers_allocate_nothing() {
    let scene = Scene::default();
    // Struck and dlssvm remember frames until their budget is reached.
    for (name, set) in
        [("struck", "budget = 8"), ("dlssvm", "budget = 8"), ("mil", ""), ("boosting", ""), ("online-forest", "")]
    {
        let mut tracker = scene.tracker(name, set);
        (1..20).for_each(|k| assert!(tracker.update(&scene.frame(k)).is_ok()));
        let frames: Vec<Frame> = (20..40).map(|k| scene.frame(k)).collect();
        let used = allocation_counter::measure(|| {
            frames.iter().for_each(|f| assert!(tracker.update(f).is_ok()));
        });
        assert_eq!(used.count_total, 0, "{name}: {used:?}");
    }
}

#[test]
fn failing_light_is_learnt() {
    let scene = Scene { dimming: 0.5, ..Scene::default() };
    for name in NAMES {
        for (k, estimate) in (1u64..).zip(scene.follow(name, 50)) {
            let overlap = estimate.bbox.iou(&Scene::truth(k));
            assert!(overlap > 0.5, "{name}, frame {k}: {overlap:.2} {estimate:?}");
        }
    }
}

#[test]
fn targets_covered_in_part_are_held() {
    let scene = Scene { covered: 0.4, ..Scene::default() };
    for name in NAMES {
        let last = scene.follow(name, 50).pop().unwrap();
        let overlap = last.bbox.iou(&Scene::truth(49));
        assert!(overlap > 0.6 && last.state != TrackState::Lost, "{name}: {overlap:.2} {last:?}");
    }
}

#[test]
fn what_is_gone_is_not_tracked() {
    let scene = Scene { gone_from: 20, ..Scene::default() };
    for name in NAMES {
        let told = scene.follow(name, 50);
        let alive = told[25..].iter().filter(|e| e.state == TrackState::Tracking).count();
        assert!(alive <= 2, "{name}: {alive} of {}", told[25..].len());
    }
}

/// As bright as each other.
const RED: [f64; 3] = [1.0, 0.5, 0.5];
const BLUE: [f64; 3] = [0.3, 0.75, 1.0];

/// What is said of a red target whose colour is `after` from frame 20 on.
fn repainted(name: &str, after: [f64; 3]) -> Vec<Estimate> {
    let recipe = registry::tracker(name).unwrap().default_recipe();
    let mut tracker = recipe.init(&Scene::default().tinted(0, RED), Scene::truth(0)).unwrap();
    let color = |k| if k < 20 { RED } else { after };
    (0..40).map(|k| tracker.update(&Scene::default().tinted(k, color(k))).unwrap()).collect()
}

#[test]
fn the_same_texture_in_another_color_is_another_thing() {
    for name in NAMES.into_iter().chain(["l1"]) {
        let told = |after| repainted(name, after)[25..].iter().filter(|e| e.state == TrackState::Tracking).count();
        let (same, other) = (told(RED), told(BLUE));
        assert!(same >= 13 && other <= 2, "{name}: {same} and {other} of 15");
    }
}

#[test]
fn pursuit_light_doubts_another_color() {
    let score = |after| repainted("pursuit-light", after)[20].score;
    let (same, other) = (score(RED), score(BLUE));
    assert!(other < same - 0.05, "{same:.3} and {other:.3}");
}
