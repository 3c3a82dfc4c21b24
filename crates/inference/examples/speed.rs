//! Milliseconds of a search by each network that is built in, the best and the median of many:
//! `cargo run --release --example speed -- [ROUNDS]`.
#![allow(clippy::expect_used, reason = "an example may panic")]

use pursuit_inference::lightfc::LightFc;
use pursuit_inference::nanotrack::{NanoTrackV3, Patch};
use pursuit_inference::siamese::SiameseNetwork;
use pursuit_inference::vittrack::VitTrack;
use std::time::Instant;

fn main() {
    let rounds: usize = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(300);
    measure("nanotrack", NanoTrackV3::new().expect("the weights are built in"), rounds);
    measure("lightfc", LightFc::new().expect("the weights are built in"), rounds);
    measure("vittrack", VitTrack::new().expect("the weights are built in"), rounds);
}

fn measure(name: &str, mut network: impl SiameseNetwork, rounds: usize) {
    let values: [fn(usize, usize) -> usize; 3] = [|x, _| x * 7, |_, y| y * 5, |x, y| (x + y) * 3];
    let sides = network.sides();
    for (patch, side) in [(Patch::Template, sides.template), (Patch::Search, sides.search)] {
        for y in 0..side {
            let planes =
                values.map(|value| (0..side).map(|x| (value(x, y) % 256) as f32 / 64.0 - 2.0).collect::<Vec<f32>>());
            network.write_row(patch, y, planes.each_ref().map(Vec::as_slice));
        }
    }
    let start = Instant::now();
    let features = network.embed().expect("the image has been written");
    network.set_template(&features).expect("features are the network's own");
    let template = start.elapsed().as_secs_f64() * 1e3;
    let mut times: Vec<f64> = (0..rounds)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(network.search().expect("the image has been written").scores[0]);
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("{name}: template {template:.3} ms, search best {:.3} ms, median {:.3} ms", times[0], times[rounds / 2]);
}
