//! Things of the ball's colour that are not the ball and stay where they are.

use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// As many are remembered.
const MOST: usize = 48;
/// Seen in the same place this often, a thing is taken for part of the scene.
const SETTLED: u32 = 3;
/// Looked for and not found this often, it is forgotten.
const FORGOTTEN: u32 = 5;
/// Overlap that makes two boxes the same thing.
const SAME: f64 = 0.4;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Rival {
    bbox: BBox,
    seen: u32,
    missed: u32,
}

/// The memory of them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Rivals {
    known: Vec<Rival>,
}

impl Rivals {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.known.clear();
    }

    /// Notes what was seen beside the ball in the part `looked_at` of a frame in which the ball was surely found.
    pub fn note(&mut self, others: &[BBox], looked_at: &BBox) {
        for rival in &mut self.known {
            if others.iter().any(|o| o.iou(&rival.bbox) > SAME) {
                rival.seen = rival.seen.saturating_add(1);
                rival.missed = 0;
            } else if rival.bbox.fraction_inside(looked_at) > 0.9 {
                rival.missed += 1;
            }
        }
        self.known.retain(|r| r.missed < FORGOTTEN);
        for other in others {
            if self.known.len() < MOST && self.known.iter().all(|r| r.bbox.iou(other) <= SAME) {
                self.known.push(Rival { bbox: *other, seen: 1, missed: 0 });
            }
        }
    }

    /// Whether something has long been standing there.
    pub fn holds(&self, bbox: &BBox) -> bool {
        self.known.iter().any(|r| r.seen >= SETTLED && r.bbox.iou(bbox) > SAME)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_is_known_and_what_goes_is_forgotten() {
        let leaf = BBox::from_ltwh(10.0, 10.0, 20.0, 20.0);
        let everywhere = BBox::from_ltwh(0.0, 0.0, 100.0, 100.0);
        let mut rivals = Rivals::default();
        for k in 0..3 {
            assert!(!rivals.holds(&leaf), "{k}");
            rivals.note(&[leaf], &everywhere);
        }
        assert!(rivals.holds(&leaf.translated(2.0, 0.0)));
        assert!(!rivals.holds(&leaf.translated(30.0, 0.0)));
        // Not looked at is not missed.
        (0..10).for_each(|_| rivals.note(&[], &BBox::from_ltwh(50.0, 50.0, 40.0, 40.0)));
        assert!(rivals.holds(&leaf));
        (0..5).for_each(|_| rivals.note(&[], &everywhere));
        assert!(!rivals.holds(&leaf));
    }
}
