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

    /// The number of cells inside.
    pub const fn area(&self) -> usize {
        self.right.saturating_sub(self.left) * self.bottom.saturating_sub(self.top)
    }
}
