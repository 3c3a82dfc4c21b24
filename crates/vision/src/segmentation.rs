//! From a smoothed colour image to a binary mask.

use crate::color::{HsvRange, RangeTest, range_row};
use crate::smoothing::SmoothedColor;
use multiversion::multiversion;
use pursuit_imaging::{Image, ImageView, Result};

/// Marks the pixels of `smoothed` whose colour lies in `range` with 255, all others with 0.
///
/// Exactly what converting to HSV with [`rgb_to_hsv`](crate::color::rgb_to_hsv) and testing each pixel gives, without a
/// division per pixel.
///
/// # Errors
/// Never for an image that exists.
pub fn in_range(smoothed: &SmoothedColor, range: &HsvRange, mask: &mut Image<u8>) -> Result<()> {
    let [red, green, blue] = smoothed.planes();
    mask.resize_for_overwrite(red.size(), 0)?;
    let test = RangeTest::new(range);
    for y in 0..red.height() {
        range_row(red.row(y), green.row(y), blue.row(y), &test, mask.row_mut(y));
    }
    Ok(())
}

/// Marks the pixels that are at least `level` with 255, all others with 0.
///
/// # Errors
/// Never for an image that exists.
pub fn threshold(image: ImageView<'_, u8>, level: u8, mask: &mut Image<u8>) -> Result<()> {
    mask.resize_for_overwrite(image.size(), 0)?;
    for y in 0..image.height() {
        threshold_row(image.row(y), level, mask.row_mut(y));
    }
    Ok(())
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn threshold_row(row: &[u8], level: u8, mask: &mut [u8]) {
    for (mask, &value) in mask.iter_mut().zip(row) {
        *mask = if value >= level { 255 } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::rgb_to_hsv;
    use crate::window::PixelWindow;

    #[test]
    fn the_fused_pipeline_equals_the_plain_one() {
        let image = Image::from_fn(67, 41, |x, y| [(x * 7 + y) as u8, (y * 5) as u8, (x * x) as u8]).unwrap();
        let mut smoothed = SmoothedColor::new();
        smoothed.smooth(image.view(), PixelWindow { x: 3, y: 2, width: 60, height: 35 }).unwrap();
        let mut mask = Image::filled(1, 1, 0).unwrap();
        for (hue_low, hue_high) in [(5, 60), (160, 20)] {
            let range = HsvRange { hue_low, hue_high, saturation_low: 40, value_low: 50, ..HsvRange::ALL };
            in_range(&smoothed, &range, &mut mask).unwrap();
            let plain =
                Image::from_fn(60, 35, |x, y| if range.contains(rgb_to_hsv(smoothed.pixel(x, y))) { 255u8 } else { 0 });
            assert_eq!(mask, plain.unwrap());
            assert!(mask.as_slice().contains(&255) && mask.as_slice().contains(&0));
        }
    }

    #[test]
    fn threshold_is_inclusive() {
        let image = Image::from_vec(vec![0, 99, 100, 101, 255, 7], 3, 2).unwrap();
        let mut mask = Image::filled(1, 1, 0).unwrap();
        threshold(image.view(), 100, &mut mask).unwrap();
        assert_eq!(mask.as_slice(), [0, 0, 255, 255, 255, 0]);
    }
}
