//! The cascade and its learning again, slow and obvious: pixel by pixel, window by window.

use super::cascade::{Candidate, Cascade, Knowledge, Place};
use super::cells::SIDE;
use super::ferns::Ferns;
use super::grid::Grid;
use super::learning::{Learner, Scratch};
use super::params::{LearningParams, TldParams};
use crate::appearance::{ObjectModel, PatchSampler, SimilarityForm};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Image, ImageView};
use pursuit_testkit::Noise;

const COMPARISONS: usize = 13;

/// Mean of the pixels of rows `[top, bottom)` and columns `[left, right)`.
fn mean(gray: ImageView<'_, u8>, (left, right): (usize, usize), (top, bottom): (usize, usize)) -> f64 {
    let sum: f64 = (top..bottom).flat_map(|y| &gray.row(y)[left..right]).map(|&v| f64::from(v)).sum();
    sum / ((right - left) * (bottom - top)) as f64
}

/// The pixels within `radius` of `center`, of `n`.
fn about(center: f64, radius: f64, n: usize) -> (usize, usize) {
    let first = ((center - radius).clamp(0.0, n as f64 - 1.0) + 0.5).floor().min(n as f64 - 1.0) as usize;
    let end = ((center + radius).clamp(0.0, n as f64) + 0.5).floor() as usize;
    (first, end.max(first + 1))
}

/// Grey of cell `cell` of `window`.
fn cell(gray: ImageView<'_, u8>, window: &BBox, smooth: f64, cell: u16) -> u8 {
    let (x, y) = (usize::from(cell) % SIDE, usize::from(cell) / SIDE);
    let along = |from: f64, length: f64, i: usize, n: usize| {
        let side = length / SIDE as f64;
        about(from + (i as f64 + 0.5) * side, side.max(smooth), n)
    };
    let columns = along(window.left(), window.width(), x, gray.size().width);
    let rows = along(window.top(), window.height(), y, gray.size().height);
    (mean(gray, columns, rows) + 0.5) as u8
}

/// Variance of the pixels under `window`, whose sides are whole.
fn variance(gray: ImageView<'_, u8>, window: &BBox) -> f64 {
    let span = |from: f64, length: f64| (from.round() as usize, from.round() as usize + length as usize);
    let (columns, rows) = (span(window.left(), window.width()), span(window.top(), window.height()));
    let values = || (rows.0..rows.1).flat_map(|y| &gray.row(y)[columns.0..columns.1]).map(|&v| f64::from(v));
    let mean = mean(gray, columns, rows);
    values().map(|v| (v - mean).powi(2)).sum::<f64>() / values().count() as f64
}

/// The outcome of every fern for `window`.
fn outcomes(gray: ImageView<'_, u8>, ferns: &Ferns, window: &BBox, smooth: f64) -> Vec<usize> {
    let fern = |(f, pairs): (usize, &[(u16, u16)])| {
        let bit = |(a, b): &(u16, u16)| usize::from(cell(gray, window, smooth, *a) > cell(gray, window, smooth, *b));
        (f << COMPARISONS) | pairs.iter().fold(0, |bits, pair| 2 * bits + bit(pair))
    };
    ferns.pairs.chunks_exact(COMPARISONS).enumerate().map(fern).collect()
}

/// The mean posterior of these outcomes, by counts.
fn posterior(seen: &[(u16, u16)], outcomes: &[usize]) -> f64 {
    let share = |&o: &usize| {
        let (p, n) = (f64::from(seen[o].0), f64::from(seen[o].1));
        if p + n > 0.0 { p / (p + n) } else { 0.0 }
    };
    outcomes.iter().map(share).sum::<f64>() / outcomes.len() as f64
}

fn windows(grid: &Grid) -> impl Iterator<Item = BBox> + '_ {
    (0..grid.windows()).filter_map(|i| grid.window(i))
}

fn scene(seed: u32) -> Image<u8> {
    let mut numbers = Noise::new(seed | 1);
    let mut noise = || u32::from(numbers.byte());
    let coarse: Vec<u32> = (0..24 * 20).map(|_| noise()).collect();
    // Flat on the right, where no window varies enough.
    Image::from_fn(96, 80, |x, y| if x > 70 { 90 } else { (3 * coarse[y / 4 * 24 + x / 4] / 4 + noise() / 8) as u8 })
        .unwrap()
}

fn params() -> TldParams {
    let learning = LearningParams { first_warps: 0, warps: 0, first_negatives: 40, ..LearningParams::default() };
    TldParams { learning, ..TldParams::default() }
}

const TARGET: (f64, f64, f64, f64) = (20.0, 16.0, 24.0, 22.0);

struct Taught {
    params: TldParams,
    grid: Grid,
    ferns: Ferns,
    model: ObjectModel,
    least_variance: f64,
    cascade: Cascade,
    random: u64,
}

impl Taught {
    fn new(gray: ImageView<'_, u8>, params: TldParams) -> Self {
        let target = BBox::from_ltwh(TARGET.0, TARGET.1, TARGET.2, TARGET.3);
        let grid = Grid::new(Size::new(96, 80), (TARGET.2, TARGET.3), &params.scan);
        let mut random = 3;
        let ferns = Ferns::new(&params.ferns, &mut random);
        let side = params.neighbor.side;
        let model = ObjectModel::new(side * side, params.neighbor.capacity, random);
        let least_variance = params.ferns.variance * variance(gray, &target);
        let cascade = Cascade::default();
        let mut taught = Self { params, grid, ferns, model, least_variance, cascade, random };
        taught.learn(|learner, cascade| learner.bootstrap(cascade, gray, &target));
        taught
    }

    fn learn(&mut self, act: impl FnOnce(&mut Learner<'_>, &mut Cascade)) {
        let mut learner = Learner {
            params: &self.params,
            grid: &self.grid,
            ferns: &mut self.ferns,
            model: &mut self.model,
            least_variance: self.least_variance,
            random: &mut self.random,
            scratch: &mut Scratch::default(),
        };
        act(&mut learner, &mut self.cascade);
    }

    fn scan(&mut self, gray: ImageView<'_, u8>) {
        let Self { params, grid, ferns, model, least_variance, cascade, .. } = self;
        let known = Knowledge { params, grid, ferns, model, least_variance: *least_variance };
        let whole = Place { region: gray.size().bounds(), expected: gray.size().bounds(), turn: None };
        cascade.scan(gray, &known, &whole, usize::MAX);
        cascade.judge(gray, &known);
    }
}

#[test]
fn a_scan_finds_what_its_twin_finds() {
    let image = scene(5);
    let mut taught = Taught::new(image.view(), TldParams::default());
    // Lit otherwise: ferns and correlation do not mind light.
    let other = Image::from_fn(96, 80, |x, y| image.row(y)[x].saturating_add(9)).unwrap();
    let gray = other.view();
    taught.scan(gray);
    let smooth = taught.params.ferns.smooth_px;
    let (mut varied, mut passed, mut twin) = (0, 0, Vec::new());
    for window in windows(&taught.grid) {
        if variance(gray, &window) < taught.least_variance {
            continue;
        }
        varied += 1;
        if posterior(&taught.ferns.seen, &outcomes(gray, &taught.ferns, &window, smooth))
            > taught.params.ferns.posterior
        {
            passed += 1;
            twin.push(window);
        }
    }
    let all = taught.grid.windows();
    assert_eq!(taught.cascade.windows(), all);
    assert!(varied < 9 * all / 10 && varied > all / 4 && passed > 3, "{passed} of {varied} of {all}");
    let found: Vec<BBox> = taught.cascade.candidates().iter().map(|c| c.window).collect();
    // Cell centres that fall on a half pixel may be rounded either way: a comparison or two of 130.
    let common = twin.iter().filter(|w| found.contains(w)).count();
    assert!(common * 20 >= 19 * twin.len().max(found.len()), "{common} of {} and {}", twin.len(), found.len());
    judged_as_by_the_twin(&taught, gray);
}

/// Similarities by correlation coefficients in double precision, and the order by them.
fn judged_as_by_the_twin(taught: &Taught, gray: ImageView<'_, u8>) {
    let mut patch = Vec::new();
    let relative = |c: &Candidate| c.similarity.relative(SimilarityForm::Distance);
    for pair in taught.cascade.candidates().windows(2) {
        assert!(relative(&pair[0]) >= relative(&pair[1]));
    }
    for candidate in taught.cascade.candidates() {
        PatchSampler::default().sample(gray, &candidate.window, taught.params.neighbor.side, &mut patch);
        let n = patch.len() as f64;
        let mean = patch.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
        let norm = patch.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>().sqrt();
        let unit: Vec<f32> = patch.iter().map(|v| ((f64::from(*v) - mean) / norm) as f32).collect();
        let twin = taught.model.resemblance(&unit).similarity;
        assert!((twin.positive - candidate.similarity.positive).abs() < 1e-5);
        assert!((twin.negative - candidate.similarity.negative).abs() < 1e-5);
    }
}

/// The windows of the whole grid that overlap the target most, the nearest first.
fn nearest(grid: &Grid, bbox: &BBox, l: &LearningParams) -> Vec<BBox> {
    let mut near: Vec<BBox> = windows(grid).filter(|w| w.iou(bbox) > l.near_overlap).collect();
    near.sort_by(|a, b| b.iou(bbox).total_cmp(&a.iou(bbox)).then(a.width().total_cmp(&b.width())));
    near.truncate(l.closest);
    near
}

#[test]
fn learning_counts_as_its_twin_does() {
    let image = scene(9);
    let gray = image.view();
    let mut taught = Taught::new(gray, params());
    // A target elsewhere: positives are not known yet, and what passed at the old place is now wrong.
    taught.scan(gray);
    let old: Vec<BBox> = taught.cascade.candidates().iter().map(|c| c.window).collect();
    let moved = BBox::from_ltwh(38.3, 45.1, 25.0, 23.0);
    let (smooth, threshold) = (taught.params.ferns.smooth_px, taught.params.ferns.posterior);
    let mut seen = taught.ferns.seen.clone();
    for window in nearest(&taught.grid, &moved, &taught.params.learning) {
        let outcomes = outcomes(gray, &taught.ferns, &window, smooth);
        if posterior(&seen, &outcomes) <= threshold {
            outcomes.iter().for_each(|&o| seen[o].0 += 1);
        }
    }
    let positives: u32 = seen.iter().map(|s| u32::from(s.0)).sum();
    let far = |w: &&BBox| w.iou(&moved) < taught.params.learning.negative_overlap;
    for window in old.iter().filter(far) {
        let outcomes = outcomes(gray, &taught.ferns, window, smooth);
        if posterior(&seen, &outcomes) >= threshold {
            outcomes.iter().for_each(|&o| seen[o].1 += 1);
        }
    }
    let before = taught.ferns.seen.clone();
    let patches = taught.model.len();
    let sum = |seen: &[(u16, u16)], f: fn(&(u16, u16)) -> u16| seen.iter().map(|s| i64::from(f(s))).sum::<i64>();
    // The box must look like the target for the learner to believe it: drift is not learned.
    taught.learn(|learner, cascade| learner.update(cascade, gray, &moved));
    assert_eq!(
        (&taught.ferns.seen, taught.model.len()),
        (&before, patches),
        "what looks unlike the target teaches nothing"
    );
    let lax = LearningParams { least_similarity: 0.0, least_conservative: 0.0, ..taught.params.learning.clone() };
    taught.params.learning = lax;
    taught.least_variance = 0.0;
    taught.scan(gray);
    taught.learn(|learner, cascade| learner.update(cascade, gray, &moved));
    let after = &taught.ferns.seen;
    assert!(i64::from(positives) > sum(&before, |s| s.0) && sum(&seen, |s| s.1) > sum(&before, |s| s.1));
    let differing: i64 = after
        .iter()
        .zip(&seen)
        .map(|(a, b)| (i64::from(a.0) - i64::from(b.0)).abs() + (i64::from(a.1) - i64::from(b.1)).abs())
        .sum();
    let moves = sum(after, |s| s.0 + s.1) - sum(&before, |s| s.0 + s.1);
    assert!(differing * 10 <= moves, "{differing} of {moves} counts differ");
    let (known, others) = taught.model.len();
    assert_eq!(known, patches.0 + 1, "the box is a patch of the object");
    assert!(others <= patches.1 + taught.params.learning.most_negatives);
}
