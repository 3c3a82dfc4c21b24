use crate::{Detector, Estimate, Result, TrackingError, parameters::Parameters, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Serialize, de::DeserializeOwned};

/// A tracker that has been started on a target; made by [`Recipe::init`].
pub trait Tracker: Send {
    /// Looks at the next frame. Frames must come in order of time; their spacing is free.
    ///
    /// # Errors
    /// A frame of another size or kind than the first. Losing the target is no error.
    fn update(&mut self, frame: &Frame) -> Result<Estimate>;

    /// Forgets the target and starts on a new one, keeping parameters and allocations; the frame may have a new size.
    ///
    /// # Errors
    /// As [`Recipe::init`].
    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;

    /// Everything needed to go on later, for [`Recipe::restore`].
    ///
    /// # Errors
    /// When the state cannot be written down.
    fn save(&self) -> Result<Vec<u8>>;

    /// A copy that goes its own way.
    fn boxed_clone(&self) -> Box<dyn Tracker>;
}

/// Which tracker, with which parameters: a value that makes trackers.
pub trait Recipe: Send + Sync {
    /// Name in the registry.
    fn name(&self) -> &'static str;

    /// Every parameter with its value.
    ///
    /// # Errors
    /// When a value cannot be written as TOML.
    fn parameters(&self) -> Result<toml::Table>;

    /// Starts a tracker on the target inside `bbox`.
    ///
    /// # Errors
    /// A box that is empty, not finite or outside the frame; a frame that lacks what the tracker needs.
    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>>;

    /// A tracker as [`Tracker::save`] left it.
    ///
    /// # Errors
    /// Bytes that another tracker, another version or nobody wrote.
    fn restore(&self, saved: &[u8]) -> Result<Box<dyn Tracker>>;
}

/// What an implementer writes to have a [`Recipe`]: implemented by the tracker's parameter struct.
pub trait TrackerRecipe: Parameters + Send + Sync {
    /// The tracker made.
    type Tracker: Tracker + Serialize + DeserializeOwned + 'static;

    /// One line on what the tracker does and when to use it.
    const SUMMARY: &'static str;
    /// The page under `docs/papers/` with its source, without `.md`.
    const PAPER: &'static str;
    /// Whether it can only work on colour frames.
    const NEEDS_COLOR: bool = false;

    /// Starts a tracker; `bbox` has been checked to be finite, not empty and to overlap the frame.
    ///
    /// # Errors
    /// When the frame lacks what the tracker needs.
    fn start(&self, frame: &Frame, bbox: BBox) -> Result<Self::Tracker>;

    /// Rebuilds what is not saved (plans, scratch) and refuses a state that does not hold together.
    ///
    /// # Errors
    /// [`TrackingError::Snapshot`] when sizes and numbers do not fit each other.
    fn revive(&self, saved: Self::Tracker) -> Result<Self::Tracker>;
}

impl<P: TrackerRecipe> Recipe for P {
    fn name(&self) -> &'static str {
        P::OWNER
    }

    fn parameters(&self) -> Result<toml::Table> {
        self.to_table()
    }

    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>> {
        self.validate()?;
        check_box(frame, bbox)?;
        check_planes::<P>(frame)?;
        Ok(Box::new(self.start(frame, bbox)?))
    }

    fn restore(&self, saved: &[u8]) -> Result<Box<dyn Tracker>> {
        self.validate()?;
        Ok(Box::new(self.revive(snapshot::read(P::OWNER, saved)?)?))
    }
}

/// What an implementer writes to have a detector: implemented by the detector's parameter struct.
pub trait DetectorRecipe: Parameters + Send + Sync {
    /// One line on what the detector finds.
    const SUMMARY: &'static str;
    /// The tracker to use for what it finds unless the user names one.
    const DEFAULT_TRACKER: &'static str;

    /// Makes the detector.
    ///
    /// # Errors
    /// When the parameters do not fit each other.
    fn detector(&self) -> Result<Box<dyn Detector>>;
}

/// Checks a box to start from: finite, not empty, and at least partly inside the frame.
///
/// # Errors
/// [`TrackingError::StartBox`] that says which.
pub fn check_box(frame: &Frame, bbox: BBox) -> Result<()> {
    let problem = if !bbox.is_finite() {
        "has a coordinate that is not a finite number"
    } else if bbox.is_empty() {
        "is empty"
    } else if bbox.clipped_to(frame.size()).is_none() {
        "lies outside the frame"
    } else {
        return Ok(());
    };
    Err(TrackingError::StartBox { bbox, frame: frame.size(), problem })
}

fn check_planes<P: TrackerRecipe>(frame: &Frame) -> Result<()> {
    if P::NEEDS_COLOR && !frame.has_color() {
        return Err(TrackingError::MissingPlane { tracker: P::OWNER, needed: "colour", index: frame.index() });
    }
    Ok(())
}
