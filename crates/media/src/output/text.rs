//! Text from the fixed fonts of the X Window System (public domain, as packaged by `embedded-graphics`): hinted by hand for
//! these sizes, hence readable in small pictures; enlarged by whole factors in large ones.

use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point as Pixel2, Size as Size2};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle, iso_8859_1};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::text::{Baseline, Text};
use pursuit_geometry::Point;
use pursuit_imaging::{Image, Rgb8};
use std::convert::Infallible;

/// The largest font that does not exceed a height, and by what it is enlarged.
fn font(height_px: f64) -> (&'static MonoFont<'static>, u32) {
    if height_px >= 40.0 {
        // `as` saturates and maps NaN to 0; neither gets here.
        return (&iso_8859_1::FONT_10X20, ((height_px / 20.0) as u32).min(64));
    }
    let font = match height_px {
        h if h >= 20.0 => &iso_8859_1::FONT_10X20,
        h if h >= 15.0 => &iso_8859_1::FONT_9X15_BOLD,
        h if h >= 13.0 => &iso_8859_1::FONT_7X13_BOLD,
        _ => &iso_8859_1::FONT_6X10,
    };
    (font, 1)
}

/// A height readable in a picture of this size: 10 px at 320 × 240, 15 at 640 × 480, 20 at 1280 × 720, 40 at 1920 × 1080
/// and above.
pub(super) fn readable_height_px(width: usize, height: usize) -> f64 {
    match (width as f64 / 640.0).min(height as f64 / 480.0) {
        s if s < 0.7 => 10.0,
        s if s < 0.95 => 13.0,
        s if s < 1.4 => 15.0,
        s if s < 2.0 => 20.0,
        s => 20.0 * (s * 0.9).round().clamp(1.0, 8.0),
    }
}

pub(super) fn size(text: &str, height_px: f64) -> (f64, f64) {
    let (font, factor) = font(height_px);
    let longest = text.lines().map(|l| l.chars().count()).max().unwrap_or(0);
    let cell = font.character_size;
    let (width, height) =
        (longest as f64 * f64::from(cell.width), text.lines().count().max(1) as f64 * f64::from(cell.height));
    (width * f64::from(factor), height * f64::from(factor))
}

/// Draws `text` with its top left corner at the whole pixel nearest to `at`; `paint` colours each pixel that is ink.
pub(super) fn draw(image: &mut Image<Rgb8>, at: Point, text: &str, height_px: f64, paint: impl FnMut(&mut Rgb8)) {
    let (x, y) = (at.x.round(), at.y.round());
    let reachable = |v: f64| v.abs() < 1e6;
    if !(reachable(x) && reachable(y)) {
        return;
    }
    let (font, factor) = font(height_px);
    let mut ink = Ink { image, left: x as i64, top: y as i64, factor: i64::from(factor), paint };
    let style = MonoTextStyle::new(font, BinaryColor::On);
    // Drawing into memory cannot fail: the error type has no values.
    let Ok(_) = Text::with_baseline(text, Pixel2::zero(), style, Baseline::Top).draw(&mut ink);
}

/// Turns the font's pixels into (blocks of) the picture's.
struct Ink<'a, F> {
    image: &'a mut Image<Rgb8>,
    left: i64,
    top: i64,
    factor: i64,
    paint: F,
}

impl<F> OriginDimensions for Ink<'_, F> {
    fn size(&self) -> Size2 {
        Size2::new(self.image.width() as u32, self.image.height() as u32)
    }
}

impl<F: FnMut(&mut Rgb8)> DrawTarget for Ink<'_, F> {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = embedded_graphics::Pixel<BinaryColor>>,
    {
        let (width, height) = (self.image.width() as i64, self.image.height() as i64);
        for embedded_graphics::Pixel(at, color) in pixels {
            if color.is_off() {
                continue;
            }
            let (left, top) = (self.left + i64::from(at.x) * self.factor, self.top + i64::from(at.y) * self.factor);
            for y in top.max(0)..(top + self.factor).min(height) {
                for x in left.max(0)..(left + self.factor).min(width) {
                    (self.paint)(&mut self.image.row_mut(y as usize)[x as usize]);
                }
            }
        }
        Ok(())
    }
}
