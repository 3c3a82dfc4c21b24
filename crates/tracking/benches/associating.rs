//! One update of many targets without pixels: walkers in a picture that grows with their number, so that it is as crowded with many as with few.
#![allow(clippy::unwrap_used, reason = "a bench may panic")]

#[path = "../tests/crowds/crowd.rs"]
mod crowd;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use crowd::Crowd;
use pursuit_parameters::Parameters;
use pursuit_tracking::Detection;
use pursuit_tracking::many::{Associating, ManyParams};

/// Frames that are timed, and as many before them until everybody is known.
const FRAMES: u64 = 20;

fn associating(c: &mut Criterion) {
    for model in ["nearest", "two-stage", "joint", "hypotheses"] {
        let mut group = c.benchmark_group(format!("{FRAMES} updates, {model}"));
        group.sample_size(10);
        for walkers in [4, 20, 100, 500, 1000, 3000] {
            let crowd = Crowd::of(walkers);
            let changes = format!("association.model = '{model}'").parse().unwrap();
            let params = ManyParams::default().with("many", &changes).unwrap();
            let mut known = Associating::fed(params).unwrap();
            for k in 0..FRAMES {
                known.update(Crowd::time_s(k), Some(crowd.size), &crowd.detections(k)).unwrap();
            }
            let saved = pursuit_tracking::MultiTracker::save(&known).unwrap();
            let frames: Vec<Vec<Detection>> = (FRAMES..2 * FRAMES).map(|k| crowd.detections(k)).collect();
            let recipes = |name: &str| Err(pursuit_tracking::TrackingError::UnknownTarget { id: name.len() as u64 });
            group.bench_function(BenchmarkId::from_parameter(walkers), |b| {
                b.iter_batched_ref(
                    || Associating::restore_fed(&saved, &|name| recipes(name)).unwrap(),
                    |many| {
                        let one = |(k, found): (u64, &Vec<Detection>)| {
                            many.update(Crowd::time_s(k), Some(crowd.size), found).unwrap().len()
                        };
                        (FRAMES..).zip(&frames).map(one).sum::<usize>()
                    },
                    BatchSize::LargeInput,
                );
            });
        }
        group.finish();
    }
}

criterion_group!(benches, associating);
criterion_main!(benches);
