//! Detectors of objects: what goes into the network and what is made of its answer, beside an obvious twin; and a small network by
//! file, made by `xtask/peers/objects_fixture.py`.
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test may panic, and be told by the environment where a library is"
)]

#[cfg(any(feature = "rten", feature = "onnxruntime"))]
mod ways;

use pursuit_geometry::BBox;
use pursuit_imaging::{Image, Rgb8};
use pursuit_inference::detection::{BoxCoding, DetectionConfig, Family, Limits, Object, ObjectDetector, Placing};
use pursuit_inference::{InferenceError, Network, Port, Result};
use std::path::Path;
use std::sync::{Arc, Mutex};

const LIMITS: Limits = Limits { score: 0.3, overlap: 0.5, candidates: 100, most: 100 };

/// Answers what it was told, and keeps what it was shown.
struct Told {
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    image: Vec<f32>,
    answer: Vec<f32>,
    shown: Arc<Mutex<Vec<f32>>>,
}

impl Told {
    fn new(image: [usize; 4], output: [usize; 3], answer: Vec<f32>) -> Self {
        let port = |shape: &[usize]| vec![Port { name: "port".into(), shape: shape.to_vec() }];
        let len = image.iter().product();
        Self { inputs: port(&image), outputs: port(&output), image: vec![0.0; len], answer, shown: Arc::default() }
    }
}

impl Network for Told {
    fn name(&self) -> &str {
        "told"
    }
    fn inputs(&self) -> &[Port] {
        &self.inputs
    }
    fn outputs(&self) -> &[Port] {
        &self.outputs
    }
    fn input_mut(&mut self, _: usize) -> &mut [f32] {
        &mut self.image
    }
    fn run(&mut self) -> Result<()> {
        self.shown.lock().unwrap().clone_from(&self.image);
        Ok(())
    }
    fn output(&self, _: usize) -> &[f32] {
        &self.answer
    }
}

fn config(text: &str) -> DetectionConfig {
    let config: DetectionConfig = toml::from_str(text).unwrap();
    config.check().unwrap();
    config
}

/// A row of YOLOX's answer: the box relative to its cell, how likely it holds anything, two classes.
fn row(x: f32, y: f32, w: f32, h: f32, rest: [f32; 3]) -> Vec<f32> {
    [&[x, y, w, h][..], &rest].concat()
}

fn detect(network: Told, config: DetectionConfig, image: &Image<Rgb8>, limits: &Limits) -> Vec<Object> {
    ObjectDetector::new(Box::new(network), config).unwrap().detect(image.view(), limits).unwrap().to_vec()
}

#[test]
fn boxes_of_grids_are_decoded_as_yolox_does() {
    // An image of 16 x 8 has 2 x 1 cells of 8 px and 1 x 0 … so one grid, and one of 4 px: 4 x 2 cells before them.
    let config = config("classes = ['a', 'b']\nstrides = [4, 8]");
    let mut answer: Vec<Vec<f32>> = vec![row(0.0, 0.0, 0.0, 0.0, [0.0; 3]); 10];
    // Cell 6 of the first grid: column 2, row 1; cell 9: column 1 of the second.
    answer[6] = row(0.5, 0.25, 0.0, 2f32.ln(), [0.8, 0.1, 0.9]);
    answer[9] = row(-0.5, 0.5, 2f32.ln(), 0.0, [0.9, 0.6, 0.5]);
    answer[3] = row(0.0, 0.0, f32::NAN, 0.0, [0.9, 0.9, 0.5]);
    answer[4] = row(0.0, 0.0, 0.0, 0.0, [f32::NAN, 0.9, 0.5]);
    answer[5] = row(0.0, 0.0, 900.0, 0.0, [0.9, 0.9, 0.5]);
    let network = Told::new([1, 3, 8, 16], [1, 10, 7], answer.concat());
    // A frame twice as large: ratio one half.
    let frame = Image::filled(32, 16, [10, 20, 30]).unwrap();
    let found = detect(network, config.clone(), &frame, &LIMITS);
    let expected = [
        // Middle ((2 + .5) · 4, (1 + .25) · 4), size (4, 8), twice as large in the frame.
        (BBox::from_ltwh(16.0, 2.0, 8.0, 16.0), 0.8f64 * 0.9, 1),
        (BBox::from_ltwh(-8.0, 0.0, 32.0, 16.0), 0.9 * 0.6, 0),
    ];
    assert_eq!(found.len(), 2, "{found:?}");
    for (object, (bbox, score, class)) in found.iter().zip(expected) {
        assert_eq!(object.class, class);
        assert!((object.score - score).abs() < 1e-6, "{object:?}");
        let worst = |a: (f64, f64, f64, f64), b: (f64, f64, f64, f64)| {
            [a.0 - b.0, a.1 - b.1, a.2 - b.2, a.3 - b.3].iter().fold(0.0, |m: f64, d| m.max(d.abs()))
        };
        assert!(worst(object.bbox.ltwh(), bbox.ltwh()) < 1e-5, "{object:?} {bbox}");
    }
    // One class alone: boxes of the other are not offered as it.
    let network = Told::new([1, 3, 8, 16], [1, 10, 7], answer.concat());
    let mut detector = ObjectDetector::new(Box::new(network), config).unwrap();
    detector.look_for(&["A".to_owned()]).unwrap();
    let found = detector.detect(frame.view(), &Limits { score: 0.05, ..LIMITS }).unwrap();
    assert_eq!(found.iter().map(|o| o.class).collect::<Vec<_>>(), [0]);
    assert_eq!(detector.look_for(&["a".to_owned(), "c".to_owned()]), Err("c"));
}

#[test]
fn boxes_in_planes_of_pixels_without_objectness_are_read_too() {
    // Three boxes of two classes, logits, number after number of all boxes.
    let planes = [
        [5.0, 6.0, 30.0],
        [5.0, 5.0, 30.0],
        [4.0, 4.0, 10.0],
        [4.0, 4.0, 10.0],
        [2.0, 1.0, -9.0],
        [-9.0, -9.0, 3.0f32],
    ];
    let config = config("classes = ['a', 'b']\nboxes = 'pixels'\nobjectness = false\nlogits = true\nplace = 'middle'");
    assert_eq!(config.attributes(), 6);
    let network = Told::new([1, 3, 40, 40], [1, 6, 3], planes.concat());
    // 40 x 20 in 40 x 40: ten rows above it.
    let frame = Image::filled(40, 20, [0, 0, 0]).unwrap();
    let found = detect(network, config, &frame, &LIMITS);
    // The second overlaps the first by 12/20.
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].class, found[0].bbox), (1, BBox::from_ltwh(25.0, 15.0, 10.0, 10.0)));
    assert_eq!((found[1].class, found[1].bbox), (0, BBox::from_ltwh(3.0, -7.0, 4.0, 4.0)));
    assert!((found[1].score - 1.0 / (1.0 + (-2f64).exp())).abs() < 1e-6);
}

#[test]
fn the_network_is_shown_the_frame_fitted_into_its_image() {
    let shown = |text: &str, frame: &Image<Rgb8>| {
        let network = Told::new([1, 3, 4, 6], [1, 1, 6], vec![0.0; 6]);
        let image = network.shown.clone();
        let config = config(&format!("classes = ['a']\nstrides = [4]\n{text}"));
        detect(network, config, frame, &LIMITS);
        let image = image.lock().unwrap();
        image.clone()
    };
    // 3 x 4 pixels fill four rows as they are; three columns remain.
    let frame = Image::from_fn(3, 4, |x, y| [(10 * x) as u8, (10 * y) as u8, 200]).unwrap();
    let plane = |image: &[f32], c: usize| image[c * 24..][..24].to_vec();
    let image = shown("channels = 'bgr'", &frame);
    let twin = |c: usize| -> Vec<f32> {
        let pixel = |i: usize| (i % 6 < 3).then(|| frame.row(i / 6)[i % 6]);
        (0..24).map(|i| pixel(i).map_or(114.0, |p| f32::from(p[2 - c]))).collect()
    };
    (0..3).for_each(|c| assert_eq!(plane(&image, c), twin(c), "channel {c}"));
    let image = shown(
        "channels = 'rgb'\nplace = 'middle'\nfill = 0\nmean = [1.0, 0.0, 0.0]\ndeviation = [2.0, 1.0, 1.0]",
        &frame,
    );
    assert_eq!(&plane(&image, 0)[..6], [-0.5, -0.5 + 0.0, 4.5, 9.5, -0.5, -0.5]);
    assert_eq!(&plane(&image, 2)[..6], [0.0, 200.0, 200.0, 200.0, 0.0, 0.0]);
}

#[test]
fn a_network_that_answers_everywhere_costs_no_more_than_its_limits() {
    let config = config("classes = ['a']\nboxes = 'pixels'\nobjectness = false");
    let count = 5000;
    let answer = (0..count).flat_map(|i| [(7 * i) as f32, 0.0, 5.0, 5.0, i as f32 / count as f32]).collect();
    let network = Told::new([1, 3, 8, 8], [1, count, 5], answer);
    let frame = Image::filled(8, 8, [0, 0, 0]).unwrap();
    let found = detect(network, config, &frame, &Limits { score: 0.0, overlap: 0.5, candidates: 30, most: 20 });
    assert_eq!(found.len(), 20);
    assert!(found.windows(2).all(|w| w[0].score >= w[1].score) && found[0].score > 0.999);
}

#[test]
fn networks_and_descriptions_that_do_not_fit_are_refused_with_the_mend() {
    let refused = |image: [usize; 4], output: [usize; 3], config: &DetectionConfig, words: &[&str]| {
        let error = ObjectDetector::new(Box::new(Told::new(image, output, Vec::new())), config.clone()).err().unwrap();
        assert!(matches!(error, InferenceError::Model { .. }));
        let message = error.to_string();
        words.iter().for_each(|w| assert!(message.contains(w), "{w}: {message}"));
    };
    let yolox = DetectionConfig::default();
    assert_eq!((yolox.attributes(), yolox.classes.len(), yolox.place), (85, 80, Placing::Corner));
    refused([1, 1, 64, 64], [1, 84, 85], &yolox, &["no image of three planes"]);
    refused([1, 3, 64, 64], [1, 84, 25], &yolox, &["80 classes need 85 numbers", "TOML file"]);
    refused([1, 3, 64, 64], [1, 85, 85], &yolox, &["it has 85 boxes", "have 84 cells"]);
    refused([1, 3, 64, 64], [1, 60, 85], &yolox, &["it has 60 boxes", "have 84 cells"]);
    refused([1, 3, 64, 64], [1, 84, 85], &DetectionConfig { strides: vec![0], ..yolox.clone() }, &["`strides`"]);

    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("net.onnx");
    let none = DetectionConfig::beside(&model).unwrap();
    assert!(none.config == yolox && !none.says_how && !none.names_classes);
    for (text, words) in [
        ("clases = ['a']", "unknown field `clases`"),
        ("classes = []", "1 to 10000 names"),
        ("classes = ['a', 'b', 'a']", "`a` twice"),
        ("classes = ['a,b']", "comma"),
        ("classes = ['a', \"b\\nc\"]", "line break"),
        (&format!("classes = ['{}']", "a".repeat(65)), "longer than 64"),
        ("image_px = [0, 4]", "`image_px`"),
        ("deviation = [0.0, 1.0, 1.0]", "`deviation`"),
        ("strides = []", "`strides`"),
        ("boxes = 'edges'", "edges"),
        ("family = 'yolov99'", "yolov99"),
    ] {
        std::fs::write(model.with_extension("toml"), text).unwrap();
        let error = DetectionConfig::beside(&model).unwrap_err().to_string();
        assert!(error.contains("net.toml") && error.contains(words), "{error}");
    }
    std::fs::write(model.with_extension("toml"), [0xff; 9]).unwrap();
    assert!(DetectionConfig::beside(&model).is_err());
    std::fs::write(model.with_extension("toml"), vec![b'#'; (1 << 20) + 1]).unwrap();
    assert!(DetectionConfig::beside(&model).unwrap_err().to_string().contains("bytes"));
    std::fs::write(model.with_extension("toml"), "boxes = 'pixels'").unwrap();
    let described = DetectionConfig::beside(&model).unwrap();
    assert!(described.config.boxes == BoxCoding::Pixels && described.says_how);
    // A family, and what is otherwise; the classes alone say nothing of how it answers.
    std::fs::write(model.with_extension("toml"), "family = 'yolov8'\nclasses = ['a', 'b']\nplace = 'corner'").unwrap();
    let expected = DetectionConfig {
        classes: vec!["a".into(), "b".into()],
        place: Placing::Corner,
        ..DetectionConfig::of(Family::Yolov8)
    };
    assert_eq!(DetectionConfig::beside(&model).unwrap().config, expected);
    std::fs::write(model.with_extension("toml"), "classes = ['a', 'b']\nimage_px = [64, 64]").unwrap();
    let named = DetectionConfig::beside(&model).unwrap();
    assert!(named.names_classes && !named.says_how && named.config.classes == ["a", "b"]);
}

#[test]
#[cfg(any(feature = "rten", feature = "onnxruntime"))]
fn a_network_by_file_finds_red_and_blue_squares() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/squares.onnx");
    // The network's image is 128 x 96: a frame of that shape is looked at as it is.
    let frame = Image::from_fn(128, 96, |x, y| match (x / 8, y / 8) {
        (3, 5) => [250, 0, 0],
        (10, 2) => [0, 0, 220],
        _ => [0, 9, 0],
    })
    .unwrap();
    for options in ways::ways() {
        let mut detector = ObjectDetector::open(&file, &options).unwrap();
        let found = detector.detect(frame.view(), &LIMITS).unwrap().to_vec();
        let seen: Vec<_> = found.iter().map(|o| (o.class, o.bbox)).collect();
        assert_eq!(seen, [(0, BBox::from_ltwh(24.0, 40.0, 8.0, 8.0)), (1, BBox::from_ltwh(80.0, 16.0, 8.0, 8.0))]);
        assert!((found[0].score - (250.0f64 / 255.0).powi(2)).abs() < 1e-4, "{found:?}");
        // Frames of other sizes follow, with nothing left of those before.
        let small = Image::filled(16, 12, [0, 0, 0]).unwrap();
        assert_eq!(detector.detect(small.view(), &LIMITS).unwrap(), []);
        assert_eq!(detector.detect(frame.view(), &LIMITS).unwrap(), found);
    }
}

#[test]
#[cfg(not(any(feature = "rten", feature = "onnxruntime")))]
fn without_a_library_the_feature_that_is_missing_is_named() {
    use pursuit_inference::onnx::OnnxOptions;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/squares.onnx");
    let refusal = |file: &Path| ObjectDetector::open(file, &OnnxOptions::default()).err().unwrap();
    let message = refusal(&file).to_string();
    assert!(message.contains("--features onnxruntime") && message.contains("--features rten"), "{message}");
    assert!(matches!(refusal(Path::new("/nowhere.onnx")), InferenceError::Read { .. }));
}
