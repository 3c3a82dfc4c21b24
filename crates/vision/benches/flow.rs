//! Optical flow and global motion on 1280×720 pictures, one thread; `opencv.py` beside times OpenCV on the same ones.
#![allow(clippy::expect_used, reason = "a bench may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Image;
use pursuit_vision::flow::dense::{DenseFlow, DenseFlowParams, FlowField};
use pursuit_vision::flow::{
    GoodFeatures, GoodFeaturesParams, LucasKanade, LucasKanadeParams, MedianFlow, MedianFlowParams, Pyramid, grid,
};
use pursuit_vision::global_motion::{PhaseCorrelation, SparseMotion, SparseMotionParams};
use pursuit_vision::integral::IntegralImage;

/// Waves of four lengths, moved by (dx, dy).
fn picture(dx: f64, dy: f64) -> Image<u8> {
    Image::from_fn(1280, 720, |x, y| {
        let (x, y) = (x as f64 - dx, y as f64 - dy);
        let wave = |a: f64, b: f64| (a * x + b * y).sin();
        let sum = wave(0.31, 0.17) + wave(-0.23, 0.29) + wave(0.071, -0.053) + wave(0.043, 0.061);
        (127.5 + 30.0 * sum) as u8
    })
    .expect("valid size")
}

fn flow(c: &mut Criterion) {
    let (first, second) = (picture(0.0, 0.0), picture(3.3, -2.1));
    let (from, to) = (Pyramid::of(first.view(), 4).expect("valid"), Pyramid::of(second.view(), 4).expect("valid"));
    let mut points: Vec<Point> = Vec::new();
    grid(&BBox::from_ltwh(60.0, 60.0, 1160.0, 600.0), Size::new(20, 10), &mut points);
    let mut group = c.benchmark_group("720p");
    let mut pyramid = from.clone();
    group.bench_function("pyramid, 4 levels", |b| b.iter(|| pyramid.build(second.view(), 4)));
    let mut lk = LucasKanade::new(LucasKanadeParams::default()).expect("valid");
    let mut tracks = Vec::new();
    group.bench_function("200 points 21x21, pyramids given", |b| b.iter(|| lk.track(&from, &to, &points, &mut tracks)));
    let mut pyramids = [from.clone(), to.clone()];
    group.bench_function("200 points 21x21, two pyramids and flow", |b| {
        b.iter(|| {
            pyramids[0].build(first.view(), 4).expect("valid");
            pyramids[1].build(second.view(), 4).expect("valid");
            lk.track(&pyramids[0], &pyramids[1], &points, &mut tracks)
        });
    });
    let mut median = MedianFlow::new(MedianFlowParams::default()).expect("valid");
    let target = BBox::from_ltwh(500.0, 300.0, 120.0, 90.0);
    group.bench_function("median flow of a box", |b| b.iter(|| median.estimate(&from, &to, &target)));
    let mut motion = SparseMotion::new(SparseMotionParams::default()).expect("valid");
    group.bench_function("global motion, sparse", |b| b.iter(|| motion.estimate(&from, &to, &[])));
    let mut corners = GoodFeatures::new(GoodFeaturesParams::default()).expect("valid");
    group.bench_function("200 corners", |b| b.iter(|| corners.find(first.view(), &[]).len()));
    let presets = [
        ("default", DenseFlowParams::default()),
        ("kroeger2016 fast", DenseFlowParams::kroeger2016_fast()),
        ("kroeger2016 fine", DenseFlowParams::kroeger2016_fine()),
    ];
    for (name, params) in presets {
        let mut dense = DenseFlow::new(params).expect("valid");
        let levels = dense.levels(first.size());
        let (from, to) =
            (Pyramid::of(first.view(), levels).expect("valid"), Pyramid::of(second.view(), levels).expect("valid"));
        let mut field = FlowField::zero(first.size()).expect("valid");
        group.bench_function(format!("dense flow, {name}"), |b| b.iter(|| dense.estimate(&from, &to, &mut field)));
    }
    let mut phase = PhaseCorrelation::new(160);
    group.bench_function("global motion, phase", |b| b.iter(|| phase.estimate(&from, &to)));
    let mut integral = IntegralImage::new();
    group.bench_function("integral image and squares", |b| b.iter(|| integral.build(first.view())));
    group.finish();
}

criterion_group!(benches, flow);
criterion_main!(benches);
