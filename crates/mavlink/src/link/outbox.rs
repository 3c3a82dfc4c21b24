use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

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
        let state = self.lock();
        if !state.ended {
            // A message that comes meanwhile ends the rest early, which does no harm.
            drop(self.changed.wait_timeout(state, time));
        }
    }

    pub fn has_ended(&self) -> bool {
        self.lock().ended
    }

    pub fn end(&self) {
        self.lock().ended = true;
        self.changed.notify_all();
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
        outbox.end();
        assert_eq!(std::iter::from_fn(|| outbox.next()).count(), 63);
    }
}
