//! What to run, as a value: read from a TOML file, from a command line, or both.

mod catalogue;
mod settings;

pub use catalogue::catalogue;
pub use settings::{ACQUIRE_PREFIX, DETECTOR_PREFIX, MANY_PREFIX, Participants, Settings};

use crate::publish::PublishOptions;
use crate::sinks::OverlayStyle;
use crate::{Resize, RunError};
use pursuit_geometry::BBox;
use pursuit_media::Locator;
use pursuit_media::depth::DepthOptions;
use pursuit_trackers::registry;
use pursuit_tracking::many::{AcquisitionParams, AssociationParams};
use pursuit_tracking::parameters::{Parameters, merge, nested};
use pursuit_tracking::{Detector, Recipe};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

/// Everything about a run that can stand in a configuration file. What is absent has its default.
///
/// ```toml
/// input = "clip.mp4"
/// detect = "ball"
/// out = "results"
/// [parameters]
/// color = "orange"
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunConfig {
    /// What to track in: a file, a folder, a camera, a stream, `-`, or `scene:NAME`. Credentials in it are read, and neither
    /// shown nor stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<Locator>,
    /// Depth images that belong to the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<String>,
    /// How depth images are to be read.
    #[serde(skip_serializing_if = "is_default")]
    pub depth_options: DepthOptions,
    /// Boxes to start from, `[left, top, width, height]` in pixels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<[f64; 4]>,
    /// Name of the tracker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracker: Option<String>,
    /// Name of the detector that finds the target when no box is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detect: Option<String>,
    /// Whether everything that the detector finds is followed, not one target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub many: Option<bool>,
    /// Folder for the results.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
    /// Whether a run without a folder named replaces the last of its name, in place of making a new folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overwrite: Option<bool>,
    /// Whether to go on with the run in the folder, which was interrupted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resume: Option<bool>,
    /// Whether to write the overlay video.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub video: Option<bool>,
    /// How much the overlay video shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlay: Option<OverlayStyle>,
    /// Whether to draw plots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plots: Option<bool>,
    /// Further trajectory files: `csv`, `jsonl`, `mot`, `parquet`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub formats: Vec<String>,
    /// A broker that results are published to, `mqtt://[USER@]HOST[:PORT][/PREFIX]` or `nats://…`. A password in it is
    /// neither shown nor stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub publish: Option<Locator>,
    /// How they are published.
    #[serde(skip_serializing_if = "is_default")]
    pub publish_options: PublishOptions,
    /// First frame to look at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<u64>,
    /// Last frame to look at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<u64>,
    /// Of how many frames one is looked at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stride: Option<NonZeroU64>,
    /// The part of the picture to look at, `[left, top, width, height]` in pixels of the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<[f64; 4]>,
    /// To what size pictures are brought before they are looked at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resize: Option<Resize>,
    /// Frames per second to assume instead of the input's own times.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Parameters of the tracker and the detector; see [`Settings::split`].
    #[serde(skip_serializing_if = "toml::Table::is_empty")]
    pub parameters: toml::Table,
    /// The file that it was read from.
    #[serde(skip)]
    pub read_from: Option<PathBuf>,
}

fn is_default<T: Default + PartialEq>(options: &T) -> bool {
    *options == T::default()
}

/// The options with those of `over` in their place that it says.
fn merged(own: DepthOptions, over: DepthOptions) -> DepthOptions {
    DepthOptions {
        coding: over.coding.or(own.coding),
        intrinsics: over.intrinsics.or(own.intrinsics),
        depth_intrinsics: over.depth_intrinsics.or(own.depth_intrinsics),
        offset_mm: over.offset_mm.or(own.offset_mm),
        registered: over.registered.or(own.registered),
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

    /// This configuration with what `over` says in its place; parameters are merged name by name.
    #[must_use]
    pub fn overridden_by(self, over: Self) -> Self {
        let mut parameters = nested(&self.parameters);
        merge(&mut parameters, nested(&over.parameters));
        let list = |a: Vec<String>, b: Vec<String>| if b.is_empty() { a } else { b };
        Self {
            input: over.input.or(self.input),
            depth: over.depth.or(self.depth),
            depth_options: merged(self.depth_options, over.depth_options),
            boxes: if over.boxes.is_empty() { self.boxes } else { over.boxes },
            tracker: over.tracker.or(self.tracker),
            detect: over.detect.or(self.detect),
            many: over.many.or(self.many),
            out: over.out.or(self.out),
            overwrite: over.overwrite.or(self.overwrite),
            resume: over.resume.or(self.resume),
            read_from: over.read_from.or(self.read_from),
            video: over.video.or(self.video),
            overlay: over.overlay.or(self.overlay),
            plots: over.plots.or(self.plots),
            formats: list(self.formats, over.formats),
            publish: over.publish.or(self.publish),
            publish_options: self.publish_options.overridden_by(over.publish_options),
            from: over.from.or(self.from),
            to: over.to.or(self.to),
            stride: over.stride.or(self.stride),
            region: over.region.or(self.region),
            resize: over.resize.or(self.resize),
            fps: over.fps.or(self.fps),
            parameters,
        }
    }

    /// The files that a run reads, whether they are there or not: the input, its truth, depth, the configuration.
    pub(crate) fn files(&self) -> impl Iterator<Item = PathBuf> {
        let input = self.input.iter().map(|input| input.path().to_path_buf());
        let media = input.chain(self.depth.iter().map(PathBuf::from));
        media.flat_map(|path| [path.with_extension("csv"), path]).chain(self.read_from.clone())
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
        let many = self.many == Some(true);
        if many && detector.is_none() {
            return Err(RunError::usage("nothing says what to follow; name a detector, for example `--detect ball`"));
        }
        let tracker = match (&self.tracker, detector) {
            (Some(name), _) => registry::tracker(name)?,
            (None, Some(detector)) => registry::tracker(detector.default_tracker)?,
            (None, None) => registry::tracker(registry::DEFAULT_TRACKER)?,
        };
        let settings = Settings::split(&self.parameters, &Participants { trackers: &[tracker], detector, many })?;
        let for_tracker = settings.trackers.first().cloned().unwrap_or_default();
        let many = AssociationParams::default();
        let many = match detector {
            Some(detector) => AssociationParams { motion: detector.motion(), ..many },
            None => many,
        };
        let detector_parameters = detector.map(|d| d.parameters(&settings.detector)).transpose()?;
        let detector = detector.map(|d| d.detector(&settings.detector)).transpose()?;
        Ok(Methods {
            recipe: tracker.recipe(&for_tracker)?,
            detector,
            detector_parameters,
            acquire: AcquisitionParams::default().with(ACQUIRE_PREFIX, &settings.acquire)?,
            many: many.with(MANY_PREFIX, &settings.many)?,
        })
    }
}

/// What follows the targets, and what finds them where a detector was asked for.
pub struct Methods {
    /// Makes trackers.
    pub recipe: Box<dyn Recipe>,
    /// Finds the target, or the targets.
    pub detector: Option<Box<dyn Detector>>,
    /// Every parameter of the detector with its value.
    pub detector_parameters: Option<toml::Table>,
    /// How one target found is made sure of.
    pub acquire: AcquisitionParams,
    /// How many targets are told apart.
    pub many: AssociationParams,
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

/// Reads `KEY=VALUE`; the value is read as TOML (`3`, `0.5`, `true`, `[1, 2]`, `"word"`) and, failing that, as a number
/// (`.5`, which TOML does not know) or a word.
///
/// # Errors
/// [`RunError::Usage`] without `=` or without a key.
pub fn parse_setting(text: &str) -> Result<(String, toml::Value), RunError> {
    let Some((key, value)) = text.split_once('=').map(|(k, v)| (k.trim(), v.trim())).filter(|(k, _)| !k.is_empty())
    else {
        return Err(RunError::usage(format!("`{text}` is not KEY=VALUE, for example color=orange")));
    };
    let as_toml = format!("v = {value}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut t| if t.len() == 1 { t.remove("v") } else { None });
    let as_number = || value.parse().ok().filter(|v: &f64| v.is_finite()).map(toml::Value::Float);
    let value = as_toml.or_else(as_number).unwrap_or_else(|| toml::Value::String(value.to_owned()));
    Ok((key.to_owned(), value))
}

/// Reads `left,top,width,height` in pixels.
///
/// # Errors
/// [`RunError::Usage`] unless there are four numbers.
pub fn parse_box(text: &str) -> Result<[f64; 4], RunError> {
    let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    match <[f64; 4]>::try_from(numbers) {
        Ok(ltwh) if text.split(',').count() == 4 => Ok(ltwh),
        _ => Err(RunError::usage(format!(
            "box `{text}` is not LEFT,TOP,WIDTH,HEIGHT in pixels, for example 120,80,40,40"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::{Discovery, Every};
    use pursuit_media::depth::DepthCoding;

    #[test]
    fn settings_are_toml_or_words() {
        assert_eq!(parse_setting("a=3").unwrap(), ("a".into(), toml::Value::Integer(3)));
        assert_eq!(parse_setting("a = 0.5").unwrap(), ("a".into(), toml::Value::Float(0.5)));
        assert_eq!(parse_setting("a=-.5").unwrap(), ("a".into(), toml::Value::Float(-0.5)));
        assert_eq!(parse_setting("color=orange").unwrap(), ("color".into(), "orange".into()));
        assert_eq!(parse_setting("x=a\nb=1").unwrap().1, toml::Value::String("a\nb=1".into()));
        assert!(parse_setting("color").is_err() && parse_setting("=3").is_err());
    }

    #[test]
    fn boxes_are_four_numbers() {
        assert_eq!(parse_box("1, 2.5,3,4").unwrap(), [1.0, 2.5, 3.0, 4.0]);
        for bad in ["", "1,2,3", "1,2,3,4,5", "1,2,x,4", "1,,3,4"] {
            assert!(parse_box(bad).is_err(), "{bad}");
        }
    }

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
    fn every_field_of_a_file_can_be_overridden_and_is_kept_otherwise() {
        let some = |n: u64| RunConfig {
            input: Some(format!("input {n}").into()),
            depth: Some(format!("depth {n}")),
            depth_options: DepthOptions {
                coding: Some(DepthCoding::ALL[n as usize]),
                intrinsics: Some([n as f64; 4]),
                depth_intrinsics: Some([n as f64 + 0.5; 4]),
                offset_mm: Some([n as f64; 3]),
                registered: Some(n == 1),
            },
            boxes: vec![[n as f64, 0.0, 1.0, 1.0]],
            tracker: Some(format!("tracker {n}")),
            detect: Some(format!("detect {n}")),
            many: Some(n == 1),
            out: Some(format!("out {n}").into()),
            overwrite: Some(n == 1),
            resume: Some(n == 1),
            video: Some(n == 1),
            overlay: Some(if n == 1 { OverlayStyle::Full } else { OverlayStyle::Minimal }),
            plots: Some(n == 1),
            formats: vec![format!("format {n}")],
            publish: Some(format!("mqtt://host{n}").into()),
            publish_options: PublishOptions {
                every: Some(if n == 1 { Every::State } else { Every::Seconds(2.0) }),
                qos: Some(n as u8),
                buffer: Some(n as usize),
                ca_file: Some(format!("ca {n}").into()),
                discovery: Some(Discovery::HomeAssistant),
            },
            from: Some(n),
            to: Some(n),
            stride: NonZeroU64::new(n),
            region: Some([n as f64; 4]),
            resize: Some(crate::Resize::By(n as f64)),
            fps: Some(n as f64),
            parameters: toml::Table::from_iter([("n".to_owned(), toml::Value::Integer(n as i64))]),
            read_from: None,
        };
        assert_eq!(some(1).overridden_by(RunConfig::default()), some(1));
        assert_eq!(RunConfig::default().overridden_by(some(2)), some(2));
        assert_eq!(some(1).overridden_by(some(2)), some(2));
        let text = toml::to_string(&some(1)).unwrap();
        assert_eq!(toml::from_str::<RunConfig>(&text).unwrap(), some(1));
        let both = some(1).overridden_by(toml::from_str("[parameters.motion]\nmodel = 'imm'").unwrap());
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
        assert_eq!((kcf.recipe.name(), kcf.many.gate), ("kcf", 9.0));
        assert!(methods("tracker = 'kcf'").unwrap().detector.is_none());
        for (text, words) in [
            ("tracker = 'nobody'", "there is no tracker called `nobody`"),
            ("detect = 'nobody'", "there is no detector called `nobody`"),
            ("many = true", "name a detector"),
            ("parameters.nonsense = 1", "no parameter `nonsense`"),
            ("detect = 'ball'\nparameters.detect.min_area = -1.0", "min_area"),
            ("detect = 'ball'\nparameters.acquire.trial_s = -1.0", "`trial_s` of `acquire`: must be at least 0"),
            ("detect = 'ball'\nmany = true\nparameters.many.gate = 0", "`gate` of `many`: must be above 0"),
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
