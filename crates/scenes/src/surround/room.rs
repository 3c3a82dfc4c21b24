//! The room around the camera, painted once: a floor, and a round wall with pillars, posters and a door.
//!
//! The painting is a cylinder: across the angle, down the tangent of the angle below the horizon, both times the focal
//! length of the home view, so that a pixel of the home view is about one of the painting.

use crate::hash;
use crate::texture::{Color, Texture, fractal_noise, hsv, mixed, scaled, smooth_step};
use pursuit_imaging::Direction;

/// How high the camera hangs, and how far away the wall is, in metres.
pub(super) const CAMERA_M: f64 = 1.5;
pub(super) const WALL_M: f64 = 6.5;
/// Tangents of the angles that the painting reaches above and below the horizon.
const REACH_TAN: f64 = 0.85;

/// The door's edges along the wall, and its height, in metres.
const DOOR_M: [f64; 3] = [1.3, 2.2, 2.05];
const FRAME_M: f64 = 0.07;

pub(super) struct Room {
    painting: Texture,
    /// Pixels of the painting per radian.
    scale: f64,
    /// Radians to either side.
    reach_rad: f64,
}

impl Room {
    /// Paints `reach_rad` to either side of straight ahead, `scale` pixels a radian.
    pub(super) fn paint(seed: u64, reach_rad: f64, scale: f64) -> Self {
        let key = hash::mix(seed, 0x4003);
        let (width, height) = ((2.0 * reach_rad * scale).ceil(), (2.0 * REACH_TAN * scale).ceil());
        let posters: Vec<Poster> =
            (0..(reach_rad * WALL_M * 2.2) as u64).map(|k| Poster::random(key, k, reach_rad)).collect();
        let painting = Texture::paint(width as usize, height as usize, 1, |x, y| {
            let (pan, below) = (x / scale - reach_rad, y / scale - REACH_TAN);
            let away = if below > 0.0 { CAMERA_M / below } else { f64::INFINITY };
            if away < WALL_M {
                return floor(key, away * pan.sin(), away * pan.cos());
            }
            wall(key, &posters, pan * WALL_M, CAMERA_M - below * WALL_M)
        });
        Self { painting, scale, reach_rad }
    }

    /// The colour in a direction.
    pub(super) fn sample(&self, direction: Direction) -> Color {
        let (across, below) = (direction.pan_rad + self.reach_rad, REACH_TAN - direction.tilt_rad.tan());
        self.painting.sample(across * self.scale, below * self.scale)
    }
}

/// What is seen of the door when it stands open by `share` of its width: the corridor behind it. Colour and opacity.
pub(super) fn open_door(share: f64, direction: Direction) -> [f32; 4] {
    let (along, height) = (direction.pan_rad * WALL_M, CAMERA_M + direction.tilt_rad.tan() * WALL_M);
    let [left, right, top] = DOOR_M;
    let soft = |d: f64| smooth_step(-0.01, 0.01, d);
    let cover = soft(along - left) * soft(left + share * (right - left) - along) * soft(top - height) * soft(height);
    let light = mixed([236.0, 226.0, 196.0], [150.0, 140.0, 120.0], smooth_step(0.0, top, top - height) as f32);
    let cover = cover as f32;
    [light[0] * cover, light[1] * cover, light[2] * cover, cover]
}

/// The box of directions that holds the door: least and greatest pan, least and greatest tilt.
pub(super) fn door_directions() -> [Direction; 4] {
    let tilt = |height: f64| ((height - CAMERA_M) / WALL_M).atan();
    let corner = |along: f64, height: f64| Direction { pan_rad: along / WALL_M, tilt_rad: tilt(height) };
    let [left, right, top] = DOOR_M;
    [corner(left, 0.0), corner(right, 0.0), corner(left, top), corner(right, top)]
}

fn floor(key: u64, x: f64, z: f64) -> Color {
    let plank = (x / 0.16).floor();
    let tone = hash::between(key, (plank as i64) as u64, 0.82, 1.12);
    let grain = fractal_noise(key ^ 2, x * 40.0, z * 3.0, 3);
    let joint = if (x / 0.16 - plank) < 0.06 { 0.7 } else { 1.0 };
    scaled([122.0, 96.0, 72.0], (joint * (tone + 0.18 * grain)) as f32)
}

fn wall(key: u64, posters: &[Poster], along: f64, height: f64) -> Color {
    let stain = fractal_noise(key ^ 4, along * 0.9, height * 0.9, 4);
    let mut color = scaled([182.0, 178.0, 168.0], (0.86 + 0.16 * stain) as f32);
    // A pillar every 2.4 m.
    let pillar = (along / 2.4).rem_euclid(1.0);
    if pillar < 0.12 {
        color = scaled(color, (0.72 + 0.3 * (pillar / 0.12 * std::f64::consts::PI).sin()) as f32);
    }
    if height < 0.12 {
        color = [74.0, 66.0, 58.0];
    }
    for poster in posters {
        color = poster.over(color, along, height);
    }
    let [left, right, top] = DOOR_M;
    let in_frame = along > left - FRAME_M && along < right + FRAME_M && height < top + FRAME_M;
    let in_door = along > left && along < right && height < top;
    match (in_frame, in_door) {
        (_, true) => {
            scaled([126.0, 92.0, 62.0], (0.9 + 0.2 * fractal_noise(key ^ 8, along * 20.0, height * 1.5, 3)) as f32)
        }
        (true, false) => [96.0, 92.0, 88.0],
        _ => color,
    }
}

/// Something flat on the wall, for the eye to hold on to.
struct Poster {
    left: f64,
    bottom: f64,
    width: f64,
    height: f64,
    colors: [Color; 2],
    stripes: f64,
}

impl Poster {
    fn random(key: u64, index: u64, reach_rad: f64) -> Self {
        let key = hash::mix(key, 900 + index);
        let random = |k, low, high| hash::between(key, k, low, high);
        let color = |k| hsv(random(k, 0.0, 360.0), random(k + 1, 0.1, 0.6), random(k + 2, 0.25, 0.85));
        Self {
            left: random(0, -reach_rad * WALL_M, reach_rad * WALL_M),
            bottom: random(1, 0.5, 2.6),
            width: random(2, 0.2, 0.8),
            height: random(3, 0.25, 0.9),
            colors: [color(4), color(7)],
            stripes: random(10, 8.0, 30.0),
        }
    }

    fn over(&self, under: Color, along: f64, height: f64) -> Color {
        let (x, y) = (along - self.left, height - self.bottom);
        if x < 0.0 || y < 0.0 || x > self.width || y > self.height {
            return under;
        }
        mixed(self.colors[0], self.colors[1], smooth_step(-0.3, 0.3, (y * self.stripes + 3.0 * x).sin()) as f32)
    }
}
