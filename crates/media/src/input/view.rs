use pursuit_geometry::{BBox, Point, Size};
use serde::Serialize;

/// The part of an input's picture that its frames show, and at what size: how pixels of the two belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct View {
    /// Width and height of the input's whole picture, in pixels.
    #[serde(skip)]
    pub input: Size,
    /// Left, top, width and height of the part that is shown, in pixels of the input.
    pub region: [usize; 4],
    /// Width and height of the frames that show it.
    pub size: [usize; 2],
}

impl View {
    /// Width and height of the frames.
    pub const fn size(&self) -> Size {
        Size::new(self.size[0], self.size[1])
    }

    /// Left and top of the part, in pixels of the input.
    pub const fn origin(&self) -> [f64; 2] {
        [self.region[0] as f64, self.region[1] as f64]
    }

    /// Pixels of a frame for one of the input, along x and y.
    pub const fn scale(&self) -> [f64; 2] {
        let [_, _, width, height] = self.region;
        [self.size[0] as f64 / width as f64, self.size[1] as f64 / height as f64]
    }

    /// Width against height of the frames' pixels, where that of the input's is `(width, height)`.
    pub fn pixel_aspect(&self, (width, height): (u32, u32)) -> (u32, u32) {
        let [_, _, from_width, from_height] = self.region.map(|side| side as u128);
        let [to_width, to_height] = self.size.map(|side| side as u128);
        let (wide, high) = (u128::from(width) * from_width * to_height, u128::from(height) * from_height * to_width);
        let (mut a, mut b) = (wide, high);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        let whole = |side: u128| u32::try_from(side / a.max(1)).ok().filter(|&side| side > 0);
        whole(wide).zip(whole(high)).unwrap_or((width, height))
    }

    /// A point of the input in the frames' pixels.
    pub const fn point_of_input(&self, p: Point) -> Point {
        let ([sx, sy], [x, y]) = (self.scale(), self.origin());
        Point::new((p.x - x) * sx, (p.y - y) * sy)
    }

    /// A point of the frames in the input's pixels.
    pub const fn point_in_input(&self, p: Point) -> Point {
        let ([sx, sy], [x, y]) = (self.scale(), self.origin());
        Point::new(p.x / sx + x, p.y / sy + y)
    }

    /// A box of the input in the frames' pixels.
    pub fn of_input(&self, bbox: BBox) -> BBox {
        let ([sx, sy], [x, y], (l, t, w, h)) = (self.scale(), self.origin(), bbox.ltwh());
        BBox::from_ltwh((l - x) * sx, (t - y) * sy, w * sx, h * sy)
    }

    /// A box of the frames in the input's pixels.
    pub fn in_input(&self, bbox: BBox) -> BBox {
        let ([sx, sy], [x, y], (l, t, w, h)) = (self.scale(), self.origin(), bbox.ltwh());
        BBox::from_ltwh(l / sx + x, t / sy + y, w / sx, h / sy)
    }
}
