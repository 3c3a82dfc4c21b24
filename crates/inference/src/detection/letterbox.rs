use super::Placing;
use pursuit_geometry::{BBox, Size};

/// A frame fitted into a network's image: enlarged or reduced as a whole, the rest of the image filled; or stretched over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Letterbox {
    /// Pixels of the image to a pixel of the frame, across and down.
    ratios: (f64, f64),
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl Letterbox {
    /// A frame of `size` in an image of `width` × `height` pixels. Sides are rounded down, as `preproc` of YOLOX does, but to no
    /// less than a pixel.
    pub fn new(size: Size, (width, height): (usize, usize), place: Placing) -> Self {
        let across = (width as f64 / size.width as f64, height as f64 / size.height as f64);
        let ratio = across.0.min(across.1);
        let fit = |side: usize, most: usize| ((side as f64 * ratio) as usize).clamp(1, most.max(1));
        let (w, h) = (fit(size.width, width), fit(size.height, height));
        let (ratios, left, top, w, h) = match place {
            Placing::Corner => ((ratio, ratio), 0, 0, w, h),
            Placing::Middle => ((ratio, ratio), (width - w) / 2, (height - h) / 2, w, h),
            Placing::Stretched => (across, 0, 0, width, height),
        };
        Self { ratios, left, top, width: w, height: h }
    }

    /// Columns and rows of the image that the frame takes up: left, top, width, height.
    pub const fn window(&self) -> (usize, usize, usize, usize) {
        (self.left, self.top, self.width, self.height)
    }

    /// A box of the image in pixels of the frame.
    pub fn in_frame(&self, bbox: &BBox) -> BBox {
        let (left, top, width, height) = bbox.ltwh();
        let (across, down) = self.ratios;
        let (x, y) = ((left - self.left as f64) / across, (top - self.top as f64) / down);
        BBox::from_ltwh(x, y, width / across, height / down)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_fill_the_image_in_one_direction() {
        let wide = Letterbox::new(Size::new(768, 576), (416, 416), Placing::Corner);
        assert_eq!(wide.window(), (0, 0, 416, 312));
        assert_eq!(
            wide.in_frame(&BBox::from_ltwh(41.6, 104.0, 83.2, 41.6)),
            BBox::from_ltwh(41.6 * 768.0 / 416.0, 192.0, 83.2 * 768.0 / 416.0, 41.6 * 768.0 / 416.0)
        );
        let tall = Letterbox::new(Size::new(100, 333), (64, 128), Placing::Middle);
        // 100 · 128 / 333 = 38.4 columns.
        assert_eq!(tall.window(), (13, 0, 38, 128));
        let back = tall.in_frame(&BBox::from_ltwh(13.0, 0.0, 38.0, 128.0));
        assert!((back.left(), back.top()) == (0.0, 0.0) && (back.height() - 333.0).abs() < 1e-9, "{back}");
        let stretched = Letterbox::new(Size::new(200, 50), (100, 100), Placing::Stretched);
        assert_eq!(stretched.window(), (0, 0, 100, 100));
        assert_eq!(
            stretched.in_frame(&BBox::from_ltwh(10.0, 10.0, 20.0, 40.0)),
            BBox::from_ltwh(20.0, 5.0, 40.0, 20.0)
        );
        // A frame of one row keeps it.
        assert_eq!(Letterbox::new(Size::new(5000, 1), (416, 416), Placing::Corner).window(), (0, 0, 416, 1));
    }
}
