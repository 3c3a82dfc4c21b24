use pursuit_geometry::{BBox, Point, Size};
use pursuit_vision::sampling::Window;
use serde::{Deserialize, Serialize};

/// The fewest cells along a side of the grid.
const FEWEST_CELLS: usize = 6;
/// The shorter side of the window is at least this share of the longer one, so that thin targets have surroundings.
const THINNEST: f64 = 0.3;
/// Smallest and largest size of the target relative to its size at the start.
const SCALES: std::ops::RangeInclusive<f64> = 0.1..=12.0;

/// How the target, the window searched and the patch sampled from it hang together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Template {
    width_px: f64,
    height_px: f64,
    step: f64,
    patch: Size,
}

impl Template {
    /// For a target that starts as large as `bbox`: a window `1 + padding` times as large, sampled to whole cells of
    /// `cell_px` such that the patch has about `area_px.clamp(smallest, largest)` pixels.
    pub fn new(bbox: &BBox, padding: f64, cell_px: usize, smallest_px: f64, largest_px: f64) -> Self {
        let (width_px, height_px) = (bbox.width(), bbox.height());
        let (width, height) = (width_px.max(THINNEST * height_px), height_px.max(THINNEST * width_px));
        let (width, height) = (width * (1.0 + padding), height * (1.0 + padding));
        let area = (width * height).clamp(smallest_px, largest_px);
        let step = (width * height / area).sqrt();
        let side = |window: f64| good_length((window / step / cell_px as f64).round() as usize) * cell_px;
        Self { width_px, height_px, step, patch: Size::new(side(width), side(height)) }
    }

    /// For a target that starts as large as `bbox`: a square window whose side is `search` times that of the square of
    /// equal area, sampled to `cells` × `cells` cells of `cell_px`.
    pub fn square(bbox: &BBox, search: f64, cell_px: usize, cells: usize) -> Self {
        let side = cells.max(FEWEST_CELLS) * cell_px;
        let step = search * bbox.area().sqrt() / side as f64;
        Self { width_px: bbox.width(), height_px: bbox.height(), step, patch: Size::new(side, side) }
    }

    /// Size of the patch in pixels.
    pub const fn patch(&self) -> Size {
        self.patch
    }

    /// Size of the target in patch pixels.
    pub fn target_in_patch(&self) -> (f64, f64) {
        (self.width_px / self.step, self.height_px / self.step)
    }

    /// Frame pixels per patch pixel when the target has `scale` times its first size.
    pub fn step(&self, scale: f64) -> f64 {
        self.step * scale
    }

    /// The window about `center` at `scale`.
    pub fn window(&self, center: Point, scale: f64) -> Window {
        Window::new(center, self.step(scale), self.patch)
    }

    /// The box of the target at `center` and `scale`.
    pub fn bbox(&self, center: Point, scale: f64) -> BBox {
        BBox::from_center_size(center, self.width_px * scale, self.height_px * scale)
    }

    /// How many times larger than at the start a box is, kept between sensible bounds.
    pub fn scale_of(&self, bbox: &BBox) -> f64 {
        let scale = (bbox.area() / (self.width_px * self.height_px)).sqrt();
        if scale.is_finite() { scale.clamp(*SCALES.start(), *SCALES.end()) } else { 1.0 }
    }

    /// Whether it could have come from [`new`](Self::new), for states read from outside.
    pub fn is_sensible(&self) -> bool {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        positive(self.width_px)
            && positive(self.height_px)
            && positive(self.step)
            && (1..=4096).contains(&self.patch.width)
            && (1..=4096).contains(&self.patch.height)
    }
}

/// The even number of the form 2ᵃ3ᵇ5ᶜ nearest to `cells`, at least [`FEWEST_CELLS`].
fn good_length(cells: usize) -> usize {
    let is_good = |n: &usize| {
        let mut rest = *n;
        for prime in [2, 3, 5] {
            while rest.is_multiple_of(prime) {
                rest /= prime;
            }
        }
        rest == 1 && n.is_multiple_of(2)
    };
    let cells = cells.clamp(FEWEST_CELLS, 2048);
    (FEWEST_CELLS..=cells * 2).filter(is_good).min_by_key(|n| n.abs_diff(cells)).unwrap_or(FEWEST_CELLS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_whole_cells_of_good_length_and_bounded_area() {
        for (w, h) in [(31.0, 45.0), (4.0, 4.0), (3.0, 200.0), (400.0, 300.0), (64.0, 64.0)] {
            let bbox = BBox::from_ltwh(10.0, 20.0, w, h);
            let template = Template::new(&bbox, 1.5, 4, 2500.0, 10_000.0);
            let patch = template.patch();
            assert!((1600..=14_000).contains(&patch.area()), "{w}x{h}: {patch}");
            for side in [patch.width, patch.height] {
                assert_eq!(side % 8, 0);
                assert!([6, 8, 10, 12, 16, 18, 20, 24, 30, 32, 36, 40, 48].contains(&(side / 4)), "{w}x{h}: {patch}");
            }
            assert_eq!(template.bbox(bbox.center(), 1.0), bbox);
            assert!((template.scale_of(&bbox.scaled(1.7)) - 1.7).abs() < 1e-12);
            let region = template.window(bbox.center(), 1.0).region();
            assert!(region.width() >= 1.9 * w && region.height() >= 1.9 * h, "{region:?}");
        }
    }
}
