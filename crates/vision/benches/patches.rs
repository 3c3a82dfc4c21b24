//! Sampling and features of a window the size a correlation filter looks at.
#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Image;
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};
use std::hint::black_box;

fn patches(c: &mut Criterion) {
    let image = Image::from_fn(640, 480, |x, y| [(x * 7 + y * 3) as u8, (x * y) as u8, (x + y * y) as u8]).unwrap();
    let gray = Image::from_fn(640, 480, |x, y| (x * 7 + y * y) as u8).unwrap();
    let mut sampler = Sampler::new();
    let mut patch = Planes::default();
    for step in [0.8, 1.0, 1.7, 3.0] {
        let window = Window::new(Point::new(301.3, 222.8), step, Size::new(96, 96));
        c.bench_function(&format!("sample gray 96x96 step {step}"), |b| {
            b.iter(|| sampler.gray(gray.view(), black_box(&window), &mut patch));
        });
        c.bench_function(&format!("sample color 96x96 step {step}"), |b| {
            b.iter(|| sampler.color(image.view(), black_box(&window), &mut patch));
        });
    }
    let mut out = Planes::default();
    let window = Window::new(Point::new(301.3, 222.8), 1.1, Size::new(96, 96));
    for layout in [HogLayout::Felzenszwalb31, HogLayout::Dalal36] {
        let mut hog = Hog::new(layout, 4);
        sampler.gray(gray.view(), &window, &mut patch);
        c.bench_function(&format!("{layout:?} gray 96x96"), |b| b.iter(|| hog.extract(black_box(&patch), &mut out)));
        sampler.color(image.view(), &window, &mut patch);
        c.bench_function(&format!("{layout:?} color 96x96"), |b| b.iter(|| hog.extract(black_box(&patch), &mut out)));
    }
}

criterion_group!(benches, patches);
criterion_main!(benches);
