use crate::Result;
use pursuit_imaging::Frame;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Frames that may wait between a connection and whoever reads.
const CAPACITY: usize = 2;

/// What a connection has to say: a frame, its own end, or why it cannot go on.
pub(super) type Item = Result<Option<Frame>>;

/// What came out of the box.
#[allow(clippy::large_enum_variant, reason = "it lives for one call")]
pub(super) enum Taken {
    Item(Item),
    /// Nothing came in time.
    Silence,
    /// Nobody wants any more.
    Stopped,
}

/// Where connections put what they have. Of several only the newest is listened to.
#[derive(Clone, Default)]
pub(super) struct Mailbox(Arc<(Mutex<State>, Condvar)>);

#[derive(Default)]
struct State {
    items: VecDeque<Item>,
    /// The connection that is listened to.
    connection: u64,
    stopped: bool,
}

impl Mailbox {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Listens to a new connection only; its number.
    pub fn next_connection(&self) -> u64 {
        let mut state = self.lock();
        state.connection += 1;
        state.items.clear();
        let number = state.connection;
        drop(state);
        self.0.1.notify_all();
        number
    }

    pub fn stop(&self) {
        self.lock().stopped = true;
        self.0.1.notify_all();
    }

    /// Waits for room. False when nobody listens to this connection any more.
    pub fn put(&self, connection: u64, item: Item) -> bool {
        let wanted = |state: &State| state.connection == connection && !state.stopped;
        let full = |state: &mut State| state.items.len() >= CAPACITY && wanted(state);
        let waited = self.0.1.wait_while(self.lock(), full);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner);
        let wanted = wanted(&state);
        if wanted {
            state.items.push_back(item);
        }
        drop(state);
        self.0.1.notify_all();
        wanted
    }

    /// What comes next, waited for as long as `patience`; without, as long as it takes.
    pub fn take(&self, patience: Option<Duration>) -> Taken {
        let waiting = |state: &mut State| state.items.is_empty() && !state.stopped;
        let mut state = match patience {
            Some(patience) => {
                self.0.1.wait_timeout_while(self.lock(), patience, waiting).unwrap_or_else(PoisonError::into_inner).0
            }
            None => self.0.1.wait_while(self.lock(), waiting).unwrap_or_else(PoisonError::into_inner),
        };
        let taken = match state.items.pop_front() {
            _ if state.stopped => Taken::Stopped,
            Some(item) => Taken::Item(item),
            None => Taken::Silence,
        };
        drop(state);
        self.0.1.notify_all();
        taken
    }

    /// Waits, unless it is stopped.
    pub fn pause(&self, length: Duration) {
        let waited = self.0.1.wait_timeout_while(self.lock(), length, |state| !state.stopped);
        drop(waited);
    }
}
