use super::HeadSink;
use crate::{Run, RunConfig};
use pursuit_imaging::CameraPose;
use pursuit_ptz::control::Diagnosis;
use pursuit_ptz::drivers::Pilot;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Says how the camera stood when the frame of this time, in seconds, was taken.
pub type Poses = Box<dyn FnMut(f64) -> Option<CameraPose> + Send>;

/// The configuration with a tracker, or with `many` all that is followed, that takes the head's motion out of the target's, unless it says
/// otherwise.
#[must_use]
pub fn compensated(config: RunConfig) -> RunConfig {
    let key = if config.many == Some(true) { "many.motion.camera" } else { "motion.camera" };
    let parameters = toml::Table::from_iter([(key.to_owned(), "pose".into())]);
    RunConfig { parameters, ..RunConfig::default() }.overridden_by(config)
}

/// A head follows the first target of this run; `tell` is told after every frame what the head is believed to do.
pub fn follow(run: Run, pilot: Pilot, tell: impl FnMut(&Diagnosis) + Send + 'static) -> Run {
    let (sink, poses) = steer(pilot, run.input().live);
    run.with_sink(Box::new(sink.telling(tell))).posed_by(poses)
}

/// Steers a head by a run's results. `live` says that frames arrive as they are taken; a recording is followed by its own
/// clock, as fast as it can be read.
pub fn steer(pilot: Pilot, live: bool) -> (HeadSink, Poses) {
    let shared = Shared(Arc::new(Mutex::new(Steering { pilot, live, clock: None })));
    let sink = HeadSink::new(shared.clone());
    (sink, Box::new(move |time_s| shared.lock().camera(time_s)))
}

/// What the sink and the poses share.
#[derive(Clone)]
pub(super) struct Shared(Arc<Mutex<Steering>>);

impl Shared {
    pub fn lock(&self) -> MutexGuard<'_, Steering> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

pub(super) struct Steering {
    pub pilot: Pilot,
    live: bool,
    /// When the first frame came, and its time stamp.
    clock: Option<(Instant, f64)>,
}

impl Steering {
    /// The time now and that of a frame of this time, seconds since the first frame.
    pub fn clocks(&mut self, time_s: f64) -> (f64, f64) {
        let (began, first_s) = *self.clock.get_or_insert_with(|| (Instant::now(), time_s));
        let stamp_s = time_s - first_s;
        (if self.live { began.elapsed().as_secs_f64().max(stamp_s) } else { stamp_s }, stamp_s)
    }

    /// How the head is believed to have stood when the frame of this time was taken.
    pub fn camera(&mut self, time_s: f64) -> Option<CameraPose> {
        let (_, stamp_s) = self.clocks(time_s);
        self.pilot.camera(stamp_s)
    }
}
