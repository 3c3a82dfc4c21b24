use crate::convert::{gray_to_rgb, rgb_to_gray, stretch};
use crate::reducer::Coarse;
use crate::shared::check_size;
use crate::{CameraPose, Image, ImageView, ImagingError, Pixels, Result, Rgb8, SharedImage};
use pursuit_geometry::Size;
use std::sync::{Arc, OnceLock};

/// One moment of a video: pixels, number and time, what belongs to them (depth, the camera's pose), and the planes that are
/// derived from the pixels, made once and shared.
///
/// A tracker that needs only grey pays for no colour conversion, and several targets in one frame share its
/// [`gray`](Self::gray) and [`color`](Self::color). Clones share everything, also planes that are derived later: a clone
/// costs a few counters and no pixel, so a tracker may keep the frame before, and a sink may send frames to another thread.
///
/// ```
/// use pursuit_imaging::{Frame, Image};
///
/// let red = Image::filled(640, 480, [255, 0, 0])?;
/// let frame = Frame::new(0, 0.0, red);
/// let clone = frame.clone();
/// assert_eq!(clone.gray().row(0)[0], 76, "BT.601 luma of red");
/// assert!(std::ptr::eq(clone.gray().row(0), frame.gray().row(0)), "made once, by whoever asked first");
/// # Ok::<(), pursuit_imaging::ImagingError>(())
/// ```
#[derive(Clone)]
pub struct Frame {
    index: u64,
    time_s: f64,
    camera: Option<CameraPose>,
    pixels: Pixels,
    depth_mm: Option<SharedImage<u16>>,
    foreground: Option<Arc<Image<u8>>>,
    pub(crate) coarse: Option<Arc<Coarse>>,
    derived: Arc<Derived>,
}

/// What is made of the pixels on demand; `None` inside where the pixels themselves serve.
#[derive(Default)]
struct Derived {
    brightness: OnceLock<f64>,
    gray: OnceLock<Option<Image<u8>>>,
    color: OnceLock<Option<Image<Rgb8>>>,
}

impl Frame {
    /// A frame with its number in the video (from 0) and its time in seconds. `pixels` may be an
    /// [`Image`], a [`SharedImage`] or a [`Yuv420`](crate::Yuv420).
    pub fn new(index: u64, time_s: f64, pixels: impl Into<Pixels>) -> Self {
        let (pixels, derived) = (pixels.into(), Arc::default());
        Self { index, time_s, camera: None, pixels, depth_mm: None, foreground: None, coarse: None, derived }
    }

    /// The same frame with a depth image in millimetres (0 = no data), registered to the colour image.
    ///
    /// # Errors
    /// [`ImagingError::Registration`](crate::ImagingError::Registration) unless the depth image has the frame's size.
    pub fn with_depth(mut self, depth_mm: impl Into<SharedImage<u16>>) -> Result<Self> {
        let depth_mm = depth_mm.into();
        check_size(&depth_mm, self.size())?;
        self.depth_mm = Some(depth_mm);
        Ok(self)
    }

    /// The same frame with what stands out of the scene: 255 where something does, else 0. Whoever models the scene says it once for
    /// all who look at the frame.
    ///
    /// # Errors
    /// [`ImagingError::Registration`](crate::ImagingError::Registration) unless it has the frame's size.
    pub fn with_foreground(mut self, foreground: Arc<Image<u8>>) -> Result<Self> {
        if foreground.size() != self.size() {
            return Err(ImagingError::Registration { found: foreground.size(), wanted: self.size() });
        }
        self.foreground = Some(foreground);
        Ok(self)
    }

    /// The same frame with the pose in which its camera took it.
    #[must_use]
    pub const fn with_camera(mut self, camera: CameraPose) -> Self {
        self.camera = Some(camera);
        self
    }

    /// The same pixels under another number and time, for wrappers that drop, repeat or retime frames.
    #[must_use]
    pub fn retimed(self, index: u64, time_s: f64) -> Self {
        Self { index, time_s, coarse: None, ..self }
    }

    /// The same frame with other pixels of the same size and kind of content (spoiled, stabilised): number, time, depth and
    /// camera stay, derived planes are made anew.
    ///
    /// # Errors
    /// [`ImagingError::Registration`](crate::ImagingError::Registration) when the size differs and there is depth.
    pub fn with_pixels(&self, pixels: impl Into<Pixels>) -> Result<Self> {
        let pixels = pixels.into();
        self.depth_mm.as_ref().map_or(Ok(()), |depth| check_size(depth, pixels.size()))?;
        Ok(Self { pixels, coarse: None, derived: Arc::default(), ..self.clone() })
    }

    /// The same frame as its source delivered it: pixels shared, no plane derived yet. Whoever is shown such a frame pays
    /// for the planes that it needs, which is what a comparison of speeds wants.
    #[must_use]
    pub fn undecorated(&self) -> Self {
        Self { derived: Arc::default(), ..self.clone() }
    }

    /// Number of the frame in its video, from 0.
    pub const fn index(&self) -> u64 {
        self.index
    }

    /// Time of the frame in seconds; differences matter, the origin does not.
    pub const fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Where the camera looked when it took the frame, where that is known.
    pub const fn camera(&self) -> Option<&CameraPose> {
        self.camera.as_ref()
    }

    /// Width and height.
    pub const fn size(&self) -> Size {
        self.pixels.size()
    }

    /// The pixels as delivered.
    pub const fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// Whether the source delivered colour.
    pub const fn has_color(&self) -> bool {
        matches!(self.pixels, Pixels::Rgb8(_) | Pixels::Yuv420(_))
    }

    /// Depth in millimetres (0 = no data), where there is any.
    pub fn depth_mm(&self) -> Option<ImageView<'_, u16>> {
        self.depth_mm.as_ref().map(SharedImage::view)
    }

    /// What stands out of the scene, 255, and what does not, 0, where somebody who models the scene has said so.
    pub fn foreground(&self) -> Option<ImageView<'_, u8>> {
        self.foreground.as_ref().map(|image| image.view())
    }

    /// 16-bit grey as delivered, where the source is 16-bit.
    pub fn gray16(&self) -> Option<ImageView<'_, u16>> {
        match &self.pixels {
            Pixels::Gray16(image) => Some(image.view()),
            _ => None,
        }
    }

    /// 8-bit grey (BT.601 luma of colour). 16-bit input is stretched between its 0.1 % and 99.9 % quantiles.
    pub fn gray(&self) -> ImageView<'_, u8> {
        let made = self.derived.gray.get_or_init(|| match &self.pixels {
            Pixels::Gray8(_) => None,
            Pixels::Gray16(image) => Some(stretch(image.view())),
            Pixels::Rgb8(image) => Some(rgb_to_gray(image.view())),
            Pixels::Yuv420(image) => image.expanded_luma(),
        });
        match (made, &self.pixels) {
            (Some(image), _) => image.view(),
            (None, Pixels::Gray8(image)) => image.view(),
            (None, Pixels::Yuv420(image)) => image.luma(),
            (None, _) => unreachable!("grey is made for 16-bit and RGB pixels"),
        }
    }

    /// How bright the picture is: the mean grey level, 0 to 255, of every fourth pixel of every fourth row. What a lamp, a cloud or a
    /// camera's exposure does to all of the picture shows here, whatever it shows.
    pub fn brightness(&self) -> f64 {
        *self.derived.brightness.get_or_init(|| match &self.pixels {
            Pixels::Rgb8(image) => sparse_mean(image.view(), |&[r, g, b]| {
                (299 * u64::from(r) + 587 * u64::from(g) + 114 * u64::from(b)) as f64 / 1000.0
            }),
            Pixels::Yuv420(image) => image.level(sparse_mean(image.luma(), |&code| f64::from(code))),
            Pixels::Gray8(_) | Pixels::Gray16(_) => sparse_mean(self.gray(), |&v| f64::from(v)),
        })
    }

    /// 8-bit colour; grey input gives equal channels, so that colour code runs on it (see [`has_color`](Self::has_color)).
    pub fn color(&self) -> ImageView<'_, Rgb8> {
        let made = self.derived.color.get_or_init(|| match &self.pixels {
            Pixels::Rgb8(_) => None,
            Pixels::Yuv420(image) => Some(image.to_rgb()),
            Pixels::Gray8(_) | Pixels::Gray16(_) => Some(gray_to_rgb(self.gray())),
        });
        match (made, &self.pixels) {
            (Some(image), _) => image.view(),
            (None, Pixels::Rgb8(image)) => image.view(),
            (None, _) => unreachable!("colour is made for all pixels but RGB"),
        }
    }

    /// Whether colour was made of the pixels already.
    pub(crate) fn has_derived_color(&self) -> bool {
        matches!(self.derived.color.get(), Some(Some(_)))
    }

    /// Bytes that the frame keeps alive: pixels and depth as delivered, without what is derived from them.
    pub fn source_bytes(&self) -> usize {
        self.pixels.bytes() + self.depth_mm.as_ref().map_or(0, |depth| 2 * depth.size().area())
    }
}

/// The mean of what `of` says of every fourth pixel of every fourth row.
fn sparse_mean<P>(image: ImageView<'_, P>, of: impl Fn(&P) -> f64) -> f64 {
    const STEP: usize = 4;
    let count = image.width().div_ceil(STEP) * image.height().div_ceil(STEP);
    let row = |row: &[P]| row.iter().step_by(STEP).map(&of).sum::<f64>();
    image.rows().step_by(STEP).map(row).sum::<f64>() / count as f64
}

impl std::fmt::Debug for Frame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Frame {{ index: {}, time_s: {}, size: {} }}", self.index, self.time_s, self.size())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorMatrix, ColorRange, Lens, Yuv420};

    fn gray(width: usize, height: usize) -> Image<u8> {
        Image::from_fn(width, height, |x, y| (x + 10 * y) as u8).unwrap()
    }

    #[test]
    fn gray_borrows_where_it_can_and_converts_where_it_must() {
        let image = gray(3, 2);
        let frame = Frame::new(0, 0.0, image.clone());
        assert_eq!(frame.gray().to_image(), image);
        assert_eq!(frame.color().row(1)[2], [12; 3]);
        assert!(!frame.has_color());

        let frame = Frame::new(0, 0.0, Image::filled(2, 2, [255, 0, 0]).unwrap());
        assert_eq!(frame.gray().row(0), [76, 76]);
        assert!(frame.has_color() && frame.gray16().is_none());

        let chroma = Image::filled(2, 1, 128u8).unwrap();
        let yuv =
            |range| Yuv420::new(image.clone(), chroma.clone(), chroma.clone(), ColorMatrix::Bt601, range).unwrap();
        let full = Frame::new(0, 0.0, yuv(ColorRange::Full));
        assert_eq!(full.gray().to_image(), image);
        assert!(full.has_color());
        let limited = Frame::new(0, 0.0, yuv(ColorRange::Limited));
        assert_eq!((limited.gray().row(0)[0], limited.gray().row(1)[2]), (0, 0), "codes up to 16 are black");
    }

    #[test]
    fn pixels_in_a_strided_buffer_are_as_good_as_any() {
        // A buffer of twelve columns of which four, from the third on, are the picture.
        let crop = |image: Image<[u8; 3]>| SharedImage::from(image).crop(2, 1, 4, 3).unwrap();
        let image = Image::from_fn(12, 5, |x, y| [20 * x as u8, 50 * y as u8, 7]).unwrap();
        let tight = crop(image.clone()).to_image();
        let (wide, tight) = (Frame::new(0, 0.0, crop(image)), Frame::new(0, 0.0, tight));
        assert_eq!(wide.gray().to_image(), tight.gray().to_image());
        assert_eq!(wide.color().to_image(), tight.color().to_image());

        let image = Image::from_fn(12, 5, |x, y| 999 * x as u16 + y as u16).unwrap();
        let crop = SharedImage::from(image).crop(2, 1, 4, 3).unwrap();
        let tight = Frame::new(0, 0.0, crop.to_image());
        assert_eq!(Frame::new(0, 0.0, crop).gray().to_image(), tight.gray().to_image());
    }

    #[test]
    fn a_picture_is_as_bright_as_its_grey_levels_whatever_holds_them() {
        let mean = |frame: &Frame| {
            let gray = frame.gray();
            let seen = (0..21).step_by(4).flat_map(|y| (0..33).step_by(4).map(move |x| f64::from(gray.row(y)[x])));
            seen.sum::<f64>() / 54.0
        };
        let level = |x: usize, y: usize| (40 + 3 * x + 4 * y) as u8;
        let luma = Image::from_fn(33, 21, level).unwrap();
        let color = Image::from_fn(33, 21, |x, y| [level(x, y), level(y, x), 9]).unwrap();
        let chroma = Image::filled(17, 11, 90u8).unwrap();
        let yuv = |range| Yuv420::new(luma.clone(), chroma.clone(), chroma.clone(), ColorMatrix::Bt601, range).unwrap();
        let pixels: [Pixels; 5] = [
            luma.clone().into(),
            color.into(),
            yuv(ColorRange::Limited).into(),
            yuv(ColorRange::Full).into(),
            Image::from_fn(33, 21, |x, y| 100 * u16::from(level(x, y))).unwrap().into(),
        ];
        for pixels in pixels {
            let frame = Frame::new(0, 0.0, pixels);
            assert!((frame.brightness() - mean(&frame)).abs() < 0.5, "{} for {}", frame.brightness(), mean(&frame));
        }
    }

    #[test]
    fn sixteen_bit_grey_is_stretched_over_its_own_range() {
        let mut image = Image::from_fn(100, 100, |x, _| 7000 + 10 * x as u16).unwrap();
        image.as_mut_slice()[5] = 65_535; // one hot pixel must not eat the contrast
        let frame = Frame::new(0, 0.0, image);
        let gray = frame.gray();
        assert!(gray.row(50)[0] < 5 && gray.row(50)[99] > 250, "{:?}", gray.row(50));
        assert_eq!(gray.row(0)[5], 255);
        assert_eq!(frame.gray16().unwrap().row(1)[3], 7030);
    }

    #[test]
    fn clones_share_pixels_and_derived_planes_and_undecorated_ones_pixels_alone() {
        let frame = Frame::new(0, 0.0, Image::from_fn(40, 30, |x, y| [x as u8, y as u8, 9]).unwrap());
        let clone = frame.clone();
        let derived = clone.gray().row(0).as_ptr();
        assert_eq!(frame.gray().row(0).as_ptr(), derived, "a plane derived through a clone is there for all");
        assert_eq!(frame.clone().retimed(7, 0.5).gray().row(0).as_ptr(), derived);
        let bare = frame.undecorated();
        assert_eq!(bare.color().row(0).as_ptr(), frame.color().row(0).as_ptr(), "the pixels are the same");
        assert_ne!(bare.gray().row(0).as_ptr(), derived, "what was derived is not");
        assert_eq!((bare.index(), bare.time_s(), bare.gray().to_image()), (0, 0.0, frame.gray().to_image()));
    }

    #[test]
    fn depth_must_fit_and_is_shared() {
        let frame = Frame::new(3, 0.1, gray(4, 4));
        let wrong = frame.clone().with_depth(Image::filled(4, 3, 0).unwrap());
        assert_eq!(wrong.unwrap_err(), ImagingError::Registration { found: Size::new(4, 3), wanted: Size::new(4, 4) });
        let depth = SharedImage::from(Image::filled(4, 4, 900).unwrap());
        let frame = frame.with_depth(depth.clone()).unwrap();
        let seen = frame.depth_mm().unwrap();
        assert_eq!((seen.row(3)[3], seen.row(0).as_ptr()), (900, depth.view().row(0).as_ptr()));
        assert_eq!(frame.undecorated().depth_mm().unwrap().row(0).as_ptr(), depth.view().row(0).as_ptr());
        assert_eq!(frame.source_bytes(), 16 + 32);
    }

    #[test]
    fn foreground_must_fit_and_is_shared() {
        let frame = Frame::new(0, 0.0, gray(4, 4));
        assert!(frame.foreground().is_none());
        let wrong = frame.clone().with_foreground(Arc::new(gray(4, 3)));
        assert_eq!(wrong.unwrap_err(), ImagingError::Registration { found: Size::new(4, 3), wanted: Size::new(4, 4) });
        let mask = Arc::new(Image::from_fn(4, 4, |x, _| if x == 2 { 255 } else { 0 }).unwrap());
        let seen = frame.clone().with_foreground(mask.clone()).unwrap();
        assert_eq!(seen.foreground().unwrap().row(3), [0, 0, 255, 0]);
        assert_eq!(seen.clone().foreground().unwrap().row(0).as_ptr(), mask.row(0).as_ptr());
        assert_eq!(seen.gray().row(0).as_ptr(), frame.gray().row(0).as_ptr(), "the pixels are the same");
    }

    #[test]
    fn other_pixels_keep_what_belongs_to_the_moment() {
        let pose = CameraPose::new(0.1, 0.2, -0.1, Lens::field_of_view(1.0).unwrap()).unwrap();
        let depth = Image::filled(4, 4, 900).unwrap();
        let frame = Frame::new(3, 0.1, gray(4, 4)).with_depth(depth).unwrap().with_camera(pose);
        let derived = frame.color().row(0).as_ptr();
        let other = frame.with_pixels(Image::filled(4, 4, 5u8).unwrap()).unwrap();
        assert_eq!((other.index(), other.time_s(), other.camera()), (3, 0.1, Some(&pose)));
        assert!(other.depth_mm().is_some() && other.color().row(0).as_ptr() != derived);
        assert_eq!(other.color().row(0)[0], [5; 3]);
        assert!(frame.with_pixels(gray(5, 4)).is_err());
    }

    #[test]
    fn bytes_are_those_of_the_source() {
        let image = || Image::filled(6, 5, 0u8).unwrap();
        let chroma = || Image::filled(3, 3, 0u8).unwrap();
        let yuv = Yuv420::new(image(), chroma(), chroma(), ColorMatrix::Bt601, ColorRange::Full).unwrap();
        let bytes = |pixels: Pixels| Frame::new(0, 0.0, pixels).source_bytes();
        assert_eq!(bytes(image().into()), 30);
        assert_eq!(bytes(Image::filled(6, 5, 0u16).unwrap().into()), 60);
        assert_eq!(bytes(Image::filled(6, 5, [0u8; 3]).unwrap().into()), 90);
        assert_eq!(bytes(yuv.into()), 48);
    }
}
