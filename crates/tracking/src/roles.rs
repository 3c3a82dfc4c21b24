//! Who does what in the loop: each clause has one owner.
//!
//! | clause | owner | chosen by |
//! |---|---|---|
//! | predict, correct | [`Motion`](crate::motion::Motion) | the group `[motion]` |
//! | where to look | [`Proposer`](crate::search::Proposer) | the group `[search]` |
//! | find, learn | a [`Localizer`] | the tracker |
//! | judge | [`Policy`](crate::policy::Policy) | the group `[policy]` |

use crate::{BoxCovariance, Class, Diagnostics, Doubt, Result, TrackState};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;

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

/// What kind of look a [`Search`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// About the place where the target is expected.
    Near,
    /// At one place of a sweep over the frame: rough, at the expected size.
    Sweep,
    /// Again, centred on the best place of a sweep, at the expected size.
    Centred,
}

/// A gate: measurements far outside of it are implausible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Covariance of the expected measurement, with what the search adds to it.
    pub covariance: BoxCovariance,
    /// Greatest squared Mahalanobis distance of a centre that is plausible.
    pub chi2: f64,
}

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// The box the target is expected at: its centre is where to look, its size how large the target should be.
    pub expected: BBox,
    /// The part of the frame to look in, in pixels; may reach over the border.
    pub region: BBox,
    /// Candidates outside are implausible. `None`: no gate (a target that is lost may come back anywhere).
    pub gate: Option<Gate>,
    /// What kind of look this is.
    pub look: Look,
}

/// A place and a size relative to that at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Centre in pixels.
    pub center: Point,
    /// How many times larger than at the start.
    pub scale: f64,
}

/// What a localizer found.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The box of the target.
    pub bbox: BBox,
    /// How likely it is, in `[0, 1]`, that this box overlaps the target by one half, judged by appearance alone.
    pub confidence: f64,
    /// What measurements of several searches of one frame are compared by: the higher, the likelier to be the target.
    pub strength: f64,
    /// Where and how large it was seen, of localizers that go by that: exact, where a box rounds its centre.
    pub place: Option<Place>,
    /// Standard deviation of the box's centre in pixels, where the localizer can tell.
    pub sigma_px: Option<f64>,
    /// Share of its correction that the velocity takes, `[0, 1]`: less than 1 where the box is the best there is, but slides over
    /// the target, as when something comes to cover it. The motion model `constant-velocity` goes by it; in others the velocity
    /// takes all.
    pub velocity_share: f64,
    /// Squared distance from the expectation as a share of the gate's limit, `[0, 1]`, where there was a gate.
    pub gate_share: Option<f64>,
    /// Height of the response's peak, of localizers that have one.
    pub peak: Option<f64>,
    /// Peak-to-sidelobe ratio (bolme2010, section 3.5), of localizers that have one.
    pub psr: Option<f64>,
    /// Whether it continues a trajectory that is trusted (kalal2012, section 5.6), of localizers that keep account of that; true of
    /// others.
    pub valid: bool,
    /// Raw figures of the method.
    pub diagnostics: Diagnostics,
}

impl Measurement {
    /// A measurement of which nothing but the box and its probability is known.
    pub fn new(bbox: BBox, confidence: f64) -> Self {
        Self {
            bbox,
            confidence,
            strength: confidence,
            place: None,
            sigma_px: None,
            velocity_share: 1.0,
            gate_share: None,
            peak: None,
            psr: None,
            valid: true,
            diagnostics: Diagnostics::default(),
        }
    }
}

/// Which box is reported where both a measured and a filtered one are at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighed {
    /// The filtered one.
    Filtered,
    /// The measured one; the motion model keeps its own.
    Measured,
    /// The measured one, and the motion model starts anew from it.
    Restarted,
}

/// Finds the target. `locate` is apart from `adapt`, so that a policy can stop a tracker from learning its occluder.
///
/// `locate` and `refine` change nothing that is saved: they take `&mut self` for their scratch alone.
pub trait Localizer: Send {
    /// Looks for the target in one place.
    ///
    /// # Errors
    /// When the frame lacks what the method needs. Not finding the target is `Ok(None)`.
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>>;

    /// Measures more exactly what the loop decided on, such as its size; called once a frame. `look` is the look that saw it.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn refine(&mut self, frame: &Frame, found: Measurement, look: Look) -> Result<Measurement> {
        let _ = (frame, look);
        Ok(found)
    }

    /// Learns what the target looks like at `bbox`, where `measurement` was found; called only when the policy says so.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn adapt(&mut self, frame: &Frame, bbox: BBox, measurement: &Measurement) -> Result<()>;

    /// What becomes of the box that the motion model made of a measurement that is believed.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn weigh(&mut self, frame: &Frame, measurement: &Measurement, filtered: &BBox) -> Result<Weighed> {
        let _ = (frame, measurement, filtered);
        Ok(Weighed::Filtered)
    }

    /// Places besides the prediction that are worth a look in `frame`, into `places` (boxes of the size expected there), of
    /// localizers that hold hypotheses of their own; called once a frame before anything is looked at, with the state before
    /// it. Looked at while the target is occluded. Changes nothing that is saved.
    ///
    /// # Errors
    /// When the hypotheses cannot be carried to this frame.
    fn suggest(&mut self, frame: &Frame, prior: &Prior, state: TrackState, places: &mut Vec<BBox>) -> Result<()> {
        let _ = (frame, prior, state, places);
        Ok(())
    }

    /// Why a target is not seen that is expected at `expected`, of localizers that can tell; asked where it is taken for occluded, after
    /// everything was looked at.
    fn doubt(&self, frame: &Frame, expected: &BBox) -> Option<Doubt> {
        let _ = (frame, expected);
        None
    }

    /// Is told what became of a frame, after it was judged and learned from: the one place where what is not appearance
    /// (hypotheses, the distance of what hides the target) may change.
    ///
    /// # Errors
    /// When the hypotheses cannot be corrected.
    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_>) -> Result<()> {
        let _ = (frame, outcome);
        Ok(())
    }

    /// Forgets everything and starts on a new target.
    ///
    /// # Errors
    /// When the frame or the box cannot be used.
    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;

    /// How much of the frame one look takes in when the target is expected at `expected`, in pixels; `None` where a look
    /// takes in the whole region it is given.
    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let _ = expected;
        None
    }
}

/// What the loop made of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome<'a> {
    /// The state of the frame.
    pub state: TrackState,
    /// The box believed: corrected when tracking, else predicted.
    pub bbox: BBox,
    /// What was found, believed or not.
    pub found: Option<&'a Measurement>,
    /// The box to go on from, for methods that follow from frame to frame: the one reported where what was found is believed,
    /// the one found where it only moved the box. None where nothing was found or followed.
    pub followed: Option<BBox>,
    /// Seconds since the frame before, > 0.
    pub dt_s: f64,
}

/// Width and height of what one look takes in, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewSize {
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
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
}

impl Detection {
    /// Of a detector that looks for one kind of thing.
    pub const fn new(bbox: BBox, confidence: f64) -> Self {
        Self { bbox, confidence, class: None }
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

    /// Raw figures of the last frame as a whole, such as a step of the light; they join those of every target.
    fn diagnostics(&self) -> Diagnostics {
        Diagnostics::default()
    }
}
