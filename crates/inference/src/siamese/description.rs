use super::{SiameseConfig, SiameseParams};
use crate::onnx::{self, OnnxOptions, OnnxSiamese};
use crate::{InferenceError, Result};
use pursuit_parameters::{Table, Value};
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The most bytes a description may have.
const MOST_BYTES: u64 = 1 << 20;

/// A Siamese tracker of the user's: which files its network is in, and everything that these do not say. Paths are relative to
/// the description's folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiameseDescription {
    /// Template image to features; absent where the search takes both images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub template: Option<PathBuf>,
    /// Search image, and with no head the template's features or image, to features or answer.
    pub search: PathBuf,
    /// Template's and search image's features to the answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub head: Option<PathBuf>,
    /// What draws the mask of outputs of the others that are called like its inputs, cut about the point; absent where an output has a plane for
    /// each place of the mask, or there are no masks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refine: Option<PathBuf>,
    /// Sizes, normalisation, decoding and penalties.
    pub config: SiameseConfig,
}

impl SiameseDescription {
    /// Reads a TOML file.
    ///
    /// # Errors
    /// [`InferenceError::Read`] if it cannot be read, [`InferenceError::Description`] if it cannot be understood or a value is
    /// out of range.
    pub fn read(path: &Path) -> Result<Self> {
        let unread = |source| InferenceError::Read { path: path.to_owned(), source };
        let wrong = |why: String| InferenceError::Description { path: path.to_owned(), why };
        let mut bytes = Vec::new();
        std::fs::File::open(path).and_then(|f| f.take(MOST_BYTES + 1).read_to_end(&mut bytes)).map_err(unread)?;
        let text = String::from_utf8(bytes).ok().filter(|text| text.len() as u64 <= MOST_BYTES);
        let text =
            text.ok_or_else(|| wrong("it is no text, or too long; name the TOML file, not the network".into()))?;
        let said = text.parse::<Table>().unwrap_or_default();
        let config = said.get("config").and_then(Value::as_table);
        let missing = |key: &&&str| config.is_some_and(|config| !config.contains_key(**key));
        if let Some(key) = SiameseParams::REQUIRED.iter().find(missing) {
            return Err(wrong(format!("`config` lacks `{key}`")));
        }
        let read: Self = toml::from_str(&text).map_err(|e| wrong(crate::error::in_line(&text, &e)))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let beside = |file: PathBuf| folder.join(file);
        Ok(Self {
            template: read.template.map(beside),
            search: beside(read.search),
            head: read.head.map(beside),
            refine: read.refine.map(beside),
            ..read
        })
    }

    /// Opens its networks. One of another size than the files name is run on the sizes of the configuration.
    ///
    /// # Errors
    /// As [`onnx::open`], [`OnnxSiamese::new`] and [`OnnxSiamese::with_masks`].
    pub fn open(&self, options: &OnnxOptions) -> Result<OnnxSiamese> {
        let on = |file: &Path, image: Option<usize>| {
            onnx::open(file, &OnnxOptions { image: image.map(|side| (side, side)), ..options.clone() })
        };
        let template = self.template.as_deref().map(|t| on(t, Some(self.config.template_side_px))).transpose()?;
        // Where both images go into one network, the file knows which is which.
        let search = on(&self.search, template.as_ref().map(|_| self.config.search_side_px))?;
        let head = self.head.as_deref().map(|h| on(h, None)).transpose()?;
        let refine = self.refine.as_deref().map(|r| on(r, None)).transpose()?;
        OnnxSiamese::new(template, search, head, &self.config.answer)?.with_masks(refine, &self.config)
    }
}
