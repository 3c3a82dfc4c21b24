use pursuit_geometry::{BBox, Size};
use pursuit_parameters::ParameterError;

/// What can go wrong when a tracker is made or fed. Losing the target is a state, never an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrackingError {
    /// The box to start from cannot be used.
    #[error(
        "box {bbox} {problem} (the frame is {frame}); give left,top,width,height in pixels of a box that overlaps the frame"
    )]
    StartBox {
        /// The box given.
        bbox: BBox,
        /// Size of the frame.
        frame: Size,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A frame whose size differs from the one the tracker was started on.
    #[error(
        "frame {index} is {actual}, the tracker was started on {expected}; start it again (reinit) when the size changes"
    )]
    FrameSize {
        /// Number of the frame.
        index: u64,
        /// Size at the start.
        expected: Size,
        /// Size now.
        actual: Size,
    },
    /// A detection that cannot be one.
    #[error("detection {at} of frame {index} (box {bbox}) {problem}; leave it out, or mend what made it")]
    Detection {
        /// Its place among the detections of its frame, from 0.
        at: usize,
        /// Number of the frame.
        index: u64,
        /// Its box.
        bbox: BBox,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Time that runs backward, or is none.
    #[error(
        "frame {index} is of {time_s} s, the one before of {before_s} s; give frames in order of time, in finite seconds"
    )]
    Time {
        /// Number of the frame.
        index: u64,
        /// Its time, in seconds.
        time_s: f64,
        /// The time of the frame before, in seconds.
        before_s: f64,
    },
    /// A frame that lacks what the tracker needs.
    #[error("tracker `{tracker}` needs {needed}, frame {index} has none; choose a tracker that works without it")]
    MissingPlane {
        /// Name of the tracker.
        tracker: String,
        /// What it needs: colour, depth.
        needed: &'static str,
        /// Number of the frame.
        index: u64,
    },
    /// A parameter that does not exist or has a senseless value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No tracker or detector of that name.
    #[error("there is no {kind} called `{name}`; there are: {available}")]
    UnknownName {
        /// `tracker` or `detector`.
        kind: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are.
        available: String,
    },
    /// A tracker or detector that this build was made without.
    #[error("the {kind} `{name}` is not part of this build; build it with `--features {feature}`")]
    NotBuiltIn {
        /// `tracker` or `detector`.
        kind: &'static str,
        /// The name asked for.
        name: String,
        /// The feature that brings it.
        feature: &'static str,
    },
    /// No target of that id in the set.
    #[error("there is no target {id}; targets are removed once, by the id that `add` returned")]
    UnknownTarget {
        /// The id asked for.
        id: u64,
    },
    /// A saved tracker that cannot be restored.
    #[error("saved state of tracker `{tracker}` cannot be restored: {problem}")]
    Snapshot {
        /// Name of the tracker.
        tracker: String,
        /// What is wrong with the bytes.
        problem: String,
    },
    /// A computation on a valid input failed.
    #[error("tracker `{tracker}`, frame {index}: {source}")]
    Computation {
        /// Name of the tracker.
        tracker: String,
        /// Number of the frame.
        index: u64,
        /// What failed.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}
