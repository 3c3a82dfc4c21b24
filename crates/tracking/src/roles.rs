//! Who does what in the loop: each clause has one owner.

use crate::{BoxCovariance, Diagnostics, Result, TrackState};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;

/// What the motion filter expects before the frame is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The predicted box.
    pub bbox: BBox,
    /// Covariance of the predicted *measurement* (innovation covariance S), for gating; `None` where the filter has none.
    pub innovation_covariance: Option<BoxCovariance>,
    /// Seconds since the frame before, > 0.
    pub dt_s: f64,
}

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// The box the target is expected at: its centre and size.
    pub expected: BBox,
    /// The part of the frame to look in, in pixels; may reach over the border.
    pub region: BBox,
    /// Innovation covariance of the expectation: candidates far outside it are implausible. `None`: no gate (a target that
    /// is lost may come back anywhere).
    pub gate: Option<BoxCovariance>,
    /// Whether the target is being searched for all over, having been lost.
    pub wide: bool,
}

/// What a localizer found.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The box of the target.
    pub bbox: BBox,
    /// How likely it is, in `[0, 1]`, that this box overlaps the target by one half, judged by appearance alone.
    pub confidence: f64,
    /// Standard deviation of the box's centre in pixels, where the localizer can tell.
    pub sigma_px: Option<f64>,
    /// Raw figures of the method.
    pub diagnostics: Diagnostics,
}

/// Says where to look: near the prediction while the target is seen or coasted, wide once it is lost.
pub trait Proposer: Send {
    /// The search for this frame.
    fn propose(&mut self, frame: &Frame, prior: &Prior, state: TrackState) -> Search;
}

/// Finds the target. `locate` is apart from `adapt`, so that a policy can stop a tracker from learning its occluder.
pub trait Localizer: Send {
    /// Looks for the target; learns nothing.
    ///
    /// # Errors
    /// When the frame lacks what the method needs. Not finding the target is `Ok(None)`.
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>>;

    /// Learns what the target looks like at `bbox`; called only when the policy says so.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn adapt(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;

    /// Forgets everything and starts on a new target.
    ///
    /// # Errors
    /// When the frame or the box cannot be used.
    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;
}

/// Everything a policy may judge by.
#[derive(Debug)]
pub struct Evidence<'a> {
    /// The frame.
    pub frame: &'a Frame,
    /// What the motion filter expected.
    pub prior: &'a Prior,
    /// Where was looked.
    pub search: &'a Search,
    /// What was found.
    pub found: Option<&'a Measurement>,
    /// The state before this frame.
    pub state: TrackState,
}

/// A policy's judgement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The state of this frame. `Tracking` means that the measurement is believed.
    pub state: TrackState,
    /// The probability, in `[0, 1]`, that the box reported overlaps the target by one half.
    pub score: f64,
    /// Whether appearance may learn from this frame; ignored unless `state` is `Tracking`.
    pub learn: bool,
}

/// Judges whether the target is still seen.
pub trait Policy: Send {
    /// The judgement of this frame.
    fn judge(&mut self, evidence: &Evidence<'_>) -> Verdict;

    /// Whether a measurement moves the box although its verdict is `state` and not `Tracking`: the best guess of where the
    /// target is, apart from whether it is seen. Nothing is learned from it.
    fn follows(&self, _state: TrackState) -> bool {
        false
    }

    /// Forgets everything: a new target.
    fn restart(&mut self);
}

/// Predicts where the box goes and corrects the prediction by what was measured.
pub trait MotionFilter: Send {
    /// Moves the belief `dt_s` seconds on (> 0) and returns the prior.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    fn predict(&mut self, dt_s: f64) -> Result<Prior, Box<dyn std::error::Error + Send + Sync>>;

    /// Corrects the belief by a measurement that is believed.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    fn correct(&mut self, measurement: &Measurement) -> Result<(), Box<dyn std::error::Error + Send + Sync>>;

    /// Starts anew at `bbox`, at rest.
    fn restart(&mut self, bbox: BBox);

    /// The box believed now.
    fn bbox(&self) -> BBox;

    /// Covariance of the box believed now.
    fn covariance(&self) -> Option<BoxCovariance>;
}

/// One thing a detector saw.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Its box.
    pub bbox: BBox,
    /// How likely it is, in `[0, 1]`, to be what the detector looks for.
    pub confidence: f64,
}

/// Finds targets without being told where to look.
pub trait Detector: Send {
    /// All detections in the frame, the best first.
    ///
    /// # Errors
    /// When the frame lacks what the method needs. Nothing found is an empty list.
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>>;
}
