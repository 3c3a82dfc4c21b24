use super::{Kernel, KernelHistogram};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image, Rgb8};
use serde::{Deserialize, Serialize};

/// Bins of each of red, green and blue. Few: a lamp that changes a little is to change the histogram a little.
const BINS: usize = 8;
/// About so many pixels of a box are looked at.
const PIXELS: usize = 4096;

/// The colours that the target had at first, kept for good: what a tracker has drifted to and learnt is the target for all that it has learnt
/// since, and seldom has its colours.
///
/// A lamp, a cloud, a camera's exposure or the gain of a thermal camera make all of the picture brighter, the target too; a camera that turns
/// to the sky makes it brighter, and not the target. So colours are compared as they are, and as they would be if the picture were as
/// bright as the first one; the greater likeness is taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FirstColors {
    first: KernelHistogram,
    /// Mean grey level of the picture that they were seen in.
    brightness: f64,
    /// Overwritten at every use.
    #[serde(skip)]
    work: Work,
}

/// The colours seen now, and the part of the picture that they are seen in.
#[derive(Debug, Clone, PartialEq)]
struct Work {
    seen: KernelHistogram,
    part: Image<Rgb8>,
}

impl Default for Work {
    fn default() -> Self {
        let part = Image::filled(1, 1, [0; 3]).unwrap_or_else(|_| unreachable!("one pixel is a valid size"));
        Self { seen: KernelHistogram::empty(BINS), part }
    }
}

impl FirstColors {
    /// The colours in `bbox`, the middle of which counts most; of a grey frame its brightness.
    pub fn new(frame: &Frame, bbox: &BBox) -> Self {
        let mut work = Work::default();
        if let Some(kernel) = work.look(frame, bbox) {
            work.measure(&kernel, 0);
        }
        Self { first: std::mem::take(&mut work.seen), brightness: frame.brightness(), work }
    }

    /// Whether a state that was read is one that the colours of a box lead to.
    pub fn is_sound(&self) -> bool {
        self.first.is_sound(BINS) && (0.0..=255.0).contains(&self.brightness)
    }

    /// The Bhattacharyya coefficient of the colours in `bbox` and the first ones, from 0 (no colour in common, or nothing of the box in the
    /// picture) to 1 (comaniciu2003, eq. 7).
    pub fn likeness(&mut self, frame: &Frame, bbox: &BBox) -> f64 {
        let Self { first, brightness, work } = self;
        let Some(kernel) = work.look(frame, bbox) else { return 0.0 };
        let mut likeness = |brighter| {
            work.measure(&kernel, brighter);
            work.seen.coefficient(first)
        };
        let as_it_is = likeness(0);
        match (frame.brightness() - *brightness).round() as i16 {
            0 => as_it_is,
            brighter => as_it_is.max(likeness(brighter)),
        }
    }
}

impl Work {
    /// Takes the colours of the part of the picture that the box is in: of planar video, only that part is converted. `None` where the box
    /// is beside the picture.
    fn look(&mut self, frame: &Frame, bbox: &BBox) -> Option<Kernel> {
        let kernel = Kernel::new(bbox, PIXELS);
        let [x, y, width, height] = kernel.part(frame.size());
        // An error would be of a part that is larger than a picture may be.
        let is_seen = frame.reduced_color([x, y, width, height], 1, &mut self.part).unwrap_or(false);
        let Point { x: right, y: down } = kernel.center();
        is_seen.then(|| kernel.at(Point::new(right - x as f64, down - y as f64)))
    }

    /// Sees the colours under the kernel in a picture that is as much darker.
    fn measure(&mut self, kernel: &Kernel, brighter: i16) {
        let darker = |pixel: Rgb8| pixel.map(|v| (i16::from(v) - brighter).clamp(0, 255) as u8);
        self.seen.measure_as(self.part.view(), kernel, BINS, darker);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{ColorMatrix, ColorRange, Yuv420};

    /// A picture whose left half is red, whose right half is blue.
    fn halves() -> Frame {
        let color = |x| if x < 40 { [200, 20, 20] } else { [20, 20, 200] };
        Frame::new(0, 0.0, Image::from_fn(80, 40, |x, _| color(x)).unwrap())
    }

    #[test]
    fn colors_of_the_first_box_are_known_anywhere_and_others_are_not() {
        let frame = halves();
        let mut colors = FirstColors::new(&frame, &BBox::from_ltwh(5.0, 5.0, 20.0, 20.0));
        assert!(colors.is_sound());
        assert!((colors.likeness(&frame, &BBox::from_ltwh(12.0, 15.0, 20.0, 20.0)) - 1.0).abs() < 1e-6);
        assert!((colors.likeness(&frame, &BBox::from_ltwh(30.0, 10.0, 20.0, 20.0)) - 0.5_f64.sqrt()).abs() < 0.05);
        assert_eq!(colors.likeness(&frame, &BBox::from_ltwh(50.0, 5.0, 20.0, 20.0)), 0.0);
        assert_eq!(colors.likeness(&frame, &BBox::from_ltwh(500.0, 5.0, 20.0, 20.0)), 0.0, "beside the picture");
    }

    #[test]
    fn light_on_the_whole_picture_changes_nothing_and_light_on_the_box_does() {
        let picture = |all: u8, target: u8| {
            let pixel = |x: usize, y: usize| {
                let at_target = (10..30).contains(&x) && (10..30).contains(&y);
                let level = if at_target { 90 + 3 * x as u8 + target } else { 30 + 2 * (x as u8 % 16) };
                [level + all, level + all, level + all]
            };
            Frame::new(0, 0.0, Image::from_fn(100, 80, pixel).unwrap())
        };
        let bbox = BBox::from_ltwh(10.0, 10.0, 20.0, 20.0);
        let mut colors = FirstColors::new(&picture(0, 0), &bbox);
        assert!(colors.likeness(&picture(60, 0), &bbox) > 0.98, "a brighter picture");
        assert!(colors.likeness(&picture(0, 60), &bbox) < 0.5, "something brighter in the same picture");
        let darker = |frame: &Frame, (from, to): (usize, usize)| {
            let pixel = |x: usize, y| if (from..to).contains(&x) { frame.color().row(y)[x] } else { [0; 3] };
            frame.with_pixels(Image::from_fn(100, 80, pixel).unwrap()).unwrap()
        };
        let turned = darker(&picture(0, 0), (0, 40));
        assert!(turned.brightness() < picture(0, 0).brightness() - 10.0);
        assert_eq!(colors.likeness(&turned, &bbox), 1.0, "a darker scene behind the same target");
    }

    #[test]
    fn planes_of_a_film_and_their_colours_say_the_same() {
        let plane = |w, h, k: usize| Image::from_fn(w, h, move |x, y| (30 + (k * x + 7 * y) % 190) as u8).unwrap();
        let film = |from: usize| {
            let (y, u, v) = (plane(160, 120, 3 + from), plane(80, 60, 5 + from), plane(80, 60, 2));
            Frame::new(0, 0.0, Yuv420::new(y, u, v, ColorMatrix::Bt709, ColorRange::Limited).unwrap())
        };
        let colored = |frame: &Frame| frame.with_pixels(frame.color().to_image()).unwrap();
        let (first, now) = (film(0), film(1));
        for (l, t, w, h) in [(31.0, 17.0, 20.0, 25.0), (-9.0, 60.5, 130.0, 90.0)] {
            let bbox = BBox::from_ltwh(l, t, w, h);
            let by_planes = FirstColors::new(&first, &bbox).likeness(&now, &bbox);
            let by_colors = FirstColors::new(&colored(&first), &bbox).likeness(&colored(&now), &bbox);
            assert!((by_planes - by_colors).abs() < 0.02 && by_planes < 0.99, "{by_planes} for {by_colors}");
        }
    }

    #[test]
    fn nothing_is_known_of_what_was_beside_the_picture() {
        let frame = halves();
        let mut colors = FirstColors::new(&frame, &BBox::from_ltwh(-50.0, 5.0, 20.0, 20.0));
        assert!(colors.is_sound());
        assert_eq!(colors.likeness(&frame, &BBox::from_ltwh(5.0, 5.0, 20.0, 20.0)), 0.0);
    }
}
