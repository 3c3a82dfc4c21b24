use super::COCO;
use crate::siamese::ChannelOrder;
use crate::{InferenceError, Result};
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::Path;

/// The most classes, and the most bytes that a description may have.
const MOST_CLASSES: usize = 10_000;
/// Letters of a class's name at most.
const LONGEST_NAME: usize = 64;
const MOST_BYTES: u64 = 1 << 20;

/// Where the frame lies in the network's image, which it fills in one direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placing {
    /// In the upper left corner.
    Corner,
    /// In the middle.
    Middle,
}

/// What the four numbers of a box are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoxCoding {
    /// Centre relative to a cell of a grid, in cells, and the logarithm of the size in cells; grids in order of
    /// [`strides`](DetectionConfig::strides), each row by row. YOLOX as exported.
    Grid,
    /// Centre and size in pixels of the network's image.
    Pixels,
}

/// Everything about a detector that its network does not say. The default is YOLOX as trained on COCO.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionConfig {
    /// Names of the classes in the network's order, at most 10 000, none twice.
    pub classes: Vec<String>,
    /// Width and height of its image in pixels, 1 to 4096, where the file leaves them open.
    pub image_px: Option<(usize, usize)>,
    /// Order of its channels.
    pub channels: ChannelOrder,
    /// What is subtracted from each channel (in the network's order), in grey levels.
    pub mean: [f32; 3],
    /// What each channel is divided by afterwards, > 0.
    pub deviation: [f32; 3],
    /// Where the frame lies in its image.
    pub place: Placing,
    /// Grey level of what the frame leaves of its image.
    pub fill: u8,
    /// What the numbers of a box are.
    pub boxes: BoxCoding,
    /// Sides of the grids' cells in pixels of its image, 1 to 1024.
    pub strides: Vec<usize>,
    /// Whether the box is followed by how likely it holds anything, by which the classes' scores are multiplied.
    pub objectness: bool,
    /// Whether scores are logits; else they are probabilities.
    pub logits: bool,
}

impl Default for DetectionConfig {
    fn default() -> Self {
        Self {
            classes: COCO.iter().map(|&name| name.to_owned()).collect(),
            image_px: None,
            channels: ChannelOrder::Bgr,
            mean: [0.0; 3],
            deviation: [1.0; 3],
            place: Placing::Corner,
            fill: 114,
            boxes: BoxCoding::Grid,
            strides: vec![8, 16, 32],
            objectness: true,
            logits: false,
        }
    }
}

impl DetectionConfig {
    /// The description of the network in `model`: the file of the same name that ends in `.toml`, or the default where there
    /// is none.
    ///
    /// # Errors
    /// [`InferenceError::Read`] if the description cannot be read, [`InferenceError::Description`] if it cannot be understood or
    /// a value is out of range.
    pub fn beside(model: &Path) -> Result<Self> {
        let path = model.with_extension("toml");
        let unread = |source| InferenceError::Read { path: path.clone(), source };
        let wrong = |why: String| InferenceError::Description { path: path.clone(), why };
        let mut text = String::new();
        match std::fs::File::open(&path) {
            Ok(file) => file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(unread)?,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(e) => return Err(unread(e)),
        };
        if text.len() as u64 > MOST_BYTES {
            return Err(wrong(format!("it has more than {MOST_BYTES} bytes")));
        }
        let config: Self = toml::from_str(&text).map_err(|e| wrong(crate::error::in_line(&text, &e)))?;
        config.check().map_err(wrong)?;
        Ok(config)
    }

    /// Numbers a box has: four, perhaps how likely it holds anything, and one a class.
    pub fn attributes(&self) -> usize {
        4 + usize::from(self.objectness) + self.classes.len()
    }

    /// Checks every value.
    ///
    /// # Errors
    /// What is out of range, and the range.
    pub fn check(&self) -> Result<(), String> {
        let side = |s: usize| (1..=4096).contains(&s);
        let mut names: Vec<&str> = self.classes.iter().map(String::as_str).collect();
        names.sort_unstable();
        let wrong = |what: &str| Err(what.to_owned());
        if !(1..=MOST_CLASSES).contains(&names.len()) {
            return Err(format!("`classes` must have 1 to {MOST_CLASSES} names, not {}", names.len()));
        }
        if let Some(twice) = names.windows(2).find(|w| w[0] == w[1]) {
            return Err(format!("`classes` has `{}` twice", twice[0]));
        }
        if names.iter().any(|n| n.trim().is_empty() || n.contains(',')) {
            return wrong("a name of `classes` is empty or has a comma in it");
        }
        // They are written into pictures, files and messages.
        if names.iter().any(|n| n.chars().count() > LONGEST_NAME || n.contains(char::is_control)) {
            return Err(format!("a name of `classes` is longer than {LONGEST_NAME} letters or has a line break in it"));
        }
        if self.image_px.is_some_and(|(width, height)| !side(width) || !side(height)) {
            return wrong("`image_px` must be two numbers from 1 to 4096");
        }
        if !self.mean.iter().all(|m| m.is_finite()) || !self.deviation.iter().all(|d| *d > 0.0 && d.is_finite()) {
            return wrong("`mean` must be finite and `deviation` positive");
        }
        if self.boxes == BoxCoding::Grid && !(1..=16).contains(&self.strides.len()) {
            return wrong("`strides` must have 1 to 16 numbers where `boxes` is \"grid\"");
        }
        if !self.strides.iter().all(|s| (1..=1024).contains(s)) {
            return wrong("`strides` must be from 1 to 1024");
        }
        Ok(())
    }
}
