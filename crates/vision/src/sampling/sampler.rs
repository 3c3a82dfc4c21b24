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
    line: Vec<f32>,
}

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
        self.line.reserve((3 * frame.width).saturating_sub(self.line.len()));
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
        self.line.resize((self.x.end - self.x.first) * N, 0.0);
        let span = self.x.first * N..self.x.end * N;
        let taps = self.y.taps;
        for i in 0..height {
            let (rows, weights) = (&self.y.index[i * taps..(i + 1) * taps], &self.y.weight[i * taps..(i + 1) * taps]);
            let source = |k: u32| &row(self.y.first + k as usize)[span.clone()];
            weighted_row_pair(source(rows[0]), source(rows[1]), weights[0], weights[1], &mut self.line);
            for (&k, &weight) in rows.iter().zip(weights).skip(2).filter(|(_, w)| **w != 0.0) {
                add_weighted_row(source(k), weight, &mut self.line);
            }
            let mut planes = out.planes_mut();
            let lines: [&mut [f32]; N] = std::array::from_fn(|_| match planes.next() {
                Some(plane) => &mut plane[i * width..(i + 1) * width],
                None => unreachable!("the patch has N planes"),
            });
            gather(&self.line, &self.x.index, &self.x.weight, self.x.taps, lines);
        }
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
fn weighted_row_pair(a: &[u8], b: &[u8], weight_a: f32, weight_b: f32, out: &mut [f32]) {
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = weight_a * f32::from(a) + weight_b * f32::from(b);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_weighted_row(row: &[u8], weight: f32, out: &mut [f32]) {
    for (out, &v) in out.iter_mut().zip(row) {
        *out += weight * f32::from(v);
    }
}

/// Interpolates an interleaved line of `N` channels horizontally into `N` rows.
fn gather<const N: usize>(line: &[f32], index: &[u32], weight: &[f32], taps: usize, out: [&mut [f32]; N]) {
    if taps == 2 {
        let (pairs, _) = index.as_chunks::<2>();
        let (weights, _) = weight.as_chunks::<2>();
        for (j, (&[a, b], &[wa, wb])) in pairs.iter().zip(weights).enumerate() {
            let (a, b) = (&line[a as usize * N..][..N], &line[b as usize * N..][..N]);
            for c in 0..N {
                out[c][j] = wa * a[c] + wb * b[c];
            }
        }
        return;
    }
    for (j, (indices, weights)) in index.chunks_exact(taps).zip(weight.chunks_exact(taps)).enumerate() {
        let mut sum = [0.0; N];
        for (&i, &w) in indices.iter().zip(weights) {
            let pixel = &line[i as usize * N..][..N];
            for c in 0..N {
                sum[c] += w * pixel[c];
            }
        }
        for c in 0..N {
            out[c][j] = sum[c];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_geometry::Point;
    use pursuit_imaging::Image;

    fn noise(width: usize, height: usize) -> Image<Rgb8> {
        let mut state = 12_345_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        Image::from_fn(width, height, |_, _| [next(), next(), next()]).unwrap()
    }

    /// One output pixel by the definition: a normalised triangle kernel over border-replicated pixels.
    fn twin(image: &Image<Rgb8>, window: &Window, i: usize, j: usize, c: usize) -> f64 {
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
                        let want = twin(&image, &window, i, j, c);
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
