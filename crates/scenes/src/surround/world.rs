use super::body::{BALL_RADIUS_M, Body, Limb};
use super::room::{CAMERA_M, Room, door_directions, open_door};
use super::{Path, Stand};
use crate::compose::{Layer, Noise, develop};
use crate::texture::{Color, smooth_step};
use crate::view::bounds;
use crate::{Scene, SceneMoment, TargetTruth, View};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Direction;

/// Somebody who goes about.
pub(super) struct Actor {
    pub(super) body: Body,
    pub(super) path: Path,
}

/// A room with people around a camera on a pan-tilt head.
pub(super) struct Surround {
    pub(super) size: Size,
    pub(super) fps: f64,
    pub(super) duration_s: f64,
    pub(super) home: View,
    pub(super) seed: u64,
    pub(super) noise: f64,
    pub(super) room: Room,
    /// All are targets; the first is the one to follow.
    pub(super) actors: Vec<Actor>,
    /// How dark shadows are, 0 to 1.
    pub(super) shadow: f64,
    /// When the door opens, in seconds.
    pub(super) door_s: Option<f64>,
    pub(super) light: Box<dyn Fn(f64) -> Color + Send + Sync>,
}

/// How long the door takes to open, in seconds.
const OPENING_S: f64 = 0.8;
/// Points at which it is asked whether they can be seen, across and down a target.
const PROBES: (u32, u32) = (24, 48);

/// An actor at one moment.
struct Present<'a> {
    actor: &'a Actor,
    stand: Stand,
    limbs: Vec<Limb>,
    /// Its number among the targets.
    index: usize,
}

impl Scene for Surround {
    fn size(&self) -> Size {
        self.size
    }

    fn fps(&self) -> f64 {
        self.fps
    }

    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn home(&self) -> View {
        self.home
    }

    fn render_view(&self, time_s: f64, view: &View) -> SceneMoment {
        let present = self.present(time_s);
        let mut layers: Vec<Layer> = self.open_door(time_s, view).into_iter().collect();
        if self.shadow > 0.0 {
            layers.extend(present.iter().filter_map(|p| p.shadow(self.shadow, view)));
        }
        layers.extend(present.iter().filter_map(|p| p.layer(view)));
        let noise = Noise::of_frame(self.noise, self.seed, time_s, self.fps);
        let image = develop(view.size, (self.light)(time_s), noise, |y, row| {
            for (x, to) in row.iter_mut().enumerate() {
                *to = self.room.sample(view.direction_of(Point::new(x as f64 + 0.5, y as f64 + 0.5)));
            }
            layers.iter().for_each(|layer| layer.blend_row(y, row));
        });
        SceneMoment { image, depth_mm: None, targets: self.truths(&present, view) }
    }

    fn targets_in_view(&self, time_s: f64, view: &View) -> Vec<TargetTruth> {
        self.truths(&self.present(time_s), view)
    }
}

impl Surround {
    /// Who is there, the farthest first.
    fn present(&self, time_s: f64) -> Vec<Present<'_>> {
        let mut present = Vec::with_capacity(self.actors.len());
        for (index, actor) in self.actors.iter().enumerate() {
            if let Some(stand) = (actor.path)(time_s) {
                present.push(Present { actor, stand, limbs: actor.body.limbs(&stand), index });
            }
        }
        present.sort_by(|a, b| b.stand.distance_m.total_cmp(&a.stand.distance_m));
        present
    }

    fn truths(&self, present: &[Present<'_>], view: &View) -> Vec<TargetTruth> {
        let mut truths = vec![TargetTruth::ABSENT; self.actors.len()];
        for (k, p) in present.iter().enumerate() {
            truths[p.index] = p.truth(&present[k + 1..], view);
        }
        truths
    }

    fn open_door(&self, time_s: f64, view: &View) -> Option<Layer> {
        let share = smooth_step(0.0, OPENING_S, time_s - self.door_s?);
        let seen = bounds(door_directions().into_iter().map(|d| view.point_of(d)))?.expanded(4.0);
        (share > 0.0).then(|| layer(&seen, view, |direction| open_door(share, direction)))
    }
}

/// A layer over the pixels of `seen`, coloured by direction.
fn layer(seen: &BBox, view: &View, color: impl Fn(Direction) -> [f32; 4]) -> Layer {
    Layer::paint([seen.left(), seen.top(), seen.right(), seen.bottom()], view.size, |x, y| {
        color(view.direction_of(Point::new(x as f64 + 0.5, y as f64 + 0.5)))
    })
}

impl Present<'_> {
    /// The direction of a point of the body: metres to its right, metres above the floor.
    fn direction_of(&self, [across, height]: [f64; 2]) -> Direction {
        let away = self.stand.distance_m;
        Direction { pan_rad: self.stand.pan_rad + across / away, tilt_rad: ((height - CAMERA_M) / away).atan() }
    }

    /// The point of the body's plane that lies in a direction.
    fn body_point(&self, direction: Direction) -> [f64; 2] {
        let away = self.stand.distance_m;
        [(direction.pan_rad - self.stand.pan_rad) * away, CAMERA_M + direction.tilt_rad.tan() * away]
    }

    /// The box around it in the picture's plane; `None` behind the camera.
    fn extent(&self, view: &View) -> Option<BBox> {
        bounds(self.limbs.iter().flat_map(Limb::outline).map(|p| view.point_of(self.direction_of(p))))
    }

    fn layer(&self, view: &View) -> Option<Layer> {
        let seen = self.extent(view)?.expanded(1.0);
        let pixel_m = self.stand.distance_m / view.camera.lens().pinhole_px(view.size)[0];
        let body = &self.actor.body;
        Some(layer(&seen, view, |d| body.sample(&self.limbs, &self.stand, self.body_point(d), pixel_m)))
    }

    fn covers(&self, direction: Direction) -> bool {
        let point = self.body_point(direction);
        self.limbs.iter().any(|limb| limb.depth(point) > 0.0)
    }

    /// A soft shadow on the floor, thrown to the right and towards the camera.
    fn shadow(&self, strength: f64, view: &View) -> Option<Layer> {
        let tall = self.limbs.len() > 1;
        let (long, wide) = if tall { (0.75, 0.26) } else { (0.2, 0.12) };
        let (sin, cos) = self.stand.pan_rad.sin_cos();
        let away = self.stand.distance_m;
        // Axes on the floor at the feet: to the right of the camera's line of sight, and along it.
        let place =
            |right: f64, ahead: f64| (away * sin + right * cos + ahead * sin, away * cos - right * sin + ahead * cos);
        let (x0, z0) = if tall { place(0.35, -0.12) } else { place(BALL_RADIUS_M / 2.0, 0.0) };
        let share = move |x: f64, z: f64| {
            let (dx, dz) = (x - x0, z - z0);
            let (right, ahead) = (dx * cos - dz * sin, dx * sin + dz * cos);
            (right / long).hypot((ahead + 0.3 * right) / wide)
        };
        let rim = (0..32).map(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / 32.0).sin_cos();
            let (right, ahead) = (1.1 * long * c, 1.1 * (wide * s - 0.3 * long * c));
            let (x, z) = (x0 + right * cos + ahead * sin, z0 - right * sin + ahead * cos);
            view.point_of(Direction { pan_rad: x.atan2(z), tilt_rad: (-CAMERA_M).atan2(x.hypot(z)) })
        });
        let seen = bounds(rim)?.expanded(1.0);
        Some(layer(&seen, view, |direction| {
            let below = -direction.tilt_rad.tan();
            let dark = if below > 0.0 {
                let away = CAMERA_M / below;
                let (sin, cos) = direction.pan_rad.sin_cos();
                strength * (1.0 - smooth_step(0.35, 1.0, share(away * sin, away * cos)))
            } else {
                0.0
            };
            [0.0, 0.0, 0.0, dark as f32]
        }))
    }

    /// Its truth, given who stands before it.
    fn truth(&self, before: &[Present<'_>], view: &View) -> TargetTruth {
        let Some(extent) = self.extent(view) else { return TargetTruth::ABSENT };
        let points: Vec<[f64; 2]> = self.limbs.iter().flat_map(Limb::outline).collect();
        let edge =
            |axis: usize, sign: f64| points.iter().map(|p| sign * p[axis]).fold(f64::NEG_INFINITY, f64::max) * sign;
        let (left, right, low, high) = (edge(0, -1.0), edge(0, 1.0), edge(1, -1.0), edge(1, 1.0));
        let picture = view.size.bounds();
        let (mut all, mut seen) = (0u32, 0u32);
        for (i, j) in (0..PROBES.0).flat_map(|i| (0..PROBES.1).map(move |j| (i, j))) {
            let at = |low: f64, high: f64, k: u32, n: u32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(n);
            let point = [at(left, right, i, PROBES.0), at(low, high, j, PROBES.1)];
            if self.limbs.iter().all(|limb| limb.depth(point) <= 0.0) {
                continue;
            }
            all += 1;
            let direction = self.direction_of(point);
            let inside = view.point_of(direction).is_some_and(|p| picture.contains(p));
            seen += u32::from(inside && !before.iter().any(|other| other.covers(direction)));
        }
        TargetTruth { extent: Some(extent), visible_fraction: f64::from(seen) / f64::from(all.max(1)) }
    }
}
