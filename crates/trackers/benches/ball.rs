//! One update of the ball tracker on 1280×720 frames, one thread: smoothing, HSV range, opening, regions, judgement, filter.
#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_trackers::registry;
use std::hint::black_box;

/// A yellow ball of 44 px on a textured ground, frame `k` of a slow roll.
fn frame(k: u64) -> Frame {
    let center = center(k);
    let image = Image::from_fn(1280, 720, |x, y| {
        let shade = ((x * 7919 + y * 104_729) % 23) as u8;
        let away = center.distance(Point::new(x as f64 + 0.5, y as f64 + 0.5));
        if away < 22.0 { [235 - shade, 205 - shade, 30 + shade] } else { [80 + shade, 90 + shade, 100 + shade / 2] }
    });
    Frame::new(k, k as f64 / 30.0, image.unwrap())
}

fn center(k: u64) -> Point {
    Point::new(300.0 + 9.0 * k as f64, 360.0 + 2.0 * k as f64)
}

fn ball(c: &mut Criterion) {
    let frames: Vec<Frame> = (0..30).map(frame).collect();
    let mut group = c.benchmark_group("ball, 720p");
    for (name, motion) in [("adaptive", "bounce"), ("paper", "ball")] {
        let set = toml::Table::from_iter([("motion.model".to_owned(), toml::Value::String(motion.to_owned()))]);
        let recipe = registry::tracker("ball").unwrap().recipe(&set).unwrap();
        let tracker = recipe.init(&frames[0], BBox::from_center_size(center(0), 44.0, 44.0)).unwrap();
        group.bench_function(format!("30 updates while tracked, {name} motion"), |b| {
            b.iter_batched_ref(
                || tracker.boxed_clone(),
                |tracker| frames.iter().skip(1).map(|f| tracker.update(f).unwrap().score).sum::<f64>(),
                BatchSize::LargeInput,
            );
        });
    }
    let set = toml::Table::from_iter([("color".to_owned(), toml::Value::String("yellow".to_owned()))]);
    let mut detector = registry::detector("ball").unwrap().detector(&set).unwrap();
    group.bench_function("detection in one frame", |b| {
        b.iter(|| detector.detect(black_box(&frames[3]), &[]).unwrap().len())
    });
    let set = toml::Table::from_iter([("color".to_owned(), toml::Value::String("blue".to_owned()))]);
    let mut detector = registry::detector("ball").unwrap().detector(&set).unwrap();
    group.bench_function("nothing to detect in one frame", |b| {
        b.iter(|| detector.detect(black_box(&frames[3]), &[]).unwrap().len())
    });
    group.finish();
}

criterion_group!(benches, ball);
criterion_main!(benches);
