//! One suite over the registry of detectors: every detector listed there is held to it, with nothing to add here for a new one.

use crate::world::{self, Kind, background_color};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Frame, Image, Pixels, Rgb8};
use pursuit_trackers::registry::{detectors, ready_detectors};
use pursuit_tracking::{Detection, Detector, DetectorEntry, Followed, TrackingError};

/// A check of the suite.
type Check = fn(&DetectorEntry);

const CHECKS: &[(&str, Check)] = &[
    ("the template reads back as the defaults", template),
    ("the same frames give the same answers", deterministic),
    ("what moves is found", finds),
    ("of nothing, nothing is found", nothing),
    ("grey and 16-bit frames", gray_frames),
    ("a changed frame size does no harm", changed_size),
    ("thin and tiny frames", thin_and_tiny),
    ("frames of one value, and noise", hostile_frames),
    ("senseless boxes of targets do no harm", hostile_targets),
    ("time that stands still or runs backwards does no harm", odd_times),
];

#[test]
fn every_detector_of_the_registry_conforms() {
    let failed: Vec<String> = ready_detectors().flat_map(failures).collect();
    assert_eq!(failed, Vec::<String>::new());
    let names: Vec<&str> = detectors().iter().map(|d| d.name).collect();
    assert!(names.iter().enumerate().all(|(i, name)| !names[..i].contains(name)), "{names:?}");
}

/// The checks that an entry fails: all of them, so that one run shows the whole list.
fn failures(entry: &DetectorEntry) -> Vec<String> {
    let fails = |check: Check| std::panic::catch_unwind(|| check(entry)).is_err();
    CHECKS.iter().filter(|(_, check)| fails(*check)).map(|(name, _)| format!("{}: {name}", entry.name)).collect()
}

#[test]
fn detectors_without_their_file_say_so() {
    for entry in detectors().iter().filter(|d| d.needs.file) {
        let error = entry.detector(&toml::Table::new()).err().expect("it needs a file").to_string();
        assert!(error.contains(entry.name) && error.contains("--set"), "{error}");
    }
}

/// A yellow ball of radius 11 that moves over a still background, away from `start` by `step` pixels a frame.
#[derive(Clone, Copy)]
struct Rally {
    kind: Kind,
    size: Size,
    with_ball: bool,
}

impl Rally {
    const RADIUS: f64 = 11.0;

    fn new() -> Self {
        Self { kind: Kind::Color, size: world::SIZE, with_ball: true }
    }

    fn center(index: u64) -> Point {
        Point::new(30.0 + 3.0 * index as f64, 50.0 + 1.5 * index as f64)
    }

    fn truth(index: u64) -> BBox {
        BBox::from_center_size(Self::center(index), 2.0 * Self::RADIUS, 2.0 * Self::RADIUS)
    }

    fn frame(&self, index: u64) -> Frame {
        self.frame_at(index, index as f64 / world::FPS)
    }

    fn frame_at(&self, index: u64, time_s: f64) -> Frame {
        let center = Self::center(index);
        let color = |x: usize, y: usize| -> Rgb8 {
            let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
            let inside = self.with_ball && Point::new(u, v).distance(center) < Self::RADIUS;
            if inside { [255, 225, 30] } else { background_color(u, v) }
        };
        Frame::new(index, time_s, pixels(self.kind, self.size, color))
    }
}

fn pixels(kind: Kind, Size { width, height }: Size, color: impl Fn(usize, usize) -> Rgb8) -> Pixels {
    let luma = |x, y| {
        let [r, g, b] = color(x, y).map(f64::from);
        0.299 * r + 0.587 * g + 0.114 * b
    };
    match kind {
        Kind::Color => Pixels::Rgb8(Image::from_fn(width, height, &color).unwrap().into()),
        Kind::Gray => Pixels::Gray8(Image::from_fn(width, height, |x, y| luma(x, y) as u8).unwrap().into()),
        Kind::Gray16 => {
            Pixels::Gray16(Image::from_fn(width, height, |x, y| (20_000.0 + 40.0 * luma(x, y)) as u16).unwrap().into())
        }
    }
}

fn start(entry: &DetectorEntry) -> Box<dyn Detector> {
    entry.detector(&toml::Table::new()).unwrap_or_else(|e| panic!("{}: {e}", entry.name))
}

/// Finite boxes that lie in the frame, the best first, with probabilities.
fn sound(entry: &DetectorEntry, found: &[Detection], frame: &Frame) {
    for d in found {
        assert!(d.bbox.is_finite() && !d.bbox.is_empty(), "{}: {d:?}", entry.name);
        assert!(d.bbox.fraction_inside(&frame.size().bounds().expanded(1.0)) > 0.999, "{}: {d:?}", entry.name);
        assert!((0.0..=1.0).contains(&d.confidence), "{}: {d:?}", entry.name);
    }
    assert!(found.windows(2).all(|w| w[0].confidence >= w[1].confidence), "{}: {found:?}", entry.name);
}

fn look(entry: &DetectorEntry, detector: &mut dyn Detector, frame: &Frame) -> Vec<Detection> {
    let found = detector.detect(frame, &[]).unwrap_or_else(|e| panic!("{}, frame {}: {e}", entry.name, frame.index()));
    for (figure, _) in detector.diagnostics().figures() {
        assert!(
            entry.figures().any(|declared| declared == figure),
            "{}: `{}` is not declared",
            entry.name,
            figure.name
        );
    }
    sound(entry, &found, frame);
    let figures = detector.diagnostics();
    assert!(figures.iter().all(|(_, value)| value.is_finite()), "{}: {figures:?}", entry.name);
    found
}

fn run(entry: &DetectorEntry, rally: Rally, frames: u64) -> Vec<Vec<Detection>> {
    let mut detector = start(entry);
    (0..frames).map(|k| look(entry, &mut *detector, &rally.frame(k))).collect()
}

fn template(entry: &DetectorEntry) {
    let schema = entry.schema();
    let text = pursuit_parameters::template(&schema);
    let table: toml::Table = text.parse().unwrap_or_else(|e| panic!("{}: {e}\n{text}", entry.name));
    assert_eq!(entry.parameters(&table).unwrap(), entry.parameters(&toml::Table::new()).unwrap(), "{}", entry.name);
    let unknown = toml::Table::from_iter([("no-such-parameter".to_owned(), toml::Value::Boolean(true))]);
    let error = entry.detector(&unknown).err().expect("an unknown parameter is refused").to_string();
    assert!(error.contains("no-such-parameter") && error.contains(entry.name), "{error}");
}

fn deterministic(entry: &DetectorEntry) {
    assert_eq!(run(entry, Rally::new(), 15), run(entry, Rally::new(), 15), "{}", entry.name);
}

fn finds(entry: &DetectorEntry) {
    let found = run(entry, Rally::new(), 40);
    for (k, found) in (0..).zip(&found).skip(25) {
        let best = found.first().unwrap_or_else(|| panic!("{}, frame {k}: nothing", entry.name));
        let overlap = best.bbox.iou(&Rally::truth(k));
        assert!(overlap > 0.5 && best.confidence >= 0.5, "{}, frame {k}: {overlap:.2} {found:?}", entry.name);
    }
}

fn nothing(entry: &DetectorEntry) {
    let found = run(entry, Rally { with_ball: false, ..Rally::new() }, 40);
    assert_eq!(found.concat(), [], "{}", entry.name);
}

fn gray_frames(entry: &DetectorEntry) {
    for kind in [Kind::Gray, Kind::Gray16] {
        let rally = Rally { kind, ..Rally::new() };
        if entry.needs.color {
            let error = start(entry).detect(&rally.frame(0), &[]).expect_err("colour is needed");
            assert!(matches!(error, TrackingError::MissingPlane { .. }), "{}: {error}", entry.name);
        } else {
            let found = run(entry, rally, 40);
            let overlap = found[39].first().map_or(0.0, |d| d.bbox.iou(&Rally::truth(39)));
            assert!(overlap > 0.5, "{}, {kind:?}: {overlap:.2}", entry.name);
        }
    }
}

/// A model of the scene is of one size, and says so; what looks at each frame by itself goes on.
fn changed_size(entry: &DetectorEntry) {
    let (rally, other) = (Rally::new(), Rally { size: Size::new(160, 150), ..Rally::new() });
    let (mut detector, mut control) = (start(entry), start(entry));
    for k in 0..5 {
        assert_eq!(look(entry, &mut *detector, &rally.frame(k)), look(entry, &mut *control, &rally.frame(k)));
    }
    if !detector.watches() {
        look(entry, &mut *detector, &other.frame(5));
        return;
    }
    let error = detector.detect(&other.frame(5), &[]).expect_err("another size is refused");
    assert!(matches!(error, TrackingError::FrameSize { .. }), "{}: {error}", entry.name);
    let message = error.to_string();
    assert!(message.contains("200x150") && message.contains("160x150"), "{message}");
    // The refusal changes nothing.
    assert_eq!(look(entry, &mut *detector, &rally.frame(6)), look(entry, &mut *control, &rally.frame(6)));
}

fn thin_and_tiny(entry: &DetectorEntry) {
    for (width, height) in [(1, 1), (2, 2), (1, 200), (200, 1), (3, 40), (16, 16)] {
        run(entry, Rally { size: Size::new(width, height), ..Rally::new() }, 6);
    }
}

fn hostile_frames(entry: &DetectorEntry) {
    let mut detector = start(entry);
    let noise = |k: u64, x: usize, y: usize| -> Rgb8 {
        let mut h = (k << 40 ^ (x as u64) << 20 ^ y as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        h = (h ^ h >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        [h >> 40, h >> 48, h >> 56].map(|c| c as u8)
    };
    for k in 0..12 {
        let color = |x: usize, y: usize| match k % 4 {
            0 => [0; 3],
            1 => [255; 3],
            2 => [240, 120, 20],
            _ => noise(k, x, y),
        };
        let frame = Frame::new(k, k as f64 / world::FPS, pixels(Kind::Color, world::SIZE, color));
        look(entry, &mut *detector, &frame);
    }
}

fn hostile_targets(entry: &DetectorEntry) {
    let boxes = [
        BBox::from_ltwh(f64::NAN, 10.0, 20.0, 20.0),
        BBox::from_ltwh(10.0, 10.0, f64::INFINITY, 20.0),
        BBox::from_ltwh(-1e9, -1e9, 2e9, 2e9),
        BBox::from_ltwh(1e7, 1e7, 5.0, 5.0),
        BBox::from_ltwh(40.0, 40.0, 0.0, 0.0),
        BBox::from_ltwh(40.0, 40.0, -5.0, -5.0),
    ];
    let followed: Vec<Followed> = boxes.iter().map(|b| Followed { bbox: *b, measured: true }).collect();
    let (mut detector, rally) = (start(entry), Rally::new());
    for k in 0..12 {
        let frame = rally.frame(k);
        let found = detector.detect(&frame, &followed).unwrap_or_else(|e| panic!("{}, frame {k}: {e}", entry.name));
        sound(entry, &found, &frame);
    }
}

fn odd_times(entry: &DetectorEntry) {
    let (mut detector, rally) = (start(entry), Rally::new());
    for (k, time_s) in (0..).zip([0.0, 0.0, -5.0, 100.0, 99.0, f64::NAN, f64::INFINITY, 101.0, 101.04]) {
        look(entry, &mut *detector, &rally.frame_at(k, time_s));
    }
}
