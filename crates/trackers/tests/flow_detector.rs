//! The detector of movers before a camera that moves: on worlds made up here, whose truth is known.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_testkit::{lattice, value_noise};
use pursuit_trackers::registry::detector;
use pursuit_tracking::{Detection, Detector};

const SIZE: (usize, usize) = (240, 180);

/// Two octaves of noise over a plane.
fn texture(x: f64, y: f64, seed: u64) -> f64 {
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let octave = |cell: f64, salt: u64| value_noise((x, y), cell, smooth, |i, j| lattice(i, j, seed + salt));
    0.65 * octave(11.0, 0) + 0.35 * octave(4.0, 40)
}

/// A world under a camera that goes `pan` pixels a frame and turns by `turn` radians a frame about the middle, with a thing of its own
/// texture that goes `step` pixels a frame through the picture, where there is one.
struct World {
    pan: (f64, f64),
    turn: f64,
    thing: Option<(BBox, (f64, f64))>,
}

impl World {
    fn truth(&self, k: u64) -> Option<BBox> {
        self.thing.map(|(start, (dx, dy))| start.translated(k as f64 * dx, k as f64 * dy))
    }

    fn frame(&self, k: u64) -> Frame {
        let (width, height) = SIZE;
        let (s, c) = (self.turn * k as f64).sin_cos();
        let (mx, my) = (width as f64 / 2.0, height as f64 / 2.0);
        let truth = self.truth(k);
        let pixel = |x: usize, y: usize| {
            let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
            let value = match truth.filter(|b| b.contains(Point::new(u, v))) {
                Some(b) => texture(u - b.left(), v - b.top(), 900),
                None => {
                    let (u, v) = (u - mx, v - my);
                    let (u, v) = (c * u - s * v + mx, s * u + c * v + my);
                    texture(u + self.pan.0 * k as f64, v + self.pan.1 * k as f64, 3)
                }
            };
            (30.0 + 190.0 * value) as u8
        };
        Frame::new(k, k as f64 / 25.0, Image::from_fn(width, height, pixel).unwrap())
    }

    fn run(&self, frames: u64, settings: &str) -> Vec<Vec<Detection>> {
        let mut detector = start(settings);
        (0..frames).map(|k| detector.detect(&self.frame(k), &[]).unwrap()).collect()
    }
}

fn start(settings: &str) -> Box<dyn Detector> {
    detector("flow").unwrap().detector(&settings.parse().unwrap()).unwrap()
}

#[test]
fn a_mover_is_found_while_the_camera_moves() {
    let thing = Some((BBox::from_ltwh(60.0, 60.0, 40.0, 30.0), (3.0, 1.0)));
    for (pan, turn) in [((0.0, 0.0), 0.0), ((2.6, -1.3), 0.0), ((-4.0, 2.0), 0.0), ((1.5, 0.5), 0.006)] {
        let world = World { pan, turn, thing };
        let found = world.run(14, "");
        for (k, found) in (0..).zip(&found).skip(3) {
            let truth = world.truth(k).unwrap();
            let sure: Vec<&Detection> = found.iter().filter(|d| d.confidence > 0.5).collect();
            let best = sure.first().unwrap_or_else(|| panic!("{pan:?} {turn}, frame {k}: nothing in {found:?}"));
            assert!(best.bbox.iou(&truth) > 0.55, "{pan:?} {turn}, frame {k}: {best:?} {truth:?}");
            assert!(sure.len() == 1, "{pan:?} {turn}, frame {k}: {found:?}");
        }
    }
}

#[test]
fn a_camera_alone_makes_no_mover() {
    for (pan, turn) in [((3.0, -2.0), 0.0), ((0.4, 0.3), 0.01), ((-9.0, 5.0), 0.0)] {
        let world = World { pan, turn, thing: None };
        assert_eq!(world.run(10, "").concat(), [], "{pan:?} {turn}");
    }
}

#[test]
fn what_the_camera_follows_is_a_mover_too() {
    // The thing stands still in the picture while the scene goes by.
    let thing = Some((BBox::from_ltwh(100.0, 70.0, 44.0, 36.0), (0.0, 0.0)));
    let world = World { pan: (4.0, 0.0), turn: 0.0, thing };
    for (k, found) in world.run(10, "").iter().enumerate().skip(3) {
        let best = found.first().unwrap_or_else(|| panic!("frame {k}: nothing"));
        assert!(best.confidence > 0.5 && best.bbox.iou(&world.truth(0).unwrap()) > 0.55, "frame {k}: {found:?}");
    }
}

#[test]
fn a_mover_is_sure_from_its_second_sight_on() {
    let thing = Some((BBox::from_ltwh(60.0, 60.0, 40.0, 30.0), (3.0, 1.0)));
    let world = World { pan: (2.0, 0.0), turn: 0.0, thing };
    let found = world.run(4, "");
    assert!(found[0].is_empty());
    assert!(!found[1].is_empty() && found[1].iter().all(|d| d.confidence < 0.5), "{:?}", found[1]);
    assert!(found[2][0].confidence > 0.5, "{:?}", found[2]);
    let bold = world.run(2, "first = 1.0");
    assert!(bold[1][0].confidence > 0.5, "{bold:?}");
}

#[test]
fn without_the_cameras_motion_nothing_is_told() {
    let mut detector = start("");
    // Every frame is another place: nothing agrees.
    let elsewhere = |k: u64| {
        let pixel = |x: usize, y: usize| (255.0 * texture(x as f64 + 977.0 * k as f64, y as f64, 7 + k)) as u8;
        Frame::new(k, k as f64 / 25.0, Image::from_fn(SIZE.0, SIZE.1, pixel).unwrap())
    };
    for k in 0..4 {
        assert_eq!(detector.detect(&elsewhere(k), &[]).unwrap(), []);
        let figures = detector.diagnostics();
        assert_eq!(figures.get("camera_known"), Some(0.0), "{figures:?}");
    }
    let world = World { pan: (3.0, 4.0), turn: 0.0, thing: None };
    let mut detector = start("");
    for k in 0..3 {
        detector.detect(&world.frame(k), &[]).unwrap();
    }
    let shift = detector.diagnostics().get("camera_shift_px").unwrap();
    assert!((shift - 5.0).abs() < 0.2, "{shift}");
}
