use crate::{Appearance, Estimate, Figure, Forecast, Measurement, Result, TrackingError};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameter;

/// A tracker that has been started on a target; made by [`Recipe::init`].
pub trait Tracker: Send {
    /// Looks at the next frame. Frames must come in order of time; their spacing is free.
    ///
    /// # Errors
    /// A frame of another size or kind than the first. Losing the target is no error.
    fn update(&mut self, frame: &Frame) -> Result<Estimate>;

    /// What would be measured in `frame` if it came next, with the box and the probability that it is right; changes nothing
    /// that [`save`](Self::save) shows.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    fn peek(&mut self, frame: &Frame) -> Result<Option<Measurement>>;

    /// Where the target will be `seconds` after the frame seen last, by its motion alone; changes nothing.
    ///
    /// # Errors
    /// When the motion model cannot be stepped that far.
    fn forecast(&self, seconds: f64) -> Result<Forecast>;

    /// Forgets the target and starts on a new one with the same parameters; the frame may have a new size.
    ///
    /// # Errors
    /// As [`Recipe::init`]; the tracker is then as before or of no further use.
    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;

    /// Changes parameters of the groups `motion`, `policy` and `search` while running; what is known of the target stays.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for a name that is unknown or cannot be changed while running, or a bad value; nothing is
    /// changed then.
    fn change(&mut self, changes: &toml::Table) -> Result<()>;

    /// Everything needed to go on later, for [`Recipe::restore`].
    ///
    /// # Errors
    /// When the state cannot be written down.
    fn save(&self) -> Result<Vec<u8>>;

    /// A copy that goes its own way.
    fn boxed_clone(&self) -> Box<dyn Tracker>;
}

/// What a tracker cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// Frames with colour.
    pub color: bool,
    /// A file of the user's, such as a network: with its default parameters it cannot start.
    pub file: bool,
}

/// Which tracker, with which parameters: a value that makes trackers.
pub trait Recipe: Send + Sync {
    /// Name in the registry.
    fn name(&self) -> &str;

    /// What it cannot do without.
    fn needs(&self) -> Needs;

    /// Every parameter, with this recipe's values for defaults.
    fn schema(&self) -> Vec<Parameter>;

    /// Every figure that its [`Estimate::diagnostics`] may hold.
    fn figures(&self) -> Vec<&'static Figure> {
        Vec::new()
    }

    /// The paths of today for a parameter that a former version knew; none where it is no former one.
    fn renamed(&self, _path: &str) -> Option<Vec<String>> {
        None
    }

    /// Every parameter of the models chosen with its value, groups as tables.
    ///
    /// # Errors
    /// When a value cannot be written as TOML.
    fn parameters(&self) -> Result<toml::Table>;

    /// This recipe with the values of `changes` in their place. Groups may be given in part; keys may be dotted
    /// (`motion.model`).
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for a name that is unknown or belongs to a model that is not chosen, or a bad value.
    fn with(&self, changes: &toml::Table) -> Result<Box<dyn Recipe>>;

    /// Starts a tracker on the target inside `bbox`.
    ///
    /// # Errors
    /// A box that is empty, not finite or outside the frame; a frame that lacks what the tracker needs.
    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>>;

    /// What looks for the target inside `bbox` where somebody else keeps what is believed of it.
    ///
    /// # Errors
    /// As [`init`](Self::init).
    fn appearance(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Appearance>>;

    /// What looks for a target, as [`Appearance::save`] left it.
    ///
    /// # Errors
    /// As [`restore`](Self::restore).
    fn restore_appearance(&self, saved: &[u8]) -> Result<Box<dyn Appearance>>;

    /// A tracker as [`Tracker::save`] left it.
    ///
    /// # Errors
    /// Bytes that another tracker, another version or nobody wrote.
    fn restore(&self, saved: &[u8]) -> Result<Box<dyn Tracker>>;

    /// A copy.
    fn boxed_clone(&self) -> Box<dyn Recipe>;
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
