use super::Support;
use crate::correlation::Likeness;
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// How the target looked at first, kept for good: a filter that learns answers whatever it has drifted to, the initial
/// template does not.
///
/// The features inside the target, scaled to length one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InitialTemplate {
    support: Support,
    channels: usize,
    likeness: Likeness,
    view: Vec<f32>,
}

impl InitialTemplate {
    /// The view of the cells in `support` of the first `channels` of `features` (without the weights of a window).
    pub fn new(support: Support, features: &Planes, channels: usize, likeness: Likeness) -> Self {
        let Support { left, right, top, bottom } = support;
        let (width, channels) = (features.size().width, channels.min(features.channels()));
        let mut view = Vec::with_capacity(support.area() * channels);
        for plane in features.planes().take(channels) {
            let cells = || (top..bottom).flat_map(|y| &plane[y * width + left..y * width + right]);
            let mean = match likeness {
                Likeness::Cosine => 0.0,
                Likeness::Correlation => cells().sum::<f32>() / support.area().max(1) as f32,
            };
            view.extend(cells().map(|v| v - mean));
        }
        let energy: f32 = view.iter().map(|v| v * v).sum();
        let scale = if energy > 0.0 { energy.sqrt().recip() } else { 0.0 };
        view.iter_mut().for_each(|v| *v *= scale);
        Self { support, channels, likeness, view }
    }

    /// How much the target, displaced by `(dx, dy)` cells in `features`, looks like the initial template: `[−1, 1]`. Cells
    /// outside repeat the border's.
    pub fn likeness(&self, features: &Planes, dx: isize, dy: isize) -> f64 {
        let Support { left, right, top, bottom } = self.support;
        let Size { width, height } = features.size();
        let inside = |at: usize, by: isize, n: usize| (at as isize + by).clamp(0, n as isize - 1) as usize;
        let (mut product, mut energy) = (0.0_f32, 0.0_f32);
        for (plane, view) in features.planes().zip(self.view.chunks_exact(self.support.area().max(1))) {
            let mut sums = Sums::default();
            for (y, view) in (top..bottom).zip(view.chunks_exact(right - left)) {
                let row = &plane[inside(y, dy, height) * width..][..width];
                let (first, last) = (inside(left, dx, width), inside(right - 1, dx, width));
                if last - first == right - 1 - left {
                    add(&mut sums, &row[first..=last], view);
                } else {
                    (left..right).zip(view).for_each(|(x, view)| sums.add(row[inside(x, dx, width)], *view));
                }
            }
            // A view without mean: that of the features drops out of the product.
            product += sums.product;
            energy += match self.likeness {
                Likeness::Cosine => sums.squares,
                Likeness::Correlation => sums.squares - sums.values * sums.values / view.len() as f32,
            };
        }
        if energy > 0.0 { f64::from(product / energy.sqrt()) } else { 0.0 }
    }

    /// Whether a state that was read fits the cells of `support` and `channels` channels.
    pub fn fits(&self, support: Support, channels: usize) -> bool {
        self.support == support && self.channels == channels && self.view.len() == support.area() * channels
    }
}

/// Sums over the cells of a channel.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    product: f32,
    squares: f32,
    values: f32,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, value: f32, view: f32) {
        self.product += value * view;
        self.squares += value * value;
        self.values += value;
    }
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn add(sums: &mut Sums, row: &[f32], view: &[f32]) {
    row.iter().zip(view).for_each(|(value, view)| sums.add(*value, *view));
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUPPORT: Support = Support { left: 3, right: 7, top: 2, bottom: 6 };

    /// A pattern displaced by whole cells, brighter and with more contrast.
    fn features(dx: usize, gain: f32) -> Planes {
        let mut planes = Planes::new(Size::new(11, 8), 2);
        let at = |i: usize| (((i + 11 - dx) * 37 + i / 88 * 5) % 23) as f32;
        planes.as_mut_slice().iter_mut().enumerate().for_each(|(i, v)| *v = 5.0 * gain + gain * at(i));
        planes
    }

    /// By its definition.
    fn slow(first: &Planes, now: &Planes, (dx, dy): (isize, isize), likeness: Likeness) -> f64 {
        let cut = |planes: &Planes, (dx, dy): (isize, isize)| -> Vec<f64> {
            let channel = |plane: &[f32]| -> Vec<f64> {
                let at = |x: usize, y: usize| {
                    let x = (x as isize + dx).clamp(0, 10) as usize;
                    f64::from(plane[(y as isize + dy).clamp(0, 7) as usize * 11 + x])
                };
                let cells: Vec<f64> = (2..6).flat_map(|y| (3..7).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
                let mean = cells.iter().sum::<f64>() / 16.0 * f64::from(likeness == Likeness::Correlation);
                cells.into_iter().map(|v| v - mean).collect()
            };
            planes.planes().flat_map(channel).collect()
        };
        let (a, b) = (cut(first, (0, 0)), cut(now, (dx, dy)));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt()
    }

    #[test]
    fn likeness_is_by_its_definition() {
        let first = features(0, 1.0);
        let view = InitialTemplate::new(SUPPORT, &first, 2, Likeness::Correlation);
        assert!((view.likeness(&first, 0, 0) - 1.0).abs() < 1e-5);
        assert!((view.likeness(&features(2, 3.0), 2, 0) - 1.0).abs() < 1e-5);
        for likeness in [Likeness::Cosine, Likeness::Correlation] {
            let view = InitialTemplate::new(SUPPORT, &first, 2, likeness);
            for by in [(0, 0), (1, 0), (-2, 1), (4, -2), (-3, 2)] {
                let (got, want) =
                    (view.likeness(&features(1, 2.0), by.0, by.1), slow(&first, &features(1, 2.0), by, likeness));
                assert!((got - want).abs() < 1e-4, "{likeness:?} {by:?}: {got} is not {want}");
            }
        }
        // Far outside there is but the border's corner.
        assert_eq!(view.likeness(&features(1, 2.0), 100, -100), 0.0);
        let flat = Planes::new(Size::new(11, 8), 2);
        assert_eq!(view.likeness(&flat, 0, 0), 0.0);
        assert_eq!(InitialTemplate::new(SUPPORT, &flat, 2, Likeness::Correlation).likeness(&first, 0, 0), 0.0);
    }

    #[test]
    fn only_the_channels_asked_for_count() {
        let mut now = features(0, 1.0);
        now.plane_mut(1).iter_mut().for_each(|v| *v = -*v);
        let likeness = |channels| {
            InitialTemplate::new(SUPPORT, &features(0, 1.0), channels, Likeness::Cosine).likeness(&now, 0, 0)
        };
        assert!((likeness(1) - 1.0).abs() < 1e-5 && likeness(2) < 0.5);
    }

    #[test]
    fn states_that_do_not_fit_are_told() {
        let view = InitialTemplate::new(SUPPORT, &features(0, 1.0), 2, Likeness::Correlation);
        assert!(view.fits(SUPPORT, 2) && !view.fits(SUPPORT, 3));
        assert!(!view.fits(Support { left: 2, ..SUPPORT }, 2));
    }
}
