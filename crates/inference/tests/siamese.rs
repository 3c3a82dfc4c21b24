//! Siamese tracking around the default network, and its parts by themselves.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_inference::InferenceError;
use pursuit_inference::nanotrack::{NanoTrackV3, Patch};
use pursuit_inference::siamese::{
    Answer, Cropper, Decoder, Exemplar, Fill, Location, Region, SiameseConfig, SiameseNetwork, SiameseParams,
    SiameseTracker, Sides, Ties,
};

const POINTS: usize = 225;

fn frame(width: usize, height: usize, pixel: impl Fn(usize, usize) -> Rgb8) -> Frame {
    Frame::new(0, 0.0, Image::from_fn(width, height, pixel).unwrap())
}

/// A striped square of 40 px on a smooth ground, its corner at (left, top).
fn scene(left: i64, top: i64) -> Frame {
    frame(320, 240, |x, y| {
        let (u, v) = (x as i64 - left, y as i64 - top);
        if (0..40).contains(&u) && (0..40).contains(&v) {
            [if u / 8 % 2 == 0 { 230 } else { 60 }, (v * 6) as u8, 40]
        } else {
            [(90 + x / 8) as u8, (100 + y / 6) as u8, (110 + (x + y) / 16) as u8]
        }
    })
}

fn tracker() -> SiameseTracker<NanoTrackV3> {
    let bbox = BBox::from_ltwh(100.0, 80.0, 40.0, 40.0);
    SiameseTracker::new(NanoTrackV3::new().unwrap(), SiameseConfig::nanotrack_v3(), &scene(100, 80), bbox).unwrap()
}

fn found(tracker: &mut SiameseTracker<NanoTrackV3>, frame: &Frame) -> Location {
    tracker.locate(frame, Point::new(120.0, 100.0), (40.0, 40.0)).unwrap().unwrap()
}

#[test]
fn a_target_that_moved_is_found_where_it_went() {
    let mut tracker = tracker();
    for (dx, dy) in [(0, 0), (12, -7), (-20, 15)] {
        let found = found(&mut tracker, &scene(100 + dx, 80 + dy));
        let truth = BBox::from_ltwh((100 + dx) as f64, (80 + dy) as f64, 40.0, 40.0);
        assert!(found.score > 0.9, "score {}", found.score);
        assert!(found.bbox.center().distance(truth.center()) < 3.0, "{:?} instead of {truth:?}", found.bbox);
        assert!((found.bbox.width() - 40.0).abs() < 4.0 && (found.bbox.height() - 40.0).abs() < 4.0);
        assert_eq!(tracker.scores().len(), POINTS);
        let best = tracker.scores().nth(found.point.0 * 15 + found.point.1).unwrap();
        assert_eq!(best, found.score);
    }
}

/// A network whose features are what a test says.
#[derive(Debug)]
struct Features(Vec<f32>);

impl SiameseNetwork for Features {
    fn sides(&self) -> Sides {
        Sides { template: 127, search: 255, answer: 15 }
    }

    fn write_row(&mut self, _: Patch, _: usize, _: [&[f32]; 3]) {}

    fn embed(&mut self) -> Result<Vec<f32>, InferenceError> {
        Ok(Vec::new())
    }

    fn set_template(&mut self, _: &[f32]) -> Result<(), InferenceError> {
        Ok(())
    }

    fn search(&mut self) -> Result<Answer<'_>, InferenceError> {
        Ok(Answer { scores: &[], distances: &[] })
    }

    fn search_features(&self) -> &[f32] {
        &self.0
    }
}

#[test]
fn an_embedding_is_the_mean_of_the_features_in_the_middle_of_a_box() {
    const SIDE: usize = 16;
    let feature = |i: usize| ((i * 37) % 101) as f32 / 50.0 - 0.7;
    let features: Vec<f32> = (0..3 * SIDE * SIDE).map(feature).collect();
    let (center, size) = (Point::new(160.0, 120.0), (40.0, 30.0));
    let bbox = BBox::from_center_size(center, size.0, size.1);
    let network = Features(features.clone());
    let tracker = SiameseTracker::new(network, SiameseConfig::nanotrack_v3(), &scene(0, 0), bbox).unwrap();
    let extent = tracker.search_extent(size).0;
    // Slowly: of many points of the box, the feature of the place that is nearest.
    let slow = |bbox: &BBox| {
        let (middle, n) = (bbox.scaled(0.75), 400);
        let place = |from_middle: f64| (((from_middle / extent + 0.5) * 255.0 - 0.5) / 16.0).round() as usize;
        let mut sums = [0.0; 3];
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let at = |k: usize, from: f64, side: f64| from + (k as f64 + 0.5) / n as f64 * side;
            let x = place(at(i, middle.left(), middle.width()) - center.x);
            let y = place(at(j, middle.top(), middle.height()) - center.y);
            (0..3).for_each(|c| sums[c] += f64::from(features[(c * SIDE + y) * SIDE + x]));
        }
        sums
    };
    let cosine = |a: [f64; 3], b: [f64; 3]| {
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    };
    let first = tracker.embedding_of(center, size, &bbox).unwrap();
    assert!(first.is_sound());
    assert!((tracker.likeness_of(&first, center, size, &bbox).unwrap() - 1.0).abs() < 1e-6);
    for other in [bbox.translated(9.0, -6.5), BBox::from_ltwh(110.0, 100.0, 70.0, 25.0), bbox.scaled(0.1)] {
        let (fast, slow) =
            (tracker.likeness_of(&first, center, size, &other).unwrap(), cosine(slow(&bbox), slow(&other)));
        assert!((fast - slow).abs() < 0.01, "{fast} for {slow}");
    }
    // Of a box beside what was searched nothing is known, nor of no box.
    assert_eq!(tracker.likeness_of(&first, center, size, &bbox.translated(300.0, 0.0)), None);
    assert_eq!(tracker.likeness_of(&first, center, size, &BBox::from_ltwh(f64::NAN, 0.0, 9.0, 9.0)), None);
    // A network that keeps no features has nothing to say.
    let silent = SiameseTracker::new(Features(Vec::new()), SiameseConfig::nanotrack_v3(), &scene(0, 0), bbox).unwrap();
    assert_eq!(silent.embedding_of(center, size, &bbox), None);
}

#[test]
fn the_target_looks_like_itself_wherever_it_is_and_the_ground_does_not() {
    let mut tracker = tracker();
    tracker.keep_features();
    let truth = BBox::from_ltwh(100.0, 80.0, 40.0, 40.0);
    let (center, size) = (truth.center(), (truth.width(), truth.height()));
    found(&mut tracker, &scene(100, 80));
    let first = tracker.embedding_of(center, size, &truth).unwrap();
    found(&mut tracker, &scene(112, 73));
    let moved = tracker.likeness_of(&first, center, size, &truth.translated(12.0, -7.0)).unwrap();
    found(&mut tracker, &scene(400, 73));
    let ground = tracker.likeness_of(&first, center, size, &truth.translated(12.0, -7.0)).unwrap();
    assert!(moved > 0.95 && ground < 0.8, "{moved} of the target, {ground} of the ground");
}

#[test]
fn a_search_changes_nothing_and_a_restored_tracker_is_the_same() {
    let mut tracker = tracker();
    let first = found(&mut tracker, &scene(108, 84));
    found(&mut tracker, &scene(60, 120));
    assert_eq!(found(&mut tracker, &scene(108, 84)), first);

    let saved = serde_json::to_string(tracker.exemplar()).unwrap();
    let exemplar: Exemplar = serde_json::from_str(&saved).unwrap();
    assert_eq!(exemplar.features.len(), NanoTrackV3::TEMPLATE_LEN);
    let (network, config) = (NanoTrackV3::new().unwrap(), SiameseConfig::nanotrack_v3());
    let mut restored = SiameseTracker::restore(network, config, exemplar).unwrap();
    assert_eq!(found(&mut restored, &scene(108, 84)), first);

    let short = Exemplar { features: vec![0.0; 7], fill: [0; 3] };
    let restored = SiameseTracker::restore(NanoTrackV3::new().unwrap(), SiameseConfig::nanotrack_v3(), short);
    assert!(matches!(restored, Err(InferenceError::Tensor { expected: 6144, actual: 7, .. })));
}

#[test]
fn a_search_allocates_nothing() {
    let mut tracker = tracker();
    let frame = scene(108, 84);
    let mut peaks = Vec::with_capacity(POINTS);
    found(&mut tracker, &frame);
    let counted = allocation_counter::measure(|| {
        let _ = found(&mut tracker, &frame);
        tracker.peaks(Point::new(120.0, 100.0), (40.0, 40.0), 0.05, &mut peaks);
    });
    assert_eq!(counted.count_total, 0);
    assert!(!peaks.is_empty());
}

fn pixels(planes: [&mut [f32]; 3]) -> Vec<[f32; 3]> {
    (0..planes[0].len()).map(|x| planes.each_ref().map(|plane| plane[x])).collect()
}

#[test]
fn what_is_outside_the_frame_has_the_mean_color() {
    let frame = frame(4, 2, |x, y| [10 * x as u8, 100 + y as u8, 7]);
    let region = Region::around(Point::new(2.0, 1.0), 6.0, Ties::Up);
    assert_eq!(region.ltwh(), (-1, -2, 6, 6));
    let mut rows = vec![Vec::new(); 6];
    Cropper::default().crop(frame.color(), region, 6, [1, 2, 3], |y, planes| rows[y] = pixels(planes));
    let fill = [1.0, 2.0, 3.0];
    for y in [0, 1, 4, 5] {
        assert_eq!(rows[y], [fill; 6], "row {y}");
    }
    let inside = |y: usize| (0..4).map(move |x| [10.0 * x as f32, 100.0 + y as f32, 7.0]);
    for y in 0..2 {
        let want: Vec<[f32; 3]> = [fill].into_iter().chain(inside(y)).chain([fill]).collect();
        assert_eq!(rows[y + 2], want);
    }
}

#[test]
fn the_mean_color_is_rounded_down_or_to_the_nearest() {
    // Means of 42.75, 7 and 128.5.
    let colors = [[42, 7, 128], [43, 7, 129], [43, 7, 128], [43, 7, 129]];
    let frame = frame(64, 64, |x, y| colors[x % 2 + 2 * (y % 2)]);
    let bbox = BBox::from_ltwh(20.0, 20.0, 20.0, 20.0);
    for (fill, want) in [(Fill::Mean, [42, 7, 128]), (Fill::NearestMean, [43, 7, 128]), (Fill::Black, [0; 3])] {
        let params = SiameseParams { fill, ..SiameseConfig::nanotrack_v3().into() };
        let config = SiameseConfig::try_from(params).unwrap();
        let tracker = SiameseTracker::new(NanoTrackV3::new().unwrap(), config, &frame, bbox).unwrap();
        assert_eq!(tracker.exemplar().fill, want, "{fill:?}");
    }
}

#[test]
fn regions_start_where_the_released_trackers_start_them() {
    for (center, side, want) in [
        (Point::new(10.0, 20.5), 5.0, (7, 18, 5)),
        (Point::new(10.0, 20.5), 4.0, (8, 18, 4)),
        (Point::new(0.2, -3.0), 6.5, (-3, -6, 6)),
        (Point::new(0.2, -3.0), 7.5, (-4, -7, 8)),
    ] {
        assert_eq!(
            {
                let (l, t, w, _) = Region::around(center, side, Ties::Up).ltwh();
                (l, t, w)
            },
            want,
            "{center:?}, {side}"
        );
    }
}

#[test]
fn resampling_is_bilinear_in_whole_grey_levels() {
    let frame = frame(4, 4, |x, y| [(60 * x) as u8, (60 * y) as u8, (15 * (x + 4 * y)) as u8]);
    let region = Region::around(Point::new(2.0, 2.0), 4.0, Ties::Up);
    assert_eq!(region.ltwh(), (0, 0, 4, 4));
    for samples in [2usize, 3, 7, 8] {
        Cropper::default().crop(frame.color(), region, samples, [0; 3], |y, planes| {
            for (x, pixel) in pixels(planes).into_iter().enumerate() {
                let at = |i: usize| ((i as f64 + 0.5) * 4.0 / samples as f64 - 0.5).clamp(0.0, 3.0);
                let want = [60.0 * at(x), 60.0 * at(y), 15.0 * (at(x) + 4.0 * at(y))];
                for c in 0..3 {
                    let error = f64::from(pixel[c]) - want[c];
                    assert!(error.abs() <= 1.0 && pixel[c].fract() == 0.0, "{samples}: {pixel:?} for {want:?}");
                }
            }
        });
    }
}

#[test]
fn resampling_gives_the_grey_levels_of_opencv() {
    // The last rows of `cv2.resize(image, (n, n))` of OpenCV 5.0, whose bilinear weights have eleven bits.
    let frame = frame(4, 4, |x, y| [(60 * x) as u8, (60 * y) as u8, (15 * (x + 4 * y)) as u8]);
    let of_three = [[10, 170, 172], [90, 170, 192], [170, 170, 212]];
    let of_seven = [
        [0, 180, 180],
        [21, 180, 185],
        [56, 180, 194],
        [90, 180, 202],
        [124, 180, 211],
        [158, 180, 220],
        [180, 180, 225],
    ];
    let region = Region::around(Point::new(2.0, 2.0), 4.0, Ties::Up);
    for want in [&of_three[..], &of_seven[..]] {
        let mut last = Vec::new();
        Cropper::default().crop(frame.color(), region, want.len(), [0; 3], |_, planes| last = pixels(planes));
        assert_eq!(last, want.iter().map(|p| p.map(|v: i32| v as f32)).collect::<Vec<_>>());
    }
}

/// An answer in which every point says "background" and a box of 20 × 20, but those named.
fn answer(targets: &[(usize, [f32; 2], [f32; 4])]) -> (Vec<f32>, Vec<f32>) {
    let (mut scores, mut distances) = (vec![0.0; 2 * POINTS], vec![10.0; 4 * POINTS]);
    scores[..POINTS].fill(20.0);
    for &(point, logits, edges) in targets {
        (0..2).for_each(|k| scores[k * POINTS + point] = logits[k]);
        (0..4).for_each(|k| distances[k * POINTS + point] = edges[k]);
    }
    (scores, distances)
}

#[test]
fn an_answer_is_decoded_by_the_released_trackers_equations() {
    let config = SiameseConfig::nanotrack_v3();
    let mut decoder = Decoder::new(config);
    let (width, height) = (50.0f64, 30.0);
    let extent = ((width + 40.0) * (height + 40.0)).sqrt();
    assert!((decoder.template_extent(width, height).0 - extent).abs() < 1e-9);
    assert!((decoder.search_extent(width, height).0 - extent * 255.0 / 127.0).abs() < 1e-9);

    // Row 6, column 9: 16 px above and 32 px right of the middle.
    let (scores, distances) = answer(&[(6 * 15 + 9, [0.0, 2.0], [40.0, 30.0, 60.0, 20.0])]);
    let found = decoder
        .locate(
            Answer { scores: &scores, distances: &distances },
            Point::new(200.0, 150.0),
            (width, height),
            Size::new(640, 480),
        )
        .unwrap();
    let scale = 127.0 / extent;
    let center = Point::new(200.0 + (32.0 + 10.0) / scale, 150.0 + (-16.0 - 5.0) / scale);
    assert_eq!(found.point, (6, 9));
    assert!(found.raw.center().distance(center) < 1e-9 && found.bbox.center().distance(center) < 1e-9);
    assert!((found.raw.width() - 100.0 / scale).abs() < 1e-9 && (found.raw.height() - 50.0 / scale).abs() < 1e-9);
    let score = 1.0 / (1.0 + (-2.0f64).exp());
    assert!((found.score - score).abs() < 1e-9);
    let side = |w: f64, h: f64| ((w + (w + h) / 2.0) * (h + (w + h) / 2.0)).sqrt();
    let grown = side(100.0, 50.0) / side(width * scale, height * scale);
    let ratio: f64 = (width / height) / 2.0;
    let penalty = (-(grown.max(1.0 / grown) * ratio.max(1.0 / ratio) - 1.0) * 0.138).exp();
    assert!((found.penalty - penalty).abs() < 1e-9);
    let rate = penalty * score * 0.348;
    assert!((found.bbox.width() - (width * (1.0 - rate) + 100.0 / scale * rate)).abs() < 1e-9);
    assert!((found.bbox.height() - (height * (1.0 - rate) + 50.0 / scale * rate)).abs() < 1e-9);
}

#[test]
fn boxes_stay_in_the_frame_and_the_window_prefers_the_middle() {
    let mut decoder = Decoder::new(SiameseConfig::nanotrack_v3());
    let edges = [60.0, 60.0, 60.0, 60.0];
    let (scores, distances) = answer(&[(7, [0.0, 3.0], edges), (7 * 15 + 7, [0.0, 2.5], edges)]);
    let both = Answer { scores: &scores, distances: &distances };
    let size = Size::new(64, 48);
    let found = decoder.locate(both, Point::new(60.0, 2.0), (60.0, 60.0), size).unwrap();
    assert_eq!(found.point, (7, 7));
    assert_eq!((found.bbox.center().x, found.bbox.center().y), (60.0, 2.0));
    assert_eq!(found.bbox.height(), 48.0);

    let mut open = Decoder::new(SiameseConfig::nanotrack_v3().with_weights(0.0, 0.138, 0.348).unwrap());
    let found = open.locate(both, Point::new(60.0, 2.0), (60.0, 60.0), size).unwrap();
    assert_eq!(found.point, (0, 7));
    assert_eq!(found.bbox.center().y, 0.0);

    let mut peaks = Vec::new();
    open.peaks(Point::new(60.0, 2.0), (60.0, 60.0), 0.5, &mut peaks);
    assert_eq!(peaks.len(), 2);
    assert!(peaks[0].score > peaks[1].score && (peaks[1].score - 1.0 / (1.0 + (-2.5f64).exp())).abs() < 1e-9);
    assert_eq!(peaks[1].bbox.center(), Point::new(60.0, 2.0));
}

#[test]
fn tiny_boxes_have_a_least_size_that_can_be_changed() {
    let (scores, distances) = answer(&[]);
    let size = Size::new(64, 48);
    for (config, least) in
        [(SiameseConfig::nanotrack_v3(), 10.0), (SiameseConfig::nanotrack_v3().with_min_side_px(3.0).unwrap(), 4.0)]
    {
        let answer = Answer { scores: &scores, distances: &distances };
        let found = Decoder::new(config).locate(answer, Point::new(9.0, 9.0), (4.0, 4.0), size).unwrap();
        assert!((found.bbox.width() - least).abs() < 0.01, "{}", found.bbox.width());
    }
}

#[test]
fn answers_that_are_no_numbers_are_no_location() {
    let mut decoder = Decoder::new(SiameseConfig::nanotrack_v3());
    let (mut scores, distances) = answer(&[]);
    let center = Point::new(30.0, 30.0);
    scores.fill(f32::NAN);
    let nothing = Answer { scores: &scores, distances: &distances };
    assert_eq!(decoder.locate(nothing, center, (20.0, 20.0), Size::new(64, 48)), None);
    let nothing = Answer { scores: &[], distances: &[] };
    assert_eq!(decoder.locate(nothing, center, (20.0, 20.0), Size::new(64, 48)), None);
}

#[test]
fn boxes_that_cannot_be_followed_are_refused() {
    let mut tracker = tracker();
    for size in [(0.0, 10.0), (f64::NAN, 10.0), (f64::INFINITY, 10.0)] {
        let found = tracker.locate(&scene(0, 0), Point::new(5.0, 5.0), size);
        assert!(matches!(found, Err(InferenceError::Box { .. })), "{size:?}");
    }
    // Far outside the frame, or as large as a world, there is still an answer.
    assert!(tracker.locate(&scene(0, 0), Point::new(-1e7, 1e9), (40.0, 1e9)).unwrap().is_some());
    let (network, config) = (NanoTrackV3::new().unwrap(), SiameseConfig::nanotrack_v3());
    let empty = SiameseTracker::new(network, config, &scene(0, 0), BBox::from_ltwh(1.0, 1.0, 0.0, 5.0));
    assert!(matches!(empty.err(), Some(InferenceError::Box { .. })));
}

const FEAR: &str = r#"
template_side_px = 128
search_side_px = 256
answer_side = 16
stride_px = 16.0
channels = "rgb"
mean = [123.675, 116.28, 103.53]
scores = "sigmoid"
context = 0.2
window = 0.38
penalty = 0.062
rate = 0.765
"#;

#[test]
fn configurations_are_read_from_toml_and_checked() {
    let config: SiameseConfig = toml::from_str(FEAR).unwrap();
    assert_eq!((config.template_side_px, config.search_side_px, config.answer_side), (128, 256, 16));
    assert_eq!(config.deviation, [1.0; 3]);
    assert_eq!(config.min_side_px, 10.0);
    assert_eq!(toml::from_str::<SiameseConfig>(&toml::to_string(&config).unwrap()).unwrap(), config);
    for (from, to, name) in [
        ("answer_side = 16", "answer_side = 2", "answer_side"),
        ("answer_side = 16", "answer_side = 129", "answer_side"),
        ("search_side_px = 256", "search_side_px = 127", "search_side_px"),
        ("template_side_px = 128", "template_side_px = 0", "template_side_px"),
        ("stride_px = 16.0", "stride_px = 0.0", "stride_px"),
        ("window = 0.38", "window = 1.1", "window"),
        ("penalty = 0.062", "penalty = -1.0", "penalty"),
        ("rate = 0.765", "rate = nan", "rate"),
        ("context = 0.2", "context = 4.5", "context"),
        ("mean = [123.675,", "mean = [inf,", "mean"),
        ("rate = 0.765", "rate = 0.5\ndeviation = [1.0, 0.0, 1.0]", "deviation"),
        ("rate = 0.765", "rate = 0.5\ntemplate_shift_px = 3.0", "template_shift_px"),
        ("rate = 0.765", "rate = 0.5\nmin_side_px = 0.0", "min_side_px"),
        ("rate = 0.765", "rate = 0.5\nspeed = 1.0", "speed"),
    ] {
        let error = toml::from_str::<SiameseConfig>(&FEAR.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(name), "{to}: {error}");
    }
    // The network's sides are not these.
    let bbox = BBox::from_ltwh(1.0, 1.0, 9.0, 9.0);
    let wrong = SiameseTracker::new(NanoTrackV3::new().unwrap(), config, &scene(0, 0), bbox);
    assert!(matches!(wrong.err(), Some(InferenceError::Config(error)) if error.name == "template_side_px"));
}
