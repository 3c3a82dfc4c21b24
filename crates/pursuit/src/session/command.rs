//! What a session can be told while it runs.

use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_media::input::StopHandle;
use pursuit_tracking::{Recipe, TargetId};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel as mpsc};

/// What a session can be told between two steps.
pub enum Command {
    /// Follow one more target.
    Add {
        /// Where it is.
        bbox: BBox,
        /// What makes its tracker; without, the session's own recipe.
        recipe: Option<Box<dyn Recipe>>,
    },
    /// Stop following a target.
    Remove(TargetId),
    /// Put a target elsewhere.
    Reinit {
        /// Which.
        target: TargetId,
        /// Where it is.
        bbox: BBox,
    },
    /// Change parameters while running, as far as that is possible.
    Change {
        /// Of which target; without, of all, and of those added later.
        target: Option<TargetId>,
        /// The values changed; keys may be dotted (`motion.model`).
        parameters: toml::Table,
    },
    /// Wait before the next frame.
    Pause,
    /// Go on.
    Resume,
    /// Go to a frame, forward or back, where the source can. What is believed of the targets stays.
    Seek(u64),
}

/// Commands and stops a session from elsewhere; clones speak to the same one.
#[derive(Clone)]
pub struct Remote {
    stopped: Arc<AtomicBool>,
    source: Option<StopHandle>,
    requests: Sender<Request>,
}

/// The answer to a command, once the session has come to it.
pub struct Reply(Receiver<Result<Option<TargetId>, RunError>>);

impl Remote {
    /// Ends the session after the frame in hand, even while it waits for a frame or is paused.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
        self.source.iter().for_each(StopHandle::stop);
        // Wakes a session that is paused; one that has ended needs no waking.
        let _ = self.requests.send(Request::Wake);
    }

    /// Whether it was stopped.
    pub fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// Sends a command; the session obeys it before its next frame. Commands are obeyed in the order they are sent.
    pub fn send(&self, command: Command) -> Reply {
        let (answer, reply) = mpsc();
        // A session that has ended drops the request, which its reply tells.
        let _ = self.requests.send(Request::Obey(command, answer));
        Reply(reply)
    }
}

impl Reply {
    /// Waits until the session has obeyed, or refused. Never call this on the thread that steps the session.
    ///
    /// # Errors
    /// As [`Session::apply`](crate::Session::apply), or that the session has ended.
    pub fn wait(self) -> Result<Option<TargetId>, RunError> {
        self.0.recv().unwrap_or_else(|_| Err(ended()))
    }

    /// The same without waiting; the reply itself where the session has not come to it yet.
    ///
    /// # Errors
    /// This reply, to ask again later.
    pub fn poll(self) -> Result<Result<Option<TargetId>, RunError>, Self> {
        match self.0.try_recv() {
            Ok(answer) => Ok(answer),
            Err(TryRecvError::Empty) => Err(self),
            Err(TryRecvError::Disconnected) => Ok(Err(ended())),
        }
    }
}

fn ended() -> RunError {
    RunError::usage("the session has ended")
}

/// One thing that came from elsewhere.
pub(super) enum Request {
    Obey(Command, Sender<Result<Option<TargetId>, RunError>>),
    Wake,
}

impl Request {
    /// Obeys by `apply`, and tells whoever asked.
    pub fn answer(self, apply: impl FnOnce(Command) -> Result<Option<TargetId>, RunError>) {
        if let Self::Obey(command, answer) = self {
            // Nobody has to listen.
            let _ = answer.send(apply(command));
        }
    }
}

/// The session's end.
pub(super) struct Inbox(Receiver<Request>);

impl Inbox {
    /// What has come, if anything has.
    pub fn next(&self) -> Option<Request> {
        self.0.try_recv().ok()
    }

    /// Waits for what comes next.
    pub fn wait(&self) -> Option<Request> {
        self.0.recv().ok()
    }
}

/// Both ends. `source` is stopped along with the session.
pub(super) fn channel(source: Option<StopHandle>) -> (Inbox, Remote) {
    let (requests, inbox) = mpsc();
    (Inbox(inbox), Remote { stopped: Arc::default(), source, requests })
}
