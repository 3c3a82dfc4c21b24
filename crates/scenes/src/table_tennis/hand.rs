use super::TableTennis;
use crate::compose::Layer;
use crate::hash;
use crate::texture::{Texture, fractal_noise, mixed, scaled, smooth_step};

const WIDTH: usize = 190;
const HEIGHT: usize = 330;
/// Where the hand's picture has its top left corner while it hides the ball.
const PLACE: (f64, f64) = (250.0, 204.0);
/// When it begins to come, is there, begins to go, is gone, in seconds.
const COMES_S: (f64, f64) = (4.3, 4.9);
const GOES_S: (f64, f64) = (6.7, 7.3);
/// Where the sleeve begins.
const CUFF_PX: f64 = 205.0;

/// A forearm with a hand that reaches in from below, nearer to the camera than the ball.
pub(super) struct Hand {
    /// Red, green, blue times opacity, and opacity; row by row.
    pixels: Vec<[f32; 4]>,
}

impl Hand {
    pub(super) fn new(seed: u64) -> Self {
        let key = hash::mix(seed, 0x4a9d);
        let opacity = Texture::paint(WIDTH, HEIGHT, 3, |x, y| [f32::from(inside(x, y) > 0.0); 3]);
        let color = Texture::paint(WIDTH, HEIGHT, 1, |x, y| {
            let depth = inside(x, y);
            let grain = fractal_noise(key, x / 9.0, y / 9.0, 3) as f32;
            // Rounder near the rim, lit from the upper left like the rest.
            let bulge = (depth / 30.0).clamp(0.0, 1.0).sqrt();
            let slope = inside(x - 3.0, y - 3.0) - inside(x + 3.0, y + 3.0);
            let lit = 0.66 + 0.34 * bulge - 0.035 * slope.clamp(-6.0, 6.0);
            let skin = [204.0 + 16.0 * grain, 162.0 + 14.0 * grain, 140.0 + 14.0 * grain];
            let weave = 10.0 * fractal_noise(key ^ 3, x / 2.0, y / 5.0, 2) as f32;
            let sleeve = [52.0 + weave, 58.0 + weave, 66.0 + weave];
            let cuff = smooth_step(CUFF_PX - 1.0, CUFF_PX + 1.0, y + 0.04 * x) as f32;
            scaled(mixed(skin, sleeve, cuff), lit as f32)
        });
        let rows = (0..HEIGHT as i64).flat_map(|y| color.row(y).iter().zip(opacity.row(y)));
        Self { pixels: rows.map(|([r, g, b], [a, ..])| [r * a, g * a, b * a, *a]).collect() }
    }

    pub(super) fn layer(&self, time_s: f64) -> Layer {
        let out = 1.0 - smooth_step(COMES_S.0, COMES_S.1, time_s) + smooth_step(GOES_S.0, GOES_S.1, time_s);
        let (left, top) = (PLACE.0 + 60.0 * out, PLACE.1 + 280.0 * out);
        let bounds = [left, top, left + WIDTH as f64, top + HEIGHT as f64];
        // The same sub-pixel shift for every pixel: a picture pixel mixes the four of the hand's that it covers.
        let (u, v) = ((left - left.floor()) as f32, (top - top.floor()) as f32);
        let weights = [(1, 1, u * v), (0, 1, (1.0 - u) * v), (1, 0, u * (1.0 - v)), (0, 0, (1.0 - u) * (1.0 - v))];
        let (left, top) = (left.floor() as i64, top.floor() as i64);
        Layer::paint(bounds, TableTennis::SIZE, |x, y| {
            let mut sum = [0.0; 4];
            for (dx, dy, weight) in weights {
                let pixel = self.pixel(x - left - dx, y - top - dy);
                sum = std::array::from_fn(|c| sum[c] + weight * pixel[c]);
            }
            sum
        })
    }

    fn pixel(&self, x: i64, y: i64) -> [f32; 4] {
        let inside = (0..WIDTH as i64).contains(&x) && (0..HEIGHT as i64).contains(&y);
        if inside { self.pixels[y as usize * WIDTH + x as usize] } else { [0.0; 4] }
    }
}

/// How deep a point lies inside the hand's outline, in pixels; negative outside.
fn inside(x: f64, y: f64) -> f64 {
    // Fingers: knuckle to tip, with their radius.
    const FINGERS: [([f64; 4], f64); 5] = [
        ([58.0, 84.0, 42.0, 30.0], 14.5),
        ([80.0, 76.0, 75.0, 16.0], 15.0),
        ([104.0, 76.0, 108.0, 20.0], 15.0),
        ([127.0, 86.0, 139.0, 40.0], 13.5),
        ([44.0, 138.0, 16.0, 92.0], 15.0),
    ];
    let arm = capsule(x, y, [92.0, 150.0, 100.0, 400.0], 55.0);
    let palm = capsule(x, y, [88.0, 104.0, 94.0, 138.0], 56.0);
    let fingers = FINGERS.iter().map(|(line, radius)| capsule(x, y, *line, *radius));
    fingers.fold(smooth_max(arm, palm, 8.0), |depth, finger| smooth_max(depth, finger, 5.0))
}

/// Depth inside a line thickened by `radius`.
fn capsule(x: f64, y: f64, [x0, y0, x1, y1]: [f64; 4], radius: f64) -> f64 {
    let (dx, dy) = (x1 - x0, y1 - y0);
    let along = (((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    radius - (x - x0 - along * dx).hypot(y - y0 - along * dy)
}

/// The larger of two depths, rounded where they meet.
fn smooth_max(a: f64, b: f64, round: f64) -> f64 {
    let h = (round - (a - b).abs()).max(0.0) / round;
    a.max(b) + h * h * round / 4.0
}
