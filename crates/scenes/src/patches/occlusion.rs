//! One patch, one occlusion, at true depths: what depth-aware tracking is measured on.

use super::depth::DepthSensor;
use super::paint;
use super::params::{Common, Depth, Light, Occluder, RgbdOcclusion};
use super::scenarios::{Stage, resolution, world};
use super::world::Thing;
use crate::{Scene, hash};
use pursuit_geometry::{BBox, Point};
use std::f64::consts::TAU;

/// When the patch and what covers it meet, as a share of the duration.
const MEETING: f64 = 0.45;

/// A patch crosses the picture before a wall with things standing before it; something nearer comes the other way, and the
/// two meet. The patch's size goes with its distance.
pub(crate) fn rgbd_occlusion(seed: u64, (common, depth, own): &(Common, Depth, RgbdOcclusion)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let (size, start_mm, duration) = (stage.patch.size, depth.distance, stage.picture.duration);
    let (approach, reach) = (own.approach, own.pan);
    let distance_mm = move |t: f64| (start_mm - approach * t).max(450.0);
    let sweep = move |t: f64| reach * (TAU * t / duration).sin();
    let crossing = Crossing::new(stage);
    let side = move |t: f64| size * start_mm / distance_mm(t);
    let target = move |t: f64| {
        let center = crossing.target(t);
        Some(BBox::from_center_size(Point::new(center.x - sweep(t), center.y), side(t), side(t)))
    };
    let mut world = world(stage, Box::new(target));
    let meeting_side = side(MEETING * duration);
    let occluder = crossing.occluder(stage, own, meeting_side);
    let before = move |t: f64| {
        let bbox = occluder(t);
        Some(bbox.translated(-sweep(t), 0.0))
    };
    let first = occluder(0.0);
    let look = match own.occluder {
        Occluder::Similar => paint::patch(seed, resolution(size), 0.15),
        Occluder::Board => paint::bar(seed, first.width().ceil() as usize, first.height().ceil() as usize),
    };
    if own.cover > 0.0 {
        world.before.push(Thing { look, path: Box::new(before) });
    }
    let margin = own.pan.ceil() + 2.0;
    let (width, height) = stage.extent();
    world.backdrop = paint::background(seed, (width + 2.0 * margin) as usize, height as usize + 2);
    world.camera = Box::new(move |t| Point::new(margin + sweep(t), 0.0));
    world.light = light(stage, own.light);
    world.depth = Some(sensor(stage, depth, own, Box::new(distance_mm), margin));
    Box::new(world)
}

/// How the patch and what covers it go.
#[derive(Clone, Copy)]
struct Crossing {
    from: Point,
    /// To the right, pixels per second; negative to the left.
    speed: f64,
    /// Slow way up and down, pixels.
    sway: f64,
    phase: f64,
    meets_s: f64,
}

impl Crossing {
    fn new(stage: Stage<'_>) -> Self {
        let (seed, size, (width, height)) = (stage.seed, stage.patch.size, stage.extent());
        let rightwards = hash::unit(seed, 91) < 0.5;
        let margin = 0.8 * size;
        let speed = stage.speed * hash::between(seed, 92, 0.8, 1.2);
        let from =
            Point::new(if rightwards { margin } else { width - margin }, height * hash::between(seed, 93, 0.4, 0.6));
        Self {
            from,
            speed: if rightwards { speed } else { -speed },
            sway: 0.25 * size,
            phase: hash::between(seed, 94, 0.0, TAU),
            meets_s: MEETING * stage.picture.duration,
        }
    }

    fn target(&self, t: f64) -> Point {
        Point::new(self.from.x + self.speed * t, self.from.y + self.sway * (0.9 * t + self.phase).sin())
    }

    /// What comes the other way: so wide that a patch of `side` pixels is covered for as long as asked.
    fn occluder(
        self,
        stage: Stage<'_>,
        own: &RgbdOcclusion,
        side: f64,
    ) -> impl Fn(f64) -> BBox + Send + Sync + Copy + use<> {
        let speed = -self.speed * hash::between(stage.seed, 95, 0.3, 1.2);
        let covered_s = f64::from(own.hidden) / stage.picture.fps;
        let width = side + (self.speed - speed).abs() * covered_s + 2.0;
        let height = 2.2 * side;
        let meeting = self.target(self.meets_s);
        // Covered from above or from below as far as asked.
        let from_above = hash::unit(stage.seed, 96) < 0.5;
        let cover = own.cover;
        let offset = if cover >= 1.0 {
            0.0
        } else {
            (side / 2.0 + height / 2.0 - cover * side) * if from_above { -1.0 } else { 1.0 }
        };
        let meets_s = self.meets_s;
        move |t| {
            let x = meeting.x + speed * (t - meets_s);
            BBox::from_center_size(Point::new(x, meeting.y + offset), width, height)
        }
    }
}

/// Gains of red, green and blue.
fn light(stage: Stage<'_>, light: Light) -> Box<dyn Fn(f64) -> crate::texture::Color + Send + Sync> {
    let (seed, fps) = (stage.seed, stage.picture.fps);
    Box::new(move |t| {
        let gain = match light {
            Light::Steady => 1.0,
            Light::Dark => 0.1,
            Light::Flicker => hash::between(seed ^ 0xf11c, (t * fps).round() as i64 as u64, 0.1, 1.0),
            Light::Black => 0.0,
        };
        [gain as f32; 3]
    })
}

fn sensor(
    stage: Stage<'_>,
    depth: &Depth,
    own: &RgbdOcclusion,
    target_mm: Box<dyn Fn(f64) -> f64 + Send + Sync>,
    margin: f64,
) -> DepthSensor {
    let (width, height) = (stage.extent().0 + 2.0 * margin, stage.extent().1);
    let wall_mm = depth.distance + 1600.0;
    let clutter = |k: u64| {
        let at = |n: u64, low: f64, high: f64| hash::between(hash::mix(stage.seed, 0xc1a7), 16 * k + n, low, high);
        let center = Point::new(at(0, 0.0, width), at(1, 0.0, height));
        let bbox = BBox::from_center_size(center, at(2, 20.0, 90.0), at(3, 20.0, 90.0));
        // Behind the patch, before the wall.
        (bbox, wall_mm - at(4, 400.0, 1100.0))
    };
    DepthSensor {
        target_mm,
        nearer_mm: depth.nearer,
        holes: depth.holes,
        relief_mm: own.relief,
        wall_mm: Some(wall_mm),
        clutter: (0..own.clutter).map(clutter).collect(),
        quantised: own.quantised,
    }
}
