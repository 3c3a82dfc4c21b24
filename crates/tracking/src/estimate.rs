use crate::Diagnostics;
use nalgebra::Matrix4;
use pursuit_geometry::{BBox, Point};
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

/// Why a target is not taken to be seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Doubt {
    /// Something hides it where it should be.
    Covered,
    /// Something is there that does not look as the target did.
    Changed,
    /// Several things could be it.
    Confused,
    /// It is out of the picture, or nowhere to be found.
    Gone,
}

impl Doubt {
    /// The word used in files: `covered`, `changed`, `confused` or `gone`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Covered => "covered",
            Self::Changed => "changed",
            Self::Confused => "confused",
            Self::Gone => "gone",
        }
    }
}

/// Covariance of centre x, centre y, width and height, in square pixels.
pub type BoxCovariance = Matrix4<f64>;

/// A velocity of the box's centre, in pixels per second: x to the right, y down.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Velocity {
    /// Along x, px/s.
    pub x: f64,
    /// Along y, px/s.
    pub y: f64,
}

/// Where the target will be at a later time, by its motion alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// The time it is for, in seconds on the frames' clock.
    pub time_s: f64,
    /// The expected box.
    pub bbox: BBox,
    /// Covariance of that box; `None` where the motion model has none.
    pub covariance: Option<BoxCovariance>,
    /// The expected velocity; `None` where the motion model has none.
    pub velocity: Option<Velocity>,
}

/// What a motion model that samples (qu2010) says of its next sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NextSample {
    /// Seconds until it is due, ≥ 0.
    pub in_s: f64,
    /// The centre predicted for it, in pixels; `None` while too few samples were taken.
    pub center: Option<Point>,
}

/// What a tracker says about one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Time of the frame, in seconds.
    pub time_s: f64,
    /// Where the target is believed to be: corrected when tracking, predicted when occluded, last believed when lost.
    pub bbox: BBox,
    /// The probability, in `[0, 1]`, that [`bbox`](Self::bbox) overlaps the target by at least one half.
    pub score: f64,
    /// Whether the target was measured, is coasted, or is lost.
    pub state: TrackState,
    /// Why it is not tracked; `None` while it is, and where the method cannot tell.
    pub doubt: Option<Doubt>,
    /// The one-step prior, made before the frame was seen; `None` where nothing predicts.
    pub prediction: Option<BBox>,
    /// What the localizer said, believed or not; `None` when it found nothing.
    pub measurement: Option<BBox>,
    /// The part of the frame that was looked at: by the search that found the measurement, else by the first one.
    pub searched: Option<BBox>,
    /// Covariance of the box, where the motion model has one.
    pub covariance: Option<BoxCovariance>,
    /// Velocity of the centre, where the motion model has one; of a lost target it means nothing and is `None`.
    pub velocity: Option<Velocity>,
    /// Where the target will be at the next sample, of motion models that sample.
    pub next: Option<NextSample>,
    /// Raw figures of the method: peaks, ratios, areas.
    pub diagnostics: Diagnostics,
}

impl Estimate {
    /// What is known in the frame a target is started on at `time_s`: the box itself, taken for measured.
    pub fn started(time_s: f64, bbox: BBox, score: f64) -> Self {
        Self {
            time_s,
            bbox,
            score,
            state: TrackState::Tracking,
            doubt: None,
            prediction: None,
            measurement: Some(bbox),
            searched: None,
            covariance: None,
            velocity: None,
            next: None,
            diagnostics: Diagnostics::default(),
        }
    }
}
