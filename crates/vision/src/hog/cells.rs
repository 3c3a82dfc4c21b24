use super::SIGNED;
use multiversion::multiversion;
use pursuit_geometry::Size;

/// The orientation histograms of all cells, filled row by row: 18 planes, one for each orientation.
#[derive(Debug, Clone, Default)]
pub(super) struct CellHistograms {
    grid: Size,
    cell_px: usize,
    planes: Vec<f32>,
    /// Votes of one row of pixels: a line for each orientation, one cell more on either side than the grid.
    votes: Vec<f32>,
    /// For each column of pixels: the cell to the left of or at it (shifted by 1, as in `votes`) and the share of the next.
    columns: Vec<(u32, f32)>,
}

impl CellHistograms {
    /// Empties the histograms of `grid` cells.
    pub(super) fn start(&mut self, cell_px: usize, grid: Size) {
        if self.cell_px != cell_px || self.grid.width != grid.width {
            self.columns.clear();
            self.columns.extend((0..grid.width * cell_px).map(|x| {
                let (cell, share) = split(x, cell_px);
                (cell as u32, share)
            }));
        }
        (self.cell_px, self.grid) = (cell_px, grid);
        self.votes.resize(SIGNED * (grid.width + 2), 0.0);
        self.planes.resize(SIGNED * grid.area(), 0.0);
        self.planes.fill(0.0);
    }

    /// Lets the pixels of row `y` vote, bilinearly among the nearest cells.
    pub(super) fn add_row(&mut self, y: usize, magnitude: &[f32], orientation: &[u32]) {
        let Size { width, height } = self.grid;
        self.votes.fill(0.0);
        for ((&(cell, share), &magnitude), &bin) in self.columns.iter().zip(magnitude).zip(orientation) {
            let at = bin as usize * (width + 2) + cell as usize;
            let [first, second] = &mut self.votes[at..at + 2] else { unreachable!("two cells were taken") };
            let next = magnitude * share;
            *first += magnitude - next;
            *second += next;
        }
        let (cell, share) = split(y, self.cell_px);
        // `cell` counts from 1 for the first row of cells; votes for cells outside are dropped.
        for (cell, weight) in [(cell, 1.0 - share), (cell + 1, share)] {
            if (1..=height).contains(&cell) && weight > 0.0 {
                add_scaled(&self.votes, weight, &mut self.planes, self.grid, cell - 1);
            }
        }
    }

    /// The histograms: 18 planes of the grid's size.
    pub(super) fn planes(&self) -> &[f32] {
        &self.planes
    }
}

/// The cell whose centre is at or before pixel `x`, counted from 1 (0 = the one before the grid), and the weight of the
/// next cell.
fn split(x: usize, cell_px: usize) -> (usize, f32) {
    let position = (x as f32 + 0.5) / cell_px as f32 + 0.5;
    (position as usize, position.fract())
}

/// Adds weighted votes to row `row` of every plane.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_scaled(votes: &[f32], weight: f32, planes: &mut [f32], grid: Size, row: usize) {
    let Size { width, .. } = grid;
    for (plane, votes) in planes.chunks_exact_mut(grid.area()).zip(votes.chunks_exact(width + 2)) {
        for (sum, vote) in plane[row * width..(row + 1) * width].iter_mut().zip(&votes[1..=width]) {
            *sum += weight * vote;
        }
    }
}
