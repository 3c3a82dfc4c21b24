//! Where to look: near the prediction, elsewhere while unsure, all over the frame once the target is lost.

mod params;
mod tentative;

pub use params::{GateParams, SearchModel, SearchParams, WideningParams};

use crate::{BoxCovariance, Gate, Look, Measurement, Prior, Search, TrackState, ViewSize};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point, Size};
use serde::{Deserialize, Serialize};
use tentative::{MOST, Tentative};

/// Most columns, and most rows, of the grid of windows that a sweep over the frame goes through.
const MOST_LINES: usize = 64;

/// Share of a new size in the size that is remembered.
const SIZE_RATE: f64 = 0.1;

/// What a proposer goes by.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// Size of the frame.
    pub frame: Size,
    /// What the motion model expects.
    pub prior: &'a Prior,
    /// The state before this frame.
    pub state: TrackState,
    /// How much one look of the localizer takes in; `None`: any region at once.
    pub view: Option<ViewSize>,
    /// From this probability on nobody need look elsewhere.
    pub sure_from: f64,
    /// Whether the target was not sure for so long that it may be elsewhere.
    pub elsewhere: bool,
}

/// What a search found; `F` is the localizer's own [`Finding`](crate::Localizer::Finding).
#[derive(Debug, Clone, PartialEq)]
pub struct Observation<F> {
    /// Where was looked.
    pub search: Search,
    /// What was measured there.
    pub measurement: Measurement,
    /// What else the localizer saw there.
    pub finding: F,
}

/// Proposes where to look, a round of searches at a time, until enough has been seen of a frame.
///
/// It owns everything that is believed about the whole frame: where the target was seen last, how sure that was, and how
/// far the sweep over the frame has come.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Proposer {
    params: SearchParams,
    /// Where the target was seen last, believed or not.
    last: (f64, f64),
    /// Probability of what was seen near the prediction last.
    latest: f64,
    /// The window of the sweep looked at last.
    cursor: usize,
    /// Passes over the frame so far.
    pass: usize,
    /// How long the target has not been seen, in seconds.
    unseen_s: f64,
    /// Its size when it was seen whole.
    whole: (f64, f64),
    /// Places that may show it.
    tentative: Vec<Tentative>,
    /// The windows of a pass over the frame, in the order in which they are looked at, and the columns of their grid.
    order: Vec<usize>,
    columns: usize,
}

/// How far the search of one frame has come, and what it found.
#[derive(Debug)]
pub struct Progress<F> {
    round: Round,
    near: Option<Observation<F>>,
    swept: Option<Observation<F>>,
    /// What was seen at the places that may show the target.
    again: [Option<Observation<F>>; MOST],
}

impl<F> Default for Progress<F> {
    fn default() -> Self {
        Self { round: Round::First, near: None, swept: None, again: std::array::from_fn(|_| None) }
    }
}

impl<F> Progress<F> {
    /// Takes the best observation of the round proposed last.
    pub fn take(&mut self, best: Option<Observation<F>>) {
        match self.round {
            Round::Near => self.near = best,
            Round::Sweep | Round::Centred => self.swept = best,
            Round::Again(place) => {
                if let Some(seen) = self.again.get_mut(place) {
                    *seen = best;
                }
            }
            Round::First | Round::Done => {}
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Round {
    /// Nothing has been looked at.
    First,
    /// Near the prediction.
    Near,
    /// At one of the places that may show the target.
    Again(usize),
    /// At some windows over the frame.
    Sweep,
    /// Again, centred on the best of them.
    Centred,
    /// Enough has been seen.
    Done,
}

impl Proposer {
    /// A proposer for a target that is at `bbox` now.
    pub fn new(params: SearchParams, bbox: &BBox) -> Self {
        let mut proposer = Self {
            params,
            last: (0.0, 0.0),
            latest: 1.0,
            cursor: 0,
            pass: 0,
            unseen_s: 0.0,
            whole: (bbox.width(), bbox.height()),
            tentative: Vec::with_capacity(MOST),
            order: Vec::new(),
            columns: 0,
        };
        proposer.settle(bbox);
        proposer
    }

    /// Its parameters.
    pub const fn params(&self) -> &SearchParams {
        &self.params
    }

    /// Goes on with other parameters.
    pub fn change(&mut self, params: SearchParams) {
        self.params = params;
    }

    /// Forgets everything: a new target at `bbox`.
    pub fn restart(&mut self, bbox: &BBox) {
        *self = Self::new(self.params.clone(), bbox);
    }

    /// Remembers where the target was seen.
    pub fn settle(&mut self, bbox: &BBox) {
        self.last = (bbox.center().x, bbox.center().y);
    }

    /// The target is seen for certain at `bbox`. A box that reaches the border of `frame` may show a part of it.
    pub fn sure(&mut self, bbox: &BBox, frame: Size) {
        self.tentative.clear();
        self.order.clear();
        let (bounds, margin) = (frame.bounds(), 2.0);
        let whole = bbox.left() > margin
            && bbox.top() > margin
            && bbox.right() < bounds.right() - margin
            && bbox.bottom() < bounds.bottom() - margin;
        if whole {
            let towards = |old: f64, new: f64| old + SIZE_RATE * (new - old);
            self.whole = (towards(self.whole.0, bbox.width()), towards(self.whole.1, bbox.height()));
        }
    }

    /// The camera's motion moved the picture by `(dx, dy)` pixels.
    pub fn carry(&mut self, (dx, dy): (f64, f64)) {
        self.last = (self.last.0 + dx, self.last.1 + dy);
    }

    /// The part of the frame in which the target moves on; what is found outside of it came from elsewhere.
    pub fn neighbourhood(&self, situation: &Situation<'_>) -> BBox {
        let near = || situation.prior.bbox.scaled(self.params.reach);
        match self.params.model {
            SearchModel::Gate => {
                self.gate(situation).map_or_else(near, |gate| self.gate_region(&situation.prior.bbox, &gate))
            }
            SearchModel::Widening if situation.state != TrackState::Tracking => self.widened(situation),
            SearchModel::Near | SearchModel::NearThenWide | SearchModel::Widening | SearchModel::Everywhere => near(),
        }
    }

    /// The neighbourhood of the prediction and of the place where the target was seen last, and as far about both as the
    /// target may have gone since.
    fn widened(&self, situation: &Situation<'_>) -> BBox {
        let near = situation.prior.bbox.scaled(self.params.reach);
        let both = near.union(&near.centered_at(Point::new(self.last.0, self.last.1)));
        let covariance = situation.prior.innovation_covariance.unwrap_or_else(BoxCovariance::zeros);
        let rate = self.params.widening.growth_per_s * situation.prior.bbox.area().sqrt();
        // Not both: what is followed in doubt keeps the covariance small, wherever it leads.
        let further =
            |axis: usize| (self.params.gate_chi2 * covariance[(axis, axis)].max(0.0)).sqrt().max(rate * self.unseen_s);
        BBox::from_center_size(both.center(), both.width() + 2.0 * further(0), both.height() + 2.0 * further(1))
    }

    /// The next round of searches, into `searches`; none: enough has been seen. `progress` is new with the frame. `places` are
    /// hypotheses of the localizer's own, which are looked at in the first round while the target is not in sight.
    pub fn propose<F>(
        &mut self,
        situation: &Situation<'_>,
        places: &[BBox],
        progress: &mut Progress<F>,
        searches: &mut Vec<Search>,
    ) {
        searches.clear();
        if progress.round == Round::First && situation.state != TrackState::Tracking {
            searches.extend(places.iter().map(|place| self.at(*place)));
        }
        progress.round = match progress.round {
            Round::First if self.is_wide(situation.state) => self.elsewhere(0, situation, searches),
            Round::First => {
                searches.push(self.near(situation));
                if self.takes_in_all(situation) {
                    searches.iter_mut().for_each(|s| s.region = situation.frame.bounds());
                }
                Round::Near
            }
            Round::Near if self.params.tentative > 0 && situation.elsewhere => self.elsewhere(0, situation, searches),
            Round::Again(place) => self.elsewhere(place + 1, situation, searches),
            Round::Near if self.is_unsure(progress, situation.sure_from) && !self.looks_once(situation) => {
                self.sweep(situation, self.params.side_windows, searches)
            }
            Round::Sweep => {
                searches
                    .extend(progress.swept.as_ref().and_then(|best| self.centred(situation, &best.measurement.bbox)));
                Round::Centred
            }
            Round::Near | Round::Centred | Round::Done => Round::Done,
        };
    }

    /// What was found in this frame, after the last round. While the target is followed, what is seen elsewhere counts only
    /// if there is no doubt about it.
    pub fn finish<F>(&mut self, situation: &Situation<'_>, progress: Progress<F>) -> Option<Observation<F>> {
        let Progress { near, swept, again, .. } = progress;
        let swept = if self.params.tentative > 0 { self.weigh(situation, swept, again) } else { swept };
        let seen = situation.state == TrackState::Tracking;
        self.unseen_s = if seen { 0.0 } else { self.unseen_s + situation.prior.dt_s };
        let mut found = if self.is_wide(situation.state) {
            swept
        } else {
            let least = situation.sure_from.max(self.params.side_from);
            let found = swept.filter(|s| s.measurement.confidence >= least).or(near);
            if let Some(found) = &found {
                self.latest = found.measurement.confidence;
            }
            found
        };
        if let Some(found) = found.as_mut().filter(|found| found.search.keep_inside) {
            let bbox = &mut found.measurement.bbox;
            *bbox = bbox.centered_at(inside(bbox.center(), situation.frame));
        }
        found
    }

    /// Looks at the tentative place of that number, or else at windows over the frame.
    fn elsewhere(&mut self, place: usize, situation: &Situation<'_>, searches: &mut Vec<Search>) -> Round {
        let Some(tentative) = self.tentative.get(place).filter(|_| place < MOST) else {
            return self.sweep(situation, self.params.wide_windows, searches);
        };
        let keep_inside = self.params.keep_inside;
        let region = tentative.bbox.scaled(self.params.reach);
        searches.push(Search { expected: tentative.bbox, region, gate: None, look: Look::Centred, keep_inside });
        Round::Again(place)
    }

    /// What the looks of a frame say of the places that may show the target: the one believed by now, with the probability that
    /// all its looks give it.
    fn weigh<F>(
        &mut self,
        situation: &Situation<'_>,
        swept: Option<Observation<F>>,
        mut again: [Option<Observation<F>>; MOST],
    ) -> Option<Observation<F>> {
        let params = &self.params;
        let mut place = 0;
        let mut held = [false; MOST];
        for (tentative, (seen, held)) in self.tentative.iter_mut().zip(again.iter_mut().zip(&mut held)) {
            *held = tentative.look(params, seen.as_ref());
        }
        let apart = |a: &BBox, b: &BBox| a.iou(b) < 0.3;
        for i in 0..self.tentative.len().min(MOST) {
            // Of two places that have become one the first is kept.
            let doubled = (0..i).any(|j| held[j] && !apart(&self.tentative[i].bbox, &self.tentative[j].bbox));
            held[i] &= !doubled;
        }
        self.tentative.retain(|_| {
            place += 1;
            held.get(place - 1).copied().unwrap_or(false)
        });
        let mut kept = 0;
        for i in 0..MOST {
            if held[i] {
                again.swap(i, kept);
                kept += 1;
            }
        }
        if let Some(swept) = swept
            && self.tentative.len() < params.tentative
            && self.tentative.iter().all(|t| apart(&t.bbox, &swept.measurement.bbox))
        {
            let tentative = Tentative::new(params, &swept);
            if tentative.odds > -params.believe_at / 2.0 {
                if let Some(slot) = again.get_mut(self.tentative.len()) {
                    *slot = Some(swept);
                }
                self.tentative.push(tentative);
            }
        }
        let best =
            (0..self.tentative.len()).max_by(|&a, &b| self.tentative[a].odds.total_cmp(&self.tentative[b].odds))?;
        let odds = self.tentative[best].odds;
        let mut found = again.get_mut(best)?.take()?;
        let believed = odds >= params.believe_at;
        found.measurement.confidence = if believed {
            found.measurement.confidence.max(sigmoid(odds))
        } else {
            // What is not yet believed is no find, whatever its last look said.
            found.measurement.confidence.min(situation.sure_from / 2.0)
        };
        Some(found)
    }

    fn is_wide(&self, state: TrackState) -> bool {
        state == TrackState::Lost
            && match self.params.model {
                SearchModel::Near => false,
                SearchModel::NearThenWide | SearchModel::Gate | SearchModel::Widening | SearchModel::Everywhere => true,
            }
    }

    /// Whether the first look is at the whole frame.
    fn takes_in_all(&self, situation: &Situation<'_>) -> bool {
        self.params.model == SearchModel::Everywhere && situation.view.is_none()
    }

    /// Whether doubt does not lead to a second look: it widens the first one, or that took in everything.
    fn looks_once(&self, situation: &Situation<'_>) -> bool {
        self.params.model == SearchModel::Widening || self.takes_in_all(situation)
    }

    /// Whether the target that was seen near the prediction, now and in the frame before, may be another.
    fn is_unsure<F>(&self, progress: &Progress<F>, sure_from: f64) -> bool {
        let near = progress.near.as_ref().map(|f| f.measurement.confidence);
        near.is_some_and(|near| near < sure_from && self.latest < sure_from)
    }

    /// The look about the place where the target is expected.
    fn near(&self, situation: &Situation<'_>) -> Search {
        let (expected, gain) = (situation.prior.bbox, self.params.prediction_gain);
        let (x, y) = (expected.center().x, expected.center().y);
        // A gain of one is the prediction itself, to the last bit.
        let towards =
            |last: f64, predicted: f64| if gain == 1.0 { predicted } else { last + gain * (predicted - last) };
        let expected = expected.centered_at(Point::new(towards(self.last.0, x), towards(self.last.1, y)));
        Search {
            expected,
            region: self.neighbourhood(situation),
            gate: self.gate(situation).or_else(|| {
                let chi2 = self.params.gate_chi2;
                situation.prior.innovation_covariance.map(|covariance| Gate { covariance, chi2 })
            }),
            look: Look::Near,
            keep_inside: self.params.keep_inside,
        }
    }

    /// The look at a place that the localizer suggests: by its own hypotheses, so that no gate applies.
    fn at(&self, place: BBox) -> Search {
        Search {
            expected: place,
            region: place.scaled(self.params.reach),
            gate: None,
            look: Look::Near,
            keep_inside: self.params.keep_inside,
        }
    }

    /// The gate of the search model of that name.
    fn gate(&self, situation: &Situation<'_>) -> Option<Gate> {
        let p = &self.params;
        if p.model != SearchModel::Gate || situation.state == TrackState::Lost {
            return None;
        }
        let covariance = situation.prior.innovation_covariance?;
        let slack = p.gate.slack * situation.prior.bbox.area().sqrt();
        let shrunk = match situation.state {
            TrackState::Unsure | TrackState::Occluded => covariance * p.gate.unseen,
            TrackState::Tracking | TrackState::Lost => covariance,
        };
        Some(Gate { covariance: shrunk + BoxCovariance::identity() * (slack * slack), chi2: p.gate_chi2 })
    }

    /// Where the gate reaches, and the margin about it.
    fn gate_region(&self, expected: &BBox, gate: &Gate) -> BBox {
        let margin = self.params.gate.margin * expected.area().sqrt();
        let reach = |axis: usize| (gate.chi2 * gate.covariance[(axis, axis)].max(0.0)).sqrt() + margin;
        BBox::from_center_size(expected.center(), expected.width() + 2.0 * reach(0), expected.height() + 2.0 * reach(1))
    }

    /// The next `windows` windows of the sweep over the frame.
    fn sweep(&mut self, situation: &Situation<'_>, windows: usize, searches: &mut Vec<Search>) -> Round {
        let (bounds, prior) = (situation.frame.bounds(), situation.prior.bbox);
        let keep_inside = self.params.keep_inside;
        let Some(view) = situation.view else {
            searches.push(Search { expected: prior, region: bounds, gate: None, look: Look::Sweep, keep_inside });
            return Round::Centred;
        };
        let (expected, grown) = self.sought(&prior);
        let view = ViewSize { width: view.width * grown, height: view.height * grown };
        // Windows overlap by half: what lies near the edge of one is weakened by the localizer's own window.
        let lines = |whole: f64, part: f64| ((2.0 * whole / part).ceil() as usize).clamp(1, MOST_LINES);
        let (columns, rows) = (lines(bounds.width(), view.width), lines(bounds.height(), view.height));
        let all = columns * rows;
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let center = |window: usize| {
            Point::new(
                bounds.left() + share(window % columns, columns) * bounds.width(),
                bounds.top() + share(window / columns, rows) * bounds.height(),
            )
        };
        let hurried = match self.params.pass_frames {
            0 => windows,
            frames => windows.max(all.div_ceil(frames).min(self.params.most_windows)),
        };
        let ordered = self.params.whole_size;
        if ordered && (self.order.len(), self.columns) != (all, columns) {
            // The places nearest to where it was last come first.
            let last = Point::new(self.last.0, self.last.1);
            self.columns = columns;
            self.order.clear();
            self.order.extend(0..all);
            self.order.sort_by(|&a, &b| center(a).distance(last).total_cmp(&center(b).distance(last)));
        }
        for _ in 0..hurried.min(all) {
            let next = self.cursor + 1;
            self.pass += usize::from(next >= all);
            self.cursor = next % all;
            let window = if ordered { self.order.get(self.cursor).copied().unwrap_or(0) } else { self.cursor };
            let center = center(window);
            let region = BBox::from_center_size(center, view.width, view.height);
            searches.push(Search {
                expected: expected.centered_at(center),
                region,
                gate: None,
                look: Look::Sweep,
                keep_inside,
            });
        }
        Round::Sweep
    }

    /// The size at which the frame is gone over, as a box, and how much larger that is than `prior`.
    fn sought(&self, prior: &BBox) -> (BBox, f64) {
        if !self.params.whole_size {
            return (*prior, 1.0);
        }
        let factor = match (self.params.sizes, self.pass % self.params.sizes.max(1)) {
            (_, 1) => 2.0,
            (3, 2) => 0.5,
            _ => 1.0,
        };
        let sought = BBox::from_center_size(prior.center(), factor * self.whole.0, factor * self.whole.1);
        (sought, (sought.area() / prior.area().max(1e-9)).sqrt())
    }

    /// A second look, centred on the best of a sweep.
    fn centred(&self, situation: &Situation<'_>, best: &BBox) -> Option<Search> {
        let (center, view) = (best.center(), situation.view?);
        let region = BBox::from_center_size(center, view.width, view.height);
        let expected = if self.params.whole_size { *best } else { situation.prior.bbox.centered_at(center) };
        Some(Search { expected, region, gate: None, look: Look::Centred, keep_inside: self.params.keep_inside })
    }
}

/// The point of a frame of that size that is nearest to `point`.
pub fn inside(point: Point, frame: Size) -> Point {
    let bounds = frame.bounds();
    Point::new(point.x.clamp(0.0, bounds.right()), point.y.clamp(0.0, bounds.bottom()))
}

#[cfg(test)]
mod tests;
