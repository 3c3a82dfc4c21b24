//! Long-term tracking in a scene: the target leaves and comes back elsewhere.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, Pixels};
use pursuit_testkit::{lattice, value_noise};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, TrackState, Tracker};

const FRAME: Size = Size::new(400, 220);
const SIDE: (f64, f64) = (36.0, 30.0);

/// Smooth value noise in [0, 1] with cells of `cell` pixels.
fn texture(x: f64, y: f64, cell: f64, seed: u64) -> f64 {
    let seed = seed.wrapping_mul(0x1656_67b1_9e37_79f9);
    value_noise((x, y), cell, |t| t, |i, j| lattice(i, j, seed))
}

/// A frame of the scene, with the target where there is one.
fn frame(index: u64, seed: u64, target: Option<BBox>) -> Frame {
    let image = Image::from_fn(FRAME.width, FRAME.height, |x, y| {
        let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
        let inside = |b: &BBox| b.contains(pursuit_geometry::Point::new(u, v));
        let value = match target.filter(inside) {
            Some(b) => 40.0 + 200.0 * texture(u - b.left(), v - b.top(), 6.0, 1000 + seed),
            None => 60.0 + 110.0 * texture(u, v, 9.0, seed) + 30.0 * texture(u, v, 4.0, 77 + seed),
        };
        value as u8
    });
    Frame::new(index, index as f64 / 25.0, Pixels::Gray8(image.unwrap().into()))
}

fn at(x: f64, y: f64) -> BBox {
    BBox::from_ltwh(x, y, SIDE.0, SIDE.1)
}

const SEEN: u64 = 30;
const BACK: u64 = SEEN + 80;

/// The target moves, is gone for 80 frames and comes back 280 px away.
fn truth(k: u64) -> Option<BBox> {
    match k {
        _ if k < SEEN => Some(at(30.0 + k as f64, 60.0 + 0.5 * k as f64)),
        _ if k < BACK => None,
        _ => Some(at(59.0 + 280.0 - (k - BACK) as f64, 90.0)),
    }
}

fn run(name: &str, seed: u64, frames: u64) -> Vec<Estimate> {
    run_with(name, &toml::Table::new(), seed, frames)
}

fn run_with(name: &str, parameters: &toml::Table, seed: u64, frames: u64) -> Vec<Estimate> {
    let recipe = registry::tracker(name).unwrap().recipe(parameters).unwrap();
    let mut tracker: Box<dyn Tracker> = recipe.init(&frame(0, seed, truth(0)), truth(0).unwrap()).unwrap();
    (1..frames).map(|k| tracker.update(&frame(k, seed, truth(k))).unwrap()).collect()
}

/// Whether the target was never claimed while it was gone, and found within five frames of its return.
fn honest_and_back(name: &str, seed: u64) -> Result<(), String> {
    let estimates = run(name, seed, BACK + 20);
    let of = |k: u64| &estimates[k as usize - 1];
    let claimed = (SEEN..BACK).filter(|k| of(*k).state == TrackState::Tracking).count();
    let found =
        (BACK..BACK + 20).find(|k| of(*k).bbox.iou(&truth(*k).unwrap()) > 0.5 && of(*k).state == TrackState::Tracking);
    match found {
        Some(k) if claimed == 0 && k < BACK + 5 => Ok(()),
        _ => Err(format!("{name}, seed {seed}: claimed in {claimed} frames, found at {found:?}")),
    }
}

#[test]
fn a_target_that_leaves_is_found_elsewhere() {
    for name in ["tld", "kalman-tld"] {
        assert_eq!(honest_and_back(name, 1), Ok(()));
    }
}

#[test]
fn threads_find_what_one_finds() {
    for name in ["tld", "kalman-tld"] {
        // The target is seen, then gone: the whole frame is scanned.
        let alone = run(name, 2, SEEN + 20);
        let parameters = "scan.threads = 3".parse().unwrap();
        assert_eq!(run_with(name, &parameters, 2, SEEN + 20), alone, "{name}");
    }
}

#[test]
fn half_a_target_at_the_border_is_none() {
    // It walks out of the frame to the left, and stays away.
    let path = |k: u64| Some(at(60.0 - 3.0 * k as f64, 90.0)).filter(|b| b.right() > 0.0);
    for name in ["tld", "kalman-tld"] {
        let recipe = registry::tracker(name).unwrap().recipe(&toml::Table::new()).unwrap();
        let mut tracker = recipe.init(&frame(0, 4, path(0)), path(0).unwrap()).unwrap();
        for k in 1..60 {
            let estimate = tracker.update(&frame(k, 4, path(k))).unwrap();
            let inside = path(k).map_or(0.0, |b| (b.right().min(SIDE.0)) / SIDE.0);
            if inside >= 1.0 {
                assert_eq!(estimate.state, TrackState::Tracking, "{name}, frame {k}");
            }
            if inside < 0.4 {
                assert_ne!(estimate.state, TrackState::Tracking, "{name}, frame {k}: {inside} of it is left");
            }
        }
    }
}

/// The state saved is all that is kept; the loop brings the target back to where it was.
#[test]
#[ignore = "measurement: 100 000 frames of each"]
fn memory_stays_bounded_over_a_long_run() {
    let path = |k: u64| Some(at(30.0 + 2.0 * (50.0 - (k % 100) as f64).abs(), 60.0)).filter(|_| k % 500 < 450);
    let frames: Vec<Frame> = (0..500).map(|k| frame(k, 3, path(k))).collect();
    for name in ["tld", "kalman-tld"] {
        let recipe = registry::tracker(name).unwrap().recipe(&toml::Table::new()).unwrap();
        let mut tracker = recipe.init(&frames[0], path(0).unwrap()).unwrap();
        let (mut sizes, mut seen, mut clock) = (Vec::new(), 0, std::time::Instant::now());
        for k in 1..=100_000u64 {
            let shown = frames[(k % 500) as usize].undecorated().retimed(k, k as f64 / 25.0);
            let estimate = tracker.update(&shown).unwrap();
            seen += u64::from(estimate.state == TrackState::Tracking);
            if k % 10_000 == 0 {
                sizes.push(tracker.save().unwrap().len());
                println!("{name}: frame {k}, {:.1} s, {} bytes", clock.elapsed().as_secs_f64(), sizes[sizes.len() - 1]);
                clock = std::time::Instant::now();
            }
        }
        assert!(seen > 70_000, "{name}: seen in {seen} frames");
        let (early, late) = (sizes[1], sizes[sizes.len() - 1]);
        assert!(late < early + early / 4, "{name}: {sizes:?}");
    }
}
