//! Procedural colour, in linear 0–255 floats, never clamped before the camera does it.

use crate::hash;

/// A colour while it is being mixed: red, green, blue in 0–255.
pub(crate) type Color = [f32; 3];

/// `a` and `b` mixed, `b` with weight `t`.
pub(crate) fn mixed(a: Color, b: Color, t: f32) -> Color {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// `color` times `gain`.
pub(crate) fn scaled(color: Color, gain: f32) -> Color {
    color.map(|c| c * gain)
}

/// A colour from hue in degrees, saturation and value in `[0, 1]`.
pub(crate) fn hsv(hue_deg: f64, saturation: f64, value: f64) -> Color {
    let channel = |n: f64| {
        let k = (n + hue_deg / 60.0).rem_euclid(6.0);
        (255.0 * (value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0))) as f32
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// 0 below `low`, 1 above `high`, smooth in between.
pub(crate) fn smooth_step(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Smooth noise in `[-1, 1]` with features about one unit apart (value noise).
pub(crate) fn value_noise(key: u64, x: f64, y: f64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (u, v) = (fade(x - i), fade(y - j));
    let corner = |di: i64, dj: i64| {
        let cell = hash::mix((i as i64 + di) as u64, (j as i64 + dj) as u64);
        2.0 * hash::unit(key, cell) - 1.0
    };
    let top = corner(0, 0) * (1.0 - u) + corner(1, 0) * u;
    let bottom = corner(0, 1) * (1.0 - u) + corner(1, 1) * u;
    top * (1.0 - v) + bottom * v
}

/// Several octaves of [`value_noise`], each of twice the frequency and half the strength; about `[-1, 1]`.
pub(crate) fn fractal_noise(key: u64, x: f64, y: f64, octaves: u32) -> f64 {
    let (mut sum, mut weight, mut frequency) = (0.0, 0.5, 1.0);
    for octave in 0..octaves {
        sum += weight * value_noise(hash::mix(key, octave.into()), x * frequency, y * frequency);
        (weight, frequency) = (weight / 2.0, frequency * 2.0);
    }
    sum
}

/// An opaque picture to sample from.
#[derive(Debug, Clone)]
pub(crate) struct Texture {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

impl Texture {
    /// Paints a texture; `color(x, y)` is asked at `samples` × `samples` points of each pixel and averaged.
    pub(crate) fn paint(width: usize, height: usize, samples: u32, color: impl Fn(f64, f64) -> Color) -> Self {
        let step = 1.0 / f64::from(samples);
        let share = 1.0 / (samples * samples) as f32;
        let pixel = |column: usize, row: usize| {
            let mut sum = [0.0; 3];
            for j in 0..samples {
                for i in 0..samples {
                    let (x, y) = (f64::from(i) * step + step / 2.0, f64::from(j) * step + step / 2.0);
                    let sample = color(column as f64 + x, row as f64 + y);
                    sum = std::array::from_fn(|c| sum[c] + share * sample[c]);
                }
            }
            sum
        };
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        Self { width, height, pixels: pixels.map(|(column, row)| pixel(column, row)).collect() }
    }

    /// A texture of the rows that `row` writes.
    pub(crate) fn of_rows(width: usize, height: usize, mut row: impl FnMut(usize, &mut [Color])) -> Self {
        let mut pixels = vec![[0.0; 3]; width * height];
        pixels.chunks_exact_mut(width.max(1)).enumerate().for_each(|(y, out)| row(y, out));
        Self { width, height, pixels }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// Row `y`, the nearest row where there is none.
    pub(crate) fn row(&self, y: i64) -> &[Color] {
        let y = y.clamp(0, self.height as i64 - 1) as usize;
        &self.pixels[y * self.width..(y + 1) * self.width]
    }

    /// Bilinear sample at continuous pixel coordinates (pixel centres at + 0.5), border replicated.
    pub(crate) fn sample(&self, x: f64, y: f64) -> Color {
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = ((x - left) as f32, (y - top) as f32);
        let column = |c: i64| c.clamp(0, self.width as i64 - 1) as usize;
        let (upper, lower) = (self.row(top as i64), self.row(top as i64 + 1));
        let (l, r) = (column(left as i64), column(left as i64 + 1));
        mixed(mixed(upper[l], upper[r], u), mixed(lower[l], lower[r], u), v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hsv_gives_the_primaries_and_greys() {
        for (hue, expected) in [(0.0, [255.0, 0.0, 0.0]), (120.0, [0.0, 255.0, 0.0]), (240.0, [0.0, 0.0, 255.0])] {
            assert_eq!(hsv(hue, 1.0, 1.0), expected);
        }
        assert_eq!(hsv(60.0, 1.0, 1.0), [255.0, 255.0, 0.0]);
        assert_eq!(hsv(77.0, 0.0, 0.4), [102.0; 3]);
    }

    #[test]
    fn samples_at_pixel_centres_are_the_pixels() {
        let texture = Texture::paint(5, 4, 1, |x, y| [x as f32, y as f32, 0.0]);
        assert_eq!(texture.sample(2.5, 1.5), [2.5, 1.5, 0.0]);
        assert_eq!(texture.sample(3.0, 2.25), [3.0, 2.25, 0.0]);
        assert_eq!(texture.sample(-9.0, 99.0), [0.5, 3.5, 0.0]);
    }
}
