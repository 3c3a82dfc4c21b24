//! Masks by a network of the user's: what it says of the picture about the box, as far as that hangs together.

use super::pieces::Pieces;
use super::{MaskParams, about};
use crate::runtime::unusable;
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;
use pursuit_inference::segmentation::SegmentationNetwork;
use pursuit_parameters::{ParameterError, Parameters};
use pursuit_tracking::{Result, TrackingError};
use pursuit_vision::PixelWindow;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, PoisonError};

/// The owner of the parameters in errors.
const NAME: &str = "mask";
/// The parameter that names the network.
const MODEL: &str = "network.model";

/// Which pixels a network draws. It learns nothing.
#[derive(Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct NetworkSegmenter {
    params: MaskParams,
    /// Clones share it, and ask one after the other.
    network: Arc<Mutex<SegmentationNetwork>>,
    scratch: (Vec<bool>, Pieces),
}

/// What is stored: the network itself is not.
#[derive(Clone, Serialize, Deserialize)]
struct Saved {
    params: MaskParams,
}

impl From<NetworkSegmenter> for Saved {
    fn from(segmenter: NetworkSegmenter) -> Self {
        Self { params: segmenter.params }
    }
}

impl TryFrom<Saved> for NetworkSegmenter {
    type Error = TrackingError;

    fn try_from(Saved { params }: Saved) -> Result<Self> {
        params.validate(NAME)?;
        Self::new(&params, NAME)
    }
}

impl std::fmt::Debug for NetworkSegmenter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NetworkSegmenter").field("params", &self.params.network).finish_non_exhaustive()
    }
}

impl NetworkSegmenter {
    /// Opens the network; errors name its parameters as those of `group`.
    ///
    /// # Errors
    /// When none is named, or it cannot be used.
    pub(super) fn new(params: &MaskParams, group: &str) -> Result<Self> {
        let Some(model) = params.network.model.path() else {
            let problem = format!(
                "names no network; give its ONNX file, or the folder with image encoder and mask decoder, for example \
                 `--set {group}.{MODEL}=networks/mobile_sam`"
            );
            return Err(ParameterError::new(group, MODEL, problem).into());
        };
        let opened = SegmentationNetwork::open(model, &params.network.runtime.options());
        let network = opened.map_err(unusable(group, MODEL))?;
        tracing::info!("{}", network.taken_for());
        network.notes().iter().for_each(|note| tracing::warn!("{note}"));
        Ok(Self { params: params.clone(), network: Arc::new(Mutex::new(network)), scratch: Default::default() })
    }

    /// The target's pixels at `bbox`.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub(super) fn look(&mut self, frame: &Frame, bbox: &BBox) -> Result<Option<Mask>> {
        let Some(window) = PixelWindow::of(&about(bbox, self.params.slack), frame.size()) else { return Ok(None) };
        let PixelWindow { x, y, width, height } = window;
        let (cells, pieces) = &mut self.scratch;
        let mut network = self.network.lock().unwrap_or_else(PoisonError::into_inner);
        let asked = network.segment(frame.color(), bbox, (x..x + width, y..y + height), cells);
        asked.map_err(|e| TrackingError::Computation {
            tracker: NAME.to_owned(),
            index: frame.index(),
            source: Box::new(e),
        })?;
        pieces.keep_large(cells, width, self.params.least_piece);
        let mut mask = Mask::default();
        for (row, pixels) in cells.chunks(width).enumerate() {
            mask.extend_row(y + row, x, pixels.iter().copied());
        }
        let inside = bbox.clipped_to(frame.size()).map_or(1.0, |b| b.area()).max(1.0);
        Ok((!mask.is_empty() && mask.area() as f64 >= self.params.least_fill * inside).then_some(mask))
    }
}
