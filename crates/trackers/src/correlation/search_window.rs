use super::params::{WindowParams, WindowShape};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_vision::fourier::good_size;
use pursuit_vision::sampling::Window;
use serde::{Deserialize, Serialize};

/// The fewest cells along a side of the grid: a transform of fewer tells no direction.
const FEWEST_CELLS: usize = 6;
/// The most.
const MOST_CELLS: usize = 2048;
/// Longest side of a patch in pixels.
const LONGEST_SIDE: usize = 4096;

/// How the target, the window searched and the patch sampled from it hang together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(remote = "SearchWindow")]
pub struct SearchWindow {
    width_px: f64,
    height_px: f64,
    step: f64,
    patch: Size,
    scales: (f64, f64),
}

pursuit_estimation::checked!(SearchWindow);

impl SearchWindow {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { width_px, height_px, step, patch, scales } = self;
        let positive = [width_px, height_px, step, scales.0, scales.1].iter().all(|v| v.is_finite() && *v > 0.0);
        let sides = 1..=LONGEST_SIDE;
        let sound = positive && scales.0 <= scales.1 && sides.contains(&patch.width) && sides.contains(&patch.height);
        if sound { Ok(self) } else { Err("its search window has a size that cannot be") }
    }
}

impl SearchWindow {
    /// For a target that starts as large as `bbox`: a window `1 + padding` times as large, sampled to whole cells of
    /// `cell_px` such that the patch has about as many pixels as the window, within the bounds on its area.
    pub fn new(bbox: &BBox, params: &WindowParams, cell_px: usize) -> Self {
        let (width_px, height_px) = (bbox.width(), bbox.height());
        let grown = 1.0 + params.padding;
        let (width, height) = match params.shape {
            WindowShape::Proportional => {
                (grown * width_px.max(params.thinnest * height_px), grown * height_px.max(params.thinnest * width_px))
            }
            WindowShape::Square => (grown * bbox.area().sqrt(), grown * bbox.area().sqrt()),
            WindowShape::Margin => {
                let margins = params.padding * 0.5 * (width_px + height_px);
                (width_px + margins, height_px + margins)
            }
        };
        let area = (width * height).max(params.smallest_area_px).min(params.largest_area_px);
        let step = (width * height / area).sqrt();
        let side = |window: f64| {
            good_size(((window / step / cell_px as f64).round() as usize).clamp(FEWEST_CELLS, MOST_CELLS)) * cell_px
        };
        let patch = Size::new(side(width), side(height));
        let step = match params.shape {
            WindowShape::Proportional | WindowShape::Margin => step,
            // Here the window has whole cells, so that it is as large as asked for.
            WindowShape::Square => width / patch.width as f64,
        };
        Self { width_px, height_px, step, patch, scales: (params.smallest_scale, params.largest_scale) }
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
        self.within_bounds(scale)
    }

    /// `scale` kept between sensible bounds; 1 for what is no number.
    pub fn within_bounds(&self, scale: f64) -> f64 {
        let (smallest, largest) = self.scales;
        if scale.is_finite() { scale.max(smallest).min(largest) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_whole_cells_and_bounded_area() {
        for (w, h) in [(31.0, 45.0), (4.0, 4.0), (3.0, 200.0), (400.0, 300.0), (64.0, 64.0)] {
            let bbox = BBox::from_ltwh(10.0, 20.0, w, h);
            let params = WindowParams { largest_area_px: 10_000.0, ..WindowParams::default() };
            let window = SearchWindow::new(&bbox, &params, 4);
            let patch = window.patch();
            assert!((1600..=14_000).contains(&patch.area()), "{w}x{h}: {patch}");
            for side in [patch.width, patch.height] {
                assert_eq!(side % 8, 0);
                assert!([6, 8, 10, 12, 16, 18, 20, 24, 30, 32, 36, 40, 48].contains(&(side / 4)), "{w}x{h}: {patch}");
            }
            assert_eq!(window.bbox(bbox.center(), 1.0), bbox);
            assert!((window.scale_of(&bbox.scaled(1.7)) - 1.7).abs() < 1e-12);
            let region = window.window(bbox.center(), 1.0).region();
            assert!(region.width() >= 1.9 * w && region.height() >= 1.9 * h, "{region:?}");
        }
    }

    #[test]
    fn margins_are_the_same_on_all_sides() {
        let area = 22_500.0;
        let params = WindowParams {
            shape: WindowShape::Margin,
            padding: 1.0,
            smallest_area_px: area,
            largest_area_px: area,
            ..WindowParams::default()
        };
        // 20 + 50 by 80 + 50 pixels.
        let window = SearchWindow::new(&BBox::from_ltwh(10.0, 20.0, 20.0, 80.0), &params, 4);
        let step = (70.0_f64 * 130.0 / area).sqrt();
        assert!((window.step(1.0) - step).abs() < 1e-12);
        let region = window.window(Point::new(20.0, 60.0), 1.0).region();
        assert!(
            (region.width() / 70.0 - 1.0).abs() < 0.12 && (region.height() / 130.0 - 1.0).abs() < 0.12,
            "{region:?}"
        );
    }

    #[test]
    fn square_windows_are_as_large_as_asked_for() {
        let params = WindowParams {
            shape: WindowShape::Square,
            padding: 4.0,
            smallest_area_px: 25_600.0,
            largest_area_px: 25_600.0,
            ..WindowParams::default()
        };
        for (w, h) in [(20.0, 80.0), (3.0, 3.0), (400.0, 100.0)] {
            let window = SearchWindow::new(&BBox::from_ltwh(0.0, 0.0, w, h), &params, 4);
            assert_eq!(window.patch(), Size::new(160, 160));
            let region = window.window(Point::new(0.0, 0.0), 1.0).region();
            assert!((region.width() - 5.0 * (w * h).sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn impossible_states_are_refused() {
        let window = SearchWindow::new(&BBox::from_ltwh(0.0, 0.0, 20.0, 30.0), &WindowParams::default(), 4);
        let back = |w: &SearchWindow| postcard::from_bytes::<SearchWindow>(&postcard::to_stdvec(w).unwrap());
        assert_eq!(back(&window).unwrap(), window);
        assert!(back(&SearchWindow { step: 0.0, ..window }).is_err());
        assert!(back(&SearchWindow { width_px: f64::NAN, ..window }).is_err());
        assert!(back(&SearchWindow { patch: Size::new(5000, 8), ..window }).is_err());
        assert!(back(&SearchWindow { scales: (2.0, 1.0), ..window }).is_err());
    }

    #[test]
    fn scales_stay_within_their_bounds() {
        let bbox = BBox::from_ltwh(0.0, 0.0, 20.0, 30.0);
        let window = SearchWindow::new(&bbox, &WindowParams::default(), 4);
        assert_eq!(window.scale_of(&bbox.scaled(50.0)), 12.0);
        assert_eq!(window.scale_of(&bbox.scaled(0.01)), 0.1);
        assert_eq!(window.scale_of(&BBox::from_ltwh(0.0, 0.0, f64::NAN, 1.0)), 1.0);
        let (width, height) = window.target_in_patch();
        assert!((width * window.step(1.0) - 20.0).abs() < 1e-9 && (height * window.step(2.0) - 60.0).abs() < 1e-9);
    }
}
