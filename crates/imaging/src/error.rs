use pursuit_geometry::Size;

/// What can be wrong with pixel data handed to this crate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImagingError {
    /// The buffer cannot hold an image of the size given.
    #[error(
        "a {width}x{height} image with {stride} pixels a row needs {needed} pixels, the buffer has {actual}; pass a buffer of that length or the right size"
    )]
    BufferLength {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
        /// Pixels from one row to the next.
        stride: usize,
        /// Pixels needed.
        needed: usize,
        /// Pixels there are.
        actual: usize,
    },
    /// An image without pixels, or with sides that overflow.
    #[error("an image of {width}x{height} pixels cannot be used; both sides must be between 1 and {max}", max = crate::Image::<u8>::MAX_SIDE)]
    Size {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
    /// A second image of a frame whose size is not the frame's.
    #[error(
        "an image of {found} pixels does not belong to a frame of {wanted}; both must be registered, pixel by pixel"
    )]
    Registration {
        /// The size it has.
        found: Size,
        /// The frame's size.
        wanted: Size,
    },
    /// A camera pose that no camera has.
    #[error("a camera pose with {quantity} {value} cannot be used; {wanted}")]
    Camera {
        /// What is wrong.
        quantity: &'static str,
        /// Its value, written out.
        value: String,
        /// What it must be.
        wanted: &'static str,
    },
}
