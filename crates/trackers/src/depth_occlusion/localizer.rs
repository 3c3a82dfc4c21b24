use super::hypotheses::add_apart;
use super::{DepthOcclusionParams, Hypotheses, Occluder, Sought, TargetDepth};
use crate::correlation::CorrelationLocalizer;
use crate::depth::samples;
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, ImageView};
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{
    Diagnostics, Doubt, Localizer, Look, Measurement, Outcome, Place, Prior, Result, Search, TrackState, TrackingError,
    ViewSize,
};
use serde::{Deserialize, Serialize};

/// Finds the target by the correlation of depth, and knows when something nearer hides it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct DepthLocalizer {
    params: DepthOcclusionParams,
    /// On depth, from the first frame with depth on.
    depth: Option<DepthFilter>,
    /// On the picture, for frames without depth.
    picture: CorrelationLocalizer,
    hypotheses: Hypotheses,
    /// The target is not in sight.
    hidden: bool,
    /// What hides it, where that is known.
    occluder: Option<Occluder>,
    /// Where it was seen last.
    last: BBox,
    /// Frames learned from.
    learned: u64,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: DepthOcclusionParams,
    depth: Option<DepthFilter>,
    picture: CorrelationLocalizer,
    hypotheses: Hypotheses,
    hidden: bool,
    occluder: Option<Occluder>,
    last: BBox,
    learned: u64,
}

impl TryFrom<Raw> for DepthLocalizer {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, depth, picture, hypotheses, hidden, occluder, last, learned } = raw;
        if params.check_all().is_err() {
            return Err("its parameters are out of range");
        }
        if occluder.is_some_and(|o| !o.distance_m.is_finite()) {
            return Err("what hides its target has no distance");
        }
        Ok(Self { params, depth, picture, hypotheses, hidden, occluder, last, learned })
    }
}

/// The filter on depth and what is known of the target's distance.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct DepthFilter {
    filter: CorrelationLocalizer,
    target: TargetDepth,
}

impl DepthFilter {
    /// `None` where the box has no depth.
    fn new(params: &DepthOcclusionParams, frame: &Frame, bbox: &BBox) -> Option<Self> {
        let target = TargetDepth::new(params, usable_depth(params, frame)?, bbox)?;
        Some(Self { filter: CorrelationLocalizer::new(params.filter.spec(), frame, bbox), target })
    }
}

/// The frame's depth, unless it has hardly any data.
fn usable_depth<'a>(params: &DepthOcclusionParams, frame: &'a Frame) -> Option<ImageView<'a, u16>> {
    let depth = frame.depth_mm()?;
    let (all, valid) = samples(depth, &frame.size().bounds(), params.probes)
        .fold((0_u32, 0_u32), |(all, valid), mm| (all + 1, valid + u32::from(mm > 0)));
    (f64::from(valid) >= params.least_depth * f64::from(all.max(1))).then_some(depth)
}

fn failed(frame: &Frame) -> impl FnOnce(EstimationError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "depth-occlusion".to_owned(), index, source: Box::new(e) }
}

impl DepthLocalizer {
    /// Starts on the target at `bbox`.
    pub(super) fn new(params: &DepthOcclusionParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        Ok(Self {
            depth: DepthFilter::new(params, frame, &bbox),
            picture: CorrelationLocalizer::new(params.picture.spec(), frame, &bbox),
            hypotheses: Hypotheses::new(params, usable_depth(params, frame), &bbox).map_err(failed(frame))?,
            hidden: false,
            occluder: None,
            last: bbox,
            learned: 0,
            params: params.clone(),
        })
    }

    /// Where to look with which size: at another place than the expected one, things may be at another distance.
    fn expected_size(&self, depth: ImageView<'_, u16>, target: &TargetDepth, search: &Search) -> Search {
        let mut search = search.clone();
        if search.look == Look::Centred && self.params.scale_from_depth {
            let found = target.scale_in(&self.params, depth, &search.expected, true);
            let last = target.scale_at(target.surface_m());
            if let Some(scale) = found {
                search.expected = search
                    .expected
                    .scaled((scale / last).clamp(1.0 / self.params.most_resize, self.params.most_resize));
            }
        }
        search
    }

    /// The better of two looks, near the prediction and, if it has hardly answered there, where it was last.
    fn locate_in_depth(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let found = self.look_in_depth(frame, search)?;
        let dropped = |m: &Measurement| {
            let part = self.depth.as_ref();
            part.is_some_and(|part| part.target.has_dropped(&self.params, m.strength))
        };
        let near = search.look == Look::Near && !self.hidden;
        // What is being covered answers less wherever it is looked for.
        let astray = near && self.params.look_back && found.as_ref().is_some_and(dropped);
        if !astray || self.covered(frame, &search.expected) > self.params.learn_covered {
            return Ok(found);
        }
        let expected = search.expected.centered_at(self.last.center());
        let back = self.look_in_depth(frame, &Search { expected, ..search.clone() })?;
        Ok(found.into_iter().chain(back).max_by(|a, b| a.strength.total_cmp(&b.strength)))
    }

    /// The response of the filter on depth, held against the distances.
    fn look_in_depth(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let (Some(mut part), Some(depth)) = (self.depth.take(), usable_depth(&self.params, frame)) else {
            return Ok(None);
        };
        let search = self.expected_size(depth, &part.target, search);
        let located = part.filter.locate(frame, &search);
        let target = part.target;
        self.depth = Some(part);
        let Some(found) = located? else { return Ok(None) };
        let raw = found.peak.unwrap_or(0.0);
        let sought = match search.look {
            _ if !self.hidden => Sought::InSight,
            Look::Near => Sought::Hidden,
            Look::Sweep | Look::Centred => Sought::Anywhere,
        };
        let seen = target.judge(&self.params, depth, &found.bbox, raw, sought);
        let confidence = seen.judged.probability(self.params.softness);
        Ok(Some(Measurement {
            confidence,
            strength: seen.judged.response,
            velocity_share: target.velocity_share(&self.params, seen.judged.response),
            peak: Some(seen.judged.response),
            diagnostics: Diagnostics::default()
                .with("response", raw)
                .with("penalised", seen.judged.response)
                .with("threshold", seen.judged.threshold)
                .with("depth_m", seen.depth.mean_m.unwrap_or(0.0))
                .with("covered", seen.covered)
                .with("psr", found.psr.unwrap_or(0.0)),
            ..found
        }))
    }

    /// Whether this frame is looked at by its depth.
    fn sees_depth(&self, frame: &Frame) -> bool {
        self.depth.is_some() && usable_depth(&self.params, frame).is_some()
    }

    /// How much of the target at `bbox` something nearer covers.
    fn covered(&self, frame: &Frame, bbox: &BBox) -> f64 {
        match (&self.depth, usable_depth(&self.params, frame)) {
            (Some(part), Some(depth)) => part.target.judge(&self.params, depth, bbox, 0.0, Sought::InSight).covered,
            _ => 0.0,
        }
    }

    /// The target was seen: what is known of its distance follows, unless it is partly covered.
    fn saw(&mut self, frame: &Frame, outcome: &Outcome<'_>) {
        let was_hidden = std::mem::replace(&mut self.hidden, false);
        self.occluder = None;
        self.last = outcome.bbox;
        let clear = self.covered(frame, &outcome.bbox) <= self.params.learn_covered;
        let (Some(part), Some(depth), Some(found)) =
            (&mut self.depth, usable_depth(&self.params, frame), outcome.found)
        else {
            return;
        };
        if was_hidden {
            part.target.found_again(&self.params, depth, &outcome.bbox);
        } else if clear {
            part.target.learn(&self.params, depth, &outcome.bbox, found.peak.unwrap_or(0.0));
            self.hypotheses.learn(&self.params, depth, &outcome.bbox);
        }
    }

    /// The target is out of sight: what is nearer at its place hides it.
    fn missed(&mut self, frame: &Frame, outcome: &Outcome<'_>) {
        self.hidden = true;
        let (Some(part), Some(depth)) = (&self.depth, usable_depth(&self.params, frame)) else { return };
        let seen = part.target.judge(&self.params, depth, &outcome.bbox, 0.0, Sought::Hidden);
        if outcome.state == TrackState::Lost {
            self.occluder = None;
        } else if let (Some(distance_m), true) = (seen.depth.nearer_m, seen.covered > self.params.learn_covered) {
            self.occluder = Some(Occluder { distance_m });
        }
    }
}

impl Localizer for DepthLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        if self.sees_depth(frame) { self.locate_in_depth(frame, search) } else { self.picture.locate(frame, search) }
    }

    /// Measures the size by the distance.
    fn refine(&mut self, frame: &Frame, found: Measurement, look: Look) -> Result<Measurement> {
        let (Some(part), Some(depth)) = (&self.depth, usable_depth(&self.params, frame)) else { return Ok(found) };
        let (Some(place), true) = (found.place, self.params.scale_from_depth) else { return Ok(found) };
        let anywhere = look != Look::Near;
        let Some(scale) = part.target.scale_in(&self.params, depth, &found.bbox, anywhere) else { return Ok(found) };
        let window = part.filter.window();
        let scale = window.within_bounds(scale);
        let place = Place { scale, ..place };
        Ok(Measurement { bbox: window.bbox(place.center, scale), place: Some(place), ..found })
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, measurement: &Measurement) -> Result<()> {
        if self.covered(frame, &bbox) > self.params.learn_covered {
            return Ok(());
        }
        self.learned = self.learned.wrapping_add(1);
        match &mut self.depth {
            Some(part) if usable_depth(&self.params, frame).is_some() => part.filter.adapt(frame, bbox, measurement)?,
            Some(_) => return self.picture.adapt(frame, bbox, measurement),
            none => *none = DepthFilter::new(&self.params, frame, &bbox),
        }
        if self.depth.is_none() || self.learned.is_multiple_of(self.params.picture_every.max(1) as u64) {
            self.picture.adapt(frame, bbox, measurement)?;
        }
        Ok(())
    }

    fn suggest(&mut self, frame: &Frame, prior: &Prior, state: TrackState, places: &mut Vec<BBox>) -> Result<()> {
        let depth = usable_depth(&self.params, frame);
        self.hypotheses.look_ahead(&self.params, frame, depth, &prior.bbox, prior.dt_s).map_err(failed(frame))?;
        if state == TrackState::Tracking {
            return Ok(());
        }
        self.hypotheses.clusters(&self.params, &prior.bbox, places);
        if let (Some(occluder), Some(depth), true) = (&self.occluder, depth, self.params.occluder_edges) {
            occluder.edges(&self.params, depth, &prior.bbox, places);
        }
        // What nothing hides may have stopped.
        if self.occluder.is_none() {
            add_apart(places, self.last, self.params.apart);
        }
        Ok(())
    }

    fn doubt(&self, frame: &Frame, expected: &BBox) -> Option<Doubt> {
        (self.covered(frame, expected) > self.params.learn_covered).then_some(Doubt::Covered)
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_>) -> Result<()> {
        let seen = outcome.state == TrackState::Tracking;
        if seen {
            self.saw(frame, outcome);
        } else {
            self.missed(frame, outcome);
        }
        let distance_m = self.depth.as_ref().filter(|_| self.sees_depth(frame)).map(|part| part.target.surface_m());
        let seen = seen.then(|| (outcome.bbox.center(), distance_m));
        self.hypotheses.settle(&self.params, frame, seen, outcome.dt_s).map_err(failed(frame))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox)?;
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        self.depth.as_ref().map_or(&self.picture, |part| &part.filter).view(expected)
    }
}
