use super::row::{Row, Version};
use std::collections::VecDeque;
use std::sync::Arc;

/// Records that are kept of one trajectory unless told otherwise.
const MOST_RECORDS: usize = 100_000;
/// Earlier versions that are kept; then the oldest is dropped.
const MOST_VERSIONS: usize = 8;

/// What is known of every frame followed so far, and the versions before the last correction.
#[derive(Debug, Clone)]
pub struct Trajectory {
    /// Records that are kept.
    most: usize,
    /// How often anything but its end has changed.
    revision: u64,
    rows: VecDeque<Arc<Row>>,
    records: usize,
    versions: Vec<Version>,
    replaced: u32,
}

impl Default for Trajectory {
    fn default() -> Self {
        Self::holding(MOST_RECORDS)
    }
}

impl Trajectory {
    /// A trajectory of so many records at most; of longer ones the oldest frames are dropped.
    pub const fn holding(most: usize) -> Self {
        Self { most, revision: 0, rows: VecDeque::new(), records: 0, versions: Vec::new(), replaced: 0 }
    }

    /// Adds the row of the frame after the last.
    pub fn push(&mut self, row: Row) {
        self.records += row.records.len();
        self.rows.push_back(Arc::new(row));
        while self.records > self.most {
            let Some(oldest) = self.rows.pop_front() else { break };
            self.records -= oldest.records.len();
        }
    }

    /// How many frames it has.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The row of its first frame.
    pub fn first(&self) -> Option<&Arc<Row>> {
        self.rows.front()
    }

    /// The row of its last frame.
    pub fn last(&self) -> Option<&Arc<Row>> {
        self.rows.back()
    }

    /// The row of this frame, or of the first one after it.
    pub fn at(&self, frame: u64) -> Option<&Arc<Row>> {
        self.rows.get(self.rows.partition_point(|r| r.frame < frame))
    }

    /// The last row before this frame.
    pub fn before(&self, frame: u64) -> Option<&Arc<Row>> {
        self.rows.get(self.rows.partition_point(|r| r.frame < frame).checked_sub(1)?)
    }

    /// The first row after this frame.
    pub fn after(&self, frame: u64) -> Option<&Arc<Row>> {
        self.rows.get(self.rows.partition_point(|r| r.frame <= frame))
    }

    /// Puts another row in the place of the last.
    pub fn replace_last(&mut self, row: Row) {
        if let Some(old) = self.rows.pop_back() {
            self.records -= old.records.len();
        }
        self.revision += 1;
        self.push(row);
    }

    /// Puts another row in the place of the one of its frame.
    pub fn replace(&mut self, row: Arc<Row>) {
        let at = self.rows.partition_point(|r| r.frame < row.frame);
        if let Some(old) = self.rows.get_mut(at).filter(|old| old.frame == row.frame) {
            self.records = self.records + row.records.len() - old.records.len();
            self.revision += 1;
            *old = row;
        }
    }

    /// Keeps what there is as a version, where anything was followed, and drops the rows from frame `from` on.
    pub fn branch(&mut self, from: u64, why: &str, tracker: &str) {
        if self.records > 0 && self.rows.len() > 1 {
            self.replaced += 1;
            let rows = Arc::new(self.rows.iter().cloned().collect());
            let (why, tracker) = (why.to_owned(), tracker.to_owned());
            self.versions.push(Version { number: self.replaced, why, tracker, rows });
            if self.versions.len() > MOST_VERSIONS {
                self.versions.remove(0);
            }
        }
        self.revision += 1;
        self.rows.truncate(self.rows.partition_point(|r| r.frame < from));
        self.records = self.rows.iter().map(|r| r.records.len()).sum();
    }

    /// Takes the place of what there is, as after an undo: whoever has seen this one is told by a new revision.
    pub fn restore(&mut self, other: Self) {
        *self = Self { revision: self.revision.max(other.revision) + 1, ..other };
    }

    /// A number that grows whenever anything but the end of the trajectory changes: rows that were read before may be others.
    pub const fn revision(&self) -> u64 {
        self.revision
    }

    /// All rows, in order of their frames.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = &Arc<Row>> + ExactSizeIterator {
        self.rows.iter()
    }

    /// The number of the version that is being made.
    pub const fn number(&self) -> u32 {
        self.replaced + 1
    }

    /// The earlier versions that are kept, the oldest first.
    pub fn versions(&self) -> &[Version] {
        &self.versions
    }

    /// What there is now, as a version.
    pub fn current(&self, tracker: &str) -> Version {
        let rows = Arc::new(self.rows.iter().cloned().collect());
        Version { number: self.number(), why: String::new(), tracker: tracker.to_owned(), rows }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::BBox;

    fn row(frame: u64, targets: u64) -> Row {
        let mut row = Row { frame, time_s: frame as f64, records: Vec::new(), backward: Vec::new() };
        (1..=targets).for_each(|t| row.put(t, BBox::from_ltwh(0.0, 0.0, 9.0, 9.0), 0.0));
        row
    }

    #[test]
    fn branches_keep_what_was_there() {
        let mut all = Trajectory::default();
        (0..10).for_each(|frame| all.push(row(2 * frame, 1)));
        let frame = |row: Option<&Arc<Row>>| row.map(|r| r.frame);
        assert_eq!((frame(all.at(6)), frame(all.at(7)), frame(all.at(19))), (Some(6), Some(8), None));
        assert_eq!((frame(all.before(6)), frame(all.after(6)), frame(all.before(0))), (Some(4), Some(8), None));
        all.branch(8, "corrected", "kcf");
        assert_eq!((all.len(), all.number(), all.versions()[0].rows.len()), (4, 2, 10));
        for _ in 0..20 {
            all.branch(100, "again", "kcf");
        }
        assert_eq!((all.versions().len(), all.number()), (MOST_VERSIONS, 22));
    }

    #[test]
    fn every_change_but_a_row_at_the_end_is_a_new_revision() {
        let mut all = Trajectory::default();
        (0..4).for_each(|frame| all.push(row(frame, 1)));
        let before = all.clone();
        assert_eq!(all.revision(), 0);
        all.replace(Arc::new(row(2, 1)));
        all.replace_last(row(3, 1));
        all.branch(2, "corrected", "kcf");
        assert_eq!((all.revision(), all.len()), (3, 2));
        all.restore(before);
        assert_eq!((all.revision(), all.rows().len(), all.versions().len()), (4, 4, 0));
    }

    #[test]
    fn long_trajectories_lose_their_oldest_frames() {
        let mut all = Trajectory::default();
        (0..MOST_RECORDS as u64 / 2 + 10).for_each(|frame| all.push(row(frame, 2)));
        assert_eq!((all.first().unwrap().frame, all.len()), (10, MOST_RECORDS / 2));
    }
}
