//! Scenes for what comes after looking: motion models, and depth.

use super::depth::DepthSensor;
use super::paint;
use super::params::{Common, Course, Depth, Motion, OccludingBar};
use super::scenarios::{Stage, boxed, wander, world};
use super::world::Thing;
use crate::{Scene, hash};
use pursuit_geometry::{BBox, Point};
use std::f64::consts::TAU;

/// Straight on, turning, stopping, thrown, swinging, or a camera that jumps; rates of 5 frames a second are asked for by `fps=5`.
pub(crate) fn motion(seed: u64, (common, own): &(Common, Motion)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let size = stage.patch.size;
    match own.motion {
        Course::Line => Box::new(world(stage, boxed(line(stage, stage.extent()), size))),
        Course::Turn => Box::new(world(stage, boxed(circle(stage, own.radius), size))),
        Course::Stop => {
            // Goes for a second, stands for a second.
            let going = |t: f64| (t / 2.0).floor() + t.rem_euclid(2.0).min(1.0);
            let line = line(stage, stage.extent());
            Box::new(world(stage, boxed(move |t| line(going(t)), size)))
        }
        Course::Jump => jumping(stage, own.jump),
        Course::Throw => Box::new(world(stage, boxed(thrown(stage, own.gravity), size))),
        Course::Swing => Box::new(world(stage, boxed(swing(stage, own), size))),
    }
}

/// A straight line at constant speed, slanted by up to a quarter, from the left; at the border it turns back.
fn line(stage: Stage<'_>, (width, height): (f64, f64)) -> impl Fn(f64) -> Point + Send + Sync + use<> {
    let (speed, margin) = (stage.speed, stage.patch.size * 0.6);
    let slope: f64 = hash::between(stage.seed, 81, -0.25, 0.25);
    let (across, down) = ((width - 2.0 * margin).max(1.0), (height - 2.0 * margin).max(1.0));
    let step = speed / 1f64.hypot(slope);
    let first = down * hash::between(stage.seed, 82, 0.4, 0.6);
    move |t| {
        let (x, y) = (folded(step * t, across), folded(first + slope * step * t, down));
        Point::new(margin + x, margin + y)
    }
}

/// Where a point that would be at `x` is when walls at 0 and `length` throw it back.
fn folded(x: f64, length: f64) -> f64 {
    let around = x.rem_euclid(2.0 * length);
    if around > length { 2.0 * length - around } else { around }
}

/// A turn at constant rate.
fn circle(stage: Stage<'_>, radius: f64) -> impl Fn(f64) -> Point + Send + Sync + use<> {
    let (width, height) = stage.extent();
    let center = Point::new(width / 2.0, height / 2.0);
    let room = (center.x.min(center.y) - 0.75 * stage.patch.size).max(1.0);
    let radius = radius.min(room);
    let (omega, phase) = (stage.speed / radius, hash::between(stage.seed, 83, 0.0, TAU));
    move |t| {
        let (sin, cos) = (omega * t + phase).sin_cos();
        Point::new(center.x + radius * cos, center.y + radius * sin)
    }
}

/// Thrown from the lower left so that it comes down at the lower right: a parabola as high as the picture leaves room for, or less
/// where `speed` across would lead out of the picture before.
fn thrown(stage: Stage<'_>, gravity: f64) -> impl Fn(f64) -> Point + Send + Sync + use<> {
    let ((width, height), margin) = (stage.extent(), stage.patch.size * 0.75);
    let high = (height - 2.0 * margin).max(1.0);
    let upward = (2.0 * gravity * high).sqrt();
    let across = stage.speed.min((width - 2.0 * margin).max(1.0) * gravity / (2.0 * upward));
    move |t| Point::new(margin + across * t, height - margin - upward * t + gravity * t * t / 2.0)
}

/// A pendulum that hangs from above the picture's middle, let go ten degrees to the right: the motion of small swings.
fn swing(stage: Stage<'_>, own: &Motion) -> impl Fn(f64) -> Point + Send + Sync + use<> {
    let ((width, height), length) = (stage.extent(), own.radius);
    let omega = (own.gravity / length).sqrt();
    let reach = 10_f64.to_radians();
    move |t| {
        let (sin, cos) = (reach * (omega * t).cos()).sin_cos();
        Point::new(width / 2.0 + length * sin, height / 2.0 + length * (cos - 1.0))
    }
}

/// The patch goes straight on while the camera jumps to another place every second and stays there.
fn jumping(stage: Stage<'_>, jump: f64) -> Box<dyn Scene> {
    let seed = stage.seed;
    let offset = move |t: f64| {
        let second = t.floor() as i64;
        let angle = hash::between(hash::mix(seed, 84), second as u64, 0.0, TAU);
        // Every other second it is back, so that it never strays.
        let away = if second.rem_euclid(2) == 1 { jump } else { 0.0 };
        Point::new(away * angle.cos(), away * angle.sin())
    };
    let (width, height) = stage.extent();
    // The patch keeps off the border by more than the jump.
    let inner = line(stage, ((width - 2.0 * jump).max(1.0), (height - 2.0 * jump).max(1.0)));
    let path = move |t: f64| {
        let (p, o) = (inner(t), offset(t));
        Point::new(p.x + jump - o.x, p.y + jump - o.y)
    };
    let mut world = world(stage, boxed(path, stage.patch.size));
    let margin = jump.ceil() + 2.0;
    let painted = (width + 2.0 * margin, height + 2.0 * margin);
    world.backdrop = paint::background(seed, painted.0.ceil() as usize, painted.1.ceil() as usize);
    world.camera = Box::new(move |t| Point::new(margin + offset(t).x, margin + offset(t).y));
    Box::new(world)
}

/// A patch that wanders in front of a wall, and a bar, nearer to the camera, that passes to and fro before it.
pub(crate) fn depth_occluder(seed: u64, (common, depth, own): &(Common, Depth, OccludingBar)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let ((width, height), bar) = (stage.extent(), own.bar);
    let mut world = world(stage, boxed(wander(stage, 0.5), stage.patch.size));
    let period = stage.picture.duration.clamp(2.0, 12.0);
    // At the right border to begin with, before the picture's middle after a quarter of the time.
    let place = move |t: f64| {
        let x = width / 2.0 + (width / 2.0 - 0.4 * bar) * (TAU * t / period).cos();
        BBox::from_center_size(Point::new(x, height * 0.55), bar, height * 0.9)
    };
    let look = paint::bar(seed, bar.ceil() as usize, (height * 0.9).ceil() as usize);
    world.before.push(Thing { look, path: Box::new(move |t| Some(place(t))) });
    let distance = depth.distance;
    world.depth = Some(DepthSensor {
        target_mm: Box::new(move |t| distance * (1.0 + 0.1 * (0.9 * t).sin())),
        nearer_mm: depth.nearer,
        holes: depth.holes,
        relief_mm: 0.0,
        wall_mm: None,
        clutter: Vec::new(),
        quantised: false,
    });
    Box::new(world)
}
