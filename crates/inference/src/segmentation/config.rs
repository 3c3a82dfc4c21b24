use crate::detection::Placing;
use crate::siamese::ChannelOrder;
use crate::{InferenceError, Result};
use pursuit_parameters::{Parameters, choices, parameters};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The most bytes that a description may have.
const MOST_BYTES: u64 = 1 << 20;
/// What names the two files of a prompted network in a description.
const FILES: [&str; 2] = ["encoder", "decoder"];
/// What only networks of one picture have.
const PLAIN_ONLY: [&str; 3] = ["place", "values", "plane"];

choices! {
    /// What the numbers of a mask of one plane are.
    pub enum MaskValues {
        /// Found out: probabilities where all answers lie from 0 to 1, else logits.
        Auto = "auto",
        /// Logits: the target's where above 0.
        Logits = "logits",
        /// Probabilities: the target's where above one half.
        Probabilities = "probabilities",
    }
}

parameters! {
    /// Everything about a segmentation network that its file does not say.
    pub struct SegmentationConfig {
        /// Width and height of its picture, where the file leaves them open; of an image encoder both are the same.
        pub image_px: Option<[usize; 2]> = None, in 8..=4096, unit "px";
        /// Order of its channels.
        pub channels: ChannelOrder = ChannelOrder::Rgb;
        /// What is subtracted from each channel (in the network's order); beyond the frame and in the rest of the picture is this colour.
        pub mean: [f32; 3] = [123.675, 116.28, 103.53], in 0.0..=255.0, unit "grey levels", source "ImageNet, and Segment Anything: build_sam.py";
        /// What each channel is divided by afterwards.
        pub deviation: [f32; 3] = [58.395, 57.12, 57.375], in pursuit_parameters::above(0.0), unit "grey levels", source "as the mean";
        /// How much about the box is shown, at each side. Left out: a quarter for a network of one picture, the whole frame for a prompted one.
        pub context: Option<f64> = None, in 0.0..=10.0, unit "target sizes";
        /// Where the region lies in the picture of a network of one picture.
        pub place: Placing = Placing::Stretched;
        /// What the numbers of its mask are, where it has one plane.
        pub values: MaskValues = MaskValues::Auto;
        /// Which plane of its mask is the target's, from 0, where it has several: a pixel is the target's where this one is the greatest. Left
        /// out: the second of two.
        pub plane: Option<usize> = None, in 0..=9999;
    }
}

/// Where a segmentation network lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SegmentationFiles {
    /// One file: a picture of the target's region to a mask of it.
    Plain {
        /// It.
        network: PathBuf,
    },
    /// Two files: a picture to its embedding, and that with a box to a mask.
    Prompted {
        /// The image encoder.
        encoder: PathBuf,
        /// The mask decoder.
        decoder: PathBuf,
    },
}

impl SegmentationConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// What is out of range, and the range.
    pub fn check(&self) -> Result<(), String> {
        self.validate("config").map_err(|e| e.to_string())
    }
}

/// The files that `model` names, and what is said of them.
///
/// # Errors
/// [`InferenceError::Read`] and [`InferenceError::Description`]; [`InferenceError::Model`] for a folder in which it is not clear which
/// files are meant.
pub(super) fn described(model: &Path) -> Result<(SegmentationFiles, SegmentationConfig)> {
    if model.is_dir() {
        return Ok((in_folder(model)?, SegmentationConfig::default()));
    }
    let is_description = model.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let path = if is_description { model.to_owned() } else { model.with_extension("toml") };
    let wrong = |why: String| InferenceError::Description { path: path.clone(), why };
    let text = match read(&path)? {
        Some(text) => text,
        // Whether the network itself is there its opening says.
        None if !is_description => String::new(),
        None => return Err(InferenceError::Read { path, source: std::io::ErrorKind::NotFound.into() }),
    };
    let mut table: toml::Table = toml::from_str(&text).map_err(|e| wrong(crate::error::in_line(&text, &e)))?;
    let files: Vec<toml::Value> = FILES.iter().filter_map(|key| table.remove(*key)).collect();
    let folder = path.parent().unwrap_or(Path::new(""));
    let files = match files.as_slice() {
        [] if is_description => {
            return Err(wrong(
                "it names no `encoder` and `decoder`; name the ONNX file of a network of one picture instead".into(),
            ));
        }
        [] => SegmentationFiles::Plain { network: model.to_owned() },
        [toml::Value::String(encoder), toml::Value::String(decoder)] => {
            if !is_description {
                return Err(wrong("it names an encoder and a decoder; name this description as the network".into()));
            }
            SegmentationFiles::Prompted { encoder: folder.join(encoder), decoder: folder.join(decoder) }
        }
        _ => return Err(wrong("`encoder` and `decoder` are two names of ONNX files".into())),
    };
    let only = PLAIN_ONLY.iter().find(|key| table.contains_key(**key));
    if let (SegmentationFiles::Prompted { .. }, Some(key)) = (&files, only) {
        return Err(wrong(format!("`{key}` is of networks of one picture; an encoder with a decoder has none")));
    }
    let config = SegmentationConfig::default().with("config", &table).map_err(|e| wrong(e.to_string()))?;
    config.check().map_err(wrong)?;
    Ok((files, config))
}

/// The text of a description; `None` where it is not there.
fn read(path: &Path) -> Result<Option<String>> {
    let unread = |source| InferenceError::Read { path: path.to_owned(), source };
    let file = match std::fs::File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(unread(e)),
    };
    let mut bytes = Vec::new();
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unread)?;
    match String::from_utf8(bytes).ok().filter(|text| text.len() as u64 <= MOST_BYTES) {
        Some(text) => Ok(Some(text)),
        None => Err(InferenceError::Description { path: path.to_owned(), why: "it is no text, or too long".into() }),
    }
}

/// The one encoder and the one decoder in a folder.
fn in_folder(folder: &Path) -> Result<SegmentationFiles> {
    let entries =
        std::fs::read_dir(folder).map_err(|source| InferenceError::Read { path: folder.to_owned(), source })?;
    let mut found: [Vec<PathBuf>; 2] = Default::default();
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
        if name.ends_with(".onnx") {
            let of = FILES.iter().position(|part| name.contains(part));
            of.into_iter().for_each(|k| found[k].push(path.clone()));
        }
    }
    match found.each_ref().map(Vec::as_slice) {
        [[encoder], [decoder]] => {
            Ok(SegmentationFiles::Prompted { encoder: encoder.clone(), decoder: decoder.clone() })
        }
        [encoders, decoders] => Err(InferenceError::Model {
            what: folder.display().to_string(),
            why: format!(
                "it has {} ONNX files with `encoder` in their names and {} with `decoder`, where one each is wanted",
                encoders.len(),
                decoders.len()
            ),
            mend: "name a TOML file that says which: `encoder = \"….onnx\"` and `decoder = \"….onnx\"`".into(),
        }),
    }
}
