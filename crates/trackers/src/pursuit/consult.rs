//! Asking the expert, and what becomes of its answer.

use super::expert::{Opinion, Remark};
use super::fusion::{Candidate, Fusion};
use super::localizer::WitnessLocalizer;
use pursuit_estimation::logit;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::Result;

impl WitnessLocalizer {
    /// Asks those that are asked now and then, where they are due or what was found leaves a doubt.
    pub(super) fn consult(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        fused: Option<Fusion>,
        looked: bool,
    ) -> Result<Option<Fusion>> {
        let sure = logit(self.params.networks.lightfc_below);
        let doubt = fused.is_none_or(|f| !f.agreed || f.leading().is_none_or(|c| c.log_odds < sure));
        let mut fused = fused;
        let networks = &self.params.networks;
        let doubtful = networks.lightfc_doubtful_every.min(networks.lightfc_every);
        let every = if doubt { doubtful } else { networks.lightfc_every };
        let opinion = match &mut self.expert {
            Some(expert) if expert.is_due(every) => expert.look(frame, expected)?,
            _ => None,
        };
        if let Some(opinion) = opinion {
            fused = Some(self.taken_over(frame, expected, fused.unwrap_or(Fusion::NOTHING), &opinion, looked)?);
        }
        Ok(fused)
    }

    /// The expert's box in place of `fused`, which the other witnesses saw; `looked` says whether the network looked in this frame.
    fn taken_over(
        &mut self,
        frame: &Frame,
        expected: &BBox,
        mut fused: Fusion,
        opinion: &Opinion,
        looked: bool,
    ) -> Result<Fusion> {
        let overlap = fused.bbox(&self.params.fusion).map_or(0.0, |bbox| bbox.iou(&opinion.bbox));
        let remark = Remark { score: opinion.score, overlap, embedding: opinion.embedding };
        let boxes = (opinion.bbox, opinion.own);
        let candidate = match fused.leading() {
            Some(leading) if overlap >= self.params.fusion.agree_from => {
                Candidate { bbox: opinion.bbox, own: opinion.own, ..*leading }
            }
            _ => {
                let evidence = self.filter.evidence_at(frame, &opinion.own);
                let score = self.score_at(frame, &opinion.own, looked)?;
                self.candidate(boxes, evidence, score, overlap, expected)
            }
        };
        (fused.expert, fused.remark) = (Some(candidate), Some(remark));
        let other = fused.leading().copied();
        if let Some(other) = other.filter(|_| overlap < self.params.fusion.agree_from) {
            fused.expert_leads = self.params.expert_arbitration.odds(&candidate.evidence, &other.evidence) > 0.0;
        } else {
            fused.expert_leads = true;
        }
        fused.heard(&self.params.judge, |evidence| {
            (evidence.lightfc, evidence.lightfc_overlap) = (remark.score, overlap);
            evidence.lightfc_fall = self.usual.lightfc_fall(remark.score);
        });
        Ok(fused)
    }

    /// Asks everybody about a place where a lost target may be.
    pub(super) fn centred(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Fusion>> {
        let expert = match &mut self.expert {
            Some(expert) => expert.look_about(frame, expected)?,
            None => None,
        };
        // The best eyes say where exactly it would be.
        let about = expert.map_or(*expected, |opinion| opinion.own);
        let Some(location) = self.network.look(frame, &about)? else { return Ok(None) };
        let place = expert.map_or_else(|| self.convention.of(&location.bbox), |opinion| opinion.bbox);
        let peak = self.filter.sight(frame, &place);
        let Some(mut fused) = self.fuse(frame, expected, peak, Some(location))? else { return Ok(None) };
        if let Some(opinion) = expert {
            fused = self.taken_over(frame, expected, fused, &opinion, true)?;
        }
        Ok(Some(fused))
    }
}
