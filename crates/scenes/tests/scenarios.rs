//! That the scenes made for motion models, long absences and depth do what they say.

#![allow(clippy::panic, clippy::unwrap_used)] // a test names the scene it fails on

use pursuit_geometry::Point;
use pursuit_media::Source;
use pursuit_parameters::Value;
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
fn what_is_thrown_falls_by_gravity() {
    let fps = 100.0;
    let at = centers("scene:motion?motion=throw&fps=100&duration=0.5&gravity=1500&speed=200");
    for w in at.windows(3) {
        let change = |a: f64, b: f64, c: f64| (a - 2.0 * b + c) * fps * fps;
        assert!((change(w[0].y, w[1].y, w[2].y) - 1500.0).abs() < 1e-4 && change(w[0].x, w[1].x, w[2].x).abs() < 1e-4);
    }
}

#[test]
fn a_pendulum_has_its_length_and_period() {
    let at = centers("scene:motion?motion=swing&radius=200&gravity=981&fps=100&duration=3");
    let above = Point::new(320.0, 180.0 - 200.0);
    assert!(at.iter().all(|p| (p.distance(above) - 200.0).abs() < 1e-9));
    // At a quarter of the period it passes the middle.
    let quarter = std::f64::consts::TAU * (200.0_f64 / 981.0).sqrt() / 4.0 * 100.0;
    let (before, after) = (at[quarter as usize].x, at[quarter as usize + 1].x);
    assert!(before > 320.0 && after < 320.0, "{before} {after}");
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
    assert!(message.contains("`wobble`") && message.contains("one of line, turn, stop, jump"), "{message}");
    assert!(error("scene:motion?motion=1").contains("one of line"));
    let in_code =
        |value: Value| pursuit_scenes::scene("motion", 1, &[("motion".to_owned(), value)].into_iter().collect());
    assert_eq!(in_code("turn".into()).unwrap().targets(0.3), made("scene:motion?motion=turn").targets(0.3));
    assert!(matches!(in_code(Value::Integer(1)), Err(SceneError::Parameter(_))));
    assert!(matches!(in_code("wobble".into()), Err(SceneError::Parameter(_))));
}

#[test]
fn the_guide_names_every_scene_and_every_key() {
    let guide = include_str!("../../../docs/guide/scenes.md");
    let of_drift: Vec<&str> = pursuit_scenes::find("drift").unwrap().schema().iter().map(|p| p.name).collect();
    for entry in pursuit_scenes::SCENES {
        let row = guide.lines().find(|l| l.starts_with(&format!("| `{}` |", entry.name)));
        let row = row.unwrap_or_else(|| panic!("{} is not in the guide", entry.name));
        for key in entry.schema() {
            let inherited = row.contains("those of `drift`") && of_drift.contains(&key.name);
            assert!(inherited || row.contains(&format!("`{}`", key.name)), "{} lacks {}", entry.name, key.name);
        }
    }
}

#[test]
fn a_senseless_view_is_a_small_picture_and_no_panic() {
    use pursuit_geometry::Size;
    for query in ["scene:rgbd-occlusion?duration=1", "scene:person?duration=1", "scene:table-tennis"] {
        let scene = made(query);
        for size in [Size::new(0, 0), Size::new(0, 7), Size::new(5, 0)] {
            let moment = scene.render_view(0.1, &pursuit_scenes::View { size, ..scene.home() });
            let want = Size::new(size.width.max(1), size.height.max(1));
            assert_eq!(moment.image.size(), want, "{query}");
            assert!(moment.depth_mm.is_none_or(|d| d.size() == want), "{query}");
        }
    }
}

/// The clip of depth-aware tracking: sizes at true depths, covered as far and as long as asked.
#[test]
fn an_occlusion_is_as_long_and_as_full_as_asked() {
    for (seed, keys, frames) in [(1, "hidden=20", 20), (2, "hidden=12&pan=30&approach=100", 12), (3, "hidden=0", 0)] {
        let scene = made(&format!("scene:rgbd-occlusion?seed={seed}&{keys}"));
        let shown: Vec<f64> =
            (0..scene.frame_count()).map(|k| scene.targets(scene.frame_time_s(k))[0].visible_fraction).collect();
        let hidden = shown.iter().filter(|v| **v < 0.01).count() as i64;
        assert!((hidden - frames).abs() <= 3, "{keys}: {hidden}");
        assert!(shown[0] > 0.99 && *shown.last().unwrap() > 0.99, "{keys}: {shown:?}");
    }
    let partly = made("scene:rgbd-occlusion?seed=4&cover=0.5");
    let least = (0..partly.frame_count())
        .map(|k| partly.targets(partly.frame_time_s(k))[0].visible_fraction)
        .fold(1.0, f64::min);
    assert!((least - 0.5).abs() < 0.05, "{least}");
    let none = made("scene:rgbd-occlusion?seed=4&cover=0");
    assert!((0..none.frame_count()).all(|k| none.targets(none.frame_time_s(k))[0].visible_fraction > 0.99));
}

#[test]
fn sizes_and_depths_belong_together() {
    let scene = made("scene:rgbd-occlusion?seed=5&cover=0&approach=200&relief=0&holes=0&size=40&distance=2000");
    let at = |t: f64| {
        let moment = scene.render(t);
        let extent = moment.targets[0].extent.unwrap();
        let center = extent.center();
        let depth = moment.depth_mm.unwrap();
        let mm = depth.view().row(center.y as usize)[center.x as usize];
        (extent.width(), f64::from(mm))
    };
    let ((first, near), (later, nearer)) = (at(0.0), at(2.0));
    assert!((first - 40.0).abs() < 1e-9 && (later - 50.0).abs() < 1e-9);
    // Disparities in eighths of a pixel are 12 mm apart at that distance.
    assert!((near - 2000.0).abs() < 60.0 && (nearer - 1600.0).abs() < 40.0, "{near} {nearer}");
}

#[test]
fn the_light_changes_the_picture_alone() {
    let at = |light: &str| made(&format!("scene:rgbd-occlusion?seed=6&light={light}&noise=0")).render(0.5);
    let (steady, dark, black) = (at("steady"), at("dark"), at("black"));
    assert_eq!((&steady.depth_mm, &dark.depth_mm), (&dark.depth_mm, &black.depth_mm));
    let mean = |m: &pursuit_scenes::SceneMoment| {
        m.image.as_slice().as_flattened().iter().map(|v| f64::from(*v)).sum::<f64>()
            / (3 * m.image.size().area()) as f64
    };
    assert!((mean(&dark) / mean(&steady) - 0.1).abs() < 0.02 && mean(&black) == 0.0);
}
