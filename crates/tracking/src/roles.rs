//! Who does what in the loop: each clause has one owner.
//!
//! | clause | owner | chosen by |
//! |---|---|---|
//! | predict, correct | [`Motion`](crate::motion::Motion) | the group `[motion]` |
//! | where to look | [`Proposer`](crate::search::Proposer) | the group `[search]` |
//! | find, learn | a [`Localizer`](crate::Localizer) | the tracker |
//! | judge | [`Policy`](crate::policy::Policy) | the group `[policy]` |
//! | which pixels | a [`Segmenter`](crate::Segmenter), once the target is found, else the localizer | the group `[mask]` |

use crate::motion::MotionParams;
use crate::{BoxCovariance, Class, Diagnostics, Result};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use std::sync::Arc;

/// What the motion model expects before the frame is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The predicted box.
    pub bbox: BBox,
    /// Covariance of the predicted *measurement* (innovation covariance S), for gating; `None` where the model has none.
    pub innovation_covariance: Option<BoxCovariance>,
    /// Seconds since the frame before, > 0.
    pub dt_s: f64,
}

/// One thing a detector saw.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Its box.
    pub bbox: BBox,
    /// How likely it is, in `[0, 1]`, to be what the detector looks for.
    pub confidence: f64,
    /// What it is taken for, of detectors that tell kinds of things apart.
    pub class: Option<Class>,
    /// What it looks like, as a network or a histogram says it: of any length, the same for all; nearer is more alike, by the
    /// cosine of the angle between two.
    pub embedding: Option<Arc<[f32]>>,
}

impl Detection {
    /// Of a detector that looks for one kind of thing.
    pub const fn new(bbox: BBox, confidence: f64) -> Self {
        Self { bbox, confidence, class: None, embedding: None }
    }
}

/// Says what things look like, so that they are told apart by it: colours, or a network for re-identification.
pub trait Embedder: Send {
    /// What the inside of `bbox`, which may reach over the border, looks like: as many numbers as ever, nearer is more alike by the
    /// cosine of the angle between two.
    ///
    /// # Errors
    /// When the method fails on this frame.
    fn embed(&mut self, frame: &Frame, bbox: &BBox) -> Result<Arc<[f32]>>;

    /// What a user should know of how it was made, a line each: that it runs elsewhere than asked for.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}

/// What a detector is told of the targets that are being followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Followed {
    /// The box believed.
    pub bbox: BBox,
    /// Whether it was measured in the frame before.
    pub measured: bool,
}

/// Finds targets without being told where to look; asked at every frame.
pub trait Detector: Send {
    /// All detections in the frame, the best first. `followed` are the targets being followed: a detector that models the
    /// background must not learn them into it.
    ///
    /// # Errors
    /// When the frame lacks what the method needs. Nothing found is an empty list.
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>>;

    /// Whether it must see every frame, because it models the scene: it is then asked even where its answer is not needed.
    fn watches(&self) -> bool {
        false
    }

    /// Whether what it found in the frame seen last says better where a target is than a tracker does that has learnt the target. One that models
    /// the scene does not while its camera is turned away from what it knows.
    fn measures(&self) -> bool {
        true
    }

    /// Share of `bbox` that stood out of the scene in the frame seen last, in `[0, 1]`; `None` where it does not know the scene.
    fn standing_out(&self, _bbox: &BBox) -> Option<f64> {
        None
    }

    /// What stood out of the scene in the frame seen last: 255, else 0; `None` where it does not know the scene. Trackers of what it
    /// finds are shown it with the frame ([`Frame::foreground`]), so that nobody needs a background of its own.
    fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        None
    }

    /// `frame`, the one seen last, as trackers of what it finds are shown it; `None`: as it is. With what stood out of the scene, where it
    /// knows the scene, and coarser ([`Frame::coarse`]), where it looked at it so.
    fn shown(&mut self, frame: &Frame) -> Option<Frame> {
        frame.clone().with_foreground(self.foreground()?).ok()
    }

    /// How what it finds moves, and how exactly it is measured; `None`: as of any detector.
    fn motion(&self) -> Option<MotionParams> {
        None
    }

    /// What a user should know of how it was made, a line each: what a file was taken for, that it runs elsewhere than asked for.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Raw figures of the last frame as a whole, such as a step of the light; they join those of every target.
    fn diagnostics(&self) -> Diagnostics {
        Diagnostics::default()
    }
}
