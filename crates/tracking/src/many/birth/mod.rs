//! When what a detector finds becomes a target: the model that [`BirthParams`] name.
//!
//! A detection that is of no target starts a candidate. A candidate has no id; the model gathers evidence for it until it is
//! confirmed, and so a target, or refuted.

mod hits;
mod ratio;

pub use hits::HitsParams;
pub use ratio::RatioParams;
pub(super) use ratio::{Nats, RatioTest};

use crate::Detection;
use hits::Hits;
use serde::{Deserialize, Serialize};

pursuit_parameters::choices! {
    /// How a candidate is confirmed.
    pub enum BirthModel {
        /// M of N: by how often it was detected.
        Hits = "hits",
        /// By a sequential probability ratio test against clutter (Wald 1945).
        Ratio = "ratio",
        /// At once.
        Immediate = "immediate",
    }
}

pursuit_parameters::parameters! {
    /// When what a detector finds becomes a target.
    pub struct BirthParams {
        /// The model.
        pub model: BirthModel = BirthModel::Ratio, source "ours";
        /// Less likely detections continue targets, but start none.
        pub from: f64 = 0.3, in 0.0..=1.0, source "ours";
        /// A detection that overlaps a target by more (IoU) is that target seen twice, and starts no other.
        pub crowding: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// In so many frames at the start of a clip, whatever is detected is a target at once, if the detection that starts it counts (`hits.birth_counts`), else when it is detected again.
        pub at_start: usize = 0, in 0..=1_000_000, unit "frames", source "zhang2022, its program: 1";
        /// M of N.
        pub hits: HitsParams = HitsParams::default(), of [BirthModel::Hits];
        /// The sequential test.
        pub ratio: RatioParams = RatioParams::default(), of [BirthModel::Ratio];
    }
}

/// What speaks for a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) enum Evidence {
    Hits(Hits),
    Ratio(Nats),
    Immediate,
}

impl Evidence {
    /// Of a candidate that nothing is known of yet.
    pub fn new(model: BirthModel) -> Self {
        match model {
            BirthModel::Hits => Self::Hits(Hits::default()),
            BirthModel::Ratio => Self::Ratio(Nats::default()),
            BirthModel::Immediate => Self::Immediate,
        }
    }

    /// The model whose evidence it is.
    pub const fn model(&self) -> BirthModel {
        match self {
            Self::Hits(_) => BirthModel::Hits,
            Self::Ratio(_) => BirthModel::Ratio,
            Self::Immediate => BirthModel::Immediate,
        }
    }

    /// A frame, and the candidate's detection in it.
    pub fn look(&mut self, detection: Option<&Detection>, params: &BirthParams) {
        match self {
            Self::Hits(hits) => hits.look(detection, &params.hits),
            Self::Ratio(nats) => {
                let said = params.ratio.nats(detection.map(|d| d.confidence));
                nats.add(said, &(&params.ratio).into());
            }
            Self::Immediate => {}
        }
    }

    /// Whether the candidate is a target.
    pub fn confirms(&self, params: &BirthParams) -> bool {
        match self {
            Self::Hits(hits) => hits.confirm(&params.hits),
            Self::Ratio(nats) => nats.confirm(&(&params.ratio).into()),
            Self::Immediate => true,
        }
    }

    /// Whether the candidate is to be forgotten, which was not seen in so many frames, one after the other.
    pub fn refutes(&self, unseen: usize, params: &BirthParams) -> bool {
        match self {
            Self::Hits(hits) => unseen > params.hits.patience && hits.refute(&params.hits),
            Self::Ratio(nats) => nats.refute(&(&params.ratio).into()),
            Self::Immediate => false,
        }
    }

    /// Whether it can be evidence: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Hits(_) | Self::Immediate => true,
            Self::Ratio(nats) => nats.0.is_finite(),
        }
    }
}
