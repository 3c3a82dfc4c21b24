use super::Features;
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use pursuit_vision::features::{ColorTable, cell_means};
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};

/// 31 channels of oriented gradients, one of grey, and, of colour frames, eleven of colour names.
#[derive(Debug, Clone)]
pub struct AppearanceFeatures {
    sampler: Sampler,
    hog: Hog,
    names: Option<ColorTable>,
    patch: Planes,
    gradients: Planes,
}

impl AppearanceFeatures {
    /// Cells of `cell_px` pixels; colour names only with `color`.
    pub fn new(cell_px: usize, color: bool) -> Self {
        Self {
            sampler: Sampler::new(),
            hog: Hog::new(HogLayout::Felzenszwalb31, cell_px),
            names: color.then(ColorTable::color_names),
            patch: Planes::default(),
            gradients: Planes::default(),
        }
    }
}

impl Features for AppearanceFeatures {
    fn channels(&self) -> usize {
        self.hog.channels() + 1 + self.names.as_ref().map_or(0, ColorTable::channels)
    }

    fn cell_px(&self) -> usize {
        self.hog.cell_px()
    }

    fn grid(&self, patch: Size) -> Size {
        self.hog.grid(patch)
    }

    fn gradient_channels(&self) -> usize {
        self.hog.channels()
    }

    fn patch(&self) -> Option<&Planes> {
        Some(&self.patch)
    }

    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        if self.names.is_some() {
            self.sampler.color(frame.color(), window, &mut self.patch);
        } else {
            self.sampler.gray(frame.gray(), window, &mut self.patch);
        }
        self.hog.extract(&self.patch, &mut self.gradients);
        out.reshape(self.gradients.size(), self.channels());
        let gradients = self.gradients.as_slice();
        out.as_mut_slice()[..gradients.len()].copy_from_slice(gradients);
        // Of a colour patch the first plane, red, stands for brightness; the colour names tell the rest.
        cell_means(&self.patch, self.hog.cell_px(), out, self.hog.channels());
        if let Some(names) = &self.names {
            names.extract(&self.patch, self.hog.cell_px(), out, self.hog.channels() + 1);
        }
    }
}
