//! `pursuit track`: from a configuration to the files of a run.

mod checks;

use crate::compare::Scoreboard;
use crate::config::RunConfig;
use crate::events::{ClipPlan, EventRules, Watcher};
use crate::folder_sinks::{Place, create_sinks, formats, shelf};
use crate::input::{self, OpenedInput};
use crate::publish::Publication;
use crate::resume::Earlier;
use crate::run::{AccuracyMeter, InputFacts, RecipeFacts, RunFile, StreamFacts};
use crate::run_folder::{Destination, FACTS, PLOTS, RunFolder, STATE};
use crate::segments::Shelf;
use crate::session::{Checkpoint, Outcome, Progress, Remote, Session};
use crate::sinks::{Format, Sink};
use crate::start::{Start, StartFrom};
use crate::{Fetched, RunError, measure, run_folder, trajectory_plots};
use checks::{check_measure, check_segments, destination, earlier};
use pursuit_geometry::Truth;
use pursuit_imaging::{CameraPose, ImageView};
use pursuit_media::wrappers::PrefetchStats;
use pursuit_media::{OpenOptions, Source, SourceInfo};
use std::path::PathBuf;
use std::sync::PoisonError;

/// A run that has been checked and opened, about to start.
pub struct Run {
    session: Session,
    info: SourceInfo,
    stats: PrefetchStats,
    recipe: RecipeFacts,
    config: RunConfig,
    fetched: Fetched,
    /// None for standard output, and where nothing is written.
    destination: Option<Destination>,
    /// Whether results go to the sinks and the observer alone.
    unwritten: bool,
    /// What is gone on with.
    earlier: Option<Earlier>,
    /// Where results go besides the files.
    further: Vec<Box<dyn Sink>>,
    /// Where they are published.
    publication: Option<Publication>,
    /// What happens is told by these.
    rules: EventRules,
    notes: Vec<String>,
}

/// What a run left behind.
#[derive(Debug)]
pub struct Finished {
    /// The folder with the files; none where results went to standard output.
    pub out: Option<PathBuf>,
    /// The files written, in the folder.
    pub files: Vec<PathBuf>,
    /// What `run.json` holds.
    pub facts: RunFile,
    /// What was measured of it, where that was asked for: what `measure.json` holds.
    pub measured: Option<measure::Facts>,
    /// How it ended.
    pub outcome: Outcome,
}

impl Run {
    /// Checks the configuration and where results are to go, and opens the input. Nothing is written yet.
    ///
    /// # Errors
    /// Wrong usage, an input that cannot be read, files in the way.
    pub fn prepare(config: RunConfig, options: &OpenOptions) -> Result<Self, RunError> {
        Self::prepare_with(config, None, Fetched::default(), options)
    }

    /// What a user should know of the methods, a line each: what a network by file was taken for, that it runs elsewhere than asked
    /// for. The log has them too.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// As [`prepare`](Self::prepare), of frames that the program has ([`frames`](crate::frames)) in place of an input that the
    /// configuration names. They are read on the thread that runs, none before it is wanted.
    ///
    /// # Errors
    /// As [`prepare`](Self::prepare), and where the configuration names an input.
    pub fn prepare_source(config: RunConfig, source: Box<dyn Source>, options: &OpenOptions) -> Result<Self, RunError> {
        if let Some(input) = &config.input {
            return Err(RunError::usage(format!("the frames are given; leave the input {input} out")));
        }
        let config = RunConfig { input: Some(source.info().name.clone().into()), ..config };
        Self::prepare_with(config, Some(source), Fetched::default(), options)
    }

    /// As [`prepare`](Self::prepare), of an input that something else has read from where it is.
    ///
    /// # Errors
    /// As [`prepare`](Self::prepare); messages may name the copy.
    pub fn prepare_fetched(config: RunConfig, fetched: Fetched, options: &OpenOptions) -> Result<Self, RunError> {
        Self::prepare_with(config, None, fetched, options)
    }

    pub(crate) fn prepare_with(
        config: RunConfig,
        given: Option<Box<dyn Source>>,
        fetched: Fetched,
        options: &OpenOptions,
    ) -> Result<Self, RunError> {
        let Some(name) = &config.input else {
            return Err(RunError::usage("no input; name a video, a folder of images, a camera or `scene:NAME`"));
        };
        let mut methods = config.methods()?;
        let notes = std::mem::take(&mut methods.notes);
        formats(&config)?;
        check_segments(&config)?;
        let rules = config.events.rules()?;
        let publication = match &config.publish {
            Some(address) => Some(Publication::new(address, &config.publish_options, &run_folder::name_of(name))?),
            None => None,
        };
        let destination = destination(&config, name)?;
        if config.measure == Some(true) {
            check_measure(&config, destination.as_ref())?;
        }
        let earlier = earlier(&config, destination.as_ref())?;
        let OpenedInput { source, info, stats } =
            input::open((name, given), &config, &fetched, earlier.as_ref().map(|e| e.last), options)?;
        // What a camera has shown does not come again: what was kept of it goes by its age alone.
        let keeps_segments = config.segment.is_some() && info.live;
        let destination = destination.map(|d| d.keeping_segments(keeps_segments));
        let start = Start::choose(&config, info.truth.as_deref(), &info.name)?;
        let recipe = start.recipe_facts(&config, &methods)?;
        let session = Session::new(source, methods.recipe.boxed_clone());
        let session = match &earlier {
            Some(earlier) => start.go_on(session, &earlier.state, methods)?,
            None => start.begin(session, methods, &config)?,
        };
        let run = Self {
            session,
            info,
            stats,
            recipe,
            config,
            fetched,
            destination,
            unwritten: false,
            earlier,
            further: Vec::new(),
            publication,
            rules,
            notes,
        };
        run.notes.iter().for_each(|note| tracing::warn!("{note}"));
        if let Some(earlier) = &run.earlier {
            earlier.check(&run.input_facts(), &run.recipe)?;
        }
        Ok(run)
    }

    /// Results also go to `sink`, such as a pan-tilt head; it comes before the files.
    #[must_use]
    pub fn with_sink(mut self, sink: Box<dyn Sink>) -> Self {
        self.further.push(sink);
        self
    }

    /// Says of each frame how the camera stood when it was taken, as a pan-tilt head knows it.
    #[must_use]
    pub fn posed_by(mut self, poses: Box<dyn FnMut(f64) -> Option<CameraPose> + Send>) -> Self {
        self.session = self.session.posed_by(poses);
        self
    }

    /// Writes no files and nothing on standard output: results go to the sinks given and to the observer alone.
    #[must_use]
    pub fn unwritten(mut self) -> Self {
        (self.destination, self.unwritten) = (None, true);
        self
    }

    /// What is known of the input. All boxes are in pixels of the whole input: its truth, what is written, and what
    /// [`run`](Self::run) hands to its observer and to further sinks.
    pub const fn input(&self) -> &SourceInfo {
        &self.info
    }

    /// The tracker with every parameter, and what starts it.
    pub const fn recipe(&self) -> &RecipeFacts {
        &self.recipe
    }

    /// Whether it begins with something to follow, and does not wait to be told.
    pub fn follows(&self) -> bool {
        self.config.start != Some(StartFrom::Command)
    }

    /// How many frames there will be, where the input knows.
    pub fn frame_count(&self) -> Option<u64> {
        self.info.frame_count
    }

    /// Stops and commands the run from another thread or a signal handler, even while it waits for a frame.
    pub fn remote(&self) -> Remote {
        self.session.remote()
    }

    /// The truth that came with the input, one entry a frame.
    pub fn truth(&self) -> Option<&[Truth]> {
        self.info.truth.as_deref()
    }

    /// Tracks until the input ends, something breaks, or it is stopped. Results are kept in any case.
    ///
    /// # Errors
    /// When the first frame cannot be used or the folder cannot be made: nothing is written then, and what was there stays.
    /// What ends a run later is in [`Finished::outcome`].
    pub fn run(mut self, mut observe: impl FnMut(Progress<'_>)) -> Result<Finished, RunError> {
        self.session.start()?;
        let mut facts = self.facts();
        let mut sinks = std::mem::take(&mut self.further);
        let published = match &self.publication {
            Some(publication) => {
                let sink = publication.start(&facts.input, &facts.recipe, &self.rules.zones)?;
                let published = sink.facts();
                sinks.push(Box::new(sink));
                Some(published)
            }
            None => None,
        };
        let folder = match (self.destination.take(), &self.earlier) {
            (Some(destination), None) => Some(destination.open()?),
            (Some(destination), Some(_)) => Some(destination.reopen()?),
            (None, _) => None,
        };
        let shelf = match &folder {
            Some(folder) => shelf(&self.config, &self.rules, folder, self.earlier.is_some())?,
            None => None,
        };
        match &folder {
            Some(folder) => {
                facts.write(&folder.file(FACTS))?;
                shelf.iter().for_each(|shelf| shelf.tell_in(facts.clone(), folder.file(FACTS)));
                let place = Place { folder, shelf: shelf.as_ref(), earlier: self.earlier.as_ref() };
                sinks.extend(create_sinks(&self.config, &self.info, &self.rules, place)?);
                // What a live source has shown does not come again.
                let checkpoint = (!self.info.live).then(|| Checkpoint::new(folder.file(STATE)));
                self.session = self.session.kept_in(checkpoint);
            }
            None if self.unwritten => {}
            None => {
                let size = self.info.input_size();
                sinks.push(Format::JSONL.to_writer("standard output", Box::new(std::io::stdout()), size)?);
            }
        }
        let watcher = watcher(&self.rules, shelf.as_ref(), published.is_some());
        self.session = self.session.watching(watcher);
        let mut files: Vec<PathBuf> = sinks.iter().flat_map(|s| s.files()).collect();

        let mut meter = AccuracyMeter::default();
        let compared = self.recipe.compared.iter().map(|compared| &compared.tracker);
        let mut scoreboard = Scoreboard::new(std::iter::once(&self.recipe.tracker).chain(compared).cloned().collect());
        let info = self.info;
        let kept = self.earlier.map(|earlier| earlier.kept).unwrap_or_default();
        if info.truth.is_some() {
            kept.first.iter().for_each(|(frame, estimate)| meter.add(info.truth_at(*frame), estimate.as_ref()));
        }
        let mut empty_depth_frames = info.depth.as_ref().map(|_| 0);
        let mut outcome = self.session.with_sinks(sinks).run(|progress| {
            if let Some(count) = &mut empty_depth_frames {
                *count += u64::from(progress.frame.depth_mm().is_some_and(is_empty));
            }
            if info.truth.is_some() {
                // The truth is of one target: the first.
                let estimate = progress.records.first().and_then(|r| r.estimate.as_ref());
                meter.add(info.truth_at(progress.frame.index()), estimate);
            }
            scoreboard.add(progress.records, info.truth.as_ref().map(|_| info.truth_at(progress.frame.index())));
            observe(progress);
        });

        facts.status = match (&outcome.failure, outcome.interrupted) {
            (Some(_), _) => "broken",
            (None, true) => "interrupted",
            (None, false) => "done",
        };
        facts.error = outcome.failure.as_ref().map(|e| self.fetched.renamed(e.to_string()));
        facts.resumed_at = kept.first.last().map(|(frame, _)| frame + 1);
        facts.frame_count = kept.frames + outcome.frames;
        let damage = std::mem::take(&mut outcome.damage.messages);
        facts.damage = damage.into_iter().map(|message| self.fetched.renamed(message)).collect();
        facts.damage_count = outcome.damage.count;
        facts.dropped_frames = self.stats.dropped_frames();
        facts.empty_depth_frames = empty_depth_frames;
        facts.stream = info.stream.map(|stream| StreamFacts::new(stream.counts(), outcome.age_ms));
        facts.segments = shelf.as_ref().map(Shelf::facts);
        files.extend(shelf.map(|shelf| shelf.list()));
        facts.publish = published.map(|facts| facts.lock().unwrap_or_else(PoisonError::into_inner).clone());
        facts.states = kept.states.with(outcome.states);
        facts.timing = outcome.timing;
        // Which of many targets the truth is of nobody says.
        let many = self.config.many == Some(true) || self.config.detections.is_some();
        facts.accuracy = meter.accuracy().filter(|_| !many);
        facts.compared = scoreboard.facts();
        let mut measured = None;
        if let Some(folder) = &folder {
            match conclude(&facts, folder, &self.config, &mut files) {
                Ok(found) => measured = found,
                Err(late) => outcome.failure = outcome.failure.or(Some(late)),
            }
        }
        Ok(Finished { out: folder.map(|f| f.path().to_path_buf()), files, facts, measured, outcome })
    }

    fn input_facts(&self) -> InputFacts {
        InputFacts::of(&self.info)
    }

    fn facts(&self) -> RunFile {
        RunFile::begun(self.input_facts(), self.recipe.clone())
    }
}

/// Whether no pixel of a depth image has data.
fn is_empty(depth: ImageView<'_, u16>) -> bool {
    (0..depth.size().height).all(|y| depth.row(y).iter().all(|mm| *mm == 0))
}

/// What tells what happens, where somebody asked for it.
fn watcher(rules: &EventRules, shelf: Option<&Shelf>, is_published: bool) -> Option<Watcher> {
    let plan = rules.clips.clone().zip(shelf.cloned()).map(|(rules, shelf)| ClipPlan::new(rules, shelf));
    (rules.file || is_published || plan.is_some()).then(|| Watcher::new(rules.clone(), plan))
}

/// Writes what is known at the end, and measures the run where that was asked for.
fn conclude(
    facts: &RunFile,
    folder: &RunFolder,
    config: &RunConfig,
    files: &mut Vec<PathBuf>,
) -> Result<Option<measure::Facts>, RunError> {
    let run_json = folder.file(FACTS);
    facts.write(&run_json)?;
    files.push(run_json);
    if config.plots == Some(true) {
        files.extend(trajectory_plots::draw(&folder.file(Format::CSV.file_name()), &folder.file(PLOTS))?);
    }
    if config.measure != Some(true) {
        return Ok(None);
    }
    let options = &config.measure_options;
    let found = measure::measure(folder.path(), None, options)?;
    let plots = options.plots != Some(false);
    files.extend(measure::Destination::new(folder.path(), &options.formats, plots)?.write(&found)?);
    Ok(Some(found.facts))
}
