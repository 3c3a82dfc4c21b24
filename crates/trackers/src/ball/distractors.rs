//! Things of the ball's colour that are not the ball and stay where they are.

use super::params::DistractorParams;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Distractor {
    bbox: BBox,
    seen: u32,
    missed: u32,
}

/// Remembers the places of such things.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Distractors {
    params: DistractorParams,
    known: Vec<Distractor>,
}

impl Distractors {
    /// None yet.
    pub const fn new(params: DistractorParams) -> Self {
        Self { params, known: Vec::new() }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.known.clear();
    }

    /// Notes what was seen beside the ball in the part `looked_at` of a frame in which the ball was surely found.
    pub fn note(&mut self, others: &[BBox], looked_at: &BBox) {
        let DistractorParams { most, forgotten, same, .. } = self.params;
        for distractor in &mut self.known {
            if others.iter().any(|o| o.iou(&distractor.bbox) > same) {
                distractor.seen = distractor.seen.saturating_add(1);
                distractor.missed = 0;
            } else if distractor.bbox.fraction_inside(looked_at) > 0.9 {
                distractor.missed += 1;
            }
        }
        self.known.retain(|r| r.missed < forgotten);
        for other in others {
            if self.known.len() < most && self.known.iter().all(|r| r.bbox.iou(other) <= same) {
                self.known.push(Distractor { bbox: *other, seen: 1, missed: 0 });
            }
        }
    }

    /// Whether something has long been standing there.
    pub fn holds(&self, bbox: &BBox) -> bool {
        self.known.iter().any(|r| r.seen >= self.params.settled && r.bbox.iou(bbox) > self.params.same)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distractors_that_go_are_forgotten() {
        let leaf = BBox::from_ltwh(10.0, 10.0, 20.0, 20.0);
        let everywhere = BBox::from_ltwh(0.0, 0.0, 100.0, 100.0);
        let mut distractors = Distractors::new(DistractorParams::default());
        for k in 0..3 {
            assert!(!distractors.holds(&leaf), "{k}");
            distractors.note(&[leaf], &everywhere);
        }
        assert!(distractors.holds(&leaf.translated(2.0, 0.0)));
        assert!(!distractors.holds(&leaf.translated(30.0, 0.0)));
        // Not looked at is not missed.
        (0..10).for_each(|_| distractors.note(&[], &BBox::from_ltwh(50.0, 50.0, 40.0, 40.0)));
        assert!(distractors.holds(&leaf));
        (0..5).for_each(|_| distractors.note(&[], &everywhere));
        assert!(!distractors.holds(&leaf));
    }
}
