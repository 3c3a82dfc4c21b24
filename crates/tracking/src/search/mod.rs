//! Where to look: near the prediction, elsewhere while unsure, all over the frame once the target is lost.

mod params;
mod refused;
mod sweep;
mod tentative;

pub use params::{GateParams, SearchModel, SearchParams, WideningParams};

use crate::{BoxCovariance, Gate, Look, Measurement, Prior, Search, TrackState, ViewSize};
use pursuit_geometry::{BBox, Point, Size};
use refused::Refused;
use serde::{Deserialize, Serialize};
use sweep::Sweep;
use tentative::{MOST, Tentatives};

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
    /// How far going over the frame has come.
    sweep: Sweep,
    /// How long the target has not been seen, in seconds.
    unseen_s: f64,
    /// Places that may show it.
    tentative: Tentatives,
    /// Places that turned out not to.
    refused: Refused,
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
            sweep: Sweep::new(bbox),
            unseen_s: 0.0,
            tentative: Tentatives::default(),
            refused: Refused::default(),
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

    /// The target is seen for certain at `bbox` of a frame of that size.
    pub fn sure(&mut self, bbox: &BBox, frame: Size) {
        self.tentative.clear();
        self.sweep.sure(bbox, frame);
    }

    /// The camera's motion moved the picture by `(dx, dy)` pixels.
    pub fn carry(&mut self, (dx, dy): (f64, f64)) {
        self.last = (self.last.0 + dx, self.last.1 + dy);
        self.refused.carry((dx, dy));
    }

    /// What was found at `bbox` turned out not to be the target.
    pub fn refuse(&mut self, bbox: &BBox) {
        if self.params.refuse_s > 0.0 {
            self.refused.add(bbox, self.params.refuse_s);
        }
    }

    /// Whether a find at `bbox`, all over the frame, is one that turned out not to be the target.
    pub fn refuses(&self, situation: &Situation<'_>, bbox: &BBox) -> bool {
        self.is_wide(situation.state) && self.refused.contains(bbox)
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
        let swept = if self.params.tentative > 0 {
            self.tentative.weigh(&self.params, situation.sure_from, swept, again)
        } else {
            swept
        };
        let seen = situation.state == TrackState::Tracking;
        self.refused.age(situation.prior.dt_s);
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
        let Some(tentative) = self.tentative.get(place) else {
            return self.sweep(situation, self.params.wide_windows, searches);
        };
        let keep_inside = self.params.keep_inside;
        let region = tentative.bbox.scaled(self.params.reach);
        searches.push(Search { expected: tentative.bbox, region, gate: None, look: Look::Centred, keep_inside });
        Round::Again(place)
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
        let Some(view) = situation.view else {
            let (expected, region) = (situation.prior.bbox, situation.frame.bounds());
            let keep_inside = self.params.keep_inside;
            searches.push(Search { expected, region, gate: None, look: Look::Sweep, keep_inside });
            return Round::Centred;
        };
        let last = Point::new(self.last.0, self.last.1);
        self.sweep.windows(&self.params, situation, view, windows, last, searches);
        Round::Sweep
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
