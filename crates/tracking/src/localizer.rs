//! What finds the target: where it is told to look, what it tells the loop, and what it keeps of a look for itself.

use crate::roles::Prior;
use crate::{BoxCovariance, Diagnostics, Doubt, Figure, Result, TrackState};
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;

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
    /// Whether what is found there has its middle moved into the frame.
    pub keep_inside: bool,
}

/// What the loop, the motion model and the policy are told of a target that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The box of the target.
    pub bbox: BBox,
    /// How likely it is, in `[0, 1]`, that this box overlaps the target by one half, judged by appearance alone.
    pub confidence: f64,
    /// What measurements of several searches of one frame are compared by: the higher, the likelier to be the target.
    pub strength: f64,
    /// Standard deviation of the box's centre in pixels, where the localizer can tell.
    pub sigma_px: Option<f64>,
    /// Share of its correction that the velocity takes, `[0, 1]`: less than 1 where the box is the best there is, but slides over
    /// the target, as when something comes to cover it. The motion model `constant-velocity` goes by it; in others the velocity
    /// takes all.
    pub velocity_share: f64,
    /// Squared distance from the expectation as a share of the gate's limit, `[0, 1]`, where there was a gate.
    pub gate_share: Option<f64>,
    /// Peak-to-sidelobe ratio (bolme2010, section 3.5), of localizers that have one.
    pub psr: Option<f64>,
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
            sigma_px: None,
            velocity_share: 1.0,
            gate_share: None,
            psr: None,
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
/// `locate` and `refine` change nothing that is saved: they take `&mut self` for their buffers alone. The loop looks in several
/// places and decides on one of them: what a look saw travels in its [`Finding`](Self::Finding) from `locate` to all that comes
/// later in the frame, and never in a field of the localizer, which would hold what the *last* look saw.
pub trait Localizer: Send {
    /// What a look saw beyond the [`Measurement`], for the localizer's own later use in the same frame: a small value. The finding
    /// of a localizer that wraps another contains that of the other. `()` of localizers that need nothing more.
    type Finding;

    /// The figures that it may report, in groups that are reported together; those of what it wraps included.
    const FIGURES: &'static [&'static [Figure]] = &[];

    /// Looks for the target in one place.
    ///
    /// # Errors
    /// When the frame lacks what the method needs. Not finding the target is `Ok(None)`.
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, Self::Finding)>>;

    /// Measures more exactly what the loop decided on, such as its size; called once a frame. `search` is the one that found it.
    /// Where it says so, the box's middle has been moved into the frame.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut Self::Finding,
    ) -> Result<()> {
        let _ = (frame, search, measurement, finding);
        Ok(())
    }

    /// Learns what the target, of which `finding` was seen, looks like at `bbox`; called only when the policy says so.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &Self::Finding) -> Result<()>;

    /// What becomes of the box that the motion model made of a measurement that is believed.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn weigh(&mut self, frame: &Frame, finding: &Self::Finding, filtered: &BBox) -> Result<Weighed> {
        let _ = (frame, finding, filtered);
        Ok(Weighed::Filtered)
    }

    /// Places besides the prediction that are worth a look in `frame`, into `places` (boxes of the size expected there), of
    /// localizers that hold hypotheses of their own; called once a frame before anything is looked at, with the state before
    /// it. Looked at while the target is not `tracking`. Changes nothing that is saved.
    ///
    /// # Errors
    /// When the hypotheses cannot be carried to this frame.
    fn suggest(&mut self, frame: &Frame, prior: &Prior, state: TrackState, places: &mut Vec<BBox>) -> Result<()> {
        let _ = (frame, prior, state, places);
        Ok(())
    }

    /// Why a target is not seen that is expected at `expected`, of localizers that can tell; asked where it is neither tracked nor lost, after
    /// everything was looked at. `finding` is what was found and not believed.
    fn doubt(&self, frame: &Frame, expected: &BBox, finding: Option<&Self::Finding>) -> Option<Doubt> {
        let _ = (frame, expected, finding);
        None
    }

    /// Which pixels of `frame` are those of the target of which `finding` was seen, of localizers that see them; none may lie beyond the frame.
    /// Asked once a frame, where the target is `tracking` or `unsure`. One that wraps another passes on what that sees where it believes it.
    fn mask(&self, frame: &Frame, finding: &Self::Finding) -> Option<Mask> {
        let _ = (frame, finding);
        None
    }

    /// Is told what became of a frame, after it was judged and learned from: the one place where what is not appearance
    /// (hypotheses, the distance of what hides the target) may change.
    ///
    /// # Errors
    /// When the hypotheses cannot be corrected.
    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, Self::Finding>) -> Result<()> {
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
#[derive(Debug)]
pub struct Outcome<'a, F> {
    /// The state of the frame.
    pub state: TrackState,
    /// The box believed: corrected when tracking, else predicted.
    pub bbox: BBox,
    /// The box found and what was seen of it, believed or not.
    pub found: Option<(BBox, &'a F)>,
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
