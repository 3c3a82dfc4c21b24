use super::{Kernel, KernelHistogram};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize};

/// Bins of each of red, green and blue. Few: a lamp that changes a little is to change the histogram a little.
const BINS: usize = 8;
/// About so many pixels of a box are looked at.
const PIXELS: usize = 4096;

/// The colours that the target had at first, kept for good: what a tracker has drifted to and learnt is the target for all that it has learnt
/// since, and seldom has its colours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FirstColors {
    first: KernelHistogram,
    /// Overwritten at every use.
    #[serde(skip)]
    seen: KernelHistogram,
}

impl FirstColors {
    /// The colours in `bbox`, the middle of which counts most; of a grey frame its brightness.
    pub fn new(frame: &Frame, bbox: &BBox) -> Self {
        let mut first = KernelHistogram::empty(BINS);
        first.measure(frame.color(), &Kernel::new(bbox, PIXELS), BINS);
        Self { first, seen: KernelHistogram::default() }
    }

    /// Whether a state that was read is one that the colours of a box lead to.
    pub fn is_sound(&self) -> bool {
        self.first.is_sound(BINS)
    }

    /// The Bhattacharyya coefficient of the colours in `bbox` and the first ones, from 0 (no colour in common, or nothing of the box in the
    /// picture) to 1 (comaniciu2003, eq. 7).
    pub fn likeness(&mut self, frame: &Frame, bbox: &BBox) -> f64 {
        self.seen.measure(frame.color(), &Kernel::new(bbox, PIXELS), BINS);
        self.seen.coefficient(&self.first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

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
    fn nothing_is_known_of_what_was_beside_the_picture() {
        let frame = halves();
        let mut colors = FirstColors::new(&frame, &BBox::from_ltwh(-50.0, 5.0, 20.0, 20.0));
        assert!(colors.is_sound());
        assert_eq!(colors.likeness(&frame, &BBox::from_ltwh(5.0, 5.0, 20.0, 20.0)), 0.0);
    }
}
