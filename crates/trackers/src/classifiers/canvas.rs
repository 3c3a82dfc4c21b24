use super::ViewParams;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Frame, ImageView};
use pursuit_vision::integral::IntegralImage;
use pursuit_vision::sampling::{Planes, Sampler, Window};
use serde::{Deserialize, Serialize};

/// So many windows side by side are rated together.
pub(super) const LANES: usize = 32;

/// Of what size the target is looked at, and how far about it, in pixels of the canvas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Shape {
    /// Sides of a window.
    pub width: usize,
    pub height: usize,
    /// Windows lie up to so far to each side of the middle one.
    pub reach: usize,
}

/// Least and greatest side of a window.
const SIDES: (f64, f64) = (8.0, 96.0);

impl Shape {
    /// Of a target that is at `bbox` at first.
    pub fn new(view: &ViewParams, bbox: &BBox) -> Self {
        let scale = (view.area_px / bbox.area()).sqrt();
        let side = |px: f64| (px * scale).round().clamp(SIDES.0, SIDES.1) as usize;
        Self { width: side(bbox.width()), height: side(bbox.height()), reach: view.reach }
    }

    /// Whether it is one that [`new`](Self::new) makes.
    pub fn is_sound(&self) -> bool {
        let side = |px: usize| (SIDES.0..=SIDES.1).contains(&(px as f64));
        side(self.width) && side(self.height) && (LANES / 2..=128).contains(&self.reach)
    }

    /// Windows across, and down.
    pub const fn windows(&self) -> usize {
        2 * self.reach
    }

    /// Of the canvas.
    pub const fn size(&self) -> Size {
        Size { width: self.width + 2 * self.reach, height: self.height + 2 * self.reach }
    }

    /// The middle window.
    pub const fn middle(&self) -> Place {
        Place { x: self.reach, y: self.reach }
    }

    /// The window at a displacement from another, which is kept on the canvas.
    pub fn about(&self, at: Place, dx: f64, dy: f64) -> Place {
        let inside = |v: f64| v.round().clamp(0.0, (self.windows() - 1) as f64) as usize;
        Place { x: inside(at.x as f64 + dx), y: inside(at.y as f64 + dy) }
    }

    /// Overlap of two windows, [0, 1].
    pub fn overlap(&self, a: Place, b: Place) -> f64 {
        let shared = |side: usize, a: usize, b: usize| side.saturating_sub(a.abs_diff(b));
        let both = shared(self.width, a.x, b.x) * shared(self.height, a.y, b.y);
        both as f64 / (2 * self.width * self.height - both) as f64
    }
}

/// The top left pixel of a window on the canvas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Place {
    pub x: usize,
    pub y: usize,
}

/// The surroundings of a place, sampled so that the target is as large as a window.
#[derive(Debug, Clone, Default)]
pub(super) struct Canvas {
    sampler: Sampler,
    planes: Planes,
    pixels: Vec<u8>,
    integral: IntegralImage,
    size: Size,
    /// Red, green and blue, where they are looked at.
    colors: Option<Planes>,
}

impl Canvas {
    /// One with colours beside grey.
    pub fn colored() -> Self {
        Self { colors: Some(Planes::default()), ..Self::default() }
    }

    /// Takes the canvas whose middle window lies on `bbox`; beyond the frame its border is repeated.
    pub fn look(&mut self, frame: &Frame, shape: &Shape, bbox: &BBox) {
        let patch = shape.size();
        let (step_x, step_y) = (bbox.width() / shape.width as f64, bbox.height() / shape.height as f64);
        let window = Window { center: bbox.center(), step_x, step_y, angle_rad: 0.0, patch };
        self.sampler.gray(frame.gray(), &window, &mut self.planes);
        self.pixels.clear();
        self.pixels.extend(self.planes.plane(0).iter().map(|v| v.round().clamp(0.0, 255.0) as u8));
        if let Ok(view) = ImageView::new(&self.pixels, patch.width, patch.height, patch.width) {
            self.integral.build(view);
        }
        self.size = patch;
        if let Some(colors) = &mut self.colors {
            self.sampler.color(frame.color(), &window, colors);
        }
    }

    /// Sums above and left of every pixel, and how many there are in a row.
    pub fn sums(&self) -> (&[u32], usize) {
        self.integral.sums()
    }

    /// Grey codes, row by row, and how many there are in a row.
    pub fn pixels(&self) -> (&[u8], usize) {
        (&self.pixels, self.size.width)
    }

    /// Red, green and blue, 0 to 255, where they are looked at.
    pub const fn colors(&self) -> Option<&Planes> {
        self.colors.as_ref()
    }
}

/// The middle of the window at fractional displacement `(x, y)` from the first of the canvas about `bbox`.
pub(super) fn center_of(shape: &Shape, bbox: &BBox, (x, y): (f64, f64)) -> Point {
    let reach = shape.reach as f64;
    let c = bbox.center();
    Point::new(
        c.x + (x - reach) * bbox.width() / shape.width as f64,
        c.y + (y - reach) * bbox.height() / shape.height as f64,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    #[test]
    fn windows_keep_the_area_and_the_proportions() {
        let view = ViewParams { area_px: 1024.0, reach: 32 };
        let shape = Shape::new(&view, &BBox::from_ltwh(0.0, 0.0, 50.0, 200.0));
        assert_eq!((shape.width, shape.height), (16, 64));
        let thin = Shape::new(&view, &BBox::from_ltwh(0.0, 0.0, 1.0, 4000.0));
        assert!(thin.is_sound() && (thin.width, thin.height) == (8, 96));
        assert_eq!(shape.size(), Size::new(80, 128));
    }

    #[test]
    fn overlaps_are_those_of_boxes() {
        let shape = Shape { width: 20, height: 30, reach: 20 };
        let bbox = |p: Place| BBox::from_ltwh(p.x as f64, p.y as f64, 20.0, 30.0);
        let (a, far) = (Place { x: 3, y: 8 }, Place { x: 30, y: 8 });
        for b in [a, Place { x: 10, y: 20 }, far] {
            assert!((shape.overlap(a, b) - bbox(a).iou(&bbox(b))).abs() < 1e-12);
        }
    }

    #[test]
    fn the_middle_window_lies_on_the_box() {
        let image = Image::from_fn(120, 90, |x, y| ((x * 5 + y * 3) % 251) as u8).unwrap();
        let frame = Frame::new(0, 0.0, image);
        let bbox = BBox::from_ltwh(40.0, 30.0, 20.0, 16.0);
        let shape = Shape { width: 20, height: 16, reach: 16 };
        let mut canvas = Canvas::default();
        canvas.look(&frame, &shape, &bbox);
        let (pixels, stride) = canvas.pixels();
        let gray = frame.gray();
        let same = |x: usize, y: usize| pixels[(y + 16) * stride + x + 16] == gray.row(30 + y)[40 + x];
        assert!((0..16).all(|y| (0..20).all(|x| same(x, y))));
        assert_eq!(center_of(&shape, &bbox, (16.0, 16.0)), bbox.center());
        assert_eq!(center_of(&shape, &bbox, (18.5, 16.0)).x, bbox.center().x + 2.5);
    }
}
