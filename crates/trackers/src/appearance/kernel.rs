use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{ImageView, Rgb8};
use std::ops::Range;

/// Half sides below this count as this much: a kernel then reaches a pixel's middle wherever its own lies.
const LEAST_HALF_PX: f64 = 1.0;

/// An Epanechnikov kernel over the ellipse in a box: its profile is 1 − r², where r is the distance from the middle with each
/// axis scaled by half the box's side, and 0 beyond 1 (comaniciu2003, sections 2.1 and 4.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    center: Point,
    half: (f64, f64),
    /// Every so many pixels are looked at each way.
    step: usize,
}

impl Kernel {
    /// The kernel in `bbox`, of which about `most_pixels` pixels are looked at where it has more.
    pub fn new(bbox: &BBox, most_pixels: usize) -> Self {
        let half = |side: f64| (side / 2.0).max(LEAST_HALF_PX);
        let step = (bbox.area() / most_pixels.max(1) as f64).sqrt().ceil().max(1.0);
        // A cast saturates: a box without end has the greatest step, and none of its pixels matter.
        Self { center: bbox.center(), half: (half(bbox.width()), half(bbox.height())), step: step as usize }
    }

    /// The same kernel elsewhere.
    pub const fn at(self, center: Point) -> Self {
        Self { center, ..self }
    }

    /// Its middle.
    pub const fn center(&self) -> Point {
        self.center
    }

    /// The part of a picture of this size that it looks at: left, top, width and height in pixels. Left and top are where a grid of the
    /// part begins as well as one of the picture; nothing is wide where the kernel is beside the picture.
    pub fn part(&self, picture: Size) -> [usize; 4] {
        let part = |center: f64, half: f64, n: usize| {
            let Range { start, end } = line(center, half, n);
            let from = start / self.step * self.step;
            (from, if start < end { end - from } else { 0 })
        };
        let (x, width) = part(self.center.x, self.half.0, picture.width);
        let (y, height) = part(self.center.y, self.half.1, picture.height);
        [x, y, width, height]
    }

    /// Calls `look` with each pixel under the kernel, its displacement from the middle in pixels and the kernel there. Those
    /// outside of the picture are left out.
    #[inline(always)]
    pub fn for_each(&self, color: ImageView<'_, Rgb8>, mut look: impl FnMut(Rgb8, (f32, f32), f32)) {
        let (width, height) = (color.size().width, color.size().height);
        let (scale_x, scale_y) = (1.0 / (self.half.0 * self.half.0), 1.0 / (self.half.1 * self.half.1));
        for y in lines(self.center.y, self.half.1, height, self.step) {
            let dy = y as f64 + 0.5 - self.center.y;
            let left = 1.0 - dy * dy * scale_y;
            if left <= 0.0 {
                continue;
            }
            let row = color.row(y);
            let reach = self.half.0 * left.sqrt();
            for x in lines(self.center.x, reach, width, self.step) {
                let dx = x as f64 + 0.5 - self.center.x;
                look(row[x], (dx as f32, dy as f32), (left - dx * dx * scale_x) as f32);
            }
        }
    }
}

/// The pixels of a line of `n` whose middles are less than `half` from `center`.
fn line(center: f64, half: f64, n: usize) -> Range<usize> {
    let bound = |v: f64| v.clamp(0.0, n as f64) as usize;
    bound((center - half - 0.5).floor() + 1.0)..bound((center + half - 0.5).ceil())
}

/// Every `step`th of the picture of those.
fn lines(center: f64, half: f64, n: usize, step: usize) -> impl Iterator<Item = usize> {
    let Range { start, end } = line(center, half, n);
    (start.next_multiple_of(step)..end).step_by(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// The kernel at every pixel of the picture, one after the other.
    fn slow(bbox: &BBox, image: &Image<Rgb8>) -> Vec<(Rgb8, f64)> {
        let mut seen = Vec::new();
        for (y, row) in image.view().rows().enumerate() {
            for (x, pixel) in row.iter().enumerate() {
                let u = (x as f64 + 0.5 - bbox.center().x) / (bbox.width() / 2.0).max(1.0);
                let v = (y as f64 + 0.5 - bbox.center().y) / (bbox.height() / 2.0).max(1.0);
                if u * u + v * v < 1.0 {
                    seen.push((*pixel, 1.0 - u * u - v * v));
                }
            }
        }
        seen
    }

    #[test]
    fn every_pixel_of_the_ellipse_is_weighed_by_the_profile() {
        let image = Image::from_fn(40, 30, |x, y| [x as u8, y as u8, 7]).unwrap();
        for (l, t, w, h) in
            [(5.3, 6.1, 17.0, 12.4), (-6.0, 20.0, 20.0, 18.0), (33.0, -4.0, 30.0, 9.0), (9.7, 9.2, 0.4, 0.4)]
        {
            let bbox = BBox::from_ltwh(l, t, w, h);
            let mut seen = Vec::new();
            Kernel::new(&bbox, usize::MAX).for_each(image.view(), |pixel, _, k| seen.push((pixel, f64::from(k))));
            let want = slow(&bbox, &image);
            assert!(!want.is_empty() && seen.len() == want.len(), "{bbox}: {} of {}", seen.len(), want.len());
            assert!(seen.iter().zip(&want).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-6), "{bbox}");
        }
    }

    #[test]
    fn large_kernels_are_looked_at_on_a_grid() {
        let image = Image::from_fn(200, 150, |x, y| [x as u8, y as u8, 7]).unwrap();
        let (mut some, mut all) = (0_i32, 0_i32);
        let bbox = BBox::from_ltwh(10.0, 10.0, 160.0, 120.0);
        Kernel::new(&bbox, 1200).for_each(image.view(), |pixel, _, _| {
            assert!(pixel[0] % 4 == 0 && pixel[1] % 4 == 0);
            some += 1;
        });
        Kernel::new(&bbox, usize::MAX).for_each(image.view(), |_, _, _| all += 1);
        assert!((some * 16 - all).abs() < all / 20, "{some} of {all}");
    }

    #[test]
    fn the_part_of_a_picture_has_every_pixel_that_is_looked_at() {
        let image = Image::from_fn(200, 150, |x, y| [x as u8, y as u8, 7]).unwrap();
        for (l, t, w, h, most) in [
            (10.4, 17.3, 160.0, 120.0, 1200),
            (-30.0, 101.0, 90.0, 80.0, 500),
            (150.2, -9.0, 99.0, 30.0, usize::MAX),
            (9.7, 9.2, 0.4, 0.4, 9),
        ] {
            let kernel = Kernel::new(&BBox::from_ltwh(l, t, w, h), most);
            let [x, y, width, height] = kernel.part(image.size());
            let part = image.view().crop(x, y, width, height).unwrap();
            let (mut seen, mut want) = (Vec::new(), Vec::new());
            let there = Point::new(kernel.center().x - x as f64, kernel.center().y - y as f64);
            kernel.at(there).for_each(part, |pixel, _, k| seen.push((pixel, k)));
            kernel.for_each(image.view(), |pixel, _, k| want.push((pixel, k)));
            assert!(!want.is_empty() && seen.len() == want.len(), "{l} {t}: {} of {}", seen.len(), want.len());
            assert!(seen.iter().zip(&want).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-5), "{l} {t}");
        }
        let [_, _, width, _] = Kernel::new(&BBox::from_ltwh(900.0, 9.0, 20.0, 20.0), 99).part(image.size());
        assert_eq!(width, 0);
    }

    #[test]
    fn nothing_is_seen_outside_of_the_picture() {
        let image = Image::filled(20, 10, [1; 3]).unwrap();
        for bbox in [BBox::from_ltwh(40.0, 2.0, 8.0, 8.0), BBox::from_ltwh(5.0, -1e9, 8.0, 8.0)] {
            Kernel::new(&bbox, 100).for_each(image.view(), |_, _, _| panic!("nothing is there"));
        }
    }
}
