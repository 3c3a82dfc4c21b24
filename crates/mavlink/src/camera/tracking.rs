/// A box in the picture, in parts of its width and height: 0 is left and top, 1 right and bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Left edge.
    pub left: f64,
    /// Top edge.
    pub top: f64,
    /// Right edge.
    pub right: f64,
    /// Bottom edge.
    pub bottom: f64,
}

impl Place {
    /// Its middle.
    pub const fn center(&self) -> (f64, f64) {
        (0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom))
    }
}

/// What has become of the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tracking {
    /// There is none.
    Idle,
    /// It is seen there.
    Seen(Place),
    /// It is hidden and expected there, or it is most likely there and not for certain.
    Coasting(Place),
    /// It is lost: nobody knows where it is.
    Lost,
}

impl Tracking {
    /// Where it is or is expected, where anybody knows.
    pub(crate) const fn place(&self) -> Option<Place> {
        match self {
            Self::Seen(place) | Self::Coasting(place) => Some(*place),
            Self::Idle | Self::Lost => None,
        }
    }
}
