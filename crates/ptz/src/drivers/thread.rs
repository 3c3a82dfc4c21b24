use super::Head;
use crate::{Command, PtzError, Result, Status};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What has become of a head since it was asked last.
#[derive(Debug, Default)]
pub struct Report {
    /// What it said of itself last.
    pub status: Option<Status>,
    /// Errors, oldest first; the oldest are dropped where there are many.
    pub errors: Vec<PtzError>,
    /// How many commands were overtaken by newer ones before they could be sent.
    pub overtaken: u64,
    /// Whether the thread has ended.
    pub ended: bool,
}

/// A head on a thread of its own.
///
/// Telling it something never waits. Of several commands that wait for a slow head only the newest is sent. A head that is
/// told nothing for `watchdog` while it turns on and on is stopped: whoever steered it has gone. One that goes to a place stands there by
/// itself. When this value is dropped
/// the head is stopped, and the thread is waited for as long as one call of the driver may take.
pub struct HeadThread {
    name: String,
    shared: Arc<Shared>,
    patience: Duration,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    next: Option<Command>,
    /// The last command, once all is to end.
    ending: Option<Command>,
    ended: bool,
    status: Option<Status>,
    /// How often the head has said how it stands.
    words: u64,
    errors: VecDeque<PtzError>,
    overtaken: u64,
}

/// How a [`HeadThread`] treats its head.
#[derive(Debug, Clone, Copy)]
struct Care {
    watchdog: Duration,
    poll: Option<Duration>,
}

impl Shared {
    /// The most errors kept for the next report.
    const MOST_ERRORS: usize = 16;

    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked left a whole state behind: every change of it is one assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn complain(&self, error: PtzError) {
        let mut state = self.lock();
        if state.errors.len() == Self::MOST_ERRORS {
            state.errors.pop_front();
        }
        state.errors.push_back(error);
    }
}

impl HeadThread {
    /// Runs `head`, stops it when it is told nothing for `watchdog`, asks it for its status every `poll`, and waits for it
    /// no longer than `patience` when all ends.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(
        head: impl Head + 'static,
        watchdog: Duration,
        poll: Option<Duration>,
        patience: Duration,
    ) -> Result<Self> {
        let name = head.name().to_owned();
        let shared = Arc::new(Shared::default());
        let (theirs, care) = (shared.clone(), Care { watchdog, poll });
        let start = std::thread::Builder::new().name(format!("head {name}")).spawn(move || {
            let _ended = Ended(theirs.clone());
            serve(head, &theirs, care);
        });
        start.map_err(|source| PtzError::Io { head: name.clone(), doing: "starting its thread", source })?;
        Ok(Self { name, shared, patience })
    }

    /// Tells the head something. A command that has not been sent yet is overtaken.
    ///
    /// # Errors
    /// Where the thread has ended.
    pub fn tell(&self, command: Command) -> Result<()> {
        let mut state = self.shared.lock();
        if state.ended || state.ending.is_some() {
            return Err(PtzError::Ended { head: self.name.clone() });
        }
        if state.next.replace(command).is_some() {
            state.overtaken += 1;
        }
        drop(state);
        self.shared.changed.notify_all();
        Ok(())
    }

    /// What has become of it since the last report.
    pub fn report(&self) -> Report {
        let mut state = self.shared.lock();
        Report {
            status: state.status,
            errors: state.errors.drain(..).collect(),
            overtaken: std::mem::take(&mut state.overtaken),
            ended: state.ended,
        }
    }

    /// What the head said of itself last, where it has said something since it had done so `words` times; with how often it has.
    pub fn heard_since(&self, words: u64) -> Option<(u64, Status)> {
        let state = self.shared.lock();
        state.status.filter(|_| state.words > words).map(|status| (state.words, status))
    }

    /// Stops the head and ends its thread; whether it ended within the patience.
    pub fn end(&self) -> bool {
        self.end_with(Command::Stop)
    }

    /// Stops the head, sends it somewhere where `last` says so, and ends its thread; whether that ended within the patience. The
    /// head goes on its last way alone. Only the first call counts.
    pub fn end_with(&self, last: Command) -> bool {
        let deadline = Instant::now() + self.patience;
        let mut state = self.shared.lock();
        state.ending.get_or_insert(last);
        self.shared.changed.notify_all();
        while !state.ended {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            let waited = self.shared.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }
}

impl Drop for HeadThread {
    fn drop(&mut self) {
        self.end();
    }
}

/// Says that the thread has ended, however it ended.
struct Ended(Arc<Shared>);

impl Drop for Ended {
    fn drop(&mut self) {
        self.0.lock().ended = true;
        self.0.changed.notify_all();
    }
}

/// How much later a head is asked again that did not say how it stands.
const STATUS_AGAIN: Duration = Duration::from_secs(5);

/// What to do next.
enum Task {
    Send(Command),
    Stop,
    Poll,
    End(Command),
}

fn serve(mut head: impl Head, shared: &Shared, care: Care) {
    let mut runs_on = false;
    let (mut told, mut polled) = (Instant::now(), Instant::now());
    loop {
        let quiet = runs_on.then(|| told + care.watchdog);
        let poll = care.poll.map(|every| polled + every);
        match next(shared, quiet, poll) {
            Task::Send(command) => {
                told = Instant::now();
                // It may move even when the answer gets lost.
                runs_on = command.runs_on() || runs_on;
                match head.send(&command) {
                    Ok(()) => runs_on = command.runs_on(),
                    Err(error) => shared.complain(error),
                }
            }
            Task::Stop => match head.send(&Command::Stop) {
                Ok(()) => runs_on = false,
                Err(error) => {
                    // Again after another while.
                    told = Instant::now();
                    shared.complain(error);
                }
            },
            Task::Poll => {
                let answer = head.status();
                // Counted from the answer, so that a slow head has as long for commands.
                polled = Instant::now();
                match answer {
                    Ok(status) => {
                        let mut state = shared.lock();
                        state.status = status;
                        state.words += 1;
                    }
                    Err(error) => {
                        // Commands are not to wait behind a status that cannot be had.
                        polled += STATUS_AGAIN;
                        shared.complain(error);
                    }
                }
            }
            Task::End(last) => {
                if let Err(error) = head.send(&Command::Stop) {
                    shared.complain(error);
                }
                if last != Command::Stop {
                    match head.send(&last) {
                        Ok(()) => head.leave(),
                        Err(error) => shared.complain(error),
                    }
                }
                return;
            }
        }
    }
}

/// Waits for the next task: a command at once, a stop when `quiet` is over, a poll when it is due. Where a head takes longer than the
/// time between two commands one always waits, so a poll that is due goes before it, but not before a stop.
fn next(shared: &Shared, quiet: Option<Instant>, poll: Option<Instant>) -> Task {
    let mut state = shared.lock();
    loop {
        if let Some(last) = state.ending {
            return Task::End(last);
        }
        let now = Instant::now();
        if state.next.is_some_and(|command| command != Command::Stop) && poll.is_some_and(|time| time <= now) {
            return Task::Poll;
        }
        if let Some(command) = state.next.take() {
            return Task::Send(command);
        }
        if quiet.is_some_and(|time| time <= now) {
            return Task::Stop;
        }
        if poll.is_some_and(|time| time <= now) {
            return Task::Poll;
        }
        let until = quiet.into_iter().chain(poll).min();
        state = match until {
            Some(until) => shared.changed.wait_timeout(state, until - now).unwrap_or_else(PoisonError::into_inner).0,
            None => shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
        };
    }
}

#[cfg(test)]
mod tests;
