//! The kernels of the ball pipeline on a 1280×720 picture, one thread.
#![allow(clippy::expect_used, reason = "a bench may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use pursuit_geometry::Size;
use pursuit_imaging::Image;
use pursuit_vision::PixelWindow;
use pursuit_vision::color::HsvRange;
use pursuit_vision::contour::{perimeter, trace};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::regions::RegionFinder;
use pursuit_vision::segmentation::{in_range, threshold};
use pursuit_vision::smoothing::SmoothedColor;
use std::hint::black_box;

fn kernels(c: &mut Criterion) {
    let size = Size::new(1280, 720);
    let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 97) as u8;
    let blobs = |x: usize, y: usize| {
        let (dx, dy) = ((x % 40) as f64 - 20.0, (y % 32) as f64 - 16.0);
        if dx.hypot(dy) < 11.0 { 255 } else { 0 }
    };
    let color = Image::from_fn(size.width, size.height, |x, y| {
        let n = noise(x, y);
        if blobs(x, y) > 0 { [200 - n / 4, 120, 20 + n / 4] } else { [90 + n, 80 + n, 70 + n / 2] }
    })
    .expect("valid size");
    let gray = Image::from_fn(size.width, size.height, noise).expect("valid size");
    let mask = Image::from_fn(size.width, size.height, blobs).expect("valid size");
    let mut out = mask.clone();

    let mut group = c.benchmark_group("720p");
    let mut smoothed = SmoothedColor::new();
    group.bench_function("gaussian 5x5, colour", |b| {
        b.iter(|| smoothed.smooth(color.view(), PixelWindow::full(size)));
    });
    let range = HsvRange { hue_low: 4, hue_high: 22, saturation_low: 100, value_low: 80, ..HsvRange::ALL };
    group.bench_function("colour range in HSV", |b| b.iter(|| in_range(&smoothed, &range, &mut out)));
    group.bench_function("threshold", |b| b.iter(|| threshold(gray.view(), black_box(50), &mut out)));
    let mut scratch = MorphologyScratch::default();
    let mut opened = mask.clone();
    group.bench_function("erode twice, dilate twice", |b| {
        b.iter(|| erode(&mut opened, 2, &mut scratch).and_then(|()| dilate(&mut opened, 2, &mut scratch)));
    });
    let mut finder = RegionFinder::default();
    group.bench_function("regions", |b| b.iter(|| finder.find(mask.view(), 1).len()));
    let (mut finder, mut outline) = (RegionFinder::default(), Vec::new());
    group.bench_function("regions and outlines", |b| {
        b.iter(|| {
            let regions = finder.find(mask.view(), 1);
            regions
                .iter()
                .map(|r| {
                    trace(mask.view(), r.first, &mut outline);
                    perimeter(&outline)
                })
                .sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, kernels);
criterion_main!(benches);
