//! A camera on a head that is bad in every way that a head can be, in a room where somebody walks to and fro.

use pursuit::Frame;
use pursuit::head::KnownWorld;
use pursuit::media::{MediaError, Source, SourceInfo};
use pursuit::ptz::control::{Follower, FollowerParams};
use pursuit::ptz::drivers::{Capabilities, Head, HeadThread, Pilot};
use pursuit::ptz::geometry::FieldsOfView;
use pursuit::ptz::simulation::{HeadParams, SimulatedHead};
use pursuit::ptz::{Command, Direction, Position, PtzError, Status};
use pursuit_geometry::Size;
use std::error::Error;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Pictures per second.
pub const FPS: u64 = 5;
const SIZE: Size = Size::new(160, 90);
/// How long the room has something to show, seconds: then all begins anew, and the walker is somewhere else at once.
const WORLD_S: f64 = 3600.0;
/// Half its angle of view, degrees.
const HALF_VIEW_DEG: f64 = 30.0;
/// A head stops by itself when it hears nothing for so long, seconds.
const STOPS_S: f64 = 2.0;
/// Every so many seconds the cable is out for so many; and every so many the head starts anew, and answers nothing until then.
const CABLE_S: (f64, f64) = (1500.0, 45.0);
const ANEW_S: (f64, f64) = (4000.0, 60.0);

/// The head, its camera, and the world about it. Clones are the same.
#[derive(Clone)]
pub struct Mount(Arc<Inner>);

struct Inner {
    world: KnownWorld,
    /// Where the head looks when it is switched on: at the walker's first place.
    home: Direction,
    state: Mutex<State>,
}

struct State {
    head: SimulatedHead,
    /// Pictures taken so far: they are the clock of the whole.
    taken: u64,
    heard_s: f64,
    restarts: u64,
    refused: u64,
    commands: u64,
}

impl Mount {
    pub fn new() -> Result<Self, Box<dyn Error + Send + Sync>> {
        let world = KnownWorld::scene(&format!("wide-world?seed=5&reach=30&speed=0.6&duration={WORLD_S}"))?;
        let (home, ..) = world.target(0.0).ok_or("nobody is there")?;
        let state = State { head: head(0, home)?, taken: 0, heard_s: 0.0, restarts: 0, refused: 0, commands: 0 };
        Ok(Self(Arc::new(Inner { world, home, state: Mutex::new(state) })))
    }

    /// The walker's box in the first picture, `[left, top, width, height]` in pixels.
    pub fn first_box(&self) -> Option<[f64; 4]> {
        let (_, width, height) = self.0.world.target(0.0)?;
        let focal_px = 0.5 * SIZE.width as f64 / HALF_VIEW_DEG.to_radians().tan();
        let (width, height) = (focal_px * width, focal_px * height);
        Some([0.5 * (SIZE.width as f64 - width), 0.5 * (SIZE.height as f64 - height), width, height])
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A connection to the camera.
    pub fn picture_source(&self) -> Result<Pictures, Box<dyn Error + Send + Sync>> {
        let info = SourceInfo { fps: Some(FPS as f64), ..SourceInfo::new("camera:turning", SIZE, "simulated") };
        Ok(Pictures { mount: self.clone(), info, next: 0 })
    }

    /// What follows with the head.
    pub fn pilot(&self) -> Result<Pilot, Box<dyn Error + Send + Sync>> {
        let home = Position { direction: self.0.home, zoom: 0.0 };
        let params = FollowerParams { home, command_delay_s: 0.15, frame_age_s: 0.1, ..FollowerParams::default() };
        let follower = Follower::new(params, FieldsOfView::fixed(HALF_VIEW_DEG)?, SIZE, 0.0)?;
        // Pictures come many times faster than they were taken: so does the head's word.
        let (poll, patience) = (Some(Duration::from_millis(2)), Duration::from_secs(20));
        Ok(Pilot::new(follower, HeadThread::start(Driver(self.clone()), Pilot::WATCHDOG, poll, patience)?))
    }

    /// What became of the head in so many seconds.
    ///
    /// # Errors
    /// Where it was not as bad as it should have been: then nothing was tried.
    pub fn said(&self, seconds: u64) -> Result<String, String> {
        let State { restarts, refused, commands, .. } = *self.lock();
        let said = format!("{commands} commands, {refused} calls not answered, {restarts} restarts of the head");
        let due = |every_s: f64| (seconds as f64 / every_s) as u64;
        // The last may come after the end: the camera's clock and that of the pictures differ by what it took to connect.
        let enough = commands > 0 && refused >= due(CABLE_S.0) && restarts + 1 >= due(ANEW_S.0);
        if enough { Ok(said) } else { Err(format!("only {said}")) }
    }
}

fn head(seed: u64, direction: Direction) -> Result<SimulatedHead, PtzError> {
    let home = Position { direction, zoom: 0.0 };
    let params = HeadParams { home, delay_s: 0.15, jitter_s: 0.1, dropped: 0.05, ..HeadParams::default() };
    SimulatedHead::new(params, seed)
}

impl State {
    fn now_s(&self) -> f64 {
        self.taken as f64 / FPS as f64
    }

    /// Whether the head hears and answers.
    fn answers(&self) -> bool {
        let away = |(every, lasts): (f64, f64)| self.now_s() % every > every - lasts;
        !away(CABLE_S) && !away(ANEW_S)
    }

    /// Lets time pass until the next picture; where the camera looks then.
    fn advance(&mut self, home: Direction) -> Result<(f64, Direction), PtzError> {
        let before_s = self.now_s();
        self.taken += 1;
        let now_s = self.now_s();
        if now_s - self.heard_s > STOPS_S {
            self.head.command(now_s, Command::Stop);
            self.heard_s = now_s;
        }
        if (now_s / ANEW_S.0).floor() > (before_s / ANEW_S.0).floor() {
            self.restarts += 1;
            self.head = head(self.restarts, home)?;
        }
        self.head.advance_to(now_s);
        Ok((now_s, self.head.position().direction))
    }
}

/// How the head is spoken to.
struct Driver(Mount);

impl Driver {
    fn reached(&self, doing: &'static str) -> Result<MutexGuard<'_, State>, PtzError> {
        let mut state = self.0.lock();
        if state.answers() {
            return Ok(state);
        }
        state.refused += 1;
        Err(PtzError::TimedOut { head: "simulated".to_owned(), doing, after_s: 1.0 })
    }
}

impl Head for Driver {
    fn name(&self) -> &str {
        "simulated"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { velocity: true, absolute: true, status: true, ..Capabilities::default() }
    }

    fn send(&mut self, command: &Command) -> Result<(), PtzError> {
        let mut state = self.reached("a command")?;
        let now_s = state.now_s();
        state.head.command(now_s, *command);
        (state.heard_s, state.commands) = (now_s, state.commands + 1);
        Ok(())
    }

    fn status(&mut self) -> Result<Option<Status>, PtzError> {
        Ok(self.reached("the status")?.head.status())
    }

    fn leave(&mut self) {}
}

/// Pictures of the camera, one connection.
pub struct Pictures {
    mount: Mount,
    info: SourceInfo,
    next: u64,
}

impl Source for Pictures {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, MediaError> {
        let broken = |e: String| MediaError::Unreadable { name: "camera:turning".to_owned(), reason: e };
        let (now_s, pose) = self.mount.lock().advance(self.mount.0.home).map_err(|e| broken(e.to_string()))?;
        let views = FieldsOfView::fixed(HALF_VIEW_DEG).map_err(|e| broken(e.to_string()))?;
        let lens = views.lens(0.0, SIZE).map_err(|e| broken(e.to_string()))?;
        let mut world = self.mount.0.world.world().map_err(|e| broken(e.to_string()))?;
        let image = world.render(now_s % WORLD_S, &lens, pose).map_err(|e| broken(e.to_string()))?;
        let (index, time_s) = (self.next, self.next as f64 / FPS as f64);
        self.next += 1;
        Ok(Some(Frame::new(index, time_s, image)))
    }
}
