//! Two witnesses as one localizer.

use super::PursuitParams;
use super::hearing::{Claim, Hearing};
use super::judge::Testimony;
use super::meaning::Meaning;
use super::rivalry::Rivalry;
use super::seat::Seat;
use crate::correlation::{CorrelationLocalizer, Evidence, Sighting, probability};
use crate::nanotrack::NanoTrackLocalizer;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::siamese::Location;
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{Localizer, Look, Measurement, Outcome, Result, Search, TrackState, ViewSize};
use serde::{Deserialize, Serialize};

/// Finds the target by a filter and a network, each from its own seat, and judges what both say.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct WitnessLocalizer {
    params: PursuitParams,
    filter: CorrelationLocalizer,
    network: NanoTrackLocalizer,
    meaning: Meaning,
    filter_seat: Seat,
    network_seat: Seat,
    /// As large as the target was when it was believed last: a sweep looks for that.
    believed: Seat,
    rivalry: Rivalry,
    #[serde(skip)]
    heard: Heard,
}

/// What was heard in this frame; not state.
#[derive(Debug, Clone, Copy, Default)]
struct Heard {
    /// Near the expected place.
    near: Option<Hearing>,
    /// At the best place of a sweep.
    swept: Option<Hearing>,
    /// What the loop decided on.
    decided: Option<Hearing>,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: PursuitParams,
    filter: CorrelationLocalizer,
    network: NanoTrackLocalizer,
    meaning: Meaning,
    filter_seat: Seat,
    network_seat: Seat,
    believed: Seat,
    rivalry: Rivalry,
}

impl TryFrom<Raw> for WitnessLocalizer {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, filter, network, meaning, filter_seat, network_seat, believed, rivalry } = raw;
        if params.check_all().is_err() {
            return Err("its settings are out of range");
        }
        let heard = Heard::default();
        Ok(Self { params, filter, network, meaning, filter_seat, network_seat, believed, rivalry, heard })
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
        let meaning = network.look(frame, &bbox)?.map_or_else(Meaning::default, |seen| {
            Meaning::new(&bbox, &seen.raw, params.together.meant_center, params.together.meant_size)
        });
        Ok(Self {
            params,
            filter,
            network,
            meaning,
            filter_seat: Seat::new(&bbox),
            network_seat: Seat::new(&bbox),
            believed: Seat::new(&bbox),
            rivalry: Rivalry::default(),
            heard: Heard::default(),
        })
    }

    /// A claim to `bbox`, `own` in the witness's terms, of which the filter says `filter` and the network `score`.
    fn claim(&self, (bbox, own): (BBox, BBox), filter: Evidence, score: f64, together: f64, expected: &BBox) -> Claim {
        let moved = bbox.center().distance(expected.center()) / expected.area().sqrt().max(1.0);
        let said = Testimony { filter, network: logit(score), together, moved };
        Claim { bbox, own, said, log_odds: self.params.judge.log_odds(&said) }
    }

    /// Hears the filter from `filter_seat` and the network from `network_seat`.
    fn near(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Hearing>> {
        let (filter_seat, network_seat) = (self.filter_seat.at(expected), self.network_seat.at(expected));
        let sighting = self.filter.sight(frame, &filter_seat);
        let location = self.network.look(frame, &network_seat)?;
        self.hear(frame, expected, sighting, location, &network_seat)
    }

    /// Hears the network at a place of a sweep, and the filter where the network saw the target.
    fn centred(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Hearing>> {
        let Some(location) = self.network.look(frame, expected)? else { return Ok(None) };
        let sighting = self.filter.sight(frame, &self.meaning.of(&location.bbox));
        self.hear(frame, expected, sighting, Some(location), expected)
    }

    fn hear(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        sighting: Option<Sighting>,
        location: Option<Location>,
        network_seat: &BBox,
    ) -> Result<Option<Hearing>> {
        let alone = Hearing { filter: None, network: None, agreed: false, filter_leads: false, odds: 0.0, place: None };
        Ok(match (sighting, location) {
            (None, None) => None,
            (Some(sighting), Some(location)) => {
                Some(self.confront(frame, expected, &sighting, &location, network_seat)?)
            }
            (Some(seen), None) => {
                let bbox = self.filter.window().bbox(seen.center, seen.scale);
                let filter = Some(self.claim((bbox, bbox), seen.evidence, 0.0, 0.0, expected));
                Some(Hearing { filter, filter_leads: true, place: Some((seen.center, seen.scale)), ..alone })
            }
            (None, Some(location)) => {
                let network = Some(self.of_network(frame, expected, &location, 0.0));
                Some(Hearing { network, ..alone })
            }
        })
    }

    /// What the network found, examined by the filter.
    fn of_network(&mut self, frame: &Frame, expected: &BBox, location: &Location, together: f64) -> Claim {
        let evidence = self.filter.evidence_at(frame, &location.bbox);
        let boxes = (self.meaning.of(&location.bbox), location.bbox);
        self.claim(boxes, evidence, location.score, together, expected)
    }

    /// Both found something: one thing, or two that each is asked about.
    fn confront(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        sighting: &Sighting,
        location: &Location,
        network_seat: &BBox,
    ) -> Result<Hearing> {
        let bbox = self.filter.window().bbox(sighting.center, sighting.scale);
        let meant = self.meaning.of(&location.bbox);
        let together = bbox.iou(&meant);
        let place = Some((sighting.center, sighting.scale));
        if together >= self.params.together.agree_from {
            let filter = self.claim((bbox, bbox), sighting.evidence, location.score, together, expected);
            let network = Some(Claim { bbox: meant, own: location.bbox, ..filter });
            let filter = Some(filter);
            return Ok(Hearing { filter, network, agreed: true, filter_leads: true, odds: 0.0, place });
        }
        let there = match self.network.score_at(network_seat, bbox.center()) {
            Some(score) => score,
            None => self.network.look(frame, &bbox)?.map_or(0.0, |l| l.score),
        };
        let filter = self.claim((bbox, bbox), sighting.evidence, there, together, expected);
        let network = self.of_network(frame, expected, location, together);
        let odds = Rivalry::now(&self.params.rivalry, &filter.said, &network.said);
        let filter_leads = self.rivalry.filter_leads(&self.params.rivalry, odds);
        Ok(Hearing { filter: Some(filter), network: Some(network), agreed: false, filter_leads, odds, place })
    }

    fn measurement(&self, heard: &Hearing) -> Option<Measurement> {
        let leading = heard.leading()?;
        Some(Measurement {
            strength: leading.log_odds,
            peak: Some(leading.said.filter.peak),
            psr: Some(leading.said.filter.psr),
            diagnostics: heard.figures(),
            ..Measurement::new(heard.bbox(&self.params.together)?, probability(leading.log_odds))
        })
    }

    /// Seats both witnesses for the next frame.
    fn seat_both(&mut self, found: Option<&Measurement>, state: TrackState) {
        let (Some(heard), Some(found)) = (std::mem::take(&mut self.heard).decided, found) else { return };
        if state == TrackState::Lost {
            return;
        }
        let Self { params, filter_seat, network_seat, believed, rivalry, .. } = self;
        let reported = &found.bbox;
        if state == TrackState::Tracking {
            believed.sit(reported, reported);
        }
        rivalry.remember(&params.rivalry, heard.odds);
        if let Some(claim) = &heard.network {
            // Of what both agree on, the network looks in the middle of what is reported, for the size it saw itself.
            let own = if heard.agreed { claim.own.centered_at(reported.center()) } else { claim.own };
            network_seat.sit(&own, reported);
        }
        if let Some(claim) = &heard.filter {
            let own = if heard.agreed && !heard.filter_keeps(&params.together) { reported } else { &claim.own };
            filter_seat.sit(own, reported);
        }
        if heard.agreed {
            return;
        }
        // One that saw nothing, or whose cause is lost, goes where the other is.
        match (rivalry.settled(&params.rivalry), &heard.filter, &heard.network) {
            (_, Some(claim), None) | (Some(true), Some(claim), _) => network_seat.sit(&claim.own, reported),
            (_, None, Some(claim)) | (Some(false), _, Some(claim)) => filter_seat.sit(&claim.bbox, reported),
            _ => {}
        }
    }
}

impl Localizer for WitnessLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let expected = &search.expected;
        let heard = match search.look {
            Look::Near => {
                self.heard.near = self.near(frame, expected)?;
                self.heard.near
            }
            Look::Sweep => {
                let found = self.network.look(frame, &self.believed.at(expected))?;
                return Ok(found.map(|l| Measurement { strength: l.score, ..Measurement::new(l.bbox, 0.0) }));
            }
            Look::Centred => {
                self.heard.swept = self.centred(frame, &self.believed.at(expected))?;
                self.heard.swept
            }
        };
        Ok(heard.and_then(|heard| self.measurement(&heard)))
    }

    /// Measures the size by the filter along scale, where the filter saw the target.
    fn refine(&mut self, frame: &Frame, found: Measurement, look: Look) -> Result<Measurement> {
        self.heard.decided = if look == Look::Near { self.heard.near } else { self.heard.swept };
        let Some(heard) = &mut self.heard.decided else { return Ok(found) };
        let (Some((center, scale)), Some(claim), true) = (heard.place, &mut heard.filter, heard.filter_leads) else {
            return Ok(found);
        };
        let scale = self.filter.scale_at(frame, center, scale);
        claim.bbox = self.filter.window().bbox(center, scale);
        claim.own = claim.bbox;
        // The proposer may have moved the middle into the frame; the size alone is new.
        let bbox = heard.bbox(&self.params.together).map_or(found.bbox, |b| b.centered_at(found.bbox.center()));
        Ok(Measurement { bbox, diagnostics: heard.figures(), ..found })
    }

    /// Teaches the filter what both believe, or the judge of one alone.
    fn adapt(&mut self, frame: &Frame, bbox: BBox, measurement: &Measurement) -> Result<()> {
        let Some(heard) = &self.heard.decided else { return Ok(()) };
        let together = &self.params.together;
        match &heard.filter {
            Some(claim) if heard.filter_keeps(together) => self.filter.adapt(frame, claim.own, measurement),
            _ if heard.agreed || heard.filter_leads || measurement.confidence >= together.teach_from => {
                self.filter.adapt(frame, bbox, measurement)
            }
            _ => Ok(()),
        }
    }

    fn observe(&mut self, _: &Frame, outcome: &Outcome<'_>) -> Result<()> {
        self.seat_both(outcome.found, outcome.state);
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
