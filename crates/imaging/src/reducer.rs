//! Frames at a whole fraction of their size.

use crate::reduce::{MOST_STEP, means};
use crate::{CameraPose, Frame, Image, ImagingError, Lens, Pixels, Result, Rgb8, SharedImage};
use pursuit_geometry::Size;
use std::sync::{Arc, Mutex, Weak};

/// The same moment as a frame, every `step` × `step` pixels of that one.
pub(crate) struct Coarse {
    step: usize,
    frame: Frame,
}

impl Frame {
    /// The same frame with the same moment beside it as somebody saw it who needs no more: every `step` × `step` pixels are one of
    /// `coarse`, as [`reduced`](Self::reduced) makes them. It is made once for all who look at the frame.
    ///
    /// # Errors
    /// [`ImagingError::Registration`] unless it has the frame's size divided by `step`.
    pub fn with_coarse(mut self, step: usize, coarse: Self) -> Result<Self> {
        let side = |pixels: usize| pixels.checked_div(step).unwrap_or(0);
        let wanted = Size::new(side(self.size().width), side(self.size().height));
        if coarse.size() != wanted {
            return Err(ImagingError::Registration { found: coarse.size(), wanted });
        }
        self.coarse = Some(Arc::new(Coarse { step, frame: coarse }));
        Ok(self)
    }

    /// How many pixels each way are one, and the same moment so, where somebody who looked at it coarser left it.
    pub fn coarse(&self) -> Option<(usize, &Self)> {
        self.coarse.as_deref().map(|coarse| (coarse.step, &coarse.frame))
    }

    /// The same moment at a whole fraction of its size: every `step` × `step` pixels (from 1 to 64) are one, their mean, as 8-bit colour
    /// or grey. Pixels at the right and at the bottom that make no whole block are left out. Number, time and the camera's pose stay, its
    /// lens as of the smaller picture; depth and foreground are left out.
    ///
    /// # Errors
    /// [`ImagingError::Size`] when no block fits in the picture, or `step` is out of its range.
    pub fn reduced(&self, step: usize) -> Result<Self> {
        Reducer::default().reduce(self, step)
    }
}

/// Reduces frame after frame, as [`Frame::reduced`] does each, in the memory of those that nobody holds any more.
#[derive(Debug, Default)]
pub struct Reducer {
    /// Buffers that nobody holds.
    spare: Arc<Mutex<Vec<Vec<Rgb8>>>>,
}

/// Buffers that are kept for later frames: one is seen while the one before is still compared with it.
const MOST_SPARE: usize = 2;

/// Pixels that go back to where they came from.
struct Lent {
    pixels: Vec<Rgb8>,
    home: Weak<Mutex<Vec<Vec<Rgb8>>>>,
}

impl AsRef<[Rgb8]> for Lent {
    fn as_ref(&self) -> &[Rgb8] {
        &self.pixels
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let home = self.home.upgrade();
        if let Some(mut spare) = home.as_ref().and_then(|home| home.lock().ok()).filter(|s| s.len() < MOST_SPARE) {
            spare.push(std::mem::take(&mut self.pixels));
        }
    }
}

impl Reducer {
    /// As [`Frame::reduced`].
    ///
    /// # Errors
    /// As [`Frame::reduced`].
    pub fn reduce(&self, frame: &Frame, step: usize) -> Result<Frame> {
        let size = frame.size();
        let [width, height] =
            if (1..=MOST_STEP).contains(&step) { [size.width / step, size.height / step] } else { [0; 2] };
        let pixels = if frame.has_color() {
            let mut pixels = self.spare.lock().ok().and_then(|mut spare| spare.pop()).unwrap_or_default();
            pixels.resize(width * height, [0; 3]);
            let mut out = Image::from_vec(pixels, width, height)?;
            frame.reduced_color([0, 0, size.width, size.height], step, &mut out)?;
            let lent = Lent { pixels: out.into_vec(), home: Arc::downgrade(&self.spare) };
            Pixels::from(SharedImage::from_buffer(lent, width, height, width)?)
        } else {
            let mut out = Image::filled(width, height, 0)?;
            let mut columns = vec![0; width * step];
            for row in 0..height {
                means(frame.gray(), (0, row * step), step, &mut columns, out.row_mut(row));
            }
            Pixels::from(out)
        };
        let small = Frame::new(frame.index(), frame.time_s(), pixels);
        let camera = frame.camera().map(|pose| reduced_pose(pose, size, step)).transpose()?;
        Ok(camera.into_iter().fold(small, Frame::with_camera))
    }
}

/// The pose of a camera that takes pictures of `size` as that of one whose pixels are `step` times as large.
fn reduced_pose(pose: &CameraPose, size: Size, step: usize) -> Result<CameraPose> {
    let [fx, fy, cx, cy] = pose.lens().pinhole_px(size).map(|v| v / step as f64);
    CameraPose::new(pose.time_s(), pose.pan_rad(), pose.tilt_rad(), Lens::intrinsics(fx, fy, cx, cy)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ColorRange;
    use crate::reduce::tests::{noise, slow, yuv};
    use pursuit_geometry::Point;

    #[test]
    fn a_frame_at_a_fraction_shows_the_same_from_the_same_camera() {
        let pose = CameraPose::new(0.3, 0.2, -0.1, Lens::field_of_view(1.1).unwrap()).unwrap();
        let plane = noise(67, 41, 3);
        let gray16 = Image::from_fn(67, 41, |x, y| 256 * u16::from(plane.row(y)[x])).unwrap();
        let pictures: [Pixels; 3] = [plane.clone().into(), gray16.into(), yuv(67, 41, ColorRange::Full).into()];
        for pixels in pictures {
            let frame = Frame::new(7, 0.5, pixels).with_camera(pose);
            for step in [1, 2, 3, 5] {
                let small = frame.reduced(step).unwrap();
                assert_eq!((small.index(), small.time_s(), small.has_color()), (7, 0.5, frame.has_color()));
                assert_eq!(small.size(), Size::new(67 / step, 41 / step));
                for (i, j) in (0..small.size().height).flat_map(|j| (0..small.size().width).map(move |i| (i, j))) {
                    let [want, ..] = slow(&frame, i * step, j * step, step);
                    let got = f64::from(small.color().row(j)[i][0]);
                    assert!((got - want).abs() <= if frame.has_color() { 24.0 } else { 0.51 }, "{step}: {got} {want}");
                }
                let place = Point::new(12.0, 30.0);
                let (k, camera) = (step as f64, small.camera().unwrap());
                let seen = camera.direction_of(Point::new(place.x / k, place.y / k), small.size());
                let wanted = pose.direction_of(place, frame.size());
                assert!(
                    (seen.pan_rad - wanted.pan_rad).abs() < 1e-12 && (seen.tilt_rad - wanted.tilt_rad).abs() < 1e-12
                );
            }
            for step in [0, 42, 65, usize::MAX] {
                assert!(frame.reduced(step).is_err(), "{step}");
            }
        }
    }

    #[test]
    fn a_coarser_frame_must_fit_and_is_of_the_same_pixels_and_moment() {
        let frame = Frame::new(0, 0.0, noise(7, 4, 3));
        let reduced = |step| frame.reduced(step).unwrap();
        let wrong = frame.clone().with_coarse(3, reduced(2));
        let (found, wanted) = (Size::new(3, 2), Size::new(2, 1));
        assert_eq!(wrong.unwrap_err(), ImagingError::Registration { found, wanted });
        assert!(frame.clone().with_coarse(0, reduced(2)).is_err() && frame.coarse().is_none());
        let seen = frame.clone().with_coarse(2, reduced(2)).unwrap();
        let (step, coarse) = seen.coarse().unwrap();
        assert_eq!((step, coarse.gray().to_image()), (2, reduced(2).gray().to_image()));
        assert!(seen.clone().retimed(1, 0.1).coarse().is_none());
        assert!(seen.with_pixels(noise(7, 4, 5)).unwrap().coarse().is_none());
    }

    #[test]
    fn memory_that_nobody_holds_serves_the_next_frame() {
        let reducer = Reducer::default();
        let frame = |seed| Frame::new(0, 0.0, Image::from_fn(9, 6, |x, y| [(seed * (x + 9 * y)) as u8; 3]).unwrap());
        let held = reducer.reduce(&frame(1), 2).unwrap();
        let first = reducer.reduce(&frame(2), 2).unwrap();
        let at = first.color().row(0).as_ptr();
        assert_ne!(at, held.color().row(0).as_ptr());
        drop(first);
        let next = reducer.reduce(&frame(3), 2).unwrap();
        assert_eq!(next.color().row(0).as_ptr(), at);
        assert_eq!(next.color().to_image(), frame(3).reduced(2).unwrap().color().to_image());
        assert_eq!(held.color().to_image(), frame(1).reduced(2).unwrap().color().to_image(), "it is still held");
        let held: Vec<Frame> = (0..9).map(|k| reducer.reduce(&frame(k), 2).unwrap()).collect();
        drop((held, next));
        assert_eq!(reducer.spare.lock().unwrap().len(), MOST_SPARE);
    }
}
