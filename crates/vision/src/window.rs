use pursuit_geometry::{BBox, Size};

/// A rectangle of whole pixels inside an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PixelWindow {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns, ≥ 1.
    pub width: usize,
    /// Rows, ≥ 1.
    pub height: usize,
}

impl PixelWindow {
    /// The whole image.
    pub const fn full(size: Size) -> Self {
        Self { x: 0, y: 0, width: size.width, height: size.height }
    }

    /// The pixels of an image of the given size that `bbox` touches; `None` when there are none.
    pub fn of(bbox: &BBox, size: Size) -> Option<Self> {
        let inside = bbox.clipped_to(size)?;
        let (x, y) = (inside.left().floor() as usize, inside.top().floor() as usize);
        let right = (inside.right().ceil() as usize).min(size.width);
        let bottom = (inside.bottom().ceil() as usize).min(size.height);
        (right > x && bottom > y).then_some(Self { x, y, width: right - x, height: bottom - y })
    }

    /// Columns and rows.
    pub const fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// As a box in continuous pixels.
    pub fn to_bbox(&self) -> BBox {
        BBox::from_ltwh(self.x as f64, self.y as f64, self.width as f64, self.height as f64)
    }

    /// The common part of both, `None` when they do not meet.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let right = (self.x + self.width).min(other.x + other.width);
        let bottom = (self.y + self.height).min(other.y + other.height);
        (right > x && bottom > y).then(|| Self { x, y, width: right - x, height: bottom - y })
    }
}
