//! `pursuit track`: from a configuration to the files of a run.

use crate::accuracy::AccuracyMeter;
use crate::config::{Methods, RunConfig};
use crate::input::{self, OpenedInput};
use crate::run_file::{HostFacts, InputFacts, RecipeFacts, RunFile, StateCounts, TimingFacts};
use crate::session::{Outcome, Progress, Session, Start};
use crate::sinks::{self, Format, Sink};
use crate::{RunError, trajectory_plots};
use pursuit_geometry::BBox;
use pursuit_media::input::StopHandle;
use pursuit_media::{OpenOptions, Source, Truth};
use pursuit_tracking::{Detector, Recipe};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// A run that has been checked and opened, about to start.
pub struct Run {
    input: OpenedInput,
    recipe: Box<dyn Recipe>,
    start: Start,
    boxes: Vec<BBox>,
    config: RunConfig,
    out: PathBuf,
}

/// What starts a run that has both the truth's first box and a detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preference {
    Truth,
    Detector,
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
        let Methods { recipe, detector } = config.methods()?;
        formats(&config)?;
        let input = input::open(name, &config, options)?;
        let (start, boxes) = choose_start(&config, input.info.truth.as_deref(), detector, prefer, name)?;
        let out = config.out.clone().unwrap_or_else(|| default_folder(name));
        std::fs::create_dir_all(&out).map_err(RunError::output(&out))?;
        Ok(Self { input, recipe, start, boxes, config, out })
    }

    /// How many frames there will be, where the input knows.
    pub fn frame_count(&self) -> Option<u64> {
        self.input.info.frame_count
    }

    /// Ends the run from another thread or a signal handler, even while it waits for a frame; set `stop` first.
    pub fn stop_handle(&self) -> Option<StopHandle> {
        self.input.source.stop_handle()
    }

    /// The truth that came with the input, one entry a frame.
    pub fn truth(&self) -> Option<&[Truth]> {
        self.input.info.truth.as_deref()
    }

    /// Tracks until the input ends, something breaks, or `stop` becomes true. Results are kept in any case.
    ///
    /// # Errors
    /// Only when nothing could be started; what ends a run early is in [`Finished::outcome`].
    pub fn run(self, stop: &AtomicBool, mut observe: impl FnMut(Progress<'_>)) -> Result<Finished, RunError> {
        let mut facts = self.facts()?;
        let run_json = self.out.join("run.json");
        facts.write(&run_json)?;
        let sinks = self.sinks()?;
        let mut files: Vec<PathBuf> = sinks.iter().map(|s| s.path().to_path_buf()).collect();

        let (truth, stats) = (self.input.info.truth, self.input.stats);
        let mut meter = AccuracyMeter::default();
        let session = Session::new(Box::new(self.input.source), self.recipe.as_ref(), self.start, sinks, stop);
        let mut outcome = session.run(|progress| {
            // The truth is of one target: the first.
            if let (Some(truth), Some(record)) = (&truth, progress.records.first()) {
                let known = usize::try_from(record.frame).ok().and_then(|i| truth.get(i));
                meter.add(record, known.copied().unwrap_or(Truth::Unknown));
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

        facts.dropped_frames = stats.dropped_frames();
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
        let fps = self.config.fps.or(self.input.info.fps);
        all.extend(sinks::overlay(&self.out.join("overlay.mp4"), fps, self.config.video)?);
        Ok(all)
    }

    fn facts(&self) -> Result<RunFile, RunError> {
        let info = &self.input.info;
        Ok(RunFile {
            version: env!("CARGO_PKG_VERSION"),
            status: "running",
            error: None,
            input: InputFacts {
                name: info.name.clone(),
                decoder: info.decoder.clone(),
                width: info.size.width,
                height: info.size.height,
                nominal_fps: info.fps,
            },
            recipe: RecipeFacts {
                tracker: self.recipe.name().to_owned(),
                parameters: self.recipe.parameters()?,
                detector: self.config.detect.clone().filter(|_| matches!(self.start, Start::Detector(_))),
                boxes: self.boxes.iter().map(|b| [b.left(), b.top(), b.width(), b.height()]).collect(),
            },
            seed: self.config.seed,
            host: HostFacts::here(),
            frame_count: 0,
            dropped_frames: 0,
            states: StateCounts::default(),
            timing: TimingFacts::default(),
            accuracy: None,
        })
    }
}

/// Boxes given, else the truth's first box, else the detector.
fn choose_start(
    config: &RunConfig,
    truth: Option<&[Truth]>,
    detector: Option<Box<dyn Detector>>,
    prefer: Preference,
    input: &str,
) -> Result<(Start, Vec<BBox>), RunError> {
    let boxes = config.start_boxes();
    if !boxes.is_empty() {
        return Ok((Start::Boxes(boxes.clone()), boxes));
    }
    let from = usize::try_from(config.from.unwrap_or(0)).unwrap_or(usize::MAX);
    let first = truth.and_then(|t| t.get(from)).and_then(Truth::bbox);
    match (first, detector) {
        (_, Some(detector)) if first.is_none() || prefer == Preference::Detector => {
            return Ok((Start::Detector(detector), Vec::new()));
        }
        (Some(bbox), _) => return Ok((Start::Boxes(vec![bbox]), vec![bbox])),
        (None, _) => {}
    }
    Err(RunError::usage(format!(
        "nothing to track in {input}: give a box, `--box LEFT,TOP,WIDTH,HEIGHT` in pixels of frame {from}, or a detector, `--detect ball`"
    )))
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
