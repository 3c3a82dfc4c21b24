//! Rulers: that they measure what is true, say how uncertain they are, and refuse what nothing can be measured with.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod common;

use common::Normal;
use pursuit_measuring::{Calibration, Ruler, Unit};

fn ruler(text: &str) -> Ruler {
    Ruler::new(&Calibration::from_toml(text).unwrap(), &[]).unwrap()
}

fn near(found: [f64; 2], expected: [f64; 2]) {
    assert!((found[0] - expected[0]).hypot(found[1] - expected[1]) < 1e-9, "{found:?} {expected:?}");
}

#[test]
fn a_stick_measures_up_and_down_from_the_origin() {
    let stick = "stick = { from = [100.0, 400.0], to = [600.0, 400.0], length = '0.50m' }\n";
    let up = ruler(&format!("{stick}axes = {{ origin = [200.0, 300.0] }}"));
    near(up.place([300.0, 250.0]).unwrap().0, [0.1, 0.05]);
    let down = ruler(&format!("{stick}axes = {{ origin = [200.0, 300.0], up = 'down' }}"));
    near(down.place([300.0, 250.0]).unwrap().0, [0.1, -0.05]);
    // x leads straight up in the picture: y leads to the left.
    let turned = ruler(&format!("{stick}axes = {{ origin = [200.0, 300.0], toward = [200.0, 100.0] }}"));
    near(turned.place([190.0, 250.0]).unwrap().0, [0.05, 0.01]);
    let by_angle = ruler(&format!("{stick}axes = {{ origin = [200.0, 300.0], angle_deg = 90.0 }}"));
    near(by_angle.place([190.0, 250.0]).unwrap().0, [0.05, 0.01]);
    let in_cm = ruler(&format!("unit = 'cm'\n{stick}"));
    assert_eq!((in_cm.unit(), in_cm.facts().kind), (Unit::Centimetre, "stick"));
    assert!((in_cm.facts().per_pixel.unwrap() - 0.1).abs() < 1e-12);
    near(in_cm.pixel(in_cm.place([33.0, 44.0]).unwrap().0).unwrap(), [33.0, 44.0]);
    let pixels = ruler("axes = { up = 'down' }");
    near(pixels.place([33.0, 44.0]).unwrap().0, [33.0, 44.0]);
}

#[test]
fn a_stick_is_as_uncertain_as_its_clicks_and_its_length() {
    let of = |length: &str, click: f64| {
        let text = format!(
            "stick = {{ from = [0.0, 0.0], to = [300.0, 400.0], length = '{length}', click_error_px = {click:?} }}"
        );
        ruler(&text).facts().relative_error.unwrap()
    };
    assert!((of("1m+-1cm", 0.0) - 0.01).abs() < 1e-9);
    // Two ends along the stick.
    assert!((of("1m", 0.5) - 0.5 * 2.0_f64.sqrt() / 500.0).abs() < 1e-5);
    assert!((of("1m+-1cm", 5.0) - 0.01_f64.hypot(2.0_f64.sqrt() / 100.0)).abs() < 3e-4);
}

#[test]
fn a_targets_own_size_is_a_ruler() {
    let calibration = Calibration::from_toml("target = { size = '7cm' }").unwrap();
    let boxes = [[34.0, 35.0], [35.0, 35.0], [36.0, 35.0]];
    let ruler = Ruler::new(&calibration, &boxes).unwrap();
    assert!((ruler.facts().per_pixel.unwrap() - 0.2).abs() < 1e-12);
    assert!(ruler.facts().relative_error.unwrap() > 0.01);
    assert!(Ruler::new(&calibration, &[]).unwrap_err().to_string().contains("measured in no frame"));
}

/// A floor seen by a true pinhole camera, with distortion: corner pixels and their places.
fn floor(click: f64, draw: &mut Normal, distorted: bool) -> String {
    let camera = "[camera]\npicture = [1280, 720]\nfocal = [900.0, 900.0]\ncentre = [640.0, 360.0]\ndistortion = [-0.18, 0.03, 0.0, 0.0]\n";
    let lens = pursuit_measuring::Camera {
        picture: [1280, 720],
        focal: [900.0, 900.0],
        centre: [640.0, 360.0],
        distortion: if distorted { vec![-0.18, 0.03, 0.0, 0.0] } else { Vec::new() },
    };
    let places = [[-1.0, 3.0], [1.0, 3.0], [1.5, 6.0], [-1.5, 6.0], [0.0, 4.0], [0.5, 5.0], [-0.7, 3.5], [0.9, 4.4]];
    let points: Vec<String> = places
        .iter()
        .map(|&[x, z]| {
            let seen = lens.distort(ideal([x, z]));
            format!("[{:?}, {:?}, {x:?}, {z:?}]", seen[0] + click * draw.draw(), seen[1] + click * draw.draw())
        })
        .collect();
    let plane =
        format!("plane = {{ unit = 'm', points = [{}], click_error_px = {:?} }}\n", points.join(", "), click.max(0.5));
    if distorted { plane + camera } else { plane }
}

/// Where a pinhole 1.6 m above the floor, looking down by 17°, shows a place on it.
fn ideal([x, z]: [f64; 2]) -> [f64; 2] {
    let (s, c) = 0.3_f64.sin_cos();
    let (depth, below) = (z * c + 1.6 * s, 1.6 * c - z * s);
    [640.0 + 900.0 * x / depth, 360.0 + 900.0 * below / depth]
}

#[test]
fn a_plane_seen_obliquely_is_measured_behind_a_lens() {
    let text = floor(0.0, &mut Normal::new(1), true);
    let calibration = Calibration::from_toml(&text).unwrap();
    let ruler = Ruler::new(&calibration, &[]).unwrap();
    assert!(ruler.facts().residuals_px.iter().all(|r| *r < 1e-6) && ruler.facts().warnings.is_empty());
    for place in [[0.3, 3.3], [-1.2, 5.5], [0.8, 4.1]] {
        let seen = calibration.camera.as_ref().unwrap().distort(ideal(place));
        near(ruler.place(seen).unwrap().0, place);
        near(ruler.pixel(place).unwrap(), seen);
    }
    assert!(ruler.place([640.0, 20.0]).is_none(), "above the horizon");
}

#[test]
fn a_planes_uncertainty_is_that_of_clicking_it_again() {
    let (place, mut square, mut said) = ([0.4, 4.5], 0.0, 0.0);
    let seeds = 300_u64;
    for seed in 0..seeds {
        let made = ruler(&floor(0.5, &mut Normal::new(seed), false));
        let found = made.place(ideal(place)).unwrap().0;
        square += (found[1] - place[1]).powi(2) / seeds as f64;
        // A still target, measured without error: all that is uncertain is the ruler.
        let still = (0..8_u64).map(|k| pursuit_measuring::Sighting {
            frame: k,
            time_s: k as f64,
            at: Some(ideal(place)),
            size: None,
        });
        let track = pursuit_measuring::Track { target: 1, sightings: still.collect() };
        let measured = pursuit_measuring::measure(&track, &made, &pursuit_measuring::Options::default()).unwrap();
        said += measured.moments[4].state.as_ref().unwrap().deviation(1).powi(2) / seeds as f64;
    }
    assert!((square / said).sqrt() > 0.85 && (square / said).sqrt() < 1.15, "{square} {said}");
}

#[test]
fn a_swapped_or_misplaced_point_is_told() {
    let good = floor(0.0, &mut Normal::new(1), false);
    let misplaced = good.replace("0.5, 5.0]", "0.5, 5.6]");
    assert_ne!(misplaced, good);
    let warned = ruler(&misplaced);
    assert!(
        warned.facts().warnings[0].contains("do not fit") && warned.facts().warnings[0].contains("point 6 most"),
        "{:?}",
        warned.facts()
    );
    let four = "plane = { unit = 'm', points = [[0.0, 0.0, 0.0, 0.0], [100.0, 0.0, 1.0, 0.0], [100.0, 100.0, 1.0, 1.0], [0.0, 90.0, 0.0, 1.0]] }";
    assert!(ruler(four).facts().warnings[0].contains("a fifth would"));
    let swapped = four
        .replace("1.0, 1.0]", "1.0, 0.3]")
        .replace("100.0, 0.0, 1.0, 0.0", "100.0, 0.0, 0.0, 1.0")
        .replace("0.0, 90.0, 0.0, 1.0", "0.0, 90.0, 1.0, 0.0");
    let refused = Ruler::new(&Calibration::from_toml(&swapped).unwrap(), &[]);
    assert!(refused.is_err() || !refused.unwrap().facts().warnings.is_empty());
}
