//! How well whoever moves is followed: stares, coverage and identities.

use pursuit_geometry::BBox;
use pursuit_tracking::{Track, TrackState};
use std::collections::{BTreeMap, BTreeSet};

/// Where people are, frame by frame.
pub type Truth = BTreeMap<u64, Vec<BBox>>;

/// Frames this near to somebody's coming or going are open: nobody is sure whether there is somebody.
const OPEN: u64 = 6;

/// What was counted.
#[derive(Debug, Default)]
pub struct Figures {
    /// Boxes told as tracked, and those of them that touch nobody (IoU < .1).
    pub told: usize,
    pub stares: usize,
    /// Boxes of the truth, those with a told box of IoU ≥ .5, and the sum of the best overlaps.
    pub truth: usize,
    pub covered: usize,
    overlap: f64,
    pub ids: BTreeSet<u64>,
}

impl Figures {
    /// Counts frame `k`, where people are `seen`, and are to be followed as `truth` says; where `one` is followed, whoever it is.
    pub fn count(&mut self, k: u64, tracks: &[Track], (seen, truth): (&Truth, &Truth), one: bool) {
        let empty = Vec::new();
        let here = truth.get(&k).unwrap_or(&empty);
        let told = tracks.iter().filter_map(|t| Some((t.id.0, t.estimate.as_ref()?)));
        let said: Vec<_> = told.filter(|(_, e)| e.state == TrackState::Tracking).map(|(id, e)| (id, e.bbox)).collect();
        let near: Vec<&BBox> = (k.saturating_sub(OPEN)..=k + OPEN).filter_map(|k| seen.get(&k)).flatten().collect();
        for (id, bbox) in &said {
            self.told += 1;
            self.ids.insert(*id);
            self.stares += usize::from(near.iter().all(|t| t.iou(bbox) < 0.1));
        }
        let best = |t: &BBox| said.iter().map(|(_, b)| b.iou(t)).fold(0.0, f64::max);
        let mut overlaps: Vec<f64> = here.iter().map(best).collect();
        if one && !overlaps.is_empty() {
            // Which one is followed is not ours to say.
            overlaps = vec![overlaps.iter().copied().fold(0.0, f64::max)];
        }
        self.truth += overlaps.len();
        self.covered += overlaps.iter().filter(|o| **o >= 0.5).count();
        self.overlap += overlaps.iter().sum::<f64>();
    }

    /// Share of what is told that touches nobody.
    pub fn stared(&self) -> f64 {
        self.stares as f64 / self.told.max(1) as f64
    }

    /// Share of the truth that is followed.
    pub fn coverage(&self) -> f64 {
        self.covered as f64 / self.truth.max(1) as f64
    }

    /// One line of it all.
    pub fn line(&self) -> String {
        format!(
            "told {}, stares {} ({:.1} %), coverage {:.1} % of {}, mean overlap {:.3}, ids {}",
            self.told,
            self.stares,
            100.0 * self.stared(),
            100.0 * self.coverage(),
            self.truth,
            self.overlap / self.truth.max(1) as f64,
            self.ids.len()
        )
    }
}
