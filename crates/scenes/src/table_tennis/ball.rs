use super::camera::{HEIGHT_M, project};
use super::{Path, TableTennis, World};
use crate::compose::Layer;
use crate::texture::{Color, scaled, smooth_step};
use pursuit_geometry::{BBox, Point};

/// Half of the 40 mm of the rules.
pub(super) const RADIUS_M: f64 = 0.02;
/// Moments at which an exposure is sampled.
const EXPOSURE_SAMPLES: u32 = 12;
/// The lamp's direction in the camera's axes (right, up, towards the camera), length 1.
const LAMP: [f64; 3] = [-0.424, 0.755, 0.5];
/// Halfway between lamp and viewer, length 1: where the highlight sits.
const HIGHLIGHT: [f64; 3] = [-0.245, 0.436, 0.866];

/// A ball: a path and a colour.
pub(super) struct Ball {
    pub(super) path: Path,
    pub(super) color: Color,
}

/// A ball's picture at one instant: centre and radius in pixels.
#[derive(Clone, Copy)]
struct Disc {
    center: Point,
    radius_px: f64,
}

impl Ball {
    /// The box around the ball at `time_s`.
    pub(super) fn extent(&self, time_s: f64) -> BBox {
        let disc = self.disc(time_s);
        BBox::from_center_size(disc.center, 2.0 * disc.radius_px, 2.0 * disc.radius_px)
    }

    fn disc(&self, time_s: f64) -> Disc {
        let (center, scale) = project(self.path.at(time_s));
        Disc { center, radius_px: RADIUS_M * scale }
    }

    /// The ball, averaged over the exposure about `time_s`.
    pub(super) fn layer(&self, time_s: f64, exposure_s: f64) -> Layer {
        let discs: Vec<Disc> = instants(time_s, exposure_s).map(|t| self.disc(t)).collect();
        let share = 1.0 / discs.len() as f32;
        Layer::paint(bounds(&discs, 1.0), TableTennis::SIZE, |x, y| {
            let mut sum = [0.0; 4];
            for disc in &discs {
                let sample = self.sample(disc, x as f64 + 0.5, y as f64 + 0.5);
                sum = std::array::from_fn(|c| sum[c] + share * sample[c]);
            }
            sum
        })
    }

    /// Colour times opacity, and opacity, of the pixel whose centre is `(x, y)`.
    fn sample(&self, disc: &Disc, x: f64, y: f64) -> [f32; 4] {
        let (dx, dy) = (x - disc.center.x, disc.center.y - y);
        let distance = dx.hypot(dy);
        let cover = (disc.radius_px - distance + 0.5).clamp(0.0, 1.0);
        if cover <= 0.0 {
            return [0.0; 4];
        }
        // The outermost, partly covered pixels take the shade of the rim.
        let (nx, ny) = (dx / disc.radius_px, dy / disc.radius_px);
        let shrink = 1.0 / (nx.hypot(ny)).max(1.0);
        let (nx, ny) = (nx * shrink, ny * shrink);
        let normal = [nx, ny, (1.0 - nx * nx - ny * ny).max(0.0).sqrt()];
        let dot = |d: [f64; 3]| d.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>();
        let lit = 0.60 + 0.42 * dot(LAMP).max(0.0) + 0.05 * ny;
        let gloss = 70.0 * dot(HIGHLIGHT).max(0.0).powi(40);
        let color = scaled(self.color, lit as f32);
        let cover = cover as f32;
        [0, 1, 2, 3].map(|c| if c == 3 { cover } else { (color[c] + gloss as f32) * cover })
    }

    /// Its shadow on the table: black with soft edges, wider and weaker the higher the ball flies.
    pub(super) fn shadow(&self, time_s: f64, exposure_s: f64) -> Layer {
        let shadows: Vec<Shadow> =
            instants(time_s, exposure_s).step_by(3).map(|t| Shadow::of(self.path.at(t))).collect();
        let discs: Vec<Disc> =
            shadows.iter().map(|s| Disc { center: s.center, radius_px: s.radius_px * 1.5 }).collect();
        let share = 1.0 / shadows.len() as f32;
        Layer::paint(bounds(&discs, 1.0), TableTennis::SIZE, |x, y| {
            let point = Point::new(x as f64 + 0.5, y as f64 + 0.5);
            [0.0, 0.0, 0.0, shadows.iter().map(|s| share * s.darkness(point)).sum()]
        })
    }
}

/// Evenly spaced moments of the exposure about `time_s`.
fn instants(time_s: f64, exposure_s: f64) -> impl Iterator<Item = f64> {
    let count = if exposure_s > 0.0 { EXPOSURE_SAMPLES } else { 1 };
    (0..count).map(move |k| time_s + exposure_s * ((f64::from(k) + 0.5) / f64::from(count) - 0.5))
}

/// The rectangle around all discs, `margin` pixels wider on each side.
fn bounds(discs: &[Disc], margin: f64) -> [f64; 4] {
    let outermost = |reach: &dyn Fn(&Disc) -> f64| {
        discs.iter().map(|d| reach(d) + d.radius_px + margin).fold(f64::NEG_INFINITY, f64::max)
    };
    let (left, top) = (-outermost(&|d| -d.center.x), -outermost(&|d| -d.center.y));
    [left, top, outermost(&|d| d.center.x), outermost(&|d| d.center.y)]
}

struct Shadow {
    center: Point,
    radius_px: f64,
    /// Height of the ellipse over its width.
    flatness: f64,
    strength: f64,
}

impl Shadow {
    /// The shadow of a ball at `p` under a large lamp, above and to the left.
    fn of(p: World) -> Self {
        let above = p.y - RADIUS_M;
        let ground = World { x: p.x + 0.35 * p.y, y: 0.0, z: p.z + 0.12 * p.y };
        let (center, scale) = project(ground);
        let radius_m = RADIUS_M + 0.10 * above;
        let flatness = HEIGHT_M / ground.z.hypot(HEIGHT_M);
        Self { center, radius_px: radius_m * scale, flatness, strength: 0.62 * (RADIUS_M / radius_m).powf(1.3) }
    }

    fn darkness(&self, at: Point) -> f32 {
        let distance = (at.x - self.center.x).hypot((at.y - self.center.y) / self.flatness) / self.radius_px;
        (self.strength * (1.0 - smooth_step(0.5, 1.45, distance))) as f32
    }
}
