use super::paint;
use super::world::{Path, Thing, World};
use crate::Scene;
use crate::hash;
use crate::keys::Scenery;
use pursuit_geometry::{BBox, Point, Size};
use std::f64::consts::TAU;

/// A world in which nothing happens yet: the patch follows `path`.
pub(super) fn world(scenery: &Scenery, path: Path) -> World {
    let seed = scenery.seed;
    let size = Size::new(scenery.get("width") as usize, scenery.get("height") as usize);
    World {
        size,
        fps: scenery.get("fps"),
        duration_s: scenery.get("duration"),
        seed,
        noise: scenery.get("noise"),
        backdrop: paint::background(seed, size.width, size.height),
        camera: Box::new(|_| Point::new(0.0, 0.0)),
        behind: Vec::new(),
        targets: vec![Thing { look: look(scenery, 0.0), path }],
        before: Vec::new(),
        light: Box::new(|_| [1.0; 3]),
        depth: None,
    }
}

fn look(scenery: &Scenery, variation: f64) -> crate::texture::Texture {
    if scenery.get("plain") >= 0.5 {
        return paint::plain();
    }
    // A texture of about the patch's own resolution: bilinear sampling then neither blurs nor aliases.
    paint::patch(scenery.seed, scenery.get("size").ceil().clamp(16.0, 256.0) as usize, variation)
}

/// A smooth endless loop about the picture's middle (two sines whose periods do not divide), at `speed` on average.
pub(super) fn wander(scenery: &Scenery, reach: f64) -> impl Fn(f64) -> Point + Send + Sync + use<> {
    let (width, height) = (scenery.get("width"), scenery.get("height"));
    let margin = scenery.get("size") * 0.75;
    let amplitude_x = (width / 2.0 - margin).max(1.0) * reach;
    let amplitude_y = (height / 2.0 - margin).max(1.0) * reach;
    let phase = |k| hash::between(scenery.seed, k, 0.0, TAU);
    let (phase_x, phase_y) = (phase(31), phase(32));
    // The root mean square speed of two sines is √((a ω_x)² / 2 + (b ω_y)² / 2).
    let ratio = 0.77;
    let omega = scenery.get("speed") / (amplitude_x.hypot(amplitude_y * ratio) / 2f64.sqrt());
    move |t| {
        let (x, y) = ((omega * t + phase_x).sin(), (ratio * omega * t + phase_y).sin());
        Point::new(width / 2.0 + amplitude_x * x, height / 2.0 + amplitude_y * y)
    }
}

pub(super) fn boxed(center: impl Fn(f64) -> Point + Send + Sync + 'static, side: f64) -> Path {
    Box::new(move |t| Some(BBox::from_center_size(center(t), side, side)))
}

pub(crate) fn drift(scenery: &Scenery) -> Box<dyn Scene> {
    Box::new(world(scenery, boxed(wander(scenery, 0.9), scenery.get("size"))))
}

pub(crate) fn motionless(scenery: &Scenery) -> Box<dyn Scene> {
    let at = wander(scenery, 0.7)(0.0);
    Box::new(world(scenery, boxed(move |_| at, scenery.get("size"))))
}

pub(crate) fn low_frame_rate(scenery: &Scenery) -> Box<dyn Scene> {
    drift(scenery)
}

pub(crate) fn scale_ramp(scenery: &Scenery) -> Box<dyn Scene> {
    let (size, growth, duration) = (scenery.get("size"), scenery.get("growth"), scenery.get("duration"));
    let center = wander(scenery, 0.4);
    let side = move |t: f64| size * growth.powf((t / duration).clamp(0.0, 1.0));
    Box::new(world(scenery, Box::new(move |t| Some(BBox::from_center_size(center(t), side(t), side(t))))))
}

pub(crate) fn occluding_bar(scenery: &Scenery) -> Box<dyn Scene> {
    let (width, height, size) = (scenery.get("width"), scenery.get("height"), scenery.get("size"));
    let amplitude = (width / 2.0 - size * 0.75).max(1.0);
    let omega = scenery.get("speed") / amplitude;
    let row = height * hash::between(scenery.seed, 41, 0.35, 0.65);
    // Starts at a turning point beside the bar and passes behind it at full speed.
    let path =
        move |t: f64| Point::new(width / 2.0 - amplitude * (omega * t).cos(), row + 0.06 * height * (1.7 * t).sin());
    let mut world = world(scenery, boxed(path, size));
    let bar = scenery.get("bar");
    let place = BBox::from_center_size(Point::new(width / 2.0, height / 2.0), bar, height);
    let look = paint::bar(scenery.seed, bar.ceil() as usize, height as usize);
    world.before.push(Thing { look, path: Box::new(move |_| Some(place)) });
    Box::new(world)
}

pub(crate) fn lighting_step(scenery: &Scenery) -> Box<dyn Scene> {
    let mut world = world(scenery, boxed(wander(scenery, 0.8), scenery.get("size")));
    let (gain, half) = (scenery.get("gain") as f32, scenery.get("duration") / 2.0);
    world.light = Box::new(move |t| if t < half { [1.0; 3] } else { [gain; 3] });
    Box::new(world)
}

pub(crate) fn camera_pan(scenery: &Scenery) -> Box<dyn Scene> {
    let seed = scenery.seed;
    let (fps, shake) = (scenery.get("fps"), scenery.get("shake"));
    // One sweep to and fro in the scene's duration; 2.5 sweeps a minute at most, so that slow pans stay slow.
    let omega = TAU / scenery.get("duration").clamp(2.0, 24.0);
    let sweep = scenery.get("pan") / omega;
    let tremble = move |t: f64, axis: u64| {
        let frame = (t * fps).round() as i64 as u64;
        shake * hash::normal(hash::mix(seed, 51 + axis), frame).clamp(-3.0, 3.0)
    };
    let margin = sweep + 3.0 * shake + 2.0;
    let camera =
        move |t: f64| Point::new(margin - sweep * (omega * t).cos() + tremble(t, 0), 3.0 * shake + 2.0 + tremble(t, 1));
    // The patch lives in the world: what shakes the camera shakes it, what the camera follows it follows in part.
    let wander = wander(scenery, 0.55);
    let path = move |t: f64| {
        let p = wander(t);
        Point::new(p.x - tremble(t, 0), p.y - tremble(t, 1))
    };
    let mut world = world(scenery, boxed(path, scenery.get("size")));
    let (width, height) = (world.size.width as f64 + 2.0 * margin, world.size.height as f64 + 6.0 * shake + 4.0);
    world.backdrop = paint::background(seed, width.ceil() as usize, height.ceil() as usize);
    world.camera = Box::new(camera);
    Box::new(world)
}

pub(crate) fn look_alike(scenery: &Scenery) -> Box<dyn Scene> {
    let (size, gap, duration) = (scenery.get("size"), scenery.get("gap"), scenery.get("duration"));
    let target = wander(scenery, 0.35);
    let center = wander(scenery, 0.35);
    let mut world = world(scenery, boxed(target, size));
    let span = world.size.width as f64 * 0.9;
    // Relative to the target it passes from far left to far right, closest at half time.
    let path = move |t: f64| {
        let p = center(t);
        Point::new(p.x + span * (t / duration - 0.5), p.y + gap * size)
    };
    let other = if scenery.get("plain") >= 0.5 { 1.0 } else { scenery.get("difference") };
    let look = paint::patch(scenery.seed, size.ceil().clamp(16.0, 256.0) as usize, other);
    world.behind.push(Thing { look, path: boxed(path, size) });
    Box::new(world)
}

pub(crate) fn leave_and_return(scenery: &Scenery) -> Box<dyn Scene> {
    let (size, fps, away) = (scenery.get("size"), scenery.get("fps"), scenery.get("away"));
    // Frames decide, not seconds: exactly `absent` frames without it at the nominal rate.
    let gone = (scenery.get("leaves") * fps).round();
    let back = gone + scenery.get("absent");
    let (width, height) = (scenery.get("width"), scenery.get("height"));
    let (speed, phase) = (scenery.get("speed"), hash::between(scenery.seed, 61, 0.0, TAU));
    let start = Point::new((width - away) / 2.0, height / 2.0);
    // A small circle: the patch is where it was, `away` further on, whatever the time between.
    let radius = (start.x.min(height / 2.0) - size * 0.75).clamp(1.0, 30.0);
    let circle = move |frames: f64| {
        let angle = phase + speed / radius * frames / fps;
        (radius * angle.cos(), radius * angle.sin())
    };
    let path = move |t: f64| {
        let frame = (t * fps).round();
        let before = frame < gone;
        if !before && frame < back {
            return None;
        }
        // Time stands still while it is gone, so that it returns exactly `away` from where it vanished.
        let (frames, shift) = if before { (t * fps, 0.0) } else { (t * fps - (back - gone + 1.0), away) };
        let (x, y) = circle(frames);
        Some(BBox::from_center_size(Point::new(start.x + x + shift, start.y + y), size, size))
    };
    let mut world = world(scenery, Box::new(path));
    if scenery.get("look-alike") >= 0.5 {
        // It stands a little below the place where the patch was last seen, as long as the patch is away.
        let (x, y) = circle(gone - 1.0);
        let place = Point::new(start.x + x, (start.y + y + 1.6 * size).min(height - 0.6 * size));
        let there = move |t: f64| (gone..back).contains(&(t * fps).round());
        let path = move |t: f64| there(t).then(|| BBox::from_center_size(place, size, size));
        world.behind.push(Thing { look: look(scenery, scenery.get("difference")), path: Box::new(path) });
    }
    Box::new(world)
}

/// Each patch wanders about its own part of the picture, so that all can be seen all the time.
pub(crate) fn crowd(scenery: &Scenery) -> Box<dyn Scene> {
    let (width, height) = (scenery.get("width"), scenery.get("height"));
    let count = scenery.get("targets") as usize;
    let columns = ((count as f64 * width / height).sqrt().ceil() as usize).clamp(1, count);
    let rows = count.div_ceil(columns);
    let part = (width / columns as f64, height / rows as f64);
    let patch = |k: usize| {
        let seed = hash::mix(scenery.seed, 71 + k as u64);
        let random = |index, low, high| hash::between(seed, index, low, high);
        let side = (scenery.get("size") * random(1, 0.6, 1.5)).min(0.9 * part.0.min(part.1));
        let (wide, tall) = (side * random(2, 0.8, 1.0), side * random(3, 0.8, 1.0));
        let middle = ((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5);
        let reach = (((part.0 - wide) / 2.0).max(0.5), ((part.1 - tall) / 2.0).max(0.5));
        // As in `wander`: two sines whose periods do not divide.
        let ratio = 0.77;
        let omega = scenery.get("speed") * random(4, 0.7, 1.3) / (reach.0.hypot(reach.1 * ratio) / 2f64.sqrt());
        let phase = (random(5, 0.0, TAU), random(6, 0.0, TAU));
        let path = move |t: f64| {
            let (x, y) = ((omega * t + phase.0).sin(), (ratio * omega * t + phase.1).sin());
            let center = Point::new(middle.0 * part.0 + reach.0 * x, middle.1 * part.1 + reach.1 * y);
            Some(BBox::from_center_size(center, wide, tall))
        };
        let look = match scenery.get("plain") >= 0.5 {
            true => paint::plain(),
            false => paint::patch(seed, side.ceil().clamp(16.0, 256.0) as usize, 0.0),
        };
        Thing { look, path: Box::new(path) }
    };
    let mut world = world(scenery, Box::new(|_| None));
    world.targets = (0..count).map(patch).collect();
    Box::new(world)
}
