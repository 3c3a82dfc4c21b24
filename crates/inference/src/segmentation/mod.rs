//! Networks by file that say which pixels of a picture are a target's: one that is shown the target's region and draws a mask of it
//! (U-Nets, segmenters of portraits), and the pair of image encoder and mask decoder that is asked by a box ("Segment Anything": Kirillov
//! et al. 2023, arXiv:2304.02643; MobileSAM, arXiv:2306.14289; EdgeSAM, arXiv:2312.06660).

mod config;
mod grid;
mod picture;
mod plain;
mod prompted;

pub use config::{MaskValues, SegmentationConfig, SegmentationFiles};

use crate::onnx::OnnxOptions;
use crate::{InferenceError, Network, Result};
use grid::Grid;
use plain::Plain;
use prompted::Prompted;
use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use std::ops::Range;
use std::path::Path;

/// A network that says which pixels are a target's, ready to be asked.
#[derive(Debug)]
pub struct SegmentationNetwork {
    config: SegmentationConfig,
    kind: Kind,
    /// Columns of the grid between which a row of pixels lies.
    taps: Vec<grid::Tap>,
}

#[derive(Debug)]
enum Kind {
    Plain(Box<Plain>),
    Prompted(Box<Prompted>),
}

impl SegmentationNetwork {
    /// The network that `model` names: its ONNX file, with what the file cannot say in a TOML file of the same name beside it; or a folder
    /// with an image encoder and a mask decoder (`…encoder….onnx`, `…decoder….onnx`); or a TOML file that names these.
    ///
    /// # Errors
    /// [`InferenceError::Read`] if a file cannot be read, [`InferenceError::Description`] if a description cannot be understood,
    /// [`InferenceError::NoBackend`] if no library is there, [`InferenceError::Model`] if the network cannot be used.
    pub fn open(model: &Path, options: &OnnxOptions) -> Result<Self> {
        match config::described(model)? {
            (SegmentationFiles::Plain { network }, config) => {
                Self::with(Kind::Plain(Box::new(Plain::open(&network, &config, options)?)), config)
            }
            (SegmentationFiles::Prompted { encoder, decoder }, config) => {
                let prompted = Prompted::open((&encoder, &decoder), &config, options)?;
                Self::with(Kind::Prompted(Box::new(prompted)), config)
            }
        }
    }

    /// From a network of one picture, `1 × 3 × height × width`, `1 × height × width × 3` or `height × width × 3`, whose first output is a mask
    /// of the same or another size: `1 × planes × rows × columns` or `1 × rows × columns × planes`, without the ones where there are none.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if the network has other inputs and outputs, or the configuration is out of range.
    pub fn plain(network: Box<dyn Network>, config: SegmentationConfig) -> Result<Self> {
        Self::with(Kind::Plain(Box::new(Plain::new(network, &config)?)), config)
    }

    /// From an image encoder, whose picture is square, and the mask decoder that belongs to it, whose inputs have the names of Segment
    /// Anything: `image_embeddings`, `point_coords` (1 × 2 × 2), `point_labels` (1 × 2), and perhaps `mask_input`, `has_mask_input` and
    /// `orig_im_size`.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if they have other inputs and outputs, do not fit together, or the configuration is out of range.
    pub fn prompted(encoder: Box<dyn Network>, decoder: Box<dyn Network>, config: SegmentationConfig) -> Result<Self> {
        Self::with(Kind::Prompted(Box::new(Prompted::new(encoder, decoder, &config)?)), config)
    }

    fn with(kind: Kind, config: SegmentationConfig) -> Result<Self> {
        let this = Self { config, kind, taps: Vec::new() };
        match this.config.check() {
            Ok(()) => Ok(this),
            Err(why) => Err(InferenceError::Model {
                what: this.name().to_owned(),
                why,
                mend: "put that right in its description".into(),
            }),
        }
    }

    fn name(&self) -> &str {
        match &self.kind {
            Kind::Plain(plain) => plain.name(),
            Kind::Prompted(prompted) => prompted.name(),
        }
    }

    /// What it was taken for, in a line.
    pub fn taken_for(&self) -> String {
        match &self.kind {
            Kind::Plain(plain) => plain.taken_for(),
            Kind::Prompted(prompted) => prompted.taken_for(),
        }
    }

    /// What the networks say of how they are run, a line each.
    pub fn notes(&self) -> Vec<String> {
        match &self.kind {
            Kind::Plain(plain) => plain.notes(),
            Kind::Prompted(prompted) => prompted.notes(),
        }
    }

    /// Whether each pixel of the window of `columns` and `rows` of `image` is one of the target's at `bbox`, into `cells`, row by row. Where
    /// the network answers no number nothing is the target's, and so it is outside of what the network was shown and where `bbox` lies
    /// outside of the image.
    ///
    /// # Errors
    /// [`InferenceError::Run`] if the network cannot be run, or answers what no probability is though it was taken for one that answers
    /// probabilities.
    pub fn segment(
        &mut self,
        image: ImageView<'_, Rgb8>,
        bbox: &BBox,
        (columns, rows): (Range<usize>, Range<usize>),
        cells: &mut Vec<bool>,
    ) -> Result<()> {
        cells.clear();
        let count = columns.len() * rows.len();
        let inside = bbox.clipped_to(image.size()).filter(|b| b.is_finite() && bbox.is_finite());
        let Some(inside) = inside else {
            cells.resize(count, false);
            return Ok(());
        };
        let Self { config, kind, taps } = self;
        let answer = match kind {
            Kind::Plain(plain) => plain.ask(image, bbox, config)?,
            Kind::Prompted(prompted) => prompted.ask(image, (bbox, &inside), config)?,
        };
        match answer {
            Some((shown, grid)) => grid.read(&shown, (columns, rows), taps, cells),
            None => cells.resize(count, false),
        }
        Ok(())
    }
}

/// A network that is no segmenter, and what would be one.
fn misfit(network: &str, why: String) -> InferenceError {
    InferenceError::Model {
        what: network.to_owned(),
        why,
        mend: "name a network from one picture to a mask of it, or the folder with the image encoder and the mask decoder of Segment Anything \
               or one like it (docs/guide/networks.md)"
            .into(),
    }
}
