use pursuit_geometry::BBox;

/// What the user did in a frame. A trajectory is a function of the recipe and of these, which is why it can be followed
/// again from any frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Edit {
    /// Number of the frame.
    pub frame: u64,
    /// What was done.
    pub kind: EditKind,
}

/// One thing that a user did.
#[derive(Debug, Clone, PartialEq)]
pub enum EditKind {
    /// Follow one more target.
    Add {
        /// The number that it is known by.
        target: u64,
        /// Where it is.
        bbox: BBox,
    },
    /// The target is elsewhere.
    Correct {
        /// Which.
        target: u64,
        /// Where it is.
        bbox: BBox,
        /// Whether what came before is to be put right from here too.
        backward: bool,
    },
    /// Stop following a target.
    Remove {
        /// Which.
        target: u64,
    },
    /// Parameters of the groups `motion`, `policy` and `search` changed while running.
    Change {
        /// The values changed.
        parameters: toml::Table,
    },
}

impl Edit {
    /// The target that this says the place of.
    pub const fn drawn(&self) -> Option<u64> {
        match self.kind {
            EditKind::Add { target, .. } | EditKind::Correct { target, .. } => Some(target),
            EditKind::Remove { .. } | EditKind::Change { .. } => None,
        }
    }

    /// Of which target, and from which box, this asks to follow backward.
    pub const fn backward(&self) -> Option<(u64, BBox)> {
        match self.kind {
            EditKind::Correct { target, bbox, backward: true } => Some((target, bbox)),
            _ => None,
        }
    }
}
