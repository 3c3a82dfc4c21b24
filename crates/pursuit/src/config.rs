//! What to run, as a value: read from a TOML file, from a command line, or both.

use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_trackers::registry;
use pursuit_tracking::parameters::Parameter;
use pursuit_tracking::{Detector, Recipe};
use serde::{Deserialize, Serialize};
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
    /// What to track in: a file, a folder, a camera, a stream, `-`, or `scene:NAME`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
    /// Depth images that belong to the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<String>,
    /// Boxes to start from, `[left, top, width, height]` in pixels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<[f64; 4]>,
    /// Name of the tracker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracker: Option<String>,
    /// Name of the detector that finds the target when no box is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detect: Option<String>,
    /// Folder for the results.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
    /// Whether to write the overlay video.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub video: Option<bool>,
    /// Whether to draw plots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plots: Option<bool>,
    /// Further trajectory files: `csv`, `jsonl`, `mot`, `parquet`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub formats: Vec<String>,
    /// First frame to look at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<u64>,
    /// Last frame to look at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<u64>,
    /// Frames per second to assume instead of the input's own times.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Seed of everything random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Parameters of the tracker and the detector.
    #[serde(skip_serializing_if = "toml::Table::is_empty")]
    pub parameters: toml::Table,
}

impl RunConfig {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// [`RunError::Usage`] when it cannot be read, or holds something that has no meaning.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let wrong = |problem: String| RunError::usage(format!("configuration {}: {problem}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
        toml::from_str(&text).map_err(|e| wrong(e.to_string().trim_end().to_owned()))
    }

    /// This configuration with what `over` says in its place; parameters are merged name by name.
    #[must_use]
    pub fn overridden_by(self, over: Self) -> Self {
        let mut parameters = self.parameters;
        parameters.extend(over.parameters);
        let list = |a: Vec<String>, b: Vec<String>| if b.is_empty() { a } else { b };
        Self {
            input: over.input.or(self.input),
            depth: over.depth.or(self.depth),
            boxes: if over.boxes.is_empty() { self.boxes } else { over.boxes },
            tracker: over.tracker.or(self.tracker),
            detect: over.detect.or(self.detect),
            out: over.out.or(self.out),
            video: over.video.or(self.video),
            plots: over.plots.or(self.plots),
            formats: list(self.formats, over.formats),
            from: over.from.or(self.from),
            to: over.to.or(self.to),
            fps: over.fps.or(self.fps),
            seed: over.seed.or(self.seed),
            parameters,
        }
    }

    /// The boxes to start from.
    pub fn start_boxes(&self) -> Vec<BBox> {
        self.boxes.iter().map(|&[l, t, w, h]| BBox::from_ltwh(l, t, w, h)).collect()
    }

    /// The tracker and, where one is named, the detector, with their parameters.
    ///
    /// A parameter goes to whichever of the two knows it, to both if both do.
    ///
    /// # Errors
    /// Unknown names, parameters that neither knows, bad values.
    pub fn methods(&self) -> Result<Methods, RunError> {
        let detector = self.detect.as_deref().map(registry::detector).transpose()?;
        let tracker = match (&self.tracker, detector) {
            (Some(name), _) => registry::tracker(name)?,
            (None, Some(detector)) => registry::tracker(detector.default_tracker)?,
            (None, None) => registry::tracker(registry::DEFAULT_TRACKER)?,
        };
        let for_tracker = tracker.default_recipe().schema();
        let for_detector = detector.map(|d| d.schema()).unwrap_or_default();
        let knows = |schema: &[Parameter], key: &str| {
            let first = key.split('.').next().unwrap_or(key);
            schema.iter().any(|p| p.name == first)
        };
        if let Some(key) = self.parameters.keys().find(|k| !knows(&for_tracker, k) && !knows(&for_detector, k)) {
            let names = |schema: &[Parameter]| schema.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
            let mut message =
                format!("tracker `{}` has no parameter `{key}`; it has: {}", tracker.name, names(&for_tracker));
            if let Some(d) = detector {
                message += &format!("; detector `{}` has: {}", d.name, names(&for_detector));
            }
            return Err(RunError::usage(message));
        }
        let select = |schema: &[Parameter]| -> toml::Table {
            self.parameters.iter().filter(|(k, _)| knows(schema, k)).map(|(k, v)| (k.clone(), v.clone())).collect()
        };
        Ok(Methods {
            recipe: tracker.recipe(&select(&for_tracker))?,
            detector: detector.map(|d| d.detector(&select(&for_detector))).transpose()?,
        })
    }
}

/// The tracker to use, and the detector that starts it where one was asked for.
pub struct Methods {
    /// Makes trackers.
    pub recipe: Box<dyn Recipe>,
    /// Finds the target.
    pub detector: Option<Box<dyn Detector>>,
}

/// Reads `KEY=VALUE`; the value is read as TOML (`3`, `0.5`, `true`, `[1, 2]`, `"word"`) and, failing that, as a word.
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
    Ok((key.to_owned(), as_toml.unwrap_or_else(|| toml::Value::String(value.to_owned()))))
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

    #[test]
    fn settings_are_toml_or_words() {
        assert_eq!(parse_setting("a=3").unwrap(), ("a".into(), toml::Value::Integer(3)));
        assert_eq!(parse_setting("a = 0.5").unwrap(), ("a".into(), toml::Value::Float(0.5)));
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
}
