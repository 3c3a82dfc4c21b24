//! Two witnesses as one localizer.

use super::TogetherParams;
use super::judge::{JudgeParams, Testimony};
use super::seat::Seat;
use crate::correlation::{CorrelationLocalizer, Evidence, Sighting, probability};
use crate::nanotrack::NanoTrackLocalizer;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_inference::siamese::Location;
use pursuit_tracking::{Diagnostics, Localizer, Look, Measurement, Result, Search, TrackState, ViewSize};
use serde::{Deserialize, Serialize};

/// Standing of a witness that has said nothing yet, in log odds.
const FIRST_STANDING: f64 = 3.0;

/// Finds the target by a filter and a network, each from its own seat, and judges what both say.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct WitnessLocalizer {
    together: TogetherParams,
    judge: JudgeParams,
    filter: CorrelationLocalizer,
    network: NanoTrackLocalizer,
    filter_seat: Seat,
    network_seat: Seat,
    /// What was heard near the expected place in this frame, and what at the best place of a sweep.
    #[serde(skip)]
    near: Option<Hearing>,
    #[serde(skip)]
    swept: Option<Hearing>,
    /// The one that the loop decided on.
    #[serde(skip)]
    decided: Option<Hearing>,
}

/// One witness's box and what speaks for it, in log odds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Claim {
    bbox: BBox,
    said: Testimony,
    log_odds: f64,
}

/// What was heard of one place.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hearing {
    filter: Option<Claim>,
    network: Option<Claim>,
    /// Whether both speak of one thing.
    agreed: bool,
    /// Whether the filter's claim is the one believed, of claims that differ.
    filter_leads: bool,
    /// Scale of the target in the filter's own terms, where the filter saw it.
    place: Option<(Point, f64)>,
}

impl Hearing {
    fn leading(&self) -> Option<&Claim> {
        if self.filter_leads { self.filter.as_ref() } else { self.network.as_ref() }
    }
}

fn logit(score: f64) -> f64 {
    let score = score.clamp(1e-6, 1.0 - 1e-6);
    (score / (1.0 - score)).ln()
}

impl WitnessLocalizer {
    /// Two witnesses that know the target at `bbox`.
    pub fn new(
        together: TogetherParams,
        judge: JudgeParams,
        filter: CorrelationLocalizer,
        network: NanoTrackLocalizer,
        bbox: &BBox,
    ) -> Self {
        let seat = Seat::new(bbox, FIRST_STANDING);
        Self {
            together,
            judge,
            filter,
            network,
            filter_seat: seat,
            network_seat: seat,
            near: None,
            swept: None,
            decided: None,
        }
    }

    fn claim(&self, bbox: BBox, filter: Evidence, network: f64, together: f64, expected: &BBox) -> Claim {
        let moved = bbox.center().distance(expected.center()) / expected.area().sqrt().max(1.0);
        let said = Testimony { filter, network: logit(network), together, moved };
        Claim { bbox, said, log_odds: self.judge.log_odds(&said) }
    }

    /// Hears both witnesses, each from its own seat.
    fn hear(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Hearing>> {
        let (filter_seat, network_seat) = (self.filter_seat.at(expected), self.network_seat.at(expected));
        let sighting = self.filter.sight(frame, &filter_seat);
        let location = self.network.look(frame, &network_seat)?;
        Ok(match (sighting, location) {
            (None, None) => None,
            (Some(sighting), Some(location)) => {
                Some(self.confront(frame, expected, &sighting, &location, &network_seat)?)
            }
            (Some(s), None) => {
                let bbox = self.filter.window().bbox(s.center, s.scale);
                let claim = self.claim(bbox, s.evidence, 0.0, 0.0, expected);
                Some(Hearing {
                    filter: Some(claim),
                    network: None,
                    agreed: false,
                    filter_leads: true,
                    place: Some((s.center, s.scale)),
                })
            }
            (None, Some(location)) => Some(self.follow_network(frame, expected, &location)),
        })
    }

    /// What the network found, examined by the filter.
    fn follow_network(&mut self, frame: &Frame, expected: &BBox, location: &Location) -> Hearing {
        let evidence = self.filter.evidence_at(frame, &location.bbox);
        let claim = self.claim(location.bbox, evidence, location.score, 0.0, expected);
        Hearing { filter: None, network: Some(claim), agreed: false, filter_leads: false, place: None }
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
        let together = bbox.iou(&location.bbox);
        let agreed = together >= self.together.agree_from;
        let place = Some((sighting.center, sighting.scale));
        if agreed {
            let filter = self.claim(bbox, sighting.evidence, location.score, together, expected);
            let network = Claim { bbox: location.bbox, ..filter };
            return Ok(Hearing { filter: Some(filter), network: Some(network), agreed, filter_leads: true, place });
        }
        let there = match self.network.score_at(network_seat, bbox.center()) {
            Some(score) => score,
            None => self.network.look(frame, &bbox)?.map_or(0.0, |l| l.score),
        };
        let filter = self.claim(bbox, sighting.evidence, there, together, expected);
        let evidence = self.filter.evidence_at(frame, &location.bbox);
        let network = self.claim(location.bbox, evidence, location.score, together, expected);
        let weigh = |claim: &Claim, seat: &Seat| claim.log_odds + self.together.standing * seat.standing();
        let filter_leads = weigh(&filter, &self.filter_seat) > weigh(&network, &self.network_seat);
        Ok(Hearing { filter: Some(filter), network: Some(network), agreed, filter_leads, place })
    }

    fn measurement(&self, heard: &Hearing) -> Option<Measurement> {
        let leading = heard.leading()?;
        let bbox = match (heard.agreed, heard.filter, heard.network) {
            (true, Some(filter), Some(network)) => self.joined(&filter.bbox, &network.bbox),
            _ => leading.bbox,
        };
        Some(Measurement {
            strength: leading.log_odds,
            peak: Some(leading.said.filter.peak),
            psr: Some(leading.said.filter.psr),
            diagnostics: figures(heard),
            ..Measurement::new(bbox, probability(leading.log_odds))
        })
    }

    /// One box of two that are of one thing.
    fn joined(&self, filter: &BBox, network: &BBox) -> BBox {
        let mix = |share: f64, a: f64, b: f64| a + share * (b - a);
        let (here, there) = (filter.center(), network.center());
        let share = self.together.network_center;
        let center = Point::new(mix(share, here.x, there.x), mix(share, here.y, there.y));
        let share = self.together.network_size;
        BBox::from_center_size(
            center,
            mix(share, filter.width(), network.width()),
            mix(share, filter.height(), network.height()),
        )
    }
}

/// What each witness said, for the files.
fn figures(heard: &Hearing) -> Diagnostics {
    let mut figures = Diagnostics::default()
        .with("agreed", f64::from(u8::from(heard.agreed)))
        .with("filter_leads", f64::from(u8::from(heard.filter_leads)));
    if let Some(Claim { bbox, said, .. }) = &heard.filter {
        let (x, y, w, h) = bbox.ltwh();
        let boxed = [("filter_x", x), ("filter_y", y), ("filter_w", w), ("filter_h", h)];
        let rest = [
            ("filter_peak", said.filter.peak),
            ("filter_likeness", said.filter.likeness),
            ("filter_color", said.filter.color),
            ("filter_psr", said.filter.psr),
            ("filter_score", said.network),
            ("filter_moved", said.moved),
        ];
        boxed.into_iter().chain(rest).for_each(|(name, value)| figures.push(name, value));
    }
    if let Some(Claim { bbox, said, .. }) = &heard.network {
        let (x, y, w, h) = bbox.ltwh();
        let boxed = [("network_x", x), ("network_y", y), ("network_w", w), ("network_h", h)];
        let rest = [
            ("network_peak", said.filter.peak),
            ("network_likeness", said.filter.likeness),
            ("network_color", said.filter.color),
            ("network_psr", said.filter.psr),
            ("network_score", said.network),
            ("network_moved", said.moved),
        ];
        boxed.into_iter().chain(rest).for_each(|(name, value)| figures.push(name, value));
    }
    figures
}

impl Localizer for WitnessLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let expected = &search.expected;
        match search.look {
            Look::Near => {
                self.near = self.hear(frame, expected)?;
                Ok(self.near.and_then(|heard| self.measurement(&heard)))
            }
            Look::Sweep => {
                let found = self.network.look(frame, expected)?;
                Ok(found.map(|l| Measurement { strength: l.score, ..Measurement::new(l.bbox, 0.0) }))
            }
            Look::Centred => {
                let found = self.network.look(frame, expected)?;
                self.swept = found.map(|location| self.follow_network(frame, expected, &location));
                Ok(self.swept.and_then(|heard| self.measurement(&heard)))
            }
        }
    }

    /// Measures the size by the filter along scale, where the filter saw the target.
    fn refine(&mut self, frame: &Frame, found: Measurement, look: Look) -> Result<Measurement> {
        self.decided = if look == Look::Near { self.near } else { self.swept };
        let Some(heard) = &mut self.decided else { return Ok(found) };
        let (Some((center, scale)), Some(claim)) = (heard.place, &mut heard.filter) else { return Ok(found) };
        if !heard.filter_leads {
            return Ok(found);
        }
        let scale = self.filter.scale_at(frame, center, scale);
        claim.bbox = self.filter.window().bbox(center, scale);
        let heard = *heard;
        let bbox = self.measurement(&heard).map_or(found.bbox, |m| m.bbox);
        // The proposer may have moved the middle into the frame.
        let bbox = if found.bbox.center() == bbox.center() { bbox } else { bbox.centered_at(found.bbox.center()) };
        Ok(Measurement { bbox, diagnostics: figures(&heard), ..found })
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, measurement: &Measurement) -> Result<()> {
        let Some(heard) = &self.decided else { return Ok(()) };
        if heard.agreed || heard.filter_leads || measurement.confidence >= self.together.teach_from {
            self.filter.adapt(frame, bbox, measurement)?;
        }
        Ok(())
    }

    fn conclude(&mut self, found: Option<&Measurement>, state: TrackState) {
        let (Some(heard), Some(found)) = (self.decided.take(), found) else { return };
        let Self { together, filter_seat, network_seat, .. } = self;
        if state == TrackState::Lost {
            return;
        }
        for (claim, seat) in [(&heard.filter, &mut *filter_seat), (&heard.network, &mut *network_seat)] {
            if let Some(claim) = claim {
                seat.hear(claim.log_odds, together.standing_rate);
                // The one that leads is where the loop is; so are both that agree.
                seat.sit(&claim.bbox, if heard.agreed { &claim.bbox } else { &found.bbox });
            }
        }
        let (leads, other) =
            if heard.filter_leads { (&*filter_seat, &mut *network_seat) } else { (&*network_seat, &mut *filter_seat) };
        let alone = heard.filter.is_none() || heard.network.is_none();
        if alone || (!heard.agreed && leads.standing() - other.standing() >= together.reseat_margin) {
            *other = *leads;
        }
        if heard.agreed {
            filter_seat.sit(&found.bbox, &found.bbox);
        }
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.filter.restart(frame, bbox)?;
        self.network.restart(frame, bbox)?;
        let seat = Seat::new(&bbox, FIRST_STANDING);
        (self.filter_seat, self.network_seat) = (seat, seat);
        (self.near, self.swept, self.decided) = (None, None, None);
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        self.network.view(expected)
    }
}
