//! What it costs a tracker to say what became of a frame: until the message is handed to the links.
#![allow(missing_docs, clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use pursuit_mavlink::{Camera, CameraFacts, Endpoint, Identity, Place, Tracking};
use std::hint::black_box;

fn tell(c: &mut Criterion) {
    let endpoint = Endpoint::start(Identity::default(), &["udpout:127.0.0.1:9".parse().unwrap()], None).unwrap();
    let facts = CameraFacts {
        vendor: "pursuit".into(),
        model: "bench".into(),
        size: (1280, 720),
        field_of_view_deg: Some(60.0),
        fps: Some(30.0),
        stream: None,
        pitch_deg: 0.0,
        // With every picture, so that each call sends something.
        landing_target: true,
        target_width_m: Some(0.5),
        gimbal_device: 0,
    };
    let camera = Camera::start(endpoint, facts).unwrap();
    let place = Place { left: 0.2, top: 0.3, right: 0.4, bottom: 0.5 };
    c.bench_function("tell", |b| b.iter(|| camera.tell(black_box(Tracking::Seen(place)))));
}

criterion_group!(benches, tell);
criterion_main!(benches);
