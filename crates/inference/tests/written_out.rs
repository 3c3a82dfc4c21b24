//! LightFC and VitTrack answer what onnxruntime answers, without allocating.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_inference::lightfc::LightFc;
use pursuit_inference::nanotrack::Patch;
use pursuit_inference::siamese::SiameseNetwork;
use pursuit_inference::vittrack::VitTrack;

/// Made by `xtask/peers/network_fixtures.py`.
const LIGHTFC: &[u8] = include_bytes!("fixtures/lightfc.bin");
const VITTRACK: &[u8] = include_bytes!("fixtures/vittrack.bin");

const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f32; 3] = [0.229, 0.224, 0.225];
/// Where the two search images begin.
const SHIFTS: [i64; 2] = [0, 40];
const POINTS: usize = 256;

/// Rings and stripes, by the formula of the script: channel values of the pixel in column x, row y.
fn pixel(x: i64, y: i64) -> [f32; 3] {
    let (dx, dy) = (x - 128, y - 128);
    let planes = [
        (dx * dx + dy * dy).div_euclid(24),
        (3 * dx * dx + dx * dy).div_euclid(96),
        2 * dx + 5 * dy + (dy * dy).div_euclid(16),
    ];
    std::array::from_fn(|c| (planes[c].rem_euclid(256) as f32 / 255.0 - MEAN[c]) / DEVIATION[c])
}

fn write(network: &mut impl SiameseNetwork, patch: Patch, side: i64, shift: i64) {
    for y in 0..side {
        let planes = [0, 1, 2].map(|c| (0..side).map(|x| pixel(x + shift, y + shift)[c]).collect::<Vec<f32>>());
        network.write_row(patch, y as usize, planes.each_ref().map(Vec::as_slice));
    }
}

fn with_template(mut network: impl SiameseNetwork, shift: i64) -> impl SiameseNetwork {
    write(&mut network, Patch::Template, 128, shift);
    let features = network.embed().unwrap();
    network.set_template(&features).unwrap();
    network
}

fn answer(network: &mut impl SiameseNetwork, shift: i64) -> Vec<f32> {
    write(network, Patch::Search, 256, shift);
    let answer = network.search().unwrap();
    [answer.scores, answer.distances].concat()
}

/// The greatest difference, absolute or, of numbers above one, relative.
fn worst(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f32::max)
}

fn assert_agrees(network: impl SiameseNetwork, fixture: &[u8]) {
    let want: Vec<f32> = fixture.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let mut network = with_template(network, 64);
    for (shift, want) in SHIFTS.into_iter().zip(want.chunks_exact(5 * POINTS)) {
        let error = worst(&answer(&mut network, shift), want);
        println!("search at {shift}: {error}");
        assert!(error < 1e-3, "{error}");
    }
}

#[test]
fn lightfc_agrees_with_onnxruntime() {
    assert_agrees(LightFc::new().unwrap(), LIGHTFC);
}

#[test]
fn vittrack_agrees_with_onnxruntime() {
    assert_agrees(VitTrack::new().unwrap(), VITTRACK);
}

/// The layers are shared by all networks of a thread; templates and images that have not been looked at are not.
fn assert_undisturbed<N: SiameseNetwork>(new: impl Fn() -> N) {
    let alone = |shift| answer(&mut with_template(new(), shift), shift - 64);
    let expected = [alone(64), alone(96)];
    assert_ne!(expected[0], expected[1]);
    let mut networks = [with_template(new(), 64), with_template(new(), 96)];
    for (network, shift) in networks.iter_mut().zip([0, 32]) {
        write(network, Patch::Search, 256, shift);
    }
    for (network, expected) in networks.iter_mut().zip(expected) {
        let answer = network.search().unwrap();
        assert_eq!([answer.scores, answer.distances].concat(), expected);
    }
}

#[test]
fn networks_do_not_disturb_each_other() {
    assert_undisturbed(|| LightFc::new().unwrap());
    assert_undisturbed(|| VitTrack::new().unwrap());
}

#[test]
fn a_search_allocates_nothing() {
    fn of(network: impl SiameseNetwork) {
        let mut network = with_template(network, 64);
        let planes = [[0.5f32; 256]; 3];
        let mut search = || {
            (0..256).for_each(|y| network.write_row(Patch::Search, y, planes.each_ref().map(|p| &p[..])));
            std::hint::black_box(network.search().unwrap());
        };
        search();
        let info = allocation_counter::measure(search);
        assert_eq!(info.count_total, 0, "{info:?}");
    }
    of(LightFc::new().unwrap());
    of(VitTrack::new().unwrap());
}

#[test]
fn features_of_another_network_are_refused() {
    let features = LightFc::new().unwrap().template_features();
    let error = SiameseNetwork::set_template(&mut VitTrack::new().unwrap(), &features).unwrap_err().to_string();
    assert!(error.contains("vittrack") && error.contains("3072") && error.contains("6144"), "{error}");
}
