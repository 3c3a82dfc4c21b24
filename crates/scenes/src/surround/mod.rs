//! A camera in the middle of a room: people and balls around it, in metres and radians, so that it can be turned.

mod body;
mod room;
mod world;

use crate::keys::{Key, Scenery};
use crate::texture::{Color, smooth_step};
use crate::{Scene, View, hash};
use body::Body;
use pursuit_geometry::Size;
use room::Room;
use std::f64::consts::{FRAC_PI_3, TAU};
use world::{Actor, Surround};

/// Where somebody is: the direction and distance of the feet, and what the legs do.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stand {
    /// Radians to the right of straight ahead.
    pan_rad: f64,
    /// Horizontal distance from the camera, in metres.
    distance_m: f64,
    /// Metres walked so far: they move the legs.
    walked_m: f64,
    /// 1 walking, 0 standing.
    pace: f64,
    /// 1 to the right, -1 to the left.
    facing: f64,
}

/// Where somebody is at a time in seconds; `None` when not in the room.
type Path = Box<dyn Fn(f64) -> Option<Stand> + Send + Sync>;

const WIDTH: Key = Key::number("width", "the picture's width in pixels", 480.0, 64.0, 4096.0);
const HEIGHT: Key = Key::number("height", "the picture's height in pixels", 360.0, 64.0, 4096.0);
const FPS: Key = Key::number("fps", "the rate in frames per second", 30.0, 1.0, 1000.0);
const DURATION: Key = Key::number("duration", "the length in seconds", 12.0, 0.1, 3600.0);
const LENS: Key = Key::number("fov", "how wide the camera sees, in degrees", 60.0, 5.0, 120.0);
const DISTANCE: Key = Key::number("distance", "how far away they walk, in metres", 4.2, 1.5, 6.0);
const SPEED: Key = Key::number("speed", "the walking speed in metres per second", 1.2, 0.0, 20.0);
const SHADOW: Key = Key::number("shadow", "how dark shadows on the floor are, 0 to 1", 0.45, 0.0, 1.0);
const NOISE: Key = Key::number("noise", "the sensor noise's standard deviation in grey levels", 3.0, 0.0, 80.0);
const GAIN: Key = Key::number("gain", "the light's gain after the step; 1 for none", 1.0, 0.05, 2.0);
const STEP: Key = Key::number("step", "when the light changes, in seconds", 5.0, 0.0, 3600.0);

pub(crate) const PERSON_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    DURATION,
    LENS,
    DISTANCE,
    SPEED,
    Key::number(
        "enters",
        "when the person comes into the picture, in seconds; until then the room is empty",
        2.0,
        0.0,
        3600.0,
    ),
    Key::number("stands", "how long the person stands in the middle, in seconds", 3.0, 0.0, 3600.0),
    SHADOW,
    GAIN,
    STEP,
    Key::number("door", "when the door in the wall opens, in seconds; 0 for a door that stays shut", 0.0, 0.0, 3600.0),
    NOISE,
];
pub(crate) const PEOPLE_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    Key { default: 10.0, ..DURATION },
    LENS,
    Key { default: 4.5, ..DISTANCE },
    SPEED,
    Key::number("count", "how many people there are", 4.0, 1.0, 12.0),
    SHADOW,
    GAIN,
    STEP,
    NOISE,
];
pub(crate) const WIDE_WORLD_KEYS: &[Key] = &[
    Key { default: 320.0, ..WIDTH },
    Key { default: 240.0, ..HEIGHT },
    FPS,
    DURATION,
    Key { default: 50.0, ..LENS },
    Key::choice("who", "who goes to and fro", &["person", "ball"]),
    DISTANCE,
    Key { default: 1.5, help: "the greatest speed in metres per second", ..SPEED },
    Key::number("reach", "how far to either side they go, in degrees", 60.0, 0.0, 100.0),
    SHADOW,
    NOISE,
];

fn world(scenery: &Scenery, tilt_rad: f64, reach_rad: f64, actors: Vec<Actor>) -> Box<Surround> {
    let size = Size::new(scenery.get("width") as usize, scenery.get("height") as usize);
    let lens_rad = scenery.get("fov").to_radians();
    let focal_px = size.width as f64 / 2.0 / (lens_rad / 2.0).tan();
    let ahead = View::ahead(lens_rad, size);
    Box::new(Surround {
        size,
        fps: scenery.get("fps"),
        duration_s: scenery.get("duration"),
        home: ahead.aimed(0.0, tilt_rad).unwrap_or(ahead),
        seed: scenery.seed,
        noise: scenery.get("noise"),
        // Finer paintings of wide rooms would not be worth their memory.
        room: Room::paint(scenery.seed, reach_rad, focal_px.min(900.0)),
        actors,
        shadow: scenery.get("shadow"),
        door_s: Some(scenery.get("door")).filter(|t| *t > 0.0),
        light: light(scenery.get("gain"), scenery.get("step")),
    })
}

/// The light drops, or rises, within a tenth of a second. A gain of 0 stands for a scene without the key.
fn light(gain: f64, step_s: f64) -> Box<dyn Fn(f64) -> Color + Send + Sync> {
    let gain = if gain > 0.0 { gain } else { 1.0 };
    Box::new(move |t| [(1.0 + (gain - 1.0) * smooth_step(0.0, 0.1, t - step_s)) as f32; 3])
}

/// Comes in from the left, stands in the middle, leaves to the right.
pub(crate) fn person(scenery: &Scenery) -> Box<dyn Scene> {
    let (enters, stands, away) = (scenery.get("enters"), scenery.get("stands"), scenery.get("distance"));
    // A speed of zero would never arrive; a hair above it stands at the door for ever.
    let speed = scenery.get("speed").max(1e-6);
    let half_rad = scenery.get("fov").to_radians() / 2.0;
    // Half a step outside of the picture to the middle, and out again.
    let way = half_rad * away + 0.5;
    let there = enters + way / speed;
    let path = move |t: f64| {
        let stood = (t - there).clamp(0.0, stands);
        let walked_m = speed * (t - enters - stood).max(0.0);
        let pace = if (there..there + stands).contains(&t) { 0.0 } else { 1.0 };
        let inside = t >= enters && walked_m <= 2.0 * way;
        inside.then_some(Stand { pan_rad: (walked_m - way) / away, distance_m: away, walked_m, pace, facing: 1.0 })
    };
    let actor = Actor { body: Body::person(scenery.seed), path: Box::new(path) };
    world(scenery, 0.0, half_rad + 0.3, vec![actor])
}

/// Each goes to and fro at a distance of its own; they start apart and turn round at the picture's border.
pub(crate) fn people(scenery: &Scenery) -> Box<dyn Scene> {
    let count = scenery.get("count") as usize;
    let half_rad = scenery.get("fov").to_radians() / 2.0;
    let actor = |k: usize| {
        let seed = hash::mix(scenery.seed, 91 + k as u64);
        // The first walks in the middle row: others pass before it, and behind it.
        let row = if k == 0 { 0.5 } else { (k as f64 - 0.5) / (count as f64 - 1.0).max(1.0) };
        let away = scenery.get("distance") * (0.8 + 0.4 * row);
        let reach = (half_rad * away - 0.55).max(0.1);
        let speed = scenery.get("speed") * hash::between(seed, 1, 0.75, 1.25);
        let first = 2.0 * reach * (k as f64 + 0.5) / count as f64;
        let to_the_right = hash::unit(seed, 2) < 0.5;
        let path = move |t: f64| {
            let walked = first + speed * t;
            let around = (if to_the_right { walked } else { 4.0 * reach - first + speed * t }).rem_euclid(4.0 * reach);
            let (at, facing) = if around < 2.0 * reach { (around, 1.0) } else { (4.0 * reach - around, -1.0) };
            let pace = if speed > 0.0 { 1.0 } else { 0.0 };
            Some(Stand { pan_rad: (at - reach) / away, distance_m: away, walked_m: walked, pace, facing })
        };
        Actor { body: Body::person(seed), path: Box::new(path) }
    };
    world(scenery, 0.0, half_rad + 0.3, (0..count).map(actor).collect())
}

/// To and fro about straight ahead, fastest in the middle, slow where it turns round.
pub(crate) fn wide_world(scenery: &Scenery) -> Box<dyn Scene> {
    let (reach, away) = (scenery.get("reach").to_radians(), scenery.get("distance"));
    let omega = if reach > 0.0 { scenery.get("speed") / (reach * away) } else { 0.0 };
    let path = move |t: f64| {
        let (sin, cos) = (omega * t).sin_cos();
        // The way walked is that of a quarter turn for each quarter of the period.
        let quarters = (omega * t / (TAU / 4.0)).floor();
        let within = if quarters.rem_euclid(2.0) < 1.0 { sin.abs() } else { 1.0 - sin.abs() };
        Some(Stand {
            pan_rad: reach * sin,
            distance_m: away,
            walked_m: reach * away * (quarters + within),
            pace: cos.abs().sqrt().min(1.0),
            facing: if cos < 0.0 { -1.0 } else { 1.0 },
        })
    };
    let body = if scenery.get("who") >= 0.5 { Body::ball(scenery.seed) } else { Body::person(scenery.seed) };
    // The camera looks down a little, so that a ball on the floor is well inside its picture.
    world(scenery, -0.12, reach + FRAC_PI_3, vec![Actor { body, path: Box::new(path) }])
}
