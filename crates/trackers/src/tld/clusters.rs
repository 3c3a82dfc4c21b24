use super::cascade::Candidate;
use crate::appearance::{Similarity, SimilarityForm};
use pursuit_geometry::{BBox, Point};

/// Detections that mean the same thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cluster {
    /// Mean of their windows.
    pub bbox: BBox,
    /// Of the one that resembles the object most.
    pub similarity: Similarity,
}

/// Groups detections: each joins the first group in which it overlaps a member by enough (kalal2012, section 5.6;
/// single linkage, so groups that a later detection joins are one).
#[derive(Debug, Clone, Default)]
pub(super) struct Clusters {
    labels: Vec<usize>,
    found: Vec<Cluster>,
}

impl Clusters {
    /// The groups of `detections`, the group of the first detection first.
    pub fn of(&mut self, detections: &[Candidate], form: SimilarityForm, same_from: f64) -> &[Cluster] {
        self.labels.clear();
        self.labels.extend(0..detections.len());
        for (i, a) in detections.iter().enumerate() {
            for (j, b) in detections.iter().enumerate().take(i) {
                let (from, to) = (self.labels[i], self.labels[j]);
                if from != to && a.window.iou(&b.window) >= same_from {
                    let (low, high) = (from.min(to), from.max(to));
                    self.labels.iter_mut().filter(|l| **l == high).for_each(|l| *l = low);
                }
            }
        }
        self.found.clear();
        for first in 0..detections.len() {
            let members = || detections.iter().zip(&self.labels).filter(|(_, label)| **label == first).map(|(d, _)| d);
            if let Some(bbox) = mean(members().map(|d| (d.window, 1.0))) {
                let best = members().map(|d| d.similarity);
                let best = best.max_by(|a, b| a.conservative(form).total_cmp(&b.conservative(form)));
                self.found.extend(best.map(|similarity| Cluster { bbox, similarity }));
            }
        }
        &self.found
    }
}

/// The weighted mean of boxes, centre and sides apart; `None` of nothing.
pub(super) fn mean(boxes: impl Iterator<Item = (BBox, f64)>) -> Option<BBox> {
    let mut sums = [0.0; 5];
    for (b, weight) in boxes {
        let c = b.center();
        for (sum, value) in sums.iter_mut().zip([c.x, c.y, b.width(), b.height(), 1.0]) {
            *sum += weight * value;
        }
    }
    let [x, y, w, h, n] = sums;
    (n > 0.0).then(|| BBox::from_center_size(Point::new(x / n, y / n), w / n, h / n))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(left: f64, positive: f64) -> Candidate {
        let similarity = Similarity { positive, early: positive, negative: 0.5 };
        Candidate { window: BBox::from_ltwh(left, 10.0, 20.0, 30.0), sum: 0, similarity }
    }

    #[test]
    fn detections_in_a_chain_are_one_group() {
        let mut clusters = Clusters::default();
        let detections = [at(0.0, 0.8), at(12.0, 0.9), at(100.0, 0.7), at(6.0, 0.85)];
        // The last one links the first two.
        let found = clusters.of(&detections, SimilarityForm::Distance, 0.5);
        assert_eq!(found.len(), 2);
        assert!((found[0].bbox.left() - 6.0).abs() < 1e-12 && found[0].bbox.width() == 20.0);
        assert_eq!(found[0].similarity.positive, 0.9);
        assert_eq!((found[1].bbox.left(), found[1].similarity.positive), (100.0, 0.7));
        assert_eq!(clusters.of(&detections[..2], SimilarityForm::Distance, 0.5).len(), 2);
        assert!(clusters.of(&[], SimilarityForm::Distance, 0.5).is_empty());
    }

    #[test]
    fn means_are_weighted() {
        let (a, b) = (BBox::from_ltwh(0.0, 0.0, 10.0, 10.0), BBox::from_ltwh(10.0, 4.0, 20.0, 30.0));
        let mean_box = mean([(a, 3.0), (b, 1.0)].into_iter()).unwrap();
        assert_eq!((mean_box.center().x, mean_box.center().y), (8.75, 8.5));
        assert_eq!((mean_box.width(), mean_box.height()), (12.5, 15.0));
        assert_eq!(mean(std::iter::empty()), None);
    }
}
