//! Many targets at once.
//!
//! A [`MultiTracker`] is asked once a frame and says what is known of every target. It has three fillings:
//! [`TargetSet`], targets given by hand, each followed by a tracker of its own; [`Associating`], the four phases *predict,
//! associate, update, births and deaths* around a detector that is asked at every frame; and [`Acquiring`], one target that
//! a detector finds.

mod acquiring;
mod associating;
mod association;
mod birth;
mod branches;
mod cells;
mod clock;
mod death;
mod doubles;
mod embedding;
mod hypothesis;
mod look;
mod observed;
mod offline;
mod params;
mod presets;
mod target;
mod target_set;
mod whole;

pub use acquiring::Acquiring;
pub use associating::Associating;
pub use association::{
    AssociationModel, AssociationParams, BufferedParams, HypothesesParams, JointAssociationParams, NearestParams,
    ObservationParams, TwoStageParams,
};
pub use birth::{BirthModel, BirthParams, HitsParams, RatioParams};
pub use clock::{Clock, Elapsed, Reading, WallClock};
pub use death::{DeathModel, DeathParams, MissesParams, UnseenParams};
pub use doubles::{DoublesModel, DoublesParams, OverlapParams};
pub use embedding::{ColorsEmbeddingParams, EmbeddingModel, EmbeddingParams, NetworkEmbeddingParams};
pub use offline::{Looked, OfflineParams, Placed, offline};
pub use params::{AcquisitionParams, ManyParams, ReportedBox};
pub use presets::Preset;
pub use target_set::TargetSet;
pub use whole::WholeParams;

use crate::{Class, Detector, Estimate, Forecast, Recipe, Result};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// Identifies a target within its [`MultiTracker`]; counted from 1, never reused there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TargetId(pub u64);

impl std::fmt::Display for TargetId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// What one step says about one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The target.
    pub id: TargetId,
    /// What is known of it; `None` while it is still being looked for.
    pub estimate: Option<Estimate>,
    /// Whether it was started in this frame; its estimate is then the box it was started on.
    pub started: bool,
    /// How long this target's own work took.
    pub elapsed: Elapsed,
    /// What it is, where a detector that tells kinds of things apart has said so.
    pub class: Option<Class>,
    /// Which of this frame's detections it was given, by its place among them: of several the likeliest. `None` where it was given
    /// none, and where nothing is detected.
    pub detection: Option<usize>,
}

/// Follows any number of targets, frame by frame.
///
/// ```
/// # use pursuit_tracking::{MultiTracker, Recipe, Result, TargetSet, Track};
/// # use pursuit_geometry::BBox;
/// # use pursuit_imaging::Frame;
/// # fn follow(recipe: &dyn Recipe, frames: &[Frame], boxes: &[BBox]) -> Result<()> {
/// let mut targets = TargetSet::new();
/// for bbox in boxes {
///     targets.add(recipe, &frames[0], *bbox)?;
/// }
/// let mut tracks: Vec<Track> = Vec::new();
/// for frame in &frames[1..] {
///     targets.step(frame, &mut tracks)?;
///     for track in &tracks {
///         println!("{} {:?}", track.id, track.estimate.as_ref().map(|e| e.bbox));
///     }
/// }
/// # Ok(())
/// # }
/// ```
pub trait MultiTracker: Send {
    /// Looks at the next frame and puts what is known of every target into `tracks` (what was there before is dropped), in
    /// order of their ids. Frames must come in order of time; their spacing is free.
    ///
    /// # Errors
    /// A frame of another size or kind than the first. Losing a target is no error.
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()>;

    /// Starts following the target inside `bbox` of `frame`, the frame looked at last.
    ///
    /// # Errors
    /// As [`Recipe::init`]; everything is then as before.
    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId>;

    /// Stops following a target.
    ///
    /// # Errors
    /// [`TrackingError::UnknownTarget`](crate::TrackingError::UnknownTarget) when there is none of that id.
    fn remove(&mut self, id: TargetId) -> Result<()>;

    /// Puts a target onto `bbox` of `frame`, the frame looked at last; it keeps its id and its parameters.
    ///
    /// # Errors
    /// As [`Tracker::reinit`](crate::Tracker::reinit); [`TrackingError::UnknownTarget`](crate::TrackingError::UnknownTarget) when there is none of that id.
    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()>;

    /// Changes parameters of one target, or of all, while running; what is known of the targets stays.
    ///
    /// # Errors
    /// As [`Tracker::change`](crate::Tracker::change); [`TrackingError::UnknownTarget`](crate::TrackingError::UnknownTarget) when there is none of that id.
    /// Nothing is changed then.
    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()>;

    /// Where a target will be `seconds` after the frame looked at last, by its motion alone.
    ///
    /// # Errors
    /// As [`Tracker::forecast`](crate::Tracker::forecast); [`TrackingError::UnknownTarget`](crate::TrackingError::UnknownTarget) when there is none of that id.
    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast>;

    /// The ids of the targets that are followed, in ascending order.
    fn ids(&self) -> Vec<TargetId>;

    /// Everything needed to go on later, for the `restore` of the same type.
    ///
    /// # Errors
    /// When the state cannot be written down.
    fn save(&self) -> Result<Vec<u8>>;
}

/// Makes recipes by name when a saved state is restored; a registry is one.
pub type RecipeOf<'a> = &'a dyn Fn(&str) -> Result<Box<dyn Recipe>>;

/// Asks `detector` and keeps what can be used: finite boxes that overlap the frame, confidences in `[0, 1]`.
fn usable_detections(
    detector: &mut dyn Detector,
    frame: &Frame,
    followed: &[crate::Followed],
) -> Result<Vec<crate::Detection>> {
    let mut detections = detector.detect(frame, followed)?;
    detections.retain(|d| {
        d.bbox.is_finite() && d.bbox.clipped_to(frame.size()).is_some() && (0.0..=1.0).contains(&d.confidence)
    });
    Ok(detections)
}
