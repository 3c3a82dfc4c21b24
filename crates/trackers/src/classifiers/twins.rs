//! What the classifiers are tested on.

use super::Classifier;
use super::canvas::{Canvas, LANES, Place, Shape};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_testkit::{lattice, value_noise};

/// A target with a texture of its own before another, which moves by `k`.
pub(super) fn canvas_at(k: f64) -> (Shape, Canvas) {
    let shape = Shape { width: 32, height: 32, reach: 32 };
    let mut canvas = Canvas::default();
    canvas.look(&frame_at(k), &shape, &BBox::from_ltwh(48.0, 48.0, 32.0, 32.0));
    (shape, canvas)
}

pub(super) fn frame_at(k: f64) -> Frame {
    let image = Image::from_fn(128, 128, |x, y| {
        let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
        let (u, v) = ((x - 64.0) / 16.0, (y - 64.0) / 16.0);
        if u.abs() < 1.0 && v.abs() < 1.0 {
            return (150.0 + 60.0 * (3.0 * u).sin() * (2.0 * v).cos() + 30.0 * u) as u8;
        }
        (40.0 + 120.0 * value_noise((x + k, y - 0.5 * k), 7.0, |t| t, |i, j| lattice(i, j, 3))) as u8
    });
    Frame::new(0, 0.0, image.unwrap())
}

pub(super) fn canvas() -> (Shape, Canvas) {
    canvas_at(0.0)
}

/// The best window and the ratings of all, row by row.
pub(super) fn ratings(classifier: &mut dyn Classifier, shape: &Shape, canvas: &Canvas) -> (Place, Vec<f32>) {
    let side = shape.windows();
    let mut all = vec![0.0; side * side];
    let mut lanes = [0.0; LANES];
    for (y, x) in (0..side).flat_map(|y| (0..side).step_by(LANES).map(move |x| (y, x))) {
        classifier.rate(canvas, Place { x, y }, &mut lanes);
        all[y * side + x..][..LANES].copy_from_slice(&lanes);
    }
    let best = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b])).unwrap();
    (Place { x: best % side, y: best / side }, all)
}
