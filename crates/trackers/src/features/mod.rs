//! What trackers look at: a window of a frame as planes of features on a grid of cells.

mod appearance;
mod depth;
mod pixels;

pub use appearance::AppearanceFeatures;
pub use depth::DepthHogFeatures;
pub use pixels::{GrayFeatures, HogFeatures, LogGrayFeatures};

use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use pursuit_vision::hog::HogLayout;
use pursuit_vision::sampling::{Planes, Window};
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

/// Turns a window of a frame into planes of features on a grid of cells.
///
/// Implementations own their scratch: once they have seen the largest frame and patch, they allocate nothing.
/// They hold no state of the target, so a saved tracker makes them anew from its parameters.
pub trait Features: Send {
    /// The number of planes made.
    fn channels(&self) -> usize;

    /// Side of a cell in patch pixels, ≥ 1.
    fn cell_px(&self) -> usize;

    /// The grid of a patch: whole cells only.
    fn grid(&self, patch: Size) -> Size {
        Size::new(patch.width / self.cell_px(), patch.height / self.cell_px())
    }

    /// Features of `window`; `out` becomes [`channels`](Self::channels) planes of the size of [`grid`](Self::grid).
    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes);

    /// How many of the first channels are oriented gradients; all where none is.
    fn gradient_channels(&self) -> usize {
        self.channels()
    }

    /// The patch the features were last made of, values 0–255, where it is kept.
    fn patch(&self) -> Option<&Planes> {
        None
    }
}

/// Which features: a small value, saved with the tracker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FeatureKind {
    /// Grey values.
    Gray,
    /// Grey values prepared as bolme2010 does.
    LogGray,
    /// Histograms of oriented gradients of grey.
    Hog,
    /// Histograms of oriented gradients of colour, where the frame has it.
    ColorHog,
    /// Histograms of oriented gradients of inverse depth; of frames without depth, of grey.
    DepthHog {
        /// Whether those of the picture stand beside them.
        fused: bool,
        /// The distance whose inverse is the greatest value.
        nearest_mm: u16,
    },
    /// Histograms of oriented gradients of grey, and grey.
    HogGray,
    /// Gradients and grey of colour frames with colour names, where the frame the target is started on has colour.
    Appearance {
        /// Whether there are colour names.
        names: bool,
    },
}

impl FeatureKind {
    /// The same for a target that is started on `frame`.
    pub fn on(self, frame: &Frame) -> Self {
        match self {
            Self::Appearance { .. } => Self::Appearance { names: frame.has_color() },
            other => other,
        }
    }

    /// The features, with cells of `cell_px` pixels where they have cells.
    pub fn make(self, cell_px: usize) -> FeatureSet {
        let hog = |color| FeatureSet::Hog(Box::new(HogFeatures::new(HogLayout::Felzenszwalb31, cell_px, color)));
        match self {
            Self::Gray => FeatureSet::Gray(GrayFeatures::default()),
            Self::LogGray => FeatureSet::LogGray(LogGrayFeatures::default()),
            Self::Hog => hog(false),
            Self::ColorHog => hog(true),
            Self::DepthHog { fused, nearest_mm } => {
                FeatureSet::Depth(Box::new(DepthHogFeatures::new(cell_px, nearest_mm, fused)))
            }
            Self::HogGray => FeatureSet::Appearance(Box::new(AppearanceFeatures::new(cell_px, false))),
            Self::Appearance { names } => FeatureSet::Appearance(Box::new(AppearanceFeatures::new(cell_px, names))),
        }
    }
}

/// The features of a [`FeatureKind`].
#[derive(Debug, Clone)]
pub enum FeatureSet {
    /// Grey values.
    Gray(GrayFeatures),
    /// Grey values prepared as bolme2010 does.
    LogGray(LogGrayFeatures),
    /// Histograms of oriented gradients.
    Hog(Box<HogFeatures>),
    /// Histograms of oriented gradients of inverse depth.
    Depth(Box<DepthHogFeatures>),
    /// Gradients, grey and colour names.
    Appearance(Box<AppearanceFeatures>),
}

impl Deref for FeatureSet {
    type Target = dyn Features;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Gray(f) => f,
            Self::LogGray(f) => f,
            Self::Hog(f) => &**f,
            Self::Depth(f) => &**f,
            Self::Appearance(f) => &**f,
        }
    }
}

impl DerefMut for FeatureSet {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Gray(f) => f,
            Self::LogGray(f) => f,
            Self::Hog(f) => &mut **f,
            Self::Depth(f) => &mut **f,
            Self::Appearance(f) => &mut **f,
        }
    }
}
