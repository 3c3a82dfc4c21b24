//! What the engine tells: where the trial is, what came of it.

use super::super::handle::Told;
use super::super::looks::Look;
use super::super::phase::Phase;
use super::super::report;
use super::super::screen::jpeg;
use super::Engine;
use crate::error::Refusal;
use serde_json::{Value, json};
use std::time::Instant;

impl Engine {
    pub(super) fn version(&self, number: Option<u32>) -> Result<Told, Refusal> {
        let current = number.is_none_or(|n| n == self.trajectory.number());
        let version = if current {
            Some(self.trajectory.current(self.tracker.name))
        } else {
            self.trajectory.versions().iter().find(|v| Some(v.number) == number).cloned()
        };
        let version = version.ok_or_else(|| Refusal::missing("there is no such version of this trajectory"))?;
        Ok(Told { version, info: self.follower.info().clone(), edits: self.follower.edits().to_vec() })
    }

    pub(super) fn picture(&mut self, frame: u64) -> Result<Vec<u8>, Refusal> {
        if self.follower.info().frame_count.is_some_and(|n| frame >= n) {
            return Err(Refusal::missing("there is no such frame"));
        }
        let frame = self.pictures.get(frame)?.ok_or_else(|| Refusal::missing("there is no such frame any more"))?;
        jpeg(&frame).ok_or_else(|| Refusal::unfit("this picture cannot be sent as JPEG"))
    }

    pub(super) fn show(&mut self) {
        self.shown_at = Instant::now();
        self.propose();
        let (seen, facts) = (self.seen(), self.facts());
        self.screen.show(Box::new(move || facts), seen, self.phase == Phase::Running);
    }

    /// The targets that are followed: of what was not followed here, those that the last frame has.
    pub(super) fn targets(&self) -> Vec<u64> {
        match (&self.recorded, self.trajectory.last()) {
            (Some(_), Some(last)) => last.records.iter().map(|r| r.target.0).collect(),
            _ => self.follower.targets(),
        }
    }

    /// How many frames the input has, and whether that is known for certain.
    fn length(&self) -> (Option<u64>, bool) {
        let info = self.follower.info();
        let head = self.trajectory.last().map_or(0, |row| row.frame + 1);
        match (info.frame_count, info.duration_s.zip(info.fps)) {
            (Some(count), _) => (Some(count), false),
            // At its end one knows.
            (None, _) if self.phase == Phase::Ended => (Some(head), false),
            (None, Some((seconds, fps))) => (Some(((seconds * fps).round() as u64).max(head)), true),
            (None, None) => (None, false),
        }
    }

    /// Where the trial is.
    pub(super) fn facts(&self) -> Value {
        let info = self.follower.info();
        let row = self.trajectory.at(self.shown.index()).map(|r| report::row(r, info));
        let versions = self.trajectory.versions().iter();
        let versions =
            versions.map(|v| json!({ "number": v.number, "why": v.why, "tracker": v.tracker, "frames": v.rows.len() }));
        let (detector, proposals) = self.proposals();
        let [undo, redo] = self.history.names();
        let kept = self.keeping.as_ref().and_then(|keeping| keeping.folder());
        let beside = self.beside.as_ref().map(|other| {
            let (row, step_ms) = other.row(self.shown.index());
            json!({ "now": row.map(|row| report::row(&row, info)), "step_ms": step_ms })
        });
        json!({
            "phase": self.phase,
            "message": self.message,
            "input": report::input(info, self.length()),
            "tracker": self.tracker.name,
            "parameters": self.follower.recipe().parameters().unwrap_or_default(),
            "now": row,
            "first": self.trajectory.first().map(|r| r.frame),
            "head": self.trajectory.last().map(|r| r.frame),
            "targets": self.targets(),
            "edits": self.follower.edits().iter().map(report::edit).collect::<Vec<_>>(),
            "speed": self.speed,
            "look": self.looks.look,
            "looks": Look::of(&self.shown),
            "detector": detector,
            "proposals": proposals,
            "seeking": self.follower.seeking().map(|s| json!({ "name": s.name(), "parameters": s.values() })),
            "backward": self.way_back(),
            "beside": beside,
            "recorded": self.recorded.as_ref().is_some_and(|recorded| recorded.from_folder),
            "revision": self.trajectory.revision(),
            "undo": undo,
            "redo": redo,
            "names": self.labels,
            "folder": kept.and_then(|folder| self.root.shown(folder).ok()),
            "version": self.trajectory.number(),
            "versions": versions.collect::<Vec<_>>(),
            "step_ms": self.step_ms,
            "viewers": self.screen.viewers(),
        })
    }
}
