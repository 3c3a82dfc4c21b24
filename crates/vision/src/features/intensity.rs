use crate::sampling::Planes;

/// Histograms of intensity over square cells: how often each brightness occurs, shared linearly between the two nearest
/// bins; insensitive to the order of pixels within the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntensityHistogram {
    /// Bins over 0–255, at least 2; bin centres are `0, 255/(bins − 1), …, 255`.
    pub bins: usize,
    /// Side of a cell in pixels.
    pub cell_px: usize,
}

impl IntensityHistogram {
    /// Frequencies (summing to 1 in each cell) of plane 0 of `patch` (0–255): one channel for each bin, written to the
    /// planes `first..first + bins` of `out`, which must have the grid's size.
    pub fn extract(&self, patch: &Planes, out: &mut Planes, first: usize) {
        let (width, grid) = (patch.size().width, out.size());
        let (values, area) = (patch.plane(0), grid.area());
        let last = self.bins.max(2) - 1;
        let (per_code, share) = (last as f32 / 255.0, 1.0 / (self.cell_px * self.cell_px) as f32);
        let planes = &mut out.as_mut_slice()[first * area..(first + self.bins.max(2)) * area];
        planes.fill(0.0);
        for y in 0..grid.height * self.cell_px {
            for x in 0..grid.width * self.cell_px {
                let position = values[y * width + x].clamp(0.0, 255.0) * per_code;
                let bin = (position as usize).min(last - 1);
                let next = (position - bin as f32) * share;
                let at = bin * area + y / self.cell_px * grid.width + x / self.cell_px;
                planes[at] += share - next;
                planes[at + area] += next;
            }
        }
    }
}

/// Mean of plane 0 of `patch` (0–255) over cells of `cell_px` pixels, as `mean / 255 − ½`, written to plane `to` of `out`,
/// which must have the grid's size.
pub fn cell_means(patch: &Planes, cell_px: usize, out: &mut Planes, to: usize) {
    let (width, grid) = (patch.size().width, out.size());
    let (values, means) = (patch.plane(0), out.plane_mut(to));
    let scale = 1.0 / (255.0 * (cell_px * cell_px) as f32);
    means.fill(0.0);
    for y in 0..grid.height * cell_px {
        let line = &values[y * width..][..grid.width * cell_px];
        let row = &mut means[y / cell_px * grid.width..][..grid.width];
        for (mean, cell) in row.iter_mut().zip(line.chunks_exact(cell_px)) {
            *mean += cell.iter().sum::<f32>();
        }
    }
    means.iter_mut().for_each(|v| *v = *v * scale - 0.5);
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::Size;

    #[test]
    fn cells_sum_to_one_over_own_pixels() {
        let mut patch = Planes::new(Size::new(5, 2), 1);
        patch.as_mut_slice().copy_from_slice(&[0.0, 0.0, 255.0, 127.5, 9.0, 255.0, 63.75, 255.0, 255.0, 9.0]);
        let mut out = Planes::new(Size::new(2, 1), 4);
        IntensityHistogram { bins: 3, cell_px: 2 }.extract(&patch, &mut out, 1);
        let cell = |x: usize| [1, 2, 3].map(|c| out.plane(c)[x]);
        assert_eq!(cell(0), [0.625, 0.125, 0.25]);
        assert_eq!(cell(1), [0.0, 0.25, 0.75]);
        cell_means(&patch, 2, &mut out, 0);
        assert!((out.plane(0)[0] - (318.75 / 4.0 / 255.0 - 0.5)).abs() < 1e-6);
        assert!((out.plane(0)[1] - (892.5 / 4.0 / 255.0 - 0.5)).abs() < 1e-6);
    }
}
