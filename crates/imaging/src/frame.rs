use crate::{Image, ImageView, ImagingError, Result, Rgb8, Yuv420};
use multiversion::multiversion;
use pursuit_geometry::Size;
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Pixels as a source delivered them.
#[derive(Debug, Clone)]
pub enum Pixels {
    /// 8-bit grey.
    Gray8(Image<u8>),
    /// 16-bit grey: thermal cameras, scientific images.
    Gray16(Image<u16>),
    /// 8-bit colour.
    Rgb8(Image<Rgb8>),
    /// Planar colour straight from a video decoder; converted only if somebody asks for colour.
    Yuv420(Yuv420),
}

/// A derived value: the map's lock is held only to find the slot, the slot's own lock while the value is made.
type DerivedSlot = Arc<OnceLock<Arc<dyn Any + Send + Sync>>>;

/// One moment of a video: pixels, number and time, and whatever is derived from the pixels, computed once and shared.
///
/// A tracker that needs only grey pays for no colour conversion, and several targets in one frame share every derived
/// plane, [`gray`](Self::gray), [`color`](Self::color) and anything computed through [`derived`](Self::derived).
pub struct Frame {
    index: u64,
    time_s: f64,
    pixels: Pixels,
    depth: Option<Image<u16>>,
    gray: OnceLock<Option<Image<u8>>>,
    color: OnceLock<Option<Image<Rgb8>>>,
    derived: Mutex<HashMap<TypeId, DerivedSlot>>,
}

impl Frame {
    /// A frame with its number in the video (from 0) and its time in seconds.
    pub fn new(index: u64, time_s: f64, pixels: Pixels) -> Self {
        Self {
            index,
            time_s,
            pixels,
            depth: None,
            gray: OnceLock::new(),
            color: OnceLock::new(),
            derived: Mutex::default(),
        }
    }

    /// The same frame with a depth image in millimetres (0 = no data), registered to the colour image.
    ///
    /// # Errors
    /// [`ImagingError::Size`] unless the depth image has the frame's size.
    pub fn with_depth(mut self, depth_mm: Image<u16>) -> Result<Self> {
        if depth_mm.size() != self.size() {
            return Err(ImagingError::Size { width: depth_mm.width(), height: depth_mm.height() });
        }
        self.depth = Some(depth_mm);
        Ok(self)
    }

    /// The same pixels under another number and time, for wrappers that drop, repeat or retime frames.
    #[must_use]
    pub fn retimed(mut self, index: u64, time_s: f64) -> Self {
        (self.index, self.time_s) = (index, time_s);
        self
    }

    /// Number of the frame in its video, from 0.
    pub const fn index(&self) -> u64 {
        self.index
    }

    /// Time of the frame in seconds; differences matter, the origin does not.
    pub const fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Width and height.
    pub const fn size(&self) -> Size {
        match &self.pixels {
            Pixels::Gray8(i) => i.size(),
            Pixels::Gray16(i) => i.size(),
            Pixels::Rgb8(i) => i.size(),
            Pixels::Yuv420(i) => i.size(),
        }
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
        self.depth.as_ref().map(Image::view)
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
        let made = self.gray.get_or_init(|| match &self.pixels {
            Pixels::Gray8(_) => None,
            Pixels::Gray16(image) => Some(stretch(image)),
            Pixels::Rgb8(image) => Some(rgb_to_gray(image)),
            Pixels::Yuv420(image) => image.expanded_luma(),
        });
        match (made, &self.pixels) {
            (Some(image), _) | (None, Pixels::Gray8(image)) => image.view(),
            (None, Pixels::Yuv420(image)) => image.luma(),
            (None, _) => unreachable!("grey is made for 16-bit and RGB pixels"),
        }
    }

    /// 8-bit colour; grey input gives equal channels, so that colour code runs on it (see [`has_color`](Self::has_color)).
    pub fn color(&self) -> ImageView<'_, Rgb8> {
        let made = self.color.get_or_init(|| match &self.pixels {
            Pixels::Rgb8(_) => None,
            Pixels::Yuv420(image) => Some(image.to_rgb()),
            Pixels::Gray8(_) | Pixels::Gray16(_) => Some(gray_to_rgb(self.gray())),
        });
        match (made, &self.pixels) {
            (Some(image), _) | (None, Pixels::Rgb8(image)) => image.view(),
            (None, _) => unreachable!("colour is made for all pixels but RGB"),
        }
    }

    /// A value derived from this frame, made by the first caller and shared by all later ones.
    ///
    /// The type is the key: wrap what you share in a type of its own (`struct HsvPlanes(…)`). `make` must depend on the
    /// frame alone. Callers on other threads wait for the one that computes; different types do not wait for each other.
    pub fn derived<T: Any + Send + Sync>(&self, make: impl FnOnce(&Self) -> T) -> Arc<T> {
        // A panicking `make` of another thread leaves the map itself intact, so a poisoned lock is still good.
        let slot =
            self.derived.lock().unwrap_or_else(PoisonError::into_inner).entry(TypeId::of::<T>()).or_default().clone();
        let value = slot.get_or_init(|| Arc::new(make(self))).clone();
        value.downcast().unwrap_or_else(|_| unreachable!("the slot is keyed by its type"))
    }
}

impl std::fmt::Debug for Frame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Frame {{ index: {}, time_s: {}, size: {} }}", self.index, self.time_s, self.size())
    }
}

impl Clone for Frame {
    /// Copies the pixels; derived planes are made anew on demand.
    fn clone(&self) -> Self {
        Self { depth: self.depth.clone(), ..Self::new(self.index, self.time_s, self.pixels.clone()) }
    }
}

fn mapped<P, Q>(image: &Image<P>, data: Vec<Q>) -> Image<Q> {
    Image::from_vec(data, image.width(), image.height()).unwrap_or_else(|_| unreachable!("one pixel for each pixel"))
}

fn rgb_to_gray(image: &Image<Rgb8>) -> Image<u8> {
    let mut data = vec![0; image.size().area()];
    rgb_to_luma(image.as_slice(), &mut data);
    mapped(image, data)
}

/// BT.601 luma in 14-bit fixed point.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn rgb_to_luma(rgb: &[Rgb8], out: &mut [u8]) {
    for (out, &[r, g, b]) in out.iter_mut().zip(rgb) {
        *out = ((u32::from(r) * 4899 + u32::from(g) * 9617 + u32::from(b) * 1868 + 8192) >> 14) as u8;
    }
}

fn gray_to_rgb(gray: ImageView<'_, u8>) -> Image<Rgb8> {
    let data = gray.rows().flatten().map(|&g| [g; 3]).collect();
    Image::from_vec(data, gray.width(), gray.height()).unwrap_or_else(|_| unreachable!("one pixel for each pixel"))
}

/// Stretches 16-bit grey to 8 bits between the 0.1 % and 99.9 % quantiles, so that neither a hot pixel nor a sensor's
/// unused range eats the contrast.
fn stretch(image: &Image<u16>) -> Image<u8> {
    const SHIFT: u32 = 4;
    let mut histogram = vec![0usize; 1 << (16 - SHIFT)];
    image.as_slice().iter().for_each(|&v| histogram[usize::from(v >> SHIFT)] += 1);
    let outliers = image.size().area() / 1000;
    let mut seen = 0;
    let first_past = |&count: &usize| {
        seen += count;
        seen > outliers
    };
    let low = histogram.iter().position(first_past).unwrap_or(0) << SHIFT;
    seen = 0;
    let first_past = |&count: &usize| {
        seen += count;
        seen > outliers
    };
    let high = ((histogram.iter().rposition(first_past).unwrap_or(0) + 1) << SHIFT) - 1;
    let (low, span) = (low as i64, (high as i64 - low as i64).max(1));
    let data = image.as_slice().iter().map(|&v| ((i64::from(v) - low) * 255 / span).clamp(0, 255) as u8).collect();
    mapped(image, data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorMatrix, ColorRange};

    #[test]
    fn gray_borrows_where_it_can_and_converts_where_it_must() {
        let gray = Image::from_fn(3, 2, |x, y| (x + 10 * y) as u8).unwrap();
        let frame = Frame::new(0, 0.0, Pixels::Gray8(gray.clone()));
        assert_eq!(frame.gray().to_image(), gray);
        assert_eq!(frame.color().row(1)[2], [12; 3]);
        assert!(!frame.has_color());

        let rgb = Image::filled(2, 2, [255, 0, 0]).unwrap();
        assert_eq!(Frame::new(0, 0.0, Pixels::Rgb8(rgb)).gray().row(0), [76, 76]);

        let chroma = Image::filled(2, 1, 128u8).unwrap();
        let yuv = |range| Yuv420::new(gray.clone(), chroma.clone(), chroma.clone(), ColorMatrix::Bt601, range).unwrap();
        let full = Frame::new(0, 0.0, Pixels::Yuv420(yuv(ColorRange::Full)));
        assert_eq!(full.gray().to_image(), gray);
    }

    #[test]
    fn sixteen_bit_grey_is_stretched_over_its_own_range() {
        let mut image = Image::from_fn(100, 100, |x, _| 7000 + 10 * x as u16).unwrap();
        image.as_mut_slice()[5] = 65_535; // one hot pixel must not eat the contrast
        let frame = Frame::new(0, 0.0, Pixels::Gray16(image));
        let gray = frame.gray();
        assert!(gray.row(50)[0] < 5 && gray.row(50)[99] > 250, "{:?}", gray.row(50));
        assert_eq!(gray.row(0)[5], 255);
    }

    #[test]
    fn derived_values_are_made_once() {
        struct Mean(f64);
        let frame = Frame::new(0, 0.0, Pixels::Gray8(Image::filled(4, 4, 7).unwrap()));
        let first = frame.derived(|f| Mean(f64::from(f.gray().row(0)[0])));
        let second = frame.derived(|_| -> Mean { panic!("made twice") });
        assert!(Arc::ptr_eq(&first, &second));
        assert_eq!(second.0, 7.0);
    }

    #[test]
    fn depth_must_fit() {
        let frame = || Frame::new(0, 0.0, Pixels::Gray8(Image::filled(4, 4, 7).unwrap()));
        assert!(frame().with_depth(Image::filled(4, 3, 0).unwrap()).is_err());
        assert!(frame().with_depth(Image::filled(4, 4, 900).unwrap()).unwrap().depth_mm().is_some());
    }
}
