//! Which pixels inside a target's box are the target's: the group `[mask]` that every tracker has.

mod colors;
mod motion;
mod network;
mod pieces;

use crate::backdrop::about;
use crate::runtime::RuntimeParams;
use colors::ColorSegmenter;
use motion::MotionSegmenter;
use network::NetworkSegmenter;
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;
use pursuit_parameters::FileName;
use pursuit_tracking::{Estimate, Recipe, Result, Segmenter, SegmenterRecipe, SegmentingRecipe, TrackState};
use serde::{Deserialize, Serialize};

pursuit_parameters::choices! {
    /// By what the target's pixels are told from others.
    pub enum MaskModel {
        /// They are not, but by a tracker whose own network draws masks.
        None = "none",
        /// By colours: what is in the box and not about it (`GrabCut`).
        Colors = "colors",
        /// By what stands out of the background of a camera that stands still.
        Motion = "motion",
        /// By a network of yours, an ONNX file: one that draws a mask of a picture, or one like Segment Anything, asked by the box.
        Network = "network",
    }
}

pursuit_parameters::parameters! {
    /// Which pixels inside the box are the target's.
    pub struct MaskParams {
        /// By what they are told from others.
        pub model: MaskModel = MaskModel::None, source "ours";
        /// How far beyond the box the target may reach, at each side.
        pub slack: f64 = 0.1, in 0.0..=1.0, unit "target sizes", source "ours", of SEEING;
        /// A piece of less than this share of the largest is left out.
        pub least_piece: f64 = 0.15, in 0.0..=1.0, source "ours", of SEEING;
        /// With less than this share of the box in it, a mask is none: what is the target could not be told.
        pub least_fill: f64 = 0.08, in 0.0..=1.0, source "ours", of SEEING;
        /// By colours.
        pub colors: ColorsParams = ColorsParams::default(), of [MaskModel::Colors];
        /// By the background.
        pub motion: MotionParams = MotionParams::default(), of [MaskModel::Motion];
        /// By a network.
        pub network: NetworkMaskParams = NetworkMaskParams::default(), of [MaskModel::Network];
    }
}

const SEEING: [MaskModel; 3] = [MaskModel::Colors, MaskModel::Motion, MaskModel::Network];

pursuit_parameters::parameters! {
    /// Masks by colours.
    pub struct ColorsParams {
        /// Gaussians that describe the colours of the target, and as many those of what is about it, K.
        pub parts: usize = 5, in 1..=16, source "rother2004, section 3.1: 5";
        /// What it costs to part neighbours of the same colour, γ.
        pub smoothness: f64 = 3.0, in 0.0..=200.0, source "rother2004, section 3.1, has 50, for single pixels of still pictures";
        /// Rounds of dividing and learning in the first frame.
        pub first_rounds: usize = 2, in 1..=20, source "rother2004, fig. 3";
        /// Rounds in every later frame.
        pub rounds: usize = 1, in 1..=20, source "ours";
        /// How much is looked at about the box, at each side; the part beyond `slack` is background for certain.
        pub reach: f64 = 0.35, in 0.0..=2.0, unit "target sizes", source "ours";
        /// Most cells that the box and what is about it are divided into.
        pub cells: usize = 4096, in 64..=262_144, source "ours";
        /// Least standard deviation of a Gaussian.
        pub noise: f64 = 6.0, in 1.0..=64.0, unit "codes", source "ours";
        /// Weight of this frame's colours against all before.
        pub learning_rate: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Weight of where in the box the target's pixels were before, against what their colours say.
        pub shape_weight: f64 = 1.0, in 0.0..=20.0, source "ours";
        /// Weight of this frame's shape against all before.
        pub shape_rate: f64 = 0.3, in 0.0..=1.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Masks by the background. Where a detector that knows the background takes part, its word counts.
    pub struct MotionParams {
        /// Time constant of the running average of the background.
        pub history_s: f64 = 10.0, in above(0.0), unit "s", source "ours";
        /// A pixel stands out when a channel differs from the background by more.
        pub threshold: usize = 25, in 1..=254, unit "codes", source "ours";
        /// Least share of the box whose background must be known.
        pub least_known: f64 = 0.9, in 0.0..=1.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Masks by a network.
    pub struct NetworkMaskParams {
        /// The network: its ONNX file; or the folder with an image encoder and a mask decoder, or the TOML file that names these.
        pub model: FileName = FileName::default();
        /// How the network is run.
        pub runtime: RuntimeParams = RuntimeParams::default();
    }
}

pursuit_parameters::parameters! {
    /// The group by its name.
    pub struct MaskGroup {
        /// Which pixels inside the box are the target's.
        pub mask: MaskParams = MaskParams::default();
    }
}

/// The recipe, with the group `[mask]`.
pub fn with_masks(recipe: Box<dyn Recipe>) -> Box<dyn Recipe> {
    Box::new(SegmentingRecipe::new(recipe, MaskGroup::default()))
}

impl SegmenterRecipe for MaskGroup {
    type Segmenter = AnySegmenter;

    fn segmenter(&self, frame: &Frame, bbox: BBox) -> Result<Option<AnySegmenter>> {
        self.mask.segmenter("mask", frame, &bbox)
    }
}

impl MaskParams {
    /// What these make for the target at `bbox`; `None` where they want no masks. Errors name them as those of `group`.
    ///
    /// # Errors
    /// When a network cannot be used.
    pub(crate) fn segmenter(&self, group: &str, frame: &Frame, bbox: &BBox) -> Result<Option<AnySegmenter>> {
        Ok(match self.model {
            MaskModel::None => None,
            MaskModel::Colors => Some(AnySegmenter::Colors(Box::new(ColorSegmenter::new(self, frame, bbox)))),
            MaskModel::Motion => Some(AnySegmenter::Motion(Box::new(MotionSegmenter::new(self, frame, bbox)))),
            MaskModel::Network => Some(AnySegmenter::Network(Box::new(NetworkSegmenter::new(self, group)?))),
        })
    }
}

/// Any of the segmenters.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum AnySegmenter {
    /// By colours.
    Colors(Box<ColorSegmenter>),
    /// By the background.
    Motion(Box<MotionSegmenter>),
    /// By a network.
    Network(Box<NetworkSegmenter>),
}

impl AnySegmenter {
    /// The pixels of the target at `bbox`; learns them as far as `state` lets it.
    pub(crate) fn look(&mut self, frame: &Frame, bbox: &BBox, state: TrackState) -> Result<Option<Mask>> {
        // What is not seen has no pixels, and where it should be is something else to learn from.
        let seen = matches!(state, TrackState::Tracking | TrackState::Unsure);
        Ok(match self {
            Self::Colors(segmenter) if seen => segmenter.look(frame, bbox, state),
            Self::Colors(_) => None,
            Self::Motion(segmenter) => segmenter.look(frame, bbox).filter(|_| seen),
            Self::Network(segmenter) if seen => segmenter.look(frame, bbox)?,
            Self::Network(_) => None,
        })
    }
}

impl Segmenter for AnySegmenter {
    fn segment(&mut self, frame: &Frame, estimate: &Estimate) -> Result<Option<Mask>> {
        self.look(frame, &estimate.bbox, estimate.state)
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        match self {
            Self::Colors(segmenter) => segmenter.restart(frame, &bbox),
            Self::Motion(segmenter) => segmenter.restart(frame, &bbox),
            // It is open already, and knows nothing of the target.
            Self::Network(_) => {}
        }
        Ok(())
    }
}
