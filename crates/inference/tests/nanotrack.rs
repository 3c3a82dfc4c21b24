//! NanoTrack v3 answers what onnxruntime answers.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_inference::nanotrack::{NanoTrackV3, Patch};

/// Made by `xtask/peers/nanotrack_fixture.py`.
const FIXTURE: &[u8] = include_bytes!("fixtures/nanotrack_v3.bin");
const POINTS: usize = NanoTrackV3::ANSWER_SIDE * NanoTrackV3::ANSWER_SIDE;

/// Rings and stripes, by the formula of the script: channel values of the pixel in column x, row y.
fn pixel(x: i64, y: i64) -> [f32; 3] {
    let (dx, dy) = (x - 128, y - 128);
    let planes = [
        (dx * dx + dy * dy).div_euclid(24),
        (3 * dx * dx + dx * dy).div_euclid(96),
        2 * dx + 5 * dy + (dy * dy).div_euclid(16),
    ];
    planes.map(|p| p.rem_euclid(256) as f32)
}

fn write(network: &mut NanoTrackV3, patch: Patch, side: i64, shift: i64) {
    for y in 0..side {
        let planes = [0, 1, 2].map(|c| (0..side).map(|x| pixel(x + shift, y + shift)[c]).collect::<Vec<f32>>());
        network.write_row(patch, y as usize, planes.each_ref().map(Vec::as_slice));
    }
}

/// Answers with the released and with the rounded weights: logits, distances.
fn fixture() -> [Vec<f32>; 4] {
    let numbers: Vec<f32> = FIXTURE.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let (released, rounded) = numbers.split_at(6 * POINTS);
    [&released[..2 * POINTS], &released[2 * POINTS..], &rounded[..2 * POINTS], &rounded[2 * POINTS..]]
        .map(<[f32]>::to_vec)
}

fn worst(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f32::max)
}

#[test]
fn answers_agree_with_onnxruntime() {
    let mut network = NanoTrackV3::new().unwrap();
    write(&mut network, Patch::Template, 127, 64);
    write(&mut network, Patch::Search, 255, 0);
    let features = network.template_features();
    assert_eq!(features.len(), NanoTrackV3::TEMPLATE_LEN);
    assert!(network.set_template(&features));
    let (logits, distances) = network.search();
    let [released_logits, released_distances, rounded_logits, rounded_distances] = fixture();
    let errors = [worst(logits, &rounded_logits), worst(distances, &rounded_distances)];
    println!(
        "same weights {errors:?}, released weights {:?}",
        [worst(logits, &released_logits), worst(distances, &released_distances)]
    );
    assert!(errors.iter().all(|&e| e < 1e-3), "with the same weights {errors:?}");
    // The rest is the rounding of the weights to half precision.
    assert!(worst(logits, &released_logits) < 0.02);
    assert!(worst(distances, &released_distances) < 0.02);
}

/// The layers are shared by all networks of a thread; templates and images that have not been looked at are not.
#[test]
fn networks_do_not_disturb_each_other() {
    let alone = |shift: i64| {
        let mut network = NanoTrackV3::new().unwrap();
        write(&mut network, Patch::Template, 127, shift);
        let features = network.template_features();
        assert!(network.set_template(&features));
        write(&mut network, Patch::Search, 255, shift - 64);
        let (logits, distances) = network.search();
        let answer = (logits.to_vec(), distances.to_vec());
        (network, answer)
    };
    let ((mut a, first), (mut b, second)) = (alone(64), alone(96));
    assert_ne!(first, second);
    let answer = |network: &mut NanoTrackV3| {
        let (logits, distances) = network.search();
        (logits.to_vec(), distances.to_vec())
    };
    for y in 0..255 {
        for (network, shift) in [(&mut a, 0), (&mut b, 32)] {
            let planes = [0, 1, 2].map(|c| (0..255).map(|x| pixel(x + shift, y + shift)[c]).collect::<Vec<f32>>());
            network.write_row(Patch::Search, y as usize, planes.each_ref().map(Vec::as_slice));
        }
    }
    let moved = std::thread::spawn(move || answer(&mut b));
    assert_eq!(answer(&mut a), first);
    assert_eq!(moved.join().unwrap(), second);
}
