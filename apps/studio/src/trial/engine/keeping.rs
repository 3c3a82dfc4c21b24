//! The trial's folder: what was followed and done is on the disk after every frame and every change.

use super::super::phase::Phase;
use super::Engine;
use pursuit::RunError;
use pursuit::media::Locator;
use pursuit::parameters::Parameters;
use pursuit::revise::{Edit, EditKind, Revised, RunWriter};
use pursuit::run::{InputFacts, RecipeFacts, RunFile};
use pursuit::tracking::many::AcquisitionParams;
use std::path::PathBuf;

/// Where a trial is written to.
pub(crate) enum Place {
    /// A new folder below this one, once there is something to keep.
    Below(PathBuf),
    /// The folder that it was opened from.
    At(PathBuf),
}

pub(super) struct Keeping {
    place: Place,
    input: Locator,
    /// The name of the file that was uploaded, where it was; then that of the copy that is kept.
    called: Option<String>,
    writer: Option<RunWriter>,
    /// Why nothing can be written, once that is known: it is said once.
    problem: Option<String>,
}

impl Keeping {
    pub fn new(place: Place, input: Locator, called: Option<String>) -> Self {
        Self { place, input, called, writer: None, problem: None }
    }

    /// The folder, once there is one.
    pub fn folder(&self) -> Option<&std::path::Path> {
        self.writer.as_ref().map(RunWriter::path)
    }

    fn open(&mut self, size: pursuit::geometry::Size) -> Result<RunWriter, RunError> {
        match &self.place {
            Place::Below(parent) => {
                let Some(called) = self.called.clone() else { return RunWriter::create(parent, &self.input, size) };
                let writer = RunWriter::create(parent, &Locator::from(&*called), size)?;
                // What was uploaded goes with the studio: it is kept beside what was made of it.
                let (file, upload) = (writer.path().join(&called), self.input.path());
                if std::fs::hard_link(upload, &file).or_else(|_| std::fs::copy(upload, &file).map(drop)).is_ok() {
                    self.called = Some(file.display().to_string());
                }
                Ok(writer)
            }
            // Where another trial is writing into it, this one gets a folder beside it.
            Place::At(folder) => RunWriter::reopen(folder, size).or_else(|error| {
                let parent = folder.parent().ok_or(error)?;
                RunWriter::create(parent, &self.input, size)
            }),
        }
    }
}

impl Engine {
    /// Writes what is new. Nothing is written of a trial in which nothing was done, nor on the way back, which may be given up.
    pub(super) fn keep(&mut self) {
        let idle = self.follower.edits().is_empty() && self.follower.seeking().is_none() && self.labels.is_empty();
        let untouched = self.recorded.as_ref().is_some_and(|recorded| recorded.from_folder) && !self.touched;
        let Some(keeping) = &mut self.keeping else { return };
        if keeping.problem.is_some() || self.returning.is_some() || untouched || (idle && keeping.writer.is_none()) {
            return;
        }
        let size = self.follower.info().input_size();
        let written = match keeping.writer.take().map_or_else(|| keeping.open(size), Ok) {
            Ok(mut writer) => {
                let written = writer.update(&self.trajectory);
                keeping.writer = Some(writer);
                written
            }
            Err(error) => Err(error),
        };
        self.say_if_lost(written);
        if self.phase != Phase::Running {
            self.keep_facts(if self.phase == Phase::Ended { "done" } else { "running" });
        }
    }

    /// Nothing more comes.
    pub(super) fn keep_at_last(&mut self) {
        self.break_off_return();
        self.keep();
        let whole = self.phase == Phase::Ended || self.recorded.as_ref().is_some_and(|recorded| recorded.is_whole);
        self.keep_facts(if whole { "done" } else { "interrupted" });
    }

    fn keep_facts(&mut self, status: &'static str) {
        if self.keeping.as_ref().is_none_or(|keeping| keeping.writer.is_none()) {
            return;
        }
        let facts = self.run_file(status);
        let revised = Revised::new(self.follower.edits(), &self.trajectory, self.labels.clone(), self.last_target);
        let keeping = self.keeping.as_mut().and_then(|keeping| keeping.writer.as_mut());
        let written = keeping.map_or(Ok(()), |writer| writer.tell(&facts, &revised));
        self.say_if_lost(written);
    }

    fn say_if_lost(&mut self, written: Result<(), RunError>) {
        if let (Err(error), Some(keeping)) = (written, &mut self.keeping) {
            let problem = format!("this trial is not kept in a folder any more: {error}");
            (keeping.problem, self.message) = (Some(problem.clone()), Some(problem));
        }
    }

    /// What `run.json` says, as of a run of the command line.
    fn run_file(&self, status: &'static str) -> RunFile {
        let info = self.follower.info();
        let mut input = InputFacts::of(info);
        if let Some(called) = self.keeping.as_ref().and_then(|keeping| keeping.called.clone()) {
            input.name = called;
        }
        let added = |e: &Edit| match &e.kind {
            EditKind::Add { bbox, .. } => Some((e.frame, [bbox.left(), bbox.top(), bbox.width(), bbox.height()])),
            _ => None,
        };
        let added: Vec<(u64, [f64; 4])> = self.follower.edits().iter().filter_map(added).collect();
        let first = added.first().map(|(frame, _)| *frame);
        let seeking = self.follower.seeking();
        let recipe = RecipeFacts {
            tracker: self.tracker.name.to_owned(),
            start: if seeking.is_some() { "detector" } else { "box" },
            start_frame: first.filter(|_| seeking.is_none()),
            parameters: self.follower.base().parameters().unwrap_or_default(),
            detector: seeking.map(|seeking| seeking.name().to_owned()),
            detector_parameters: seeking.map(|seeking| seeking.values()),
            acquire: seeking.and_then(|_| AcquisitionParams::default().to_table("acquire").ok()),
            many: None,
            compared: Vec::new(),
            boxes: added.iter().filter(|(frame, _)| Some(*frame) == first).map(|(_, ltwh)| *ltwh).collect(),
        };
        let mut facts = RunFile::begun(input, recipe);
        (facts.status, facts.frame_count) = (status, self.trajectory.len() as u64);
        for record in self.trajectory.rows().flat_map(|row| &row.records) {
            facts.states.add(record.estimate.as_ref().map_or(pursuit::TrackState::Lost, |e| e.state));
        }
        facts
    }
}
