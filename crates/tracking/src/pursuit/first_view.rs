use crate::regularised::Support;
use pursuit_geometry::Size;
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// How the target looked when it was shown: what it is compared with for good, since a filter that learns the wrong thing
/// goes on answering to it.
///
/// The view is the features inside the target, scaled to length one; two views are compared by their inner product.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FirstView {
    support: Support,
    grid: Size,
    channels: usize,
    view: Vec<f32>,
}

impl FirstView {
    /// The cells of `support` in the first `channels` planes of `features`.
    pub fn of(features: &Planes, support: Support, channels: usize) -> Self {
        let mut first = Self { support, grid: features.size(), channels, view: vec![0.0; support.area() * channels] };
        let mut view = std::mem::take(&mut first.view);
        let mut out = view.iter_mut();
        first.visit(features, 0, 0, |v| {
            if let Some(out) = out.next() {
                *out = v;
            }
        });
        let energy: f32 = view.iter().map(|v| v * v).sum();
        let scale = if energy > 0.0 { 1.0 / energy.sqrt() } else { 0.0 };
        view.iter_mut().for_each(|v| *v *= scale);
        Self { view, ..first }
    }

    /// Reads the features inside the target, displaced by whole cells; what lies outside of the window is as its border.
    #[inline(always)]
    fn visit(&self, features: &Planes, dx: isize, dy: isize, mut read: impl FnMut(f32)) {
        let Support { left, right, top, bottom } = self.support;
        let (width, height) = (self.grid.width as isize, self.grid.height as isize);
        for plane in features.planes().take(self.channels) {
            for y in top..bottom {
                let row = (y as isize + dy).clamp(0, height - 1) * width;
                for x in left..right {
                    read(plane[(row + (x as isize + dx).clamp(0, width - 1)) as usize]);
                }
            }
        }
    }

    /// How much the target, displaced by `(dx, dy)` cells in `features`, looks as it did: `[−1, 1]`, 0 where either is blank.
    pub fn likeness(&self, features: &Planes, dx: isize, dy: isize) -> f64 {
        let (mut product, mut energy) = (0.0f32, 0.0f32);
        let mut view = self.view.iter();
        self.visit(features, dx, dy, |v| {
            product += v * view.next().copied().unwrap_or_default();
            energy += v * v;
        });
        if energy > 0.0 { f64::from(product / energy.sqrt()) } else { 0.0 }
    }

    /// Checks a state that was read.
    ///
    /// # Errors
    /// What does not fit `grid`, `channels` and `support`.
    pub fn check(&self, grid: Size, channels: usize, support: Support) -> Result<(), String> {
        let fits = self.grid == grid
            && self.channels == channels
            && self.support == support
            && self.view.len() == support.area() * channels;
        if fits { Ok(()) } else { Err("its first view does not fit its filter".into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUPPORT: Support = Support { left: 2, right: 6, top: 2, bottom: 6 };

    fn features(seed: usize) -> Planes {
        let mut planes = Planes::new(Size::new(8, 8), 3);
        planes.as_mut_slice().iter_mut().enumerate().for_each(|(i, v)| *v = ((i * 37 + seed * 101) % 23) as f32 - 11.0);
        planes
    }

    #[test]
    fn it_knows_itself_wherever_it_is_and_whatever_its_contrast() {
        let first = FirstView::of(&features(0), SUPPORT, 2);
        assert!((first.likeness(&features(0), 0, 0) - 1.0).abs() < 1e-5);
        assert!(first.likeness(&features(5), 0, 0) < 0.9);
        let mut moved = Planes::new(Size::new(8, 8), 3);
        for c in 0..3 {
            for i in 0..64 {
                let (x, y) = ((i % 8 + 1) % 8, (i / 8 + 6) % 8);
                moved.plane_mut(c)[y * 8 + x] = 0.3 * features(0).plane(c)[i];
            }
        }
        assert!((first.likeness(&moved, 1, -2) - 1.0).abs() < 1e-5);
        assert_eq!(first.likeness(&Planes::new(Size::new(8, 8), 3), 0, 0), 0.0);
    }

    #[test]
    fn a_state_that_does_not_fit_is_refused() {
        let first = FirstView::of(&features(0), SUPPORT, 2);
        assert!(first.check(Size::new(8, 8), 2, SUPPORT).is_ok());
        assert!(first.check(Size::new(8, 8), 3, SUPPORT).is_err());
        let mut broken = first;
        broken.view.pop();
        assert!(broken.check(Size::new(8, 8), 2, SUPPORT).is_err());
    }
}
