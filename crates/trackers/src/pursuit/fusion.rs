//! What both witnesses say of one place.

use super::FusionParams;
use super::expert::Remark;
use super::judge::{EXPERT, FILTER, JointEvidence, JudgeParams, NETWORK};
use pursuit_geometry::{BBox, Point};
use pursuit_tracking::{Diagnostics, Doubt};

/// One witness's box and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// What it takes for the target's box.
    pub bbox: BBox,
    /// The same in its own terms, from which it goes on.
    pub own: BBox,
    /// What is known of that box.
    pub evidence: JointEvidence,
    /// ln of p / (1 − p) of the probability that it is right.
    pub log_odds: f64,
}

/// Both candidates of one place, and which is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fusion {
    pub filter: Option<Candidate>,
    pub network: Option<Candidate>,
    /// Whether both speak of one thing.
    pub agreed: bool,
    /// Whether the filter's candidate is the one believed, of candidates that differ.
    pub filter_leads: bool,
    /// Log odds that the filter is right where they differ, by this frame alone; 0 where they agree.
    pub odds: f64,
    /// Middle and scale of the target in the filter's own terms, where the filter saw it.
    pub place: Option<(Point, f64)>,
    /// What the expert sees, where it was asked.
    pub expert: Option<Candidate>,
    /// Whether the expert's box is the one believed.
    pub expert_leads: bool,
    /// What is remembered of that.
    pub remark: Option<Remark>,
}

impl Fusion {
    /// Of a look in which nobody saw anything.
    pub const NOTHING: Self = Self {
        filter: None,
        network: None,
        agreed: false,
        filter_leads: false,
        odds: 0.0,
        place: None,
        expert: None,
        expert_leads: false,
        remark: None,
    };

    /// The expert's box where it is the one believed.
    pub fn taken(&self) -> Option<&Candidate> {
        self.expert.as_ref().filter(|_| self.expert_leads)
    }

    /// The candidate believed.
    pub fn leading(&self) -> Option<&Candidate> {
        if self.expert_leads {
            self.expert.as_ref()
        } else if self.filter_leads {
            self.filter.as_ref()
        } else {
            self.network.as_ref()
        }
    }

    /// Has every candidate judged anew by `judge`, with what `hear` adds to what is known of it.
    pub fn heard(&mut self, judge: &JudgeParams, hear: impl Fn(&mut JointEvidence)) {
        for candidate in [&mut self.filter, &mut self.network, &mut self.expert].into_iter().flatten() {
            hear(&mut candidate.evidence);
            candidate.log_odds = judge.log_odds(&candidate.evidence);
        }
    }

    /// Whether the filter, though both agree, goes on from its own box.
    pub fn filter_keeps(&self, params: &FusionParams) -> bool {
        match (self.taken(), &self.filter) {
            (Some(expert), Some(filter)) => filter.bbox.iou(&expert.bbox) >= params.own_from,
            (None, Some(filter)) => self.agreed && filter.evidence.overlap >= params.own_from,
            (_, None) => false,
        }
    }

    /// The box to report.
    pub fn bbox(&self, params: &FusionParams) -> Option<BBox> {
        if let Some(expert) = self.taken() {
            return Some(expert.bbox);
        }
        match (self.agreed, &self.filter, &self.network) {
            (true, Some(filter), Some(network)) => {
                Some(joined(params, &filter.bbox, &network.bbox, filter.evidence.overlap))
            }
            _ => self.leading().map(|candidate| candidate.bbox),
        }
    }

    /// What it would be that keeps the target from being believed here, going by what the network still sees.
    pub fn doubt(&self, params: &FusionParams) -> Doubt {
        let sees = |witness: &Option<Candidate>| witness.is_some_and(|c| c.evidence.network >= params.seen_from);
        let (filter, network) = (sees(&self.filter), sees(&self.network));
        // LightFC knows better than NanoTrack whether anything of the target is in sight.
        let seen = self.remark.map_or(filter || network, |remark| remark.score >= params.lightfc_seen_from);
        match (filter && network && !self.agreed, seen) {
            (true, _) => Doubt::Confused,
            (false, true) => Doubt::Changed,
            (false, false) => Doubt::Covered,
        }
    }

    /// What each witness said, for the files.
    pub fn figures(&self) -> Diagnostics {
        let flag = |set: bool| f64::from(u8::from(set));
        let mut said = Diagnostics::from(FusionFigures {
            agreed: flag(self.agreed),
            filter_leads: flag(self.filter_leads),
            expert_leads: flag(self.expert_leads),
        });
        for (figures, candidate) in [(FILTER, &self.filter), (NETWORK, &self.network), (EXPERT, &self.expert)] {
            said.extend(candidate.iter().flat_map(|candidate| figures.iter().zip(candidate.figures())));
        }
        said
    }
}

pursuit_tracking::figures! {
    /// What became of the two boxes.
    pub(super) struct FusionFigures {
        /// Whether both witnesses speak of one thing, 0 or 1.
        agreed;
        /// Whether the filter's box is the one believed, 0 or 1.
        filter_leads;
        /// Whether the expert's box is the one believed, 0 or 1.
        expert_leads;
    }
}

impl Candidate {
    /// In the order of [`FILTER`].
    fn figures(&self) -> impl Iterator<Item = f64> {
        let (x, y, w, h) = self.bbox.ltwh();
        [x, y, w, h].into_iter().chain(self.evidence.values())
    }
}

/// One box of two that are of one thing and overlap by `together`.
fn joined(params: &FusionParams, filter: &BBox, network: &BBox, overlap: f64) -> BBox {
    let span = (params.same_from - params.agree_from).max(1e-3);
    // How far the filter's box is believed beside the network's.
    let belief = ((overlap - params.agree_from) / span).clamp(0.0, 1.0);
    let mix = |network_share: f64, a: f64, b: f64| a + (1.0 - belief * (1.0 - network_share)) * (b - a);
    let (here, there) = (filter.center(), network.center());
    let (center, size) = (params.network_center, params.network_size);
    BBox::from_center_size(
        Point::new(mix(center, here.x, there.x), mix(center, here.y, there.y)),
        mix(size, filter.width(), network.width()),
        mix(size, filter.height(), network.height()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_says_why_nothing_is_believed() {
        let params = FusionParams::default();
        let candidate = |network: f64| {
            let bbox = BBox::from_ltwh(1.0, 2.0, 30.0, 40.0);
            let evidence = JointEvidence { network, ..JointEvidence::default() };
            Candidate { bbox, own: bbox, evidence, log_odds: 0.0 }
        };
        let (faint, clear) = (params.seen_from - 0.1, params.seen_from);
        for (filter, network, agreed, want) in [
            (Some(clear), Some(clear), true, Doubt::Changed),
            (Some(faint), Some(faint), true, Doubt::Covered),
            (Some(clear), Some(clear), false, Doubt::Confused),
            (Some(faint), Some(clear), false, Doubt::Changed),
            (Some(clear), Some(faint), false, Doubt::Changed),
            (Some(faint), Some(faint), false, Doubt::Covered),
            (None, Some(clear), false, Doubt::Changed),
            (Some(faint), None, false, Doubt::Covered),
        ] {
            let (filter, network) = (filter.map(candidate), network.map(candidate));
            let fusion = Fusion { filter, network, agreed, filter_leads: true, ..Fusion::NOTHING };
            assert_eq!(fusion.doubt(&params), want, "{fusion:?}");
        }
        // LightFC, where it was asked, has the last word on whether anything is in sight.
        for (network, score, want) in
            [(faint, params.lightfc_seen_from, Doubt::Changed), (clear, params.lightfc_seen_from - 0.1, Doubt::Covered)]
        {
            let (filter, remark) = (Some(candidate(network)), Some(Remark { score, overlap: 0.5, embedding: 0.8 }));
            let fusion = Fusion { filter, network: filter, agreed: true, remark, ..Fusion::NOTHING };
            assert_eq!(fusion.doubt(&params), want, "{fusion:?}");
        }
    }
}
