//! What to run, as a value: read from a TOML file, from a command line, or both.

mod catalogue;
mod device;
pub(crate) mod options;
mod settings;
mod texts;

pub use catalogue::catalogue;
pub use settings::{ACQUIRE_PREFIX, DETECTOR_PREFIX, MANY_PREFIX, Participants, Settings};
pub use texts::{parse_box, parse_setting};

use crate::associate::FileDetector;
use crate::config::options::options;
use crate::events::EventOptions;
use crate::measure::MeasureOptions;
use crate::publish::PublishOptions;
use crate::segments::{Span, Stretch};
use crate::sinks::OverlayStyle;
use crate::start::StartFrom;
use crate::{Resize, RunError};
use pursuit_address::Locator;
use pursuit_geometry::BBox;
use pursuit_inference::onnx::Device;
use pursuit_media::depth::DepthOptions;
use pursuit_parameters::Parameters;
use pursuit_trackers::embedding::embedder;
use pursuit_trackers::registry;
use pursuit_tracking::many::{AcquisitionParams, EmbeddingModel, ManyParams};
use pursuit_tracking::{Detector, DetectorEntry, Embedder, Recipe};
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

options! {
    /// Everything about a run that can stand in a configuration file. What is absent has its default.
    ///
    /// ```toml
    /// input = "clip.mp4"
    /// detect = "ball"
    /// out = "results"
    /// [parameters]
    /// color = "orange"
    /// ```
    pub struct RunConfig {
        /// What to track in: a file, a folder, a camera, a stream, `-`, or `scene:NAME`. Credentials in it are read, and neither
        /// shown nor stored.
        pub input: Option<Locator>,
        /// Depth images that belong to the input.
        pub depth: Option<String>,
        /// How depth images are to be read.
        pub depth_options: DepthOptions,
        /// Boxes to start from, `[left, top, width, height]` in pixels.
        pub boxes: Vec<[f64; 4]>,
        /// Name of the tracker.
        pub tracker: Option<String>,
        /// Trackers that are followed beside it from the same box; without a name for the tracker the first of them takes its place.
        pub compare: Vec<String>,
        /// Name of the detector that finds the target when no box is given.
        pub detect: Option<String>,
        /// What networks by file run on, where onnxruntime's library can hand them there; else they run on the processor, and the run
        /// says so. Those that are built in run on the processor.
        pub device: Option<Device>,
        /// What starts the run where no box is given: `detector`, which is the default where there is one, `truth`, the first box
        /// of the truth that came with the input, or `command`: nothing, until somebody says what to follow.
        pub start: Option<StartFrom>,
        /// File of detections, which takes the place of a detector: what it says of a frame is found there.
        pub detections: Option<PathBuf>,
        /// Whether everything that the detector finds is followed, not one target; where detections come from a file it is, unless
        /// this says otherwise.
        pub many: Option<bool>,
        /// Folder for the results.
        pub out: Option<PathBuf>,
        /// Whether a run without a folder named replaces the last of its name, in place of making a new folder.
        pub overwrite: Option<bool>,
        /// Whether to go on with the run in the folder, which was interrupted.
        pub resume: Option<bool>,
        /// Whether to write the overlay video.
        pub video: Option<bool>,
        /// How much the overlay video shows.
        pub overlay: Option<OverlayStyle>,
        /// Whether to draw plots.
        pub plots: Option<bool>,
        /// Whether the run is measured when it is done, by the calibration beside it.
        pub measure: Option<bool>,
        /// How it is measured.
        pub measure_options: MeasureOptions,
        /// Further trajectory files, by the names of [`Format`](crate::sinks::Format).
        pub formats: Vec<String>,
        /// How long a segment of the trajectory, the overlay and all else that grows is; without, each is one file.
        pub segment: Option<Span>,
        /// How long segments, clips and pictures of events are kept; without, for ever.
        pub keep: Option<Span>,
        /// What of what happens is told and kept: zones, clips of events.
        pub events: EventOptions,
        /// A broker that results are published to, `mqtt://[USER@]HOST[:PORT][/PREFIX]` or `nats://…`. A password in it is
        /// neither shown nor stored.
        pub publish: Option<Locator>,
        /// How they are published.
        pub publish_options: PublishOptions,
        /// First frame to look at.
        pub from: Option<u64>,
        /// Last frame to look at.
        pub to: Option<u64>,
        /// Of how many frames one is looked at.
        pub stride: Option<NonZeroU64>,
        /// The part of the picture to look at, `[left, top, width, height]` in pixels of the input.
        pub region: Option<[f64; 4]>,
        /// To what size pictures are brought before they are looked at.
        pub resize: Option<Resize>,
        /// Frames per second to assume instead of the input's own times.
        pub fps: Option<f64>,
        /// Whether a recording is played as a camera would: no faster than its frames' own times say, and without what comes too fast.
        pub real_time: Option<bool>,
        /// Parameters of the tracker and the detector; see [`Settings::split`].
        pub parameters: toml::Table,
    }
    unwritten {
        /// The file that it was read from.
        pub read_from: Option<PathBuf>,
    }
}

impl RunConfig {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// [`RunError::Usage`] when it cannot be read, or holds something that has no meaning.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let wrong = |problem: String| RunError::usage(format!("configuration {}: {problem}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
        let config: Self = toml::from_str(&text).map_err(|e| wrong(e.to_string().trim_end().to_owned()))?;
        Ok(Self { read_from: Some(path.to_path_buf()), ..config })
    }

    /// The files that a run reads, whether they are there or not: the input, its truth, depth, the configuration.
    pub(crate) fn files(&self) -> impl Iterator<Item = PathBuf> {
        let input = self.input.iter().map(|input| input.path().to_path_buf());
        let media = input.chain(self.depth.iter().map(PathBuf::from));
        let detections = self.detections.clone();
        media.flat_map(|path| [path.with_extension("csv"), path]).chain(detections).chain(self.read_from.clone())
    }

    /// How the run is cut, and how long its pieces stay.
    pub(crate) fn stretch(&self) -> Stretch {
        Stretch { every_s: self.segment.map(Span::seconds), keep_s: self.keep.map(Span::seconds) }
    }

    /// Whether everything that is found is followed.
    pub(crate) fn follows_all(&self) -> bool {
        self.many.unwrap_or(self.detections.is_some())
    }

    /// Whether something finds targets.
    pub(crate) const fn detects(&self) -> bool {
        self.detect.is_some() || self.detections.is_some()
    }

    /// Whether what the run is told to start from is there to start from.
    pub(crate) fn check_start(&self) -> Result<(), RunError> {
        let problem = match self.start {
            None => return Ok(()),
            Some(StartFrom::Truth | StartFrom::Detector) if !self.boxes.is_empty() => {
                "boxes start the run already; leave `--start` or `--box` out"
            }
            Some(StartFrom::Truth) if self.follows_all() => {
                "the truth's box is one target; leave `--start truth` or `--many` out"
            }
            Some(StartFrom::Truth) => return Ok(()),
            Some(StartFrom::Detector) if self.detects() => return Ok(()),
            Some(StartFrom::Detector) => "no detector is named; add one, `--detect motion`",
            Some(StartFrom::Command) if !self.boxes.is_empty() || self.detects() => {
                "somebody is to say what to follow; leave `--start command` out, or boxes and detectors"
            }
            Some(StartFrom::Command) => return Ok(()),
        };
        Err(RunError::usage(problem))
    }

    /// The boxes to start from.
    pub fn start_boxes(&self) -> Vec<BBox> {
        self.boxes.iter().map(|&[l, t, w, h]| BBox::from_ltwh(l, t, w, h)).collect()
    }

    /// The tracker and, where one is named, the detector, with their parameters; whose a parameter is, [`Settings::split`]
    /// says.
    ///
    /// # Errors
    /// Unknown names, parameters that nobody knows, bad values.
    pub fn methods(&self) -> Result<Methods, RunError> {
        let detector = self.detect.as_deref().map(registry::detector).transpose()?;
        let many = self.follows_all();
        if let (Some(name), Some(file)) = (&self.detect, &self.detections) {
            let file = file.display();
            return Err(RunError::usage(format!(
                "the detector {name} and the detections of {file} exclude each other; give one"
            )));
        }
        if many && !self.detects() {
            return Err(RunError::usage("nothing says what to follow; name a detector, for example `--detect ball`"));
        }
        self.check_compare()?;
        let mut named = self.tracker.iter().chain(&self.compare);
        let tracker = match (named.next(), detector) {
            (Some(name), _) => registry::tracker(name)?,
            (None, Some(detector)) => registry::tracker(detector.default_tracker)?,
            (None, None) => registry::tracker(registry::DEFAULT_TRACKER)?,
        };
        let compared = named.map(|name| registry::tracker(name)).collect::<Result<Vec<_>, _>>()?;
        let trackers: Vec<_> = std::iter::once(tracker).chain(compared).collect();
        let mut settings = Settings::split(&self.parameters, &Participants { trackers: &trackers, detector, many })?;
        let schemas: Vec<_> = trackers.iter().map(|tracker| tracker.default_recipe().schema()).collect();
        let of_detector = detector.map(DetectorEntry::schema).unwrap_or_default();
        let is_taken = self.device.is_some_and(|device| device::hand(device, &mut settings, &schemas, &of_detector));
        let mut recipes = trackers.iter().zip(&settings.trackers).map(|(tracker, own)| tracker.recipe(own));
        let recipe = recipes.next().unwrap_or_else(|| tracker.recipe(&toml::Table::new()))?;
        let compared = recipes.collect::<Result<Vec<_>, _>>()?;
        let many = detector.map_or_else(ManyParams::default, registry::many);
        let from_file = self.detections.as_deref().map(|file| FileDetector::read(file, None)).transpose()?;
        let file = |path: &PathBuf| toml::Table::from_iter([("file".to_owned(), path.display().to_string().into())]);
        let detector_parameters = match &self.detections {
            Some(path) => Some(file(path)),
            None => detector.map(|d| d.parameters(&settings.detector)).transpose()?,
        };
        let detector = match from_file {
            Some(detector) => Some(Box::new(detector) as Box<dyn Detector>),
            None => detector.map(|d| d.detector(&settings.detector)).transpose()?,
        };
        let many = many.with(MANY_PREFIX, &settings.many)?;
        let mut notes: Vec<String> = detector.iter().flat_map(|detector| detector.notes()).collect();
        let embedder = embedder(&many.embedding, self.device.unwrap_or(Device::Cpu))?;
        notes.extend(embedder.iter().flat_map(|embedder| embedder.notes()));
        let is_taken = is_taken || many.embedding.model == EmbeddingModel::Network;
        notes.extend(self.device.and_then(|device| device::note(device, is_taken)));
        Ok(Methods {
            recipe,
            compared,
            detector,
            detector_parameters,
            acquire: AcquisitionParams::default().with(ACQUIRE_PREFIX, &settings.acquire)?,
            embedder,
            many,
            notes,
        })
    }
}

/// What follows the targets, and what finds them where a detector was asked for.
pub struct Methods {
    /// Makes trackers.
    pub recipe: Box<dyn Recipe>,
    /// Make the trackers that are followed beside it.
    pub compared: Vec<Box<dyn Recipe>>,
    /// Finds the target, or the targets.
    pub detector: Option<Box<dyn Detector>>,
    /// Every parameter of the detector with its value.
    pub detector_parameters: Option<toml::Table>,
    /// How one target found is made sure of.
    pub acquire: AcquisitionParams,
    /// How many targets are told apart.
    pub many: ManyParams,
    /// Says what those look like, where that is asked for.
    pub embedder: Option<Box<dyn Embedder>>,
    /// What a user should know of them, a line each: what a network by file was taken for, that it runs elsewhere than asked for.
    pub notes: Vec<String>,
}

/// The trackers `names` with their parameters, as an evaluation wants them; whose a parameter is, [`Settings::split`] says.
///
/// # Errors
/// Unknown names, parameters that nobody knows, bad values.
pub fn recipes(names: &[String], parameters: &toml::Table) -> Result<Vec<Box<dyn Recipe>>, RunError> {
    let trackers = names.iter().map(|n| registry::tracker(n)).collect::<Result<Vec<_>, _>>()?;
    let settings = Settings::split(parameters, &Participants { trackers: &trackers, ..Participants::default() })?;
    let recipes = trackers.iter().zip(&settings.trackers).map(|(tracker, own)| tracker.recipe(own));
    Ok(recipes.collect::<Result<_, _>>()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overriding_keeps_what_is_not_said() {
        let file: RunConfig = toml::from_str("tracker = 'a'\nfps = 25.0\n[parameters]\nx = 1\ny = 2").unwrap();
        let flags: RunConfig = toml::from_str("tracker = 'b'\n[parameters]\ny = 3").unwrap();
        let both = file.overridden_by(flags);
        assert_eq!((both.tracker.as_deref(), both.fps), (Some("b"), Some(25.0)));
        assert_eq!(both.parameters.to_string(), "x = 1\ny = 3\n");
        assert!(toml::from_str::<RunConfig>("traker = 'a'").is_err());
    }

    #[test]
    fn later_options_count_and_silent_ones_do_not() {
        let read = |text: &str| toml::from_str::<RunConfig>(text).unwrap();
        let some = |n: u32| {
            read(&format!(
                "input = 'clip {n}'\nboxes = [[{n}, 0, 1, 1]]\nformats = ['format {n}']\nsegment = '{n}h'\nkeep = '{n}d'\nstride = {n}\nfps = {n}.5\n\
                 depth_options.intrinsics = [{n}, 1, 1, 1]\npublish_options.qos = {n}\nevents.dwell_s = {n}\nmeasure_options.window = {n}\nparameters.n = {n}"
            ))
        };
        assert_eq!(some(1).overridden_by(RunConfig::default()), some(1));
        assert_eq!(RunConfig::default().overridden_by(some(2)), some(2));
        assert_eq!(some(1).overridden_by(some(2)), some(2));
        assert_eq!(read(&toml::to_string(&some(1)).unwrap()), some(1));
        assert_eq!(toml::to_string(&RunConfig::default()).unwrap(), "");
        let both = some(1).overridden_by(read("[parameters.motion]\nmodel = 'imm'"));
        assert_eq!(both.parameters.to_string(), "n = 1\n\n[motion]\nmodel = \"imm\"\n");
    }

    #[test]
    fn start_boxes_are_left_top_width_height() {
        let config = RunConfig { boxes: vec![[1.0, 2.0, 3.0, 4.0]], ..RunConfig::default() };
        assert_eq!(config.start_boxes(), [BBox::from_ltwh(1.0, 2.0, 3.0, 4.0)]);
    }

    fn methods(text: &str) -> Result<Methods, RunError> {
        toml::from_str::<RunConfig>(text).unwrap().methods()
    }

    #[test]
    fn methods_are_those_named_or_those_that_go_with_the_detector() {
        assert_eq!(methods("").unwrap().recipe.name(), registry::DEFAULT_TRACKER);
        let ball = methods("detect = 'ball'\n[parameters]\ncolor = 'green'\nacquire.trial_s = 2.0").unwrap();
        assert_eq!((ball.recipe.name(), ball.acquire.trial_s), ("ball", 2.0));
        assert_eq!(ball.recipe.parameters().unwrap()["color"].as_str(), Some("green"));
        assert!(ball.detector.is_some());
        let kcf = methods("tracker = 'kcf'\ndetect = 'ball'\nmany = true\nparameters.many.gate = 9.0").unwrap();
        assert_eq!((kcf.recipe.name(), kcf.many.association.gate), ("kcf", 9.0));
        assert!(methods("tracker = 'kcf'").unwrap().detector.is_none());
        for (text, words) in [
            ("tracker = 'nobody'", "there is no tracker called `nobody`"),
            ("detect = 'nobody'", "there is no detector called `nobody`"),
            ("many = true", "name a detector"),
            ("parameters.nonsense = 1", "no parameter `nonsense`"),
            ("detect = 'ball'\nparameters.detect.min_area = -1.0", "min_area"),
            ("detect = 'ball'\nparameters.acquire.trial_s = -1.0", "`trial_s` of `acquire`: must be at least 0"),
            (
                "detect = 'ball'\nmany = true\nparameters.many.association.gate = 0",
                "`association.gate` of `many`: must be above 0",
            ),
            ("parameters.motion.model = 'imn'", "motion.model"),
        ] {
            let error = methods(text).err().unwrap();
            assert_eq!(error.exit_code(), 2, "{error}");
            assert!(error.to_string().contains(words), "{error}");
        }
    }

    #[test]
    fn an_evaluation_takes_the_same_settings() {
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let table: toml::Table = "motion.model = 'imm'\nkcf.motion.model = 'none'".parse().unwrap();
        let made = recipes(&names(&["mosse", "kcf"]), &table).unwrap();
        let models: Vec<String> =
            made.iter().map(|r| r.parameters().unwrap()["motion"]["model"].as_str().unwrap().to_owned()).collect();
        assert_eq!((models, made[0].name()), (names(&["imm", "none"]), "mosse"));
        assert!(recipes(&names(&["nobody"]), &table).is_err());
        assert!(recipes(&names(&["mosse"]), &"detect.color = 'green'".parse().unwrap()).is_err());
    }

    #[test]
    fn a_configuration_that_cannot_be_read_is_named() {
        let missing = RunConfig::read(Path::new("/nowhere/run.toml")).unwrap_err();
        assert!(missing.to_string().starts_with("configuration /nowhere/run.toml: "), "{missing}");
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "tracker = 'kcf'\nfps = 12.5").unwrap();
        let read = RunConfig::read(file.path()).unwrap();
        assert_eq!((read.tracker.as_deref(), read.fps), (Some("kcf"), Some(12.5)));
        std::fs::write(file.path(), "speed = 3").unwrap();
        assert!(RunConfig::read(file.path()).unwrap_err().to_string().contains("unknown field `speed`"));
    }
}
