use super::{CamShiftParams, Projection};
use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use pursuit_vision::color::{HUES, rgb_to_hsv};
use serde::{Deserialize, Serialize};

/// What of a pixel is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channel {
    /// Its hue, where it has one.
    Hue,
    /// Its brightness, of targets without a hue.
    Value,
}

/// The bin of a pixel; `None` of those whose hue means nothing: too grey, too dark or too bright (bradski1998).
#[inline(always)]
pub fn bin(pixel: Rgb8, channel: Channel, p: &CamShiftParams) -> Option<usize> {
    let [hue, saturation, value] = rgb_to_hsv(pixel);
    match channel {
        Channel::Hue => {
            let meant = saturation >= p.least_saturation && (p.least_value..=p.greatest_value).contains(&value);
            meant.then(|| usize::from(hue) * p.bins / usize::from(HUES))
        }
        Channel::Value => Some(usize::from(value) * p.bins / 256),
    }
}

/// The shares of the bins among the pixels of a box, the last that of pixels without a bin; they sum to one, or to nought where
/// nothing was seen.
pub type Shares = Vec<f32>;

/// Fills `shares` from the pixels of `outer` that do not lie in `hole`. `false` where there are none.
pub fn measure(
    color: ImageView<'_, Rgb8>,
    (outer, hole): (&BBox, Option<&BBox>),
    channel: Channel,
    p: &CamShiftParams,
    shares: &mut Shares,
) -> bool {
    shares.clear();
    shares.resize(p.bins + 1, 0.0);
    let mut total = 0.0;
    for_each(color, outer, p.most_pixels, |pixel, (x, y)| {
        let inside = hole.is_some_and(|h| (h.left()..h.right()).contains(&x) && (h.top()..h.bottom()).contains(&y));
        if !inside {
            shares[bin(pixel, channel, p).unwrap_or(p.bins)] += 1.0;
            total += 1.0;
        }
    });
    if total > 0.0 {
        shares.iter_mut().for_each(|v| *v /= total);
    }
    total > 0.0
}

/// Calls `look` with each pixel of the picture whose middle lies in `window`, and its middle; on a grid where there are many more
/// than `most_pixels`.
#[inline(always)]
pub fn for_each(color: ImageView<'_, Rgb8>, window: &BBox, most_pixels: usize, mut look: impl FnMut(Rgb8, (f64, f64))) {
    let step = stride(window, most_pixels);
    let pixels = |low: f64, high: f64, n: usize| {
        let bound = |v: f64| (v - 0.5).ceil().clamp(0.0, n as f64) as usize;
        (bound(low).next_multiple_of(step)..bound(high)).step_by(step)
    };
    for y in pixels(window.top(), window.bottom(), color.size().height) {
        let row = color.row(y);
        for x in pixels(window.left(), window.right(), color.size().width) {
            look(row[x], (x as f64 + 0.5, y as f64 + 0.5));
        }
    }
}

/// How far apart the pixels are that [`for_each`] looks at.
pub fn stride(window: &BBox, most_pixels: usize) -> usize {
    (window.area() / most_pixels.max(1) as f64).sqrt().ceil().max(1.0) as usize
}

/// How much each bin belongs to the target, `[0, 1]`; the last, of pixels without a bin, is nought.
pub fn probabilities(target: &Shares, around: &Shares, projection: Projection, out: &mut Vec<f32>) {
    let hues = target.split_last().map_or(&[][..], |(_, hues)| hues);
    let highest = hues.iter().copied().fold(0.0_f32, f32::max);
    let of = |(&t, &a): (&f32, &f32)| match projection {
        _ if t <= 0.0 => 0.0,
        Projection::Paper => t / highest,
        Projection::Surroundings => t / (t + a),
        Projection::Excess => ((t - a) / (t + a)).max(0.0),
    };
    out.clear();
    out.extend(hues.iter().zip(around).map(of));
    out.push(0.0);
}

/// The Bhattacharyya coefficient of two histograms.
pub fn coefficient(a: &Shares, b: &Shares) -> f64 {
    f64::from(a.iter().zip(b).map(|(a, b)| (a * b).sqrt()).sum::<f32>()).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    #[test]
    fn pixels_without_a_hue_have_no_bin() {
        let p = CamShiftParams {
            least_saturation: 30,
            least_value: 10,
            greatest_value: 250,
            bins: 18,
            ..CamShiftParams::default()
        };
        let of = |pixel| bin(pixel, Channel::Hue, &p);
        assert_eq!(of([200, 10, 10]), Some(0));
        assert_eq!(of([10, 200, 10]), Some(6));
        assert_eq!(of([10, 10, 200]), Some(12));
        assert_eq!(of([100, 95, 96]), None, "grey");
        assert_eq!(of([6, 1, 1]), None, "dark");
        assert_eq!(of([255, 100, 100]), None, "bright");
        assert_eq!(bin([100, 95, 96], Channel::Value, &p), Some(7));
    }

    #[test]
    fn shares_are_those_of_the_pixels_between_both_boxes() {
        let image = Image::from_fn(20, 16, |x, _| if x < 10 { [220, 20, 20] } else { [90; 3] }).unwrap();
        let p = CamShiftParams { bins: 4, ..CamShiftParams::default() };
        let mut shares = Shares::new();
        let (outer, hole) = (BBox::from_ltwh(-4.0, 2.0, 20.0, 8.0), BBox::from_ltwh(0.0, 4.0, 10.0, 4.0));
        assert!(measure(image.view(), (&outer, Some(&hole)), Channel::Hue, &p, &mut shares));
        // 16 columns of 8 rows less 40 pixels of the hole: 40 red and 48 grey ones.
        assert!((shares[0] - 40.0 / 88.0).abs() < 1e-6 && (shares[4] - 48.0 / 88.0).abs() < 1e-6, "{shares:?}");
        assert!(!measure(image.view(), (&BBox::from_ltwh(30.0, 0.0, 5.0, 5.0), None), Channel::Hue, &p, &mut shares));
        assert_eq!(coefficient(&shares, &shares), 0.0);
    }

    #[test]
    fn probabilities_are_those_of_their_projection() {
        let (target, around) = (vec![0.2, 0.4, 0.0, 0.4], vec![0.6, 0.0, 0.2, 0.2]);
        let mut out = Vec::new();
        probabilities(&target, &around, Projection::Paper, &mut out);
        assert_eq!(out, [0.5, 1.0, 0.0, 0.0]);
        probabilities(&target, &around, Projection::Surroundings, &mut out);
        assert_eq!(out, [0.25, 1.0, 0.0, 0.0]);
        probabilities(&target, &around, Projection::Excess, &mut out);
        assert_eq!(out, [0.0, 1.0, 0.0, 0.0]);
    }
}
