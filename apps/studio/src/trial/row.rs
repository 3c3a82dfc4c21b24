use pursuit::{BBox, Estimate, Frame, Record};
use std::sync::Arc;

/// What is known in one frame, for every target.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub frame: u64,
    pub time_s: f64,
    /// In order of their targets.
    pub records: Vec<Record>,
}

impl Row {
    pub fn new(frame: &Frame, records: Vec<Record>) -> Self {
        Self { frame: frame.index(), time_s: frame.time_s(), records }
    }

    /// Says of `target` that it was put onto `bbox` here, as a run does of the targets it is started on.
    pub fn put(&mut self, target: u64, bbox: BBox, update_ms: f64) {
        let target = pursuit::tracking::TargetId(target);
        let estimate = Some(Estimate::started(self.time_s, bbox, 1.0));
        let record = Record { frame: self.frame, time_s: self.time_s, target, estimate, update_ms: Some(update_ms) };
        self.remove(target.0);
        let at = self.records.partition_point(|r| r.target < target);
        self.records.insert(at, record);
    }

    pub fn remove(&mut self, target: u64) {
        self.records.retain(|r| r.target.0 != target);
    }
}

/// One trajectory of all targets, kept for comparison when a correction or another method made a new one.
#[derive(Debug, Clone)]
pub(crate) struct Version {
    pub number: u32,
    /// What ended it: why there is a newer one.
    pub why: String,
    pub tracker: String,
    pub rows: Arc<Vec<Arc<Row>>>,
}
