//! Large pictures are looked at coarser: who moves is as large a part of a picture of many pixels as of one of few.

use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, Reducer, Result as ImagingResult};
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::{Detection, Detector, Diagnostics, Followed, Result, TrackingError};
use std::sync::Arc;

/// A frame is reduced by no more.
const MOST_STEP: usize = 64;

/// A detector that is shown pictures whose shorter side has no more than `most_px` pixels, each the mean of a square of `step` × `step`.
pub(super) struct Coarse {
    detector: Box<dyn Detector>,
    most_px: usize,
    step: usize,
    /// Of the first frame, as every further one must be; `None` before it.
    size: Option<Size>,
    reducer: Reducer,
    /// The frame looked at last as the detector saw it, where that was coarser.
    small: Option<Frame>,
    /// What stood out, in the pixels of the picture.
    shown: Option<Arc<Image<u8>>>,
}

impl Coarse {
    /// Of pictures of any size, as they are, where `most_px` is 0.
    pub fn new(detector: Box<dyn Detector>, most_px: usize) -> Self {
        Self { detector, most_px, step: 1, size: None, reducer: Reducer::default(), small: None, shown: None }
    }

    /// A box of the picture in the pixels that the detector sees.
    fn seen(&self, bbox: &BBox) -> BBox {
        bbox.resized(1.0 / self.step as f64)
    }

    /// A box that the detector sees in the pixels of the picture. What reaches the end of what it sees reaches that of the picture.
    fn told(&self, bbox: &BBox, size: Size) -> BBox {
        let step = self.step as f64;
        let end = |at: f64, whole: usize| {
            let beyond = if at >= (whole / self.step) as f64 { whole % self.step } else { 0 };
            at * step + beyond as f64
        };
        let (right, bottom) = (end(bbox.right(), size.width), end(bbox.bottom(), size.height));
        BBox::from_ltrb(bbox.left() * step, bbox.top() * step, right, bottom)
    }
}

/// The squares that the pixels of `mask` stand for, in a picture of `size`.
fn enlarge(mask: &Image<u8>, step: usize, size: Size, out: &mut Image<u8>) -> ImagingResult<()> {
    out.resize_for_overwrite(size, 0)?;
    for y in 0..mask.height() {
        let top = y * step;
        // The last ones stand for what makes no whole square, too.
        let bottom = if y + 1 == mask.height() { size.height } else { top + step };
        let (row, wide) = (mask.row(y), out.row_mut(top));
        match step {
            2 => repeat::<2>(row, wide),
            3 => repeat::<3>(row, wide),
            _ => wide.chunks_exact_mut(step).zip(row).for_each(|(wide, v)| wide.fill(*v)),
        }
        if let Some(last) = row.last() {
            wide[row.len() * step..].fill(*last);
        }
        for below in top + 1..bottom {
            let (above, rest) = out.as_mut_slice().split_at_mut(below * size.width);
            rest[..size.width].copy_from_slice(&above[top * size.width..][..size.width]);
        }
    }
    Ok(())
}

/// Each value so many times: of few, known when this is compiled, none is a call.
fn repeat<const STEP: usize>(row: &[u8], wide: &mut [u8]) {
    wide.as_chunks_mut::<STEP>().0.iter_mut().zip(row).for_each(|(wide, v)| *wide = [*v; STEP]);
}

impl Detector for Coarse {
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        let size = frame.size();
        let expected = *self.size.get_or_insert(size);
        if expected != size {
            return Err(TrackingError::FrameSize { index: frame.index(), expected, actual: size });
        }
        let shorter = size.width.min(size.height);
        self.step = if self.most_px > 0 { shorter.div_ceil(self.most_px).clamp(1, MOST_STEP) } else { 1 };
        if self.step == 1 {
            return self.detector.detect(frame, followed);
        }
        let small = self.reducer.reduce(frame, self.step).map_err(|e| TrackingError::Computation {
            tracker: "motion".to_owned(),
            index: frame.index(),
            source: Box::new(e),
        })?;
        let followed: Vec<Followed> = followed.iter().map(|f| Followed { bbox: self.seen(&f.bbox), ..*f }).collect();
        let small = self.small.insert(small);
        let found = self.detector.detect(small, &followed)?;
        Ok(found.into_iter().map(|d| Detection { bbox: self.told(&d.bbox, size), ..d }).collect())
    }

    fn watches(&self) -> bool {
        self.detector.watches()
    }

    fn measures(&self) -> bool {
        self.detector.measures()
    }

    fn standing_out(&self, bbox: &BBox) -> Option<f64> {
        self.detector.standing_out(&self.seen(bbox))
    }

    fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        let mask = self.detector.foreground()?;
        let size = self.size.filter(|_| self.step > 1);
        let Some(size) = size else { return Some(mask) };
        // Made anew only where somebody keeps the last.
        let mut shown = match self.shown.take().map(Arc::try_unwrap) {
            Some(Ok(shown)) => shown,
            _ => Image::filled(1, 1, 0).ok()?,
        };
        enlarge(&mask, self.step, size, &mut shown).ok()?;
        self.shown = Some(Arc::new(shown));
        self.shown.clone()
    }

    fn shown(&mut self, frame: &Frame) -> Option<Frame> {
        let Some(small) = &self.small else { return self.detector.shown(frame) };
        let small = self.detector.shown(small).unwrap_or_else(|| small.clone());
        let whole = match self.foreground() {
            Some(mask) => frame.clone().with_foreground(mask).ok()?,
            None => frame.clone(),
        };
        whole.with_coarse(self.step, small).ok()
    }

    fn motion(&self) -> Option<MotionParams> {
        self.detector.motion()
    }

    fn notes(&self) -> Vec<String> {
        self.detector.notes()
    }

    fn diagnostics(&self) -> Diagnostics {
        self.detector.diagnostics()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detectors::motion::MotionDetectorParams;
    use pursuit_testkit::{lattice, value_noise};
    use pursuit_tracking::DetectorRecipe;

    /// Somebody who walks to the right before a wall with grain; he comes in over the left border.
    fn frame(k: usize, width: usize, height: usize) -> Frame {
        let scale = height as f64 / 270.0;
        let wall = |x: usize, y: usize| {
            let at = (x as f64 / scale, y as f64 / scale);
            70.0 + 120.0 * value_noise(at, 9.0, |t| t * t * (3.0 - 2.0 * t), |i, j| lattice(i, j, 3))
        };
        let left = 8.0 * k as f64 - 120.0;
        let inside = |x: usize, y: usize| {
            let (x, y) = (x as f64 / scale, y as f64 / scale);
            (left..left + 40.0).contains(&x) && (80.0..200.0).contains(&y)
        };
        let shade = |x: usize, y: usize| if inside(x, y) { [230, 30, 40] } else { [wall(x, y) as u8, 90, 80] };
        Frame::new(k as u64, k as f64 / 25.0, Image::from_fn(width, height, shade).unwrap())
    }

    fn detector(sight_px: usize) -> Box<dyn Detector> {
        MotionDetectorParams { sight_px, ..MotionDetectorParams::default() }.detector().unwrap()
    }

    #[test]
    fn a_large_picture_is_the_small_one_enlarged() {
        // 3 × 270 pixels and two that make no square.
        let (width, height) = (1082, 812);
        let (mut coarse, mut whole) = (detector(300), detector(0));
        let (mut both, mut at_border) = (0, 0);
        for k in 0..46 {
            let frame = frame(k, width, height);
            let (a, b) = (coarse.detect(&frame, &[]).unwrap(), whole.detect(&frame, &[]).unwrap());
            let (Some(a), Some(b)) = (a.first(), b.first()) else { continue };
            assert!(a.bbox.iou(&b.bbox) > 0.9, "{k}: {} {}", a.bbox, b.bbox);
            let (out, wanted) = (coarse.standing_out(&a.bbox).unwrap(), whole.standing_out(&a.bbox).unwrap());
            assert!((out - wanted).abs() < 0.1, "{k}: {out} {wanted}");
            let (mask, wanted) = (coarse.foreground().unwrap(), whole.foreground().unwrap());
            assert_eq!(mask.size(), frame.size());
            let apart = mask.as_slice().iter().zip(wanted.as_slice()).filter(|(a, b)| a != b).count();
            assert!(apart * 100 < width * height, "{k}: {apart}");
            both += 1;
            at_border += usize::from(a.bbox.left() <= 0.0);
        }
        assert!(both >= 25 && at_border >= 2, "{both} {at_border}");
    }

    #[test]
    fn who_follows_what_was_found_is_shown_what_the_detector_saw() {
        let (width, height) = (401, 270);
        let (mut coarse, mut small) = (detector(100), detector(0));
        for k in 0..20 {
            let (frame, reduced) = (frame(k, width, height), frame(k, width, height).reduced(3).unwrap());
            coarse.detect(&frame, &[]).unwrap();
            small.detect(&reduced, &[]).unwrap();
            let shown = coarse.shown(&frame).unwrap();
            let (step, seen) = shown.coarse().unwrap();
            assert_eq!((step, seen.color().to_image()), (3, reduced.color().to_image()));
            assert_eq!(shown.color().row(0).as_ptr(), frame.color().row(0).as_ptr(), "the pixels are the same");
            let wanted = small.foreground();
            assert_eq!(seen.foreground().map(|mask| mask.to_image()), wanted.as_deref().cloned(), "{k}");
            assert_eq!(shown.foreground().map(|mask| mask.size()), wanted.map(|_| frame.size()));
        }
        let mut whole = detector(300);
        whole.detect(&frame(0, width, height), &[]).unwrap();
        assert!(whole.shown(&frame(0, width, height)).is_none_or(|shown| shown.coarse().is_none()));
    }

    #[test]
    fn the_coarsest_sight_of_any_picture_is_no_fault() {
        for (width, height) in [(40, 40), (3, 1), (200, 70)] {
            let mut coarse = detector(1);
            for k in 0..20 {
                let found = coarse.detect(&frame(k, width, height), &[]).unwrap();
                assert!(found.iter().all(|d| d.bbox.is_finite()));
                assert!(coarse.foreground().is_none_or(|mask| mask.size() == Size::new(width, height)));
            }
        }
    }

    #[test]
    fn what_reaches_the_end_reaches_the_end_of_the_picture() {
        let mut coarse = Coarse::new(detector(0), 100);
        coarse.detect(&frame(0, 602, 301), &[]).unwrap();
        assert_eq!(coarse.step, 4);
        let size = Size::new(602, 301);
        let last = coarse.told(&BBox::from_ltrb(100.0, 20.0, 150.0, 75.0), size);
        assert_eq!(last, BBox::from_ltrb(400.0, 80.0, 602.0, 301.0));
        assert_eq!(coarse.told(&BBox::from_ltrb(1.0, 2.0, 3.0, 4.0), size), BBox::from_ltrb(4.0, 8.0, 12.0, 16.0));
        let mask = Image::from_fn(150, 75, |x, y| if x == 149 || y == 74 { 255 } else { 0 }).unwrap();
        let mut out = Image::filled(1, 1, 0).unwrap();
        enlarge(&mask, 4, size, &mut out).unwrap();
        let wanted = Image::from_fn(602, 301, |x, y| if x >= 596 || y >= 296 { 255 } else { 0 }).unwrap();
        assert_eq!(out, wanted);
        let other = coarse.detect(&frame(1, 600, 301), &[]);
        assert!(matches!(other, Err(TrackingError::FrameSize { expected, .. }) if expected == size));
    }
}
