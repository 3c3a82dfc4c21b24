//! Histograms of oriented gradients on a grid of square cells: the 31 channels of Felzenszwalb et al. (2010) and the
//! 36 of Dalal & Triggs (2005).
//!
//! Felzenszwalb, Girshick, McAllester, Ramanan: "Object detection with discriminatively trained part-based models",
//! TPAMI 2010, section 6. Dalal, Triggs: "Histograms of oriented gradients for human detection", CVPR 2005, section 6.

mod cells;
mod gradient;
mod normalize;
#[cfg(test)]
mod reference;

use crate::sampling::Planes;
use cells::CellHistograms;
use normalize::Norms;
use pursuit_geometry::Size;

/// Signed orientations, 20° apart.
const SIGNED: usize = 18;
/// Unsigned orientations, 20° apart.
const UNSIGNED: usize = 9;

/// Which channels are made of the cells' histograms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HogLayout {
    /// 18 signed and 9 unsigned orientations and 4 texture energies, each normalised by the four blocks around a cell and
    /// averaged (felzenszwalb2010, section 6.2).
    #[default]
    Felzenszwalb31,
    /// 9 unsigned orientations normalised by each of the four blocks around a cell (dalal2005, L2-Hys).
    Dalal36,
}

impl HogLayout {
    /// The number of channels.
    pub const fn channels(self) -> usize {
        match self {
            Self::Felzenszwalb31 => SIGNED + UNSIGNED + 4,
            Self::Dalal36 => 4 * UNSIGNED,
        }
    }
}

/// Computes HOG features; owns its scratch, so that nothing is allocated for patches that are not larger than before.
///
/// Gradients are central differences (one-sided at the patch's border); of colour, the channel with the largest gradient
/// counts. A pixel votes with its gradient's length for the nearest orientation in the four nearest cells. Histograms are
/// normalised by the energy of 2×2 blocks of cells, clipped at 0.2; at the grid's border the outermost block is repeated.
#[derive(Debug, Clone)]
pub struct Hog {
    layout: HogLayout,
    cell_px: usize,
    /// Gradient length and orientation of the pixels of two rows.
    rows: [(Vec<f32>, Vec<u32>); 2],
    cells: CellHistograms,
    norms: Norms,
}

impl Hog {
    /// Cells of `cell_px` × `cell_px` pixels; 0 counts as 1.
    pub fn new(layout: HogLayout, cell_px: usize) -> Self {
        Self {
            layout,
            cell_px: cell_px.max(1),
            rows: Default::default(),
            cells: CellHistograms::default(),
            norms: Norms::default(),
        }
    }

    /// The number of channels made.
    pub const fn channels(&self) -> usize {
        self.layout.channels()
    }

    /// Side of a cell in pixels.
    pub const fn cell_px(&self) -> usize {
        self.cell_px
    }

    /// The grid of cells of a patch: whole cells only.
    pub const fn grid(&self, patch: Size) -> Size {
        Size::new(patch.width / self.cell_px, patch.height / self.cell_px)
    }

    /// Features of a grey (1 plane) or colour (3 planes) patch with values 0–255; `out` becomes
    /// [`channels`](Self::channels) planes of the size of [`grid`](Self::grid).
    ///
    /// Channel order: signed orientations from 0° in steps of 20°, then unsigned ones, then texture (top left, top right,
    /// bottom left, bottom right block).
    pub fn extract(&mut self, patch: &Planes, out: &mut Planes) {
        let Size { width, height } = patch.size();
        let grid = self.grid(patch.size());
        out.reshape(grid, self.channels());
        if grid.area() == 0 {
            return;
        }
        for (magnitude, orientation) in &mut self.rows {
            magnitude.resize(width, 0.0);
            orientation.resize(width, 0);
        }
        self.cells.start(self.cell_px, grid);
        let row = |c: usize, y: usize| &patch.plane(c)[y * width..(y + 1) * width];
        let end = grid.height * self.cell_px;
        for top in (0..end).step_by(2) {
            let count = (end - top).min(2);
            for (y, (magnitude, orientation)) in (top..end).zip(&mut self.rows) {
                let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
                let rows = |c: usize| [row(c, above), row(c, y), row(c, below)];
                if patch.channels() >= 3 {
                    gradient::color([rows(0), rows(1), rows(2)], magnitude, orientation);
                } else {
                    gradient::gray(rows(0), magnitude, orientation);
                }
            }
            self.cells.add_rows(top, &self.rows[..count]);
        }
        let cells = self.cells.planes();
        self.norms.compute(cells, grid);
        match self.layout {
            HogLayout::Felzenszwalb31 => normalize::felzenszwalb(cells, &self.norms, out),
            HogLayout::Dalal36 => normalize::dalal(cells, &self.norms, out),
        }
    }
}
