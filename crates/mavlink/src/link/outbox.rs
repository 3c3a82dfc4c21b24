use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What waits to be written to a link; of more than it may hold the oldest are dropped.
#[derive(Default)]
pub(crate) struct Outbox {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Arc<[u8]>>,
    dropped: u64,
    sent: u64,
    /// Whether what was taken last is not written yet.
    writing: bool,
    ended: bool,
}

impl Outbox {
    const MOST: usize = 64;

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Never waits.
    pub fn push(&self, bytes: Arc<[u8]>) {
        let mut state = self.lock();
        if state.waiting.len() == Self::MOST {
            state.waiting.pop_front();
            state.dropped += 1;
        }
        state.waiting.push_back(bytes);
        drop(state);
        self.changed.notify_all();
    }

    /// Waits for the next; `None` once all is over and nothing waits.
    pub fn next(&self) -> Option<Arc<[u8]>> {
        let mut state = self.lock();
        loop {
            if let Some(bytes) = state.waiting.pop_front() {
                state.sent += 1;
                state.writing = true;
                return Some(bytes);
            }
            if state.ended {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// How many were handed to the link, and how many were dropped before.
    pub fn counts(&self) -> (u64, u64) {
        let state = self.lock();
        (state.sent, state.dropped)
    }

    /// Waits for this long, or until all is over.
    pub fn rest(&self, time: Duration) {
        let until = Instant::now() + time;
        let mut state = self.lock();
        while !state.ended {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    pub fn has_ended(&self) -> bool {
        self.lock().ended
    }

    pub fn end(&self) {
        self.lock().ended = true;
        self.changed.notify_all();
    }

    /// Says that one was written, or could not be.
    pub fn done(&self) {
        self.lock().writing = false;
        self.changed.notify_all();
    }

    /// Waits until nothing waits to be written any more, until `deadline` at most.
    pub fn drain(&self, deadline: Instant) {
        let mut state = self.lock();
        while state.writing || !state.waiting.is_empty() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_give_way() {
        let outbox = Outbox::default();
        for k in 0..70_u8 {
            outbox.push(Arc::from([k]));
        }
        assert_eq!(outbox.next().as_deref(), Some(&[6][..]));
        assert_eq!(outbox.counts(), (1, 6));
        let began = Instant::now();
        outbox.rest(Duration::from_millis(20));
        outbox.drain(Instant::now() + Duration::from_millis(20));
        assert!(began.elapsed() >= Duration::from_millis(40), "somebody waits still");
        outbox.end();
        outbox.rest(Duration::from_secs(100));
        assert_eq!(std::iter::from_fn(|| outbox.next()).count(), 63);
        outbox.done();
        outbox.drain(Instant::now() + Duration::from_secs(100));
    }
}
