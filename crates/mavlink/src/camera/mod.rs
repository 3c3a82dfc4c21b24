//! The camera protocol's tracking part: <https://mavlink.io/en/services/camera.html>.

mod facts;
mod messages;
mod request;
mod schedule;
mod server;
mod tracking;

pub use facts::{CameraFacts, Stream};
pub use request::{Ask, Request, Verdict};
pub use tracking::{Place, Seen, Tracking};

use crate::{Endpoint, Result, Vehicle};
use schedule::Schedule;
use server::Server;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A camera that tracks, as ground stations see it. It ends with this value.
pub struct Camera {
    shared: Arc<Shared>,
}

/// What the camera and its thread share.
pub(crate) struct Shared {
    pub endpoint: Endpoint,
    pub facts: CameraFacts,
    pub state: Mutex<State>,
}

pub(crate) struct State {
    pub tracking: Tracking,
    /// Whether a point was asked for, not a rectangle.
    pub by_point: bool,
    /// When something was said of tracking last.
    pub told: Option<Instant>,
    pub schedule: Schedule,
    pub vehicle: Vehicle,
    /// How the camera is turned, where a gimbal says so.
    pub turned: Option<crate::Attitude>,
    pub ended: bool,
}

impl Shared {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked left a whole state behind: every change of it is one assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Camera {
    /// A camera on `endpoint`; what it is asked to track comes from the receiver.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(endpoint: Endpoint, facts: CameraFacts) -> Result<(Self, Receiver<Request>)> {
        let schedule = Schedule::new(facts.landing_target);
        let state = State {
            tracking: Tracking::Idle,
            by_point: false,
            told: None,
            schedule,
            vehicle: Vehicle::default(),
            turned: None,
            ended: false,
        };
        let incoming = endpoint.listen();
        let shared = Arc::new(Shared { endpoint, facts, state: Mutex::new(state) });
        let (requests, received) = channel();
        let server = Server::new(shared.clone(), requests);
        let thread = std::thread::Builder::new().name("mavlink camera".to_owned()).spawn(move || server.run(&incoming));
        thread.map_err(|source| crate::MavlinkError::Io {
            link: "MAVLink".to_owned(),
            doing: "starting a thread",
            source,
        })?;
        Ok((Self { shared }, received))
    }

    /// What has become of the target in the newest picture; it is sent at once where the rate asked for allows. Never waits.
    pub fn tell(&self, tracking: Tracking) {
        let now = Instant::now();
        let mut state = self.shared.lock();
        let turns = std::mem::discriminant(&state.tracking) != std::mem::discriminant(&tracking);
        (state.tracking, state.told) = (tracking, Some(now));
        if turns {
            state.schedule.hurry();
        }
        messages::send_tracking(&self.shared, &mut state, now);
    }

    /// How the camera is turned, where a gimbal says so; `None` where that is not known (any more).
    pub fn turn(&self, attitude: Option<crate::Attitude>) {
        self.shared.lock().turned = attitude;
    }

    /// The endpoint it is on.
    pub fn endpoint(&self) -> &Endpoint {
        &self.shared.endpoint
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        // Nobody shall believe that it still tracks.
        state.tracking = Tracking::Idle;
        state.schedule.hurry();
        messages::send_tracking(&self.shared, &mut state, Instant::now());
        state.ended = true;
    }
}
