//! What is known of the background, pixel by pixel: a selective running average that knows where it knows nothing yet.

use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_vision::PixelWindow;
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// The background of the person tracker.
    pub struct BackdropParams {
        /// Time constant of the running average.
        pub history_s: f64 = 10.0, in above(0.0), unit "s", source "ours";
        /// A pixel stands out when a channel differs from the background by more.
        pub threshold: usize = 30, in 1..=254, unit "codes", source "ours";
        /// The target and this much about it, at each side, is not learnt.
        pub margin: f64 = 0.12, in 0.0..=2.0, unit "target sizes", source "ours";
        /// How far about the expected box to look for the person's outline.
        pub reach: f64 = 0.25, in 0.0..=2.0, unit "target sizes", source "ours";
        /// Least share of the expected box whose background must be known for it to count.
        pub least_known: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// When more than this share of what surrounds the expected box stands out, the camera moves, or a crowd does: the background
        /// does not count.
        pub most_around: f64 = 0.35, in 0.0..=1.0, source "ours";
        /// Log-odds that a box full of what stands out adds, and an empty one takes away.
        pub weight: f64 = 3.0, in 0.0..=20.0, source "ours";
        /// Share of a box that stands out at which nothing is added or taken away. People fill about a half of their boxes.
        pub even: f64 = 0.25, in above(0.0).below(1.0), source "ours";
        /// How far the box goes from the appearance's to the outline's.
        pub outline: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Regions smaller than this share of the expected box are noise.
        pub speck: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// So are those of fewer pixels than this.
        pub speck_px: f64 = 4.0, in 0.0..=1e6, unit "px", source "ours";
        /// A region belongs to the person when this share of it lies in the expected box.
        pub inside: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Every how many pixels, both ways, brightness is compared.
        pub light_step: usize = 4, in 1..=256, unit "px", source "ours";
        /// A pixel whose brightness, of all channels together, has changed by more than this factor and `light_offset` shows something
        /// else, not another light.
        pub light_factor: f64 = 2.0, in 1.0..=100.0, source "ours";
        /// See `light_factor`.
        pub light_offset: f64 = 30.0, in 0.0..=765.0, unit "codes", source "ours";
        /// Least overlap (IoU) of the outline's box with the appearance's for it to be the same person.
        pub agree: f64 = 0.3, in 0.0..=1.0, source "ours";
    }
}

/// Codes are kept in 256ths.
const UNIT: i32 = 256;

/// The background: a mean for every channel of every pixel, and whether it was ever seen.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Backdrop")]
pub(crate) struct Backdrop {
    width: usize,
    height: usize,
    channels: usize,
    /// In 256ths of a code, pixel by pixel.
    mean: Vec<u16>,
    known: Vec<bool>,
}

pursuit_estimation::checked!(Backdrop);

impl Backdrop {
    fn restored(self) -> Result<Self, &'static str> {
        let pixels = self.width.checked_mul(self.height).filter(|n| *n > 0);
        let fits = matches!(self.channels, 1 | 3)
            && pixels == Some(self.known.len())
            && pixels.and_then(|n| n.checked_mul(self.channels)) == Some(self.mean.len());
        if fits { Ok(self) } else { Err("its background has no size") }
    }
}

/// The pixels of a frame, channel after channel.
fn row(frame: &Frame, y: usize, channels: usize) -> &[u8] {
    if channels == 1 { frame.gray().row(y) } else { frame.color().row(y).as_flattened() }
}

impl Backdrop {
    pub fn new(frame: &Frame) -> Self {
        let Size { width, height } = frame.size();
        let channels = if frame.has_color() { 3 } else { 1 };
        let n = width * height;
        Self { width, height, channels, mean: vec![0; n * channels], known: vec![false; n] }
    }

    /// Whether it is the background of such frames.
    pub fn fits(&self, frame: &Frame) -> bool {
        frame.size() == Size::new(self.width, self.height) && (self.channels == 1 || frame.has_color())
    }

    /// Learns everything outside of `keep`, with weight `rate`; what was never seen is taken as it is.
    pub fn learn(&mut self, frame: &Frame, keep: &BBox, rate: f64) {
        let window = PixelWindow::of(keep, frame.size());
        let rate = (rate.clamp(0.0, 1.0) * f64::from(UNIT)).round().max(1.0) as i32;
        let channels = self.channels;
        for y in 0..self.height {
            let kept = window
                .filter(|w| (w.y..w.y + w.height).contains(&y))
                .map_or(self.width..self.width, |w| w.x..w.x + w.width);
            for part in [0..kept.start, kept.end..self.width] {
                let pixels =
                    row(frame, y, channels).get(part.start * channels..part.end * channels).unwrap_or_default();
                let (from, to) = (y * self.width + part.start, y * self.width + part.end);
                learn_part(
                    pixels,
                    &mut self.mean[from * channels..to * channels],
                    &mut self.known[from..to],
                    channels,
                    rate,
                );
            }
        }
    }

    /// How much brighter the frame is than the background, outside of `keep`: a ratio of sums over a grid of pixels that did not
    /// change much. 1 where nothing is known.
    pub fn gain(&self, params: &BackdropParams, frame: &Frame, keep: &BBox) -> f64 {
        let window = PixelWindow::of(keep, frame.size());
        let (mut now, mut was) = (1.0, 1.0);
        for y in (0..self.height).step_by(params.light_step) {
            let pixels = row(frame, y, self.channels);
            for x in (0..self.width).step_by(params.light_step) {
                let kept =
                    window.is_some_and(|w| (w.x..w.x + w.width).contains(&x) && (w.y..w.y + w.height).contains(&y));
                if kept || !self.known[y * self.width + x] {
                    continue;
                }
                let own = x * self.channels..(x + 1) * self.channels;
                let value: f64 = pixels[own.clone()].iter().map(|v| f64::from(*v)).sum();
                let mean = &self.mean[y * self.width * self.channels..][own];
                let mean = mean.iter().map(|v| f64::from(*v)).sum::<f64>() / f64::from(UNIT);
                let most = |v: f64| params.light_factor * v + params.light_offset;
                if value < most(mean) && mean < most(value) {
                    now += value;
                    was += mean;
                }
            }
        }
        now / was
    }

    /// What a pixel is: `None` where nothing is known, else whether it stands out of the background times `gain`, in 256ths.
    pub fn stands_out(&self, pixels: &[u8], x: usize, y: usize, gain: i32, threshold: i32) -> Option<bool> {
        let at = y * self.width + x;
        if !self.known[at] {
            return None;
        }
        let own = x * self.channels..(x + 1) * self.channels;
        let mean = &self.mean[at * self.channels..][..self.channels];
        let off = pixels[own]
            .iter()
            .zip(mean)
            .map(|(v, m)| (i32::from(*v) * UNIT - ((i32::from(*m) * gain) >> 8)).abs())
            .max();
        Some(off.unwrap_or(0) > threshold * UNIT)
    }

    pub fn row<'a>(&self, frame: &'a Frame, y: usize) -> &'a [u8] {
        row(frame, y, self.channels)
    }
}

fn learn_part(pixels: &[u8], mean: &mut [u16], known: &mut [bool], channels: usize, rate: i32) {
    for ((pixel, mean), known) in pixels.chunks_exact(channels).zip(mean.chunks_exact_mut(channels)).zip(known) {
        for (v, m) in pixel.iter().zip(mean) {
            let (value, old) = (i32::from(*v) * UNIT, i32::from(*m));
            // The product is at most 255 · 256², the result between old and new.
            *m = if *known { (old + ((value - old) * rate) / UNIT) as u16 } else { value as u16 };
        }
        *known = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{Image, Pixels};

    fn frame(light: f64, person: Option<usize>) -> Frame {
        let image = Image::from_fn(40, 30, |x, y| {
            let base = [60.0 + x as f64, 90.0, 50.0 + 2.0 * y as f64];
            let inside = person.is_some_and(|left| (left..left + 6).contains(&x) && (8..24).contains(&y));
            if inside { [200, 30, 30] } else { base.map(|v| (v * light) as u8) }
        });
        Frame::new(0, 0.0, Pixels::Rgb8(image.unwrap().into()))
    }

    fn told(backdrop: &Backdrop, frame: &Frame, x: usize, y: usize, gain: f64) -> Option<bool> {
        backdrop.stands_out(backdrop.row(frame, y), x, y, (gain * 256.0) as i32, 30)
    }

    #[test]
    fn only_what_was_seen_is_known() {
        let here = BBox::from_ltwh(9.0, 7.0, 8.0, 18.0);
        let mut backdrop = Backdrop::new(&frame(1.0, None));
        backdrop.learn(&frame(1.0, Some(10)), &here, 0.1);
        assert_eq!(told(&backdrop, &frame(1.0, Some(10)), 12, 12, 1.0), None);
        assert_eq!(told(&backdrop, &frame(1.0, Some(20)), 22, 12, 1.0), Some(true));
        assert_eq!(told(&backdrop, &frame(1.0, Some(20)), 30, 12, 1.0), Some(false));
        // What the person leaves is taken as it is.
        backdrop.learn(&frame(1.0, Some(20)), &here.translated(10.0, 0.0), 0.1);
        assert_eq!(told(&backdrop, &frame(1.0, None), 12, 12, 1.0), Some(false));
        assert_eq!(told(&backdrop, &frame(1.0, Some(10)), 12, 12, 1.0), Some(true));
        // What stays is learnt at the rate told: 107 codes of red, 80, 60, 45, 34, 25.
        let free = BBox::from_ltwh(0.0, 0.0, 0.5, 0.5);
        for (expected, _) in [(true, 0), (true, 1), (true, 2), (true, 3), (true, 4), (false, 5)] {
            assert_eq!(told(&backdrop, &frame(1.0, Some(30)), 33, 12, 1.0), Some(expected));
            backdrop.learn(&frame(1.0, Some(30)), &free, 0.25);
        }
    }

    #[test]
    fn the_light_is_measured_beside_the_target() {
        let here = BBox::from_ltwh(9.0, 7.0, 8.0, 18.0);
        let mut backdrop = Backdrop::new(&frame(1.0, None));
        assert_eq!(backdrop.gain(&BackdropParams::default(), &frame(1.0, None), &here), 1.0);
        backdrop.learn(&frame(1.0, Some(10)), &here, 0.1);
        let dark = frame(0.6, Some(10));
        let gain = backdrop.gain(&BackdropParams::default(), &dark, &here);
        assert!((gain - 0.6).abs() < 0.02, "{gain}");
        assert_eq!(told(&backdrop, &dark, 30, 12, gain), Some(false));
        assert_eq!(told(&backdrop, &dark, 39, 29, 1.0), Some(true));
    }

    #[test]
    fn what_is_restored_has_a_size() {
        let mut backdrop = Backdrop::new(&frame(1.0, None));
        backdrop.learn(&frame(1.0, None), &BBox::from_ltwh(0.0, 0.0, 2.0, 2.0), 0.5);
        let written = serde_json::to_value(&backdrop).unwrap();
        let read: Backdrop = serde_json::from_value(written.clone()).unwrap();
        assert_eq!((read.mean, read.known), (backdrop.mean, backdrop.known));
        for (key, value) in [("width", 41), ("channels", 1), ("channels", 2), ("height", 0)] {
            let mut bad = written.clone();
            bad[key] = value.into();
            assert!(serde_json::from_value::<Backdrop>(bad).is_err(), "{key}");
        }
    }
}
