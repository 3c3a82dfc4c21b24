use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{ImageView, Rgb8};

/// A square of the picture as a grid of cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// Its left and top, pixels.
    origin: Point,
    /// The side of a cell, pixels.
    cell: f64,
    /// Cells a side.
    pub side: usize,
}

impl Grid {
    /// The square of `length` pixels around `center`, in cells of a pixel at least and `most` a side at most.
    pub fn around(center: Point, length: f64, most: usize) -> Self {
        let side = (length.ceil() as usize).clamp(3, most);
        Self { origin: Point::new(center.x - 0.5 * length, center.y - 0.5 * length), cell: length / side as f64, side }
    }

    /// The middle of a cell, in pixels of the picture.
    pub fn center(&self, column: usize, row: usize) -> Point {
        let at = |k: usize| (k as f64 + 0.5) * self.cell;
        Point::new(self.origin.x + at(column), self.origin.y + at(row))
    }

    /// A rectangle of cells as a box of the picture.
    pub fn bbox(&self, x: usize, y: usize, width: usize, height: usize) -> BBox {
        let at = |k: usize| k as f64 * self.cell;
        BBox::from_ltwh(self.origin.x + at(x), self.origin.y + at(y), at(width), at(height))
    }

    /// A length in cells.
    pub fn cells(&self, length: f64) -> f64 {
        length / self.cell
    }

    /// The cell of a point, which may be outside.
    pub fn cell_of(&self, point: Point) -> (f64, f64) {
        ((point.x - self.origin.x) / self.cell, (point.y - self.origin.y) / self.cell)
    }

    /// Every cell in order of rows, with its middle.
    pub fn cells_with_centers(&self) -> impl Iterator<Item = Point> + '_ {
        (0..self.side).flat_map(move |row| (0..self.side).map(move |column| self.center(column, row)))
    }
}

/// The pixel at a point, that of the border beyond it.
pub(super) fn gray_at(image: ImageView<'_, u8>, at: Point) -> u8 {
    image.clamped(at.x.floor() as isize, at.y.floor() as isize)
}

/// The same of a colour image.
pub(super) fn color_at(image: ImageView<'_, Rgb8>, at: Point) -> Rgb8 {
    image.clamped(at.x.floor() as isize, at.y.floor() as isize)
}
