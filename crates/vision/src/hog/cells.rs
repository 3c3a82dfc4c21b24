use super::SIGNED;
use multiversion::multiversion;
use pursuit_geometry::Size;

/// A cell's histogram, padded so that an orientation masked to its range never misses and vectors fit.
pub(super) type Histogram = [f32; STRIDE];
pub(super) const STRIDE: usize = 32;

/// The orientation histograms of all cells, filled row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct CellHistograms {
    grid: Size,
    cell_px: usize,
    histograms: Vec<Histogram>,
    /// Votes of one row of pixels; one cell more on either side than the grid.
    row: Vec<Histogram>,
    /// For each column of pixels: the cell to the left of or at it (shifted by 1, as in `row`) and the share of the next.
    columns: Vec<(u32, f32)>,
}

impl CellHistograms {
    /// Empties the histograms of `grid` cells.
    pub(super) fn start(&mut self, cell_px: usize, grid: Size) {
        if self.cell_px != cell_px || self.grid.width != grid.width {
            self.row.resize(grid.width + 2, [0.0; STRIDE]);
            self.columns.clear();
            self.columns.extend((0..grid.width * cell_px).map(|x| {
                let (cell, share) = split(x, cell_px);
                (cell as u32, share)
            }));
        }
        (self.cell_px, self.grid) = (cell_px, grid);
        self.histograms.resize(grid.area(), [0.0; STRIDE]);
        self.histograms.fill([0.0; STRIDE]);
    }

    /// Lets the pixels of row `y` vote, bilinearly among the nearest cells.
    pub(super) fn add_row(&mut self, y: usize, magnitude: &[f32], orientation: &[u32]) {
        self.row.fill([0.0; STRIDE]);
        for ((&(cell, share), &magnitude), &bin) in self.columns.iter().zip(magnitude).zip(orientation) {
            let [first, second] = &mut self.row[cell as usize..][..2] else { unreachable!("two cells were taken") };
            let bin = bin as usize % STRIDE;
            let next = magnitude * share;
            first[bin] += magnitude - next;
            second[bin] += next;
        }
        let (cell, share) = split(y, self.cell_px);
        let Size { width, height } = self.grid;
        // `cell` counts from 1 for the first row of cells; votes for cells outside are dropped.
        for (cell, weight) in [(cell, 1.0 - share), (cell + 1, share)] {
            if (1..=height).contains(&cell) && weight > 0.0 {
                let line = &mut self.histograms[(cell - 1) * width..cell * width];
                add_scaled(&self.row[1..=width], weight, line);
            }
        }
    }

    /// All histograms, row by row; the first 18 entries of each count.
    pub(super) fn histograms(&self) -> &[Histogram] {
        &self.histograms
    }
}

/// The cell whose centre is at or before pixel `x`, counted from 1 (0 = the one before the grid), and the weight of the
/// next cell.
fn split(x: usize, cell_px: usize) -> (usize, f32) {
    let position = (x as f32 + 0.5) / cell_px as f32 + 0.5;
    (position as usize, position.fract())
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_scaled(row: &[Histogram], weight: f32, out: &mut [Histogram]) {
    // 24 is the first multiple of a vector's length that holds all orientations.
    const USED: usize = 24;
    const { assert!(USED >= SIGNED && USED <= STRIDE) };
    for (out, row) in out.iter_mut().zip(row) {
        for o in 0..USED {
            out[o] += weight * row[o];
        }
    }
}
