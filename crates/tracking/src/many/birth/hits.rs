//! M of N.

use crate::Detection;
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// M of N: a candidate is a target once it was detected in enough of its last frames.
    pub struct HitsParams {
        /// M: frames in which it must have been detected …
        pub hits: usize = 3, in 1..=64, unit "frames", source "ours";
        /// … of the last N.
        pub looks: usize = 5, in 1..=64, unit "frames", source "ours";
        /// Whether the detection that starts a candidate counts.
        pub birth_counts: bool = true, source "bewley2016, its program: it does not";
        /// A detection less likely than this is none of them.
        pub from: f64 = 0.0, in 0.0..=1.0, source "ours";
        /// A candidate is kept for so many frames without a detection, one after the other, though M of N cannot be reached.
        pub patience: usize = 0, in 0..=1_000_000, unit "frames", source "ours";
    }
    ordered { hits <= looks }
}

/// In which frames a candidate was detected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::many) struct Hits {
    /// A bit a frame, the last frame in the lowest.
    history: u64,
    /// Frames since its birth.
    looks: u64,
}

impl Hits {
    pub fn look(&mut self, detection: Option<&Detection>, params: &HitsParams) {
        let detected = detection.is_some_and(|d| d.confidence >= params.from);
        let counts = detected && (self.looks > 0 || params.birth_counts);
        self.history = self.history << 1 | u64::from(counts);
        self.looks += 1;
    }

    pub fn confirm(&self, params: &HitsParams) -> bool {
        self.recent(params) >= params.hits
    }

    /// Whether M of N cannot be reached any more.
    pub fn refute(&self, params: &HitsParams) -> bool {
        let looks = usize::try_from(self.looks).unwrap_or(usize::MAX).min(params.looks);
        looks - self.recent(params).min(looks) > params.looks - params.hits
    }

    /// How often it was detected in the last N frames.
    fn recent(&self, params: &HitsParams) -> usize {
        let unused = u64::BITS.saturating_sub(params.looks as u32);
        (self.history << unused).count_ones() as usize
    }
}
