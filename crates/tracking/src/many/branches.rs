//! What a target might have been given instead: the branches of multiple hypothesis tracking.

use super::association::Expectation;
use super::death::Unseen;
use crate::motion::{Motion, MotionFilter, MotionParams};
use crate::{Detection, Prior};
use pursuit_estimation::EstimationError;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// The most frames by which a decision may be put off.
pub(super) const MOST_SCANS: usize = 8;

/// The most branches of a target.
pub(super) const MOST_BRANCHES: usize = 64;

/// The most detections of a frame that branches can tell apart: what is remembered of them takes memory for each.
pub(super) const MOST_DETECTIONS: usize = 1 << 17;

/// In a frame without a detection.
const NONE: u32 = u32::MAX;

/// What a branch has taken in the last frames, and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Past {
    /// Log-likelihood ratio: of candidates against that there is nothing, of targets only differences between branches count.
    pub nats: f64,
    /// The numbers of the detections, the newest first.
    taken: [u32; MOST_SCANS],
}

impl Default for Past {
    fn default() -> Self {
        Self { nats: 0.0, taken: [NONE; MOST_SCANS] }
    }
}

impl Past {
    /// That of what starts with a detection.
    pub fn started(detection: usize) -> Self {
        Self::default().after(Some(detection), 1)
    }

    /// What was taken so many frames ago; 0: in the last frame.
    pub fn taken(&self, ago: usize) -> Option<usize> {
        self.taken.get(ago).filter(|taken| **taken != NONE).map(|taken| *taken as usize)
    }

    /// All of it: how many frames ago, and which detection.
    pub fn all(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..MOST_SCANS).filter_map(|ago| Some((ago, self.taken(ago)?)))
    }

    /// Another frame later; what is older than so many `scans` is forgotten.
    pub fn after(&self, detection: Option<usize>, scans: usize) -> Self {
        let mut taken = [NONE; MOST_SCANS];
        let newest = detection.and_then(|d| u32::try_from(d).ok()).unwrap_or(NONE);
        let older = std::iter::once(newest).chain(self.taken);
        taken.iter_mut().zip(older).take(scans).for_each(|(to, from)| *to = from);
        Self { taken, ..*self }
    }

    /// The same with this score.
    pub fn scored(self, nats: f64) -> Self {
        Self { nats, ..self }
    }

    fn is_sound(&self) -> bool {
        self.nats.is_finite() && self.taken.iter().all(|t| *t == NONE || (*t as usize) < MOST_DETECTIONS)
    }
}

/// A branch that is not the one reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Branch {
    pub past: Past,
    pub motion: Motion,
    pub unseen: Unseen,
    /// What is expected of the frame at hand.
    #[serde(skip)]
    pub expected: Option<(Prior, Expectation)>,
}

impl Branch {
    /// The same a frame later, in the memory of one that is `spare`: with this detection, or missed. A target that was not seen for longer than
    /// `lost_s` starts anew.
    ///
    /// # Errors
    /// When the motion cannot be corrected.
    pub fn next(
        (motion, mut unseen, dt_s): (&Motion, Unseen, f64),
        past: Past,
        detection: Option<&Detection>,
        lost_s: f64,
        spare: Option<Self>,
    ) -> Result<Self, EstimationError> {
        let mut motion = match spare {
            Some(Self { motion: mut spare, .. }) => {
                spare.clone_from(motion);
                spare
            }
            None => motion.clone(),
        };
        match detection {
            Some(detection) if unseen.seconds > lost_s => {
                motion.restart(detection.bbox);
                unseen = Unseen::default();
            }
            Some(detection) => {
                motion.correct(&crate::motion::Sight::of(detection.bbox, None))?;
                unseen = Unseen::default();
            }
            None => unseen.wait(dt_s),
        }
        Ok(Self { past, motion, unseen, expected: None })
    }
}

/// The branches of a target.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Branches {
    /// The one reported, which is believed.
    pub own: Past,
    pub others: Vec<Branch>,
}

impl Branches {
    /// Those of what starts with a detection.
    pub fn started(detection: usize) -> Self {
        Self { own: Past::started(detection), others: Vec::new() }
    }

    /// Forgets what was put off.
    pub fn clear(&mut self) {
        self.own = Past::default();
        self.others.clear();
    }

    /// Where each should be after `dt_s` seconds; one that cannot be computed is none.
    pub fn predict(&mut self, dt_s: f64, params: &MotionParams) {
        self.others.retain_mut(|branch| {
            let prior = branch.motion.predict(dt_s);
            branch.expected = prior.and_then(|p| Expectation::new(&p, params).map(|e| (p, e))).ok();
            branch.expected.is_some()
        });
    }

    /// The camera's motion moved the picture by so many pixels.
    pub fn carry(&mut self, shift: (f64, f64)) {
        self.others.iter_mut().for_each(|branch| branch.motion.carry(shift));
    }

    /// Whether they can be: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        let sound = |branch: &Branch| {
            let bbox: BBox = branch.motion.bbox();
            branch.past.is_sound() && branch.unseen.is_sound() && bbox.is_finite()
        };
        self.own.is_sound() && self.others.len() < MOST_BRANCHES && self.others.iter().all(sound)
    }
}
