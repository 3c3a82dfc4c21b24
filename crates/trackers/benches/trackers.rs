//! One update of every tracker of the registry on a target of 64 px in 640×480, one thread, and its start.
#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_trackers::registry;

/// The frames' target: orange and textured, 64 pixels wide, moving slowly.
fn bbox(k: u64) -> BBox {
    BBox::from_ltwh(200.0 + 3.0 * k as f64, 180.0 + k as f64, 64.0, 64.0)
}

fn frame(k: u64) -> Frame {
    let target = bbox(k);
    let image = Image::from_fn(640, 480, |x, y| {
        let shade = ((x / 4 * 7919 + y / 4 * 104_729) % 61) as u8;
        let (u, v) = (x as f64 + 0.5 - target.left(), y as f64 + 0.5 - target.top());
        if (0.0..64.0).contains(&u) && (0.0..64.0).contains(&v) {
            let pattern = ((u as usize / 5 * 31 + v as usize / 5 * 17) % 71) as u8;
            [235 - pattern, 130 - pattern / 2, 30]
        } else {
            [80 + shade, 90 + shade, 100 + shade / 2]
        }
    });
    Frame::new(k, k as f64 / 30.0, image.unwrap())
}

fn updates(c: &mut Criterion) {
    let frames: Vec<Frame> = (0..20).map(frame).collect();
    let mut group = c.benchmark_group("19 updates, 640x480");
    for entry in registry::ready() {
        let tracker = entry.default_recipe().init(&frames[0], bbox(0)).unwrap();
        group.bench_function(entry.name, |b| {
            b.iter_batched_ref(
                || tracker.boxed_clone(),
                |tracker| frames[1..].iter().map(|f| tracker.update(f).unwrap().score).sum::<f64>(),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

fn starts(c: &mut Criterion) {
    let first = frame(0);
    let mut group = c.benchmark_group("start");
    for entry in registry::ready() {
        let recipe = entry.default_recipe();
        group.bench_function(entry.name, |b| b.iter(|| recipe.init(&first, bbox(0)).unwrap()));
    }
    group.finish();
}

criterion_group!(benches, updates, starts);
criterion_main!(benches);
