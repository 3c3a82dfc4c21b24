use super::COCO;
use crate::siamese::ChannelOrder;
use crate::{InferenceError, Result};
use pursuit_parameters::{Parameters, choices, parameters};
use std::io::Read;
use std::path::Path;

/// The most classes, and the most bytes that a description may have.
pub(super) const MOST_CLASSES: usize = 10_000;
/// Letters of a class's name at most.
const LONGEST_NAME: usize = 64;
const MOST_BYTES: u64 = 1 << 20;

choices! {
    /// Where the frame lies in the network's image, which it fills in one direction.
    pub enum Placing {
        /// In the upper left corner.
        Corner = "corner",
        /// In the middle.
        Middle = "middle",
        /// All over it: the frame is stretched.
        Stretched = "stretched",
    }
}

choices! {
    /// What the four numbers of a box are.
    pub enum BoxCoding {
        /// Centre relative to a cell of a grid, in cells, and the logarithm of the size in cells; grids in order of
        /// [`strides`](DetectionConfig::strides), each row by row. YOLOX as exported.
        Grid = "grid",
        /// Centre and size in pixels of the network's image.
        Pixels = "pixels",
        /// Centre and size as fractions of the network's image.
        Fractions = "fractions",
        /// Left, top, right and bottom edge in pixels of the network's image.
        Corners = "corners",
    }
}

choices! {
    /// What follows the four numbers of a box.
    pub enum ScoreCoding {
        /// A score for each class.
        Classes = "classes",
        /// The score of the best class, and its number.
        Best = "best",
    }
}

choices! {
    /// By what a network was exported: the values of everything else follow from it.
    pub enum Family {
        /// YOLOX by its authors.
        Yolox = "yolox",
        /// YOLOv5, and those that answer like it: YOLOv6, YOLOv7.
        Yolov5 = "yolov5",
        /// YOLOv8, and those that answer like it: YOLOv9, YOLO11, YOLO12.
        Yolov8 = "yolov8",
        /// RT-DETR, boxes and scores in one output.
        RtDetr = "rt-detr",
        /// Boxes that the network has chosen among itself: YOLOv10, YOLO26, exports with their own suppression.
        EndToEnd = "end-to-end",
    }
}

parameters! {
    /// Everything about a detector that its network does not say. The default is YOLOX as trained on COCO.
    pub struct DetectionConfig {
        /// By what it was exported: what a description leaves out is as there.
        pub family: Family = Family::Yolox;
        /// Names of the classes in the network's order, at most 10 000, none twice.
        pub classes: Vec<String> = COCO.iter().map(|&name| name.to_owned()).collect();
        /// Width and height of its image, where the file leaves them open.
        pub image_px: Option<[usize; 2]> = None, in 1..=4096, unit "px";
        /// Order of its channels.
        pub channels: ChannelOrder = ChannelOrder::Bgr;
        /// What is subtracted from each channel (in the network's order).
        pub mean: [f32; 3] = [0.0; 3], unit "grey levels";
        /// What each channel is divided by afterwards.
        pub deviation: [f32; 3] = [1.0; 3], in above(0.0);
        /// Where the frame lies in its image.
        pub place: Placing = Placing::Corner;
        /// Grey level of what the frame leaves of its image.
        pub fill: u8 = 114;
        /// What the numbers of a box are.
        pub boxes: BoxCoding = BoxCoding::Grid;
        /// Sides of the grids' cells in pixels of its image.
        pub strides: Vec<usize> = vec![8, 16, 32], in 1..=1024, unit "px";
        /// Whether the box is followed by how likely it holds anything, by which the classes' scores are multiplied.
        pub objectness: bool = true;
        /// Whether scores are logits; else they are probabilities.
        pub logits: bool = false;
        /// What follows the box, and how likely it holds anything.
        pub scores: ScoreCoding = ScoreCoding::Classes;
        /// Whether the network gives nothing two boxes: none is left out because it overlaps a better one.
        pub unique: bool = false;
    }
}

/// What is known of a network before its answers are looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// What the description says, everything else as of the family that it names, or of YOLOX.
    pub config: DetectionConfig,
    /// Whether it names the classes.
    pub names_classes: bool,
    /// Whether it says how the network answers, or by what it was exported; else that is found out from the answers.
    pub says_how: bool,
}

impl DetectionConfig {
    /// As exported by a family.
    pub fn of(family: Family) -> Self {
        let ultralytics = Self {
            channels: ChannelOrder::Rgb,
            deviation: [255.0; 3],
            place: Placing::Middle,
            boxes: BoxCoding::Pixels,
            objectness: false,
            ..Self::default()
        };
        let config = match family {
            Family::Yolox => Self::default(),
            Family::Yolov5 => Self { objectness: true, ..ultralytics },
            Family::Yolov8 => ultralytics,
            Family::RtDetr => {
                Self { place: Placing::Stretched, boxes: BoxCoding::Fractions, unique: true, ..ultralytics }
            }
            Family::EndToEnd => {
                Self { boxes: BoxCoding::Corners, scores: ScoreCoding::Best, unique: true, ..ultralytics }
            }
        };
        Self { family, ..config }
    }

    /// The description of the network in `model`: the file of the same name that ends in `.toml`, or the default where there
    /// is none.
    ///
    /// # Errors
    /// [`InferenceError::Read`] if the description cannot be read, [`InferenceError::Description`] if it cannot be understood or
    /// a value is out of range.
    pub fn beside(model: &Path) -> Result<Description> {
        let path = model.with_extension("toml");
        let unread = |source| InferenceError::Read { path: path.clone(), source };
        let wrong = |why: String| InferenceError::Description { path: path.clone(), why };
        let mut text = String::new();
        match std::fs::File::open(&path) {
            Ok(file) => file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(unread)?,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => 0,
            Err(e) => return Err(unread(e)),
        };
        if text.len() as u64 > MOST_BYTES {
            return Err(wrong(format!("it has more than {MOST_BYTES} bytes")));
        }
        let unknown = |e| wrong(crate::error::in_line(&text, &e));
        let alone: Self = toml::from_str(&text).map_err(unknown)?;
        let written: toml::Table = toml::from_str(&text).map_err(unknown)?;
        let config = Self::of(alone.family).with("config", &written).map_err(|e| wrong(e.to_string()))?;
        config.check().map_err(wrong)?;
        // Which names classes have and how large the image is are facts of one network: they say nothing of its kind.
        let says_how = written.keys().any(|key| key != "classes" && key != "image_px");
        Ok(Description { config, names_classes: written.contains_key("classes"), says_how })
    }

    /// Numbers a box has: four, perhaps how likely it holds anything, and one a class, or two for the best.
    pub fn attributes(&self) -> usize {
        let scores = match self.scores {
            ScoreCoding::Classes => self.classes.len(),
            ScoreCoding::Best => 2,
        };
        4 + usize::from(self.objectness) + scores
    }

    /// Checks every value.
    ///
    /// # Errors
    /// What is out of range, and the range.
    pub fn check(&self) -> Result<(), String> {
        self.validate("config").map_err(|e| e.to_string())?;
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
        if self.boxes == BoxCoding::Grid && !(1..=16).contains(&self.strides.len()) {
            return wrong("`strides` must have 1 to 16 numbers where `boxes` is \"grid\"");
        }
        Ok(())
    }
}
