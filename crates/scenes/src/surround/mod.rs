//! A camera in the middle of a room: people and balls around it, in metres and radians, so that it can be turned.

mod body;
mod room;
mod world;

use crate::plan::Picture;
use crate::texture::{Color, smooth_step};
use crate::{Scene, View, hash};
use body::Body;
use pursuit_geometry::Size;
use pursuit_parameters::{choices, parameters};
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

parameters! {
    /// Of all scenes in the room.
    pub struct Walk {
        /// How wide the camera sees.
        pub fov: f64 = 60.0, in 5.0..=120.0, unit "degrees";
        /// How far away they walk.
        pub distance: f64 = 4.2, in 1.5..=6.0, unit "m";
        /// The walking speed; of who goes to and fro the greatest one.
        pub speed: f64 = 1.2, in 0.0..=20.0, unit "m/s";
        /// How dark shadows on the floor are, 0 to 1.
        pub shadow: f64 = 0.45, in 0.0..=1.0;
    }
}

parameters! {
    /// A step of the light.
    pub struct Lighting {
        /// The light's gain after the step; 1 for none.
        pub gain: f64 = 1.0, in 0.05..=2.0;
        /// When the light changes.
        pub step: f64 = 5.0, in 0.0..=3600.0, unit "s";
    }
}

parameters! {
    /// Of `person`.
    pub struct Person {
        /// When the person comes into the picture; until then the room is empty.
        pub enters: f64 = 2.0, in 0.0..=3600.0, unit "s";
        /// How long the person stands in the middle.
        pub stands: f64 = 3.0, in 0.0..=3600.0, unit "s";
        /// When the door in the wall opens; 0 for a door that stays shut.
        pub door: f64 = 0.0, in 0.0..=3600.0, unit "s";
    }
}

parameters! {
    /// Of `people`.
    pub struct People {
        /// How many people there are.
        pub count: usize = 4, in 1..=12;
    }
}

choices! {
    /// Who goes to and fro.
    pub enum Who {
        /// A person.
        Person = "person",
        /// A ball.
        Ball = "ball",
    }
}

parameters! {
    /// Of `wide-world`.
    pub struct WideWorld {
        /// Who goes to and fro.
        pub who: Who = Who::Person;
        /// How far to either side they go.
        pub reach: f64 = 60.0, in 0.0..=100.0, unit "degrees";
    }
}

/// The picture of a room unless another is asked for.
pub(crate) fn picture() -> Picture {
    Picture { width: 480, height: 360, duration: 12.0, ..Picture::default() }
}

/// The room with nobody in it, painted `reach_rad` to either side; the light is steady.
fn room(seed: u64, picture: &Picture, walk: &Walk, tilt_rad: f64, reach_rad: f64) -> Surround {
    let size = Size::new(picture.width, picture.height);
    let lens_rad = walk.fov.to_radians();
    let focal_px = size.width as f64 / 2.0 / (lens_rad / 2.0).tan();
    let ahead = View::ahead(lens_rad, size);
    Surround {
        size,
        fps: picture.fps,
        duration_s: picture.duration,
        home: ahead.aimed(0.0, tilt_rad).unwrap_or(ahead),
        seed,
        noise: picture.noise,
        // Finer paintings of wide rooms would not be worth their memory.
        room: Room::paint(seed, reach_rad, focal_px.min(900.0)),
        actors: Vec::new(),
        shadow: walk.shadow,
        door_s: None,
        light: Box::new(|_| [1.0; 3]),
    }
}

/// The light drops, or rises, within a tenth of a second.
fn light(&Lighting { gain, step }: &Lighting) -> Box<dyn Fn(f64) -> Color + Send + Sync> {
    Box::new(move |t| [(1.0 + (gain - 1.0) * smooth_step(0.0, 0.1, t - step)) as f32; 3])
}

/// Comes in from the left, stands in the middle, leaves to the right.
pub(crate) fn person(
    seed: u64,
    ((picture, walk), lighting, own): &((Picture, Walk), Lighting, Person),
) -> Box<dyn Scene> {
    let (enters, stands, away) = (own.enters, own.stands, walk.distance);
    // A speed of zero would never arrive; a hair above it stands at the door for ever.
    let speed = walk.speed.max(1e-6);
    let half_rad = walk.fov.to_radians() / 2.0;
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
    Box::new(Surround {
        actors: vec![Actor { body: Body::person(seed), path: Box::new(path) }],
        door_s: Some(own.door).filter(|t| *t > 0.0),
        light: light(lighting),
        ..room(seed, picture, walk, 0.0, half_rad + 0.3)
    })
}

/// Each goes to and fro at a distance of its own; they start apart and turn round at the picture's border.
pub(crate) fn people(
    seed: u64,
    ((picture, walk), lighting, own): &((Picture, Walk), Lighting, People),
) -> Box<dyn Scene> {
    let count = own.count;
    let half_rad = walk.fov.to_radians() / 2.0;
    let actor = |k: usize| {
        let seed = hash::mix(seed, 91 + k as u64);
        // The first walks in the middle row: others pass before it, and behind it.
        let row = if k == 0 { 0.5 } else { (k as f64 - 0.5) / (count as f64 - 1.0).max(1.0) };
        let away = walk.distance * (0.8 + 0.4 * row);
        let reach = (half_rad * away - 0.55).max(0.1);
        let speed = walk.speed * hash::between(seed, 1, 0.75, 1.25);
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
    Box::new(Surround {
        actors: (0..count).map(actor).collect(),
        light: light(lighting),
        ..room(seed, picture, walk, 0.0, half_rad + 0.3)
    })
}

/// To and fro about straight ahead, fastest in the middle, slow where it turns round.
pub(crate) fn wide_world(seed: u64, ((picture, walk), own): &((Picture, Walk), WideWorld)) -> Box<dyn Scene> {
    let (reach, away) = (own.reach.to_radians(), walk.distance);
    let omega = if reach > 0.0 { walk.speed / (reach * away) } else { 0.0 };
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
    let body = match own.who {
        Who::Person => Body::person(seed),
        Who::Ball => Body::ball(seed),
    };
    let actors = vec![Actor { body, path: Box::new(path) }];
    // The camera looks down a little, so that a ball on the floor is well inside its picture.
    Box::new(Surround { actors, ..room(seed, picture, walk, -0.12, reach + FRAC_PI_3) })
}
