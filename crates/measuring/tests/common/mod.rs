//! Worlds with true metres, seen by cameras that err: what all tests of measuring rest on.
#![allow(dead_code, missing_docs, clippy::unwrap_used, reason = "each test uses a part of it, and may panic")]

use nalgebra::Vector2;
use pursuit_measuring::{Calibration, Ruler, Sighting, Track};
use pursuit_testkit::SplitMix;

pub type Place = Vector2<f64>;

/// Normal numbers of variance 1 (Box and Muller 1958).
pub struct Normal(SplitMix);

impl Normal {
    pub const fn new(seed: u64) -> Self {
        Self(SplitMix::after(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }

    pub fn draw(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.0.unit()).cos()
    }
}

/// Something that moves: place, velocity and acceleration in metres and seconds.
pub struct World {
    pub name: &'static str,
    pub fps: f64,
    pub frames: usize,
    pub state: fn(f64) -> [Place; 3],
    pub camera: Camera,
}

/// How it is seen.
#[derive(Clone, Copy, PartialEq)]
pub enum Camera {
    /// Straight on, a stick of a metre in the picture.
    Stick,
    /// A plane seen obliquely, its corners known.
    Oblique,
}

pub const G: f64 = 9.81;

/// A ball thrown up and ahead.
fn thrown(t: f64) -> [Place; 3] {
    let (v, a) = (Place::new(2.0, 4.5), Place::new(0.0, -G));
    [Place::new(0.3, 0.4) + v * t + a * (0.5 * t * t), v + a * t, a]
}

/// A pendulum of a metre, a small swing: its path on the circle.
fn pendulum(t: f64) -> [Place; 3] {
    let (length, swing, w) = (1.0, 0.15, (G / 1.0_f64).sqrt());
    let (angle, rate, change) = (swing * (w * t).cos(), -swing * w * (w * t).sin(), -swing * w * w * (w * t).cos());
    let (s, c) = angle.sin_cos();
    [
        Place::new(1.5 + length * s, 1.6 - length * c),
        Place::new(c, s) * (length * rate),
        Place::new(c, s) * (length * change) + Place::new(-s, c) * (length * rate * rate),
    ]
}

/// A point on the rim of a wheel that turns and slows down.
fn wheel(t: f64) -> [Place; 3] {
    let radius = 0.3;
    let (angle, rate, change) = (6.0 * t - 0.2 * t * t, 6.0 - 0.4 * t, -0.4);
    let (s, c) = angle.sin_cos();
    [
        Place::new(1.5 + radius * c, 0.8 + radius * s),
        Place::new(-s, c) * (radius * rate),
        Place::new(-s, c) * (radius * change) - Place::new(c, s) * (radius * rate * rate),
    ]
}

/// Somebody who walks in a bow over the floor.
fn walk(t: f64) -> [Place; 3] {
    let w = 0.5;
    let (s, c) = (w * t).sin_cos();
    [Place::new(1.0 + 0.5 * t, 2.5 + 1.2 * s), Place::new(0.5, 1.2 * w * c), Place::new(0.0, -1.2 * w * w * s)]
}

pub const WORLDS: [World; 4] = [
    World { name: "thrown ball", fps: 60.0, frames: 55, state: thrown, camera: Camera::Stick },
    World { name: "pendulum", fps: 60.0, frames: 480, state: pendulum, camera: Camera::Stick },
    World { name: "turning wheel", fps: 60.0, frames: 240, state: wheel, camera: Camera::Stick },
    World { name: "oblique walk", fps: 25.0, frames: 200, state: walk, camera: Camera::Oblique },
];

/// The true ruler of a camera: 400 pixels a metre, or a floor 4 by 4 metres behind which the horizon rises.
pub fn true_ruler(camera: Camera) -> Ruler {
    let text = match camera {
        Camera::Stick => "stick = { from = [100.0, 600.0], to = [500.0, 600.0], length = '1m', click_error_px = 0.0 }\naxes = { origin = [100.0, 700.0], click_error_px = 0.0 }".to_owned(),
        Camera::Oblique => corners(&CORNERS, 0.0),
    };
    Ruler::new(&Calibration::from_toml(&text).unwrap(), &[]).unwrap()
}

const CORNERS: [[f64; 4]; 6] = [
    [80.0, 650.0, 0.0, 0.0],
    [1200.0, 650.0, 5.0, 0.0],
    [900.0, 300.0, 5.0, 6.0],
    [380.0, 300.0, 0.0, 6.0],
    [0.0, 0.0, 2.5, 0.0],
    [0.0, 0.0, 2.5, 3.0],
];

fn corners(points: &[[f64; 4]], error: f64) -> String {
    let points: Vec<String> = points[..4].iter().map(|p| format!("{p:?}")).collect();
    format!("plane = {{ unit = 'm', points = [{}], click_error_px = {error:?} }}", points.join(", "))
}

/// The ruler as somebody makes it who clicks with an error, drawn anew.
pub fn clicked_ruler(camera: Camera, click: f64, draw: &mut Normal) -> Ruler {
    let text = match camera {
        Camera::Stick => {
            let mut at = |x: f64| x + click * draw.draw();
            let (a, b, c, d) = (at(100.0), at(600.0), at(500.0), at(600.0));
            let (ox, oy) = (at(100.0), at(700.0));
            format!(
                "stick = {{ from = [{a:?}, {b:?}], to = [{c:?}, {d:?}], length = '1m', click_error_px = {click:?} }}\n\
                 axes = {{ origin = [{ox:?}, {oy:?}], click_error_px = {click:?} }}"
            )
        }
        Camera::Oblique => {
            let clicked = CORNERS.map(|[x, y, a, b]| [x + click * draw.draw(), y + click * draw.draw(), a, b]);
            corners(&clicked, click)
        }
    };
    Ruler::new(&Calibration::from_toml(&text).unwrap(), &[]).unwrap()
}

/// What a tracker measures of a world: the true pixel with an error of `noise` pixels, and every so often nothing.
pub fn seen(world: &World, noise: f64, gaps: bool, draw: &mut Normal) -> Track {
    let ruler = true_ruler(world.camera);
    let one = |k: usize| {
        let time_s = k as f64 / world.fps;
        let [place, ..] = (world.state)(time_s);
        let pixel = ruler.pixel([place.x, place.y]).unwrap();
        let at = [pixel[0] + noise * draw.draw(), pixel[1] + noise * draw.draw()];
        let hidden = gaps && (k % 40) >= 33;
        Sighting { frame: k as u64, time_s, at: (!hidden).then_some(at), size: None }
    };
    Track { target: 1, sightings: (0..world.frames).map(one).collect() }
}
