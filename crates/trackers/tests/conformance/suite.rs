//! What every tracker must do.

use crate::world::{Kind, World};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_tracking::TrackerEntry;
use pursuit_tracking::{Estimate, Recipe, TrackState, Tracker, TrackingError};

/// A check of the suite.
pub type Check = fn(&TrackerEntry);

/// The suite: each check with its name.
pub const CHECKS: &[(&str, Check)] = &[
    ("the template reads back as the defaults", template),
    ("the same frames give the same answers", deterministic),
    ("a moving target is followed", follows),
    ("a motionless scene stays put", motionless),
    ("shifting the image shifts the answer", shifts),
    ("boxes at and over the border", borders),
    ("thin and tiny boxes", thin_and_tiny),
    ("senseless boxes are clear errors", senseless_boxes),
    ("grey and 16-bit frames", gray_frames),
    ("a changed frame size is a clear error", changed_size),
    ("an absent target is not tracked", absent),
    ("starting again is starting afresh", reinit),
    ("a clone goes its own way", cloned),
    ("looking changes nothing that is saved", looking),
    ("forecasts change nothing and follow the motion", forecasts),
    ("groups can be changed while running", changes),
    ("every motion model follows", motion_models),
    ("every policy and search runs", policies_and_searches),
    ("saved and restored goes on alike", saved),
    ("corrupted snapshots are errors", corrupted),
    ("time that stands still or runs backwards does no harm", odd_times),
    ("a low frame rate does no harm", low_frame_rate),
];

fn recipe(entry: &TrackerEntry) -> Box<dyn Recipe> {
    entry.recipe(&toml::Table::new()).unwrap()
}

fn start(entry: &TrackerEntry, world: &World) -> Box<dyn Tracker> {
    recipe(entry).init(&world.frame(0), world.truth(0)).unwrap_or_else(|e| panic!("{}: {e}", entry.name))
}

fn sound(entry: &TrackerEntry, estimate: &Estimate, frame: &Frame) {
    let name = entry.name;
    let b = estimate.bbox;
    assert!(b.is_finite() && !b.is_empty(), "{name}: {estimate:?}");
    assert!((0.0..=1.0).contains(&estimate.score), "{name}: {estimate:?}");
    let Size { width, height } = frame.size();
    // A coasted box may leave the picture; it must not leave the neighbourhood.
    let near = frame.size().bounds().expanded(2.0 * (width + height) as f64);
    assert!(
        near.contains(b.center()) && b.width() <= 4.0 * width as f64 && b.height() <= 4.0 * height as f64,
        "{name}: {estimate:?}"
    );
    if estimate.state == TrackState::Tracking {
        assert!(b.clipped_to(frame.size()).is_some(), "{name}: tracked outside of the picture: {estimate:?}");
    }
    for other in [estimate.prediction, estimate.measurement].into_iter().flatten() {
        assert!(other.is_finite(), "{name}: {estimate:?}");
    }
    let declared = recipe(entry).figures();
    let names: Vec<&str> = estimate.diagnostics.iter().map(|(figure, _)| figure).collect();
    for (k, (figure, _)) in estimate.diagnostics.figures().enumerate() {
        assert!(declared.contains(&figure), "{name}: `{}` is not declared", figure.name);
        assert!(!names[..k].contains(&figure.name), "{name}: `{}` is said twice", figure.name);
    }
    if let Some(covariance) = estimate.covariance {
        assert!(covariance.iter().all(|v| v.is_finite()), "{name}: {estimate:?}");
        assert!((0..4).all(|i| covariance[(i, i)] >= 0.0), "{name}: {estimate:?}");
    }
}

fn advance(entry: &TrackerEntry, tracker: &mut dyn Tracker, frame: &Frame) -> Estimate {
    let estimate = tracker.update(frame).unwrap_or_else(|e| panic!("{}, frame {}: {e}", entry.name, frame.index()));
    sound(entry, &estimate, frame);
    estimate
}

fn run(entry: &TrackerEntry, tracker: &mut dyn Tracker, world: &World, frames: std::ops::Range<u64>) -> Vec<Estimate> {
    frames.map(|k| advance(entry, tracker, &world.frame(k))).collect()
}

fn template(entry: &TrackerEntry) {
    use pursuit_tracking::motion::MotionModel;
    let schema = recipe(entry).schema();
    let text = pursuit_parameters::template(&schema);
    let table: toml::Table = text.parse().unwrap_or_else(|e| panic!("{}: {e}\n{text}", entry.name));
    let read = entry.recipe(&table).unwrap().parameters().unwrap();
    assert_eq!(read, recipe(entry).parameters().unwrap(), "{}", entry.name);
    for name in schema.iter().map(|p| p.name) {
        assert!(text.contains(name), "{}: {name} is not in the template", entry.name);
    }
    for model in MotionModel::ALL {
        let chosen = entry.recipe(&set("motion.model", model.as_str())).unwrap();
        let table: toml::Table = pursuit_parameters::template(&chosen.schema()).parse().unwrap();
        let read = entry.recipe(&table).unwrap().parameters().unwrap();
        assert_eq!(read, chosen.parameters().unwrap(), "{}, {model:?}", entry.name);
    }
    let unknown = toml::Table::from_iter([("no-such-parameter".to_owned(), toml::Value::Boolean(true))]);
    let error = entry.recipe(&unknown).err().expect("an unknown parameter is refused").to_string();
    assert!(error.contains("no-such-parameter") && error.contains(entry.name), "{error}");
}

fn deterministic(entry: &TrackerEntry) {
    let world = World::moving();
    let (mut a, mut b) = (start(entry, &world), start(entry, &world));
    let (first, second) = (run(entry, &mut *a, &world, 1..8), run(entry, &mut *b, &world, 1..8));
    assert_eq!(first, second, "{}", entry.name);
}

fn follows(entry: &TrackerEntry) {
    let world = World::moving();
    let estimates = run(entry, &mut *start(entry, &world), &world, 1..26);
    for (k, estimate) in (1u64..).zip(&estimates) {
        let overlap = estimate.bbox.iou(&world.truth(k));
        assert!(overlap > 0.5, "{}, frame {k}: overlap {overlap:.2}, {estimate:?}", entry.name);
    }
    let tracked = estimates.iter().filter(|e| e.state == TrackState::Tracking).count();
    assert!(tracked * 10 >= estimates.len() * 9, "{}: {tracked} of {}", entry.name, estimates.len());
}

fn motionless(entry: &TrackerEntry) {
    let world = World::still();
    for estimate in run(entry, &mut *start(entry, &world), &world, 1..16) {
        let overlap = estimate.bbox.iou(&world.start);
        assert!(overlap > 0.8 && estimate.state == TrackState::Tracking, "{}: {overlap:.2} {estimate:?}", entry.name);
    }
}

fn shifts(entry: &TrackerEntry) {
    let here = World::moving();
    let there = World { shift: (17, -9), ..here };
    let a = run(entry, &mut *start(entry, &here), &here, 1..16);
    let b = run(entry, &mut *start(entry, &there), &there, 1..16);
    for (a, b) in a.iter().zip(&b) {
        let expected = a.bbox.translated(17.0, -9.0);
        let apart = expected.center().distance(b.bbox.center());
        assert!(apart < 1.5 && expected.iou(&b.bbox) > 0.85, "{}: {apart:.2} {a:?} {b:?}", entry.name);
    }
}

/// Starts on `bbox` of a moving world and only asks for sound answers.
fn survives(entry: &TrackerEntry, bbox: BBox) {
    let world = World::moving();
    let mut tracker =
        recipe(entry).init(&world.frame(0), bbox).unwrap_or_else(|e| panic!("{} from {bbox}: {e}", entry.name));
    run(entry, &mut *tracker, &world, 1..5);
}

fn borders(entry: &TrackerEntry) {
    let (w, h) = (200.0, 150.0);
    for (left, top) in [
        (0.0, 0.0),
        (w - 30.0, h - 24.0),
        (-12.0, 40.0),
        (w - 15.0, 60.0),
        (70.0, -10.0),
        (70.0, h - 8.0),
        (-20.0, -16.0),
    ] {
        survives(entry, BBox::from_ltwh(left, top, 30.0, 24.0));
    }
    survives(entry, BBox::from_ltwh(0.0, 0.0, w, h));
    survives(entry, BBox::from_ltwh(-50.0, -40.0, w + 100.0, h + 80.0));
}

fn thin_and_tiny(entry: &TrackerEntry) {
    for (width, height) in [(40.0, 3.0), (3.0, 40.0), (4.0, 4.0), (1.0, 1.0), (0.5, 0.5)] {
        survives(entry, BBox::from_ltwh(55.3, 55.7, width, height));
    }
}

fn senseless_boxes(entry: &TrackerEntry) {
    let world = World::moving();
    let frame = world.frame(0);
    let senseless = [
        (BBox::from_ltwh(50.0, 50.0, 0.0, 20.0), "empty"),
        (BBox::from_ltwh(50.0, 50.0, 20.0, 0.0), "empty"),
        (BBox::from_ltwh(f64::NAN, 50.0, 20.0, 20.0), "finite"),
        (BBox::from_ltwh(50.0, 50.0, f64::INFINITY, 20.0), "finite"),
        (BBox::from_ltwh(500.0, 50.0, 20.0, 20.0), "outside"),
        (BBox::from_ltwh(-50.0, 50.0, 50.0, 20.0), "outside"),
    ];
    let mut running = start(entry, &world);
    let mut control = start(entry, &world);
    for (bbox, word) in senseless {
        let error = recipe(entry).init(&frame, bbox).err().unwrap_or_else(|| panic!("{} accepts {bbox}", entry.name));
        assert!(matches!(error, TrackingError::StartBox { .. }), "{}: {error}", entry.name);
        assert!(error.to_string().contains(word), "{}: {error}", entry.name);
        assert!(running.reinit(&frame, bbox).is_err(), "{}: {bbox}", entry.name);
    }
    // A refused start changes nothing.
    assert_eq!(run(entry, &mut *running, &world, 1..4), run(entry, &mut *control, &world, 1..4), "{}", entry.name);
}

fn gray_frames(entry: &TrackerEntry) {
    for kind in [Kind::Gray, Kind::Gray16] {
        let world = World { kind, ..World::moving() };
        if recipe(entry).needs().color {
            let error = recipe(entry).init(&world.frame(0), world.truth(0)).err().expect("colour is needed");
            assert!(matches!(error, TrackingError::MissingPlane { .. }), "{}: {error}", entry.name);
            let mut tracker = start(entry, &World::moving());
            let error = tracker.update(&world.frame(1)).expect_err("colour is needed");
            assert!(matches!(error, TrackingError::MissingPlane { .. }), "{}: {error}", entry.name);
        } else {
            let estimates = run(entry, &mut *start(entry, &world), &world, 1..16);
            let overlap = estimates.last().unwrap().bbox.iou(&world.truth(15));
            assert!(overlap > 0.5, "{}, {kind:?}: {overlap:.2}", entry.name);
        }
    }
}

fn changed_size(entry: &TrackerEntry) {
    let world = World::moving();
    let other = World { size: Size::new(160, 150), ..world };
    let mut tracker = start(entry, &world);
    let error = tracker.update(&other.frame(1)).expect_err("another size is refused");
    assert!(matches!(error, TrackingError::FrameSize { .. }), "{}: {error}", entry.name);
    let message = error.to_string();
    assert!(message.contains("200x150") && message.contains("160x150"), "{message}");
    // The refusal changes nothing, and starting again on the new size is allowed.
    let mut control = start(entry, &world);
    assert_eq!(run(entry, &mut *tracker, &world, 1..4), run(entry, &mut *control, &world, 1..4), "{}", entry.name);
    tracker.reinit(&other.frame(4), other.truth(4)).unwrap();
    run(entry, &mut *tracker, &other, 5..8);
}

fn absent(entry: &TrackerEntry) {
    let world = World::moving();
    let mut tracker = start(entry, &world);
    run(entry, &mut *tracker, &world, 1..10);
    let gone: Vec<_> = (10..30).map(|k| advance(entry, &mut *tracker, &world.empty_frame(k))).collect();
    // A frame or two of grace; after that nobody may claim to see what is not there.
    for estimate in &gone[3..] {
        assert!(estimate.state != TrackState::Tracking && estimate.score < 0.5, "{}: {estimate:?}", entry.name);
    }
}

fn reinit(entry: &TrackerEntry) {
    let (first, second) = (World::moving(), World { shift: (20, 10), ..World::moving() });
    let mut used = start(entry, &first);
    run(entry, &mut *used, &first, 1..6);
    used.reinit(&second.frame(0), second.truth(0)).unwrap();
    let mut fresh = start(entry, &second);
    assert_eq!(run(entry, &mut *used, &second, 1..8), run(entry, &mut *fresh, &second, 1..8), "{}", entry.name);
}

fn cloned(entry: &TrackerEntry) {
    let (world, other) = (World::moving(), World { step: (-1.0, 2.0), ..World::moving() });
    let mut original = start(entry, &world);
    let mut control = start(entry, &world);
    run(entry, &mut *original, &world, 1..4);
    run(entry, &mut *control, &world, 1..4);
    let mut copy = original.boxed_clone();
    run(entry, &mut *copy, &other, 4..8);
    assert_eq!(run(entry, &mut *original, &world, 4..8), run(entry, &mut *control, &world, 4..8), "{}", entry.name);
}

fn looking(entry: &TrackerEntry) {
    let world = World::moving();
    let mut tracker = start(entry, &world);
    run(entry, &mut *tracker, &world, 1..5);
    // In sight, gone, and, long after, lost.
    for k in 5..80 {
        let frame = if k < 8 { world.frame(k) } else { world.empty_frame(k) };
        let before = tracker.save().unwrap();
        let seen = tracker.peek(&frame).unwrap();
        assert_eq!(tracker.save().unwrap(), before, "{}, frame {k}", entry.name);
        let estimate = advance(entry, &mut *tracker, &frame);
        assert_eq!(seen.map(|m| m.bbox), estimate.measurement, "{}, frame {k}", entry.name);
    }
}

fn forecasts(entry: &TrackerEntry) {
    let world = World::moving();
    let mut tracker = start(entry, &world);
    let last = run(entry, &mut *tracker, &world, 1..16).pop().unwrap();
    let before = tracker.save().unwrap();
    let (now, ahead) = (tracker.forecast(0.0).unwrap(), tracker.forecast(0.2).unwrap());
    assert_eq!(tracker.save().unwrap(), before, "{}", entry.name);
    assert_eq!((now.bbox, now.time_s, now.velocity), (last.bbox, last.time_s, last.velocity), "{}", entry.name);
    assert!((ahead.time_s - last.time_s - 0.2).abs() < 1e-12);
    // Five frames ahead. Boxes of several witnesses by turns are less even than those of one, and so is their speed.
    let apart = ahead.bbox.center().distance(world.truth(20).center());
    assert!(apart < 9.0, "{}: {apart} {ahead:?}", entry.name);
    assert!(ahead.covariance.unwrap()[(0, 0)] > now.covariance.unwrap()[(0, 0)], "{}", entry.name);
}

fn set(key: &str, value: impl Into<toml::Value>) -> toml::Table {
    toml::Table::from_iter([(key.to_owned(), value.into())])
}

fn changes(entry: &TrackerEntry) {
    let world = World::moving();
    let mut tracker = start(entry, &world);
    run(entry, &mut *tracker, &world, 1..8);
    let before = tracker.save().unwrap();
    for bad in [set("no-such", 1), set("policy.lost_after_s", -1.0), set("search.reach", "far")] {
        assert!(matches!(tracker.change(&bad), Err(TrackingError::Parameter(_))), "{}: {bad}", entry.name);
        assert_eq!(tracker.save().unwrap(), before, "{}: {bad}", entry.name);
    }
    tracker.change(&set("motion.model", "imm")).unwrap();
    tracker.change(&set("policy.model", "always")).unwrap();
    let estimates = run(entry, &mut *tracker, &world, 8..20);
    assert!(estimates.last().unwrap().bbox.iou(&world.truth(19)) > 0.5, "{}", entry.name);
    assert!(estimates.iter().all(|e| e.state == TrackState::Tracking), "{}", entry.name);
}

fn motion_models(entry: &TrackerEntry) {
    use pursuit_tracking::motion::MotionModel;
    let world = World::moving();
    for model in MotionModel::ALL {
        let recipe = entry.recipe(&set("motion.model", model.as_str())).unwrap();
        let mut tracker = recipe.init(&world.frame(0), world.truth(0)).unwrap();
        let last = run(entry, &mut *tracker, &world, 1..20).pop().unwrap();
        let overlap = last.bbox.iou(&world.truth(19));
        assert!(overlap > 0.5, "{}, {}: {overlap:.2}", entry.name, model.as_str());
        let restored = recipe.restore(&tracker.save().unwrap()).unwrap().update(&world.frame(20)).unwrap();
        assert_eq!(restored, tracker.update(&world.frame(20)).unwrap(), "{}, {}", entry.name, model.as_str());
    }
}

fn policies_and_searches(entry: &TrackerEntry) {
    use pursuit_tracking::policy::PolicyModel;
    use pursuit_tracking::search::SearchModel;
    let world = World::moving();
    for policy in PolicyModel::ALL {
        for search in SearchModel::ALL {
            let table = toml::Table::from_iter([
                ("policy.model".to_owned(), policy.as_str().into()),
                ("search.model".to_owned(), search.as_str().into()),
            ]);
            let recipe = entry.recipe(&table).unwrap();
            let mut tracker = recipe.init(&world.frame(0), world.truth(0)).unwrap();
            let last = run(entry, &mut *tracker, &world, 1..16).pop().unwrap();
            assert!(last.bbox.iou(&world.truth(15)) > 0.4, "{}, {policy:?}, {search:?}", entry.name);
            (16..40).for_each(|k| {
                advance(entry, &mut *tracker, &world.empty_frame(k));
            });
        }
    }
}

fn saved(entry: &TrackerEntry) {
    let world = World::moving();
    let mut original = start(entry, &world);
    run(entry, &mut *original, &world, 1..5);
    let bytes = original.save().unwrap();
    let mut restored = recipe(entry).restore(&bytes).unwrap_or_else(|e| panic!("{}: {e}", entry.name));
    assert_eq!(run(entry, &mut *original, &world, 5..12), run(entry, &mut *restored, &world, 5..12), "{}", entry.name);
    // Also when saved right after the start, and when saved again.
    let again = restored.save().unwrap();
    assert_eq!(original.save().unwrap(), again, "{}", entry.name);
    assert!(recipe(entry).restore(&start(entry, &world).save().unwrap()).is_ok(), "{}", entry.name);
}

fn corrupted(entry: &TrackerEntry) {
    let world = World::moving();
    let bytes = start(entry, &world).save().unwrap();
    let is_refused = |bytes: &[u8]| {
        let result = recipe(entry).restore(bytes);
        assert!(!matches!(&result, Err(e) if !matches!(e, TrackingError::Snapshot { .. })), "{}", entry.name);
        result
    };
    let step = (bytes.len() / 40).max(1);
    for length in (0..bytes.len()).step_by(step) {
        assert!(is_refused(&bytes[..length]).is_err(), "{}: cut to {length} of {} bytes", entry.name, bytes.len());
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(is_refused(&longer).is_err(), "{}: one byte too many", entry.name);
    assert!(is_refused(b"nothing of the kind").is_err(), "{}", entry.name);
    // A flipped bit may go unnoticed, but nothing may panic, then or later.
    let frame = world.frame(1);
    for at in (0..bytes.len()).step_by(step).chain(0..bytes.len().min(48)) {
        for bit in [0, 6, 7] {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << bit;
            if let Ok(mut tracker) = is_refused(&flipped) {
                // Whatever it says now, it says it without a panic.
                drop(tracker.update(&frame));
            }
        }
    }
}

fn odd_times(entry: &TrackerEntry) {
    let world = World::moving();
    let mut tracker = start(entry, &world);
    for (k, time_s) in [(1, 0.0), (2, 0.0), (3, -5.0), (4, 100.0), (5, 99.0), (6, f64::NAN), (7, 101.0), (8, 101.04)] {
        advance(entry, &mut *tracker, &world.frame_at(k, time_s, true));
    }
}

fn low_frame_rate(entry: &TrackerEntry) {
    // Two frames a second, most of its size between frames: it may be lost, but not with a senseless answer.
    let world = World { step: (24.0, 12.0), fps: 2.0, ..World::moving() };
    run(entry, &mut *start(entry, &world), &world, 1..5);
}
