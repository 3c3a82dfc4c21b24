//! Scenes that are aimed: the truth stays where the pixels are, and nobody's default picture has changed.

#![allow(clippy::panic, clippy::unwrap_used)] // a test names the scene it fails on

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Image, Rgb8};
use pursuit_scenes::{SCENES, Scene, View, open};

fn made(query: &str) -> Box<dyn Scene> {
    open(query).unwrap_or_else(|e| panic!("{query}: {e}"))
}

/// The box around all pixels of which `is_target` holds, by whole pixels.
fn segmented(size: Size, is_target: impl Fn(usize, usize) -> bool) -> Option<BBox> {
    let pixels = (0..size.height).flat_map(|y| (0..size.width).map(move |x| (x, y)));
    let boxes = pixels.filter(|&(x, y)| is_target(x, y)).map(|(x, y)| BBox::from_ltwh(x as f64, y as f64, 1.0, 1.0));
    boxes.reduce(|a, b| a.union(&b))
}

fn edge_error(a: &BBox, b: &BBox) -> f64 {
    let edges = |b: &BBox| [b.left(), b.top(), b.right(), b.bottom()];
    edges(a).iter().zip(edges(b)).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max)
}

fn difference(a: &Image<Rgb8>, b: &Image<Rgb8>, x: usize, y: usize) -> u8 {
    let (a, b) = (a.row(y)[x], b.row(y)[x]);
    (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
}

/// Fowler, Noll & Vo's hash (FNV-1a).
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// Of three pictures of each scene, taken when scenes could not be aimed yet. They depend on the platform's sine and
/// cosine, so they are compared on the one they were taken on.
#[cfg(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu"))]
const PICTURES: &[(&str, u64)] = &[
    ("table-tennis", 0x60b99013efb7fe9d),
    ("drift", 0xe6df05c633ef66a5),
    ("scale-ramp", 0x6abf7c28b3cb536a),
    ("occluding-bar", 0xc32d52dfe99cd985),
    ("lighting-step", 0x6db03ffed51dbff9),
    ("camera-pan", 0xb80ecdfc08ce714e),
    ("look-alike", 0x600313be6d95c80e),
    ("low-frame-rate", 0x5d4a2a25dea0cb8b),
    ("leave-and-return", 0xea798d7860f2fad2),
    ("crowd", 0x903b26bff50a4988),
    ("static", 0x7b7b76c9f514a8e4),
];

#[test]
#[cfg(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu"))]
fn the_default_view_shows_what_scenes_always_showed() {
    for (name, expected) in PICTURES {
        let smaller = if *name == "crowd" { "&width=480&height=270&targets=6" } else { "" };
        let scene = made(&format!("scene:{name}?seed=3{smaller}"));
        let pictures: Vec<u8> = [0.0, 1.2345, 2.5]
            .iter()
            .flat_map(|t| scene.render_view(*t, &scene.home()).image.as_slice().as_flattened().to_vec())
            .collect();
        assert_eq!(hash(&pictures), *expected, "{name}");
    }
}

#[test]
fn a_view_is_a_pure_function_and_the_home_view_is_the_default() {
    for entry in SCENES {
        let smaller = if entry.schema().iter().any(|p| p.name == "width") { "&width=200&height=150" } else { "" };
        let query = format!("scene:{}?seed=3{smaller}", entry.name);
        let (first, second) = (made(&query), made(&query));
        let aimed = first.home().aimed(0.2, -0.1).unwrap().zoomed(0.6).unwrap();
        let view = View { size: Size::new(120, 90), ..aimed };
        let moment = first.render_view(2.9, &view);
        assert_eq!(moment, second.render_view(2.9, &view), "{}", entry.name);
        assert_eq!(moment.image.size(), view.size);
        assert_eq!(moment.targets, second.targets_in_view(2.9, &view), "{}", entry.name);
        assert_eq!(first.render(2.9), first.render_view(2.9, &first.home()), "{}", entry.name);
        assert_ne!(moment.image, first.render_view(2.9, &view.aimed(0.25, -0.1).unwrap()).image, "{}", entry.name);
    }
}

#[test]
fn truth_of_flat_scenes_is_where_their_pixels_are_in_any_view() {
    let scene = made("scene:drift?seed=5&plain=1&noise=0&size=40");
    let mut compared = 0;
    for (pan, tilt, fov) in [(0.0, 0.0, 0.5), (0.15, 0.1, 1.0), (-0.2, -0.1, 0.8), (0.1, -0.05, 1.4)] {
        let view = scene.home().aimed(pan, tilt).unwrap().zoomed(fov).unwrap();
        for k in (0..scene.frame_count()).step_by(9) {
            let moment = scene.render_view(scene.frame_time_s(k), &view);
            let truth = moment.targets[0];
            let magenta = |x: usize, y: usize| {
                let [r, g, b] = moment.image.row(y)[x];
                r > 170 && b > 170 && g < 80
            };
            if truth.visible_fraction > 0.999 {
                let extent = truth.extent.unwrap();
                let found = segmented(view.size, magenta).unwrap_or_else(|| panic!("frame {k}: nothing at {extent}"));
                // Zooming in stretches the soft edge.
                assert!(
                    edge_error(&found, &extent) < 0.9 + 0.7 / fov,
                    "{pan} {tilt} {fov}, {k}: {found} is not {extent}"
                );
                compared += 1;
            } else if truth.visible_fraction == 0.0 {
                assert_eq!(segmented(view.size, magenta), None, "{pan} {tilt} {fov}, frame {k}");
            }
        }
    }
    assert!(compared > 15, "only {compared} compared");
}

/// Against the empty room, whatever differs is the person.
#[test]
fn truth_of_a_person_is_where_the_pixels_are_in_any_view() {
    let scene = made("scene:person?seed=4&noise=0&shadow=0&width=320&height=240&enters=1");
    let mut compared = 0;
    for (pan, tilt, fov) in [(0.0, 0.0, 60.0), (0.25, -0.15, 50.0), (-0.1, -0.1, 80.0)] {
        let aimed = scene.home().aimed(pan, tilt).unwrap();
        let view = aimed.zoomed(f64::to_radians(fov)).unwrap();
        let empty = scene.render_view(0.0, &view);
        assert_eq!(empty.targets[0].extent, None, "nobody is there yet");
        for time_s in [2.0, 2.7, 3.2, 4.5, 6.6, 7.3] {
            let moment = scene.render_view(time_s, &view);
            let truth = moment.targets[0];
            let found = segmented(view.size, |x, y| difference(&moment.image, &empty.image, x, y) > 12);
            if truth.visible_fraction > 0.999 {
                let (found, extent) = (found.unwrap(), truth.extent.unwrap());
                assert!(edge_error(&found, &extent) < 1.6, "{pan} {tilt} {fov}, {time_s} s: {found} is not {extent}");
                compared += 1;
            }
        }
    }
    assert!(compared >= 9, "only {compared} compared");
}

#[test]
fn a_person_comes_stands_and_goes() {
    let scene = made("scene:person?seed=2&noise=0");
    let seen: Vec<Option<Point>> = (0..scene.frame_count())
        .map(|k| scene.targets(scene.frame_time_s(k))[0].visible().map(|b| b.center()))
        .collect();
    assert!(seen[..60].iter().all(Option::is_none), "the room is empty for two seconds");
    assert!(seen.last().unwrap().is_none() && seen.iter().flatten().count() > 150);
    let still = seen.windows(2).filter(|w| matches!(w, [Some(a), Some(b)] if a.distance(*b) == 0.0)).count();
    assert!((88..=90).contains(&still), "stands for 3 s: {still}");
    let (first, last) = (seen.iter().flatten().next().unwrap(), seen.iter().flatten().last().unwrap());
    assert!(first.x < 40.0 && last.x > 440.0, "{first:?} {last:?}");
}

#[test]
fn light_door_and_shadow_change_the_background() {
    let mean = |query: &str, time_s: f64| {
        let image = made(query).render(time_s).image;
        image.as_slice().as_flattened().iter().map(|v| f64::from(*v)).sum::<f64>() / (3 * image.size().area()) as f64
    };
    let small = "scene:person?seed=2&noise=0&width=160&height=120&enters=4";
    assert!((mean(small, 0.5) - mean(small, 3.5)).abs() < 1e-9, "nothing changes by itself");
    let dimmed = format!("{small}&gain=0.6&step=2");
    assert!((mean(&dimmed, 3.0) / mean(&dimmed, 1.0) - 0.6).abs() < 0.01);
    let door = format!("{small}&door=2");
    let (shut, open) = (made(&door).render(1.9).image, made(&door).render(3.0).image);
    let changed = segmented(Size::new(160, 120), |x, y| difference(&shut, &open, x, y) > 20).unwrap();
    assert!((16.0..30.0).contains(&changed.width()) && (40.0..60.0).contains(&changed.height()), "{changed}");
    let (with, without) = (made(&format!("{small}&shadow=0.6")), made(&format!("{small}&shadow=0")));
    let (with, without) = (with.render(6.0), without.render(6.0));
    assert_eq!(with.targets, without.targets, "a shadow is no part of the target");
    let shadow = segmented(Size::new(160, 120), |x, y| difference(&with.image, &without.image, x, y) > 12).unwrap();
    assert!(shadow.bottom() > 90.0 && shadow.width() > 10.0, "{shadow}");
}

#[test]
fn people_cover_each_other() {
    let scene = made("scene:people?seed=2");
    let targets: Vec<_> = (0..scene.frame_count()).map(|k| scene.targets(scene.frame_time_s(k))).collect();
    assert!(targets.iter().all(|t| t.len() == 4));
    let least = targets.iter().map(|t| t[0].visible_fraction).fold(1.0, f64::min);
    assert!(least < 0.5, "the first is never covered: {least}");
    let nearest = (0..4).filter(|&i| targets.iter().all(|t| t[i].visible_fraction > 0.999)).count();
    assert!(nearest >= 1, "nobody covers the nearest");
    for truths in &targets {
        for (i, truth) in truths.iter().enumerate() {
            let alone = truths
                .iter()
                .enumerate()
                .all(|(j, other)| i == j || truth.extent.unwrap().iou(&other.extent.unwrap()) == 0.0);
            assert!(!alone || truth.visible_fraction == 1.0, "{truth:?} is covered by nothing");
        }
    }
}

#[test]
fn a_wide_world_is_seen_by_turning_to_it() {
    for who in ["person", "ball"] {
        let scene = made(&format!("scene:wide-world?seed=3&who={who}"));
        let fractions: Vec<f64> =
            (0..scene.frame_count()).map(|k| scene.targets(scene.frame_time_s(k))[0].visible_fraction).collect();
        assert!(
            fractions[0] > 0.99 && fractions.iter().filter(|f| **f == 0.0).count() > 100,
            "{who} leaves the picture"
        );
        for time_s in [0.0, 1.7, 3.1, 4.4, 7.7, 10.3] {
            // As a controller that knows the truth would: look about, then turn to the middle of the target, which
            // perspective lets arrive in a few steps.
            let seen = |v: &View| scene.targets_in_view(time_s, v)[0].visible_fraction > 0.5;
            let mut around = (-6..=6).map(|k| scene.home().aimed(0.2 * f64::from(k), -0.12).unwrap());
            let mut view = around.find(seen).unwrap_or_else(|| panic!("{who} is nowhere at {time_s} s"));
            for _ in 0..4 {
                let center = scene.targets_in_view(time_s, &view)[0].extent.unwrap().center();
                let direction = view.direction_of(center);
                view = view.aimed(direction.pan_rad, direction.tilt_rad).unwrap();
            }
            let truth = scene.targets_in_view(time_s, &view)[0];
            let off = truth.extent.unwrap().center().distance(Point::new(160.0, 120.0));
            assert!(off < 2.0 && truth.visible_fraction > 0.99, "{who} at {time_s} s: {truth:?} is {off} px off");
        }
    }
}

#[test]
fn turning_moves_what_stands_still_as_the_pinhole_says() {
    let scene = made("scene:wide-world?seed=3&noise=0&who=ball&reach=0&shadow=0");
    let home = scene.home();
    let there = home.direction_of(scene.targets(0.0)[0].extent.unwrap().center());
    for (pan, tilt) in [(0.3, -0.2), (-0.35, -0.3), (0.0, -0.4)] {
        let view = home.aimed(pan, tilt).unwrap();
        let expected = view.point_of(there).unwrap();
        let found = scene.targets_in_view(0.0, &view)[0].extent.unwrap().center();
        assert!(found.distance(expected) < 0.5, "{found:?} is not {expected:?}");
    }
}
