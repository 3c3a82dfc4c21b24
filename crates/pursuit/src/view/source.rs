use super::{Resize, pose_of_input, view};
use crate::RunError;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, Pixels, SharedImage};
use pursuit_media::{MediaError, Source, SourceInfo, StopHandle, View};
use pursuit_vision::sampling::{Planes, Sampler, Window};

/// The part `region` of each picture of `source`, `[left, top, width, height]` in its pixels, brought to the size `resize`.
/// Numbers and times stay; depth is cut alike, and resized without mixing near and far.
///
/// Boxes stay in pixels of the whole picture: a [`Session`](crate::Session) over the part is given such boxes, and says such.
///
/// # Errors
/// A region that does not lie in the picture, sizes out of range, or a source that shows a part already.
pub fn part_of(
    source: Box<dyn Source>,
    region: Option<[f64; 4]>,
    resize: Option<Resize>,
) -> Result<Box<dyn Source>, RunError> {
    let info = source.info();
    let view = view(info.size, region, resize)?;
    if view.is_some() && info.view.is_some() {
        return Err(RunError::usage(format!("{} is seen in part already; name one region and one size", info.name)));
    }
    Ok(match view {
        Some(view) => Box::new(Viewed::new(source, view)),
        None => source,
    })
}

/// Shows a part of each picture of a source, at another size.
struct Viewed {
    source: Box<dyn Source>,
    info: SourceInfo,
    view: View,
    sampler: Sampler,
    planes: Planes,
}

impl Viewed {
    fn new(source: Box<dyn Source>, view: View) -> Self {
        let size = view.size();
        let info = SourceInfo { size, view: Some(view), ..source.info().clone() };
        Self { source, info, view, sampler: Sampler::new(), planes: Planes::new(size, 3) }
    }

    fn shown(&mut self, frame: &Frame) -> Result<Frame, MediaError> {
        let [x, y, width, height] = self.view.region;
        let (name, frame_number) = (self.info.name.clone(), frame.index());
        let broken = |reason: String| MediaError::Broken { name: name.clone(), frame: frame_number, reason };
        let outside = || broken("its size changed, and the region is no part of it any more".to_owned());
        let pixels = frame.pixels().crop(x, y, width, height).ok_or_else(outside)?;
        let depth = frame.depth_mm().map(|d| d.crop(x, y, width, height).ok_or_else(outside)).transpose()?;
        let size = self.view.size();
        let depth = depth.map(|depth| nearest(size, |x, y| depth.row(y)[x], depth.size()));
        let pixels = if pixels.size() == size { pixels } else { self.resized(pixels) };
        let shown = Frame::new(frame.index(), frame.time_s(), pixels);
        let pose = frame.camera().and_then(|pose| pose_of_input(&self.view, pose));
        let shown = pose.map_or(shown.clone(), |pose| shown.with_camera(pose));
        let shown = depth.map_or(Ok(shown.clone()), |depth| shown.with_depth(depth));
        shown.map_err(|e| broken(e.to_string()))
    }

    fn resized(&mut self, pixels: Pixels) -> Pixels {
        let (from, size) = (pixels.size(), self.view.size());
        let whole = BBox::from_ltwh(0.0, 0.0, from.width as f64, from.height as f64);
        let window = Window::of_region(whole, size);
        let code = |value: f32| value.round().clamp(0.0, 255.0) as u8;
        if let Pixels::Gray16(image) = &pixels {
            return nearest(size, |x, y| image.view().row(y)[x], from).into();
        }
        let frame = Frame::new(0, 0.0, pixels);
        if frame.has_color() {
            self.sampler.color(frame.color(), &window, &mut self.planes);
            let [r, g, b] = [0, 1, 2].map(|c| self.planes.plane(c));
            image(size, |i| [code(r[i]), code(g[i]), code(b[i])]).into()
        } else {
            self.sampler.gray(frame.gray(), &window, &mut self.planes);
            let gray = self.planes.plane(0);
            image(size, |i| code(gray[i])).into()
        }
    }
}

/// An image of pixels in the order of rows.
fn image<P: Copy + Send + Sync + 'static>(size: Size, pixel: impl Fn(usize) -> P) -> SharedImage<P> {
    let made = Image::from_fn(size.width, size.height, |x, y| pixel(y * size.width + x));
    made.unwrap_or_else(|_| unreachable!("the size of a view was checked")).into()
}

/// Each pixel that of the input which lies under its centre.
fn nearest(size: Size, pixel: impl Fn(usize, usize) -> u16, from: Size) -> SharedImage<u16> {
    let at = |i: usize, to: usize, from: usize| ((2 * i + 1) * from / (2 * to)).min(from - 1);
    image(size, |i| pixel(at(i % size.width, size.width, from.width), at(i / size.width, size.height, from.height)))
}

impl Source for Viewed {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, MediaError> {
        self.source.next_frame()?.map(|frame| self.shown(&frame)).transpose()
    }

    fn seek(&mut self, index: u64) -> Result<(), MediaError> {
        self.source.seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use pursuit_imaging::Yuv420;
    use pursuit_imaging::{ColorMatrix, ColorRange};

    fn viewed(region: [f64; 4], resize: Option<&str>, pixels: Pixels, depth: bool) -> Frame {
        let source = crate::open("scene:drift?seed=7&duration=1").unwrap();
        let view = view(pixels.size(), Some(region), resize.map(|r| r.parse().unwrap())).unwrap().unwrap();
        let mut frame = Frame::new(3, 0.5, pixels);
        if depth {
            let size = frame.size();
            frame = frame
                .with_depth(Image::from_fn(size.width, size.height, |x, y| (100 * y + x) as u16).unwrap())
                .unwrap();
        }
        let shown = Viewed::new(source, view).shown(&frame).unwrap();
        assert_eq!((shown.index(), shown.time_s(), shown.size()), (3, 0.5, view.size()));
        shown
    }

    fn gray() -> Image<u8> {
        Image::from_fn(40, 30, |x, y| (2 * x + 4 * y) as u8).unwrap()
    }

    #[test]
    fn pixels_of_the_part_come_unchanged_and_depth_with_them() {
        let part = viewed([10.0, 6.0, 20.0, 16.0], None, gray().into(), true);
        assert_eq!((part.gray().row(0)[0], part.gray().row(15)[19]), (44, 2 * 29 + 4 * 21));
        assert_eq!(part.depth_mm().unwrap().row(3)[4], 100 * 9 + 14);
        let chroma = |k: usize| Image::from_fn(20, 15, |x, y| (k * x + y) as u8).unwrap();
        let yuv = Yuv420::new(gray(), chroma(1), chroma(3), ColorMatrix::Bt709, ColorRange::Full).unwrap();
        let part = viewed([10.0, 6.0, 21.0, 17.0], None, yuv.clone().into(), false);
        let Pixels::Yuv420(planes) = part.pixels() else { panic!("video stays planar") };
        assert_eq!((planes.chroma().0.row(0)[0], planes.chroma().1.row(8)[10]), (5 + 3, 3 * 15 + 11));
        assert_eq!((planes.matrix(), planes.range()), (ColorMatrix::Bt709, ColorRange::Full));
        assert_eq!(part.color().row(4)[7], Frame::new(0, 0.0, yuv).color().row(10)[17]);
    }

    #[test]
    fn resized_pictures_are_means_and_depth_is_not_mixed() {
        let half = viewed([0.0, 0.0, 40.0, 30.0], Some("0.5"), gray().into(), true);
        // A ramp stays a ramp: the centre of pixel (5, 5) lies at (11, 11), between four pixels.
        assert_eq!(half.gray().row(5)[5], 2 * 21 / 2 + 4 * 21 / 2);
        assert_eq!(half.depth_mm().unwrap().row(5)[5], 100 * 11 + 11);
        let color = Image::from_fn(40, 30, |x, y| [(2 * x) as u8, (4 * y) as u8, 9]).unwrap();
        let double = viewed([0.0, 0.0, 40.0, 30.0], Some("80x30"), color.into(), false);
        assert_eq!(double.color().row(10)[21], [21, 40, 9]);
        let deep = Image::from_fn(40, 30, |x, _| if x < 20 { 500_u16 } else { 60_000 }).unwrap();
        let deep = viewed([0.0, 0.0, 40.0, 30.0], Some("15x15"), deep.into(), false);
        let values: std::collections::BTreeSet<u16> = deep.gray16().unwrap().rows().flatten().copied().collect();
        assert_eq!(values, [500, 60_000].into());
    }
}
