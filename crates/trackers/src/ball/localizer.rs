//! Finds the ball near its prediction, or anywhere once it is lost.

use super::appearance::Appearance;
use super::color_blobs::{Candidate, ColorBlobFinder};
use super::detector::ball_likeness;
use super::distractors::Distractors;
use super::palette;
use super::params::{BallParams, SightParams};
use nalgebra::{Matrix2, Vector2};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::motion::{Completion, CutSides, complete};
use pursuit_tracking::{Figure, Figures, Gate, Localizer, Look, Measurement, Result, Search, TrackingError};
use pursuit_vision::PixelWindow;
use pursuit_vision::color::HsvRange;
use serde::{Deserialize, Serialize};

/// The colour localizer of the ball.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "BallLocalizer")]
pub struct BallLocalizer {
    params: BallParams,
    range: HsvRange,
    appearance: Appearance,
    /// Solidity of the region started on: 1 for anything convex.
    solidity: f64,
    /// How far the box started on reaches over its coloured region, as fractions of the region: left, top, right, bottom.
    margins: [f64; 4],
    distractors: Distractors,
    #[serde(skip)]
    scratch: Scratch,
}

pursuit_estimation::checked!(BallLocalizer);

impl BallLocalizer {
    fn restored(self) -> Result<Self, &'static str> {
        let widest = self.params.sight.widest_margin;
        let fits = self.margins.iter().all(|m| m.is_finite() && m.abs() <= widest);
        if self.params.check_all().is_err() || !fits || !(0.0..=1.0).contains(&self.solidity) {
            return Err("its numbers do not fit each other");
        }
        Ok(self)
    }
}

/// Not state: made anew after a restore.
#[derive(Debug, Clone, Default)]
struct Scratch {
    blobs: ColorBlobFinder,
    seen: Appearance,
    sightings: Vec<Sighting>,
    /// Regions that were not taken for the ball in the last frame.
    others: Vec<BBox>,
    looked_at: Option<PixelWindow>,
    /// Which look all this is of, counted from the start.
    looks: u64,
}

/// What a look saw, and which one it was.
#[derive(Debug, Clone)]
pub struct BallFinding {
    search: Search,
    look: u64,
    /// Whether it showed the ball whole and sharp, so that appearance may learn from it.
    clear: bool,
}

pursuit_tracking::figures! {
    /// What is said of a region taken for the ball.
    struct BallFigures {
        /// Its area.
        area_px in "px²";
        /// How alike its colours are to the ball's, 0 to 1.
        color_likeness;
        /// Regions that could be the ball.
        sightings;
        /// Whether all of it is seen, 0 or 1.
        whole;
        /// Whether it is a streak, 0 or 1: the ball moved while the picture was taken.
        streak;
    }
}

/// A candidate seen as the ball.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    /// What is visible of it; the ball's own box where it is a streak.
    bbox: BBox,
    /// Where the whole ball would be.
    whole: BBox,
    cut: CutSides,
    streak: bool,
    sigma_px: f64,
    /// Squared distance from the prediction in units of the gate.
    distance: f64,
    confidence: f64,
    likeness: f64,
    area: f64,
}

impl BallLocalizer {
    pub(super) fn new(params: &BallParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let mut localizer = Self {
            params: params.clone(),
            range: HsvRange::ALL,
            appearance: Appearance::default(),
            solidity: 1.0,
            margins: [0.0; 4],
            distractors: Distractors::new(params.distractors.clone()),
            scratch: Scratch::default(),
        };
        localizer.restart(frame, bbox)?;
        Ok(localizer)
    }

    /// The range of colours looked for.
    pub const fn range(&self) -> &HsvRange {
        &self.range
    }

    fn least_area(&self, bbox: &BBox) -> f64 {
        (self.params.sight.least_area * bbox.area()).max(4.0)
    }

    /// How many pixels each way are taken for one when a ball of this size is sought in a part of a picture: the larger the
    /// part and the ball, the more.
    fn step(&self, ball: &BBox, part: PixelWindow) -> usize {
        let s = &self.params.sight;
        let (side, area) = (ball.width().min(ball.height()), part.size().area() as f64);
        ((side / s.pixels_across).min((area / s.whole_below).sqrt().ceil()) as usize)
            .clamp(1, super::detector::MOST_STEP)
    }

    fn opening(&self, bbox: &BBox) -> usize {
        let side = bbox.width().min(bbox.height());
        // At least one pixel, unless that would eat a tiny ball.
        ((self.params.opening_radius * side).round() as usize).clamp(usize::from(side >= 6.0), 24)
    }

    /// The region of a box as reported: margins taken off.
    fn region_of(&self, bbox: &BBox) -> BBox {
        let [l, t, r, b] = self.margins;
        let (w, h) = (bbox.width() / (1.0 + l + r), bbox.height() / (1.0 + t + b));
        BBox::from_ltwh(bbox.left() + l * w, bbox.top() + t * h, w, h)
    }

    /// The box to report for what is visible of a region that is `whole` when all of it is seen.
    fn reported(&self, visible: &BBox, whole: &BBox) -> BBox {
        let [l, t, r, b] = self.margins;
        let (w, h) = (whole.width(), whole.height());
        BBox::from_ltrb(
            visible.left() - l * w,
            visible.top() - t * h,
            visible.right() + r * w,
            visible.bottom() + b * h,
        )
    }

    /// What a candidate would be as the ball; `None` when it cannot be.
    fn sight(&mut self, candidate: &Candidate, search: &Search, size: Size) -> Option<Sighting> {
        let expected = self.region_of(&search.expected);
        let s = self.params.sight.clone();
        let (visible, whole, cut, streak) = interpret(candidate, &expected, &s);
        let extent = search.expected.area().sqrt();
        let ratio = (whole.area() / expected.area()).sqrt();
        let wide = search.look != Look::Near;
        let most = if wide { self.params.max_size_ratio.powi(2) } else { self.params.max_size_ratio };
        if !(ratio <= most && ratio >= 1.0 / most) || candidate.solidity < s.solidity * self.solidity {
            return None;
        }
        let distance = match &search.gate {
            Some(gate) => {
                let distance = distance(gate, whole.center(), expected.center())?;
                let distance = if cut.is_whole() { distance } else { s.part_distance * distance };
                if distance > gate.chi2 {
                    return None;
                }
                distance
            }
            None => 0.0,
        };
        if wide && !self.may_return(candidate, &expected) {
            return None;
        }
        let Scratch { blobs, seen, .. } = &mut self.scratch;
        seen.take(blobs, &visible);
        let likeness = self.appearance.likeness(seen);
        let filled = blobs.coverage(&visible, 0.0..0.8);
        let solid = ((candidate.solidity / self.solidity - s.solidity) / (1.0 - s.solidity)).clamp(0.0, 1.0);
        let color = ((likeness - s.color_none) / s.color_full).clamp(0.0, 1.0);
        let sized = (-0.5 * (ratio.ln() / most.ln().max(0.1) * s.size_steepness).powi(2)).exp();
        let partial = if cut.is_whole() { 1.0 } else { s.part_worth };
        let inside = candidate.bbox.clipped_to(size).map_or(0.0, |b| b.area() / whole.area()).clamp(0.0, 1.0);
        let shown = (inside / s.shown_full).min(1.0);
        let confidence = color.sqrt()
            * (s.ragged_worth + (1.0 - s.ragged_worth) * solid)
            * sized
            * partial
            * shown
            * (filled / s.filled_full).min(1.0);
        let sigma_px = if streak {
            let long = candidate.rectangle.width.max(candidate.rectangle.height);
            s.sigma_streak * (long - whole.width().min(whole.height())).max(0.0) + s.sigma_whole * extent
        } else if cut.is_whole() {
            s.sigma_whole * extent
        } else {
            s.sigma_part * extent
        };
        let (bbox, whole) = (self.reported(&visible, &whole), self.reported(&whole, &whole));
        Some(Sighting { bbox, whole, cut, streak, sigma_px, distance, confidence, likeness, area: candidate.area })
    }

    /// Sorts the candidates found into sightings of the ball and others.
    fn sight_all(&mut self, search: &Search, size: Size) {
        for i in 0..self.scratch.blobs.candidates().len() {
            let Some(candidate) = self.scratch.blobs.candidates().get(i).copied() else { break };
            match self.sight(&candidate, search, size) {
                Some(sighting) if !self.distractors.holds(&candidate.bbox) => self.scratch.sightings.push(sighting),
                _ => self.scratch.others.push(candidate.bbox),
            }
        }
    }

    /// The sighting nearest to the prediction, unless another looks better by far.
    fn best(&self) -> Option<Sighting> {
        let cost = |s: &Sighting| s.distance + self.params.sight.doubt_distance * (1.0 - s.confidence);
        self.scratch.sightings.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).copied()
    }

    /// Strict gates for what shows up somewhere after the ball was lost.
    fn may_return(&mut self, candidate: &Candidate, expected: &BBox) -> bool {
        let relative = (candidate.bbox.width() / expected.width()) / (candidate.bbox.height() / expected.height());
        let Scratch { blobs, seen, .. } = &mut self.scratch;
        seen.take(blobs, &candidate.bbox);
        relative.min(1.0 / relative) >= self.params.return_squareness
            && self.appearance.likeness(seen) >= self.params.sight.return_likeness
            // Only a ball can be asked to be round; the thing started on may have been something else.
            && (self.solidity < self.params.sight.round_from
                || ball_likeness(blobs, candidate) >= self.params.sight.return_roundness)
            && !self.distractors.holds(&candidate.bbox)
    }

    /// Looks for the ball and sorts what it sees.
    fn look(&mut self, frame: &Frame, search: &Search) -> Result<Option<Sighting>> {
        if !frame.has_color() {
            return Err(no_color(frame));
        }
        self.scratch.looks = self.scratch.looks.wrapping_add(1);
        self.scratch.others.clear();
        self.scratch.looked_at = PixelWindow::of(&search.region, frame.size());
        let Some(window) = self.scratch.looked_at else { return Ok(None) };
        let radius = self.opening(&search.expected);
        let least = self.least_area(&search.expected);
        self.scratch.blobs.look(frame, window, self.step(&search.expected, window))?;
        self.scratch.blobs.find(frame, &self.range, radius, least, |_| true)?;
        self.scratch.sightings.clear();
        self.sight_all(search, frame.size());
        let unsure = self.best().is_none_or(|b| b.confidence < self.params.sight.second_look_below);
        if unsure && search.look == Look::Near && !self.scratch.blobs.candidates().is_empty() {
            let wider = (self.params.sight.second_opening * radius as f64).round() as usize;
            self.scratch.blobs.find_opened(frame, wider, least, |_| true)?;
            self.sight_all(search, frame.size());
        }
        let Some(best) = self.best() else { return Ok(None) };
        let Scratch { sightings, others, .. } = &mut self.scratch;
        others.extend(sightings.iter().map(|s| s.bbox));
        others.retain(|o| o.intersection(&best.whole).is_none());
        Ok(Some(best))
    }
}

fn no_color(frame: &Frame) -> TrackingError {
    TrackingError::MissingPlane { tracker: "ball".to_owned(), needed: "colour", index: frame.index() }
}

impl Localizer for BallLocalizer {
    type Finding = BallFinding;

    const FIGURES: &[&[Figure]] = &[BallFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, BallFinding)>> {
        let Some(best) = self.look(frame, search)? else { return Ok(None) };
        let measurement = Measurement {
            sigma_px: Some(best.sigma_px),
            gate_share: search.gate.map(|gate| best.distance / gate.chi2),
            diagnostics: BallFigures {
                area_px: best.area,
                color_likeness: best.likeness,
                sightings: self.scratch.sightings.len() as f64,
                whole: f64::from(u8::from(best.cut.is_whole())),
                streak: f64::from(u8::from(best.streak)),
            }
            .into(),
            // A colour region where the ball may be is the ball nearly always; what is left is whether its box fits.
            ..Measurement::new(best.bbox, f64::midpoint(1.0, best.confidence))
        };
        let clear = best.cut.is_whole() && !best.streak;
        Ok(Some((measurement, BallFinding { search: search.clone(), look: self.scratch.looks, clear })))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &BallFinding) -> Result<()> {
        if self.scratch.looks != finding.look {
            // The regions to learn from are those of another look: they are found once more.
            self.look(frame, &finding.search)?;
        }
        if let Some(window) = self.scratch.looked_at {
            self.distractors.note(&self.scratch.others, &window.to_bbox());
        }
        if finding.clear {
            let region = self.region_of(&bbox);
            self.scratch.seen.take(&self.scratch.blobs, &region);
            self.appearance.follow(&self.scratch.seen, self.params.learning_rate);
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        if !frame.has_color() {
            return Err(no_color(frame));
        }
        self.scratch.seen = Appearance::default();
        self.appearance = Appearance::default();
        self.distractors.clear();
        (self.margins, self.solidity) = ([0.0; 4], 1.0);
        let whole = PixelWindow::full(frame.size());
        self.scratch.looked_at = Some(whole);
        self.scratch.blobs.look(frame, whole, self.step(&bbox, whole))?;
        let prior = self.params.color.range();
        self.range = match prior {
            Some(range) if !self.params.learn_range => range,
            prior => palette::learn(&self.scratch.blobs, &bbox, prior),
        };
        let radius = self.opening(&bbox);
        self.scratch.blobs.find(frame, &self.range, radius, self.least_area(&bbox), |_| true)?;
        let candidates = self.scratch.blobs.candidates();
        let own = candidates.iter().max_by(|a, b| a.bbox.iou(&bbox).total_cmp(&b.bbox.iou(&bbox)));
        if let Some((own, margins)) = own.and_then(|own| Some((own, margins(&own.bbox, &bbox, &self.params.sight)?))) {
            self.solidity = own.solidity;
            // Cut by the border, the box says nothing about margins.
            if bbox.expanded(1.0).fraction_inside(&frame.size().bounds()) == 1.0 {
                self.margins = margins;
            }
        }
        self.scratch.others.clear();
        let others = candidates.iter().map(|c| c.bbox).filter(|b| b.intersection(&bbox).is_none());
        self.scratch.others.extend(others);
        self.distractors.note(&self.scratch.others, &frame.size().bounds());
        let region = self.region_of(&bbox);
        self.appearance.take(&self.scratch.blobs, &region);
        Ok(())
    }
}

/// How far `bbox` reaches over `region` on each side, as fractions of the region; `None` when they are different things.
fn margins(region: &BBox, bbox: &BBox, sight: &SightParams) -> Option<[f64; 4]> {
    let (w, h) = (region.width(), region.height());
    let margins = [
        (region.left() - bbox.left()) / w,
        (region.top() - bbox.top()) / h,
        (bbox.right() - region.right()) / w,
        (bbox.bottom() - region.bottom()) / h,
    ];
    margins.iter().all(|m| m.abs() <= sight.widest_margin).then_some(margins.map(|m| m.max(-sight.overhang)))
}

/// Reads a region as the ball: what is visible of it, where all of it would be, whether something hides a part, and
/// whether it is a streak.
fn interpret(candidate: &Candidate, expected: &BBox, s: &SightParams) -> (BBox, BBox, CutSides, bool) {
    let rectangle = &candidate.rectangle;
    let (long, short) = (rectangle.width.max(rectangle.height), rectangle.width.min(rectangle.height));
    let (expected_long, expected_short) =
        (expected.width().max(expected.height()), expected.width().min(expected.height()));
    let width = short / expected_short;
    let elongated = (long / expected_long) / width >= s.streak && long > expected_long * (s.streak + 1.0) / 2.0;
    if elongated && (s.streak_narrowest..=s.streak_widest).contains(&width) {
        // The ball swept along the long side; its box at the middle of the exposure is as wide as the streak.
        let scale = width.clamp(0.8, 1.25);
        let ball = BBox::from_center_size(candidate.centroid, expected.width() * scale, expected.height() * scale);
        return (ball, ball, CutSides { cut_x: false, cut_y: false }, true);
    }
    let (whole, cut) = complete(&candidate.bbox, expected, Completion::default());
    (candidate.bbox, whole, cut, false)
}

/// Squared Mahalanobis distance of two centres under the gate's covariance; `None` for a gate that is no covariance.
fn distance(gate: &Gate, a: Point, b: Point) -> Option<f64> {
    let covariance: Matrix2<f64> = gate.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let away = Vector2::new(a.x - b.x, a.y - b.y);
    Some((away.transpose() * covariance.try_inverse()? * away)[(0, 0)]).filter(|d| d.is_finite() && *d >= 0.0)
}
