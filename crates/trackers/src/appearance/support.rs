use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};

/// The cells `[left, right) × [top, bottom)` of a grid that are the target's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Support {
    /// First column inside.
    pub left: usize,
    /// First column outside again.
    pub right: usize,
    /// First row inside.
    pub top: usize,
    /// First row outside again.
    pub bottom: usize,
}

impl Support {
    /// The `target` cells (width, height) in the middle of `grid`: rounded, at least three each way where the grid has
    /// them, leaving as many cells on either side.
    pub fn middle(target: (f64, f64), grid: Size) -> Self {
        let side = |cells: f64, n: usize| {
            let most = n.saturating_sub(2).max(1);
            let cells = (cells.round() as usize).clamp(3.min(most), most);
            let margin = (n - cells) / 2;
            (margin, n - margin)
        };
        let ((left, right), (top, bottom)) = (side(target.0, grid.width), side(target.1, grid.height));
        Self { left, right, top, bottom }
    }

    /// The smallest that holds the cells that are 1 of a plane of `grid`; `None` where it is another plane, or none of its cells is.
    pub fn of(cells: &[f32], grid: Size) -> Option<Self> {
        let set =
            cells.iter().enumerate().filter(|(_, cell)| **cell > 0.0).map(|(k, _)| (k % grid.width, k / grid.width));
        let grow = |of: Option<Self>, (x, y): (usize, usize)| {
            let Self { left, right, top, bottom } = of.unwrap_or(Self { left: x, right: x + 1, top: y, bottom: y + 1 });
            Some(Self { left: left.min(x), right: right.max(x + 1), top: top.min(y), bottom: bottom.max(y + 1) })
        };
        if cells.len() == grid.area() { set.fold(None, grow) } else { None }
    }

    /// The number of cells inside.
    pub const fn area(&self) -> usize {
        self.right.saturating_sub(self.left) * self.bottom.saturating_sub(self.top)
    }

    /// A plane of `grid` with 1 inside and 0 outside.
    pub fn cells(&self, grid: Size) -> Vec<f32> {
        let inside = |x: usize, y: usize| (self.left..self.right).contains(&x) && (self.top..self.bottom).contains(&y);
        (0..grid.area()).map(|k| if inside(k % grid.width, k / grid.width) { 1.0 } else { 0.0 }).collect()
    }
}
