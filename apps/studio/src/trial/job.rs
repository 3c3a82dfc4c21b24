//! A run of the command line that is watched: it tells what it sees, and nobody can tell it anything.

use super::Order;
use super::handle::Told;
use super::report;
use super::screen::{PICTURE_EVERY, Screen, jpeg};
use crate::error::Refusal;
use axum::http::StatusCode;
use pursuit::media::SourceInfo;
use pursuit::revise::{Row, Trajectory};
use pursuit::toml::Table;
use pursuit::{Frame, Record};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Records that are kept for the time line: a job may run for days.
const MOST_RECORDS: usize = 20_000;

/// A job as those who watch it know it.
pub(crate) struct Job {
    info: SourceInfo,
    tracker: String,
    parameters: Table,
    screen: Arc<Screen>,
    state: Mutex<State>,
}

struct State {
    trajectory: Trajectory,
    newest: Option<Arc<Frame>>,
    /// What the job says besides.
    remark: Option<String>,
    /// `ready` before the first frame, `running`, then `ended` or `failed`.
    phase: &'static str,
    message: Option<String>,
}

impl Job {
    /// # Errors
    /// When the system gives no thread.
    pub fn new(info: SourceInfo, tracker: String, parameters: Table) -> std::io::Result<Arc<Self>> {
        let trajectory = Trajectory::holding(MOST_RECORDS);
        let state = Mutex::new(State { trajectory, newest: None, remark: None, phase: "ready", message: None });
        Ok(Arc::new(Self { info, tracker, parameters, screen: Screen::open()?, state }))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub const fn screen(&self) -> &Arc<Screen> {
        &self.screen
    }

    /// The job has looked at a frame. It is only put where those who watch find it: words and pictures are made elsewhere.
    pub fn saw(self: &Arc<Self>, frame: &Arc<Frame>, records: &[Record]) {
        let mut state = self.state();
        state.trajectory.push(Row::new(frame, records.to_vec()));
        (state.newest, state.phase) = (Some(frame.clone()), "running");
        drop(state);
        self.show(frame.clone(), true);
    }

    /// Something to be shown with the newest frame.
    pub fn remark(&self, remark: String) {
        self.state().remark = Some(remark);
    }

    /// The job is over, with what went wrong; said once, it stays so.
    pub fn end(self: &Arc<Self>, message: Option<String>) {
        let mut state = self.state();
        if matches!(state.phase, "ended" | "failed") {
            return;
        }
        state.phase = if message.is_some() { "failed" } else { "ended" };
        state.message = message;
        let newest = state.newest.clone();
        drop(state);
        if let Some(frame) = newest {
            self.show(frame, false);
        }
        self.screen.close();
    }

    fn show(self: &Arc<Self>, frame: Arc<Frame>, running: bool) {
        let (job, index) = (self.clone(), frame.index());
        self.screen.show(Box::new(move || job.facts(Some(index))), frame, running);
    }

    /// Tells where the job is; nothing else is obeyed.
    pub fn order(self: &Arc<Self>, order: &Order) -> Result<Value, Refusal> {
        if !matches!(order, Order::Tell) {
            return Err(read_only());
        }
        let state = self.state();
        let (newest, running) = (state.newest.clone(), state.phase == "running");
        drop(state);
        if let Some(frame) = newest {
            self.show(frame, running);
        }
        Ok(self.facts(None))
    }

    pub fn version(&self, number: Option<u32>) -> Result<Told, Refusal> {
        let state = self.state();
        if number.is_some_and(|n| n != state.trajectory.number()) {
            return Err(Refusal::missing("there is no such version of this trajectory"));
        }
        let version = state.trajectory.current(&self.tracker);
        drop(state);
        Ok(Told { version, info: self.info.clone(), edits: Vec::new() })
    }

    pub fn picture(&self, frame: u64) -> Result<Vec<u8>, Refusal> {
        let newest = self.state().newest.clone().filter(|newest| newest.index() == frame);
        let newest =
            newest.ok_or_else(|| Refusal::missing("of a job that is watched, the newest frame alone is there"))?;
        jpeg(&newest).ok_or_else(|| Refusal::unfit("this picture cannot be sent as JPEG"))
    }

    /// Where the job was in this frame; without one, where it is.
    fn facts(&self, frame: Option<u64>) -> Value {
        let state = self.state();
        let (all, head) = (&state.trajectory, state.trajectory.last().map(|row| row.frame));
        let last = frame.map_or_else(|| all.last(), |frame| all.at(frame)).cloned();
        let first = state.trajectory.first().map(|r| r.frame);
        let (phase, message, remark) = (state.phase, state.message.clone(), state.remark.clone());
        drop(state);
        let records = last.iter().flat_map(|row| &row.records);
        let targets: Vec<u64> = records.clone().map(|r| r.target.0).collect();
        json!({
            "read_only": true,
            "phase": phase,
            "message": message,
            "remark": remark,
            "input": report::input(&self.info, (self.info.frame_count, false)),
            "tracker": self.tracker,
            "parameters": self.parameters,
            "now": last.as_ref().map(|row| report::row(row, &self.info)),
            "first": first,
            "head": head,
            "targets": targets,
            "edits": [],
            "speed": null,
            "look": "picture",
            "looks": ["picture"],
            "detector": null,
            "proposals": [],
            "seeking": null,
            "backward": null,
            "beside": null,
            "recorded": false,
            "revision": 0,
            "undo": null,
            "redo": null,
            "names": {},
            "folder": null,
            "version": 1,
            "versions": [],
            "step_ms": records.filter_map(|r| r.update_ms).sum::<f64>(),
            "viewers": self.screen.viewers(),
        })
    }

    /// As long as viewers need to be shown the end; none where nobody watches.
    pub fn farewell(&self) -> Duration {
        if self.screen.viewers() > 0 { 10 * PICTURE_EVERY } else { Duration::ZERO }
    }
}

/// Why nothing can be changed.
pub(crate) fn read_only() -> Refusal {
    let message = "this page shows a run with `--watch`, which can only be watched; `pursuit studio` can do more";
    Refusal::new(StatusCode::FORBIDDEN, message)
}
