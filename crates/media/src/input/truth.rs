use pursuit_geometry::BBox;

/// What an annotator said about the target in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// It is here. Coordinates are as published; one-based data sets are not shifted.
    Visible(BBox),
    /// It cannot be seen.
    Absent,
    /// Nothing was said about this frame.
    Unknown,
}

impl Truth {
    /// The box, where there is one.
    pub const fn bbox(&self) -> Option<BBox> {
        match self {
            Self::Visible(bbox) => Some(*bbox),
            Self::Absent | Self::Unknown => None,
        }
    }
}
