//! Subwindow sampling: a window of a frame, at any sub-pixel position and scale, resampled to a patch of fixed size.

mod axis;
mod planes;
mod sampler;

pub use planes::Planes;
pub use sampler::Sampler;

use pursuit_geometry::{BBox, Point, Size};
use serde::{Deserialize, Serialize};

/// Where a patch is taken from: patch pixel (row i, column j) is centred at `center + R ((j + ½ − width/2) · step_x,
/// (i + ½ − height/2) · step_y)` of the frame, R the rotation by `angle_rad` (clockwise on the screen, x towards y).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Centre of the patch in the frame, pixels.
    pub center: Point,
    /// Frame pixels per patch pixel along x, > 0; above 1 the window is shrunk.
    pub step_x: f64,
    /// Frame pixels per patch pixel along y, > 0.
    pub step_y: f64,
    /// How far the window is turned, radians.
    pub angle_rad: f64,
    /// Size of the patch in patch pixels.
    pub patch: Size,
}

impl Window {
    /// A window with the same step both ways.
    pub const fn new(center: Point, step: f64, patch: Size) -> Self {
        Self { center, step_x: step, step_y: step, angle_rad: 0.0, patch }
    }

    /// The window that maps `region` of the frame onto `patch`.
    pub fn of_region(region: BBox, patch: Size) -> Self {
        Self {
            center: region.center(),
            step_x: region.width() / patch.width.max(1) as f64,
            step_y: region.height() / patch.height.max(1) as f64,
            angle_rad: 0.0,
            patch,
        }
    }

    /// The same window turned to `angle_rad`.
    #[must_use]
    pub const fn turned(self, angle_rad: f64) -> Self {
        Self { angle_rad, ..self }
    }

    /// The part of the frame it covers, before it is turned; may reach over the border.
    pub fn region(&self) -> BBox {
        let (width, height) = (self.patch.width as f64, self.patch.height as f64);
        BBox::from_center_size(self.center, width * self.step_x, height * self.step_y)
    }
}
