//! Two witnesses as one localizer.

use super::PursuitParams;
use super::arbitration::Arbitration;
use super::convention::BoxConvention;
use super::fusion::{Candidate, Fusion};
use super::judge::JointEvidence;
use super::offset::SearchOffset;
use super::rest::Rest;
use crate::correlation::{CorrelationLocalizer, Evidence, Sighting, probability};
use crate::nanotrack::NanoTrackLocalizer;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::siamese::Location;
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{Doubt, Localizer, Look, Measurement, Outcome, Result, Search, TrackState, ViewSize};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Finds the target by a filter and a network, each searching about a place of its own, and judges what both say.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct WitnessLocalizer {
    params: PursuitParams,
    filter: CorrelationLocalizer,
    network: NanoTrackLocalizer,
    convention: BoxConvention,
    filter_offset: SearchOffset,
    network_offset: SearchOffset,
    /// As large as the target was when it was believed last: a sweep looks for that.
    believed: SearchOffset,
    arbitration: Arbitration,
    rest: Rest,
    #[serde(skip)]
    fusions: Fusions,
}

/// What was concluded in this frame; not state.
#[derive(Debug, Clone, Copy, Default)]
struct Fusions {
    /// Near the expected place.
    near: Option<Fusion>,
    /// At the best place of a sweep.
    swept: Option<Fusion>,
    /// What the loop decided on.
    decided: Option<Fusion>,
    /// How long the network took near the expected place, where it was asked there, milliseconds.
    asked_ms: Option<f64>,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: PursuitParams,
    filter: CorrelationLocalizer,
    network: NanoTrackLocalizer,
    convention: BoxConvention,
    filter_offset: SearchOffset,
    network_offset: SearchOffset,
    believed: SearchOffset,
    arbitration: Arbitration,
    rest: Rest,
}

impl TryFrom<Raw> for WitnessLocalizer {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, filter, network, convention, filter_offset, network_offset, believed, arbitration, rest } =
            raw;
        if params.check_all().is_err() {
            return Err("its settings are out of range");
        }
        let fusions = Fusions::default();
        Ok(Self {
            params,
            filter,
            network,
            convention,
            filter_offset,
            network_offset,
            believed,
            arbitration,
            rest,
            fusions,
        })
    }
}

/// Log odds of a network's score.
fn logit(score: f64) -> f64 {
    let score = score.clamp(1e-6, 1.0 - 1e-6);
    (score / (1.0 - score)).ln()
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
        Ok(Self {
            params,
            filter,
            network,
            convention,
            filter_offset: SearchOffset::new(&bbox),
            network_offset: SearchOffset::new(&bbox),
            believed: SearchOffset::new(&bbox),
            arbitration: Arbitration::default(),
            rest: Rest::default(),
            fusions: Fusions::default(),
        })
    }

    /// The candidate `bbox`, `own` in the witness's terms, of which the filter says `filter` and the network `score`.
    fn candidate(
        &self,
        (bbox, own): (BBox, BBox),
        filter: Evidence,
        score: f64,
        overlap: f64,
        expected: &BBox,
    ) -> Candidate {
        let moved = bbox.center().distance(expected.center()) / expected.area().sqrt().max(1.0);
        let evidence = JointEvidence { filter, network: logit(score), overlap, moved };
        Candidate { bbox, own, evidence, log_odds: self.params.judge.log_odds(&evidence) }
    }

    /// Asks each witness about the place where it searches.
    fn near(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Fusion>> {
        let (by_filter, by_network) = (self.filter_offset.at(expected), self.network_offset.at(expected));
        let sighting = self.filter.sight(frame, &by_filter);
        if let Some(fused) = self.rested(sighting.as_ref(), expected) {
            return Ok(Some(fused));
        }
        let began = Instant::now();
        let seen = self.network.look(frame, &by_network)?;
        let location = seen.map(|seen| self.network.caught_up(seen, &by_network, self.rest.frames(), frame.size()));
        let fused = self.fuse(frame, expected, sighting, location, &by_network);
        self.fusions.asked_ms = Some(1e3 * began.elapsed().as_secs_f64());
        fused
    }

    /// What both say if the network need not be asked again.
    fn rested(&self, sighting: Option<&Sighting>, expected: &BBox) -> Option<Fusion> {
        let remembered = self.rest.remembered(&self.params.fusion)?;
        let seen = sighting?;
        let bbox = self.filter.window().bbox(seen.center, seen.scale);
        let (network, overlap) = remembered.evidence();
        let filter = self.candidate((bbox, bbox), seen.evidence, probability(network), overlap, expected);
        remembered.agree(&self.params.fusion, filter, (seen.center, seen.scale))
    }

    /// Asks the network at a place of a sweep, and the filter where the network saw the target.
    fn centred(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Fusion>> {
        let Some(location) = self.network.look(frame, expected)? else { return Ok(None) };
        let sighting = self.filter.sight(frame, &self.convention.of(&location.bbox));
        self.fuse(frame, expected, sighting, Some(location), expected)
    }

    fn fuse(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        sighting: Option<Sighting>,
        location: Option<Location>,
        about: &BBox,
    ) -> Result<Option<Fusion>> {
        let alone = Fusion { filter: None, network: None, agreed: false, filter_leads: false, odds: 0.0, place: None };
        Ok(match (sighting, location) {
            (None, None) => None,
            (Some(sighting), Some(location)) => Some(self.fuse_both(frame, expected, &sighting, &location, about)?),
            (Some(seen), None) => {
                let bbox = self.filter.window().bbox(seen.center, seen.scale);
                let filter = Some(self.candidate((bbox, bbox), seen.evidence, 0.0, 0.0, expected));
                Some(Fusion { filter, filter_leads: true, place: Some((seen.center, seen.scale)), ..alone })
            }
            (None, Some(location)) => {
                let network = Some(self.of_network(frame, expected, &location, 0.0));
                Some(Fusion { network, ..alone })
            }
        })
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
        sighting: &Sighting,
        location: &Location,
        about: &BBox,
    ) -> Result<Fusion> {
        let bbox = self.filter.window().bbox(sighting.center, sighting.scale);
        let converted = self.convention.of(&location.bbox);
        let overlap = bbox.iou(&converted);
        let place = Some((sighting.center, sighting.scale));
        if overlap >= self.params.fusion.agree_from {
            let filter = self.candidate((bbox, bbox), sighting.evidence, location.score, overlap, expected);
            let network = Some(Candidate { bbox: converted, own: location.bbox, ..filter });
            let filter = Some(filter);
            return Ok(Fusion { filter, network, agreed: true, filter_leads: true, odds: 0.0, place });
        }
        let there = match self.network.score_at(about, bbox.center()) {
            Some(score) => score,
            None => self.network.look(frame, &bbox)?.map_or(0.0, |l| l.score),
        };
        let filter = self.candidate((bbox, bbox), sighting.evidence, there, overlap, expected);
        let network = self.of_network(frame, expected, location, overlap);
        let odds = Arbitration::now(&self.params.arbitration, &filter.evidence, &network.evidence);
        let filter_leads = self.arbitration.filter_leads(&self.params.arbitration, odds);
        Ok(Fusion { filter: Some(filter), network: Some(network), agreed: false, filter_leads, odds, place })
    }

    fn measurement(&self, fused: &Fusion) -> Option<Measurement> {
        let leading = fused.leading()?;
        Some(Measurement {
            strength: leading.log_odds,
            peak: Some(leading.evidence.filter.peak),
            psr: Some(leading.evidence.filter.psr),
            diagnostics: fused.figures(),
            ..Measurement::new(fused.bbox(&self.params.fusion)?, probability(leading.log_odds))
        })
    }

    /// Says where each witness searches in the next frame.
    fn place_searches(&mut self, found: Option<&Measurement>, state: TrackState) {
        let (Some(fused), Some(found)) = (std::mem::take(&mut self.fusions).decided, found) else { return };
        if state == TrackState::Lost {
            return;
        }
        let Self { params, filter_offset, network_offset, believed, arbitration, .. } = self;
        let reported = &found.bbox;
        if state == TrackState::Tracking {
            believed.set(reported, reported);
        }
        arbitration.remember(&params.arbitration, fused.odds);
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
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let expected = &search.expected;
        let fused = match search.look {
            Look::Near => {
                // What was decided of another frame, or in passing, is nothing to go by.
                self.fusions = Fusions::default();
                self.fusions.near = self.near(frame, expected)?;
                self.fusions.near
            }
            Look::Sweep => {
                let found = self.network.look(frame, &self.believed.at(expected))?;
                return Ok(found.map(|l| Measurement { strength: l.score, ..Measurement::new(l.bbox, 0.0) }));
            }
            Look::Centred => {
                self.fusions.swept = self.centred(frame, &self.believed.at(expected))?;
                self.fusions.swept
            }
        };
        Ok(fused.and_then(|fused| self.measurement(&fused)))
    }

    /// Measures the size by the filter along scale, where the filter saw the target.
    fn refine(&mut self, frame: &Frame, found: Measurement, look: Look) -> Result<Measurement> {
        self.fusions.decided = if look == Look::Near { self.fusions.near } else { self.fusions.swept };
        let Some(fused) = &mut self.fusions.decided else { return Ok(found) };
        let (Some((center, scale)), Some(candidate), true) = (fused.place, &mut fused.filter, fused.filter_leads)
        else {
            return Ok(found);
        };
        let scale = self.filter.scale_at(frame, center, scale);
        candidate.bbox = self.filter.window().bbox(center, scale);
        candidate.own = candidate.bbox;
        // The proposer may have moved the middle into the frame; the size alone is new.
        let bbox = fused.bbox(&self.params.fusion).map_or(found.bbox, |b| b.centered_at(found.bbox.center()));
        Ok(Measurement { bbox, diagnostics: fused.figures(), ..found })
    }

    /// Teaches the filter what both believe, or the judge of one alone.
    fn adapt(&mut self, frame: &Frame, bbox: BBox, measurement: &Measurement) -> Result<()> {
        let Some(fused) = &self.fusions.decided else { return Ok(()) };
        let fusion = &self.params.fusion;
        match &fused.filter {
            Some(candidate) if fused.filter_keeps(fusion) => self.filter.adapt(frame, candidate.own, measurement),
            _ if fused.agreed || fused.filter_leads || measurement.confidence >= fusion.teach_from => {
                self.filter.adapt(frame, bbox, measurement)
            }
            _ => Ok(()),
        }
    }

    fn doubt(&self, _: &Frame, _: &BBox) -> Option<Doubt> {
        // Where neither witness saw anything there is nothing like the target.
        Some(self.fusions.decided.map_or(Doubt::Covered, |fused| fused.doubt(&self.params.fusion)))
    }

    fn observe(&mut self, _: &Frame, outcome: &Outcome<'_>) -> Result<()> {
        let concluded =
            self.fusions.decided.filter(|_| outcome.state == TrackState::Tracking && outcome.found.is_some());
        self.rest.note(&self.params.fusion, concluded.as_ref(), self.fusions.asked_ms);
        self.place_searches(outcome.found, outcome.state);
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.filter.restart(frame, bbox)?;
        self.network.restart(frame, bbox)?;
        *self = Self::new(self.params.clone(), self.filter.clone(), self.network.clone(), frame, bbox)?;
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        self.network.view(&self.believed.at(expected))
    }
}
