use super::peaks::Peaks;
use crate::correlation::Features;
use crate::regularised::AppearanceFeatures;
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use pursuit_vision::fourier::{HannEnds, hann_plane};
use pursuit_vision::sampling::{Planes, Window};

/// Not state: made of the settings, overwritten at every use.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    pub features: AppearanceFeatures,
    hann: Vec<f32>,
    /// Features as they are.
    pub plain: Planes,
    /// Features under the Hann window.
    pub windowed: Planes,
    pub response: Vec<f32>,
    pub peaks: Peaks,
}

impl Scratch {
    pub fn new(cell_px: usize, color: bool, patch: Size) -> Self {
        let features = AppearanceFeatures::new(cell_px, color);
        let grid = features.grid(patch);
        Self {
            hann: hann_plane(grid.width, grid.height, HannEnds::Zero),
            plain: Planes::new(grid, features.channels()),
            windowed: Planes::new(grid, features.channels()),
            response: vec![0.0; grid.area()],
            peaks: Peaks::default(),
            features,
        }
    }

    pub fn grid(&self) -> Size {
        self.plain.size()
    }

    pub fn channels(&self) -> usize {
        self.features.channels()
    }

    /// Features of the window.
    pub fn extract(&mut self, frame: &Frame, window: &Window) {
        self.features.extract(frame, window, &mut self.plain);
        for (plain, windowed) in self.plain.planes().zip(self.windowed.planes_mut()) {
            for ((out, v), h) in windowed.iter_mut().zip(plain).zip(&self.hann) {
                *out = v * h;
            }
        }
    }
}
