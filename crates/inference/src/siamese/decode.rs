use super::scales::ScaleSearch;
use super::{Answer, AnswerCoding, BoxRule, CropShape, ScoreCoding, SiameseConfig, WindowUse};
use pursuit_geometry::{BBox, Point, Size};
use std::f64::consts::TAU;

/// Turns answers into boxes.
#[derive(Debug, Clone)]
pub struct Decoder {
    config: SiameseConfig,
    /// Outer product of two Hann windows.
    window: Vec<f64>,
    /// Width and height of each anchor in pixels of the search image.
    anchors: Vec<(f64, f64)>,
    points: Vec<Candidate>,
    /// Of networks that give no boxes.
    scales: Option<ScaleSearch>,
}

/// What one point of the answer proposes.
#[derive(Debug, Clone, Copy, Default)]
struct Candidate {
    /// Probability that the target is there.
    score: f64,
    /// Middle and size relative to the middle of the search image, in its pixels.
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    /// exp(−k (r s − 1)).
    penalty: f64,
    /// Penalised score with the window.
    rank: f64,
}

/// Where the target is, by the best point of the answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// The box, its size smoothed, its middle inside the frame.
    pub bbox: BBox,
    /// The box as the network gave it.
    pub raw: BBox,
    /// The network's probability that the target is there: not calibrated.
    pub score: f64,
    /// Penalty on the change of shape and scale, in (0, 1].
    pub penalty: f64,
    /// The best point's row and column in the answer.
    pub point: (usize, usize),
}

/// A point of the answer whose score none of its eight neighbours exceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Its box as the network gave it.
    pub bbox: BBox,
    /// Its score.
    pub score: f64,
}

impl Decoder {
    /// For a configuration.
    pub fn new(config: SiameseConfig) -> Self {
        let n = config.answer_side;
        let hann = |i: usize| match config.window_use {
            WindowUse::Added => 0.5 - 0.5 * (TAU * i as f64 / (n - 1) as f64).cos(),
            WindowUse::Multiplied => 0.5 - 0.5 * (TAU * (i + 1) as f64 / (n + 1) as f64).cos(),
        };
        let window = (0..n * n).map(|i| hann(i / n) * hann(i % n)).collect();
        let anchors = match &config.answer {
            AnswerCoding::Anchors { ratios, scales } => {
                // Whole pixels before the scale, as networks were trained on.
                let of = |ratio: f64, scale: f64| {
                    let width = (config.stride_px / ratio.sqrt()).floor();
                    (width * scale, (width * ratio).floor() * scale)
                };
                ratios.iter().flat_map(|&r| scales.iter().map(move |&s| of(r, s))).collect()
            }
            AnswerCoding::Distances | AnswerCoding::Scores { .. } | AnswerCoding::Centres => Vec::new(),
        };
        let scales = match &config.answer {
            AnswerCoding::Scores { enlarged, .. } => Some(ScaleSearch::new(n, *enlarged)),
            AnswerCoding::Distances | AnswerCoding::Anchors { .. } | AnswerCoding::Centres => None,
        };
        Self { config, window, anchors, points: vec![Candidate::default(); n * n], scales }
    }

    /// The configuration.
    pub const fn config(&self) -> &SiameseConfig {
        &self.config
    }

    /// Width and height of what the template image covers of the frame, in pixels: of a square √((w + p (w + h)) (h + p (w + h))).
    pub fn template_extent(&self, width: f64, height: f64) -> (f64, f64) {
        self.extent(width, height, self.config.context, 1.0)
    }

    /// Width and height of what the search image covers of the frame, in pixels.
    pub fn search_extent(&self, width: f64, height: f64) -> (f64, f64) {
        let times = self.config.search_side_px as f64 / self.config.template_side_px as f64;
        self.extent(width, height, self.config.search_context, times * self.config.search_extent)
    }

    /// Of stretched windows 1 + 2 `around` of the target, of squares `times` the template's.
    fn extent(&self, width: f64, height: f64, around: f64, times: f64) -> (f64, f64) {
        let context = self.config.context * (width + height);
        let side = ((width + context) * (height + context)).sqrt() * self.config.extent * times;
        match self.config.crop {
            CropShape::Stretched => (width * (1.0 + 2.0 * around), height * (1.0 + 2.0 * around)),
            CropShape::Square | CropShape::Inclusive => (side, side),
            CropShape::Rounded => (side.ceil(), side.ceil()),
        }
    }

    /// Pixels of the search image to a pixel of the frame, across and down.
    fn scale(&self, width: f64, height: f64) -> (f64, f64) {
        let (across, down) = self.search_extent(width, height);
        let side = self.config.search_side_px as f64;
        (side / across, side / down)
    }

    /// The best point's box for a target of `width` × `height` pixels that was looked for around `center` in a frame of
    /// `size`. `None` if the answer has no finite point.
    pub fn locate(
        &mut self,
        answer: Answer<'_>,
        center: Point,
        (width, height): (f64, f64),
        size: Size,
    ) -> Option<Location> {
        let scale = self.scale(width, height);
        self.decode(answer, width * scale.0, height * scale.1);
        let mut best: Option<usize> = None;
        for (i, point) in self.points.iter().enumerate() {
            // Only a greater one replaces the first, and not-a-number is never greater.
            if point.rank.is_finite() && best.is_none_or(|b| point.rank > self.points[b].rank) {
                best = Some(i);
            }
        }
        let best = best?;
        let point = self.points[best];
        let raw = in_frame(&point, center, scale);
        let n = self.config.answer_side;
        Some(Location {
            bbox: self.followed(&raw, &point, (width, height), size),
            raw,
            score: point.score,
            penalty: point.penalty,
            point: (best / n, best % n),
        })
    }

    /// The box of the target, which was `width` × `height` large, by the network's in a frame of `size`.
    fn followed(&self, raw: &BBox, point: &Candidate, (width, height): (f64, f64), size: Size) -> BBox {
        let trusted = point.penalty * point.score * self.config.rate;
        let weight = match self.config.boxes {
            BoxRule::Smoothed => trusted,
            BoxRule::SmoothedTwice => trusted * trusted,
            BoxRule::Clipped => self.config.rate,
        };
        let smooth = |old: f64, new: f64| old * (1.0 - weight) + new * weight;
        let (width, height) = (smooth(width, raw.width()), smooth(height, raw.height()));
        let least = self.config.min_side_px;
        match self.config.boxes {
            BoxRule::Smoothed | BoxRule::SmoothedTwice => {
                let limit = |side: f64, most: usize| side.min(most as f64).max(least);
                let inside = |c: f64, most: usize| c.clamp(0.0, most as f64);
                let middle = Point::new(inside(raw.center().x, size.width), inside(raw.center().y, size.height));
                BBox::from_center_size(middle, limit(width, size.width), limit(height, size.height))
            }
            BoxRule::Clipped => {
                let side = |center: f64, side: f64, most: usize| {
                    let first = (center - side / 2.0).max(0.0).min(most as f64 - least);
                    let last = (center + side / 2.0).max(least).min(most as f64);
                    (first, (last - first).max(least))
                };
                let (left, width) = side(raw.center().x, width, size.width);
                let (top, height) = side(raw.center().y, height, size.height);
                BBox::from_ltwh(left, top, width, height)
            }
        }
    }

    /// Forgets the windows added so far. How many times larger than usual those are that a network without boxes is asked about, the
    /// usual one first; that one alone of other networks.
    pub fn begin_scales(&mut self) -> impl Iterator<Item = f64> + use<> {
        self.scales.iter_mut().for_each(ScaleSearch::begin);
        let (step, scales) = match &self.config.answer {
            AnswerCoding::Scores { step, scales, .. } => (*step, *scales),
            AnswerCoding::Distances | AnswerCoding::Anchors { .. } | AnswerCoding::Centres => (1.0, 1),
        };
        (0..scales as i32).map(move |k| step.powi(if k % 2 == 0 { k / 2 } else { -(k / 2) - 1 }))
    }

    /// Takes the answer about a window `factor` times as large as usual for a target of `width` × `height` pixels.
    pub fn add_scale(&mut self, answer: Answer<'_>, factor: f64, (width, height): (f64, f64)) {
        let (across, down) = self.scale(width, height);
        let Self { config, points, scales: Some(scales), .. } = self else { return };
        let penalty = (-(factor.max(1.0 / factor) - 1.0) * config.penalty).exp();
        if !scales.add(answer, factor, penalty) {
            return;
        }
        let n = config.answer_side;
        let at = |k: usize| (k as f64 - (n - 1) as f64 / 2.0) * config.stride_px * factor;
        for (i, (point, &response)) in points.iter_mut().zip(answer.scores).enumerate() {
            let score = probability(config, f64::from(response));
            let (width, height) = (width * across * factor, height * down * factor);
            *point = Candidate { score, x: at(i % n), y: at(i / n), width, height, penalty, rank: penalty * score };
        }
    }

    /// As [`locate`](Self::locate), by the best of the scales that were added.
    pub fn locate_at_scale(&self, center: Point, (width, height): (f64, f64), size: Size) -> Option<Location> {
        let scale = self.scale(width, height);
        let config = &self.config;
        let found = self.scales.as_ref()?.peak(config.window)?;
        let moved = |shift: f64, scale: f64| shift * config.stride_px * found.factor / scale;
        let middle = Point::new(
            (center.x + moved(found.shift.0, scale.0)).clamp(0.0, size.width as f64),
            (center.y + moved(found.shift.1, scale.1)).clamp(0.0, size.height as f64),
        );
        let growth = 1.0 - config.rate + config.rate * found.factor;
        let limit = |side: f64, most: usize| side.min(most as f64).max(config.min_side_px);
        Some(Location {
            bbox: BBox::from_center_size(
                middle,
                limit(width * growth, size.width),
                limit(height * growth, size.height),
            ),
            raw: BBox::from_center_size(middle, width * found.factor, height * found.factor),
            score: probability(config, found.response),
            penalty: found.penalty,
            point: found.point,
        })
    }

    /// The scores of the last answer, row by row.
    pub fn scores(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.points.iter().map(|p| p.score)
    }

    /// The peaks of the last answer with a score of at least `least`, for the search it was the answer to; `peaks` is
    /// emptied first, and comes back best first.
    pub fn peaks(&self, center: Point, (width, height): (f64, f64), least: f64, peaks: &mut Vec<Peak>) {
        let scale = self.scale(width, height);
        let n = self.config.answer_side;
        peaks.clear();
        for (i, point) in self.points.iter().enumerate() {
            let (row, column) = (i / n, i % n);
            let rows = row.saturating_sub(1)..(row + 2).min(n);
            let mut near = rows.flat_map(|r| (column.saturating_sub(1)..(column + 2).min(n)).map(move |c| r * n + c));
            // Of equal neighbours the first is the peak.
            let beats = |j: usize| match j.cmp(&i) {
                std::cmp::Ordering::Less => point.score > self.points[j].score,
                _ => point.score >= self.points[j].score,
            };
            if point.rank.is_finite() && point.score >= least && near.all(|j| j == i || beats(j)) {
                peaks.push(Peak { bbox: in_frame(point, center, scale), score: point.score });
            }
        }
        peaks.sort_by(|a, b| b.score.total_cmp(&a.score));
    }

    /// Fills in every point for a target whose size in the search image is `width` × `height`: of several anchors the best.
    fn decode(&mut self, answer: Answer<'_>, width: f64, height: f64) {
        let Self { config, window, anchors, points, .. } = self;
        let n = config.answer_side;
        let (count, kinds) = (n * n, config.answer.anchors());
        let target = padded_side(width, height);
        let middle = (n / 2) as f64;
        let side = config.search_side_px as f64;
        let Answer { scores, distances } = answer;
        for (i, point) in points.iter_mut().enumerate() {
            let at = |k: usize| (k as f64 - middle) * config.stride_px;
            let mut best: Option<Candidate> = None;
            for kind in 0..kinds {
                let number = |from: &[f32], plane: usize| {
                    from.get((plane * kinds + kind) * count + i).map_or(f64::NAN, |&v| f64::from(v))
                };
                let score = match config.scores {
                    ScoreCoding::Softmax => sigmoid(number(scores, 1) - number(scores, 0)),
                    ScoreCoding::Sigmoid => sigmoid(number(scores, 0)),
                    ScoreCoding::Probability => number(scores, 0),
                };
                let [a, b, c, d] = [0, 1, 2, 3].map(|plane| number(distances, plane));
                let (x, y, wide, high) = match (&config.answer, anchors.get(kind)) {
                    (AnswerCoding::Anchors { .. }, Some(&(w, h))) => {
                        (at(i % n) + a * w, at(i / n) + b * h, c.exp() * w, d.exp() * h)
                    }
                    // Relative to the middle of the image, as everything here.
                    (AnswerCoding::Centres, _) => {
                        let place = |k: usize, offset: f64| (k as f64 + offset) * config.stride_px - side / 2.0;
                        (place(i % n, c), place(i / n, d), a * side, b * side)
                    }
                    (AnswerCoding::Distances | AnswerCoding::Scores { .. }, _)
                    | (AnswerCoding::Anchors { .. }, None) => {
                        (at(i % n) + (c - a) / 2.0, at(i / n) + (d - b) / 2.0, a + c, b + d)
                    }
                };
                let change = |r: f64| r.max(1.0 / r);
                let scale = change(padded_side(wide, high) / target);
                let ratio = change((width / height) / (wide / high));
                let penalty = (-(ratio * scale - 1.0) * config.penalty).exp();
                let share = config.window;
                let rank = match config.window_use {
                    WindowUse::Added => penalty * score * (1.0 - share) + window[i] * share,
                    WindowUse::Multiplied => penalty * score * (1.0 - share + window[i] * share),
                };
                let sound = wide > 0.0 && high > 0.0 && (x + y + wide + high + score).is_finite();
                let rank = if sound { rank } else { f64::NAN };
                let candidate = Candidate { score, x, y, width: wide, height: high, penalty, rank };
                if best.is_none_or(|b| !b.rank.is_finite() || rank > b.rank) {
                    best = Some(candidate);
                }
            }
            *point = best.unwrap_or_default();
        }
    }
}

/// A candidate's box in the frame, given pixels of the search image per pixel of the frame, across and down.
fn in_frame(point: &Candidate, center: Point, (across, down): (f64, f64)) -> BBox {
    let middle = Point::new(center.x + point.x / across, center.y + point.y / down);
    BBox::from_center_size(middle, point.width / across, point.height / down)
}

/// What a single number a point stands for; what enlarging makes of probabilities may lie beyond 0 and 1.
fn probability(config: &SiameseConfig, number: f64) -> f64 {
    match config.scores {
        ScoreCoding::Probability => number.clamp(0.0, 1.0),
        ScoreCoding::Softmax | ScoreCoding::Sigmoid => sigmoid(number),
    }
}

/// √((w + (w + h) / 2) (h + (w + h) / 2)).
fn padded_side(width: f64, height: f64) -> f64 {
    let pad = (width + height) / 2.0;
    ((width + pad) * (height + pad)).sqrt()
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}
