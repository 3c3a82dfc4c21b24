//! What is counted: boxes matched with neutral ones, boxes in regions and small ones are taken out before anything is scored.

use super::truth::{Counts, CrowdTruth, TrueBox};
use crate::boxes::BoxRow;
use crate::metrics::many::{Labelled, best_pairs, inside, overlap};
use crate::{EvaluationError, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::str::FromStr;

/// A box is matched with a true one from this overlap on, and is of a region from this part of its area on.
const HALF: f64 = 0.5;
/// KITTI does not count boxes without a match that are this high, in pixels, or less.
const KITTI_HEIGHT: f64 = 25.0;

/// Whose rules say what is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CrowdRules {
    /// KITTI's for sets whose truth has regions, else MOTChallenge's.
    #[default]
    Auto,
    /// MOTChallenge's: boxes matched with neutral ones, and those inside regions, are not counted.
    Mot,
    /// KITTI's: nor are boxes without a match that are 25 px or less in height.
    Kitti,
}

impl FromStr for CrowdRules {
    type Err = EvaluationError;

    fn from_str(s: &str) -> Result<Self> {
        match s {
            "auto" => Ok(Self::Auto),
            "mot" => Ok(Self::Mot),
            "kitti" => Ok(Self::Kitti),
            _ => Err(EvaluationError::Option(format!("unknown rules `{s}`; there are auto, mot and kitti"))),
        }
    }
}

impl CrowdRules {
    /// The height up to which boxes without a match are not counted, for a set that has `regions` or none.
    pub(super) const fn least_height(self, regions: bool) -> Option<f64> {
        match (self, regions) {
            (Self::Kitti, _) | (Self::Auto, true) => Some(KITTI_HEIGHT),
            (Self::Mot, _) | (Self::Auto, false) => None,
        }
    }
}

/// The true boxes that are to be found, and the boxes said that count, of one class or of all.
pub(super) fn counted(
    truth: &CrowdTruth,
    said: &[BoxRow],
    class: Option<&str>,
    least_height: Option<f64>,
) -> Result<(Vec<Labelled>, Vec<Labelled>)> {
    let mut frames: BTreeMap<u64, Frame<'_>> = BTreeMap::new();
    for b in truth.boxes.iter().filter(|b| class.is_none() || b.class == class) {
        frames.entry(b.frame).or_default().truth.push(b);
    }
    for row in said.iter().filter(|r| class.is_none() || r.class.as_ref().is_none_or(|own| Some(own.as_str()) == class))
    {
        frames.entry(row.frame).or_default().said.push(row);
    }
    for (frame, region) in &truth.regions {
        if let Some(here) = frames.get_mut(frame) {
            here.regions.push(*region);
        }
    }
    let mut kept = (Vec::new(), Vec::new());
    for here in frames.values() {
        let to_find = here.truth.iter().filter(|b| b.counts == Counts::Yes);
        kept.0.extend(to_find.map(|b| Labelled { frame: b.frame, target: b.id, bbox: b.bbox }));
        let counts = here.counts(least_height)?;
        let rows = here.said.iter().zip(counts).filter(|(_, counts)| *counts);
        kept.1.extend(rows.map(|(r, _)| Labelled { frame: r.frame, target: r.id.unwrap_or_default(), bbox: r.bbox }));
    }
    Ok(kept)
}

#[derive(Default)]
struct Frame<'a> {
    truth: Vec<&'a TrueBox>,
    said: Vec<&'a BoxRow>,
    regions: Vec<pursuit_geometry::BBox>,
}

impl Frame<'_> {
    /// Which of the boxes said count.
    fn counts(&self, least_height: Option<f64>) -> Result<Vec<bool>> {
        let gain = |t: usize, s: usize| {
            let overlap = overlap(&self.truth[t].bbox, &self.said[s].bbox);
            if overlap < HALF - f64::EPSILON { 0.0 } else { overlap }
        };
        let mut counts = vec![None; self.said.len()];
        for (t, s) in best_pairs(self.truth.len(), self.said.len(), gain)? {
            if gain(t, s) > f64::EPSILON {
                counts[s] = Some(self.truth[t].counts != Counts::Neutral);
            }
        }
        let unmatched = |row: &BoxRow| {
            // The height as a difference of edges, as KITTI has it: the last digit decides at the limit.
            let height = row.bbox.top() + row.bbox.height() - row.bbox.top();
            least_height.is_none_or(|least| height > least + f64::EPSILON)
                && self.regions.iter().all(|region| inside(&row.bbox, region) <= HALF + f64::EPSILON)
        };
        Ok(counts.into_iter().zip(&self.said).map(|(known, row)| known.unwrap_or_else(|| unmatched(row))).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::BBox;

    fn said(id: u64, left: f64, height: f64) -> BoxRow {
        BoxRow { frame: 0, id: Some(id), bbox: BBox::from_ltwh(left, 0.0, 40.0, height), score: 1.0, class: None }
    }

    #[test]
    fn neutral_small_and_boxes_in_regions_are_left_out() {
        let at = |id, left, counts| TrueBox {
            frame: 0,
            id,
            bbox: BBox::from_ltwh(left, 0.0, 40.0, 40.0),
            counts,
            class: None,
        };
        let truth = CrowdTruth {
            boxes: vec![at(1, 0.0, Counts::Yes), at(2, 100.0, Counts::Neutral), at(3, 200.0, Counts::No)],
            regions: vec![(0, BBox::from_ltwh(300.0, 0.0, 100.0, 100.0))],
            ..CrowdTruth::default()
        };
        let rows = [
            said(11, 2.0, 40.0),
            said(12, 102.0, 40.0),
            said(13, 202.0, 40.0),
            said(14, 310.0, 40.0),
            said(15, 500.0, 25.0),
            said(16, 600.0, 26.0),
        ];
        let ids =
            |least| -> Vec<u64> { counted(&truth, &rows, None, least).unwrap().1.iter().map(|l| l.target).collect() };
        assert_eq!(ids(CrowdRules::Auto.least_height(true)), [11, 13, 16]);
        assert_eq!(ids(CrowdRules::Mot.least_height(true)), [11, 13, 15, 16]);
        assert_eq!(counted(&truth, &rows, None, None).unwrap().0.len(), 1);
        assert!("coco".parse::<CrowdRules>().unwrap_err().to_string().contains("kitti"));
    }
}
