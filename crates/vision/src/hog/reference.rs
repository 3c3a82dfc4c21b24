//! The definition, slowly and in `f64`, and the fast path against it.

use super::{Hog, HogLayout};
use crate::sampling::Planes;
use proptest::prelude::*;
use pursuit_geometry::Size;
use pursuit_testkit::Noise;

struct Reference {
    width: usize,
    height: usize,
    histograms: Vec<[f64; 18]>,
}

impl Reference {
    fn new(patch: &Planes, cell: usize) -> Self {
        let (w, h) = (patch.size().width, patch.size().height);
        let (width, height) = (w / cell, h / cell);
        let mut histograms = vec![[0.0; 18]; width * height];
        let at = |c: usize, y: isize, x: isize| {
            let (y, x) = (y.clamp(0, h as isize - 1) as usize, x.clamp(0, w as isize - 1) as usize);
            f64::from(patch.plane(c)[y * w + x])
        };
        for y in 0..(height * cell) as isize {
            for x in 0..(width * cell) as isize {
                let gradient = |c| (at(c, y, x + 1) - at(c, y, x - 1), at(c, y + 1, x) - at(c, y - 1, x));
                let length = |(dx, dy): (f64, f64)| dx.hypot(dy);
                let mut g = gradient(0);
                for c in 1..patch.channels() {
                    if length(gradient(c)) > length(g) {
                        g = gradient(c);
                    }
                }
                // The orientation with the largest projection; the patches below have no ties.
                let projection = |o: usize| {
                    let angle = (20.0 * o as f64).to_radians();
                    g.0 * angle.cos() + g.1 * angle.sin()
                };
                let best = (0..18).max_by(|a, b| projection(*a).total_cmp(&projection(*b))).unwrap();
                for cy in 0..height {
                    for cx in 0..width {
                        let share = |p: isize, c: usize| {
                            let centre = (c as f64 + 0.5) * cell as f64;
                            (1.0 - (p as f64 + 0.5 - centre).abs() / cell as f64).max(0.0)
                        };
                        histograms[cy * width + cx][best] += length(g) * share(x, cx) * share(y, cy);
                    }
                }
            }
        }
        Self { width, height, histograms }
    }

    fn unsigned(&self, y: usize, x: usize) -> [f64; 9] {
        let h = self.histograms[y * self.width + x];
        std::array::from_fn(|o| h[o] + h[o + 9])
    }

    /// Cells of the block whose top left cell is (y, x), moved inside.
    fn block(&self, y: isize, x: isize) -> Vec<[f64; 9]> {
        let inside = |k: isize, n: usize| k.clamp(0, (n as isize - 2).max(0)) as usize;
        let (top, left) = (inside(y, self.height), inside(x, self.width));
        let (bottom, right) = ((top + 1).min(self.height - 1), (left + 1).min(self.width - 1));
        vec![
            self.unsigned(top, left),
            self.unsigned(top, right),
            self.unsigned(bottom, left),
            self.unsigned(bottom, right),
        ]
    }

    fn features(&self, layout: HogLayout, y: usize, x: usize) -> Vec<f64> {
        let signed = self.histograms[y * self.width + x];
        let unsigned = self.unsigned(y, x);
        let (y, x) = (y as isize, x as isize);
        let blocks = [(y - 1, x - 1), (y - 1, x), (y, x - 1), (y, x)].map(|(y, x)| self.block(y, x));
        let norm = |cells: &[[f64; 9]]| (cells.iter().flatten().map(|v| v * v).sum::<f64>() + 1e-4).sqrt();
        let norms = [0, 1, 2, 3].map(|k| norm(&blocks[k]));
        let clipped = |v: f64, k: usize| (v / norms[k]).min(0.2);
        match layout {
            HogLayout::Felzenszwalb31 => {
                let mean = |v: &f64| (0..4).map(|k| clipped(*v, k)).sum::<f64>() / 2.0;
                let texture = |k| signed.iter().map(|v| clipped(*v, k)).sum::<f64>() / 18_f64.sqrt();
                signed.iter().map(mean).chain(unsigned.iter().map(mean)).chain((0..4).map(texture)).collect()
            }
            HogLayout::Dalal36 => (0..4)
                .flat_map(|k| {
                    let again: Vec<_> = blocks[k].iter().map(|cell| cell.map(|v| clipped(v, k))).collect();
                    let second = norm(&again);
                    unsigned.map(|v| clipped(v, k) / second)
                })
                .collect(),
        }
    }
}

/// Values in irregular fractions, so that no gradient lies halfway between two orientations (nor do they at 2 pixels or more).
fn patch(width: usize, height: usize, channels: usize, seed: u32) -> Planes {
    let mut planes = Planes::new(Size::new(width, height), channels);
    let mut noise = Noise::new(seed);
    for v in planes.as_mut_slice() {
        *v = (noise.draw() >> 8) as f32 / 65_793.0;
    }
    planes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn features_equal_the_slow_reference(
        width in 2usize..40, height in 2usize..40, color: bool, cell in 1usize..9, seed: u32, dalal: bool,
    ) {
        let patch = patch(width, height, if color { 3 } else { 1 }, seed);
        let layout = if dalal { HogLayout::Dalal36 } else { HogLayout::Felzenszwalb31 };
        let mut hog = Hog::new(layout, cell);
        let mut out = Planes::default();
        hog.extract(&patch, &mut out);
        let reference = Reference::new(&patch, cell);
        prop_assert_eq!(out.size(), Size::new(reference.width, reference.height));
        for y in 0..reference.height {
            for x in 0..reference.width {
                for (c, want) in reference.features(layout, y, x).into_iter().enumerate() {
                    let got = f64::from(out.plane(c)[y * reference.width + x]);
                    prop_assert!((got - want).abs() < 1e-5 * want.abs().max(1.0), "({y}, {x}) channel {c}: {got}, {want}");
                }
            }
        }
    }
}

#[test]
fn opposite_edges_differ_in_sign_only() {
    // Dark above bright, and the reverse: vertical gradients, which lie halfway between 80° and 100°.
    let step = |first: f32, second: f32| {
        let mut p = Planes::new(Size::new(24, 24), 1);
        let rows = p.as_mut_slice().chunks_exact_mut(24).enumerate();
        rows.for_each(|(y, row)| row.fill(if y < 12 { first } else { second }));
        let mut out = Planes::default();
        Hog::new(HogLayout::Felzenszwalb31, 4).extract(&p, &mut out);
        out
    };
    let (down, up) = (step(0.0, 200.0), step(200.0, 0.0));
    assert!(down.plane(4)[2 * 6 + 3] > 0.1 && up.plane(13)[2 * 6 + 3] > 0.1);
    assert_eq!(down.plane(4), up.plane(13));
    assert_eq!(down.plane(18 + 4), up.plane(18 + 4));
}

#[test]
fn scratch_of_another_shape_leaves_no_trace() {
    let mut hog = Hog::new(HogLayout::Felzenszwalb31, 4);
    let (mut first, mut again) = (Planes::default(), Planes::default());
    hog.extract(&patch(33, 18, 1, 1), &mut first);
    hog.extract(&patch(61, 44, 3, 2), &mut again);
    hog.extract(&patch(12, 80, 1, 3), &mut again);
    hog.extract(&patch(33, 18, 1, 1), &mut again);
    assert_eq!(first, again);
    hog.extract(&patch(3, 3, 1, 1), &mut again);
    assert_eq!(again.size().area(), 0);
}
