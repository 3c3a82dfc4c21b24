use crate::Record;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::{Estimate, TargetId};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is known in one frame, for every target.
#[derive(Debug, Clone)]
pub struct Row {
    /// Number of the frame.
    pub frame: u64,
    /// Its time in seconds.
    pub time_s: f64,
    /// In order of their targets.
    pub records: Vec<Record>,
    /// Targets whose record was found by following backward from a later frame.
    pub backward: Vec<u64>,
}

impl Row {
    /// What is known of every target in `frame`, in order of their targets.
    pub fn new(frame: &Frame, records: Vec<Record>) -> Self {
        Self { frame: frame.index(), time_s: frame.time_s(), records, backward: Vec::new() }
    }

    /// Says of `target` that it was put onto `bbox` here, as a run does of the targets it is started on.
    pub fn put(&mut self, target: u64, bbox: BBox, update_ms: f64) {
        let target = TargetId(target);
        let estimate = Some(Estimate::started(self.time_s, bbox, 1.0));
        let (frame, time_s, update_ms) = (self.frame, self.time_s, Some(update_ms));
        self.insert(Record { frame, time_s, target, class: None, estimate, update_ms });
    }

    /// Says of a target what was found on the way back from a later frame.
    pub fn put_backward(&mut self, record: Record) {
        let target = record.target.0;
        self.insert(record);
        self.backward.push(target);
    }

    fn insert(&mut self, record: Record) {
        self.remove(record.target.0);
        let at = self.records.partition_point(|r| r.target < record.target);
        self.records.insert(at, record);
    }

    /// Says nothing of `target` any more.
    pub fn remove(&mut self, target: u64) {
        self.records.retain(|r| r.target.0 != target);
        self.backward.retain(|t| *t != target);
    }
}

/// One trajectory of all targets, kept for comparison when a correction or another method made a new one.
#[derive(Debug, Clone)]
pub struct Version {
    /// From 1 on.
    pub number: u32,
    /// What ended it: why there is a newer one.
    pub why: String,
    /// The tracker that made it.
    pub tracker: String,
    /// In order of their frames.
    pub rows: Arc<Vec<Arc<Row>>>,
}

impl Version {
    /// The stretches that were found by following backward: target, first and last frame, in order of their last frames.
    pub fn backward(&self) -> Vec<(u64, u64, u64)> {
        let (mut open, mut over) = (BTreeMap::<u64, (u64, u64)>::new(), Vec::new());
        for row in self.rows.iter() {
            for target in &row.backward {
                open.entry(*target).or_insert((row.frame, row.frame)).1 = row.frame;
            }
            let ended = open.extract_if(.., |target, _| !row.backward.contains(target));
            over.extend(ended.map(|(target, (first, last))| (target, first, last)));
        }
        over.extend(open.into_iter().map(|(target, (first, last))| (target, first, last)));
        over
    }
}
