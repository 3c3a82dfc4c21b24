use crate::{Image, ImageView, ImagingError, Result};
use pursuit_geometry::Size;
use std::sync::Arc;

/// An image that nobody changes any more: clones share its pixels, which may lie in anybody's buffer.
///
/// An [`Image`] becomes one without a copy (`image.into()`); so does whatever else can be borrowed as a slice of pixels and
/// sent between threads ([`from_buffer`](Self::from_buffer)): a camera's buffer, a memory map, an array of another language.
///
/// ```
/// use pursuit_imaging::SharedImage;
/// use std::sync::Arc;
///
/// // Rows of 4 pixels of which 3 belong to the picture.
/// let camera_buffer: Arc<[u8]> = vec![1, 2, 3, 0, 4, 5, 6, 0].into();
/// let image = SharedImage::from_buffer(camera_buffer.clone(), 3, 2, 4)?;
/// assert_eq!(image.view().row(1), [4, 5, 6]);
/// assert_eq!(image.view().row(1).as_ptr(), &raw const camera_buffer[4], "the pixels stay where they are");
/// # Ok::<(), pursuit_imaging::ImagingError>(())
/// ```
pub struct SharedImage<P> {
    buffer: Arc<dyn AsRef<[P]> + Send + Sync>,
    /// Where in the buffer the first pixel lies.
    start: usize,
    width: usize,
    height: usize,
    stride: usize,
}

impl<P> SharedImage<P> {
    /// Wraps `buffer` as an image of `width` × `height` pixels, `stride` pixels from one row to the next. Nothing is copied;
    /// the buffer is dropped with the last image that shares it.
    ///
    /// `buffer.as_ref()` must give the same slice at every call, as that of every array and smart pointer does.
    ///
    /// # Errors
    /// [`ImagingError::Size`] without pixels or with a side above [`Image::MAX_SIDE`], [`ImagingError::BufferLength`] when
    /// the buffer is too short or `stride < width`.
    pub fn from_buffer(
        buffer: impl AsRef<[P]> + Send + Sync + 'static,
        width: usize,
        height: usize,
        stride: usize,
    ) -> Result<Self> {
        ImageView::new(buffer.as_ref(), width, height, stride)?;
        Ok(Self { buffer: Arc::new(buffer), start: 0, width, height, stride })
    }

    /// Borrows the whole image.
    pub fn view(&self) -> ImageView<'_, P> {
        let pixels = (*self.buffer).as_ref().get(self.start..).unwrap_or_default();
        ImageView::over(pixels, self.size(), self.stride)
    }

    /// The part of `width` × `height` pixels whose top left pixel is `(x, y)`, sharing the pixels; `None` unless it lies
    /// inside.
    #[must_use]
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        self.view().crop(x, y, width, height)?;
        let (buffer, start) = (self.buffer.clone(), self.start + y * self.stride + x);
        Some(Self { buffer, start, width, height, stride: self.stride })
    }

    /// Columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Pixels from one row to the next, ≥ width.
    pub const fn stride(&self) -> usize {
        self.stride
    }

    /// Width and height.
    pub const fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// Whether two images lie in the same buffer, so that one costs no memory beside the other.
    pub fn shares_buffer(&self, other: &Self) -> bool {
        std::ptr::addr_eq(Arc::as_ptr(&self.buffer), Arc::as_ptr(&other.buffer))
    }
}

impl<P: Copy> SharedImage<P> {
    /// A copy that owns its pixels, to change them.
    pub fn to_image(&self) -> Image<P> {
        self.view().to_image()
    }
}

impl<P: Send + Sync + 'static> From<Image<P>> for SharedImage<P> {
    /// Moves the image behind a shared pointer; no pixel is copied.
    fn from(image: Image<P>) -> Self {
        let Size { width, height } = image.size();
        Self { buffer: Arc::new(image.into_vec()), start: 0, width, height, stride: width }
    }
}

impl<P> Clone for SharedImage<P> {
    /// Shares the pixels.
    fn clone(&self) -> Self {
        Self { buffer: self.buffer.clone(), ..*self }
    }
}

impl<P: PartialEq> PartialEq for SharedImage<P> {
    /// Equal sizes and pixels, wherever they lie.
    fn eq(&self, other: &Self) -> bool {
        self.size() == other.size() && self.view().rows().eq(other.view().rows())
    }
}

impl<P: Eq> Eq for SharedImage<P> {}

impl<P> std::fmt::Debug for SharedImage<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SharedImage {{ size: {}, stride: {} }}", self.size(), self.stride)
    }
}

/// Refuses a depth or mask image that does not fit the frame it belongs to.
pub(crate) fn check_size<P>(image: &SharedImage<P>, wanted: Size) -> Result<()> {
    if image.size() == wanted {
        return Ok(());
    }
    Err(ImagingError::Registration { found: image.size(), wanted })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_becomes_shared_without_moving_its_pixels() {
        let image = Image::from_fn(4, 3, |x, y| 10 * y + x).unwrap();
        let address = image.as_slice().as_ptr();
        let shared = SharedImage::from(image.clone());
        assert_ne!(shared.view().row(0).as_ptr(), address, "this one was a copy");
        let shared = SharedImage::from(image);
        let clone = shared.clone();
        assert_eq!([shared.view().row(0).as_ptr(), clone.view().row(0).as_ptr()], [address; 2]);
        assert!(shared.shares_buffer(&clone));
        assert!(!shared.shares_buffer(&shared.to_image().into()));
        assert_eq!(shared, SharedImage::from(shared.to_image()));
        assert_eq!((shared.width(), shared.height(), shared.stride()), (4, 3, 4));
    }

    #[test]
    fn a_foreign_buffer_keeps_its_stride_and_is_dropped_with_the_last_image() {
        let buffer: Arc<Vec<u16>> = Arc::new((0..12).collect());
        let image = SharedImage::from_buffer(Borrowed(buffer.clone()), 3, 2, 5).unwrap();
        assert_eq!((image.stride(), image.view().row(0), image.view().row(1)), (5, &[0, 1, 2][..], &[5, 6, 7][..]));
        assert_eq!(image.to_image().as_slice(), [0, 1, 2, 5, 6, 7]);
        let crop = image.crop(1, 1, 2, 1).unwrap();
        assert_eq!((crop.view().row(0), crop.size()), (&[6, 7][..], Size::new(2, 1)));
        assert_eq!(crop.crop(1, 0, 1, 1).unwrap().view().row(0), [7]);
        assert_eq!((image.crop(2, 0, 2, 1), image.crop(0, 1, 1, 2)), (None, None));
        drop(image);
        assert_eq!(Arc::strong_count(&buffer), 2, "the crop still needs it");
        drop(crop);
        assert_eq!(Arc::strong_count(&buffer), 1);
    }

    /// An owner of another kind: what a binding to another language would write.
    struct Borrowed(Arc<Vec<u16>>);

    impl AsRef<[u16]> for Borrowed {
        fn as_ref(&self) -> &[u16] {
            &self.0
        }
    }

    #[test]
    fn buffers_that_do_not_hold_the_image_are_refused() {
        let new = |len: usize, width, height, stride| SharedImage::from_buffer(vec![0u8; len], width, height, stride);
        assert!(new(11, 3, 3, 4).is_ok(), "the last row needs no padding");
        assert!(matches!(new(10, 3, 3, 4), Err(ImagingError::BufferLength { needed: 11, actual: 10, .. })));
        assert!(matches!(new(99, 3, 3, 2), Err(ImagingError::BufferLength { .. })));
        assert!(matches!(new(99, 3, 3, usize::MAX), Err(ImagingError::BufferLength { .. })));
        assert!(matches!(new(99, 0, 3, 4), Err(ImagingError::Size { .. })));
    }

    #[test]
    fn images_are_equal_by_their_pixels_not_by_their_place() {
        let padded = SharedImage::from_buffer(vec![1u8, 2, 9, 3, 4, 8], 2, 2, 3).unwrap();
        let tight = SharedImage::from(Image::from_vec(vec![1u8, 2, 3, 4], 2, 2).unwrap());
        assert_eq!(padded, tight);
        assert_ne!(padded, SharedImage::from(Image::from_vec(vec![1u8, 2, 3, 5], 2, 2).unwrap()));
        assert_ne!(padded, SharedImage::from(Image::from_vec(vec![1u8, 2, 3, 4], 4, 1).unwrap()));
    }
}
