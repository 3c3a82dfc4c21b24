use crate::BBox;

/// What is known about the target in one frame: what an annotator said, or where a scene put it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_visible_has_a_box() {
        let bbox = BBox::from_ltwh(1.0, 2.0, 3.0, 4.0);
        assert_eq!([Truth::Visible(bbox), Truth::Absent, Truth::Unknown].map(|t| t.bbox()), [Some(bbox), None, None]);
    }
}
