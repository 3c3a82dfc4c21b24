//! Milliseconds of a search by NanoTrack v3, the best and the median of many: `cargo run --release --example speed`.
#![allow(clippy::expect_used, reason = "an example may panic")]

use pursuit_inference::nanotrack::{NanoTrackV3, Patch};
use std::time::Instant;

fn main() {
    let rounds: usize = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(300);
    let mut network = NanoTrackV3::new().expect("the weights are built in");
    let values: [fn(usize, usize) -> usize; 3] = [|x, _| x * 7, |_, y| y * 5, |x, y| (x + y) * 3];
    for (patch, side) in [(Patch::Template, 127), (Patch::Search, 255)] {
        for y in 0..side {
            let planes = values.map(|value| (0..side).map(|x| (value(x, y) % 256) as f32).collect::<Vec<f32>>());
            network.write_row(patch, y, planes.each_ref().map(Vec::as_slice));
        }
    }
    let features = network.template_features();
    let start = Instant::now();
    assert!(network.set_template(&features));
    println!("template {:.3} ms", start.elapsed().as_secs_f64() * 1e3);
    let mut times: Vec<f64> = (0..rounds)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(network.search());
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("search best {:.3} ms, median {:.3} ms", times[0], times[rounds / 2]);
}
