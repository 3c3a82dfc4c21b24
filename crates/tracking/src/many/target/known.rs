//! What is known of a target, and saved.

use super::super::TargetId;
use super::super::birth::Evidence;
use super::super::branches::Branches;
use super::super::death::Unseen;
use super::super::look::Look;
use super::super::observed::Observed;
use super::super::whole::PartOf;
use crate::belief::Belief;
use crate::class::Classes;
use serde::{Deserialize, Serialize};

/// What something that was detected is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Standing {
    /// What may be a target, and what speaks for that.
    Candidate(Evidence),
    /// A target that was detected.
    Confirmed(TargetId),
    /// A target that a user pointed at: nothing but a user gives it up.
    Given(TargetId),
}

/// What is known of a target or a candidate, and saved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Known {
    pub standing: Standing,
    pub belief: Belief,
    /// What its detections were taken for.
    pub classes: Classes,
    /// What its detections look like.
    pub(super) look: Look,
    /// The boxes that it was given lately.
    pub(super) observed: Observed,
    pub(super) unseen: Unseen,
    /// Time since it was detected, in seconds.
    pub(super) undetected_s: f64,
    /// For how long nothing has stood out of the scene where it should be, in seconds.
    pub(super) empty_s: f64,
    /// For how long it has been a part of another.
    pub part_of: PartOf,
    /// What it might have been given instead.
    pub(super) branches: Branches,
}

impl Known {
    /// Its id; `None` while it is a candidate.
    pub const fn id(&self) -> Option<TargetId> {
        match self.standing {
            Standing::Candidate(_) => None,
            Standing::Confirmed(id) | Standing::Given(id) => Some(id),
        }
    }

    /// Whether it was found again and has not been seen in so many frames since.
    pub fn is_on_trial(&self, frames: usize) -> bool {
        frames > 0
            && matches!(self.standing, Standing::Confirmed(_))
            && self.observed.since_gap().is_some_and(|seen| seen < frames)
    }

    /// Whether it can be known: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        let evidence = match &self.standing {
            Standing::Candidate(evidence) => evidence.is_sound(),
            Standing::Confirmed(_) | Standing::Given(_) => true,
        };
        evidence
            && self.look.is_sound()
            && self.observed.is_sound()
            && self.unseen.is_sound()
            && self.undetected_s.is_finite()
            && self.undetected_s >= 0.0
            && self.empty_s.is_finite()
            && self.part_of.0.is_finite()
            && self.belief.last_believed.is_finite()
            && self.classes.is_sound()
            && self.branches.is_sound()
    }
}
