//! What the network has confirmed, carried from answer to answer by the regions that move.

use pursuit_geometry::BBox;
use pursuit_tracking::{Class, Detection, Followed};

/// An object that the network has seen, where it is now.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Confirmed {
    pub bbox: BBox,
    pub class: Option<Class>,
    pub score: f64,
    /// Answers since the last one that had it.
    missed: usize,
    /// Which of the frame's regions it is.
    pub region: Option<usize>,
}

impl Confirmed {
    /// Whether the last answer had it.
    pub const fn is_seen(&self) -> bool {
        self.missed == 0
    }
}

/// When an object and a region, or a target, are the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Agreement {
    /// Overlap (IoU) from which on they are.
    pub overlap: f64,
    /// Share of each of several objects that lies in a region which is all of them.
    pub inside: f64,
}

impl Agreement {
    /// Whether an object lies in a region.
    pub fn lies_in(&self, object: &Confirmed, region: &BBox) -> bool {
        object.bbox.fraction_inside(region) >= self.inside
    }

    /// Whether a region is several objects.
    pub fn is_several(&self, objects: &[Confirmed], region: &BBox) -> bool {
        objects.iter().filter(|object| self.lies_in(object, region)).count() > 1
    }
}

/// Takes each object along: to the region that is it alone, else to the target that is. Of the pairs that agree those that overlap
/// most come first.
pub(super) fn carry(objects: &mut [Confirmed], regions: &[Detection], followed: &[Followed], agreement: Agreement) {
    let agree = agreement.overlap;
    objects.iter_mut().for_each(|object| object.region = None);
    let alone = |(_, region): &(usize, &Detection)| !agreement.is_several(objects, &region.bbox);
    let single: Vec<(usize, &Detection)> = regions.iter().enumerate().filter(alone).collect();
    let all = objects
        .iter()
        .enumerate()
        .flat_map(|(o, object)| single.iter().map(move |(r, region)| (object.bbox.iou(&region.bbox), o, *r)));
    let mut pairs: Vec<(f64, usize, usize)> = all.filter(|(overlap, ..)| *overlap >= agree).collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, o, r) in pairs {
        let taken = objects.iter().any(|object| object.region == Some(r));
        if let (Some(object), Some(region), false) = (objects.get_mut(o), regions.get(r), taken)
            && object.region.is_none()
        {
            (object.region, object.bbox) = (Some(r), region.bbox);
        }
    }
    for object in objects.iter_mut().filter(|object| object.region.is_none()) {
        if let Some(bbox) = nearest(&object.bbox, followed.iter().map(|f| f.bbox), agree) {
            object.bbox = bbox;
        }
    }
}

/// The box of `others` that overlaps most, by at least `agree`.
pub(super) fn nearest(bbox: &BBox, others: impl Iterator<Item = BBox>, agree: f64) -> Option<BBox> {
    let overlaps = others.map(|other| (other.iou(bbox), other)).filter(|(overlap, _)| *overlap >= agree);
    overlaps.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, other)| other)
}

/// What is confirmed once the network has answered: what it saw, and what it has not missed for longer than `patience`.
pub(super) fn renew(objects: &mut Vec<Confirmed>, seen: Vec<Detection>, agree: f64, patience: usize) {
    objects.retain_mut(|object| {
        object.missed += 1;
        object.missed <= patience && !seen.iter().any(|s| s.bbox.iou(&object.bbox) >= agree)
    });
    objects.extend(seen.into_iter().map(|s| Confirmed {
        bbox: s.bbox,
        class: s.class,
        score: s.confidence,
        missed: 0,
        region: None,
    }));
}
