use super::SIGNED;
use multiversion::multiversion;
use pursuit_geometry::Size;

/// The orientation histograms of all cells, filled row by row: 18 planes, one for each orientation.
#[derive(Debug, Clone, Default)]
pub(super) struct CellHistograms {
    grid: Size,
    cell_px: usize,
    planes: Vec<f32>,
    /// Votes of two rows of pixels: for each a line for each orientation, one cell more on either side than the grid.
    votes: [Vec<f32>; 2],
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
        self.votes.iter_mut().for_each(|v| v.resize(SIGNED * (grid.width + 2), 0.0));
        self.planes.resize(SIGNED * grid.area(), 0.0);
        self.planes.fill(0.0);
    }

    /// Lets the pixels of the rows from `y` on, one or two, vote, bilinearly among the nearest cells: gradient length and
    /// orientation of each pixel.
    pub(super) fn add_rows(&mut self, y: usize, rows: &[(Vec<f32>, Vec<u32>)]) {
        match rows {
            [first, second] => {
                // A vote must wait for the last one of the same cell and orientation; two rows wait by turns.
                let [votes, more_votes] = &mut self.votes;
                votes.fill(0.0);
                more_votes.fill(0.0);
                let both = first.0.iter().zip(&first.1).zip(second.0.iter().zip(&second.1));
                for (&column, (pixel, other)) in self.columns.iter().zip(both) {
                    vote(votes, self.grid.width, column, pixel);
                    vote(more_votes, self.grid.width, column, other);
                }
            }
            rows => {
                for ((magnitude, orientation), votes) in rows.iter().zip(&mut self.votes) {
                    votes.fill(0.0);
                    for (&column, pixel) in self.columns.iter().zip(magnitude.iter().zip(orientation)) {
                        vote(votes, self.grid.width, column, pixel);
                    }
                }
            }
        }
        self.collect(y, rows.len());
    }

    /// Adds the votes of `count` rows of pixels to the rows of cells above and below them.
    fn collect(&mut self, y: usize, count: usize) {
        let Self { grid, cell_px, planes, votes: [votes, more_votes], .. } = self;
        let (cell, share) = split(y, *cell_px);
        let (next_cell, next_share) = split(y + 1, *cell_px);
        // Cells count from 1 for the first row of cells; votes for cells outside are dropped.
        let inside = |cell: &(usize, f32, f32)| (1..=grid.height).contains(&cell.0);
        if count == 2 && cell == next_cell {
            let below = (cell + 1, share, next_share);
            for (cell, a, b) in [(cell, 1.0 - share, 1.0 - next_share), below].into_iter().filter(inside) {
                add_scaled_pair([votes, more_votes], [a, b], planes, *grid, cell - 1);
            }
            return;
        }
        for (votes, (cell, share)) in
            [(&*votes, (cell, share)), (more_votes, (next_cell, next_share))].into_iter().take(count)
        {
            for (cell, weight, _) in [(cell, 1.0 - share, 0.0), (cell + 1, share, 0.0)].into_iter().filter(inside) {
                add_scaled(votes, weight, planes, *grid, cell - 1);
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

/// A pixel's vote for the two cells beside it.
#[inline(always)]
fn vote(votes: &mut [f32], width: usize, (cell, share): (u32, f32), (&magnitude, &bin): (&f32, &u32)) {
    let at = bin as usize * (width + 2) + cell as usize;
    let [first, second] = &mut votes[at..at + 2] else { unreachable!("two cells were taken") };
    let next = magnitude * share;
    *first += magnitude - next;
    *second += next;
}

/// Adds weighted votes of two rows of pixels to row `row` of every plane.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_scaled_pair(votes: [&[f32]; 2], weights: [f32; 2], planes: &mut [f32], grid: Size, row: usize) {
    let Size { width, .. } = grid;
    let lines = votes[0].chunks_exact(width + 2).zip(votes[1].chunks_exact(width + 2));
    for (plane, (a, b)) in planes.chunks_exact_mut(grid.area()).zip(lines) {
        let (line, a, b) = (&mut plane[row * width..(row + 1) * width], &a[1..=width], &b[1..=width]);
        for ((sum, a), b) in line.iter_mut().zip(a).zip(b) {
            *sum = *sum + weights[0] * a + weights[1] * b;
        }
    }
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
