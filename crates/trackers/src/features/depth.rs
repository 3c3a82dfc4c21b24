use super::Features;
use crate::depth::DepthSampler;
use pursuit_imaging::Frame;
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};

/// Histograms of oriented gradients of inverse depth (zhai2024, section 2.1) and, if asked for, of the picture beside them.
/// Of frames without depth the picture stands for it.
#[derive(Debug, Clone)]
pub struct DepthHogFeatures {
    depth: DepthSampler,
    picture: Sampler,
    hog: Hog,
    patch: Planes,
    gradients: Planes,
    nearest_mm: u16,
    fused: bool,
}

impl DepthHogFeatures {
    /// Cells of `cell_px` pixels, depths relative to `nearest_mm`; with `fused`, 31 channels of the picture follow the 31 of depth.
    pub fn new(cell_px: usize, nearest_mm: u16, fused: bool) -> Self {
        Self {
            depth: DepthSampler::default(),
            picture: Sampler::new(),
            hog: Hog::new(HogLayout::Felzenszwalb31, cell_px),
            patch: Planes::default(),
            gradients: Planes::default(),
            nearest_mm,
            fused,
        }
    }

    fn picture_gradients(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        if self.fused && frame.has_color() {
            self.picture.color(frame.color(), window, &mut self.patch);
        } else {
            self.picture.gray(frame.gray(), window, &mut self.patch);
        }
        self.hog.extract(&self.patch, out);
    }
}

impl Features for DepthHogFeatures {
    fn channels(&self) -> usize {
        self.hog.channels() * if self.fused { 2 } else { 1 }
    }

    fn cell_px(&self) -> usize {
        self.hog.cell_px()
    }

    fn extract(&mut self, frame: &Frame, window: &Window, out: &mut Planes) {
        let mut gradients = std::mem::take(&mut self.gradients);
        let first = if self.fused { &mut gradients } else { &mut *out };
        match frame.depth_mm() {
            Some(depth) => {
                self.depth.inverse(self.nearest_mm, depth, window, &mut self.patch);
                self.hog.extract(&self.patch, first);
            }
            None => self.picture_gradients(frame, window, first),
        }
        if self.fused {
            out.reshape(gradients.size(), self.channels());
            let n = gradients.as_slice().len();
            out.as_mut_slice()[..n].copy_from_slice(gradients.as_slice());
            self.picture_gradients(frame, window, &mut gradients);
            out.as_mut_slice()[n..].copy_from_slice(gradients.as_slice());
        }
        self.gradients = gradients;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::{Point, Size};
    use pursuit_imaging::Image;

    fn frame(light: u8, with_depth: bool) -> Frame {
        let color = Image::from_fn(64, 48, |x, y| [(x * 3) as u8 / light, (y * 5) as u8 / light, 9]).unwrap();
        let depth = Image::from_fn(64, 48, |x, y| if x > 20 && y > 15 { 1000 } else { 2000 }).unwrap();
        let frame = Frame::new(0, 0.0, color);
        if with_depth { frame.with_depth(depth).unwrap() } else { frame }
    }

    fn extract(frame: &Frame, fused: bool) -> Planes {
        let mut out = Planes::default();
        let window = Window::new(Point::new(30.0, 20.0), 1.3, Size::new(24, 16));
        DepthHogFeatures::new(4, 400, fused).extract(frame, &window, &mut out);
        assert_eq!((out.size(), out.channels()), (Size::new(6, 4), if fused { 62 } else { 31 }));
        out
    }

    #[test]
    fn depth_alone_does_not_see_the_light() {
        let depth = extract(&frame(1, true), false);
        assert_eq!(depth, extract(&frame(7, true), false));
        assert!(depth.as_slice().iter().any(|v| *v > 0.1));
        assert_ne!(depth, extract(&frame(1, false), false), "without depth it is the picture that is seen");
    }

    #[test]
    fn fused_features_are_depths_then_the_pictures() {
        let (fused, depth) = (extract(&frame(1, true), true), extract(&frame(1, true), false));
        let n = depth.as_slice().len();
        assert_eq!(&fused.as_slice()[..n], depth.as_slice());
        assert_eq!(&fused.as_slice()[n..], &extract(&frame(1, false), true).as_slice()[n..]);
    }
}
