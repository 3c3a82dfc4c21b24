//! What `meanshift`, `camshift` and `condensation` are for: targets that bend and grow and keep their colours; and no allocation.
#![cfg(feature = "zoo")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_testkit::{lattice, value_noise};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, TrackState, Tracker};

const NAMES: [&str; 3] = ["meanshift", "camshift", "condensation"];

/// A target in two colours, one inside the other, whose shape and size change before something of other colours.
#[derive(Clone, Copy)]
struct Scene {
    outer: Rgb8,
    inner: Rgb8,
    /// Growth a frame.
    growth: f64,
    /// Share of the side by which width and height change places.
    bending: f64,
}

const ORANGE: Scene = Scene { outer: [225, 110, 30], inner: [120, 40, 160], growth: 1.0, bending: 0.0 };

impl Scene {
    fn truth(&self, k: u64) -> BBox {
        let size = self.growth.powi(k as i32);
        let bend = self.bending * (0.35 * k as f64).sin();
        let center = Point::new(90.0 + 2.5 * k as f64, 80.0 + 1.2 * k as f64);
        BBox::from_center_size(center, 40.0 * size * (1.0 + bend), 40.0 * size * (1.0 - bend))
    }

    fn frame(&self, k: u64) -> Frame {
        let target = self.truth(k);
        let image = Image::from_fn(320, 240, |x, y| {
            let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
            let u = 2.0 * (x - target.center().x) / target.width();
            let v = 2.0 * (y - target.center().y) / target.height();
            let noise = value_noise((x, y), 6.0, |t| t, |i, j| lattice(i, j, 5));
            let shaded = |color: Rgb8| color.map(|c| (f64::from(c) * (0.85 + 0.15 * noise)) as u8);
            match u * u + v * v {
                r if r < 0.3 => shaded(self.inner),
                r if r < 1.0 => shaded(self.outer),
                _ => [(70.0 + 60.0 * noise) as u8, (90.0 + 60.0 * noise) as u8, (80.0 + 40.0 * noise) as u8],
            }
        });
        let frame = Frame::new(k, k as f64 / 30.0, image.unwrap());
        // Made once for all who look at a frame, and not by a tracker's own hand.
        frame.gray();
        frame
    }

    fn tracker(&self, name: &str, set: &str) -> Box<dyn Tracker> {
        let recipe = registry::tracker(name).unwrap().recipe(&set.parse().unwrap()).unwrap();
        recipe.init(&self.frame(0), self.truth(0)).unwrap()
    }

    fn follow(&self, name: &str, set: &str, frames: u64) -> Vec<Estimate> {
        let mut tracker = self.tracker(name, set);
        (1..frames).map(|k| tracker.update(&self.frame(k)).unwrap()).collect()
    }
}

#[test]
fn warm_trackers_allocate_nothing() {
    for name in NAMES {
        let mut tracker = ORANGE.tracker(name, "");
        (1..20).for_each(|k| assert!(tracker.update(&ORANGE.frame(k)).is_ok()));
        let frames: Vec<Frame> = (20..40).map(|k| ORANGE.frame(k)).collect();
        let used = allocation_counter::measure(|| {
            frames.iter().for_each(|f| assert!(tracker.update(f).is_ok()));
        });
        assert_eq!(used.count_total, 0, "{name}: {used:?}");
    }
}

#[test]
fn bending_targets_are_followed() {
    let scene = Scene { bending: 0.25, ..ORANGE };
    for name in NAMES {
        for (k, estimate) in (1u64..).zip(scene.follow(name, "", 50)) {
            let overlap = estimate.bbox.iou(&scene.truth(k));
            assert!(
                overlap > 0.5 && estimate.state != TrackState::Lost,
                "{name}, frame {k}: {overlap:.2} {estimate:?}"
            );
        }
    }
}

#[test]
fn boxes_grow_with_their_targets() {
    let scene = Scene { growth: 1.012, ..ORANGE };
    for name in NAMES {
        let last = scene.follow(name, "policy.model = 'always'", 45).pop().unwrap();
        let (grown, overlap) = (last.bbox.area() / scene.truth(0).area(), last.bbox.iou(&scene.truth(44)));
        // The target's area has grown by 2.9.
        assert!(grown > 1.6 && overlap > 0.55, "{name}: {grown:.2} {overlap:.2}");
    }
}

#[test]
fn sizes_stay_where_they_are_to_stay() {
    let scene = Scene { growth: 1.012, ..ORANGE };
    for name in ["meanshift", "camshift"] {
        let last = scene.follow(name, "size.model = 'fixed'", 30).pop().unwrap();
        assert!((last.bbox.area() / scene.truth(0).area() - 1.0).abs() < 0.01, "{name}: {:?}", last.bbox);
    }
}

#[test]
fn targets_without_a_hue_go_by_brightness() {
    let scene = Scene { outer: [235; 3], inner: [250; 3], ..ORANGE };
    for name in NAMES {
        let last = scene.follow(name, "", 40).pop().unwrap();
        let overlap = last.bbox.iou(&scene.truth(39));
        assert!(overlap > 0.5 && last.state == TrackState::Tracking, "{name}: {overlap:.2}");
    }
}

#[test]
fn papers_models_follow_too() {
    let sets = [
        ("meanshift", "surroundings = 'paper'\nbins = 16\nsize.model = 'paper'\nsearch.prediction_gain = 0.0"),
        ("camshift", "projection = 'paper'\nsize.model = 'paper'\nsearch.prediction_gain = 0.0"),
        ("condensation", "contour_share = 1.0\nsamples = 1000"),
    ];
    for (name, set) in sets {
        let last = ORANGE.follow(name, &format!("policy.model = 'always'\n{set}"), 40).pop().unwrap();
        assert!(last.bbox.contains(ORANGE.truth(39).center()), "{name}: {:?}", last.bbox);
        assert!(last.state == TrackState::Tracking, "{name}: nothing is lost");
    }
}
