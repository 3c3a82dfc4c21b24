use crate::{Image, Rgb8, SharedImage, Yuv420};
use pursuit_geometry::Size;

/// Pixels as a source delivered them; clones share them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pixels {
    /// 8-bit grey.
    Gray8(SharedImage<u8>),
    /// 16-bit grey: thermal cameras, scientific images.
    Gray16(SharedImage<u16>),
    /// 8-bit colour.
    Rgb8(SharedImage<Rgb8>),
    /// Planar colour straight from a video decoder; converted only if somebody asks for colour.
    Yuv420(Yuv420),
}

impl Pixels {
    /// Width and height.
    pub const fn size(&self) -> Size {
        match self {
            Self::Gray8(image) => image.size(),
            Self::Gray16(image) => image.size(),
            Self::Rgb8(image) => image.size(),
            Self::Yuv420(image) => image.size(),
        }
    }

    /// The part of `width` × `height` pixels whose top left pixel is `(x, y)`, sharing the pixels; `None` unless it lies
    /// inside and, where colour belongs to pairs of pixels, `x` and `y` are even.
    #[must_use]
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        Some(match self {
            Self::Gray8(image) => Self::Gray8(image.crop(x, y, width, height)?),
            Self::Gray16(image) => Self::Gray16(image.crop(x, y, width, height)?),
            Self::Rgb8(image) => Self::Rgb8(image.crop(x, y, width, height)?),
            Self::Yuv420(image) => Self::Yuv420(image.crop(x, y, width, height)?),
        })
    }

    /// Bytes of all pixels, without gaps between rows.
    pub(crate) fn bytes(&self) -> usize {
        let area = self.size().area();
        match self {
            Self::Gray8(_) => area,
            Self::Gray16(_) => 2 * area,
            Self::Rgb8(_) => 3 * area,
            Self::Yuv420(image) => area + 2 * image.chroma().0.size().area(),
        }
    }
}

impl From<SharedImage<u8>> for Pixels {
    fn from(image: SharedImage<u8>) -> Self {
        Self::Gray8(image)
    }
}

impl From<SharedImage<u16>> for Pixels {
    fn from(image: SharedImage<u16>) -> Self {
        Self::Gray16(image)
    }
}

impl From<SharedImage<Rgb8>> for Pixels {
    fn from(image: SharedImage<Rgb8>) -> Self {
        Self::Rgb8(image)
    }
}

impl From<Image<u8>> for Pixels {
    fn from(image: Image<u8>) -> Self {
        Self::Gray8(image.into())
    }
}

impl From<Image<u16>> for Pixels {
    fn from(image: Image<u16>) -> Self {
        Self::Gray16(image.into())
    }
}

impl From<Image<Rgb8>> for Pixels {
    fn from(image: Image<Rgb8>) -> Self {
        Self::Rgb8(image.into())
    }
}

impl From<Yuv420> for Pixels {
    fn from(image: Yuv420) -> Self {
        Self::Yuv420(image)
    }
}
