//! The camera: layers over a backdrop, light, sensor noise and 8 bits, one row at a time.

use crate::texture::{Color, Texture};
use crate::view::possible;
use crate::{View, hash};
use multiversion::multiversion;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::{Image, Rgb8};

/// A rectangular piece of picture with opacity: red, green, blue (0–255, multiplied by opacity), opacity 0–1.
#[derive(Debug, Clone)]
pub(crate) struct Layer {
    left: i64,
    top: i64,
    width: usize,
    pixels: Vec<[f32; 4]>,
}

impl Layer {
    /// A layer for the pixels that the continuous rectangle touches, as far as they lie in a picture of `size`;
    /// `pixel(column, row)` gives each.
    pub(crate) fn paint(bounds: [f64; 4], size: Size, pixel: impl Fn(i64, i64) -> [f32; 4]) -> Self {
        let [left, top, right, bottom] = bounds;
        let clamp = |v: f64, max: usize| v.clamp(0.0, max as f64) as i64;
        let (left, top) = (clamp(left.floor(), size.width), clamp(top.floor(), size.height));
        let (right, bottom) = (clamp(right.ceil(), size.width), clamp(bottom.ceil(), size.height));
        let pixels = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Self { left, top, width: (right - left).max(0) as usize, pixels }
    }

    /// Opacity of the pixel in column `x`, row `y` of the picture.
    fn opacity(&self, x: i64, y: i64) -> f32 {
        let (column, row) = (x - self.left, y - self.top);
        if column < 0 || row < 0 || column >= self.width as i64 {
            return 0.0;
        }
        self.pixels.get(row as usize * self.width + column as usize).map_or(0.0, |p| p[3])
    }

    /// The sum of opacities that is left when `covers` lie over this layer, in pixels.
    pub(crate) fn visible_area_px(&self, covers: &[Layer]) -> f64 {
        let covers: Vec<&Layer> = covers.iter().filter(|c| !c.pixels.is_empty()).collect();
        let seen = |(k, pixel): (usize, &[f32; 4])| {
            let (x, y) = (self.left + (k % self.width) as i64, self.top + (k / self.width) as i64);
            covers.iter().fold(f64::from(pixel[3]), |seen, c| seen * f64::from(1.0 - c.opacity(x, y)))
        };
        self.pixels.iter().enumerate().map(seen).sum()
    }

    /// Lays this layer's part of row `y` over `row`.
    pub(crate) fn blend_row(&self, y: usize, row: &mut [Color]) {
        let Ok(index) = usize::try_from(y as i64 - self.top) else { return };
        let Some(pixels) = self.pixels.get(index * self.width..(index + 1) * self.width) else { return };
        // `paint` clipped to the picture, so `left` is not negative.
        for (under, over) in row.iter_mut().skip(self.left as usize).zip(pixels) {
            for c in 0..3 {
                under[c] = under[c] * (1.0 - over[3]) + over[c];
            }
        }
    }
}

/// All that a camera needs to know about one moment.
pub(crate) struct Shot<'a> {
    /// Size of the picture.
    pub(crate) size: Size,
    /// What lies behind everything.
    pub(crate) backdrop: &'a Texture,
    /// The point of the backdrop, in its pixels, that appears in the picture's top left corner.
    pub(crate) origin: Point,
    /// Layers from back to front.
    pub(crate) layers: &'a [Layer],
    /// Gains of red, green and blue.
    pub(crate) light: Color,
    /// The sensor's noise.
    pub(crate) noise: Noise,
}

/// Sensor noise: a hash of seed, frame and pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    /// Standard deviation at mid grey, in grey levels.
    pub(crate) sigma: f32,
    /// Hash of seed and frame.
    pub(crate) key: u64,
}

impl Noise {
    /// The noise of the frame nearest to `time_s`.
    pub(crate) fn of_frame(sigma: f64, seed: u64, time_s: f64, fps: f64) -> Self {
        let frame = (time_s * fps).round() as i64 as u64;
        Self { sigma: sigma as f32, key: hash::mix(seed, frame) }
    }
}

/// Takes the picture.
pub(crate) fn compose(shot: &Shot<'_>) -> Image<Rgb8> {
    let row = |y: usize, row: &mut [Color]| {
        backdrop_row(shot.backdrop, shot.origin, y, row);
        shot.layers.iter().for_each(|layer| layer.blend_row(y, row));
    };
    develop(shot.size, shot.light, shot.noise, row)
}

/// Takes the picture of a flat scene with a camera that has been turned or zoomed away from `home`.
pub(crate) fn compose_view(shot: &Shot<'_>, home: &View, view: &View) -> Image<Rgb8> {
    let flat = Texture::of_rows(shot.size.width, shot.size.height, |y, row| {
        backdrop_row(shot.backdrop, shot.origin, y, row);
        shot.layers.iter().for_each(|layer| layer.blend_row(y, row));
    });
    develop(view.size, shot.light, shot.noise, |y, row| {
        for (x, to) in row.iter_mut().enumerate() {
            let direction = view.direction_of(Point::new(x as f64 + 0.5, y as f64 + 0.5));
            *to = home.point_of(direction).map_or([0.0; 3], |p| flat.sample(p.x, p.y));
        }
    })
}

/// Exposes the rows that `mix` writes.
pub(crate) fn develop(size: Size, light: Color, noise: Noise, mut mix: impl FnMut(usize, &mut [Color])) -> Image<Rgb8> {
    let size = possible(size);
    let mut data = vec![[0u8; 3]; size.area()];
    let mut row = vec![[0f32; 3]; size.width];
    for (y, out) in data.chunks_exact_mut(size.width.max(1)).enumerate() {
        mix(y, &mut row);
        let key = hash::mix(noise.key, y as u64) as u32;
        expose(row.as_flattened_mut(), light, noise.sigma, key, out.as_flattened_mut());
    }
    Image::from_vec(data, size.width, size.height)
        .unwrap_or_else(|_| unreachable!("a possible size, and as many pixels"))
}

fn backdrop_row(backdrop: &Texture, origin: Point, y: usize, row: &mut [Color]) {
    let (left, top) = (origin.x.floor(), origin.y.floor());
    let (u, v) = ((origin.x - left) as f32, (origin.y - top) as f32);
    let start = (left.max(0.0) as usize).min(backdrop.width().saturating_sub(row.len() + 1));
    let line = |offset: i64| &backdrop.row(top as i64 + y as i64 + offset)[start..];
    if u == 0.0 && v == 0.0 {
        row.iter_mut().zip(line(0)).for_each(|(to, from)| *to = *from);
    } else {
        shift_row(line(0).as_flattened(), line(1).as_flattened(), u, v, row.as_flattened_mut());
    }
}

/// Bilinear shift of interleaved colour by `u` to the right and `v` down.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn shift_row(upper: &[f32], lower: &[f32], u: f32, v: f32, out: &mut [f32]) {
    let (upper_right, lower_right) = (upper.get(3..).unwrap_or(upper), lower.get(3..).unwrap_or(lower));
    let pairs = upper.iter().zip(upper_right).zip(lower.iter().zip(lower_right));
    for (out, ((a, b), (c, d))) in out.iter_mut().zip(pairs) {
        let (top, bottom) = (a + (b - a) * u, c + (d - c) * u);
        *out = top + (bottom - top) * v;
    }
}

/// Light, noise and quantisation. Noise has `sigma` at mid grey and grows with the root of the signal, as photons do.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn expose(row: &mut [f32], light: Color, sigma: f32, key: u32, out: &mut [u8]) {
    // Interleaved colour: a period of three gains; unrolled by hand, `chunks_exact(3)` keeps the vectoriser happy.
    for pixel in row.chunks_exact_mut(3) {
        for c in 0..3 {
            pixel[c] *= light[c];
        }
    }
    if sigma > 0.0 {
        for (k, value) in row.iter_mut().enumerate() {
            let noise = hash::nearly_normal(hash::mix32(key.wrapping_add(k as u32)));
            *value += noise * sigma * (0.3 + value.max(0.0) * (0.7 / 128.0)).sqrt();
        }
    }
    for (out, value) in out.iter_mut().zip(row.iter()) {
        *out = (value + 0.5).clamp(0.0, 255.0) as u8;
    }
}
