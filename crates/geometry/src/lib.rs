//! Points, boxes, polygons, overlap and transforms.
//!
//! This crate is the only place that knows pixel conventions: coordinates are **continuous pixels**, x to the right and
//! y down, and the pixel in row `i`, column `j` covers `[j, j + 1) × [i, i + 1)`; its centre is `(j + 0.5, i + 0.5)`.
//! One-based or inclusive conventions of data sets are converted in their readers and nowhere else.

mod bbox;
mod polygon;
mod transform;

pub use bbox::BBox;
pub use polygon::Polygon;
pub use transform::Similarity;

use serde::{Deserialize, Serialize};

/// A point in continuous pixels, x right and y down.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Point {
    /// Horizontal coordinate, pixels to the right of the image's left edge.
    pub x: f64,
    /// Vertical coordinate, pixels below the image's top edge.
    pub y: f64,
}

impl Point {
    /// The point `(x, y)`.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Euclidean distance to `other`, in pixels.
    pub fn distance(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// Width and height of an image or patch, in whole pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Size {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Size {
    /// A size of `width` columns and `height` rows.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// The number of pixels.
    pub const fn area(self) -> usize {
        self.width * self.height
    }

    /// The box that covers the whole image.
    pub fn bounds(self) -> BBox {
        BBox::from_ltwh(0.0, 0.0, self.width as f64, self.height as f64)
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}
