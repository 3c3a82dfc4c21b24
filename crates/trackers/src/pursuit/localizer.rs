//! Two witnesses as one localizer.

use super::PursuitParams;
use super::arbitration::Arbitration;
use super::convention::BoxConvention;
use super::expert::{Expert, Remark};
use super::fusion::{Candidate, Fusion, FusionFigures};
use super::judge::{EXPERT, FILTER, JointEvidence, NETWORK};
use super::offset::SearchOffset;
use super::schedule::NetworkSchedule;
use super::usual::Usual;
use crate::appearance::FirstColors;
use crate::correlation::{CorrelationLocalizer, Evidence, ResponsePeak};
use crate::lightfc::LightFcParams;
use crate::nanotrack::NanoTrackLocalizer;
use pursuit_estimation::{logit, sigmoid};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::siamese::Location;
use pursuit_parameters::Parameters;
use pursuit_tracking::{
    Doubt, Figure, Figures, Localizer, Look, Measurement, Outcome, Result, Search, TrackState, ViewSize,
};
use serde::{Deserialize, Serialize};

/// What is seen of a target that is at least so likely tells what is usual.
const USUAL_FROM: f64 = 0.9;

/// Finds the target by a filter and a network, each searching about a place of its own, and judges what both say.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "WitnessLocalizer")]
pub struct WitnessLocalizer {
    pub(super) params: PursuitParams,
    pub(super) filter: CorrelationLocalizer,
    pub(super) network: NanoTrackLocalizer,
    /// `None` where it is never asked.
    pub(super) expert: Option<Expert<LightFcParams>>,
    pub(super) convention: BoxConvention,
    filter_offset: SearchOffset,
    network_offset: SearchOffset,
    arbitration: Arbitration,
    /// Whether the last frame left a doubt.
    pub(super) doubted: bool,
    pub(super) first_colors: FirstColors,
    pub(super) usual: Usual,
    schedule: NetworkSchedule,
}

/// What both witnesses said in one look.
#[derive(Debug, Clone, Copy)]
pub struct WitnessFinding {
    /// `None` of a rough look at one place of a sweep.
    fused: Option<Fusion>,
    /// Whether the network was asked about the place expected.
    asked: bool,
    /// Likeness of the box's colours to the first ones.
    colors: f64,
}

pursuit_estimation::checked!(WitnessLocalizer);

impl WitnessLocalizer {
    fn restored(self) -> Result<Self, &'static str> {
        if self.params.check_all().is_err() {
            return Err("its settings are out of range");
        }
        let remark = self.expert.as_ref().map_or(Remark::USUAL, Expert::remark);
        if ![remark.score, remark.overlap, remark.embedding].iter().all(|v| v.is_finite()) {
            return Err("what is remembered of a network is not finite");
        }
        if !(self.first_colors.is_sound() && self.usual.is_sound()) {
            return Err("what is remembered of the target's looks is out of range");
        }
        Ok(self)
    }
}

impl WitnessLocalizer {
    /// Two witnesses that know the target at `bbox`.
    ///
    /// # Errors
    /// When the frame lacks what the network needs.
    pub fn new(
        params: PursuitParams,
        filter: CorrelationLocalizer,
        mut network: NanoTrackLocalizer,
        frame: &Frame,
        bbox: BBox,
    ) -> Result<Self> {
        let convention = network
            .look(frame, &bbox)?
            .map_or_else(BoxConvention::default, |seen| BoxConvention::new(&params.fusion, &bbox, &seen.raw));
        let (fusion, networks) = (&params.fusion, &params.networks);
        let expert = (networks.lightfc_every > 0).then(|| Expert::new(&params.expert, fusion, frame, bbox));
        Ok(Self {
            expert: expert.transpose()?,
            params,
            filter,
            network,
            convention,
            filter_offset: SearchOffset::new(&bbox),
            network_offset: SearchOffset::new(&bbox),
            arbitration: Arbitration::default(),
            doubted: false,
            first_colors: FirstColors::new(frame, &bbox),
            usual: Usual::default(),
            schedule: NetworkSchedule::default(),
        })
    }

    /// The candidate `bbox`, `own` in the witness's terms, of which the filter says `filter` and the network `score`.
    pub(super) fn candidate(
        &self,
        (bbox, own): (BBox, BBox),
        filter: Evidence,
        score: f64,
        overlap: f64,
        expected: &BBox,
    ) -> Candidate {
        let moved = bbox.center().distance(expected.center()) / expected.area().sqrt().max(1.0);
        let Evidence { peak, psr, likeness, color, .. } = filter;
        let Remark { score: lightfc, overlap: lightfc_overlap, .. } =
            self.expert.as_ref().map_or(Remark::USUAL, Expert::remark);
        let network = logit(score.clamp(1e-6, 1.0 - 1e-6));
        let evidence = JointEvidence {
            peak,
            likeness,
            color,
            network,
            psr,
            overlap,
            moved,
            lightfc,
            lightfc_overlap,
            likeness_fall: self.usual.likeness_fall(likeness),
            lightfc_fall: self.usual.lightfc_fall(lightfc),
            colors_fall: 0.0,
            embedding_fall: 0.0,
        };
        Candidate { bbox, own, evidence, log_odds: self.params.judge.log_odds(&evidence) }
    }

    /// Asks each witness about the place where it searches; and whether the network had to be asked.
    fn near(&mut self, frame: &Frame, expected: &BBox) -> Result<(Option<Fusion>, bool)> {
        let (by_filter, by_network) = (self.filter_offset.at(expected), self.network_offset.at(expected));
        let peak = self.filter.sight(frame, &by_filter);
        if let Some(fused) = self.rested(peak.as_ref(), expected) {
            return Ok((self.consult(frame, expected, Some(fused), false)?, false));
        }
        let timer = NetworkSchedule::timer(&self.params.fusion);
        let seen = self.network.look(frame, &by_network)?;
        let frames = self.schedule.frames();
        let location = seen.map(|seen| self.network.caught_up(seen, &by_network, frames, frame.size()));
        let fused = self.fuse(frame, expected, peak, location)?;
        self.schedule.spend(timer);
        Ok((self.consult(frame, expected, fused, true)?, true))
    }

    /// What both say if the network need not be asked again.
    fn rested(&self, peak: Option<&ResponsePeak>, expected: &BBox) -> Option<Fusion> {
        let remembered = self.schedule.remembered(&self.params.fusion)?;
        let seen = peak?;
        let bbox = self.filter.window().bbox(seen.center, seen.scale);
        let (network, overlap) = remembered.evidence();
        let filter = self.candidate((bbox, bbox), seen.evidence, sigmoid(network), overlap, expected);
        remembered.agree(&self.params.fusion, filter, (seen.center, seen.scale))
    }

    pub(super) fn fuse(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        peak: Option<ResponsePeak>,
        location: Option<Location>,
    ) -> Result<Option<Fusion>> {
        Ok(match (peak, location) {
            (None, None) => None,
            (Some(peak), Some(location)) => Some(self.fuse_both(frame, expected, &peak, &location)?),
            (Some(seen), None) => {
                let bbox = self.filter.window().bbox(seen.center, seen.scale);
                let filter = Some(self.candidate((bbox, bbox), seen.evidence, 0.0, 0.0, expected));
                Some(Fusion { filter, filter_leads: true, place: Some((seen.center, seen.scale)), ..Fusion::NOTHING })
            }
            (None, Some(location)) => {
                let network = Some(self.of_network(frame, expected, &location, 0.0));
                Some(Fusion { network, ..Fusion::NOTHING })
            }
        })
    }

    /// The network's score of `bbox`: in its last look, if it has `looked` in this frame and had that in sight, or in another one.
    pub(super) fn score_at(&mut self, frame: &Frame, bbox: &BBox, looked: bool) -> Result<f64> {
        match Some(bbox.center()).filter(|_| looked).and_then(|center| self.network.score_at(center)) {
            Some(score) => Ok(score),
            None => Ok(self.network.look(frame, bbox)?.map_or(0.0, |location| location.score)),
        }
    }

    /// What the network found, examined by the filter.
    fn of_network(&mut self, frame: &Frame, expected: &BBox, location: &Location, overlap: f64) -> Candidate {
        let evidence = self.filter.evidence_at(frame, &location.bbox);
        let boxes = (self.convention.of(&location.bbox), location.bbox);
        self.candidate(boxes, evidence, location.score, overlap, expected)
    }

    /// Both found something: one thing, or two that each is asked about.
    fn fuse_both(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        peak: &ResponsePeak,
        location: &Location,
    ) -> Result<Fusion> {
        let bbox = self.filter.window().bbox(peak.center, peak.scale);
        let converted = self.convention.of(&location.bbox);
        let overlap = bbox.iou(&converted);
        let place = Some((peak.center, peak.scale));
        if overlap >= self.params.fusion.agree_from {
            let filter = self.candidate((bbox, bbox), peak.evidence, location.score, overlap, expected);
            let network = Some(Candidate { bbox: converted, own: location.bbox, ..filter });
            let filter = Some(filter);
            return Ok(Fusion { filter, network, agreed: true, filter_leads: true, place, ..Fusion::NOTHING });
        }
        let there = self.score_at(frame, &bbox, true)?;
        let filter = self.candidate((bbox, bbox), peak.evidence, there, overlap, expected);
        let network = self.of_network(frame, expected, location, overlap);
        let odds = Arbitration::now(&self.params.arbitration, &filter.evidence, &network.evidence);
        let filter_leads = self.arbitration.filter_leads(&self.params.arbitration, odds);
        Ok(Fusion { filter: Some(filter), network: Some(network), filter_leads, odds, place, ..Fusion::NOTHING })
    }

    fn measurement(&self, fused: &Fusion) -> Option<Measurement> {
        let leading = fused.leading()?;
        Some(Measurement {
            strength: leading.log_odds,
            psr: Some(leading.evidence.psr),
            diagnostics: fused.figures(),
            ..Measurement::new(fused.bbox(&self.params.fusion)?, sigmoid(leading.log_odds))
        })
    }

    /// Says where each witness searches in the next frame: `fused` was found at `reported`.
    fn place_searches(&mut self, fused: &Fusion, reported: &BBox, state: TrackState) {
        if state == TrackState::Lost {
            return;
        }
        let Self { params, filter_offset, network_offset, arbitration, expert, .. } = self;
        arbitration.remember(&params.arbitration, fused.odds);
        if let (Some(expert), Some(candidate)) = (expert, &fused.expert) {
            expert.place(&candidate.own, reported);
        }
        if let Some(candidate) = fused.taken() {
            network_offset.set(&candidate.own, reported);
            let keeps = fused.filter.as_ref().filter(|_| fused.filter_keeps(&params.fusion));
            filter_offset.set(keeps.map_or(reported, |candidate| &candidate.own), reported);
            return;
        }
        if let Some(candidate) = &fused.network {
            // Of what both agree on, the network looks in the middle of what is reported, for the size it saw itself.
            let own = if fused.agreed { candidate.own.centered_at(reported.center()) } else { candidate.own };
            network_offset.set(&own, reported);
        }
        if let Some(candidate) = &fused.filter {
            let own = if fused.agreed && !fused.filter_keeps(&params.fusion) { reported } else { &candidate.own };
            filter_offset.set(own, reported);
        }
        if fused.agreed {
            return;
        }
        // One that saw nothing, or that the arbitration is against, goes where the other is.
        match (arbitration.settled(&params.arbitration), &fused.filter, &fused.network) {
            (_, Some(candidate), None) | (Some(true), Some(candidate), _) => {
                network_offset.set(&candidate.own, reported)
            }
            (_, None, Some(candidate)) | (Some(false), _, Some(candidate)) => {
                filter_offset.set(&candidate.bbox, reported)
            }
            _ => {}
        }
    }
}

impl Localizer for WitnessLocalizer {
    type Finding = WitnessFinding;

    const FIGURES: &[&[Figure]] = &[FusionFigures::ALL, FILTER, NETWORK, EXPERT];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, WitnessFinding)>> {
        let expected = &search.expected;
        let (fused, asked) = match search.look {
            Look::Near => self.near(frame, expected)?,
            Look::Sweep => {
                let found = self.network.look(frame, expected)?;
                return Ok(found.map(|l| {
                    let measurement = Measurement { strength: l.score, ..Measurement::new(l.bbox, 0.0) };
                    (measurement, WitnessFinding { fused: None, asked: false, colors: 0.0 })
                }));
            }
            Look::Centred => (self.centred(frame, expected)?, false),
        };
        let Some(fused) = fused else { return Ok(None) };
        let (fused, colors) = self.judged(frame, fused, search.look);
        Ok(self
            .measurement(&fused)
            .map(|measurement| (measurement, WitnessFinding { fused: Some(fused), asked, colors })))
    }

    /// Measures the size by the filter along scale, where the filter saw the target.
    fn refine(
        &mut self,
        frame: &Frame,
        _: &Search,
        measurement: &mut Measurement,
        finding: &mut WitnessFinding,
    ) -> Result<()> {
        let Some(fused) = &mut finding.fused else { return Ok(()) };
        if let (Some((center, scale)), Some(candidate), true) =
            (fused.place, &mut fused.filter, fused.filter_leads || fused.expert_leads)
        {
            let scale = self.filter.scale_at(frame, center, scale)?;
            candidate.bbox = self.filter.window().bbox(center, scale);
            candidate.own = candidate.bbox;
            // The proposer may have moved the middle into the frame; the size alone is new.
            if let Some(bbox) = fused.bbox(&self.params.fusion) {
                measurement.bbox = bbox.centered_at(measurement.bbox.center());
            }
            measurement.diagnostics = fused.figures();
        }
        Ok(())
    }

    /// Teaches the filter what both believe, or the judge of one alone.
    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &WitnessFinding) -> Result<()> {
        let Some((fused, leading)) = finding.fused.as_ref().and_then(|f| Some((f, f.leading()?))) else {
            return Ok(());
        };
        let (fusion, peak) = (&self.params.fusion, leading.evidence.peak);
        match &fused.filter {
            Some(candidate) if fused.filter_keeps(fusion) => self.filter.learn(frame, &candidate.own, peak)?,
            _ if (!fused.expert_leads && (fused.agreed || fused.filter_leads))
                || sigmoid(leading.log_odds) >= fusion.teach_from =>
            {
                self.filter.learn(frame, &bbox, peak)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn doubt(&self, _: &Frame, _: &BBox, finding: Option<&WitnessFinding>) -> Option<Doubt> {
        // Where neither witness saw anything there is nothing like the target.
        let fused = finding.and_then(|finding| finding.fused);
        Some(fused.map_or(Doubt::Covered, |fused| fused.doubt(&self.params.fusion)))
    }

    fn observe(&mut self, _: &Frame, outcome: &Outcome<'_, WitnessFinding>) -> Result<()> {
        let fused = outcome.found.and_then(|(_, finding)| finding.fused.as_ref());
        let concluded = fused.filter(|_| outcome.state == TrackState::Tracking);
        self.doubted = outcome.state != TrackState::Tracking;
        if let Some(sure) = concluded.and_then(Fusion::leading).filter(|c| c.log_odds >= logit(USUAL_FROM)) {
            self.usual.learn(&sure.evidence);
        }
        if let (Some(fused), Some((_, finding))) = (concluded, &outcome.found) {
            self.usual.learn_looks(finding.colors, fused.remark.map(|remark| remark.embedding));
        }
        let asked = outcome.found.is_some_and(|(_, finding)| finding.asked);
        self.schedule.note(&self.params.fusion, concluded, asked);
        if let Some(expert) = &mut self.expert {
            expert.note(fused.and_then(|fused| fused.remark));
        }
        if let Some((reported, WitnessFinding { fused: Some(fused), .. })) = outcome.found {
            self.place_searches(fused, &reported, outcome.state);
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.filter.restart(frame, bbox)?;
        self.network.restart(frame, bbox)?;
        *self = Self::new(self.params.clone(), self.filter.clone(), self.network.clone(), frame, bbox)?;
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        self.network.view(expected)
    }
}
