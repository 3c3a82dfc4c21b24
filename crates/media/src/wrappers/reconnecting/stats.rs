use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What has befallen a live source so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StreamCounts {
    /// How often no frame came for longer than allowed.
    pub stalls: u64,
    /// How often it broke off.
    pub breaks: u64,
    /// How often it was connected to again, and frames came.
    pub reconnects: u64,
    /// Attempts at that which failed.
    pub failed_attempts: u64,
    /// Frames that came damaged and were left out.
    pub damaged: u64,
    /// The longest time without a frame, seconds.
    pub longest_gap_s: f64,
}

/// The running counts of a live source, shared: clones see later changes. Two are equal when they count for one source.
#[derive(Debug, Clone, Default)]
pub struct StreamStats(Arc<Mutex<StreamCounts>>);

impl PartialEq for StreamStats {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl StreamStats {
    /// The counts so far.
    pub fn counts(&self) -> StreamCounts {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn change(&self, change: impl FnOnce(&mut StreamCounts)) {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner));
    }

    pub(super) fn gap(&self, gap: Duration) {
        self.change(|counts| counts.longest_gap_s = counts.longest_gap_s.max(gap.as_secs_f64()));
    }
}
