use super::paint;
use super::params::{
    CameraPan, Common, Crowd, LeaveAndReturn, LightingStep, LookAlike, OccludingBar, Patch, ScaleRamp, Second,
};
use super::world::{Path, Thing, World};
use crate::plan::Picture;
use crate::{Scene, hash};
use pursuit_geometry::{BBox, Point, Size};
use std::f64::consts::TAU;

/// A seed with what all scenes of patches have.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub(super) seed: u64,
    pub(super) picture: &'a Picture,
    pub(super) patch: &'a Patch,
    pub(super) speed: f64,
}

impl<'a> Stage<'a> {
    pub(super) fn new(seed: u64, (picture, patch, speed): &'a Common) -> Self {
        Self { seed, picture, patch, speed: speed.speed }
    }

    /// Width and height of the picture.
    pub(super) const fn extent(&self) -> (f64, f64) {
        (self.picture.width as f64, self.picture.height as f64)
    }
}

/// A world in which nothing happens yet: the patch follows `path`.
pub(super) fn world(stage: Stage<'_>, path: Path) -> World {
    let Stage { seed, picture, .. } = stage;
    let size = Size::new(picture.width, picture.height);
    World {
        size,
        fps: picture.fps,
        duration_s: picture.duration,
        seed,
        noise: picture.noise,
        backdrop: paint::background(seed, size.width, size.height),
        camera: Box::new(|_| Point::new(0.0, 0.0)),
        behind: Vec::new(),
        targets: vec![Thing { look: look(stage, 0.0), path }],
        before: Vec::new(),
        light: Box::new(|_| [1.0; 3]),
        depth: None,
    }
}

fn look(stage: Stage<'_>, variation: f64) -> crate::texture::Texture {
    if stage.patch.plain {
        return paint::plain();
    }
    // A texture of about the patch's own resolution: bilinear sampling then neither blurs nor aliases.
    paint::patch(stage.seed, resolution(stage.patch.size), variation)
}

/// Rows and columns of the texture of a patch whose side is `size` pixels.
pub(super) fn resolution(size: f64) -> usize {
    size.ceil().clamp(16.0, 256.0) as usize
}

/// A smooth endless loop about the picture's middle (two sines whose periods do not divide), at `speed` on average.
pub(super) fn wander(stage: Stage<'_>, reach: f64) -> impl Fn(f64) -> Point + Send + Sync + use<> {
    let (width, height) = stage.extent();
    let margin = stage.patch.size * 0.75;
    let amplitude_x = (width / 2.0 - margin).max(1.0) * reach;
    let amplitude_y = (height / 2.0 - margin).max(1.0) * reach;
    let phase = |k| hash::between(stage.seed, k, 0.0, TAU);
    let (phase_x, phase_y) = (phase(31), phase(32));
    // The root mean square speed of two sines is √((a ω_x)² / 2 + (b ω_y)² / 2).
    let ratio = 0.77;
    let omega = stage.speed / (amplitude_x.hypot(amplitude_y * ratio) / 2f64.sqrt());
    move |t| {
        let (x, y) = ((omega * t + phase_x).sin(), (ratio * omega * t + phase_y).sin());
        Point::new(width / 2.0 + amplitude_x * x, height / 2.0 + amplitude_y * y)
    }
}

pub(super) fn boxed(center: impl Fn(f64) -> Point + Send + Sync + 'static, side: f64) -> Path {
    Box::new(move |t| Some(BBox::from_center_size(center(t), side, side)))
}

pub(crate) fn drift(seed: u64, common: &Common) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    Box::new(world(stage, boxed(wander(stage, 0.9), stage.patch.size)))
}

pub(crate) fn motionless(seed: u64, (picture, patch): &(Picture, Patch)) -> Box<dyn Scene> {
    let stage = Stage { seed, picture, patch, speed: 0.0 };
    let at = wander(stage, 0.7)(0.0);
    Box::new(world(stage, boxed(move |_| at, patch.size)))
}

pub(crate) fn scale_ramp(seed: u64, (common, own): &(Common, ScaleRamp)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let (size, growth, duration) = (stage.patch.size, own.growth, stage.picture.duration);
    let center = wander(stage, 0.4);
    let side = move |t: f64| size * growth.powf((t / duration).clamp(0.0, 1.0));
    Box::new(world(stage, Box::new(move |t| Some(BBox::from_center_size(center(t), side(t), side(t))))))
}

pub(crate) fn occluding_bar(seed: u64, (common, own): &(Common, OccludingBar)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let ((width, height), size) = (stage.extent(), stage.patch.size);
    let amplitude = (width / 2.0 - size * 0.75).max(1.0);
    let omega = stage.speed / amplitude;
    let row = height * hash::between(seed, 41, 0.35, 0.65);
    // Starts at a turning point beside the bar and passes behind it at full speed.
    let path =
        move |t: f64| Point::new(width / 2.0 - amplitude * (omega * t).cos(), row + 0.06 * height * (1.7 * t).sin());
    let mut world = world(stage, boxed(path, size));
    let bar = own.bar;
    let place = BBox::from_center_size(Point::new(width / 2.0, height / 2.0), bar, height);
    let look = paint::bar(seed, bar.ceil() as usize, height as usize);
    world.before.push(Thing { look, path: Box::new(move |_| Some(place)) });
    Box::new(world)
}

pub(crate) fn lighting_step(seed: u64, (common, own): &(Common, LightingStep)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let mut world = world(stage, boxed(wander(stage, 0.8), stage.patch.size));
    let (gain, half) = (own.gain as f32, stage.picture.duration / 2.0);
    world.light = Box::new(move |t| if t < half { [1.0; 3] } else { [gain; 3] });
    Box::new(world)
}

pub(crate) fn camera_pan(seed: u64, (common, own): &(Common, CameraPan)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let (fps, shake) = (stage.picture.fps, own.shake);
    // One sweep to and fro in the scene's duration; 2.5 sweeps a minute at most, so that slow pans stay slow.
    let omega = TAU / stage.picture.duration.clamp(2.0, 24.0);
    let sweep = own.pan / omega;
    let tremble = move |t: f64, axis: u64| {
        let frame = (t * fps).round() as i64 as u64;
        shake * hash::normal(hash::mix(seed, 51 + axis), frame).clamp(-3.0, 3.0)
    };
    let margin = sweep + 3.0 * shake + 2.0;
    let camera =
        move |t: f64| Point::new(margin - sweep * (omega * t).cos() + tremble(t, 0), 3.0 * shake + 2.0 + tremble(t, 1));
    // The patch lives in the world: what shakes the camera shakes it, what the camera follows it follows in part.
    let wander = wander(stage, 0.55);
    let path = move |t: f64| {
        let p = wander(t);
        Point::new(p.x - tremble(t, 0), p.y - tremble(t, 1))
    };
    let mut world = world(stage, boxed(path, stage.patch.size));
    let (width, height) = (world.size.width as f64 + 2.0 * margin, world.size.height as f64 + 6.0 * shake + 4.0);
    world.backdrop = paint::background(seed, width.ceil() as usize, height.ceil() as usize);
    world.camera = Box::new(camera);
    Box::new(world)
}

pub(crate) fn look_alike(seed: u64, (common, second, own): &(Common, Second, LookAlike)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let (size, gap, duration) = (stage.patch.size, own.gap, stage.picture.duration);
    let target = wander(stage, 0.35);
    let center = wander(stage, 0.35);
    let mut world = world(stage, boxed(target, size));
    let span = world.size.width as f64 * 0.9;
    // Relative to the target it passes from far left to far right, closest at half time.
    let path = move |t: f64| {
        let p = center(t);
        Point::new(p.x + span * (t / duration - 0.5), p.y + gap * size)
    };
    let other = if stage.patch.plain { 1.0 } else { second.difference };
    let look = paint::patch(seed, resolution(size), other);
    world.behind.push(Thing { look, path: boxed(path, size) });
    Box::new(world)
}

pub(crate) fn leave_and_return(seed: u64, (common, second, own): &(Common, Second, LeaveAndReturn)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let (size, fps, away) = (stage.patch.size, stage.picture.fps, own.away);
    // Frames decide, not seconds: exactly `absent` frames without it at the nominal rate.
    let gone = (own.leaves * fps).round();
    let back = gone + f64::from(own.absent);
    let (width, height) = stage.extent();
    let (speed, phase) = (stage.speed, hash::between(seed, 61, 0.0, TAU));
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
    let mut world = world(stage, Box::new(path));
    if own.look_alike {
        // It stands a little below the place where the patch was last seen, as long as the patch is away.
        let (x, y) = circle(gone - 1.0);
        let place = Point::new(start.x + x, (start.y + y + 1.6 * size).min(height - 0.6 * size));
        let there = move |t: f64| (gone..back).contains(&(t * fps).round());
        let path = move |t: f64| there(t).then(|| BBox::from_center_size(place, size, size));
        world.behind.push(Thing { look: look(stage, second.difference), path: Box::new(path) });
    }
    Box::new(world)
}

/// Each patch wanders about its own part of the picture, so that all can be seen all the time.
pub(crate) fn crowd(seed: u64, (common, own): &(Common, Crowd)) -> Box<dyn Scene> {
    let stage = Stage::new(seed, common);
    let ((width, height), count) = (stage.extent(), own.targets);
    let columns = ((count as f64 * width / height).sqrt().ceil() as usize).clamp(1, count);
    let rows = count.div_ceil(columns);
    let part = (width / columns as f64, height / rows as f64);
    let patch = |k: usize| {
        let seed = hash::mix(seed, 71 + k as u64);
        let random = |index, low, high| hash::between(seed, index, low, high);
        let side = (stage.patch.size * random(1, 0.6, 1.5)).min(0.9 * part.0.min(part.1));
        let (wide, tall) = (side * random(2, 0.8, 1.0), side * random(3, 0.8, 1.0));
        let middle = ((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5);
        let reach = (((part.0 - wide) / 2.0).max(0.5), ((part.1 - tall) / 2.0).max(0.5));
        // As in `wander`: two sines whose periods do not divide.
        let ratio = 0.77;
        let omega = stage.speed * random(4, 0.7, 1.3) / (reach.0.hypot(reach.1 * ratio) / 2f64.sqrt());
        let phase = (random(5, 0.0, TAU), random(6, 0.0, TAU));
        let path = move |t: f64| {
            let (x, y) = ((omega * t + phase.0).sin(), (ratio * omega * t + phase.1).sin());
            let center = Point::new(middle.0 * part.0 + reach.0 * x, middle.1 * part.1 + reach.1 * y);
            Some(BBox::from_center_size(center, wide, tall))
        };
        let look = if stage.patch.plain { paint::plain() } else { paint::patch(seed, resolution(side), 0.0) };
        Thing { look, path: Box::new(path) }
    };
    let mut world = world(stage, Box::new(|_| None));
    world.targets = (0..count).map(patch).collect();
    Box::new(world)
}
