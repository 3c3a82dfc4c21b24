//! Exports of detectors with nothing beside them: told from the shape of the answer and the names in the file, or refused with what
//! to write.
#![cfg(any(feature = "rten", feature = "onnxruntime"))]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test may panic, and be told by the environment where a library is"
)]

mod ways;

use pursuit_geometry::BBox;
use pursuit_imaging::Image;
use pursuit_inference::detection::{Family, Limits, ObjectDetector};
use pursuit_inference::onnx::{Device, OnnxOptions};
use pursuit_testkit::network_that_answers;
use std::path::{Path, PathBuf};
use ways::ways;

const LIMITS: Limits = Limits { score: 0.3, overlap: 0.45, candidates: 100, most: 100 };
/// Of an image of 64 x 64: 64 cells of 8 pixels, 16 of 16, 4 of 32.
const SIDE: usize = 64;
const CELLS: usize = 84;
const NAMES: &str = "{0: 'person', 1: \"dog's bed\", 2: 'car'}";

/// An answer of `boxes` rows of `numbers`: nothing but `row` in place `at`.
fn rows(boxes: usize, numbers: usize, at: usize, row: &[f32]) -> Vec<f32> {
    let mut answer = vec![0.0; boxes * numbers];
    answer[at * numbers..][..row.len()].copy_from_slice(row);
    answer
}

/// Number after number of all boxes.
fn planes(rows: &[f32], numbers: usize) -> Vec<f32> {
    (0..numbers).flat_map(|n| rows.iter().skip(n).step_by(numbers).copied()).collect()
}

struct Export {
    shape: Vec<usize>,
    answer: Vec<f32>,
    image: (usize, usize),
    properties: Vec<(&'static str, &'static str)>,
}

impl Export {
    fn new(shape: &[usize], answer: Vec<f32>) -> Self {
        Self { shape: shape.to_vec(), answer, image: (SIDE, SIDE), properties: vec![("names", NAMES)] }
    }

    fn with(mut self, properties: &[(&'static str, &'static str)]) -> Self {
        self.properties = properties.to_vec();
        self
    }

    fn file(&self, folder: &Path) -> PathBuf {
        let file = folder.join("net.onnx");
        std::fs::write(&file, network_that_answers(self.image, &self.shape, &self.answer, &self.properties)).unwrap();
        file
    }

    /// Opens it by each library, and finds in a frame of 128 x 64 one box of class `class`, or what it is refused by.
    fn finds(&self, family: Family, expected: BBox, class: &str, words: &[&str]) {
        let folder = tempfile::tempdir().unwrap();
        let file = self.file(folder.path());
        let frame = Image::filled(128, 64, [90, 90, 90]).unwrap();
        for options in ways() {
            let mut detector = ObjectDetector::open(&file, &options).unwrap();
            assert_eq!(detector.config().family, family);
            let found = detector.detect(frame.view(), &LIMITS).unwrap().to_vec();
            assert_eq!(found.len(), 1, "{family:?}: {found:?}");
            let object = &found[0];
            assert_eq!(detector.config().classes[object.class], class, "{family:?}");
            let (found, wanted) = (object.bbox.ltwh(), expected.ltwh());
            let off = [found.0 - wanted.0, found.1 - wanted.1, found.2 - wanted.2, found.3 - wanted.3];
            assert!(off.iter().all(|d| d.abs() < 1e-3), "{family:?}: {found:?} for {wanted:?}");
            let [note] = detector.notes().try_into().unwrap();
            assert!(words.iter().all(|w| note.contains(w)) && note.starts_with("net.onnx is taken for"), "{note}");
        }
    }

    fn is_refused(&self, toml: Option<&str>, words: &[&str]) {
        let folder = tempfile::tempdir().unwrap();
        let file = self.file(folder.path());
        if let Some(toml) = toml {
            std::fs::write(file.with_extension("toml"), toml).unwrap();
        }
        for options in ways() {
            let error = ObjectDetector::open(&file, &options).err().unwrap().to_string();
            words.iter().for_each(|w| assert!(error.contains(w), "{w}: {error}"));
        }
    }
}

// A frame of 128 x 64 lies in rows 16 to 47 of the image where it is in the middle, in its upper half where it is in the corner, and
// is half as wide as high where it is stretched. The box in the middle of the image is the frame's middle, but for the corner.

#[test]
fn yolov8_and_yolov5_are_told_by_their_shapes() {
    let v8 = rows(CELLS, 7, 9, &[32.0, 32.0, 16.0, 8.0, 0.1, 0.2, 0.9]);
    Export::new(&[1, 7, CELLS], planes(&v8, 7)).finds(
        Family::Yolov8,
        BBox::from_ltwh(48.0, 24.0, 32.0, 16.0),
        "car",
        &["YOLOv8", "3 classes (person, dog's bed, car)", "64 x 64"],
    );
    // Transposed by somebody.
    Export::new(&[1, CELLS, 7], v8).finds(Family::Yolov8, BBox::from_ltwh(48.0, 24.0, 32.0, 16.0), "car", &["YOLOv8"]);
    let v5 = rows(3 * CELLS, 8, 200, &[32.0, 32.0, 16.0, 8.0, 0.9, 0.1, 0.8, 0.2]);
    Export::new(&[1, 3 * CELLS, 8], v5).finds(
        Family::Yolov5,
        BBox::from_ltwh(48.0, 24.0, 32.0, 16.0),
        "dog's bed",
        &["YOLOv5"],
    );
}

#[test]
fn yolox_is_told_and_needs_no_names_for_coco() {
    // Of an image of 128 x 128, cell 27 of the first grid: column 11, row 1; one pixel right and down of its corner, two cells wide
    // and one high.
    let mut row = vec![0.125, 0.125, 2f32.ln(), 0.0, 0.9];
    row.extend((0..80).map(|class| if class == 2 { 0.9 } else { 0.0 }));
    let mut export = Export::new(&[1, 336, 85], rows(336, 85, 27, &row)).with(&[]);
    export.image = (128, 128);
    let words = ["YOLOX", "80 classes (person, bicycle, car, …)"];
    export.finds(Family::Yolox, BBox::from_ltwh(81.0, 5.0, 16.0, 8.0), "car", &words);
}

#[test]
fn detectors_that_choose_among_their_boxes_are_told() {
    // Stretched: fractions of the frame itself. Two on one place are two things.
    let detr = rows(20, 7, 3, &[0.5, 0.25, 0.25, 0.5, 0.9, 0.1, 0.0]);
    Export::new(&[1, 20, 7], detr).finds(
        Family::RtDetr,
        BBox::from_ltwh(48.0, 0.0, 32.0, 32.0),
        "person",
        &["RT-DETR"],
    );
    let mut end = rows(20, 6, 0, &[24.0, 28.0, 40.0, 36.0, 0.9, 1.0]);
    // A class that there is not, and half a class, are nothing.
    end[6..18].copy_from_slice(&[24.0, 28.0, 40.0, 36.0, 0.9, 7.0, 24.0, 28.0, 40.0, 36.0, 0.0, 0.0]);
    let end = Export::new(&[1, 20, 6], end);
    end.finds(Family::EndToEnd, BBox::from_ltwh(48.0, 24.0, 32.0, 16.0), "dog's bed", &["chooses among its boxes"]);
}

#[test]
fn boxes_of_detectors_that_choose_are_not_thinned_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut answer = rows(20, 6, 0, &[24.0, 28.0, 40.0, 36.0, 0.9, 1.0]);
    answer[6..12].copy_from_slice(&[25.0, 28.0, 41.0, 36.0, 0.8, 1.0]);
    let file = Export::new(&[1, 20, 6], answer).file(folder.path());
    let frame = Image::filled(64, 64, [90, 90, 90]).unwrap();
    for options in ways() {
        let mut detector = ObjectDetector::open(&file, &options).unwrap();
        assert_eq!(detector.detect(frame.view(), &LIMITS).unwrap().len(), 2);
    }
}

#[test]
fn an_open_image_has_the_size_that_the_file_was_exported_for() {
    let v8 = rows(CELLS / 2 + 2, 7, 0, &[32.0, 16.0, 16.0, 8.0, 0.1, 0.2, 0.9]);
    let boxes = 8 * 4 + 4 * 2 + 2;
    assert!(boxes * 7 <= v8.len());
    let mut export = Export::new(&[1, 7, boxes], planes(&v8[..boxes * 7], 7));
    export.image = (0, 0);
    export.properties.push(("imgsz", "[32, 64]"));
    export.finds(Family::Yolov8, BBox::from_ltwh(48.0, 24.0, 32.0, 16.0), "car", &["64 x 32"]);
    export.properties.pop();
    export.is_refused(None, &["the shape of its input `images` is open"]);
}

#[test]
fn what_is_not_clear_is_refused_with_what_to_write() {
    let empty = |shape: [usize; 3]| Export::new(&shape, vec![0.0; shape.iter().product()]);
    // As many numbers as no names have.
    empty([1, 9, CELLS]).is_refused(None, &["\"yolov8\" of 5 classes", "3 classes are named", "net.toml", "family"]);
    empty([1, 9, CELLS]).with(&[]).is_refused(None, &["nothing names its classes", "classes = ["]);
    empty([1, 20, 6]).with(&[]).is_refused(None, &["nothing names", "classes = [", "net.toml"]);
    // Two classes: a score each, or the best with its number? An empty answer does not say.
    empty([1, 20, 6]).with(&[("names", "['a', 'b']")]).is_refused(None, &["\"rt-detr\" or \"end-to-end\"", "family"]);
    empty([1, 20, 3]).is_refused(None, &["yolox", "yolov5", "net.toml"]);
    empty([2, 20, 7]).is_refused(None, &["1 x boxes x numbers"]);
    empty([1, 7, CELLS]).with(&[("names", NAMES), ("task", "segment")]).is_refused(None, &["`segment`"]);
    empty([1, 7, CELLS]).with(&[("names", "['a', 'a', 'b']")]).is_refused(None, &["`a` twice", "net.toml"]);
    // Boxes that lie where their cells do are decoded already.
    let decoded: Vec<f32> = [(8, 8), (4, 16), (2, 32)]
        .into_iter()
        .flat_map(|(cells, side)| (0..cells * cells).map(move |i| (i % cells, i / cells, side)))
        .flat_map(|(x, y, side)| {
            let middle = |cell: usize| (cell as f32 + 0.4) * side as f32;
            [middle(x), middle(y), 9.0, 9.0, 1.0, 0.0, 0.0, 0.0]
        })
        .collect();
    Export::new(&[1, CELLS, 8], decoded).is_refused(None, &["YOLOv6", "boxes = \"pixels\""]);
    // What is described is not guessed at.
    empty([1, 7, CELLS]).is_refused(Some("family = 'yolov5'"), &["80 classes need 85 numbers"]);
}

#[test]
fn a_device_that_the_library_lacks_is_said_and_the_processor_runs_it() {
    let folder = tempfile::tempdir().unwrap();
    let v8 = rows(CELLS, 7, 9, &[32.0, 32.0, 16.0, 8.0, 0.1, 0.2, 0.9]);
    let file = Export::new(&[1, 7, CELLS], planes(&v8, 7)).file(folder.path());
    let frame = Image::filled(64, 64, [90, 90, 90]).unwrap();
    // Core ML is nowhere but on Apple's machines, where its own library has it.
    let elsewhere = if cfg!(target_os = "macos") { Device::Cuda } else { Device::CoreMl };
    for options in ways() {
        let on = |device| ObjectDetector::open(&file, &OnnxOptions { device, ..options.clone() }).unwrap();
        let mut detector = on(elsewhere);
        let notes = detector.notes();
        assert!(notes.len() == 2 && notes[1].contains("it runs on the processor"), "{notes:?}");
        assert_eq!(detector.detect(frame.view(), &LIMITS).unwrap().len(), 1);
        assert_eq!(on(Device::Cpu).notes().len(), 1);
    }
}
