use super::Kernel;
use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use serde::{Deserialize, Serialize};

/// Which bin of `bins` a channel a colour belongs to.
#[inline(always)]
pub fn bin([r, g, b]: Rgb8, bins: usize) -> usize {
    let code = |v: u8| usize::from(v) * bins / 256;
    (code(r) * bins + code(g)) * bins + code(b)
}

/// How colours are distributed: shares of bins of red, green and blue together, which sum to one, or to nought where nothing
/// was seen.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct KernelHistogram(Vec<f32>);

impl KernelHistogram {
    /// Nothing at all, in `bins` bins a channel.
    pub fn empty(bins: usize) -> Self {
        Self(vec![0.0; bins * bins * bins])
    }

    /// Whether it has `bins` bins a channel and each share is one.
    pub fn is_sound(&self, bins: usize) -> bool {
        let sum: f32 = self.0.iter().sum();
        self.0.len() == bins * bins * bins && sum <= 1.001 && self.0.iter().all(|v| (0.0..=1.0).contains(v))
    }

    /// The shares.
    pub fn shares(&self) -> &[f32] {
        &self.0
    }

    /// Becomes the colours under `kernel`, each weighed by it: p̂ᵤ = C Σ k(‖(y − xᵢ)/h‖²) δ[b(xᵢ) − u] (comaniciu2003, eq. 4).
    /// `false` where none is in the picture.
    pub fn measure(&mut self, color: ImageView<'_, Rgb8>, kernel: &Kernel, bins: usize) -> bool {
        self.measure_as(color, kernel, bins, |pixel| pixel)
    }

    /// The same of colours that `seen_as` makes of those in the picture.
    pub fn measure_as(
        &mut self,
        color: ImageView<'_, Rgb8>,
        kernel: &Kernel,
        bins: usize,
        seen_as: impl Fn(Rgb8) -> Rgb8,
    ) -> bool {
        self.0.clear();
        self.0.resize(bins * bins * bins, 0.0);
        let mut total = 0.0;
        kernel.for_each(color, |pixel, _, k| {
            self.0[bin(seen_as(pixel), bins)] += k;
            total += k;
        });
        self.scale(total)
    }

    /// Becomes the colours around `inner`, as far as `outer`, each pixel alike; about `most_pixels` of them are looked at. `false`
    /// where none is in the picture.
    pub fn measure_around(
        &mut self,
        color: ImageView<'_, Rgb8>,
        (inner, outer): (&BBox, &BBox),
        most_pixels: usize,
        bins: usize,
    ) -> bool {
        self.0.clear();
        self.0.resize(bins * bins * bins, 0.0);
        let step = (outer.area() / most_pixels.max(1) as f64).sqrt().ceil().max(1.0) as usize;
        let pixels = |low: f64, high: f64, n: usize| {
            let bound = |v: f64| (v - 0.5).ceil().clamp(0.0, n as f64) as usize;
            bound(low)..bound(high)
        };
        let (columns, rows) = (
            pixels(outer.left(), outer.right(), color.size().width),
            pixels(outer.top(), outer.bottom(), color.size().height),
        );
        let (hole_x, hole_y) = (
            pixels(inner.left(), inner.right(), color.size().width),
            pixels(inner.top(), inner.bottom(), color.size().height),
        );
        let mut total = 0.0;
        for y in rows.step_by(step) {
            let row = color.row(y);
            let through = hole_y.contains(&y);
            for x in columns.clone().step_by(step) {
                if !(through && hole_x.contains(&x)) {
                    self.0[bin(row[x], bins)] += 1.0;
                    total += 1.0;
                }
            }
        }
        self.scale(total)
    }

    fn scale(&mut self, total: f32) -> bool {
        if total > 0.0 {
            self.0.iter_mut().for_each(|v| *v /= total);
        }
        total > 0.0
    }

    /// The Bhattacharyya coefficient Σ √(p̂ᵤ q̂ᵤ), `[0, 1]` (comaniciu2003, eq. 7).
    pub fn coefficient(&self, other: &Self) -> f64 {
        let sum: f32 = self.0.iter().zip(&other.0).map(|(p, q)| (p * q).sqrt()).sum();
        f64::from(sum).min(1.0)
    }

    /// Takes in `rate` (`[0, 1]`) of another.
    pub fn blend(&mut self, other: &Self, rate: f64) {
        let rate = rate as f32;
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += rate * (b - *a));
    }

    /// Becomes `other` with each share multiplied by that of `factors`, summing to one again (comaniciu2003, section 6.1).
    /// Where nothing is left, `other` itself.
    pub fn weigh(&mut self, other: &Self, factors: &[f32]) {
        self.0.clear();
        self.0.extend(other.0.iter().zip(factors).map(|(v, f)| v * f));
        let total = self.0.iter().sum();
        if !self.scale(total) {
            self.0.clone_from(&other.0);
        }
    }

    /// How little each colour belongs to these surroundings: min(ô*/ôᵤ, 1), where ô* is the least share that is not nought
    /// (comaniciu2003, section 6.1).
    pub fn rarities(&self, out: &mut Vec<f32>) {
        let least = self.0.iter().copied().filter(|v| *v > 0.0).fold(f32::INFINITY, f32::min);
        out.clear();
        out.extend(self.0.iter().map(|v| if *v > 0.0 { (least / v).min(1.0) } else { 1.0 }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn image() -> Image<Rgb8> {
        Image::from_fn(50, 40, |x, y| [(x * 37 + y * 11) as u8, (x * y) as u8, (200 - 3 * y) as u8]).unwrap()
    }

    /// Equation 4 as it is printed, one bin after the other.
    fn slow(image: &Image<Rgb8>, bbox: &BBox, bins: usize, u: usize) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for y in 0..image.height() {
            for x in 0..image.width() {
                let pixel = image.row(y)[x];
                let dx = (bbox.center().x - (x as f64 + 0.5)) / (bbox.width() / 2.0);
                let dy = (bbox.center().y - (y as f64 + 0.5)) / (bbox.height() / 2.0);
                let k = (1.0 - dx * dx - dy * dy).max(0.0);
                total += k;
                let of = |v: u8| (f64::from(v) / (256.0 / bins as f64)).floor() as usize;
                if (of(pixel[0]) * bins + of(pixel[1])) * bins + of(pixel[2]) == u {
                    sum += k;
                }
            }
        }
        sum / total
    }

    #[test]
    fn histograms_are_those_of_equation_four() {
        let image = image();
        for bbox in [BBox::from_ltwh(8.4, 9.1, 21.0, 16.0), BBox::from_ltwh(-7.0, 30.0, 25.0, 20.0)] {
            let mut histogram = KernelHistogram::empty(4);
            assert!(histogram.measure(image.view(), &Kernel::new(&bbox, usize::MAX), 4));
            for u in 0..64 {
                let (got, want) = (f64::from(histogram.shares()[u]), slow(&image, &bbox, 4, u));
                assert!((got - want).abs() < 1e-5, "{bbox}, bin {u}: {got} is not {want}");
            }
        }
    }

    #[test]
    fn surroundings_are_the_pixels_between_both_boxes() {
        let image = image();
        let (inner, outer) = (BBox::from_ltwh(20.0, 15.0, 10.0, 8.0), BBox::from_ltwh(12.0, 8.0, 26.0, 22.0));
        let mut around = KernelHistogram::empty(8);
        assert!(around.measure_around(image.view(), (&inner, &outer), usize::MAX, 8));
        let mut counts = vec![0.0_f32; 512];
        let between = (8..30).flat_map(|y| (12..38).map(move |x| (x, y)));
        for (x, y) in between.filter(|&(x, y)| !((20..30).contains(&x) && (15..23).contains(&y))) {
            counts[bin(image.row(y)[x], 8)] += 1.0 / (26.0 * 22.0 - 80.0);
        }
        assert!(around.shares().iter().zip(&counts).all(|(a, b)| (a - b).abs() < 1e-6));
        assert!(!around.measure_around(image.view(), (&inner, &inner), usize::MAX, 8));
    }

    #[test]
    fn colors_of_the_surroundings_count_for_less() {
        let histogram = |shares: &[(usize, f32)]| {
            let mut h = KernelHistogram::empty(2);
            shares.iter().for_each(|(u, v)| h.0[*u] = *v);
            h
        };
        let (around, target) = (histogram(&[(0, 0.8), (1, 0.2)]), histogram(&[(0, 0.5), (1, 0.25), (2, 0.25)]));
        let mut factors = Vec::new();
        around.rarities(&mut factors);
        assert_eq!(factors[..3], [0.25, 1.0, 1.0]);
        let mut model = KernelHistogram::empty(2);
        model.weigh(&target, &factors);
        // 1/8 + 1/4 + 1/4 = 5/8 is what remains.
        assert!((model.0[0] - 0.2).abs() < 1e-6 && (model.0[1] - 0.4).abs() < 1e-6 && (model.0[2] - 0.4).abs() < 1e-6);
        model.weigh(&target, &[0.0; 8]);
        assert_eq!(model, target);
    }

    #[test]
    fn the_coefficient_is_one_of_equals_and_nought_of_strangers() {
        let (mut a, mut b) = (KernelHistogram::empty(2), KernelHistogram::empty(2));
        (a.0[0], a.0[1], b.0[2], b.0[3]) = (0.5, 0.5, 0.9, 0.1);
        assert!((a.coefficient(&a) - 1.0).abs() < 1e-6 && a.coefficient(&b) == 0.0);
        b.0[0] = 0.32;
        assert!((a.coefficient(&b) - 0.4).abs() < 1e-6);
        assert!(a.is_sound(2) && !a.is_sound(3) && !b.is_sound(2));
    }
}
