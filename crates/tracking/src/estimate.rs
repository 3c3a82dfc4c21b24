use nalgebra::Matrix4;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// Whether the target is being measured, coasted or given up for the time being.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrackState {
    /// Measured in this frame.
    Tracking,
    /// Not seen; the box is predicted and the search goes on near it.
    Occluded,
    /// Not seen for long; the box is the last one believed, not to be steered by; the search is wide.
    Lost,
}

impl TrackState {
    /// The word used in files: `tracking`, `occluded` or `lost`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Tracking => "tracking",
            Self::Occluded => "occluded",
            Self::Lost => "lost",
        }
    }
}

impl std::fmt::Display for TrackState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.as_str())
    }
}

/// Covariance of centre x, centre y, width and height, in square pixels.
pub type BoxCovariance = Matrix4<f64>;

/// What a tracker says about one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Where the target is believed to be: corrected when tracking, predicted when occluded, last believed when lost.
    pub bbox: BBox,
    /// The probability, in `[0, 1]`, that [`bbox`](Self::bbox) overlaps the target by at least one half.
    pub score: f64,
    /// Whether the target was measured, is coasted, or is lost.
    pub state: TrackState,
    /// The one-step prior, made before the frame was seen; `None` where nothing predicts.
    pub prediction: Option<BBox>,
    /// What the localizer said, believed or not; `None` when it found nothing.
    pub measurement: Option<BBox>,
    /// Covariance of the box, where the motion filter has one.
    pub covariance: Option<BoxCovariance>,
    /// Raw figures of the method: peaks, ratios, areas.
    pub diagnostics: Diagnostics,
}

/// A handful of named raw figures, kept without allocating.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Diagnostics {
    entries: [(&'static str, f64); Self::CAPACITY],
    len: usize,
}

impl Diagnostics {
    /// How many figures fit; further ones are dropped.
    pub const CAPACITY: usize = 8;

    /// Adds a figure.
    pub fn push(&mut self, name: &'static str, value: f64) {
        if let Some(slot) = self.entries.get_mut(self.len) {
            *slot = (name, value);
            self.len += 1;
        }
    }

    /// The same figures and one more.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: f64) -> Self {
        self.push(name, value);
        self
    }

    /// All figures in the order they were added.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.entries.iter().take(self.len).copied()
    }

    /// The figure of that name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.iter().find(|(n, _)| *n == name).map(|(_, v)| v)
    }
}
