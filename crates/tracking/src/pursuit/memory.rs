use crate::regularised::Support;
use pursuit_geometry::Size;
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// How the target has looked: the first view, kept for good, and a few later ones.
///
/// A view is the features inside the target, scaled to length one; two views are compared by their inner product.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Memory {
    support: Support,
    grid: Size,
    channels: usize,
    capacity: usize,
    views: Vec<f32>,
    count: usize,
    oldest: usize,
    #[serde(skip)]
    view: Vec<f32>,
}

impl Memory {
    /// An empty memory of at most `capacity` (at least 1) views of the cells in `support`.
    pub fn new(support: Support, grid: Size, channels: usize, capacity: usize) -> Self {
        let (capacity, length) = (capacity.max(1), support.area() * channels);
        Self {
            support,
            grid,
            channels,
            capacity,
            views: vec![0.0; capacity * length],
            count: 0,
            oldest: 1,
            view: vec![0.0; length],
        }
    }

    const fn length(&self) -> usize {
        self.support.area() * self.channels
    }

    /// Takes the view out of `features`, displaced by whole cells.
    fn look(&mut self, features: &Planes, dx: isize, dy: isize) {
        self.view.resize(self.length(), 0.0);
        let Support { left, right, top, bottom } = self.support;
        let (width, height) = (self.grid.width as isize, self.grid.height as isize);
        let mut out = self.view.iter_mut();
        let mut energy = 0.0;
        for plane in features.planes().take(self.channels) {
            for y in top..bottom {
                let row = (y as isize + dy).clamp(0, height - 1) * width;
                for x in left..right {
                    let value = plane[(row + (x as isize + dx).clamp(0, width - 1)) as usize];
                    energy += value * value;
                    if let Some(out) = out.next() {
                        *out = value;
                    }
                }
            }
        }
        let scale = if energy > 0.0 { 1.0 / energy.sqrt() } else { 0.0 };
        self.view.iter_mut().for_each(|v| *v *= scale);
    }

    /// How much the target, displaced by `(dx, dy)` cells in `features`, looks like the most similar view and like the
    /// first one: `[−1, 1]` each, 0 while the memory is empty.
    pub fn similarity(&mut self, features: &Planes, dx: isize, dy: isize) -> (f64, f64) {
        self.look(features, dx, dy);
        let views = self.views.chunks_exact(self.length().max(1)).take(self.count);
        let product = |view: &[f32]| f64::from(view.iter().zip(&self.view).map(|(a, b)| a * b).sum::<f32>());
        let (mut best, mut first) = (f64::NEG_INFINITY, 0.0);
        for (i, view) in views.enumerate() {
            let likeness = product(view);
            best = f64::max(best, likeness);
            if i == 0 {
                first = likeness;
            }
        }
        if self.count == 0 { (0.0, 0.0) } else { (best, first) }
    }

    /// Remembers the target in the middle of `features`, in place of the oldest view but the first if need be.
    pub fn remember(&mut self, features: &Planes) {
        self.look(features, 0, 0);
        let slot = if self.count < self.capacity {
            self.count += 1;
            self.count - 1
        } else if self.capacity > 1 {
            let slot = self.oldest;
            self.oldest = if slot + 1 < self.capacity { slot + 1 } else { 1 };
            slot
        } else {
            return;
        };
        let length = self.length();
        self.views[slot * length..(slot + 1) * length].copy_from_slice(&self.view);
    }

    /// Checks a state that was read.
    ///
    /// # Errors
    /// What does not fit `grid`, `channels` and `support`.
    pub fn check(&self, grid: Size, channels: usize, support: Support) -> Result<(), String> {
        let fits = self.grid == grid
            && self.channels == channels
            && self.support == support
            && (1..=64).contains(&self.capacity)
            && self.views.len() == self.capacity * self.length()
            && self.count <= self.capacity
            && (1..self.capacity.max(2)).contains(&self.oldest);
        if fits { Ok(()) } else { Err("its memory of views does not fit its filter".into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn features(seed: usize) -> Planes {
        let mut planes = Planes::new(Size::new(8, 8), 2);
        planes.as_mut_slice().iter_mut().enumerate().for_each(|(i, v)| *v = ((i * 37 + seed * 101) % 23) as f32 - 11.0);
        planes
    }

    #[test]
    fn views_are_recognised_and_the_first_is_never_forgotten() {
        let mut memory = Memory::new(Support { left: 2, right: 6, top: 2, bottom: 6 }, Size::new(8, 8), 2, 3);
        assert_eq!(memory.similarity(&features(0), 0, 0), (0.0, 0.0));
        for seed in 0..6 {
            memory.remember(&features(seed));
        }
        let likeness = |memory: &mut Memory, seed| memory.similarity(&features(seed), 0, 0);
        for kept in [0, 4, 5] {
            assert!((likeness(&mut memory, kept).0 - 1.0).abs() < 1e-5, "{kept}");
        }
        assert!((likeness(&mut memory, 0).1 - 1.0).abs() < 1e-5);
        assert!(likeness(&mut memory, 2).0 < 0.9);
        // Displaced by whole cells, and far over the border.
        assert!(memory.similarity(&features(0), 1, 0).0 < 0.9);
        assert!(memory.similarity(&features(0), -100, 100).0.is_finite());
        let (grid, support) = (memory.grid, memory.support);
        assert!(memory.check(grid, 2, support).is_ok());
        assert!(memory.check(grid, 3, support).is_err());
    }
}
