//! Hue, saturation, value; and ranges of colour in it.
//!
//! Conventions of 8-bit HSV as the field's libraries have them: hue in half degrees `0..180`, saturation and value
//! `0..=255`. Conversion is exact (rounded half up), not by tables.

use multiversion::multiversion;
use pursuit_imaging::Rgb8;
use serde::{Deserialize, Serialize};

/// Hue in half degrees (`0..180`), saturation and value (`0..=255`).
pub type Hsv8 = [u8; 3];

/// The number of hue codes: hue is counted in half degrees and wraps here.
pub const HUES: u8 = 180;

/// Converts one pixel.
///
/// V = max(R, G, B), S = 255 (V − min) / V, H = 30 times the position on the colour hexagon, rounded half up.
pub fn rgb_to_hsv([r, g, b]: Rgb8) -> Hsv8 {
    let (value, chroma, numerator) = hexagon(i32::from(r), i32::from(g), i32::from(b));
    let rounded = |n: i32, d: i32| if d == 0 { 0 } else { (2 * n + d) / (2 * d) };
    let hue = rounded(30 * numerator, chroma) % i32::from(HUES);
    let saturation = rounded(255 * chroma, value);
    [hue as u8, saturation as u8, value as u8]
}

/// `(V, C, n)` with V the largest channel, C the chroma, and n / C in `[0, 6)` the position on the colour hexagon.
#[inline(always)]
fn hexagon(r: i32, g: i32, b: i32) -> (i32, i32, i32) {
    let value = r.max(g).max(b);
    let chroma = value - r.min(g).min(b);
    // Selections instead of branches, so that the loop over a row becomes vector code.
    let red = g - b + if g < b { 6 * chroma } else { 0 };
    let green = b - r + 2 * chroma;
    let blue = r - g + 4 * chroma;
    let numerator = if value == r {
        red
    } else if value == g {
        green
    } else {
        blue
    };
    (value, chroma, numerator)
}

/// A box in HSV: the paper's "spatial filtering" by colour. All bounds are inclusive; hue may wrap (`low > high`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HsvRange {
    /// First hue, `0..180` half degrees.
    pub hue_low: u8,
    /// Last hue, `0..180`; smaller than the first when the range wraps through red.
    pub hue_high: u8,
    /// Least saturation.
    pub saturation_low: u8,
    /// Greatest saturation.
    pub saturation_high: u8,
    /// Least value.
    pub value_low: u8,
    /// Greatest value.
    pub value_high: u8,
}

impl HsvRange {
    /// Every colour.
    pub const ALL: Self =
        Self { hue_low: 0, hue_high: HUES - 1, saturation_low: 0, saturation_high: 255, value_low: 0, value_high: 255 };

    /// Whether the colour lies inside.
    pub fn contains(&self, [hue, saturation, value]: Hsv8) -> bool {
        let hue_inside = if self.hue_low <= self.hue_high {
            (self.hue_low..=self.hue_high).contains(&hue)
        } else {
            hue >= self.hue_low || hue <= self.hue_high
        };
        hue_inside
            && (self.saturation_low..=self.saturation_high).contains(&saturation)
            && (self.value_low..=self.value_high).contains(&value)
    }

    /// Whether the hue range wraps through red.
    pub const fn wraps(&self) -> bool {
        self.hue_low > self.hue_high
    }
}

/// The range test on RGB without any division: every bound multiplied out, so the answer is exactly that of
/// [`rgb_to_hsv`] followed by [`HsvRange::contains`].
///
/// H ≥ h ⇔ ⌊(60 n + C) / 2C⌋ ≥ h ⇔ 60 n ≥ (2h − 1) C, and alike for S with 255 C over V. The hue that rounds to 180 is
/// hue 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RangeTest {
    hue_from: i32,
    hue_below: i32,
    /// Hues that round to 180 count as 0.
    top_is_inside: bool,
    wraps: bool,
    gray_is_inside: bool,
    saturation_from: i32,
    saturation_below: i32,
    value_low: u8,
    value_high: u8,
}

impl RangeTest {
    pub(crate) fn new(range: &HsvRange) -> Self {
        let odd = |bound: i32| 2 * bound - 1;
        let gray_is_inside =
            HsvRange { saturation_low: 0, value_low: 0, value_high: 255, ..*range }.contains([0, 0, 0]);
        Self {
            hue_from: odd(i32::from(range.hue_low)),
            hue_below: odd(i32::from(range.hue_high) + 1),
            top_is_inside: gray_is_inside,
            wraps: range.wraps(),
            gray_is_inside,
            saturation_from: odd(i32::from(range.saturation_low)),
            saturation_below: odd(i32::from(range.saturation_high) + 1),
            value_low: range.value_low,
            value_high: range.value_high,
        }
    }

    #[inline(always)]
    fn contains(&self, r: u8, g: u8, b: u8) -> bool {
        let (value, chroma, numerator) = hexagon(i32::from(r), i32::from(g), i32::from(b));
        let hue = 60 * numerator;
        let (above, below) = (hue >= self.hue_from * chroma, hue < self.hue_below * chroma);
        // Rounds to 180, which is hue 0.
        let top = hue >= 359 * chroma;
        let inside = if self.wraps { above | below } else { above & below };
        let inside = if top { self.top_is_inside } else { inside };
        let hue_inside = if chroma == 0 { self.gray_is_inside } else { inside };
        let saturation = 510 * chroma;
        // With V = 0 the saturation is 0 by definition; 1 in its place keeps both sides right.
        let divisor = value.max(1);
        hue_inside
            & (saturation >= self.saturation_from * divisor)
            & (saturation < self.saturation_below * divisor)
            & (value >= i32::from(self.value_low))
            & (value <= i32::from(self.value_high))
    }
}

/// Writes 255 where the pixel made of the three planes lies inside, else 0.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
pub(crate) fn range_row(red: &[u8], green: &[u8], blue: &[u8], test: &RangeTest, mask: &mut [u8]) {
    let test = *test;
    for (((mask, &r), &g), &b) in mask.iter_mut().zip(red).zip(green).zip(blue) {
        *mask = if test.contains(r, g, b) { 255 } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_testkit::Noise;

    /// OpenCV 5.0 `cvtColor(…, COLOR_RGB2HSV)` of these pixels.
    const OPENCV: &[(Rgb8, Hsv8)] = &OPENCV_HSV;
    include!("../tests/fixtures/hsv.rs");

    #[test]
    fn conversion_agrees_with_opencv() {
        for &(rgb, [h, s, v]) in OPENCV {
            let [hue, saturation, value] = rgb_to_hsv(rgb);
            assert_eq!(value, v);
            // OpenCV divides by tables of 12 bits, which is now and then one code off.
            assert!(saturation.abs_diff(s) <= 1, "{rgb:?}: {saturation} {s}");
            let apart = hue.abs_diff(h);
            assert!(apart.min(HUES - apart) <= 1, "{rgb:?}: {hue} {h}");
        }
        let off = OPENCV.iter().filter(|(rgb, hsv)| rgb_to_hsv(*rgb) != *hsv).count();
        assert!(off * 50 <= OPENCV.len(), "{off} of {} differ by a code", OPENCV.len());
    }

    #[test]
    fn hue_wraps_and_grey_has_hue_zero() {
        assert_eq!(rgb_to_hsv([255, 0, 0]), [0, 255, 255]);
        assert_eq!(rgb_to_hsv([255, 0, 1]), [0, 255, 255], "179.9 rounds to 180, which is 0");
        assert_eq!(rgb_to_hsv([0, 255, 0])[0], 60);
        assert_eq!(rgb_to_hsv([0, 0, 255])[0], 120);
        assert_eq!(rgb_to_hsv([7, 7, 7]), [0, 0, 7]);
        assert_eq!(rgb_to_hsv([0, 0, 0]), [0, 0, 0]);
    }

    fn any_range() -> impl Strategy<Value = HsvRange> {
        (0..HUES, 0..HUES, any::<u8>(), any::<u8>(), any::<u8>(), any::<u8>()).prop_map(
            |(hue_low, hue_high, s, t, v, w)| HsvRange {
                hue_low,
                hue_high,
                saturation_low: s.min(t),
                saturation_high: s.max(t),
                value_low: v.min(w),
                value_high: v.max(w),
            },
        )
    }

    proptest! {
        #[test]
        fn division_free_test_equals_conversion_and_range(range in any_range(), seed in any::<u32>()) {
            let test = RangeTest::new(&range);
            let mut noise = Noise::new(seed | 1);
            for _ in 0..2000 {
                let state = noise.draw();
                let mut rgb = [(state >> 8) as u8, (state >> 16) as u8, (state >> 24) as u8];
                // Greys, blacks and near-greys are the corners.
                match state & 7 {
                    0 => rgb = [rgb[0]; 3],
                    1 => rgb = [rgb[0], rgb[0].saturating_sub(rgb[1] & 3), rgb[0]],
                    2 => rgb = rgb.map(|c| c & 3),
                    _ => {}
                }
                let [r, g, b] = rgb;
                prop_assert_eq!(test.contains(r, g, b), range.contains(rgb_to_hsv(rgb)), "{:?} {:?}", rgb, range);
            }
        }
    }
}
