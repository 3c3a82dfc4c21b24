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
    /// The target is here; with `backward`, what came before is to be put right from here too.
    Correct { target: u64, bbox: BBox, backward: bool },
    /// Stop following it.
    Remove { target: u64 },
    /// Parameters of the groups `motion`, `policy` and `search` changed while running.
    Change { parameters: pursuit::toml::Table },
}

impl Edit {
    /// The target that this says the place of.
    pub const fn drawn(&self) -> Option<u64> {
        match self.kind {
            Kind::Add { target, .. } | Kind::Correct { target, .. } => Some(target),
            Kind::Remove { .. } | Kind::Change { .. } => None,
        }
    }

    /// Of which target, and from which box, this asks to follow backward.
    pub const fn backward(&self) -> Option<(u64, BBox)> {
        match self.kind {
            Kind::Correct { target, bbox, backward: true } => Some((target, bbox)),
            _ => None,
        }
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
