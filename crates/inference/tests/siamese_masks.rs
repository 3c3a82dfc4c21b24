//! Masks that a Siamese network draws: where they lie in the frame, and what fits together.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod told;

use pursuit_geometry::{BBox, Mask, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_inference::nanotrack::Patch;
use pursuit_inference::onnx::OnnxSiamese;
use pursuit_inference::siamese::{Answer, SiameseConfig, SiameseDescription, SiameseNetwork, SiameseTracker, Sides};
use pursuit_inference::{InferenceError, Network, Result};
use told::Named;

/// Of images of 16 and 32 pixels, 5 points a side, four pixels from one to the next.
const CONFIG: &str = "template_side_px = 16\nsearch_side_px = 32\nanswer_side = 5\nstride_px = 4.0\nchannels = 'rgb'\n\
    scores = 'probability'\ncontext = 0.5\nwindow = 0.0\npenalty = 0.0\nrate = 0.0\nmin_side_px = 2.0\n";
const SIDE: usize = 6;

fn config(more: &str) -> SiameseConfig {
    toml::from_str(&format!("{CONFIG}{more}")).unwrap()
}

/// Numbers of all outputs are others.
fn told(inputs: &[Named<'_>], outputs: &[Named<'_>]) -> Box<dyn Network> {
    told::told(inputs, outputs, |output, place| 1000 * output + place)
}

/// Says that the target is at `best`, and draws the same mask everywhere.
struct Drawing {
    best: usize,
    scores: Vec<f32>,
    mask: Vec<f32>,
}

impl SiameseNetwork for Drawing {
    fn sides(&self) -> Sides {
        Sides { template: 16, search: 32, answer: 5 }
    }
    fn write_row(&mut self, _: Patch, _: usize, _: [&[f32]; 3]) {}
    fn embed(&mut self) -> Result<Vec<f32>> {
        Ok(Vec::new())
    }
    fn set_template(&mut self, _: &[f32]) -> Result<()> {
        Ok(())
    }
    fn search(&mut self) -> Result<Answer<'_>> {
        self.scores = (0..25).map(|k| if k == self.best { 0.9 } else { 0.1 }).collect();
        Ok(Answer { scores: &self.scores, distances: &[4.0; 100] })
    }
    fn mask(&mut self, point: (usize, usize)) -> Result<&[f32]> {
        assert_eq!(point, (self.best / 5, self.best % 5));
        Ok(&self.mask)
    }
}

const FRAME: Size = Size::new(70, 50);

fn drawn(config: &SiameseConfig, best: usize, mask: &[f32], bbox: BBox) -> Result<Option<Mask>> {
    let frame = Frame::new(0, 0.0, Image::filled(FRAME.width, FRAME.height, [9, 9, 9]).unwrap());
    let network = Drawing { best, scores: Vec::new(), mask: mask.to_vec() };
    let mut tracker = SiameseTracker::new(network, config.clone(), &frame, bbox)?;
    let (center, size) = (bbox.center(), (bbox.width(), bbox.height()));
    let found = tracker.locate(&frame, center, size)?.unwrap();
    Ok(tracker.mask(FRAME, center, size, &found)?.map(|drawn| drawn.in_frame(FRAME)))
}

/// The same slowly: of every pixel of the frame what `warpAffine` would give.
fn slowly(best: usize, mask: &[f32], bbox: BBox, threshold: f64) -> Mask {
    let context = 0.5 * (bbox.width() + bbox.height());
    let side = (((bbox.width() + context) * (bbox.height() + context)).sqrt() * 2.0).round_ties_even();
    let corner = |c: f64, k: usize| c - side / 2.0 + k as f64 * 4.0 * side / 32.0;
    let (left, top) = (corner(bbox.center().x, best % 5), corner(bbox.center().y, best / 5));
    let of = |x: i64, y: i64| {
        let inside = (0..SIDE as i64).contains(&x) && (0..SIDE as i64).contains(&y);
        let logit = if inside { f64::from(mask[y as usize * SIDE + x as usize]) } else { return 0.0 };
        if logit.is_finite() { 1.0 / (1.0 + (-logit).exp()) } else { 0.0 }
    };
    Mask::from_fn(FRAME, |x, y| {
        let place = |k: usize, first: f64, pixels: usize| {
            (k as f64 * pixels as f64 / (pixels - 1) as f64 - first) * SIDE as f64 / (side / 2.0)
        };
        let (u, v) = (place(x, left, FRAME.width), place(y, top, FRAME.height));
        let (i, j) = (u.floor() as i64, v.floor() as i64);
        let (a, b) = (u - u.floor(), v - v.floor());
        let row = |j: i64| (1.0 - a) * of(i, j) + a * of(i + 1, j);
        (1.0 - b) * row(j) + b * row(j + 1) > threshold
    })
}

#[test]
fn masks_lie_about_their_point_of_the_search() {
    let mask: Vec<f32> = (0..SIDE * SIDE).map(|k| ((k * 37 % 23) as f32 - 9.0) / 3.0).collect();
    let boxes = [
        BBox::from_ltwh(25.0, 15.0, 20.0, 16.0),
        BBox::from_ltwh(30.3, 12.6, 9.0, 21.0),
        // Over the borders, and beyond the frame.
        BBox::from_ltwh(-6.0, -4.0, 20.0, 16.0),
        BBox::from_ltwh(58.0, 40.0, 20.0, 16.0),
        BBox::from_ltwh(3.0, 2.0, 64.0, 46.0),
        BBox::from_ltwh(160.0, 15.0, 20.0, 16.0),
    ];
    let mut areas = Vec::new();
    for threshold in [0.3, 0.6] {
        let config = config(&format!("mask_side = {SIDE}\nmask_threshold = {threshold}\n"));
        for (bbox, best) in boxes.iter().flat_map(|b| [0, 7, 12, 24].map(|best| (*b, best))) {
            let found = drawn(&config, best, &mask, bbox).unwrap().unwrap();
            assert_eq!(found, slowly(best, &mask, bbox, threshold), "{bbox}, {best}, {threshold}");
            areas.push(found.area());
        }
    }
    assert!(areas.iter().filter(|&&a| a > 50).count() > 24 && areas.contains(&0), "{areas:?}");
}

#[test]
fn what_is_no_number_is_not_the_targets() {
    let config = config(&format!("mask_side = {SIDE}\n"));
    let bbox = BBox::from_ltwh(25.0, 15.0, 20.0, 16.0);
    for nothing in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut mask = [5.0; SIDE * SIDE];
        assert!(drawn(&config, 12, &[nothing; SIDE * SIDE], bbox).unwrap().unwrap().is_empty());
        mask[14] = nothing;
        let found = drawn(&config, 12, &mask, bbox).unwrap().unwrap();
        assert_eq!(found, slowly(12, &mask, bbox, 0.3));
        assert!(!found.is_empty());
    }
    // A network that draws less than is described, or where no masks are wanted.
    let error = drawn(&config, 12, &[0.0; 35], bbox).unwrap_err();
    assert!(matches!(error, InferenceError::Tensor { expected: 36, actual: 35, .. }), "{error}");
    assert_eq!(drawn(&self::config(""), 12, &[0.0; 35], bbox).unwrap(), None);
}

#[test]
fn descriptions_of_masks_are_checked() {
    let refused = |more: &str| toml::from_str::<SiameseConfig>(&format!("{CONFIG}{more}")).unwrap_err().to_string();
    assert!(refused("mask_side = 513").contains("`mask_side`") && refused("mask_side = -1").contains("mask_side"));
    assert!(refused("mask_threshold = 1.5").contains("`mask_threshold`"));
    let scores = "answer = { scores = { step = 1.04, scales = 3, enlarged = 4 } }\nmask_side = 6";
    assert!(refused(scores).contains("`mask_side`"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, format!("search = 'a.onnx'\nrefine = 'r.onnx'\n[config]\n{CONFIG}mask_side = 6\n")).unwrap();
    let read = SiameseDescription::read(&path).unwrap();
    assert_eq!(read.refine.unwrap(), folder.path().join("r.onnx"));
}

const SMALL: &[usize] = &[1, 3, 16, 16];
const LARGE: &[usize] = &[1, 3, 32, 32];

/// A network of one file that answers scores, boxes and these.
fn answering(more: &[(&str, &[usize])]) -> OnnxSiamese {
    let outputs = [("scores", &[1, 1, 5, 5][..]), ("boxes", &[1, 4, 5, 5])];
    let both = told(&[("template", SMALL), ("search", LARGE)], &[&outputs[..], more].concat());
    OnnxSiamese::new(None, both, None, &config("").answer).unwrap()
}

#[test]
fn an_output_with_a_plane_for_each_place_is_the_mask() {
    let config = config("mask_side = 3");
    let mut network = answering(&[("masks", &[1, 9, 5, 5])]).with_masks(None, &config).unwrap();
    network.search().unwrap();
    // `told` answers the number of the output times 1000 and the place in it.
    let want: Vec<f32> = (0..9u16).map(|plane| 2000.0 + f32::from(25 * plane + 5 * 2 + 3)).collect();
    assert_eq!(network.mask((2, 3)).unwrap(), want);
    // A clone that searches draws no masks of others.
    let mut other = network.clone();
    other.write_row(Patch::Search, 0, [&[0.5; 32]; 3]);
    other.search().unwrap();
    assert_eq!(network.mask((2, 3)).unwrap(), want);
    assert_eq!(other.mask((2, 3)).unwrap()[0], want[0] + 0.5);
    let mut silent = answering(&[("masks", &[1, 9, 5, 5])]).with_masks(None, &self::config("")).unwrap();
    silent.search().unwrap();
    assert!(silent.mask((2, 3)).unwrap().is_empty());
    for shape in [[1, 8, 5, 5], [1, 9, 4, 4], [2, 9, 5, 5], [1, 9, 5, 4]] {
        let error = answering(&[("masks", &shape)]).with_masks(None, &config).unwrap_err().to_string();
        assert!(error.contains("no mask of [1, 9, 5, 5], 3 x 3 a point") && error.contains("refine"), "{error}");
    }
}

#[test]
fn a_refined_mask_is_drawn_of_windows_about_the_point() {
    let config = config("mask_side = 3");
    let with = |inputs: &[(&str, &[usize])], outputs: &[(&str, &[usize])]| {
        answering(&[("half", &[1, 6, 16, 16]), ("correlated", &[1, 3, 5, 5])])
            .with_masks(Some(told(inputs, outputs)), &config)
    };
    let mask = [("mask", &[1, 9][..])];
    // Pixel by pixel two: windows of 8 in a map of 16 are two places apart.
    let parts = [("correlated", &[1, 3, 1, 1][..]), ("half", &[1, 6, 8, 8])];
    let mut network = with(&parts, &mask).unwrap();
    network.search().unwrap();
    // The first number of each input is added to what `told` answers: of `half` places 2 r and 2 c, of `correlated` r and c.
    let first = |r: usize, c: usize| 2000.0 + (16 * 2 * r + 2 * c) as f32 + 3000.0 + (5 * r + c) as f32;
    for (r, c) in [(0, 0), (2, 3), (4, 4)] {
        assert_eq!(network.mask((r, c)).unwrap()[..2], [first(r, c), first(r, c) + 1.0]);
    }
    // Of windows of 12 the first begin two places before the map, where there is nothing.
    let mut wide = with(&[("half", &[1, 6, 12, 12])], &mask).unwrap();
    wide.search().unwrap();
    assert_eq!(wide.mask((0, 4)).unwrap()[0], 0.0);
    assert_eq!(wide.mask((1, 1)).unwrap()[0], 2000.0);
    let wrong = |inputs: &[(&str, &[usize])], outputs: &[(&str, &[usize])], words: &str| {
        let error = with(inputs, outputs).err().unwrap().to_string();
        assert!(error.contains(words), "{error}");
    };
    wrong(&[("quarter", &[1, 6, 8, 8])], &mask, "its input `quarter` is no output of the other networks");
    wrong(&[("half", &[1, 7, 8, 8])], &mask, "its input `half` of [1, 7, 8, 8] is no part of [1, 6, 16, 16]");
    wrong(&[("half", &[1, 6, 17, 17])], &mask, "is no part of");
    wrong(&[("half", &[1, 6, 8, 7])], &mask, "is no part of");
    wrong(&[("half", &[6, 8, 8])], &mask, "is no part of");
    wrong(&parts, &[("mask", &[1, 8])], "answers 8 numbers, and no mask of 3 x 3");
    let unwanted = answering(&[]).with_masks(Some(told(&parts, &mask)), &self::config("")).unwrap_err().to_string();
    assert!(unwanted.contains("no `mask_side`"), "{unwanted}");
}

#[test]
fn features_of_a_search_and_what_its_head_correlates_are_refined_together() {
    let features: &[usize] = &[1, 4, 2, 2];
    let template = told(&[("template", SMALL)], &[("features", features)]);
    let search = told(&[("search", LARGE)], &[("features", features), ("half", &[1, 2, 16, 16])]);
    let outputs = [("scores", &[1, 1, 5, 5][..]), ("boxes", &[1, 4, 5, 5]), ("correlated", &[1, 3, 5, 5])];
    let head = told(&[("z", features), ("x", features)], &outputs);
    let refine = told(&[("half", &[1, 2, 8, 8]), ("correlated", &[1, 3, 1, 1])], &[("mask", &[1, 9])]);
    let network = OnnxSiamese::new(Some(template), search, Some(head), &config("").answer).unwrap();
    let mut network = network.with_masks(Some(refine), &config("mask_side = 3")).unwrap();
    network.search().unwrap();
    // Of `half` and of `correlated` the numbers of their outputs, the places 2, 2 and 1, 1.
    assert_eq!(network.mask((1, 1)).unwrap()[0], 1000.0 + 34.0 + 2000.0 + 6.0);
    assert!(network.notes().is_empty());
}
