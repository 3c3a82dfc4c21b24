//! Masks as truth, DAVIS's and VOT's, and what is said of those that a tracker says.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
use common::{Scripted, write, write_images};
use pursuit_evaluation::{Dataset, Entry, EvalOptions, Sequence, Truth, evaluate};
use pursuit_geometry::{BBox, Mask, Size};
use pursuit_imaging::Frame;
use pursuit_media::OpenOptions;
use pursuit_tracking::{Estimate, Segmenter, SegmenterRecipe, SegmentingRecipe};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The images that the helper writes.
const SIZE: Size = Size::new(16, 12);

/// An annotation of numbered colours, `depth` bits each.
fn write_annotation(file: &Path, depth: png::BitDepth, value: impl Fn(usize, usize) -> u8) {
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    let mut encoder = png::Encoder::new(std::fs::File::create(file).unwrap(), 16, 12);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(depth);
    encoder.set_palette((0..=255).take(1 << depth as usize).flat_map(|v| [v, v, 255 - v]).collect::<Vec<u8>>());
    let bits = depth as usize;
    let mut bytes = Vec::new();
    for y in 0..SIZE.height {
        let mut row = vec![0_u8; (SIZE.width * bits).div_ceil(8)];
        for x in 0..SIZE.width {
            row[x * bits / 8] |= value(x, y) << (8 - bits - x * bits % 8);
        }
        bytes.extend(row);
    }
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

fn discover(root: &Path) -> Dataset {
    Dataset::discover(root, &OpenOptions::default()).unwrap()
}

/// Two objects: the first goes to the right and is gone in the fourth frame, the second comes in the third.
fn davis(root: &Path) {
    let names = write_images(&root.join("JPEGImages/480p/walk"), 5, 0, 5);
    for (k, name) in names.iter().enumerate() {
        let depth = if k % 2 == 0 { png::BitDepth::Four } else { png::BitDepth::Eight };
        write_annotation(&root.join("Annotations/480p/walk").join(name), depth, |x, y| {
            let first = (k + 2..k + 6).contains(&x) && (3..7).contains(&y) && k != 3;
            let second = k >= 2 && x >= 12 && y >= 8;
            if first { 1 } else { u8::from(second) * 2 }
        });
    }
}

#[test]
fn davis_has_a_sequence_for_every_object() {
    let root = tempfile::tempdir().unwrap();
    davis(root.path());
    let dataset = discover(root.path());
    assert!(dataset.problems.is_empty(), "{:?}", dataset.problems);
    let names: Vec<&str> = dataset.sequences.iter().map(Sequence::name).collect();
    assert_eq!(names, ["480p/walk-1", "480p/walk-2"]);
    let at = |left: f64| Truth::Visible(BBox::from_ltwh(left, 3.0, 4.0, 4.0));
    assert_eq!(dataset.sequences[0].truth(), [at(2.0), at(3.0), at(4.0), Truth::Absent, at(6.0)]);
    let corner = Truth::Visible(BBox::from_ltwh(12.0, 8.0, 4.0, 4.0));
    assert_eq!(dataset.sequences[1].truth(), [Truth::Unknown, Truth::Unknown, corner, corner, corner]);
    assert_eq!(dataset.sequences[0].mask(1).unwrap().area(), 16);
    assert!(dataset.sequences[0].mask(3).unwrap().is_empty() && dataset.sequences[1].mask(0).is_none());
}

#[test]
fn shades_of_grey_are_one_object_and_void_is_none() {
    let root = tempfile::tempdir().unwrap();
    let names = write_images(&root.path().join("JPEGImages/bear"), 2, 0, 5);
    // The helper's pictures are grey all over: black, then not.
    write_images(&root.path().join("Annotations/bear"), 2, 0, 5);
    let names_of = |dataset: &Dataset| dataset.sequences.iter().map(|s| s.name().to_owned()).collect::<Vec<_>>();
    let dataset = discover(root.path());
    assert_eq!(names_of(&dataset), ["bear"]);
    assert_eq!(dataset.sequences[0].truth(), [Truth::Unknown, Truth::Visible(SIZE.bounds())]);
    for name in &names {
        let file = root.path().join("Annotations/bear").join(name);
        write_annotation(&file, png::BitDepth::Eight, |x, _| if x < 8 { 255 } else { 7 });
    }
    let half = Truth::Visible(BBox::from_ltwh(8.0, 0.0, 8.0, 12.0));
    assert_eq!(discover(root.path()).sequences[0].truth(), [half, half]);
    std::fs::write(root.path().join("Annotations/bear/00001.png"), b"nothing of the kind").unwrap();
    let damaged = discover(root.path());
    assert!(damaged.problems[0].to_string().contains("00001.png"), "{:?}", damaged.problems);
}

#[test]
fn vot_masks_are_truth() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("ants");
    write_images(&folder.join("color"), 4, 1, 8);
    write(&folder.join("groundtruth.txt"), "m2,3,3,2,0,6\nm0,0,1,1,1\n0\n2,3,3,2\n");
    let dataset = discover(root.path());
    assert!(dataset.problems.is_empty(), "{:?}", dataset.problems);
    let here = Truth::Visible(BBox::from_ltwh(2.0, 3.0, 3.0, 2.0));
    assert_eq!(dataset.sequences[0].truth(), [here, Truth::Absent, Truth::Unknown, here]);
    let known: Vec<bool> = (0..5).map(|k| dataset.sequences[0].mask(k).is_some()).collect();
    assert_eq!(known, [true, true, false, false, false]);
}

pursuit_parameters::parameters! {
    /// Says the box, `wider` to the right, and nothing at all in its `silent` th frame.
    pub struct BoxMaskParams {
        /// Pixels.
        pub wider: usize = 0, in 0..=9;
        /// Frame.
        pub silent: usize = 99, in 0..=99;
    }
}

/// Says masks made of boxes.
#[derive(Clone, Serialize, Deserialize)]
pub struct BoxMask(BoxMaskParams);

impl Segmenter for BoxMask {
    fn segment(&mut self, frame: &Frame, estimate: &Estimate) -> pursuit_tracking::Result<Option<Mask>> {
        let b = estimate.bbox;
        let wide = BBox::from_ltwh(b.left(), b.top(), b.width() + self.0.wider as f64, b.height());
        Ok((frame.index() != self.0.silent as u64).then(|| Mask::from_bbox(&wide, frame.size())))
    }

    fn restart(&mut self, _: &Frame, _: BBox) -> pursuit_tracking::Result<()> {
        Ok(())
    }
}

impl SegmenterRecipe for BoxMaskParams {
    type Segmenter = BoxMask;

    fn segmenter(&self, _: &Frame, _: BBox) -> pursuit_tracking::Result<Option<BoxMask>> {
        Ok(Some(BoxMask(self.clone())))
    }
}

#[test]
fn masks_have_figures_and_boxes_have_none() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("data/still");
    write_images(&folder.join("color"), 5, 1, 8);
    write(&folder.join("groundtruth.txt"), &"m2,3,4,4,0,16\n".repeat(5));
    let masked = |name: &'static str, params: BoxMaskParams| {
        let inner = Scripted { name, ..Scripted::still() };
        Entry { name: name.to_owned(), recipe: Box::new(SegmentingRecipe::new(Box::new(inner), params)) }
    };
    let entries = vec![
        Scripted::still().entry(),
        masked("right", BoxMaskParams::default()),
        masked("wide", BoxMaskParams { wider: 4, ..BoxMaskParams::default() }),
        masked("silent", BoxMaskParams { silent: 2, ..BoxMaskParams::default() }),
    ];
    let mut options = EvalOptions::new(vec![root.path().join("data")], entries, root.path().join("out"));
    options.report = false;
    let run = || evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap();
    let results = run();
    let of = |name: &str| results.trackers[name].mean.masks;
    assert_eq!(of("still"), None);
    let right = of("right").unwrap();
    assert_eq!((right.j_and_f, right.j_mean, right.f_mean, right.j_recall), (1.0, 1.0, 1.0, 1.0));
    let wide = of("wide").unwrap();
    assert!(wide.j_mean == 0.5 && wide.j_recall == 0.0 && wide.f_mean < 1.0 && wide.f_mean > 0.5, "{wide:?}");
    // A frame without a mask counts as one whose mask is empty: one of four after the start.
    let silent = of("silent").unwrap();
    assert_eq!((silent.j_mean, silent.f_mean, silent.f_recall), (0.75, 0.75, 0.75));
    assert!(pursuit_evaluation::text_table(&results).contains("J&F"));
    // What was kept scores alike.
    assert_eq!(run().trackers["wide"].mean.masks, Some(wide));
}
