//! Siamese networks that answer otherwise than NanoTrack: anchors, centres, windows that are stretched, one file for both images.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod told;

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_inference::nanotrack::Patch;
use pursuit_inference::onnx::OnnxSiamese;
use pursuit_inference::siamese::{
    Answer, AnswerCoding, Decoder, Region, SiameseConfig, SiameseDescription, SiameseNetwork, SiameseParams,
    SiameseTracker, Sides,
};
use pursuit_inference::{Network, Result};

const FRAME: Size = Size::new(640, 480);

fn config(text: &str) -> SiameseConfig {
    let rest = "template_side_px = 127\nsearch_side_px = 255\nchannels = 'bgr'\nwindow = 0.0\n";
    toml::from_str(&format!("{rest}{text}")).unwrap()
}

fn near(a: BBox, b: BBox, most: f64) {
    let ((l, t, w, h), (x, y, u, v)) = (a.ltwh(), b.ltwh());
    let worst = [l - x, t - y, w - u, h - v].iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    assert!(worst <= most, "{a} {b}");
}

#[test]
fn anchors_are_decoded_as_pysot_does() {
    let text = "answer_side = 5\nstride_px = 8.0\nscores = 'softmax'\ncontext = 0.5\npenalty = 0.0\nrate = 1.0\n\
                answer = { anchors = { ratios = [0.33, 1.0, 3.0], scales = [8.0] } }";
    let config = config(text);
    assert_eq!(config.answer.anchors(), 3);
    let mut decoder = Decoder::new(config);
    // pysot/utils/anchor.py for stride 8, ratios .33, 1, 3, scale 8: 104 x 32, 64 x 64, 32 x 96.
    let (cells, kinds) = (25, 3);
    let (mut scores, mut boxes) = (vec![0f32; 2 * kinds * cells], vec![0f32; 4 * kinds * cells]);
    // Row 1, column 3 of the anchor of ratio 3 is the target, the anchor of ratio 1 there next to it.
    let (cell, kind) = (5 + 3, 2);
    scores[(kinds + kind) * cells + cell] = 4.0;
    scores[(kinds + 1) * cells + cell] = 3.0;
    for (plane, delta) in [(0, 0.25f32), (1, -0.5), (2, 0.1), (3, -0.2)] {
        boxes[(plane * kinds + kind) * cells + cell] = delta;
    }
    let size = (40.0, 60.0);
    let side = ((size.0 + 50.0) * (size.1 + 50.0f64)).sqrt() * 255.0 / 127.0;
    let scale = 255.0 / side;
    let found =
        decoder.locate(Answer { scores: &scores, distances: &boxes }, Point::new(300.0, 200.0), size, FRAME).unwrap();
    let (x, y) = (8.0 + 0.25 * 32.0, -8.0 - 0.5 * 96.0);
    let expected = BBox::from_center_size(
        Point::new(300.0 + x / scale, 200.0 + y / scale),
        32.0 * 0.1f64.exp() / scale,
        96.0 * (-0.2f64).exp() / scale,
    );
    near(found.raw, expected, 1e-4);
    assert!((found.score - 1.0 / (1.0 + (-4f64).exp())).abs() < 1e-6);
    assert_eq!(found.point, (1, 3));
}

#[test]
fn centres_are_decoded_as_vittrack_does() {
    let text = "answer_side = 4\nstride_px = 63.75\nscores = 'probability'\ncontext = 0.0\nextent = 2.0\npenalty = 0.0\n\
                rate = 1.0\nanswer = 'centres'";
    let mut decoder = Decoder::new(config(text));
    let cells = 16;
    let (mut scores, mut boxes) = (vec![0.1f32; cells], vec![0f32; 4 * cells]);
    let cell = 2 * 4 + 1;
    scores[cell] = 0.9;
    for (plane, value) in [(0, 0.25f32), (1, 0.5), (2, 0.75), (3, 0.25)] {
        boxes[plane * cells + cell] = value;
    }
    let size = (80.0, 20.0);
    // The template covers 2 √(wh), the search as much more as its image is larger: both over the side of the search.
    let side = 2.0 * 40.0 * 255.0 / 127.0;
    assert!((decoder.search_extent(size.0, size.1).0 - side).abs() < 1e-9);
    let found =
        decoder.locate(Answer { scores: &scores, distances: &boxes }, Point::new(300.0, 200.0), size, FRAME).unwrap();
    let middle = Point::new(300.0 + ((1.0 + 0.75) / 4.0 - 0.5) * side, 200.0 + ((2.0 + 0.25) / 4.0 - 0.5) * side);
    near(found.raw, BBox::from_center_size(middle, 0.25 * side, 0.5 * side), 1e-6);
    assert!((found.score - 0.9).abs() < 1e-6);
}

#[test]
fn stretched_windows_keep_the_targets_place_and_size_whatever_its_shape() {
    let config = SiameseConfig::fear_xs();
    let mut decoder = Decoder::new(config);
    assert_eq!(decoder.template_extent(30.0, 100.0), (30.0 * 1.4, 100.0 * 1.4));
    assert_eq!(decoder.search_extent(30.0, 100.0), (150.0, 500.0));
    assert_eq!(Region::stretched(Point::new(50.5, 60.0), (151.0, 500.9)).ltwh(), (-25, -191, 151, 500));
    // The middle point says that the target fills a fifth of the image, where it was.
    let cells = 256;
    let (mut scores, mut distances) = (vec![-9f32; cells], vec![1f32; 4 * cells]);
    scores[8 * 16 + 8] = 9.0;
    (0..4).for_each(|plane| distances[plane * cells + 8 * 16 + 8] = 25.6);
    let found = decoder.locate(
        Answer { scores: &scores, distances: &distances },
        Point::new(320.0, 240.0),
        (30.0, 100.0),
        FRAME,
    );
    near(found.unwrap().bbox, BBox::from_center_size(Point::new(320.0, 240.0), 30.0, 100.0), 1e-4);
}

#[test]
fn a_search_window_may_be_larger_than_the_images_say() {
    // OSTrack of 384 pixels: a template of twice, and a search of five times the root of the area.
    let one_stream = SiameseParams::from(SiameseConfig::one_stream());
    let config = SiameseParams { template_side_px: 192, search_side_px: 384, search_extent: 1.25, ..one_stream };
    let decoder = Decoder::new(config.try_into().unwrap());
    assert_eq!(decoder.template_extent(40.0, 30.0), (70.0, 70.0));
    assert_eq!(decoder.search_extent(40.0, 30.0), (174.0, 174.0));
}

/// SiamFC in small: the response is how like the template's pixels a part of the search image is.
#[derive(Clone)]
struct Alike {
    template: Vec<f32>,
    search: Vec<f32>,
    known: Vec<f32>,
    scores: Vec<f32>,
}

impl Alike {
    const TEMPLATE: usize = 16;
    const SEARCH: usize = 32;
    const ANSWER: usize = 17;

    fn new() -> Self {
        let blank = |side: usize| vec![0.0; 3 * side * side];
        let template = blank(Self::TEMPLATE);
        Self {
            known: template.clone(),
            template,
            search: blank(Self::SEARCH),
            scores: vec![0.0; Self::ANSWER * Self::ANSWER],
        }
    }
}

impl SiameseNetwork for Alike {
    fn sides(&self) -> Sides {
        Sides { template: Self::TEMPLATE, search: Self::SEARCH, answer: Self::ANSWER }
    }
    fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        let (image, side) = match patch {
            Patch::Template => (&mut self.template, Self::TEMPLATE),
            Patch::Search => (&mut self.search, Self::SEARCH),
        };
        for (c, plane) in planes.into_iter().enumerate() {
            image[(c * side + y) * side..][..side].copy_from_slice(plane);
        }
    }
    fn embed(&mut self) -> Result<Vec<f32>> {
        Ok(self.template.clone())
    }
    fn set_template(&mut self, features: &[f32]) -> Result<()> {
        self.known.copy_from_slice(features);
        Ok(())
    }
    fn search(&mut self) -> Result<Answer<'_>> {
        for (i, score) in self.scores.iter_mut().enumerate() {
            let (top, left) = (i / Self::ANSWER, i % Self::ANSWER);
            let difference = |k: usize| {
                let (c, y, x) = (k / 256, k / 16 % 16, k % 16);
                (self.known[k] - self.search[(c * Self::SEARCH + top + y) * Self::SEARCH + left + x]).abs()
            };
            *score = 3.0 - (0..768).map(difference).sum::<f32>() / 768.0 / 10.0;
        }
        Ok(Answer { scores: &self.scores, distances: &[] })
    }
}

#[test]
fn a_network_that_scores_alone_is_asked_at_several_scales() {
    let text = "template_side_px = 16\nsearch_side_px = 32\nanswer_side = 17\nstride_px = 1.0\nchannels = 'rgb'\nwindow = 0.1\n\
                scores = 'sigmoid'\ncontext = 0.0\npenalty = 0.2\nrate = 0.6\nmin_side_px = 2.0\n\
                answer = { scores = { step = 1.1, scales = 3, enlarged = 8 } }";
    let config: SiameseConfig = toml::from_str(text).unwrap();
    assert_eq!(Decoder::new(config.clone()).begin_scales().count(), 3);
    // A target of 48 px with a smooth picture of its own, at `middle`, `times` as large.
    let frame = |middle: Point, times: f64| {
        let pixel = |x: usize, y: usize| {
            let (u, v) = ((x as f64 - middle.x) / times, (y as f64 - middle.y) / times);
            let inside = u.abs() < 24.0 && v.abs() < 24.0;
            let wave = |a: f64, b: f64| (128.0 + 120.0 * (a * u).sin() * (b * v).cos()) as u8;
            if inside { [wave(0.11, 0.17), wave(0.23, 0.07), wave(0.05, 0.29)] } else { [40, 90, 60] }
        };
        Frame::new(0, 0.0, Image::from_fn(240, 200, pixel).unwrap())
    };
    let start = Point::new(100.0, 90.0);
    let bbox = BBox::from_center_size(start, 48.0, 48.0);
    let mut tracker = SiameseTracker::new(Alike::new(), config, &frame(start, 1.0), bbox).unwrap();
    for (to, times) in [(start, 1.0), (Point::new(112.0, 81.0), 1.0), (Point::new(93.0, 99.0), 1.1), (start, 1.0 / 1.1)]
    {
        let found = tracker.locate(&frame(to, times), start, (48.0, 48.0)).unwrap().unwrap();
        assert!(found.bbox.center().distance(to) < 1.5, "{to:?}, {times}: {found:?}");
        assert!((found.raw.width() - 48.0 * times).abs() < 1e-9, "{times}: {found:?}");
        assert!((found.bbox.width() - 48.0 * (0.4 + 0.6 * times)).abs() < 1e-9, "{times}: {found:?}");
        assert!(found.score > 0.8 && found.score < 0.96, "{found:?}");
        let mut peaks = Vec::new();
        tracker.peaks(start, (48.0, 48.0), 0.8, &mut peaks);
        assert!(peaks[0].bbox.center().distance(to) < 4.0, "{peaks:?}");
    }
    // Gone: nothing is like it.
    let empty = Frame::new(0, 0.0, Image::filled(240, 200, [250, 5, 250]).unwrap());
    assert!(tracker.locate(&empty, start, (48.0, 48.0)).unwrap().unwrap().score < 0.05);
    let counted = allocation_counter::measure(|| {
        let _ = tracker.locate(&empty, start, (48.0, 48.0));
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn senseless_layouts_are_refused() {
    let wrong = |text: &str, words: &str| {
        let rest = "template_side_px = 127\nsearch_side_px = 255\nchannels = 'bgr'\nwindow = 0.0\nanswer_side = 5\nstride_px = 8.0\n\
                    scores = 'softmax'\ncontext = 0.5\npenalty = 0.0\nrate = 1.0\n";
        let error = toml::from_str::<SiameseConfig>(&format!("{rest}{text}")).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    wrong("answer = { anchors = { ratios = [], scales = [8.0] } }", "1 to 64 anchors");
    wrong("answer = { anchors = { ratios = [1.0, 0.0], scales = [8.0] } }", "positive ratios");
    wrong("answer = 'corners'", "corners");
    for senseless in [
        "step = 1.0, scales = 3, enlarged = 16",
        "step = 1.04, scales = 2, enlarged = 16",
        "step = 1.04, scales = 3, enlarged = 0",
    ] {
        wrong(&format!("answer = {{ scores = {{ {senseless} }} }}"), "an odd number of scales");
    }
    let large = "answer = { scores = { step = 1.04, scales = 3, enlarged = 32 } }";
    let config = |side: usize| {
        let rest = "template_side_px = 127\nsearch_side_px = 255\nchannels = 'bgr'\nwindow = 0.0\nstride_px = 8.0\nscores = 'sigmoid'\n\
                    context = 0.5\npenalty = 0.0\nrate = 1.0\n";
        toml::from_str::<SiameseConfig>(&format!("{rest}answer_side = {side}\n{large}"))
    };
    assert!(config(32).is_ok() && config(33).unwrap_err().to_string().contains("at most 1024"));
    wrong("extent = 0.0", "`extent`");
    wrong("search_context = -1.0", "`search_context`");
}

#[test]
fn descriptions_name_files_beside_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let config = toml::to_string(&SiameseConfig::fear_xs()).unwrap();
    std::fs::write(&path, format!("template = 'a.onnx'\nsearch = '/b.onnx'\n[config]\n{config}")).unwrap();
    let read = SiameseDescription::read(&path).unwrap();
    assert_eq!(read.template.unwrap(), folder.path().join("a.onnx"));
    assert_eq!((read.search, read.head, read.config), ("/b.onnx".into(), None, SiameseConfig::fear_xs()));
    let message = |text: &[u8]| {
        std::fs::write(&path, text).unwrap();
        SiameseDescription::read(&path).unwrap_err().to_string()
    };
    assert!(message(b"search = 'a'\n\nhed = 'b'").contains("line 3: unknown field `hed`"));
    assert!(message(b"search = 'a'\n[config]\ntemplate_side_px = 127").contains("`config` lacks `search_side_px`"));
    assert!(message(&[0xff; 8]).contains("no text"));
    assert!(message(&vec![b'#'; (1 << 20) + 1]).contains("too long"));
    assert!(SiameseDescription::read(&folder.path().join("none.toml")).unwrap_err().to_string().contains("none.toml"));
}

/// Takes tensors of given shapes; all numbers of an answer are alike.
fn told(inputs: &[&[usize]], outputs: &[&[usize]]) -> Box<dyn Network> {
    told::told(&named(inputs), &named(outputs), |output, _| output)
}

fn named<'a>(shapes: &[&'a [usize]]) -> Vec<told::Named<'a>> {
    ["first", "second", "third"].into_iter().zip(shapes.iter().copied()).collect()
}

#[test]
fn networks_are_put_together_by_their_shapes() {
    const SMALL: &[usize] = &[1, 3, 8, 8];
    const LARGE: &[usize] = &[1, 3, 16, 16];
    const FEATURES: &[usize] = &[1, 4, 2, 2];
    let n = |planes: usize| [1, planes, 5, 5];
    // One file with both images, the template second; sizes before offsets.
    let both = told(&[LARGE, SMALL], &[&n(2), &n(1), &n(2)]);
    let mut one = OnnxSiamese::new(None, both, None, &AnswerCoding::Centres).unwrap();
    assert_eq!((one.sides().template, one.sides().search, one.sides().answer), (8, 16, 5));
    one.write_row(Patch::Template, 0, [&[7.0; 8]; 3]);
    let features = one.embed().unwrap();
    assert_eq!((features.len(), features[0]), (3 * 64, 7.0));
    one.set_template(&features).unwrap();
    assert!(one.set_template(&features[1..]).is_err());
    one.write_row(Patch::Search, 0, [&[5.0; 16]; 3]);
    // A clone shares the session and not the images.
    let mut other = one.clone();
    other.write_row(Patch::Search, 0, [&[1.0; 16]; 3]);
    let answer = one.search().unwrap();
    assert_eq!((answer.scores[0], answer.distances[0], answer.distances[50]), (13.0, 12.0, 14.0));
    assert_eq!(other.search().unwrap().scores[0], 9.0);
    assert_eq!(one.search().unwrap().scores[0], 13.0);

    let anchors = AnswerCoding::Anchors { ratios: vec![0.5, 2.0], scales: vec![8.0] };
    let three = |coding: &AnswerCoding, outputs: &[&[usize]]| {
        let template = told(&[SMALL], &[FEATURES]);
        let search = told(&[LARGE], &[FEATURES]);
        OnnxSiamese::new(Some(template), search, Some(told(&[FEATURES, FEATURES], outputs)), coding)
    };
    // Four planes are the scores of two anchors here, and the box of one point there.
    assert!(three(&anchors, &[&n(4), &n(8)]).is_ok());
    assert!(three(&anchors, &[&n(2), &n(8)]).is_ok());
    assert!(three(&AnswerCoding::Distances, &[&n(4), &n(2)]).is_ok());
    let scores = AnswerCoding::Scores { step: 1.0375, scales: 3, enlarged: 16 };
    assert!(three(&scores, &[&n(1)]).is_ok());
    for (coding, outputs) in [
        (&anchors, vec![n(4), n(2)]),
        (&AnswerCoding::Distances, vec![n(4)]),
        (&AnswerCoding::Centres, vec![n(1), n(2)]),
        (&AnswerCoding::Distances, vec![n(4), [1, 2, 6, 6]]),
        (&scores, vec![n(2)]),
    ] {
        let outputs: Vec<&[usize]> = outputs.iter().map(|o| &o[..]).collect();
        let error = three(coding, &outputs).unwrap_err().to_string();
        assert!(error.contains("no scores and boxes of that layout") && error.contains("description"), "{error}");
    }
    let error = OnnxSiamese::new(
        Some(told(&[SMALL], &[FEATURES])),
        told(&[LARGE, SMALL], &[&n(4), &n(1)]),
        None,
        &AnswerCoding::Distances,
    );
    assert!(error.unwrap_err().to_string().contains("features that the template's network gives"));
}

#[test]
fn a_tracker_goes_through_a_network_of_any_layout() {
    let text = "template_side_px = 8\nsearch_side_px = 16\nanswer_side = 5\nstride_px = 3.2\nchannels = 'rgb'\nwindow = 0.5\n\
                scores = 'probability'\ncontext = 0.0\nextent = 2.0\npenalty = 0.0\nrate = 1.0\nanswer = 'centres'";
    let config: SiameseConfig = toml::from_str(text).unwrap();
    let n = |planes: usize| [1, planes, 5, 5];
    let both = told(&[&[1, 3, 8, 8], &[1, 3, 16, 16]], &[&n(1), &n(2), &n(2)]);
    let network = OnnxSiamese::new(None, both, None, &config.answer).unwrap();
    let frame = Frame::new(0, 0.0, Image::filled(64, 48, [0, 0, 0]).unwrap());
    let mut tracker = SiameseTracker::new(network, config, &frame, BBox::from_ltwh(20.0, 20.0, 8.0, 8.0)).unwrap();
    let found = tracker.locate(&frame, Point::new(24.0, 24.0), (8.0, 8.0)).unwrap().unwrap();
    // Black images add nothing: scores 0, sizes 1, offsets 2; the window prefers the middle point, 2 cells on.
    assert_eq!(found.point, (2, 2));
    let side = 2.0 * 8.0 * 16.0 / 8.0;
    let middle = 24.0 + ((2.0 + 2.0) * 3.2 / 16.0 - 0.5) * side;
    near(found.raw, BBox::from_center_size(Point::new(middle, middle), side, side), 1e-6);
}
