//! Which pixels are the target's: exactness on pictures whose shapes are known, honesty, and saved states.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Mask, Point, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_inference::InferenceError;
use pursuit_inference::onnx::OnnxOptions;
use pursuit_inference::segmentation::SegmentationNetwork;
use pursuit_scenes::open;
use pursuit_trackers::masks::{AnySegmenter, MaskGroup};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, Recipe, Segmenter, SegmenterRecipe, Table, TrackState, Tracker};

const SIZE: Size = Size::new(320, 240);

/// A number without a pattern for each pixel and frame, from −1 to 1.
fn noise(x: usize, y: usize, k: u64) -> f64 {
    let h = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ k.wrapping_mul(0x1656_67b1);
    let h = (h ^ h >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (h >> 40) as f64 / f64::from(1 << 23) - 1.0
}

/// A target of two colours, an ellipse that turns with a notch cut out, before blotches of other colours.
struct World {
    still: bool,
}

impl World {
    fn center(&self, k: u64) -> Point {
        Point::new(90.0 + 4.0 * k as f64, 120.0 + 30.0 * (0.2 * k as f64).sin())
    }

    fn is_target(&self, x: usize, y: usize, k: u64) -> bool {
        let (c, angle) = (self.center(k), 0.08 * k as f64);
        let (dx, dy) = (x as f64 + 0.5 - c.x, y as f64 + 0.5 - c.y);
        let (u, v) = (dx * angle.cos() + dy * angle.sin(), dy * angle.cos() - dx * angle.sin());
        (u / 38.0).hypot(v / 22.0) < 1.0 && !(u > 8.0 && v.abs() < 5.0)
    }

    fn mask(&self, k: u64) -> Mask {
        Mask::from_fn(SIZE, |x, y| self.is_target(x, y, k))
    }

    fn bbox(&self, k: u64) -> BBox {
        self.mask(k).bounds().unwrap()
    }

    fn frame(&self, k: u64) -> Frame {
        let shift = if self.still { 0 } else { k as usize };
        let image = Image::from_fn(SIZE.width, SIZE.height, |x, y| {
            let base = if self.is_target(x, y, k) {
                let c = self.center(k);
                if (y as f64) < c.y { [200.0, 60.0, 50.0] } else { [190.0, 150.0, 40.0] }
            } else {
                let blotch = noise((x + shift) / 24, y / 24, 7);
                [70.0 + 30.0 * blotch, 110.0 + 25.0 * blotch, 90.0 - 40.0 * blotch]
            };
            base.map(|v| (v + 8.0 * noise(x, y, 100 + k)).clamp(0.0, 255.0) as u8)
        });
        Frame::new(k, 0.04 * k as f64, image.unwrap())
    }
}

fn segmenter(settings: &str, frame: &Frame, bbox: BBox) -> AnySegmenter {
    use pursuit_parameters::Parameters;
    let group = MaskGroup::default().with("test", &settings.parse().unwrap()).unwrap();
    group.segmenter(frame, bbox).unwrap().unwrap()
}

fn seen(k: u64, bbox: BBox) -> Estimate {
    Estimate::started(0.04 * k as f64, bbox, 1.0)
}

/// Boxes that are off as a tracker's are: up to a twelfth of their sides.
fn rough(b: BBox, k: u64) -> BBox {
    let off = |n: u64, side: f64| side / 12.0 * noise(n as usize, k as usize, 5);
    BBox::from_ltwh(
        b.left() + off(1, b.width()),
        b.top() + off(2, b.height()),
        b.width() + off(3, b.width()),
        b.height() + off(4, b.height()),
    )
}

#[test]
fn colours_give_the_shape_of_a_coloured_target() {
    let world = World { still: false };
    let mut segmenter = segmenter("mask.model = 'colors'", &world.frame(0), world.bbox(0));
    let overlaps: Vec<f64> = (1..30)
        .map(|k| {
            let mask = segmenter.segment(&world.frame(k), &seen(k, rough(world.bbox(k), k))).unwrap().unwrap();
            mask.iou(&world.mask(k))
        })
        .collect();
    let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    assert!(mean > 0.9 && overlaps.iter().all(|j| *j > 0.8), "{mean}: {overlaps:.2?}");
    // A box says much less of it.
    let boxes = Mask::from_bbox(&world.bbox(9), SIZE).iou(&world.mask(9));
    assert!(boxes < 0.7, "{boxes}");
}

#[test]
fn the_ball_of_a_scene_is_its_disk() {
    let scene = open("scene:table-tennis?seed=7").unwrap();
    let disk = |b: BBox, size: Size| {
        let c = b.center();
        Mask::from_fn(size, |x, y| {
            ((x as f64 + 0.5 - c.x) / (0.5 * b.width())).hypot((y as f64 + 0.5 - c.y) / (0.5 * b.height())) < 1.0
        })
    };
    let mut segmenter_of: Option<AnySegmenter> = None;
    let mut overlaps = Vec::new();
    for k in 0..40 {
        let time_s = scene.frame_time_s(k);
        let moment = scene.render(time_s);
        let truth = moment.targets[0];
        let frame = moment.into_frame(k, time_s, &scene.home());
        let Some(bbox) = truth.extent.filter(|_| truth.visible_fraction > 0.98) else { continue };
        match &mut segmenter_of {
            None => segmenter_of = Some(segmenter("mask.model = 'colors'", &frame, bbox)),
            Some(segmenter) => {
                let mask = segmenter.segment(&frame, &seen(k, bbox)).unwrap();
                overlaps.push(mask.map_or(0.0, |mask| mask.iou(&disk(bbox, frame.size()))));
            }
        }
    }
    let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    assert!(overlaps.len() > 10 && mean > 0.75, "{mean}: {overlaps:.2?}");
}

#[test]
fn the_background_gives_the_shape_once_it_is_known() {
    let world = World { still: true };
    let mut segmenter = segmenter("mask.model = 'motion'", &world.frame(0), world.bbox(0));
    let mut overlaps = Vec::new();
    for k in 1..30 {
        let mask = segmenter.segment(&world.frame(k), &seen(k, rough(world.bbox(k), k))).unwrap();
        // What the target covered at first is not known, and nothing is claimed of it.
        assert!(k > 3 || mask.is_none(), "frame {k}");
        overlaps.extend(mask.filter(|_| k > 24).map(|mask| mask.iou(&world.mask(k))));
    }
    let mean = overlaps.iter().sum::<f64>() / overlaps.len().max(1) as f64;
    assert!(overlaps.len() == 5 && mean > 0.9, "{mean}: {overlaps:.2?}");
}

#[test]
fn a_detectors_background_counts() {
    let world = World { still: true };
    let mut segmenter = segmenter("mask.model = 'motion'", &world.frame(0), world.bbox(0));
    let out = Image::from_fn(SIZE.width, SIZE.height, |x, y| if world.is_target(x, y, 1) { 255 } else { 0 }).unwrap();
    let frame = world.frame(1).with_foreground(std::sync::Arc::new(out)).unwrap();
    let mask = segmenter.segment(&frame, &seen(1, world.bbox(1))).unwrap().unwrap();
    assert!(mask.iou(&world.mask(1)) > 0.99);
}

#[test]
fn what_is_not_seen_has_no_mask() {
    let world = World { still: true };
    for model in ["colors", "motion"] {
        let mut segmenter = segmenter(&format!("mask.model = '{model}'"), &world.frame(0), world.bbox(0));
        for state in [TrackState::Occluded, TrackState::Lost] {
            let estimate = Estimate { state, ..seen(1, world.bbox(1)) };
            assert_eq!(segmenter.segment(&world.frame(1), &estimate).unwrap(), None, "{model} {state}");
        }
        for nowhere in [BBox::from_ltwh(-500.0, 0.0, 20.0, 20.0), BBox::from_ltwh(f64::NAN, 0.0, 20.0, 20.0)] {
            assert_eq!(segmenter.segment(&world.frame(1), &seen(1, nowhere)).unwrap(), None, "{model}");
        }
    }
}

#[test]
fn boxes_and_frames_of_any_size_do_no_harm() {
    for (width, height) in [(1, 1), (3, 200), (64, 48)] {
        let image = |k: usize| Image::from_fn(width, height, |x, y| ((x * 7 + y * 13 + k) % 256) as u8).unwrap();
        for bbox in [BBox::from_ltwh(0.0, 0.0, 0.5, 0.5), BBox::from_ltwh(-1e6, -1e6, 2e6, 2e6)] {
            for model in ["colors", "motion"] {
                let frame = Frame::new(0, 0.0, image(0));
                let mut segmenter = segmenter(&format!("mask.model = '{model}'"), &frame, bbox);
                let mask = segmenter.segment(&Frame::new(1, 0.04, image(1)), &seen(1, bbox)).unwrap();
                assert!(mask.is_none_or(|m| m.clipped_to(Size::new(width, height)) == m));
            }
        }
    }
}

/// Real targets, of which boxes are known and masks are not: a good mask reaches as far as the true box, whatever the box given. Seen with
/// the true boxes, shaken; the figures are printed.
#[test]
fn masks_reach_as_far_as_real_targets() {
    let folder = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/sot2");
    let names = ["frog", "girl", "soldier", "monkeydog", "bird_of_paradise", "bmx"].map(|n| format!("SegTrack2_{n}"));
    let (mut all, mut clips) = (0.0, 0.0);
    for name in names.iter().map(String::as_str).chain(["OTB_Coke", "OTB_Tiger1", "OTB_Bolt"]) {
        let clip = folder.join(format!("{name}.mp4"));
        if !clip.is_file() {
            println!("skipped: {} is not there", clip.display());
            continue;
        }
        let text = std::fs::read_to_string(clip.with_extension("csv")).unwrap();
        let row = |line: &str| {
            let v: Vec<f64> = line.split(',').skip(1).map(|v| v.parse().unwrap_or(f64::NAN)).collect();
            Some(BBox::from_ltwh(v[0], v[1], v[2], v[3])).filter(BBox::is_finite)
        };
        let mut source = pursuit_media::open(clip.to_str().unwrap(), &pursuit_media::OpenOptions::default()).unwrap();
        let mut segmenter_of: Option<AnySegmenter> = None;
        let (mut frames, mut masks, mut overlap, mut given) = (0, 0, 0.0, 0.0);
        for truth in text.lines().skip(1).take(31).map(row) {
            let (Some(frame), Some(truth)) = (source.next_frame().unwrap(), truth) else { continue };
            let Some(segmenter_of) = &mut segmenter_of else {
                segmenter_of = Some(segmenter("mask.model = 'colors'", &frame, truth));
                continue;
            };
            let shaken = rough(truth, frame.index());
            let mask = segmenter_of.segment(&frame, &seen(frame.index(), shaken)).unwrap();
            (frames, given) = (frames + 1, given + shaken.iou(&truth));
            masks += usize::from(mask.is_some());
            overlap += mask.and_then(|m| m.bounds()).map_or(0.0, |bounds| bounds.iou(&truth));
        }
        let mean = overlap / f64::from(frames);
        println!(
            "{name}: {masks} masks in {frames} frames, bounds {mean:.3}, boxes given {:.3}",
            given / f64::from(frames)
        );
        (all, clips) = (all + mean, clips + 1.0);
    }
    assert!(clips == 0.0 || all / clips > 0.72, "{}", all / clips);
}

fn recipe(settings: &str) -> Box<dyn Recipe> {
    registry::tracker("staple").unwrap().recipe(&settings.parse::<Table>().unwrap()).unwrap()
}

fn run(tracker: &mut dyn Tracker, world: &World, frames: std::ops::Range<u64>) -> Vec<Estimate> {
    frames.map(|k| tracker.update(&world.frame(k)).unwrap()).collect()
}

#[test]
fn trackers_say_masks_where_these_are_asked_for() {
    let world = World { still: true };
    let start = |settings: &str| recipe(settings).init(&world.frame(0), world.bbox(0)).unwrap();
    let plain = run(&mut *start(""), &world, 1..10);
    let masked = run(&mut *start("mask.model = 'colors'"), &world, 1..10);
    assert!(plain.iter().all(|e| e.mask.is_none()));
    let without: Vec<Estimate> = masked.iter().map(|e| Estimate { mask: None, ..e.clone() }).collect();
    assert_eq!(without, plain, "masks change nothing of what is followed");
    let last = masked.last().unwrap();
    assert!(last.mask.as_ref().unwrap().iou(&world.mask(9)) > 0.7, "{last:?}");
}

#[test]
fn saved_trackers_go_on_with_their_masks() {
    let world = World { still: true };
    for settings in ["mask.model = 'colors'\nmask.colors.parts = 3", "mask.model = 'motion'"] {
        let mut tracker = recipe(settings).init(&world.frame(0), world.bbox(0)).unwrap();
        run(&mut *tracker, &world, 1..5);
        let bytes = tracker.save().unwrap();
        // Runs are resumed by the recipe with its defaults.
        let mut restored = recipe("").restore(&bytes).unwrap();
        let mut cloned = tracker.boxed_clone();
        let said = run(&mut *tracker, &world, 5..9);
        assert_eq!(run(&mut *restored, &world, 5..9), said, "{settings}");
        assert_eq!(run(&mut *cloned, &world, 5..9), said, "{settings}");
        assert_eq!(restored.save().unwrap(), tracker.save().unwrap(), "{settings}");
        for tracker in [&mut tracker, &mut restored] {
            tracker.reinit(&world.frame(9), world.bbox(9)).unwrap();
        }
        assert_eq!(restored.save().unwrap(), tracker.save().unwrap(), "{settings}");
        for length in (0..bytes.len()).step_by((bytes.len() / 40).max(1)) {
            assert!(recipe(settings).restore(&bytes[..length]).is_err(), "cut to {length}");
        }
        let step = (bytes.len() / 200).max(1);
        for at in (0..bytes.len()).step_by(step).chain(bytes.len().saturating_sub(400)..bytes.len()) {
            let mut flipped = bytes.clone();
            flipped[at] ^= 0x40;
            if let Ok(mut tracker) = recipe(settings).restore(&flipped) {
                drop(tracker.update(&world.frame(5)));
            }
        }
    }
}

#[test]
fn parameters_of_masks_are_a_group_like_others() {
    let table = recipe("mask.model = 'colors'\nmask.colors.parts = 3").parameters().unwrap();
    assert_eq!(
        (table["mask"]["model"].as_str(), table["mask"]["colors"]["parts"].as_integer()),
        (Some("colors"), Some(3))
    );
    assert_eq!(recipe("").parameters().unwrap()["mask"]["model"].as_str(), Some("none"));
    let refused = |settings: &str| {
        let table = settings.parse::<Table>().unwrap();
        registry::tracker("kcf").unwrap().recipe(&table).err().unwrap().to_string()
    };
    assert!(refused("mask.colors.parts = 3").contains("belongs to `mask.model = \"colors\"`"));
    assert!(refused("mask.model = 'magic'").contains("mask.model"));
    let world = World { still: true };
    let mut tracker = recipe("mask.model = 'colors'").init(&world.frame(0), world.bbox(0)).unwrap();
    let error = tracker.change(&"mask.model = 'none'".parse().unwrap()).unwrap_err().to_string();
    assert!(error.contains("cannot be changed while running"), "{error}");
    tracker.reinit(&world.frame(5), world.bbox(5)).unwrap();
    let said = tracker.update(&world.frame(6)).unwrap();
    assert!(said.mask.unwrap().iou(&world.mask(6)) > 0.7);
}

/// A network that draws what is red, in a file; and the settings that name it. `None` where this build has no library that runs one.
fn red_network(folder: &std::path::Path) -> Option<String> {
    let weights: Vec<f32> = (0..3 * 4).map(|k| [1.0, -0.5, -0.5][k / 4] / 4.0).collect();
    let network = pursuit_testkit::NetworkFile::default()
        .input("input", &[1, 3, 96, 96])
        .floats("weights", &[1, 3, 2, 2], &weights)
        .floats("enough", &[], &[0.3])
        .cells("input", "weights", "red", 2)
        .node("Sub", &["red", "enough"], "logits", &[])
        .output("logits", 4);
    let file = folder.join("red.onnx");
    std::fs::write(&file, network.to_bytes()).unwrap();
    match SegmentationNetwork::open(&file, &OnnxOptions::default()) {
        Err(InferenceError::NoBackend { .. }) => {
            println!("skipped: masks by a network, for want of a library that runs one");
            return None;
        }
        opened => drop(opened.unwrap()),
    }
    Some(format!("mask.model = 'network'\nmask.network.model = '{}'", file.display()))
}

#[test]
fn a_network_gives_the_shape_that_it_draws() {
    let folder = tempfile::tempdir().unwrap();
    let Some(settings) = red_network(folder.path()) else { return };
    let world = World { still: false };
    let mut segmenter = segmenter(&settings, &world.frame(0), world.bbox(0));
    for k in 1..8 {
        let mask = segmenter.segment(&world.frame(k), &seen(k, rough(world.bbox(k), k))).unwrap().unwrap();
        assert!(mask.iou(&world.mask(k)) > 0.88, "frame {k}: {}", mask.iou(&world.mask(k)));
    }
    for state in [TrackState::Occluded, TrackState::Lost] {
        let estimate = Estimate { state, ..seen(1, world.bbox(1)) };
        assert_eq!(segmenter.segment(&world.frame(1), &estimate).unwrap(), None, "{state}");
    }
    // Where it draws nothing there is no mask, and none beyond the picture.
    let elsewhere = BBox::from_ltwh(240.0, 10.0, 40.0, 40.0);
    for bbox in [elsewhere, BBox::from_ltwh(-500.0, 0.0, 20.0, 20.0), BBox::from_ltwh(f64::NAN, 0.0, 20.0, 20.0)] {
        assert_eq!(segmenter.segment(&world.frame(1), &seen(1, bbox)).unwrap(), None);
    }
}

#[test]
fn a_saved_tracker_opens_its_network_again() {
    let folder = tempfile::tempdir().unwrap();
    let Some(settings) = red_network(folder.path()) else { return };
    let world = World { still: true };
    let mut tracker = recipe(&settings).init(&world.frame(0), world.bbox(0)).unwrap();
    run(&mut *tracker, &world, 1..4);
    let bytes = tracker.save().unwrap();
    let mut restored = recipe("").restore(&bytes).unwrap();
    let said = run(&mut *tracker, &world, 4..7);
    assert!(said.iter().all(|e| e.mask.is_some()));
    assert_eq!(run(&mut *restored, &world, 4..7), said);
    tracker.reinit(&world.frame(9), world.bbox(9)).unwrap();
    let after = tracker.update(&world.frame(10)).unwrap();
    assert!(after.mask.unwrap().iou(&world.mask(10)) > 0.7);
    std::fs::remove_file(folder.path().join("red.onnx")).unwrap();
    // The format of saved states has no room for the reason.
    let error = recipe("").restore(&bytes).err().unwrap().to_string();
    assert!(error.contains("saved state of tracker `staple+mask`"), "{error}");
}

#[test]
fn a_network_for_masks_needs_a_file() {
    let world = World { still: true };
    let refused = |settings: &str| recipe(settings).init(&world.frame(0), world.bbox(0)).err().unwrap().to_string();
    let unnamed = refused("mask.model = 'network'");
    assert!(unnamed.contains("`network.model` of `mask`") && unnamed.contains("names no network"), "{unnamed}");
    let missing = refused("mask.model = 'network'\nmask.network.model = 'nowhere.onnx'");
    assert!(missing.contains("nowhere.onnx"), "{missing}");
    let table = "mask.network.model = 'a.onnx'".parse::<Table>().unwrap();
    let other = registry::tracker("kcf").unwrap().recipe(&table).err().unwrap().to_string();
    assert!(other.contains("belongs to `mask.model = \"network\"`"), "{other}");
}
