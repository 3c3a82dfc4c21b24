//! `pursuit track`: from a configuration to the files of a run.

use crate::config::{Methods, RunConfig};
use crate::input::{self, OpenedInput};
use crate::run::{AccuracyMeter, HostFacts, InputFacts, RecipeFacts, RunFile, StateCounts, TimingFacts};
use crate::session::{Outcome, Progress, Remote, Session};
use crate::sinks::{self, Format, Sink};
use crate::{RunError, trajectory_plots};
use pursuit_geometry::{BBox, Truth};
use pursuit_media::wrappers::PrefetchStats;
use pursuit_media::{OpenOptions, SourceInfo};
use pursuit_tracking::many::Associating;
use std::path::{Path, PathBuf};

/// A run that has been checked and opened, about to start.
pub struct Run {
    session: Session,
    info: SourceInfo,
    stats: PrefetchStats,
    recipe: RecipeFacts,
    config: RunConfig,
    out: PathBuf,
    /// Where results go besides the files.
    further: Vec<Box<dyn Sink>>,
}

/// What starts a run that has both the truth's first box and a detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preference {
    Truth,
    Detector,
}

/// How a run gets its first targets.
#[derive(Debug, Clone, PartialEq)]
enum Start {
    Boxes(Vec<BBox>),
    Detector,
    Many(Vec<BBox>),
}

/// What a run left behind.
#[derive(Debug)]
pub struct Finished {
    /// The folder with the files.
    pub out: PathBuf,
    /// The files written, in the folder.
    pub files: Vec<PathBuf>,
    /// What `run.json` holds.
    pub facts: RunFile,
    /// How it ended.
    pub outcome: Outcome,
}

impl Run {
    /// Checks the configuration, opens the input and makes the folder.
    ///
    /// # Errors
    /// Wrong usage, an input that cannot be read, a folder that cannot be made.
    pub fn prepare(config: RunConfig, options: &OpenOptions) -> Result<Self, RunError> {
        Self::prepare_with(config, options, Preference::Truth)
    }

    pub(crate) fn prepare_with(config: RunConfig, options: &OpenOptions, prefer: Preference) -> Result<Self, RunError> {
        let Some(name) = &config.input else {
            return Err(RunError::usage("no input; name a video, a folder of images, a camera or `scene:NAME`"));
        };
        let methods = config.methods()?;
        formats(&config)?;
        let OpenedInput { source, info, stats } = input::open(name, &config, options)?;
        let start = choose_start(&config, info.truth.as_deref(), prefer, name)?;
        let recipe = recipe_facts(&config, &methods, &start)?;
        let session = begin(Session::new(Box::new(source), methods.recipe.boxed_clone()), start, methods, &config)?;
        let out = config.out.clone().unwrap_or_else(|| default_folder(name));
        std::fs::create_dir_all(&out).map_err(RunError::output(&out))?;
        Ok(Self { session, info, stats, recipe, config, out, further: Vec::new() })
    }

    /// Results also go to `sink`, such as a pan-tilt head; it comes before the files.
    #[must_use]
    pub fn with_sink(mut self, sink: Box<dyn Sink>) -> Self {
        self.further.push(sink);
        self
    }

    /// What is known of the input: the size of its frames, whether it is live.
    pub const fn input(&self) -> &SourceInfo {
        &self.info
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
    /// Only when nothing could be started; what ends a run early is in [`Finished::outcome`].
    pub fn run(mut self, mut observe: impl FnMut(Progress<'_>)) -> Result<Finished, RunError> {
        let mut facts = self.facts();
        let run_json = self.out.join("run.json");
        facts.write(&run_json)?;
        let mut sinks = std::mem::take(&mut self.further);
        sinks.extend(self.sinks()?);
        let mut files: Vec<PathBuf> = sinks.iter().flat_map(|s| s.files()).collect();

        let mut meter = AccuracyMeter::default();
        let info = self.info;
        let mut outcome = self.session.with_sinks(sinks).run(|progress| {
            if info.truth.is_some() {
                // The truth is of one target: the first.
                let estimate = progress.records.first().and_then(|r| r.estimate.as_ref());
                meter.add(info.truth_at(progress.frame.index()), estimate);
            }
            observe(progress);
        });

        facts.status = match (&outcome.failure, outcome.interrupted) {
            (Some(_), _) => "broken",
            (None, true) => "interrupted",
            (None, false) => "done",
        };
        facts.error = outcome.failure.as_ref().map(ToString::to_string);
        facts.frame_count = outcome.frames;
        facts.dropped_frames = self.stats.dropped_frames();
        facts.states = outcome.states;
        facts.timing = outcome.timing;
        facts.accuracy = meter.accuracy();
        let late = facts.write(&run_json).and_then(|()| {
            files.push(run_json);
            if self.config.plots == Some(true) {
                files.extend(trajectory_plots::draw(&self.out.join("trajectory.csv"), &self.out.join("plots"))?);
            }
            Ok(())
        });
        outcome.failure = outcome.failure.or(late.err());
        Ok(Finished { out: self.out, files, facts, outcome })
    }

    fn sinks(&self) -> Result<Vec<Box<dyn Sink>>, RunError> {
        let mut all = vec![Format::Csv.create(&self.out)?];
        for format in formats(&self.config)?.into_iter().filter(|f| *f != Format::Csv) {
            all.push(format.create(&self.out)?);
        }
        let fps = self.config.fps.or(self.info.fps);
        all.extend(sinks::overlay(&self.out.join("overlay.mp4"), fps, self.config.video)?);
        Ok(all)
    }

    fn facts(&self) -> RunFile {
        RunFile {
            version: env!("CARGO_PKG_VERSION"),
            status: "running",
            error: None,
            input: InputFacts {
                name: self.info.name.clone(),
                decoder: self.info.decoder.clone(),
                width: self.info.size.width,
                height: self.info.size.height,
                nominal_fps: self.info.fps,
            },
            recipe: self.recipe.clone(),
            host: HostFacts::here(),
            frame_count: 0,
            dropped_frames: 0,
            states: StateCounts::default(),
            timing: TimingFacts::default(),
            accuracy: None,
        }
    }
}

fn recipe_facts(config: &RunConfig, methods: &Methods, start: &Start) -> Result<RecipeFacts, RunError> {
    let boxes = match start {
        Start::Boxes(boxes) | Start::Many(boxes) => boxes.as_slice(),
        Start::Detector => &[],
    };
    Ok(RecipeFacts {
        tracker: methods.recipe.name().to_owned(),
        parameters: methods.recipe.parameters()?,
        detector: config.detect.clone().filter(|_| !matches!(start, Start::Boxes(_))),
        boxes: boxes.iter().map(|b| b.ltwh().into()).collect(),
    })
}

/// Tells the session what to follow.
fn begin(session: Session, start: Start, methods: Methods, config: &RunConfig) -> Result<Session, RunError> {
    Ok(match (start, methods.detector) {
        (Start::Detector, Some(detector)) => session.finding(detector, methods.acquire)?,
        (Start::Many(boxes), Some(detector)) => {
            let mut targets = Associating::new(detector, methods.many)?;
            if config.tracker.is_some() {
                targets = targets.with_appearance(methods.recipe);
            }
            session.following(Box::new(targets)).starting_on(boxes)
        }
        (Start::Boxes(boxes) | Start::Many(boxes), _) => session.starting_on(boxes),
        // Nothing starts by a detector that is not there.
        (Start::Detector, None) => session,
    })
}

/// Boxes given, else the truth's first box, else the detector. Where everything that the detector finds is followed, the
/// truth's box says nothing.
fn choose_start(
    config: &RunConfig,
    truth: Option<&[Truth]>,
    prefer: Preference,
    input: &str,
) -> Result<Start, RunError> {
    let (boxes, detector) = (config.start_boxes(), config.detect.is_some());
    if config.many == Some(true) {
        return Ok(Start::Many(boxes));
    }
    if !boxes.is_empty() {
        return Ok(Start::Boxes(boxes));
    }
    let from = usize::try_from(config.from.unwrap_or(0)).unwrap_or(usize::MAX);
    match truth.and_then(|t| t.get(from)).and_then(Truth::bbox) {
        Some(bbox) if prefer == Preference::Truth || !detector => Ok(Start::Boxes(vec![bbox])),
        _ if detector => Ok(Start::Detector),
        _ => Err(RunError::usage(format!(
            "nothing to track in {input}: give a box, `--box LEFT,TOP,WIDTH,HEIGHT` in pixels of frame {from}, or a detector, `--detect ball`"
        ))),
    }
}

fn formats(config: &RunConfig) -> Result<Vec<Format>, RunError> {
    config.formats.iter().map(|name| name.parse()).collect()
}

/// `pursuit-out/NAME`, with NAME made from the input's.
fn default_folder(input: &str) -> PathBuf {
    let last = input.trim_end_matches('/').rsplit(['/', '\\']).next().unwrap_or(input);
    let stem = Path::new(last).file_stem().and_then(|s| s.to_str()).unwrap_or(last);
    let safe: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let safe = safe.trim_matches(['.', '-']);
    Path::new("pursuit-out").join(if safe.is_empty() { "run" } else { safe })
}

#[cfg(test)]
mod tests {
    use super::default_folder;
    use std::path::Path;

    #[test]
    fn folders_are_named_after_inputs_and_stay_inside() {
        for (input, folder) in [
            ("a/b/clip.mp4", "clip"),
            ("a/b/", "b"),
            ("-", "run"),
            ("..", "run"),
            ("rtsp://host/stream?x=1", "stream-x-1"),
            ("camera:0", "camera-0"),
            ("scene:table-tennis?seed=1", "scene-table-tennis-seed-1"),
        ] {
            assert_eq!(default_folder(input), Path::new("pursuit-out").join(folder), "{input}");
        }
    }
}
