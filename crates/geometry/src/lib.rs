//! Points, boxes, polygons, masks, overlap and transforms.
//!
//! This crate is the only place that knows pixel conventions: coordinates are **continuous pixels**, x to the right and
//! y down, and the pixel in row `i`, column `j` covers `[j, j + 1) × [i, i + 1)`; its centre is `(j + 0.5, i + 0.5)`.
//! One-based or inclusive conventions of data sets are converted in their readers and nowhere else.
//!
//! ```
//! use pursuit_geometry::{BBox, Point, Similarity};
//!
//! let truth = BBox::from_ltwh(100.0, 50.0, 40.0, 20.0);
//! let estimate = BBox::from_center_size(Point::new(125.0, 60.0), 40.0, 20.0);
//! assert_eq!(truth.center(), Point::new(120.0, 60.0));
//! assert_eq!(truth.iou(&estimate), 35.0 * 20.0 / (45.0 * 20.0));
//!
//! // The camera moved: what was 10 px further left is now here.
//! let now_from_before = Similarity::new(1.0, Point::new(10.0, 0.0)).ok_or("a scale above zero")?;
//! assert_eq!(now_from_before.apply_box(&truth).left(), 110.0);
//! # Ok::<(), &str>(())
//! ```

mod bbox;
pub mod camera;
mod mask;
mod polygon;
mod transform;
mod truth;

pub use bbox::BBox;
pub use mask::{CocoMask, Mask, MaskError, Span};
pub use polygon::Polygon;
pub use transform::Similarity;
pub use truth::Truth;

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
