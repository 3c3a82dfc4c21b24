use super::Features;
use pursuit_imaging::Frame;
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::illumination::log_standardize;
use pursuit_vision::sampling::{Planes, Sampler, Window};

/// Raw grey values in `[-0.5, 0.5]` (henriques2015, section 7: pixels, less ½), one cell a pixel.
#[derive(Debug, Clone, Default)]
pub struct GrayFeatures {
    sampler: Sampler,
}

impl Features for GrayFeatures {
    fn channels(&self) -> usize {
        1
    }

    fn cell_px(&self) -> usize {
        1
    }

    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        self.sampler.gray(frame.gray(), window, out);
        out.as_mut_slice().iter_mut().for_each(|v| *v = *v / 255.0 - 0.5);
    }
}

/// Grey values as MOSSE prepares them (bolme2010, section 3.1): ln (v + 1), less the mean, divided by the standard
/// deviation, so that neither light nor contrast matters.
#[derive(Debug, Clone, Default)]
pub struct LogGrayFeatures {
    sampler: Sampler,
}

impl Features for LogGrayFeatures {
    fn channels(&self) -> usize {
        1
    }

    fn cell_px(&self) -> usize {
        1
    }

    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        self.sampler.gray(frame.gray(), window, out);
        log_standardize(out.as_mut_slice());
    }
}

/// Histograms of oriented gradients of grey or colour.
#[derive(Debug, Clone)]
pub struct HogFeatures {
    sampler: Sampler,
    hog: Hog,
    patch: Planes,
    color: bool,
}

impl HogFeatures {
    /// Cells of `cell_px` pixels; with `color`, the colour channel with the steepest gradient counts (frames without colour
    /// are taken as grey).
    pub fn new(layout: HogLayout, cell_px: usize, color: bool) -> Self {
        Self { sampler: Sampler::new(), hog: Hog::new(layout, cell_px), patch: Planes::default(), color }
    }
}

impl Features for HogFeatures {
    fn channels(&self) -> usize {
        self.hog.channels()
    }

    fn cell_px(&self) -> usize {
        self.hog.cell_px()
    }

    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        if self.color && frame.has_color() {
            self.sampler.color(frame.color(), window, &mut self.patch);
        } else {
            self.sampler.gray(frame.gray(), window, &mut self.patch);
        }
        self.hog.extract(&self.patch, out);
    }

    /// One plane, or three of colour.
    fn patch(&self) -> Option<&Planes> {
        Some(&self.patch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::{Point, Size};
    use pursuit_imaging::Image;

    #[test]
    fn grids_hold_whole_cells_of_every_channel() {
        let image = Image::from_fn(64, 48, |x, y| [(x * 3) as u8, (y * 5) as u8, (x * y) as u8]).unwrap();
        let frame = Frame::new(0, 0.0, image);
        let window = Window::new(Point::new(30.0, 20.0), 1.3, Size::new(22, 17));
        let mut out = Planes::default();
        for color in [false, true] {
            let mut features = HogFeatures::new(HogLayout::Felzenszwalb31, 4, color);
            features.extract(&frame, &window, &mut out);
            assert_eq!((out.size(), out.channels()), (Size::new(5, 4), 31));
            assert_eq!(features.grid(window.patch), out.size());
            assert_eq!(features.patch().unwrap().channels(), if color { 3 } else { 1 });
        }
        GrayFeatures::default().extract(&frame, &window, &mut out);
        assert_eq!((out.size(), out.channels()), (window.patch, 1));
        assert!(out.as_slice().iter().all(|v| (-0.5..=0.5).contains(v)));
    }
}
