use super::axis::Axis;
use super::{Planes, Window};
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Rgb8};

/// Takes windows out of frames. Owns its scratch: after the first window nothing is allocated for frames and patches that
/// are not larger.
///
/// Outside the frame the border pixel is repeated. Values stay 0–255. Shrinking averages (a triangle kernel as wide as
/// the shrinking), enlarging interpolates bilinearly. Turned windows are interpolated bilinearly whatever their step.
#[derive(Debug, Clone, Default)]
pub struct Sampler {
    x: Axis,
    y: Axis,
    /// One row of the frame's pixels, combined vertically; colours interleaved, and one value more.
    line: Vec<f32>,
    /// One row of the patch, colours interleaved.
    mixed: Vec<[f32; LANES]>,
}

/// A colour is worked on as this many values, so that it is one vector; the last counts for nothing.
const LANES: usize = 4;

impl Sampler {
    /// A sampler without scratch yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A sampler that never allocates for frames up to `frame` and patches up to `patch`.
    pub fn with_capacity(frame: Size, patch: Size) -> Self {
        let mut sampler = Self::new();
        sampler.reserve(frame, patch);
        sampler
    }

    /// Makes room for frames up to `frame` and patches up to `patch`.
    pub fn reserve(&mut self, frame: Size, patch: Size) {
        self.x.reserve(patch.width);
        self.y.reserve(patch.height);
        self.line.reserve((3 * frame.width + 1).saturating_sub(self.line.len()));
        self.mixed.reserve(patch.width.saturating_sub(self.mixed.len()));
    }

    /// Samples grey: `out` becomes one plane of the window's patch size.
    pub fn gray(&mut self, image: ImageView<'_, u8>, window: &Window, out: &mut Planes) {
        self.sample::<1>(image.size(), |y| image.row(y), window, out);
    }

    /// Samples colour: `out` becomes three planes, red, green, blue, of the window's patch size.
    pub fn color(&mut self, image: ImageView<'_, Rgb8>, window: &Window, out: &mut Planes) {
        self.sample::<3>(image.size(), |y| image.row(y).as_flattened(), window, out);
    }

    /// Rows are combined vertically first (contiguous, so it runs on vectors), then gathered horizontally.
    fn sample<'a, const N: usize>(
        &mut self,
        frame: Size,
        row: impl Fn(usize) -> &'a [u8],
        window: &Window,
        out: &mut Planes,
    ) {
        let Size { width, height } = window.patch;
        if window.angle_rad != 0.0 {
            return sample_turned::<N>(frame, row, window, out);
        }
        self.reserve(frame, window.patch);
        self.x.build(window.center.x, window.step_x, width, frame.width);
        self.y.build(window.center.y, window.step_y, height, frame.height);
        out.reshape(window.patch, N);
        let span = self.x.first * N..self.x.end * N;
        self.line.resize(span.len() + 1, 0.0);
        self.mixed.resize(width, [0.0; LANES]);
        let taps = self.y.taps;
        for i in 0..height {
            let (rows, weights) = (&self.y.index[i * taps..(i + 1) * taps], &self.y.weight[i * taps..(i + 1) * taps]);
            let source = |k: u32| &row(self.y.first + k as usize)[span.clone()];
            combine(rows, weights, source, &mut self.line);
            let mut planes = out.planes_mut();
            let lines: [&mut [f32]; N] = std::array::from_fn(|_| match planes.next() {
                Some(plane) => &mut plane[i * width..(i + 1) * width],
                None => unreachable!("the patch has N planes"),
            });
            if N == 3 {
                gather_color(&self.line, &self.x.index, &self.x.weight, self.x.taps, &mut self.mixed);
                lines.into_iter().enumerate().for_each(|(c, line)| pick(&self.mixed, c, line));
            } else {
                lines.into_iter().for_each(|out| gather(&self.line, &self.x.index, &self.x.weight, self.x.taps, out));
            }
        }
    }
}

/// Combines rows of the frame, at least two, with their weights. Up to three are read at once.
fn combine<'a>(rows: &[u32], weights: &[f32], source: impl Fn(u32) -> &'a [u8], out: &mut [f32]) {
    let third = weights.get(2).copied().unwrap_or(0.0);
    if third == 0.0 {
        weighted_rows_2([source(rows[0]), source(rows[1])], [weights[0], weights[1]], out);
    } else {
        let three = [source(rows[0]), source(rows[1]), source(rows[2])];
        weighted_rows_3(three, [weights[0], weights[1], third], out);
    }
    for (&k, &weight) in rows.iter().zip(weights).skip(3).filter(|(_, w)| **w != 0.0) {
        add_weighted_row(source(k), weight, out);
    }
}

/// Pixel by pixel: turned windows are rare (they vary a first sample), so nothing is made of them.
fn sample_turned<'a, const N: usize>(frame: Size, row: impl Fn(usize) -> &'a [u8], window: &Window, out: &mut Planes) {
    let Size { width, height } = window.patch;
    out.reshape(window.patch, N);
    let (sin, cos) = window.angle_rad.sin_cos();
    let inside = |v: f64, n: usize| (v as isize).clamp(0, n as isize - 1) as usize;
    for i in 0..height {
        for j in 0..width {
            let u = (j as f64 + 0.5 - width as f64 / 2.0) * window.step_x;
            let v = (i as f64 + 0.5 - height as f64 / 2.0) * window.step_y;
            let (x, y) = (window.center.x + cos * u - sin * v - 0.5, window.center.y + sin * u + cos * v - 0.5);
            let (x0, y0) = (x.floor(), y.floor());
            let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
            let columns = [inside(x0, frame.width), inside(x0 + 1.0, frame.width)];
            let (above, below) = (row(inside(y0, frame.height)), row(inside(y0 + 1.0, frame.height)));
            for (c, plane) in out.planes_mut().enumerate() {
                let [a, b] =
                    columns.map(|x| (1.0 - fy) * f32::from(above[x * N + c]) + fy * f32::from(below[x * N + c]));
                plane[i * width + j] = if fx.is_finite() && fy.is_finite() { a + fx * (b - a) } else { 0.0 };
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn weighted_rows_2([a, b]: [&[u8]; 2], weights: [f32; 2], out: &mut [f32]) {
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = weights[0] * f32::from(a) + weights[1] * f32::from(b);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn weighted_rows_3([a, b, c]: [&[u8]; 3], weights: [f32; 3], out: &mut [f32]) {
    for (((out, &a), &b), &c) in out.iter_mut().zip(a).zip(b).zip(c) {
        *out = weights[0] * f32::from(a) + weights[1] * f32::from(b) + weights[2] * f32::from(c);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_weighted_row(row: &[u8], weight: f32, out: &mut [f32]) {
    for (out, &v) in out.iter_mut().zip(row) {
        *out += weight * f32::from(v);
    }
}

/// Interpolates a line horizontally.
fn gather(line: &[f32], index: &[u32], weight: &[f32], taps: usize, out: &mut [f32]) {
    match taps {
        2 => gather_taps::<2>(line, index, weight, out),
        3 => gather_taps::<3>(line, index, weight, out),
        4 => gather_taps::<4>(line, index, weight, out),
        _ => {
            let taps = index.chunks_exact(taps).zip(weight.chunks_exact(taps));
            for (out, (indices, weights)) in out.iter_mut().zip(taps) {
                *out = indices.iter().zip(weights).map(|(&i, &w)| w * line[i as usize]).sum();
            }
        }
    }
}

fn gather_taps<const TAPS: usize>(line: &[f32], index: &[u32], weight: &[f32], out: &mut [f32]) {
    let taps = index.as_chunks::<TAPS>().0.iter().zip(weight.as_chunks::<TAPS>().0);
    for (out, (indices, weights)) in out.iter_mut().zip(taps) {
        let mut sum = weights[0] * line[indices[0] as usize];
        for k in 1..TAPS {
            sum += weights[k] * line[indices[k] as usize];
        }
        *out = sum;
    }
}

/// Interpolates an interleaved line of colours, one value longer than they are, horizontally.
fn gather_color(line: &[f32], index: &[u32], weight: &[f32], taps: usize, out: &mut [[f32; LANES]]) {
    match taps {
        2 => gather_color_2(line, index, weight, out),
        3 => gather_color_3(line, index, weight, out),
        4 => gather_color_4(line, index, weight, out),
        _ => {
            let taps = index.chunks_exact(taps).zip(weight.chunks_exact(taps));
            for (out, (indices, weights)) in out.iter_mut().zip(taps) {
                *out = [0.0; LANES];
                indices.iter().zip(weights).for_each(|(&i, &w)| {
                    let pixel = pixel(line, i);
                    *out = std::array::from_fn(|c| out[c] + w * pixel[c]);
                });
            }
        }
    }
}

/// The fourth value is the next pixel's first: whatever it is, nobody reads what becomes of it.
#[inline(always)]
fn pixel(line: &[f32], i: u32) -> [f32; LANES] {
    let at = i as usize * 3;
    let pixel = &line[at..at + LANES];
    std::array::from_fn(|c| pixel[c])
}

#[inline(always)]
fn gather_color_taps<const TAPS: usize>(line: &[f32], index: &[u32], weight: &[f32], out: &mut [[f32; LANES]]) {
    let taps = index.as_chunks::<TAPS>().0.iter().zip(weight.as_chunks::<TAPS>().0);
    for (out, (indices, weights)) in out.iter_mut().zip(taps) {
        let mut sum = pixel(line, indices[0]).map(|v| weights[0] * v);
        for k in 1..TAPS {
            let pixel = pixel(line, indices[k]);
            sum = std::array::from_fn(|c| sum[c] + weights[k] * pixel[c]);
        }
        *out = sum;
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn gather_color_2(line: &[f32], index: &[u32], weight: &[f32], out: &mut [[f32; LANES]]) {
    gather_color_taps::<2>(line, index, weight, out);
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn gather_color_3(line: &[f32], index: &[u32], weight: &[f32], out: &mut [[f32; LANES]]) {
    gather_color_taps::<3>(line, index, weight, out);
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn gather_color_4(line: &[f32], index: &[u32], weight: &[f32], out: &mut [[f32; LANES]]) {
    gather_color_taps::<4>(line, index, weight, out);
}

/// One channel of interleaved colours.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn pick(mixed: &[[f32; LANES]], channel: usize, out: &mut [f32]) {
    let channel = channel.min(LANES - 1);
    for (out, mixed) in out.iter_mut().zip(mixed) {
        *out = mixed[channel];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_geometry::Point;
    use pursuit_imaging::Image;
    use pursuit_testkit::Noise;

    fn noise(width: usize, height: usize) -> Image<Rgb8> {
        let mut noise = Noise::new(12_345);
        Image::from_fn(width, height, |_, _| [noise.byte(), noise.byte(), noise.byte()]).unwrap()
    }

    /// One output pixel by the definition: a normalised triangle kernel over border-replicated pixels.
    fn reference(image: &Image<Rgb8>, window: &Window, i: usize, j: usize, c: usize) -> f64 {
        let position =
            |center: f64, k: usize, n: usize, step: f64| center + (k as f64 + 0.5 - n as f64 / 2.0) * step - 0.5;
        let x = position(window.center.x, j, window.patch.width, window.step_x);
        let y = position(window.center.y, i, window.patch.height, window.step_y);
        let (hx, hy) = (window.step_x.max(1.0), window.step_y.max(1.0));
        let (mut sum, mut total) = (0.0, 0.0);
        for sy in (y - hy).floor() as isize..=(y + hy).ceil() as isize {
            for sx in (x - hx).floor() as isize..=(x + hx).ceil() as isize {
                let kernel = |d: f64, h: f64| (1.0 - d.abs() / h).max(0.0);
                let weight = kernel(sx as f64 - x, hx) * kernel(sy as f64 - y, hy);
                sum += weight * f64::from(image.view().clamped(sx, sy)[c]);
                total += weight;
            }
        }
        sum / total
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn every_pixel_follows_the_definition(
            cx in -20.0..60.0, cy in -20.0..50.0, step_x in 0.2..7.0, step_y in 0.2..7.0, w in 1usize..20, h in 1usize..20,
        ) {
            let image = noise(41, 29);
            let window = Window { center: Point::new(cx, cy), step_x, step_y, angle_rad: 0.0, patch: Size::new(w, h) };
            let mut sampler = Sampler::new();
            let (mut color, mut gray) = (Planes::default(), Planes::default());
            sampler.color(image.view(), &window, &mut color);
            let reds = Image::from_vec(image.as_slice().iter().map(|p| p[0]).collect(), 41, 29).unwrap();
            sampler.gray(reds.view(), &window, &mut gray);
            prop_assert_eq!(color.plane(0), gray.plane(0));
            for i in 0..h {
                for j in 0..w {
                    for c in 0..3 {
                        let got = f64::from(color.plane(c)[i * w + j]);
                        let want = reference(&image, &window, i, j, c);
                        prop_assert!((got - want).abs() < 1e-2, "{} {} {}: {} is not {}", i, j, c, got, want);
                    }
                }
            }
        }
    }

    #[test]
    fn whole_pixels_are_copied() {
        let image = noise(16, 12);
        let window = Window::new(Point::new(6.0, 5.0), 1.0, Size::new(4, 4));
        let mut out = Planes::default();
        Sampler::new().color(image.view(), &window, &mut out);
        assert_eq!(out.plane(2)[5], f32::from(image.row(4)[5][2]));
        assert_eq!(Window::of_region(window.region(), window.patch), window);
    }

    #[test]
    fn a_quarter_turn_swaps_the_axes() {
        let image = noise(31, 33);
        let window = Window::new(Point::new(15.5, 16.5), 1.0, Size::new(9, 7));
        let (mut straight, mut turned) = (Planes::default(), Planes::default());
        let upright = Window { patch: Size::new(7, 9), ..window };
        Sampler::new().color(image.view(), &upright, &mut straight);
        Sampler::new().color(image.view(), &window.turned(std::f64::consts::FRAC_PI_2), &mut turned);
        for c in 0..3 {
            for i in 0..7 {
                for j in 0..9 {
                    // Patch x runs along frame y, patch y against frame x.
                    let (got, want) = (turned.plane(c)[i * 9 + j], straight.plane(c)[j * 7 + 6 - i]);
                    assert!((got - want).abs() < 1e-3, "{c} {i} {j}: {got} is not {want}");
                }
            }
        }
    }

    #[test]
    fn hostile_windows_do_not_panic() {
        let image = noise(16, 12);
        let mut out = Planes::default();
        for (center, step) in [(1e300, 1.0), (f64::NAN, 1.0), (0.0, 1e9), (3.0, f64::INFINITY), (3.0, 0.0), (3.0, -2.0)]
        {
            for angle_rad in [0.0, 0.3, f64::NAN] {
                let window = Window::new(Point::new(center, 5.0), step, Size::new(5, 3)).turned(angle_rad);
                Sampler::new().color(image.view(), &window, &mut out);
                assert!(out.as_slice().iter().all(|v| (0.0..=255.1).contains(v)), "{center} {step} {angle_rad}");
            }
        }
    }
}
