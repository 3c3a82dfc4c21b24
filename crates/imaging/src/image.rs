use crate::{ImagingError, Result};
use pursuit_geometry::Size;

/// An 8-bit colour pixel: red, green, blue.
pub type Rgb8 = [u8; 3];

/// An image that borrows its pixels from anybody's buffer: row-major, `stride` pixels from one row to the next.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a, P> {
    data: &'a [P],
    width: usize,
    height: usize,
    stride: usize,
}

impl<'a, P> ImageView<'a, P> {
    /// Borrows `data` as an image of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`ImagingError::Size`] without pixels, [`ImagingError::BufferLength`] when `data` is too short or `stride < width`.
    pub fn new(data: &'a [P], width: usize, height: usize, stride: usize) -> Result<Self> {
        check_side(width, height)?;
        // Both sides are at most MAX_SIDE, so only a hostile stride can overflow.
        let needed = (height - 1).checked_mul(stride).and_then(|n| n.checked_add(width)).unwrap_or(usize::MAX);
        if stride < width || data.len() < needed {
            return Err(ImagingError::BufferLength { width, height, stride, needed, actual: data.len() });
        }
        Ok(Self { data, width, height, stride })
    }

    /// Without checking: for images whose sizes were checked when they were made.
    pub(crate) const fn over(data: &'a [P], size: Size, stride: usize) -> Self {
        Self { data, width: size.width, height: size.height, stride }
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

    /// Row `y` (`y < height`), `width` pixels long.
    #[inline]
    pub fn row(&self, y: usize) -> &'a [P] {
        &self.data[y * self.stride..y * self.stride + self.width]
    }

    /// All pixels in one slice, where rows follow each other without gaps.
    pub fn as_contiguous(&self) -> Option<&'a [P]> {
        (self.stride == self.width || self.height == 1).then(|| &self.data[..self.width * self.height])
    }

    /// All rows from top to bottom.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &'a [P]> + use<'a, P> {
        let (data, stride, width) = (self.data, self.stride, self.width);
        (0..self.height).map(move |y| &data[y * stride..y * stride + width])
    }

    /// The pixel in column `x` of row `y`, or `None` outside.
    #[inline]
    pub fn get(&self, x: usize, y: usize) -> Option<&'a P> {
        (x < self.width && y < self.height).then(|| &self.data[y * self.stride + x])
    }

    /// The part of `width` × `height` pixels whose top left pixel is `(x, y)`; `None` unless it lies inside.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        let inside = width > 0
            && height > 0
            && x.checked_add(width).is_some_and(|r| r <= self.width)
            && y.checked_add(height).is_some_and(|b| b <= self.height);
        inside.then(|| Self { data: &self.data[y * self.stride + x..], width, height, stride: self.stride })
    }
}

impl<P: Copy> ImageView<'_, P> {
    /// The pixel nearest to column `x`, row `y` (border replication).
    #[inline]
    pub fn clamped(&self, x: isize, y: isize) -> P {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.data[y * self.stride + x]
    }

    /// A copy that owns its pixels.
    pub fn to_image(&self) -> Image<P> {
        let mut data = Vec::with_capacity(self.width * self.height);
        self.rows().for_each(|r| data.extend_from_slice(r));
        Image { data, width: self.width, height: self.height }
    }
}

/// An image that owns its pixels, to change them: row-major, without gaps between rows. Once finished it is handed on as a
/// [`SharedImage`](crate::SharedImage).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image<P> {
    data: Vec<P>,
    width: usize,
    height: usize,
}

impl<P> Image<P> {
    /// The longest side accepted, in pixels; larger images are refused, whatever the buffer.
    pub const MAX_SIDE: usize = 32_768;

    /// Takes `data`, `width · height` pixels in row-major order.
    ///
    /// # Errors
    /// [`ImagingError::Size`] without pixels, [`ImagingError::BufferLength`] unless the length is exactly right.
    pub fn from_vec(data: Vec<P>, width: usize, height: usize) -> Result<Self> {
        check_side(width, height)?;
        if data.len() != width * height {
            let (needed, actual) = (width * height, data.len());
            return Err(ImagingError::BufferLength { width, height, stride: width, needed, actual });
        }
        Ok(Self { data, width, height })
    }

    /// An image whose pixel in column `x`, row `y` is `pixel(x, y)`.
    ///
    /// # Errors
    /// [`ImagingError::Size`] when a side is zero or too long.
    pub fn from_fn(width: usize, height: usize, mut pixel: impl FnMut(usize, usize) -> P) -> Result<Self> {
        check_side(width, height)?;
        let data = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Ok(Self { data, width, height })
    }

    /// Borrows the whole image.
    #[inline]
    pub fn view(&self) -> ImageView<'_, P> {
        ImageView { data: &self.data, width: self.width, height: self.height, stride: self.width }
    }

    /// Columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Width and height.
    pub const fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// All pixels, row by row.
    pub fn as_slice(&self) -> &[P] {
        &self.data
    }

    /// All pixels, row by row, to change.
    pub fn as_mut_slice(&mut self) -> &mut [P] {
        &mut self.data
    }

    /// Row `y` (`y < height`).
    #[inline]
    pub fn row(&self, y: usize) -> &[P] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// Row `y` (`y < height`), to change.
    #[inline]
    pub fn row_mut(&mut self, y: usize) -> &mut [P] {
        &mut self.data[y * self.width..(y + 1) * self.width]
    }

    /// The pixels, giving up the image.
    pub fn into_vec(self) -> Vec<P> {
        self.data
    }
}

impl<P: Clone> Image<P> {
    /// An image of one value.
    ///
    /// # Errors
    /// [`ImagingError::Size`] when a side is zero or too long.
    pub fn filled(width: usize, height: usize, value: P) -> Result<Self> {
        check_side(width, height)?;
        Ok(Self { data: vec![value; width * height], width, height })
    }

    /// Makes this image `size` large, keeping the allocation where it suffices; pixel values are unspecified afterwards.
    ///
    /// For scratch images that a tracker owns and reuses from frame to frame.
    ///
    /// # Errors
    /// [`ImagingError::Size`] when a side is zero or too long.
    pub fn resize_for_overwrite(&mut self, size: Size, value: P) -> Result<()> {
        check_side(size.width, size.height)?;
        self.data.resize(size.area(), value);
        (self.width, self.height) = (size.width, size.height);
        Ok(())
    }
}

fn check_side(width: usize, height: usize) -> Result<()> {
    let valid = 1..=Image::<u8>::MAX_SIDE;
    if valid.contains(&width) && valid.contains(&height) { Ok(()) } else { Err(ImagingError::Size { width, height }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_refuse_buffers_that_are_too_short() {
        let data = [0u8; 11];
        assert!(ImageView::new(&data, 3, 3, 4).is_ok());
        assert!(matches!(ImageView::new(&data, 4, 3, 4), Err(ImagingError::BufferLength { needed: 12, .. })));
        assert!(matches!(ImageView::new(&data, 3, 3, 2), Err(ImagingError::BufferLength { .. })));
        assert!(matches!(ImageView::new(&data, 0, 3, 2), Err(ImagingError::Size { .. })));
        assert!(matches!(ImageView::new(&data, 3, 3, usize::MAX), Err(ImagingError::BufferLength { .. })));
        assert!(matches!(Image::from_vec(vec![0u8; 5], 2, 3), Err(ImagingError::BufferLength { .. })));
    }

    #[test]
    fn crops_share_pixels_and_stay_inside() {
        let image = Image::from_fn(4, 3, |x, y| 10 * y + x).unwrap();
        let crop = image.view().crop(1, 1, 2, 2).unwrap();
        assert_eq!(crop.rows().flatten().copied().collect::<Vec<_>>(), [11, 12, 21, 22]);
        assert_eq!(crop.to_image().as_slice(), [11, 12, 21, 22]);
        assert!(image.view().crop(3, 0, 2, 1).is_none());
        assert!(image.view().crop(0, 0, usize::MAX, 1).is_none());
        assert_eq!(image.view().clamped(-5, 99), 20);
    }
}
