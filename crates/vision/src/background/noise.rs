//! The noise of the sensor: how much there is of it, and frames seen so coarsely that little of it is left.

use super::difference::Channels;
use crate::Result;
use pursuit_imaging::{Image, ImageView};

/// Samples of the picture, about.
const SAMPLES: usize = 4096;
/// Median of the absolute difference of two responses of [`response`] to noise of unit deviation: 0.6745 (the median of the absolute
/// value of a Gaussian) · 6 (the norm of the operator) · √2 (two frames).
const MEDIAN_OF_UNIT_NOISE: f32 = 5.723;
/// The greatest radius of the mean, in pixels.
const MOST_RADIUS: usize = 3;
/// The radius becomes smaller where the noise would then be below this share of what is tolerated: it does not go to and fro.
const CALMER: f32 = 0.7;

/// How noisy the sensor is, and over how many pixels the mean is taken for that.
#[derive(Debug, Clone, Default)]
pub(super) struct SensorNoise {
    /// Standard deviation, in codes, over the frames of late; `None` before two pairs of frames were seen.
    deviation: Option<f32>,
    /// That between the last two frames.
    latest: Option<f32>,
    pairs: u32,
    radius: usize,
    /// What the samples of the last frame respond; and the absolute differences to that, scratch.
    responses: Vec<i16>,
    differences: Vec<u16>,
    sums: Vec<u16>,
}

impl SensorNoise {
    /// Whether frames are seen otherwise than they are.
    pub const fn is_smoothing(&self) -> bool {
        self.radius > 0
    }

    /// Side of the square over which the mean is taken, in pixels.
    pub const fn side(&self) -> usize {
        2 * self.radius + 1
    }

    /// Measures the noise of the next frame, which counts by `rate` (`None`: as all before it), and whether frames are seen otherwise
    /// from now on, so that no more than `tolerated` of it is left.
    pub fn measure<P: Channels>(&mut self, frame: ImageView<'_, P>, rate: Option<f64>, tolerated: f64) -> bool {
        let Some(between) = self.between(frame) else { return false };
        // What sets a single frame apart is a cut or a flash, and no noise.
        let Some(before) = self.latest.replace(between) else { return false };
        let now = between.min(before);
        self.pairs = self.pairs.saturating_add(1);
        let weight = rate.map_or(1.0 / self.pairs as f32, |r| r as f32);
        let deviation = self.deviation.map_or(now, |usual| usual + weight * (now - usual));
        self.deviation = Some(deviation);
        let left = |radius: usize| deviation / (2 * radius + 1) as f32;
        let needed = |tolerated: f32| (0..MOST_RADIUS).find(|r| left(*r) <= tolerated).unwrap_or(MOST_RADIUS);
        let (least, most) = (needed(tolerated as f32), needed(CALMER * tolerated as f32));
        let radius = self.radius.clamp(least, most);
        std::mem::replace(&mut self.radius, radius) != radius
    }

    /// The deviation of the noise between the frame before and this one: where nothing moves, they differ by nothing else.
    fn between<P: Channels>(&mut self, frame: ImageView<'_, P>) -> Option<f32> {
        let step = ((frame.width() * frame.height()) as f64 / SAMPLES as f64).sqrt().max(1.0) as usize;
        let (mut count, known) = (0, self.responses.len());
        self.differences.clear();
        for y in (1..frame.height().saturating_sub(1)).step_by(step) {
            for x in (1..frame.width().saturating_sub(1)).step_by(step) {
                for c in 0..P::COUNT {
                    let now = response(frame, x, y, c);
                    match self.responses.get_mut(count) {
                        Some(before) => self.differences.push(std::mem::replace(before, now).abs_diff(now)),
                        None => self.responses.push(now),
                    }
                    count += 1;
                }
            }
        }
        let middle = self.differences.len() / 2;
        if known != count || middle == 0 {
            return None;
        }
        let (_, median, _) = self.differences.select_nth_unstable(middle);
        Some(f32::from(*median) / MEDIAN_OF_UNIT_NOISE)
    }

    /// Writes `frame` with no more noise than is tolerated.
    pub fn smooth<P: Channels>(&mut self, frame: ImageView<'_, P>, to: &mut Image<P>) -> Result<()> {
        match self.radius {
            0 | 1 => mean_over::<P, 1>(frame, &mut self.sums, to),
            2 => mean_over::<P, 2>(frame, &mut self.sums, to),
            _ => mean_over::<P, MOST_RADIUS>(frame, &mut self.sums, to),
        }
    }
}

/// What is left of a channel when everything is taken away that is smooth (Immerkær 1996): the difference of two Laplacians, with
/// norm 6. A pixel at the border has no answer.
fn response<P: Channels>(image: ImageView<'_, P>, x: usize, y: usize, c: usize) -> i16 {
    let row = |y: usize| {
        let channels = P::channels(image.row(y));
        [x - 1, x, x + 1].map(|x| i16::from(channels[x * P::COUNT + c]))
    };
    let [above, here, below] = [row(y - 1), row(y), row(y + 1)];
    let outer = above[0] + above[2] + below[0] + below[2];
    outer - 2 * (above[1] + here[0] + here[2] + below[1]) + 4 * here[1]
}

/// Writes the mean over the (2R + 1)² pixels about each pixel; beyond the border those of the border count.
fn mean_over<P: Channels, const R: usize>(
    image: ImageView<'_, P>,
    sums: &mut Vec<u16>,
    to: &mut Image<P>,
) -> Result<()> {
    let (height, n) = (image.height(), P::COUNT * image.width());
    to.resize_for_overwrite(image.size(), P::default())?;
    // Sums over 2R + 1 rows, with R pixels more to either side.
    let pad = R * P::COUNT;
    sums.clear();
    sums.resize(n + 2 * pad, 0);
    let row = |y: isize| P::channels(image.row(y.clamp(0, height as isize - 1) as usize));
    let reach = R as isize;
    for y in -reach..reach {
        sums[pad..pad + n].iter_mut().zip(row(y)).for_each(|(sum, v)| *sum += u16::from(*v));
    }
    for y in 0..height {
        let at = y as isize;
        sums[pad..pad + n].iter_mut().zip(row(at + reach)).for_each(|(sum, v)| *sum += u16::from(*v));
        for k in 0..pad {
            sums[k] = sums[pad + k % P::COUNT];
            sums[pad + n + k] = sums[pad + n - P::COUNT + k % P::COUNT];
        }
        let out = P::channels_mut(to.row_mut(y));
        let area = (2 * R as u16 + 1).pow(2);
        let shifted: [&[u16]; 7] = std::array::from_fn(|k| &sums[k.min(2 * R) * P::COUNT..][..n]);
        for (i, out) in out.iter_mut().enumerate().take(n) {
            let sum: u16 = shifted[..=2 * R].iter().map(|s| s[i]).sum();
            *out = ((sum + area / 2) / area) as u8;
        }
        sums[pad..pad + n].iter_mut().zip(row(at - reach)).for_each(|(sum, v)| *sum -= u16::from(*v));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Rgb8;
    use pursuit_testkit::lattice;

    /// The `k`th picture of something with grain, by a sensor of this noise.
    fn seen(k: u64, deviation: f64) -> Image<Rgb8> {
        let unit = |x: usize, y: usize, c: usize| {
            let draw = |n: i64| lattice(3 * x as i64 + c as i64, 97 * y as i64 + n, 1000 + k);
            // The sum of twelve uniform draws has the deviation 1.
            (0..12).map(draw).sum::<f64>() - 6.0
        };
        let grain = |x: usize, y: usize| 110.0 + 60.0 * lattice(x as i64, y as i64, 7);
        let value = |x, y, c| (grain(x, y) + deviation * unit(x, y, c)).round().clamp(0.0, 255.0) as u8;
        Image::from_fn(64, 48, |x, y| [value(x, y, 0), value(x, y, 1), value(x, y, 2)]).unwrap()
    }

    #[test]
    fn noise_is_measured_whatever_the_picture_shows() {
        for deviation in [0.0, 2.0, 9.0] {
            let mut noise = SensorNoise::default();
            for k in 0..4 {
                noise.measure(seen(k, deviation).view(), None, 2.0);
            }
            let found = noise.deviation.unwrap();
            assert!((f64::from(found) - deviation).abs() <= 0.06 * deviation, "{found} for {deviation}");
        }
    }

    #[test]
    fn frames_are_smoothed_by_as_much_as_the_noise_needs() {
        let settled = |deviation: f64| {
            let mut noise = SensorNoise::default();
            let changes = (0..6).filter(|k| noise.measure(seen(*k, deviation).view(), None, 2.0)).count();
            (noise.radius, changes)
        };
        for (deviation, expected) in [(1.5, (0, 0)), (4.0, (1, 1)), (9.0, (2, 1)), (30.0, (3, 1))] {
            assert_eq!(settled(deviation), expected, "{deviation}");
        }
    }

    #[test]
    fn a_cut_is_no_noise_and_a_change_lasts() {
        let mut noise = SensorNoise::default();
        let other = Image::from_fn(64, 48, |x, y| [(lattice(x as i64, y as i64, 8) * 255.0) as u8; 3]).unwrap();
        assert!((0..10).all(|k| !noise.measure(seen(k, 1.0).view(), Some(0.2), 2.0)));
        assert!(!noise.measure(other.view(), Some(0.2), 2.0), "a cut");
        assert!((0..10).all(|_| !noise.measure(other.view(), Some(0.2), 2.0)));
        let changes = |noise: &mut SensorNoise, deviation| {
            (20..80).filter(|k| noise.measure(seen(*k, deviation).view(), Some(0.2), 2.0)).count()
        };
        assert_eq!((changes(&mut noise, 4.0), noise.radius), (1, 1), "it grows dark");
        assert_eq!((changes(&mut noise, 1.8), noise.radius), (0, 1), "hardly less");
        assert_eq!((changes(&mut noise, 0.5), noise.radius), (1, 0), "day again");
    }

    #[test]
    fn means_are_those_of_their_pixels() {
        let slow = |image: &Image<Rgb8>, r: isize, x: usize, y: usize, c: usize| {
            let mut sum = 0;
            for (dx, dy) in (-r..=r).flat_map(|dx| (-r..=r).map(move |dy| (dx, dy))) {
                sum += usize::from(image.view().clamped(x as isize + dx, y as isize + dy)[c]);
            }
            let area = (2 * r as usize + 1).pow(2);
            ((sum + area / 2) / area) as u8
        };
        for (width, height) in [(13, 9), (1, 1), (2, 3)] {
            let whole = seen(1, 40.0);
            let image = Image::from_fn(width, height, |x, y| whole.row(y)[x]).unwrap();
            let (mut sums, mut out) = (Vec::new(), Image::filled(1, 1, [0; 3]).unwrap());
            for r in 1..=3 {
                match r {
                    1 => mean_over::<Rgb8, 1>(image.view(), &mut sums, &mut out),
                    2 => mean_over::<Rgb8, 2>(image.view(), &mut sums, &mut out),
                    _ => mean_over::<Rgb8, 3>(image.view(), &mut sums, &mut out),
                }
                .unwrap();
                let expected = Image::from_fn(width, height, |x, y| [0, 1, 2].map(|c| slow(&image, r, x, y, c)));
                assert_eq!(out, expected.unwrap(), "{width} x {height}, {r}");
            }
        }
    }
}
