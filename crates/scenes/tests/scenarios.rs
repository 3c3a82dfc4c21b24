//! That the scenes made for motion models, long absences and depth do what they say.

#![allow(clippy::panic, clippy::unwrap_used)] // a test names the scene it fails on

use pursuit_geometry::Point;
use pursuit_media::Source;
use pursuit_scenes::{Scene, SceneError, SceneSource, open};

fn made(query: &str) -> Box<dyn Scene> {
    open(query).unwrap_or_else(|e| panic!("{query}: {e}"))
}

fn centers(query: &str) -> Vec<Point> {
    let scene = made(query);
    (0..scene.frame_count()).map(|k| scene.targets(scene.frame_time_s(k))[0].extent.unwrap().center()).collect()
}

/// Displacement from frame to frame.
fn steps(centers: &[Point]) -> Vec<(f64, f64)> {
    centers.windows(2).map(|w| (w[1].x - w[0].x, w[1].y - w[0].y)).collect()
}

#[test]
fn a_line_is_straight_at_the_speed_asked_for() {
    for fps in [30.0, 5.0] {
        let steps = steps(&centers(&format!("scene:motion?motion=line&fps={fps}&speed=100&seed=4")));
        assert_eq!(steps.len() as f64, 5.0 * fps - 1.0);
        let first = steps[0];
        assert!(steps.iter().all(|s| (s.0 - first.0).hypot(s.1 - first.1) < 1e-9), "{steps:?}");
        assert!((first.0.hypot(first.1) * fps - 100.0).abs() < 1e-9 && first.0 > 0.0);
    }
}

#[test]
fn a_turn_has_its_radius_and_speed() {
    let at = centers("scene:motion?motion=turn&radius=80&speed=120&fps=25");
    let middle = Point::new(320.0, 180.0);
    assert!(at.iter().all(|p| (p.distance(middle) - 80.0).abs() < 1e-9));
    // A chord of the arc walked in a frame.
    let chord = 160.0 * (120.0 / 80.0 / 25.0 / 2.0f64).sin();
    assert!(steps(&at).iter().all(|s| (s.0.hypot(s.1) - chord).abs() < 1e-9));
}

#[test]
fn a_stop_lasts_a_second() {
    let moved: Vec<bool> =
        steps(&centers("scene:motion?motion=stop&fps=20&duration=6")).iter().map(|s| s.0.hypot(s.1) > 1e-9).collect();
    for (k, moved) in moved.iter().enumerate() {
        assert_eq!(*moved, (k / 20) % 2 == 0, "frame {k}");
    }
}

#[test]
fn the_camera_jumps_and_the_world_jumps_with_the_target() {
    let query = "scene:motion?motion=jump&jump=40&fps=30&speed=60&seed=2&noise=0";
    let steps = steps(&centers(query));
    for (k, s) in steps.iter().enumerate() {
        let length = s.0.hypot(s.1);
        if (k + 1) % 30 == 0 {
            assert!((36.0..44.1).contains(&length), "no jump after frame {k}: {length}");
        } else {
            assert!((length - 2.0).abs() < 1e-9, "frame {k}: {length}");
        }
    }
    // Away from the target the picture stands still but for the jumps.
    let scene = made(query);
    let picture = |k: u64| scene.render(scene.frame_time_s(k)).image;
    let corner = |k: u64| picture(k).view().crop(560, 280, 60, 60).unwrap().to_image();
    assert_eq!(corner(3), corner(29));
    assert_ne!(corner(29), corner(30));
    assert_eq!(corner(3), corner(65), "it is back");
}

#[test]
fn the_look_alike_stands_near_while_the_patch_is_away() {
    let with = made("scene:leave-and-return?seed=3&look-alike=1&noise=0");
    let without = made("scene:leave-and-return?seed=3&noise=0");
    let mut differ = Vec::new();
    for k in (0..with.frame_count()).step_by(5) {
        let time_s = with.frame_time_s(k);
        let (a, b) = (with.render(time_s), without.render(time_s));
        assert_eq!(a.targets, b.targets, "it is no target");
        if a.image != b.image {
            differ.push(k);
        }
    }
    assert_eq!(differ, (60..140).step_by(5).collect::<Vec<u64>>());
}

#[test]
fn depth_tells_the_target_from_what_passes_before_it() {
    let scene = made("scene:depth-occluder?seed=2&distance=2000&nearer=800&holes=0.05");
    let mut occluded = 0;
    for k in (0..scene.frame_count()).step_by(4) {
        let time_s = scene.frame_time_s(k);
        let moment = scene.render(time_s);
        let (truth, depth) = (moment.targets[0], moment.depth_mm.expect("a depth sensor"));
        let inside = truth.extent.unwrap().expanded(-8.0);
        let crop = depth.view().crop(inside.left() as usize, inside.top() as usize, 24, 24).unwrap();
        let mut known: Vec<u16> = crop.rows().flatten().copied().filter(|mm| *mm > 0).collect();
        known.sort_unstable();
        let Some(median) = known.get(known.len() / 2).map(|mm| f64::from(*mm)) else { continue };
        let target_mm = 2000.0 * (1.0 + 0.1 * (0.9 * time_s).sin());
        if truth.visible_fraction > 0.999 {
            assert!((median - target_mm).abs() < 8.0, "frame {k}: {median} is not {target_mm}");
        } else if truth.visible_fraction == 0.0 {
            assert!((median - target_mm + 800.0).abs() < 8.0, "frame {k}: {median} is not that of the bar");
            occluded += 1;
        }
    }
    assert!(occluded >= 2, "hidden in {occluded} frames");
}

#[test]
fn depth_has_holes_where_asked_and_shadows_where_it_must() {
    let unknown = |query: &str| {
        let depth = made(query).render(0.4).depth_mm.unwrap();
        depth.as_slice().iter().filter(|mm| **mm == 0).count() as f64 / depth.size().area() as f64
    };
    let shadows = unknown("scene:depth-occluder?seed=2&holes=0");
    assert!((0.005..0.08).contains(&shadows), "{shadows}");
    let holes = unknown("scene:depth-occluder?seed=2&holes=0.2") - shadows;
    assert!((0.17..0.22).contains(&holes), "{holes}");
    assert_eq!(unknown("scene:depth-occluder?seed=2&holes=1"), 1.0);
}

#[test]
fn a_source_delivers_depth_and_the_camera() {
    let mut source = SceneSource::open("scene:depth-occluder?fps=10").unwrap();
    source.next_frame().unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!(frame.depth_mm().unwrap().size(), frame.size());
    let camera = frame.camera().unwrap();
    assert_eq!((camera.time_s(), camera.pan_rad(), camera.tilt_rad()), (0.1, 0.0, 0.0));
    assert!((camera.lens().horizontal_rad(frame.size()) - 1.0).abs() < 1e-12);
    let mut source = SceneSource::open("scene:wide-world").unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert!(frame.depth_mm().is_none());
    assert_eq!(frame.camera().unwrap().tilt_rad(), -0.12);
}

#[test]
fn words_are_checked_like_numbers() {
    let error = |query: &str| match open(query) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{query} was accepted"),
    };
    let message = error("scene:motion?motion=wobble");
    assert!(message.contains("motion=wobble") && message.contains("one of line, turn, stop, jump"), "{message}");
    assert!(error("scene:motion?motion=1").contains("one of line"));
    assert!(error("scene:motion?mode=line").contains("motion (line|turn|stop|jump, default line)"));
    let by_number = |value: f64| pursuit_scenes::scene("motion", 1, &[("motion".to_owned(), value)].into());
    assert_eq!(
        by_number(1.0).unwrap().targets(0.3),
        made("scene:motion?motion=turn").targets(0.3),
        "in code a choice is its number"
    );
    assert!(matches!(by_number(1.5), Err(SceneError::BadValue { .. })));
    assert!(matches!(by_number(4.0), Err(SceneError::BadValue { .. })));
}

#[test]
fn the_guide_names_every_scene_and_every_key() {
    let guide = include_str!("../../../docs/guide/scenes.md");
    let of_drift: Vec<&str> = pursuit_scenes::find("drift").unwrap().keys.iter().map(|k| k.name).collect();
    for entry in pursuit_scenes::SCENES {
        let row = guide.lines().find(|l| l.starts_with(&format!("| `{}` |", entry.name)));
        let row = row.unwrap_or_else(|| panic!("{} is not in the guide", entry.name));
        for key in entry.keys {
            let inherited = row.contains("those of `drift`") && of_drift.contains(&key.name);
            assert!(inherited || row.contains(&format!("`{}`", key.name)), "{} lacks {}", entry.name, key.name);
        }
    }
}
