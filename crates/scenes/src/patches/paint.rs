use crate::hash;
use crate::texture::{Color, Texture, fractal_noise, hsv, mixed};

/// A background of blotches, soft noise and clutter: muted, so that it neither hides nor betrays the patch by colour alone.
pub(crate) fn background(seed: u64, width: usize, height: usize) -> Texture {
    let key = hash::mix(seed, 0xbac4);
    let (first, second) = (hue(key, 1), hue(key, 2));
    let clutter: Vec<Blob> = (0..width * height / 2600).map(|k| Blob::random(key, k as u64, width, height)).collect();
    let base = Texture::paint(width, height, 1, |x, y| {
        let mix = 0.5 + 0.9 * fractal_noise(key, x / 46.0, y / 46.0, 4);
        let grain = 26.0 * fractal_noise(key ^ 1, x / 5.0, y / 5.0, 2) as f32;
        let color = mixed(hsv(first, 0.3, 0.55), hsv(second, 0.35, 0.38), mix.clamp(0.0, 1.0) as f32);
        color.map(|c| c + grain)
    });
    Texture::paint(width, height, 1, |x, y| {
        let under = base.row(y as i64)[x as usize];
        clutter.iter().fold(under, |under, blob| blob.over(under, x, y))
    })
}

fn hue(key: u64, index: u64) -> f64 {
    hash::between(key, index, 0.0, 360.0)
}

/// A piece of clutter: a soft-edged rotated box.
struct Blob {
    x: f64,
    y: f64,
    half_width: f64,
    half_height: f64,
    cos: f64,
    sin: f64,
    color: Color,
}

impl Blob {
    fn random(key: u64, index: u64, width: usize, height: usize) -> Self {
        let key = hash::mix(key, 1000 + index);
        let angle = hash::between(key, 4, 0.0, std::f64::consts::PI);
        Self {
            x: hash::between(key, 0, 0.0, width as f64),
            y: hash::between(key, 1, 0.0, height as f64),
            half_width: hash::between(key, 2, 3.0, 20.0),
            half_height: hash::between(key, 3, 2.0, 9.0),
            cos: angle.cos(),
            sin: angle.sin(),
            color: hsv(hue(key, 5), hash::between(key, 6, 0.1, 0.5), hash::between(key, 7, 0.2, 0.75)),
        }
    }

    fn over(&self, under: Color, x: f64, y: f64) -> Color {
        let (dx, dy) = (x - self.x, y - self.y);
        // Most points are far away; spare them the rotation.
        if dx.abs() + dy.abs() > self.half_width + self.half_height + 20.0 {
            return under;
        }
        let (u, v) = (dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin);
        let edge = |d: f64, half: f64| (half - d.abs() + 0.5).clamp(0.0, 1.0);
        mixed(under, self.color, (0.8 * edge(u, self.half_width) * edge(v, self.half_height)) as f32)
    }
}

/// The look of a patch: bold shapes that differ from seed to seed, with a darker rim, `resolution` pixels a side.
/// `variation` in `[0, 1]` mixes in another look, for things that look almost alike.
pub(crate) fn patch(seed: u64, resolution: usize, variation: f64) -> Texture {
    let key = hash::mix(seed, 0x9a7c);
    let colors: [Color; 3] = std::array::from_fn(|k| {
        let spread = hue(key, 0) + 110.0 * k as f64 + hash::between(key, 10 + k as u64, -25.0, 25.0);
        hsv(spread, hash::between(key, 20 + k as u64, 0.5, 0.85), [0.9, 0.65, 0.35][k])
    });
    let look = |key: u64, u: f64, v: f64| {
        let (a, b) = (fractal_noise(key, 3.3 * u, 3.3 * v, 2), fractal_noise(key ^ 7, 4.1 * u, 4.1 * v, 2));
        let step = |x: f64| ((x * 9.0).clamp(-1.0, 1.0) * 0.5 + 0.5) as f32;
        mixed(mixed(colors[0], colors[1], step(a)), colors[2], step(b - 0.08))
    };
    Texture::paint(resolution, resolution, 2, |x, y| {
        let (u, v) = (x / resolution as f64, y / resolution as f64);
        let color = mixed(look(key, u, v), look(key ^ 0xffff, u, v), variation as f32);
        let to_rim = u.min(v).min(1.0 - u).min(1.0 - v);
        if to_rim < 0.05 { mixed(color, [25.0; 3], 0.75) } else { color }
    })
}

/// The upright bar that things pass behind: wood-like, unlike both background and patch.
pub(crate) fn bar(seed: u64, width: usize, height: usize) -> Texture {
    let key = hash::mix(seed, 0xba4);
    Texture::paint(width, height, 1, |x, y| {
        let grain = fractal_noise(key, x / 4.0, y / 60.0, 3) as f32;
        let round = 1.0 - ((x / width as f64 - 0.4).powi(2) * 1.4) as f32;
        [128.0, 98.0, 70.0].map(|c| (c + 40.0 * grain) * round)
    })
}

/// One plain colour that nothing else in these scenes has, for checking truth against pixels.
pub(crate) fn plain() -> Texture {
    Texture::paint(1, 1, 1, |_, _| [255.0, 0.0, 255.0])
}
