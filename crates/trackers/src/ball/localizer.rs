//! Finds the ball near its prediction, or anywhere once it is lost.

use super::appearance::Appearance;
use super::detector::ball_likeness;
use super::eye::{Candidate, Eye};
use super::palette;
use super::params::BallParams;
use super::rivals::Rivals;
use crate::motion::{View, complete};
use crate::{BoxCovariance, Diagnostics, Localizer, Measurement, Result, Search, TrackingError};
use nalgebra::{Matrix2, Vector2};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_vision::PixelWindow;
use pursuit_vision::color::HsvRange;
use serde::{Deserialize, Serialize};

/// A region this much longer than wide, against the box started on, is a streak: the ball moved during the exposure.
const STREAK: f64 = 1.25;
/// Width of a streak against the ball's expected size.
const STREAK_WIDTH: (f64, f64) = (0.6, 1.5);
/// Margins between the box started on and its coloured region: beyond the widest they are different things; a region that
/// reaches further over its box than the narrowest is blurred or has grown together with something, which is no lasting
/// property of the ball.
const NARROWEST_MARGIN: f64 = -0.06;
const WIDEST_MARGIN: f64 = 0.35;
/// Standard deviation of a measured centre as a fraction of the size: seen whole, partly seen.
const CENTRE_SIGMA: (f64, f64) = (0.015, 0.25);
/// A candidate's solidity may fall to this fraction of that of the region started on.
const SOLIDITY: f64 = 0.8;
/// What the distance of a partly seen ball from its prediction counts.
const PART_DISTANCE: f64 = 6.0;
/// A sighting less confident than this has a second look, with an opening this much wider: the ball may have grown
/// together with like-coloured clutter.
const SECOND_LOOK: (f64, f64) = (0.7, 2.5);
/// Least likeness of colours, and least likeness to a ball, of what comes back after having been lost.
const RETURN: (f64, f64) = (0.6, 0.5);

/// The colour localizer of the ball.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BallLocalizer {
    params: BallParams,
    range: HsvRange,
    appearance: Appearance,
    /// Solidity of the region started on: 1 for anything convex.
    solidity: f64,
    /// How far the box started on reaches over its coloured region, as fractions of the region: left, top, right, bottom.
    margins: [f64; 4],
    rivals: Rivals,
    #[serde(skip)]
    scratch: Scratch,
}

/// Not state: made anew after a restore.
#[derive(Debug, Clone, Default)]
struct Scratch {
    eye: Eye,
    seen: Appearance,
    sightings: Vec<Sighting>,
    /// Regions that were not taken for the ball in the last frame.
    others: Vec<BBox>,
    looked_at: Option<PixelWindow>,
    /// Whether the last measurement showed the ball whole and sharp, so that appearance may learn from it.
    clear: bool,
}

/// A candidate seen as the ball.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    /// What is visible of it; the ball's own box where it is a streak.
    bbox: BBox,
    /// Where the whole ball would be.
    whole: BBox,
    view: View,
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
            appearance: Appearance::new(),
            solidity: 1.0,
            margins: [0.0; 4],
            rivals: Rivals::default(),
            scratch: Scratch::default(),
        };
        localizer.restart(frame, bbox)?;
        Ok(localizer)
    }

    /// Whether a restored localizer holds together.
    pub(super) fn is_sound(&self) -> bool {
        let finite = self.margins.iter().all(|m| m.is_finite() && m.abs() <= WIDEST_MARGIN);
        self.appearance.is_sound() && finite && (0.0..=1.0).contains(&self.solidity)
    }

    /// Rebuilds what is not saved.
    pub(super) fn revive(&mut self) {
        self.scratch.seen = Appearance::new();
    }

    /// The range of colours looked for.
    pub const fn range(&self) -> &HsvRange {
        &self.range
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
        let (visible, whole, view, streak) = interpret(candidate, &expected);
        let extent = search.expected.area().sqrt();
        let ratio = (whole.area() / expected.area()).sqrt();
        let most = if search.wide { self.params.max_size_ratio.powi(2) } else { self.params.max_size_ratio };
        if !(ratio <= most && ratio >= 1.0 / most) || candidate.solidity < SOLIDITY * self.solidity {
            return None;
        }
        let distance = match &search.gate {
            Some(gate) => {
                let slack = (self.params.gate_slack * extent).powi(2);
                let distance = distance(gate, slack, whole.center(), expected.center())?;
                // The completion of a part takes what lies nearest to the prediction, so it must lie really near.
                let distance = if view.is_whole() { distance } else { PART_DISTANCE * distance };
                if distance > self.params.gate_chi2 {
                    return None;
                }
                distance
            }
            None => 0.0,
        };
        if search.wide && !self.may_return(candidate, &expected) {
            return None;
        }
        let Scratch { eye, seen, .. } = &mut self.scratch;
        seen.take(eye, &visible);
        let likeness = self.appearance.likeness(seen);
        let filled = eye.coverage(&visible, 0.0..0.8);
        let solid = ((candidate.solidity / self.solidity - SOLIDITY) / (1.0 - SOLIDITY)).clamp(0.0, 1.0);
        let color = ((likeness - 0.3) / 0.5).clamp(0.0, 1.0);
        let sized = (-0.5 * (ratio.ln() / most.ln().max(0.1) * 1.5).powi(2)).exp();
        let partial = if view.is_whole() { 1.0 } else { 0.8 };
        let cut = candidate.bbox.clipped_to(size).map_or(0.0, |b| b.area() / whole.area()).clamp(0.0, 1.0);
        let shown = (cut / 0.25).min(1.0);
        let confidence = color.sqrt() * (0.4 + 0.6 * solid) * sized * partial * shown * (filled / 0.6).min(1.0);
        let sigma_px = if streak {
            let long = candidate.rectangle.width.max(candidate.rectangle.height);
            0.1 * (long - whole.width().min(whole.height())).max(0.0) + CENTRE_SIGMA.0 * extent
        } else if view.is_whole() {
            CENTRE_SIGMA.0 * extent
        } else {
            CENTRE_SIGMA.1 * extent
        };
        let (bbox, whole) = (self.reported(&visible, &whole), self.reported(&whole, &whole));
        Some(Sighting { bbox, whole, view, streak, sigma_px, distance, confidence, likeness, area: candidate.area })
    }

    /// Sorts the candidates found into sightings of the ball and others.
    fn sight_all(&mut self, search: &Search, size: Size) {
        for i in 0..self.scratch.eye.candidates().len() {
            let Some(candidate) = self.scratch.eye.candidates().get(i).copied() else { break };
            match self.sight(&candidate, search, size) {
                Some(sighting) if !self.rivals.holds(&candidate.bbox) => self.scratch.sightings.push(sighting),
                _ => self.scratch.others.push(candidate.bbox),
            }
        }
    }

    /// The sighting nearest to the prediction, unless another looks better by far.
    fn best(&self) -> Option<Sighting> {
        let cost = |s: &Sighting| s.distance + 8.0 * (1.0 - s.confidence);
        self.scratch.sightings.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).copied()
    }

    /// Strict gates for what shows up somewhere after the ball was lost.
    fn may_return(&mut self, candidate: &Candidate, expected: &BBox) -> bool {
        let relative = (candidate.bbox.width() / expected.width()) / (candidate.bbox.height() / expected.height());
        let Scratch { eye, seen, .. } = &mut self.scratch;
        seen.take(eye, &candidate.bbox);
        relative.min(1.0 / relative) >= self.params.min_squareness
            && self.appearance.likeness(seen) >= RETURN.0
            // Only a ball can be asked to be round; the thing started on may have been something else.
            && (self.solidity < 0.9 || ball_likeness(eye, candidate) >= RETURN.1)
            && !self.rivals.holds(&candidate.bbox)
    }
}

impl Localizer for BallLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        if !frame.has_color() {
            return Err(TrackingError::MissingPlane { tracker: "ball", needed: "colour", index: frame.index() });
        }
        self.scratch.clear = false;
        self.scratch.others.clear();
        self.scratch.looked_at = PixelWindow::of(&search.region, frame.size());
        let Some(window) = self.scratch.looked_at else { return Ok(None) };
        let radius = self.opening(&search.expected);
        let least = (0.02 * search.expected.area()).max(4.0);
        self.scratch.eye.look(frame, window)?;
        self.scratch.eye.find(frame, &self.range, radius, least, |_| true)?;
        self.scratch.sightings.clear();
        self.sight_all(search, frame.size());
        let unsure = self.best().is_none_or(|b| b.confidence < SECOND_LOOK.0);
        if unsure && !search.wide && !self.scratch.eye.candidates().is_empty() {
            let wider = (SECOND_LOOK.1 * radius as f64).round() as usize;
            self.scratch.eye.find_opened(frame, wider, least, |_| true)?;
            self.sight_all(search, frame.size());
        }
        let Some(best) = self.best() else { return Ok(None) };
        let Scratch { sightings, others, .. } = &mut self.scratch;
        others.extend(sightings.iter().map(|s| s.bbox));
        others.retain(|o| o.intersection(&best.whole).is_none());
        self.scratch.clear = best.view.is_whole() && !best.streak;
        let diagnostics = Diagnostics::default()
            .with("area_px", best.area)
            .with("color_likeness", best.likeness)
            .with("gate_distance", best.distance)
            .with("sightings", self.scratch.sightings.len() as f64)
            .with("whole", f64::from(u8::from(best.view.is_whole())))
            .with("streak", f64::from(u8::from(best.streak)));
        Ok(Some(Measurement {
            bbox: best.bbox,
            confidence: best.confidence,
            sigma_px: Some(best.sigma_px),
            diagnostics,
        }))
    }

    fn adapt(&mut self, _frame: &Frame, bbox: BBox) -> Result<()> {
        if let Some(window) = self.scratch.looked_at {
            self.rivals.note(&self.scratch.others, &window.to_bbox());
        }
        if self.scratch.clear {
            let region = self.region_of(&bbox);
            self.scratch.seen.take(&self.scratch.eye, &region);
            self.appearance.follow(&self.scratch.seen, self.params.learning_rate);
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        if !frame.has_color() {
            return Err(TrackingError::MissingPlane { tracker: "ball", needed: "colour", index: frame.index() });
        }
        self.scratch.seen = Appearance::new();
        self.appearance = Appearance::new();
        self.rivals.clear();
        (self.margins, self.solidity) = ([0.0; 4], 1.0);
        self.scratch.looked_at = Some(PixelWindow::full(frame.size()));
        self.scratch.eye.look(frame, PixelWindow::full(frame.size()))?;
        let prior = self.params.color.range();
        self.range = match prior {
            Some(range) if !self.params.learn_range => range,
            prior => palette::learn(&self.scratch.eye, &bbox, prior),
        };
        let radius = self.opening(&bbox);
        self.scratch.eye.find(frame, &self.range, radius, (0.02 * bbox.area()).max(4.0), |_| true)?;
        let candidates = self.scratch.eye.candidates();
        let own = candidates.iter().max_by(|a, b| a.bbox.iou(&bbox).total_cmp(&b.bbox.iou(&bbox)));
        if let Some((own, margins)) = own.and_then(|own| Some((own, margins(&own.bbox, &bbox)?))) {
            self.solidity = own.solidity;
            // Cut by the border, the box says nothing about margins.
            if bbox.expanded(1.0).fraction_inside(&frame.size().bounds()) == 1.0 {
                self.margins = margins;
            }
        }
        self.scratch.others.clear();
        let others = candidates.iter().map(|c| c.bbox).filter(|b| b.intersection(&bbox).is_none());
        self.scratch.others.extend(others);
        self.rivals.note(&self.scratch.others, &frame.size().bounds());
        let region = self.region_of(&bbox);
        self.appearance.take(&self.scratch.eye, &region);
        Ok(())
    }
}

/// How far `bbox` reaches over `region` on each side, as fractions of the region; `None` when they are different things.
fn margins(region: &BBox, bbox: &BBox) -> Option<[f64; 4]> {
    let (w, h) = (region.width(), region.height());
    let margins = [
        (region.left() - bbox.left()) / w,
        (region.top() - bbox.top()) / h,
        (bbox.right() - region.right()) / w,
        (bbox.bottom() - region.bottom()) / h,
    ];
    margins.iter().all(|m| m.abs() <= WIDEST_MARGIN).then_some(margins.map(|m| m.max(NARROWEST_MARGIN)))
}

/// Reads a region as the ball: what is visible of it, where all of it would be, whether something hides a part, and
/// whether it is a streak.
fn interpret(candidate: &Candidate, expected: &BBox) -> (BBox, BBox, View, bool) {
    let rectangle = &candidate.rectangle;
    let (long, short) = (rectangle.width.max(rectangle.height), rectangle.width.min(rectangle.height));
    let (expected_long, expected_short) =
        (expected.width().max(expected.height()), expected.width().min(expected.height()));
    let width = short / expected_short;
    let elongated = (long / expected_long) / width >= STREAK && long > expected_long * (STREAK + 1.0) / 2.0;
    if elongated && (STREAK_WIDTH.0..=STREAK_WIDTH.1).contains(&width) {
        // The ball swept along the long side; its box at the middle of the exposure is as wide as the streak.
        let scale = width.clamp(0.8, 1.25);
        let ball = BBox::from_center_size(candidate.centroid, expected.width() * scale, expected.height() * scale);
        return (ball, ball, View { cut_x: false, cut_y: false }, true);
    }
    let (whole, view) = complete(&candidate.bbox, expected);
    (candidate.bbox, whole, view, false)
}

/// Squared Mahalanobis distance of two centres under the gate's covariance plus `slack` px² for either axis; `None` for a
/// gate that is no covariance.
fn distance(gate: &BoxCovariance, slack: f64, a: Point, b: Point) -> Option<f64> {
    let covariance: Matrix2<f64> = gate.fixed_view::<2, 2>(0, 0) + Matrix2::identity() * slack;
    let away = Vector2::new(a.x - b.x, a.y - b.y);
    Some((away.transpose() * covariance.try_inverse()? * away)[(0, 0)]).filter(|d| d.is_finite() && *d >= 0.0)
}
