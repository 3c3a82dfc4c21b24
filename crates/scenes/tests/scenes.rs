//! What every scene promises: the same world for the same seed, truth that the pixels bear out, clear errors.

#![allow(clippy::panic)] // a test names the scene it fails on

use pursuit_geometry::{BBox, Truth};
use pursuit_imaging::{Image, Rgb8};
use pursuit_media::Source;
use pursuit_scenes::{SCENES, Scene, SceneError, SceneQuery, SceneSource, open};

fn made(query: &str) -> Box<dyn Scene> {
    open(query).unwrap_or_else(|e| panic!("{query}: {e}"))
}

/// The scene with this seed; large ones smaller, so that the tests are quick.
fn query(name: &str, seed: u64) -> String {
    let smaller = match name {
        "crowd" => "&width=480&height=270&targets=6",
        "person" | "people" | "wide-world" => "&width=160&height=120",
        _ => "",
    };
    format!("scene:{name}?seed={seed}{smaller}")
}

/// The box around all pixels that `is_target` accepts, by whole pixels.
fn segmented(image: &Image<Rgb8>, is_target: impl Fn(Rgb8) -> bool) -> Option<BBox> {
    let mut found: Option<BBox> = None;
    for (y, row) in image.view().rows().enumerate() {
        for (x, _) in row.iter().enumerate().filter(|(_, p)| is_target(**p)) {
            let pixel = BBox::from_ltwh(x as f64, y as f64, 1.0, 1.0);
            found = Some(found.map_or(pixel, |f| f.union(&pixel)));
        }
    }
    found
}

/// The greatest difference between the edges of two boxes.
fn edge_error(a: &BBox, b: &BBox) -> f64 {
    let edges = |b: &BBox| [b.left(), b.top(), b.right(), b.bottom()];
    edges(a).iter().zip(edges(b)).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max)
}

#[test]
fn every_scene_is_a_pure_function_of_seed_and_time() {
    for entry in SCENES {
        let (first, second) = (made(&query(entry.name, 3)), made(&query(entry.name, 3)));
        let times = [0.0, first.frame_time_s(7), 1.2345];
        let forward = times.map(|t| first.render(t));
        let mut backward = [times[2], times[1], times[0]].map(|t| second.render(t));
        backward.reverse();
        assert_eq!(forward, backward, "{}", entry.name);
        let other = made(&query(entry.name, 4)).render(0.0);
        assert_ne!(forward[0].image, other.image, "{}: the seed changes nothing", entry.name);
        assert_ne!(forward[0].image, forward[1].image, "{}: not even noise changes", entry.name);
    }
}

#[test]
fn every_scene_begins_with_a_visible_target_and_stays_sane() {
    for (entry, seed) in SCENES.iter().flat_map(|e| [(e, 1), (e, 2), (e, 77)]) {
        let scene = made(&query(entry.name, seed));
        let bounds = scene.size().bounds();
        assert!(scene.frame_count() >= 30 && scene.frame_count() <= 400, "{}", entry.name);
        for k in (0..scene.frame_count()).step_by(11) {
            let moment = scene.render(scene.frame_time_s(k));
            assert_eq!(moment.image.size(), scene.size());
            assert_eq!(moment.targets, scene.targets(scene.frame_time_s(k)));
            let truth = moment.targets[0];
            assert!((0.0..=1.0).contains(&truth.visible_fraction));
            // Into the room of `person` somebody comes later.
            if k == 0 && entry.name != "person" {
                assert!(truth.visible_fraction > 0.97, "{} seed {seed}: {truth:?}", entry.name);
            }
            if let Some(seen) = truth.visible() {
                assert!(seen.is_finite() && seen.fraction_inside(&bounds) > 0.05, "{} {k}: {seen}", entry.name);
            }
        }
    }
}

#[test]
fn truth_of_patches_is_where_their_pixels_are() {
    let magenta = |[r, g, b]: Rgb8| r > g.saturating_add(100) && b > g.saturating_add(100) && r.abs_diff(b) < 12;
    for entry in SCENES.iter().filter(|e| e.schema().iter().any(|p| p.name == "plain")) {
        let more = match entry.name {
            "lighting-step" => "&gain=0.9",
            "crowd" => "&targets=1&width=320&height=240",
            _ => "",
        };
        let scene = made(&format!("scene:{}?seed=5&plain=1&noise=0{more}", entry.name));
        let mut compared = 0;
        for k in (0..scene.frame_count()).step_by(3) {
            let moment = scene.render(scene.frame_time_s(k));
            let truth = moment.targets[0];
            let found = segmented(&moment.image, magenta);
            match truth.extent.filter(|_| truth.visible_fraction > 0.0) {
                Some(extent) if truth.visible_fraction > 0.999 => {
                    let found = found.unwrap_or_else(|| panic!("{} frame {k}: nothing at {extent}", entry.name));
                    // Border pixels count from about half coverage on.
                    assert!(edge_error(&found, &extent) < 0.8, "{} frame {k}: {found} is not {extent}", entry.name);
                    compared += 1;
                }
                Some(extent) => assert!(found.is_none_or(|f| f.fraction_inside(&extent.expanded(1.0)) > 0.999)),
                None => assert!(found.is_none(), "{} frame {k}: {found:?} although absent", entry.name),
            }
        }
        assert!(compared > 10, "{}: only {compared} frames compared", entry.name);
    }
}

fn is_yellow([r, g, b]: Rgb8) -> bool {
    let (r, g, b) = (f64::from(r), f64::from(g), f64::from(b));
    b < 0.55 * g && g > 0.75 * r && r > 0.9 * g && g > 60.0
}

#[test]
fn truth_of_the_ball_is_where_its_pixels_are() {
    let scene = made("scene:table-tennis?seed=2&noise=0&exposure=0&distractors=0&hand=0");
    let (mut compared, mut absent) = (0, 0);
    for k in (0..scene.frame_count()).step_by(4) {
        let moment = scene.render(scene.frame_time_s(k));
        let truth = moment.targets[0];
        let found = segmented(&moment.image, is_yellow);
        if truth.visible_fraction > 0.99 {
            let (found, extent) = (found.expect("the ball is there"), truth.extent.expect("in the world"));
            assert!(edge_error(&found, &extent) < 1.6, "frame {k}: {found} is not {extent}");
            assert!((24.0..41.0).contains(&extent.width()), "frame {k}: {extent}");
            compared += 1;
        } else if truth.visible_fraction == 0.0 {
            assert_eq!(found, None, "frame {k}");
            absent += 1;
        }
    }
    assert!(compared > 50 && absent >= 3, "{compared} {absent}");
}

#[test]
fn motion_blur_is_centred_on_the_truth_and_conserves_the_ball() {
    let blurred = made("scene:table-tennis?seed=1&noise=0&exposure=1&distractors=0&hand=0");
    // In free fall, at some 700 px/s: a streak of 23 px with faint ends. Against the table without the ball (and without its shadow, which
    // only darkens), whatever is redder is ball.
    let moment = blurred.render(blurred.frame_time_s(8));
    let empty = blurred.render(7.7).image;
    assert_eq!(blurred.render(7.7).targets[0].visible_fraction, 0.0);
    let gain = f64::from(moment.image.row(470)[600][1]) / f64::from(empty.row(470)[600][1]);
    let mut redder = empty.clone();
    for (difference, now) in redder.as_mut_slice().iter_mut().zip(moment.image.as_slice()) {
        *difference = [(f64::from(now[0]) - gain * f64::from(difference[0]) > 20.0).into(); 3];
    }
    let extent = moment.targets[0].extent.expect("in the world");
    let found = segmented(&redder, |p| p[0] == 1).expect("seen");
    assert!(found.height() > extent.height() + 11.0, "{found} is hardly longer than {extent}");
    assert!(found.center().distance(extent.center()) < 2.0, "{found} about {extent}");
    assert!(moment.targets[0].visible_fraction > 0.97);
}

#[test]
fn the_hand_hides_the_ball_for_about_four_tenths_of_a_second() {
    for seed in 1..6 {
        let scene = made(&format!("scene:table-tennis?seed={seed}"));
        let fraction = |k: u64| scene.targets(scene.frame_time_s(k))[0].visible_fraction;
        let hidden: Vec<u64> = (140..205).filter(|&k| fraction(k) < 0.01).collect();
        assert!((9..=18).contains(&hidden.len()), "seed {seed}: hidden in {hidden:?}");
        assert_eq!(hidden.len() as u64, hidden[hidden.len() - 1] - hidden[0] + 1, "seed {seed}: in one stretch");
    }
}

#[test]
fn the_bar_hides_the_patch_and_lets_it_reappear() {
    let scene = made("scene:occluding-bar?seed=1");
    let fractions: Vec<f64> =
        (0..scene.frame_count()).map(|k| scene.targets(scene.frame_time_s(k))[0].visible_fraction).collect();
    let hidden = fractions.iter().filter(|f| **f == 0.0).count();
    assert!((10..60).contains(&hidden), "hidden in {hidden} frames");
    assert!(fractions.iter().rev().take(5).all(|f| *f > 0.9) || fractions[fractions.len() / 2] > 0.9);
}

#[test]
fn the_patch_that_leaves_is_gone_for_80_frames_and_returns_280_pixels_away() {
    let scene = made("scene:leave-and-return");
    let truth: Vec<_> = (0..scene.frame_count()).map(|k| scene.targets(scene.frame_time_s(k))[0].visible()).collect();
    let gone: Vec<usize> = (0..truth.len()).filter(|&k| truth[k].is_none()).collect();
    assert_eq!((gone.len(), gone[79] - gone[0]), (80, 79));
    let (last, first) = (truth[gone[0] - 1].expect("seen"), truth[gone[79] + 1].expect("seen again"));
    assert!(
        (first.center().x - last.center().x - 280.0).abs() < 1e-6 && (first.center().y - last.center().y).abs() < 1e-6
    );
}

#[test]
fn a_crowd_stays_apart_and_in_the_picture() {
    for (query, count) in [("scene:crowd", 20), ("scene:crowd?seed=4&targets=7&width=640&height=360", 7)] {
        let scene = made(query);
        for k in (0..scene.frame_count()).step_by(13) {
            let targets = scene.targets(scene.frame_time_s(k));
            assert_eq!(targets.len(), count);
            assert!(targets.iter().all(|t| t.visible_fraction > 0.99 && t.extent.is_some()), "{targets:?}");
        }
        let boxes: Vec<BBox> = scene.targets(0.5).iter().filter_map(pursuit_scenes::TargetTruth::visible).collect();
        assert!(boxes.iter().all(|b| b.width() > 20.0 && b.height() > 20.0), "{boxes:?}");
    }
}

#[test]
fn a_scene_is_an_input_like_any_other() {
    let mut source = SceneSource::open("scene:leave-and-return").expect("a scene").between(58, 62);
    assert_eq!(source.info().frame_count, Some(4));
    assert!(matches!(source.info().truth_at(59), Truth::Visible(_)));
    assert_eq!(source.info().truth_at(60), Truth::Absent);
    let frames: Vec<_> = std::iter::from_fn(|| source.next_frame().expect("scenes do not break")).collect();
    assert_eq!(frames.iter().map(|f| f.index()).collect::<Vec<_>>(), [58, 59, 60, 61]);
    assert!((frames[1].time_s() - 59.0 / 30.0).abs() < 1e-12);
}

#[test]
fn bad_queries_say_what_there_is() {
    let message = |query: &str| match open(query) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{query} was accepted"),
    };
    assert!(message("scene:tennis").contains("table-tennis, drift, scale-ramp"));
    let sped = message("scene:drift?sped=4");
    assert!(sped.contains("`sped` of `drift`") && sped.contains("width, height, fps"), "{sped}");
    assert!(message("scene:drift?size=900").contains("`size` of `drift`: must be between 4 and 512, not 900"));
    assert!(message("scene:drift?size=NaN").contains("must be between 4 and 512, not NaN"));
    assert!(message("scene:drift?size=big").contains("invalid type: string, expected a number"));
    assert!(message("scene:drift?plain=2").contains("expected true or false"));
    assert!(message("scene:drift?width=320.5").contains("expected a whole number"));
    assert!(message("scene:static?speed=3").contains("`speed` of `static`: there is no such parameter"));
    assert!(message("scene:drift?seed=-1").contains("seed `-1`"));
    assert!(message("scene:drift?size").contains("lacks a value"));
    assert!(message("scene:drift?size=20&size=30").contains("twice"));
    assert!(message("drift").contains("scene:NAME"));
    assert!(matches!(open("scene:"), Err(SceneError::UnknownScene { .. })));
    let query: SceneQuery = "scene:drift?seed=9&size=24".parse().expect("a good query");
    assert_eq!((query.name.as_str(), query.seed, query.params["size"].as_float()), ("drift", 9, Some(24.0)));
}

#[test]
fn scenes_can_be_entered_anywhere() {
    let mut source = SceneSource::open("scene:drift?seed=7").unwrap();
    let frames: Vec<_> = (0..6).map(|_| source.next_frame().unwrap().unwrap()).collect();
    assert!(source.info().seekable);
    for index in [4, 0, 5] {
        source.seek(index).unwrap();
        let frame = source.next_frame().unwrap().unwrap();
        assert_eq!((frame.index(), frame.time_s()), (index, frames[index as usize].time_s()));
        assert_eq!(frame.gray().to_image(), frames[index as usize].gray().to_image());
    }
    let count = source.info().frame_count.unwrap();
    source.seek(count - 1).unwrap();
    assert!(source.seek(count).is_err());
    assert_eq!(source.next_frame().unwrap().unwrap().index(), count - 1);
    assert!(source.next_frame().unwrap().is_none());
    let mut part = SceneSource::open("scene:drift?seed=7").unwrap().between(3, 5);
    assert!(part.seek(2).is_err() && part.seek(5).is_err());
    part.seek(3).unwrap();
    assert_eq!(part.next_frame().unwrap().unwrap().index(), 3);
}
