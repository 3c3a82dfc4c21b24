use pursuit::BBox;
use serde::Serialize;
use serde_json::{Value, json};

/// What the user did in a frame. A trajectory is a function of the recipe and of these, which is why it can be followed
/// again from any frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Edit {
    /// Number of the frame.
    pub frame: u64,
    pub kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    /// Follow one more target, under this number.
    Add { target: u64, bbox: BBox },
    /// The target is here.
    Correct { target: u64, bbox: BBox },
    /// Stop following it.
    Remove { target: u64 },
    /// Parameters of the groups `motion`, `policy` and `search` changed while running.
    Change { parameters: pursuit::toml::Table },
}

impl Edit {
    /// Whether it says where a target is.
    pub const fn is_box(&self) -> bool {
        matches!(self.kind, Kind::Add { .. } | Kind::Correct { .. })
    }

    /// As the page shows it.
    pub fn to_json(&self) -> Value {
        let (what, target) = match &self.kind {
            Kind::Add { target, .. } => ("add", Some(*target)),
            Kind::Correct { target, .. } => ("correct", Some(*target)),
            Kind::Remove { target } => ("remove", Some(*target)),
            Kind::Change { .. } => ("change", None),
        };
        json!({ "frame": self.frame, "what": what, "target": target })
    }
}

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    /// The first frame is shown; nothing has been followed yet.
    Ready,
    Running,
    Paused,
    /// Stopped by the user.
    Stopped,
    /// The input has ended.
    Ended,
    /// Something broke.
    Failed,
}
