use crate::Diagnostics;
use nalgebra::Matrix4;
use pursuit_geometry::{BBox, Mask, Point};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Whether the target is measured, followed in doubt, coasted, or given up for the time being.
///
/// A target that is not `Tracking` is `Unsure` where the box follows what was found inside the picture and nothing says that it
/// is hidden ([`Doubt::Covered`]) or gone ([`Doubt::Gone`]), and `Occluded` where one of both is said, or the box goes on by
/// prediction alone because nothing was found or what was found is too far off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrackState {
    /// Measured in this frame.
    Tracking,
    /// Something is in front, or nothing is found; the box is predicted, or follows what little is found, and the search goes on near it.
    Occluded,
    /// Not seen for long; the box is the last one believed, not to be steered by; the search is wide.
    Lost,
    /// In sight, but not for certain: the box follows what is most likely the target.
    // The last one: saved states hold the place among these.
    Unsure,
}

impl TrackState {
    /// All of them, from the surest on.
    pub const ALL: [Self; 4] = [Self::Tracking, Self::Unsure, Self::Occluded, Self::Lost];

    /// The word used in files: `tracking`, `unsure`, `occluded` or `lost`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Tracking => "tracking",
            Self::Unsure => "unsure",
            Self::Occluded => "occluded",
            Self::Lost => "lost",
        }
    }

    /// The state of this word; `None` where it is none of theirs.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.as_str() == word)
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
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Covered, Self::Changed, Self::Confused, Self::Gone];

    /// The doubt of that word; `None` for others.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|doubt| doubt.as_str() == word)
    }

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
    /// Where the target is believed to be: corrected when tracking or unsure, predicted when occluded, last believed when lost.
    pub bbox: BBox,
    /// The probability, in `[0, 1]`, that [`bbox`](Self::bbox) overlaps the target by at least one half.
    pub score: f64,
    /// Whether the target was measured, is followed in doubt, is coasted, or is lost.
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
    /// Which pixels of the frame are the target's, where it is seen and what was asked could tell: a [`Segmenter`](crate::Segmenter), else the
    /// [`Localizer`](crate::Localizer::mask).
    pub mask: Option<Arc<Mask>>,
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
            mask: None,
            diagnostics: Diagnostics::default(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn every_state_is_known_by_its_word() {
        assert!(TrackState::ALL.into_iter().all(|s| TrackState::from_word(s.as_str()) == Some(s)));
        assert!(TrackState::from_word("Unsure").is_none() && TrackState::from_word("").is_none());
        assert!(Doubt::ALL.into_iter().all(|d| Doubt::from_word(d.as_str()) == Some(d)));
        assert_eq!(Doubt::from_word(""), None);
    }

    #[test]
    fn states_saved_without_the_word_unsure_are_read() {
        for (saved, state) in [(0, TrackState::Tracking), (1, TrackState::Occluded), (2, TrackState::Lost)] {
            assert_eq!(postcard::from_bytes::<TrackState>(&[saved]).unwrap(), state);
        }
        let bytes = postcard::to_stdvec(&TrackState::Unsure).unwrap();
        assert_eq!(postcard::from_bytes::<TrackState>(&bytes).unwrap(), TrackState::Unsure);
    }
}
