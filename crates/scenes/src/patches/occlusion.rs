//! One patch, one occlusion, at true depths: what depth-aware tracking is measured on.

use super::depth::DepthSensor;
use super::paint;
use super::scenarios::world;
use super::world::Thing;
use crate::keys::Scenery;
use crate::{Scene, hash};
use pursuit_geometry::{BBox, Point};
use std::f64::consts::TAU;

/// When the patch and what covers it meet, as a share of the duration.
const MEETING: f64 = 0.45;

/// A patch crosses the picture before a wall with things standing before it; something nearer comes the other way, and the
/// two meet. The patch's size goes with its distance.
pub(crate) fn rgbd_occlusion(scenery: &Scenery) -> Box<dyn Scene> {
    let seed = scenery.seed;
    let distance_mm = {
        let (start, speed) = (scenery.get("distance"), scenery.get("approach"));
        move |t: f64| (start - speed * t).max(450.0)
    };
    let sweep = {
        let (reach, duration) = (scenery.get("pan"), scenery.get("duration"));
        move |t: f64| reach * (TAU * t / duration).sin()
    };
    let crossing = Crossing::new(scenery);
    let (size, start_mm) = (scenery.get("size"), scenery.get("distance"));
    let side = move |t: f64| size * start_mm / distance_mm(t);
    let target = move |t: f64| {
        let center = crossing.target(t);
        Some(BBox::from_center_size(Point::new(center.x - sweep(t), center.y), side(t), side(t)))
    };
    let mut world = world(scenery, Box::new(target));
    let meeting_side = side(MEETING * scenery.get("duration"));
    let occluder = crossing.occluder(scenery, meeting_side);
    let before = move |t: f64| {
        let bbox = occluder(t);
        Some(bbox.translated(-sweep(t), 0.0))
    };
    let first = occluder(0.0);
    let look = match scenery.get("occluder") as u64 {
        1 => paint::patch(seed, size.ceil().clamp(16.0, 256.0) as usize, 0.15),
        _ => paint::bar(seed, first.width().ceil() as usize, first.height().ceil() as usize),
    };
    if scenery.get("cover") > 0.0 {
        world.before.push(Thing { look, path: Box::new(before) });
    }
    let margin = scenery.get("pan").ceil() + 2.0;
    let (width, height) = (scenery.get("width"), scenery.get("height"));
    world.backdrop = paint::background(seed, (width + 2.0 * margin) as usize, height as usize + 2);
    world.camera = Box::new(move |t| Point::new(margin + sweep(t), 0.0));
    world.light = light(scenery);
    world.depth = Some(sensor(scenery, distance_mm, margin));
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
    fn new(scenery: &Scenery) -> Self {
        let (seed, width, height) = (scenery.seed, scenery.get("width"), scenery.get("height"));
        let rightwards = hash::unit(seed, 91) < 0.5;
        let margin = 0.8 * scenery.get("size");
        let speed = scenery.get("speed") * hash::between(seed, 92, 0.8, 1.2);
        let from =
            Point::new(if rightwards { margin } else { width - margin }, height * hash::between(seed, 93, 0.4, 0.6));
        Self {
            from,
            speed: if rightwards { speed } else { -speed },
            sway: 0.25 * scenery.get("size"),
            phase: hash::between(seed, 94, 0.0, TAU),
            meets_s: MEETING * scenery.get("duration"),
        }
    }

    fn target(&self, t: f64) -> Point {
        Point::new(self.from.x + self.speed * t, self.from.y + self.sway * (0.9 * t + self.phase).sin())
    }

    /// What comes the other way: so wide that a patch of `side` pixels is covered for as long as asked.
    fn occluder(self, scenery: &Scenery, side: f64) -> impl Fn(f64) -> BBox + Send + Sync + Copy + use<> {
        let speed = -self.speed * hash::between(scenery.seed, 95, 0.3, 1.2);
        let covered_s = scenery.get("hidden") / scenery.get("fps");
        let width = side + (self.speed - speed).abs() * covered_s + 2.0;
        let height = 2.2 * side;
        let meeting = self.target(self.meets_s);
        // Covered from above or from below as far as asked.
        let from_above = hash::unit(scenery.seed, 96) < 0.5;
        let cover = scenery.get("cover");
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
fn light(scenery: &Scenery) -> Box<dyn Fn(f64) -> crate::texture::Color + Send + Sync> {
    let (seed, fps) = (scenery.seed, scenery.get("fps"));
    let kind = scenery.get("light") as u64;
    Box::new(move |t| {
        let gain = match kind {
            1 => 0.1,
            2 => hash::between(seed ^ 0xf11c, (t * fps).round() as i64 as u64, 0.1, 1.0),
            3 => 0.0,
            _ => 1.0,
        };
        [gain as f32; 3]
    })
}

fn sensor(scenery: &Scenery, target_mm: impl Fn(f64) -> f64 + Send + Sync + 'static, margin: f64) -> DepthSensor {
    let (seed, width, height) = (scenery.seed, scenery.get("width") + 2.0 * margin, scenery.get("height"));
    let wall_mm = scenery.get("distance") + 1600.0;
    let clutter = |k: u64| {
        let at = |n: u64, low: f64, high: f64| hash::between(hash::mix(seed, 0xc1a7), 16 * k + n, low, high);
        let center = Point::new(at(0, 0.0, width), at(1, 0.0, height));
        let bbox = BBox::from_center_size(center, at(2, 20.0, 90.0), at(3, 20.0, 90.0));
        // Behind the patch, before the wall.
        (bbox, wall_mm - at(4, 400.0, 1100.0))
    };
    DepthSensor {
        target_mm: Box::new(target_mm),
        nearer_mm: scenery.get("nearer"),
        holes: scenery.get("holes"),
        relief_mm: scenery.get("relief"),
        wall_mm: Some(wall_mm),
        clutter: (0..scenery.get("clutter") as u64).map(clutter).collect(),
        quantised: scenery.get("quantised") >= 0.5,
    }
}
