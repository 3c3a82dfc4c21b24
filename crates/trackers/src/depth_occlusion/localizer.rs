use super::hypotheses::add_apart;
use super::{DepthOcclusionParams, Hypotheses, Occluder, Sought, TargetDepth};
use crate::correlation::{CorrelationFigures, CorrelationLocalizer, ResponsePeak};
use crate::depth::samples;
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, ImageView};
use pursuit_parameters::Parameters;
use pursuit_tracking::{
    Doubt, Figure, Figures, Localizer, Look, Measurement, Outcome, Prior, Result, Search, TrackState, TrackingError,
    ViewSize,
};
use serde::{Deserialize, Serialize};

/// Finds the target by the correlation of depth, and knows when something nearer hides it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "DepthLocalizer")]
pub struct DepthLocalizer {
    pub(super) params: DepthOcclusionParams,
    /// On depth, from the first frame with depth on.
    pub(super) depth: Option<DepthFilter>,
    /// On the picture, for frames without depth.
    pub(super) picture: CorrelationLocalizer,
    hypotheses: Hypotheses,
    /// The target is not in sight.
    pub(super) hidden: bool,
    /// What hides it, where that is known.
    occluder: Option<Occluder>,
    /// Where it was seen last.
    last: BBox,
    /// Frames learned from.
    learned: u64,
}

pursuit_estimation::checked!(DepthLocalizer);

impl DepthLocalizer {
    fn restored(self) -> Result<Self, &'static str> {
        if self.params.check_all().is_err() {
            return Err("its parameters are out of range");
        }
        if self.occluder.is_some_and(|o| !o.distance_m.is_finite()) {
            return Err("what hides its target has no distance");
        }
        Ok(self)
    }
}

pursuit_tracking::figures! {
    /// What the filter on depth says of a place.
    struct DepthFigures {
        /// Height of the response's peak.
        response;
        /// The same after depth had its say.
        penalised;
        /// What that has to be.
        threshold;
        /// Mean depth of the box; 0 where there is none.
        depth_m in "m";
        /// The share of the box that something nearer covers, beyond what is the target's own shape.
        covered;
        /// Peak-to-sidelobe ratio of the response.
        psr;
    }
}

/// What a look saw: the peak in the response of the filter that looked, and of the one on depth the response after depth had
/// its say.
#[derive(Debug, Clone, Copy)]
pub struct DepthFinding {
    pub(super) peak: ResponsePeak,
    pub(super) penalised: Option<f64>,
}

impl DepthFinding {
    /// How well it answered.
    fn response(&self) -> f64 {
        self.penalised.unwrap_or(self.peak.evidence.peak)
    }
}

/// What a look found, if anything.
pub(super) type Seen = Option<(Measurement, DepthFinding)>;

/// The filter on depth and what is known of the target's distance.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct DepthFilter {
    filter: CorrelationLocalizer,
    pub(super) target: TargetDepth,
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
    pub(super) fn locate_in_depth(
        &mut self,
        frame: &Frame,
        depth: ImageView<'_, u16>,
        search: &Search,
    ) -> Result<Seen> {
        let found = self.look_in_depth(frame, depth, search)?;
        let dropped = |(m, _): &(Measurement, DepthFinding)| {
            let part = self.depth.as_ref();
            part.is_some_and(|part| part.target.has_dropped(&self.params, m.strength))
        };
        let near = search.look == Look::Near && !self.hidden;
        // What is being covered answers less wherever it is looked for.
        let astray = near && self.params.look_back && found.as_ref().is_some_and(dropped);
        if !astray || self.covered(Some(depth), &search.expected) > self.params.learn_covered {
            return Ok(found);
        }
        let expected = search.expected.centered_at(self.last.center());
        let back = self.look_in_depth(frame, depth, &Search { expected, ..search.clone() })?;
        Ok(found.into_iter().chain(back).max_by(|a, b| a.0.strength.total_cmp(&b.0.strength)))
    }

    /// The response of the filter on depth, held against the distances.
    fn look_in_depth(&mut self, frame: &Frame, depth: ImageView<'_, u16>, search: &Search) -> Result<Seen> {
        let Some(mut part) = self.depth.take() else { return Ok(None) };
        let search = self.expected_size(depth, &part.target, search);
        let located = part.filter.locate(frame, &search);
        let target = part.target;
        self.depth = Some(part);
        let Some((found, peak)) = located? else { return Ok(None) };
        let raw = peak.evidence.peak;
        let sought = match search.look {
            _ if !self.hidden => Sought::InSight,
            Look::Near => Sought::Hidden,
            Look::Sweep | Look::Centred => Sought::Anywhere,
        };
        let seen = target.judge(&self.params, depth, &found.bbox, raw, sought);
        let measurement = Measurement {
            confidence: seen.judged.probability(self.params.softness),
            strength: seen.judged.response,
            velocity_share: target.velocity_share(&self.params, seen.judged.response),
            diagnostics: DepthFigures {
                response: raw,
                penalised: seen.judged.response,
                threshold: seen.judged.threshold,
                depth_m: seen.depth.mean_m.unwrap_or(0.0),
                covered: seen.covered,
                psr: peak.evidence.psr,
            }
            .into(),
            ..found
        };
        Ok(Some((measurement, DepthFinding { peak, penalised: Some(seen.judged.response) })))
    }

    /// The frame's depth where it can be used: as `finding` says where there is one.
    fn depth_of<'a>(&self, frame: &'a Frame, finding: Option<&DepthFinding>) -> Option<ImageView<'a, u16>> {
        match finding {
            Some(DepthFinding { penalised: Some(_), .. }) => frame.depth_mm(),
            // Its place has none, whatever the rest of the frame has.
            Some(_) if self.depth.is_some() && self.params.scarce_depth > 0.0 => None,
            Some(_) | None => usable_depth(&self.params, frame),
        }
    }

    /// How much of the target at `bbox` something nearer covers; nothing where that cannot be told.
    fn covered(&self, depth: Option<ImageView<'_, u16>>, bbox: &BBox) -> f64 {
        match (&self.depth, depth) {
            (Some(part), Some(depth)) => part.target.judge(&self.params, depth, bbox, 0.0, Sought::InSight).covered,
            _ => 0.0,
        }
    }

    /// The target was seen: what is known of its distance follows, unless it is partly covered.
    fn saw(&mut self, depth: Option<ImageView<'_, u16>>, outcome: &Outcome<'_, DepthFinding>) {
        let was_hidden = std::mem::replace(&mut self.hidden, false);
        self.occluder = None;
        self.last = outcome.bbox;
        let clear = self.covered(depth, &outcome.bbox) <= self.params.learn_covered;
        let (Some(part), Some(depth), Some((_, finding))) = (&mut self.depth, depth, outcome.found) else { return };
        if was_hidden {
            part.target.found_again(&self.params, depth, &outcome.bbox);
        } else if clear {
            part.target.learn(&self.params, depth, &outcome.bbox, finding.response());
            self.hypotheses.learn(&self.params, depth, &outcome.bbox);
        }
    }

    /// The target is out of sight: what is nearer at its place hides it.
    fn missed(&mut self, depth: Option<ImageView<'_, u16>>, outcome: &Outcome<'_, DepthFinding>) {
        self.hidden = true;
        let (Some(part), Some(depth)) = (&self.depth, depth) else { return };
        let seen = part.target.judge(&self.params, depth, &outcome.bbox, 0.0, Sought::Hidden);
        if outcome.state == TrackState::Lost {
            self.occluder = None;
        } else if let (Some(distance_m), true) = (seen.depth.nearer_m, seen.covered > self.params.learn_covered) {
            self.occluder = Some(Occluder { distance_m });
        }
    }
}

impl Localizer for DepthLocalizer {
    type Finding = DepthFinding;

    const FIGURES: &[&[Figure]] = &[DepthFigures::ALL, CorrelationFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Seen> {
        match usable_depth(&self.params, frame).filter(|_| self.depth.is_some()) {
            Some(depth) if self.params.scarce_depth > 0.0 => self.locate_by_place(frame, depth, search),
            Some(depth) => self.locate_in_depth(frame, depth, search),
            None => self.locate_in_picture(frame, search),
        }
    }

    /// Measures the size by the distance.
    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut DepthFinding,
    ) -> Result<()> {
        if finding.penalised.is_none() && self.params.scarce_depth > 0.0 {
            return self.picture.refine(frame, search, measurement, &mut finding.peak);
        }
        let by_depth = finding.penalised.is_some() && self.params.scale_from_depth;
        let (Some(part), Some(depth), true) = (&self.depth, frame.depth_mm(), by_depth) else { return Ok(()) };
        let anywhere = search.look != Look::Near;
        if let Some(scale) = part.target.scale_in(&self.params, depth, &measurement.bbox, anywhere) {
            let (window, peak) = (part.filter.window(), &mut finding.peak);
            peak.center = part.filter.middle(frame, search, peak);
            peak.scale = window.within_bounds(scale);
            measurement.bbox = window.bbox(peak.center, peak.scale);
        }
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &DepthFinding) -> Result<()> {
        let depth = self.depth_of(frame, Some(finding));
        if self.covered(depth, &bbox) > self.params.learn_covered {
            return Ok(());
        }
        self.learned = self.learned.wrapping_add(1);
        match &mut self.depth {
            Some(part) if depth.is_some() => part.filter.learn(frame, &bbox, finding.response())?,
            Some(_) => {
                self.picture.learn(frame, &bbox, finding.response())?;
                return Ok(());
            }
            none => *none = DepthFilter::new(&self.params, frame, &bbox),
        }
        if self.depth.is_none() || self.learned.is_multiple_of(self.params.picture_every.max(1) as u64) {
            self.picture.learn(frame, &bbox, finding.response())?;
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

    fn doubt(&self, frame: &Frame, expected: &BBox, finding: Option<&DepthFinding>) -> Option<Doubt> {
        (self.covered(self.depth_of(frame, finding), expected) > self.params.learn_covered).then_some(Doubt::Covered)
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, DepthFinding>) -> Result<()> {
        let depth = self.depth_of(frame, outcome.found.map(|(_, finding)| finding));
        let seen = outcome.state == TrackState::Tracking;
        if seen {
            self.saw(depth, outcome);
        } else {
            self.missed(depth, outcome);
        }
        let distance_m = self.depth.as_ref().filter(|_| depth.is_some()).map(|part| part.target.surface_m());
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
