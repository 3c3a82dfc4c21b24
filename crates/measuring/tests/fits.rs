//! Fits against true parameters: g of a thrown ball, the period of a pendulum.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod common;

use common::{Camera, G, Normal, Place, WORLDS, World, clicked_ruler, seen};
use pursuit_measuring::fits::{Asked, Fitted, fit};
use pursuit_measuring::{Options, measure};

const SEEDS: u64 = 100;

fn fitted(world: &World, asked: &str, seed: u64) -> Fitted {
    let mut draw = Normal::new(seed + 5000);
    let track = seen(world, 0.4, false, &mut draw);
    let ruler = clicked_ruler(world.camera, 0.5, &mut draw);
    let measured = measure(&track, &ruler, &Options::default()).unwrap();
    fit(&track, &measured.moments, &ruler, &asked.parse::<Asked>().unwrap()).unwrap()
}

/// The largest relative error over all seeds, and how often the truth lies within two errors.
fn held(world: &World, asked: &str, name: &str, truth: f64) -> (f64, f64) {
    let (mut worst, mut inside) = (0.0_f64, 0.0);
    for seed in 0..SEEDS {
        let found = fitted(world, asked, seed);
        let found = found.parameter(name).unwrap();
        worst = worst.max((found.value / truth - 1.0).abs());
        inside += f64::from(u8::from((found.value - truth).abs() <= 2.0 * found.error)) / SEEDS as f64;
    }
    println!(
        "{} by {asked}: {name} at most {:.3} % off, {:.0} % within 2 σ",
        world.name,
        100.0 * worst,
        100.0 * inside
    );
    (worst, inside)
}

#[test]
fn a_thrown_ball_gives_g_within_a_percent() {
    let (worst, inside) = held(&WORLDS[0], "parabola", "acceleration", G);
    assert!(worst < 0.01 && inside >= 0.9, "{worst} {inside}");
    let down = fitted(&WORLDS[0], "parabola", 1);
    assert!((down.parameter("ay").unwrap().value + G).abs() < 0.1 && down.parameter("ay").unwrap().unit == "m/s^2");
    assert!(down.parameter("ax").unwrap().value.abs() < 0.05);
    // 0.4 px of 400 a metre.
    assert!(down.residual_rms.iter().all(|r| (0.0006..0.0016).contains(r)), "{:?}", down.residual_rms);
    assert_eq!((down.count, down.residuals.len()), (55, 55));
}

#[test]
fn a_pendulum_gives_its_period() {
    let (worst, inside) = held(&WORLDS[1], "sine", "period", std::f64::consts::TAU / G.sqrt());
    assert!(worst < 0.002 && inside >= 0.9, "{worst} {inside}");
}

#[test]
fn a_straight_roll_gives_its_speed() {
    fn roll(t: f64) -> [Place; 3] {
        let v = Place::new(0.6, 0.8);
        [Place::new(0.2, 0.3) + v * t, v, Place::zeros()]
    }
    let world = World { name: "roll", fps: 30.0, frames: 40, state: roll, camera: Camera::Oblique };
    let (worst, inside) = held(&world, "line", "speed", 1.0);
    assert!(worst < 0.03 && inside >= 0.9, "{worst} {inside}");
}

#[test]
fn too_little_to_fit_is_said() {
    let mut draw = Normal::new(3);
    let track = seen(&WORLDS[0], 0.4, false, &mut draw);
    let ruler = clicked_ruler(WORLDS[0].camera, 0.5, &mut draw);
    let measured = measure(&track, &ruler, &Options::default()).unwrap();
    for (asked, words) in [("parabola@0.1-0.15", "needs 7"), ("line@5-9", "0 frames"), ("sine@0-0.12", "another span")]
    {
        let error = fit(&track, &measured.moments, &ruler, &asked.parse().unwrap()).unwrap_err().to_string();
        assert!(error.contains(words), "{asked}: {error}");
    }
}
