//! The camera protocol's tracking part: <https://mavlink.io/en/services/camera.html>.

mod facts;
mod messages;
mod request;
mod schedule;
mod server;
mod tracking;

pub use facts::{CameraFacts, Stream};
pub use request::{Ask, Request, Verdict};
pub use tracking::{Place, Tracking};

use crate::{Endpoint, Result, Vehicle};
use request::{Asked, Requests};
use schedule::Schedule;
use server::Server;
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
    pub requests: Requests,
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

    /// Answers what was asked.
    pub fn answer(&self, asked: &Asked, verdict: Verdict) {
        let (result, detail) = verdict.result();
        asked.order.answer(&self.endpoint, result, detail);
        self.lock().requests.answered(asked, verdict);
    }
}

impl Camera {
    /// A camera on `endpoint`.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(endpoint: Endpoint, facts: CameraFacts) -> Result<Self> {
        let schedule = Schedule::new(facts.landing_target);
        let state = State {
            tracking: Tracking::Idle,
            requests: Requests::default(),
            told: None,
            schedule,
            vehicle: Vehicle::default(),
            turned: None,
            ended: false,
        };
        let incoming = endpoint.listen();
        let shared = Arc::new(Shared { endpoint, facts, state: Mutex::new(state) });
        let server = Server::new(shared.clone());
        let thread = std::thread::Builder::new().name("mavlink camera".to_owned()).spawn(move || server.run(&incoming));
        thread.map_err(|source| crate::MavlinkError::Io {
            link: "MAVLink".to_owned(),
            doing: "starting a thread",
            source,
        })?;
        Ok(Self { shared })
    }

    /// What a ground station asks, if one asks something: the newest of what came since the last call. The others, and what nobody takes for a
    /// second, are answered with "not now". Never waits.
    pub fn asked(&self) -> Option<Request> {
        let asked = self.shared.lock().requests.take()?;
        Some(Request::new(asked, self.shared.clone()))
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
        if let Some(asked) = self.asked() {
            asked.answer(Verdict::NotNow);
        }
        let mut state = self.shared.lock();
        // Nobody shall believe that it still tracks.
        state.tracking = Tracking::Idle;
        state.schedule.hurry();
        messages::send_tracking(&self.shared, &mut state, Instant::now());
        state.ended = true;
    }
}
