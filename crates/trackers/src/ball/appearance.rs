//! What the ball looks like, remembered.

use super::color_blobs::ColorBlobFinder;
use pursuit_geometry::BBox;
use pursuit_vision::color::HUES;
use serde::{Deserialize, Serialize};

const HUE_BINS: usize = 30;
const SATURATION_BINS: usize = 4;
const VALUE_BINS: usize = 4;
const LENGTH: usize = HUE_BINS * SATURATION_BINS * VALUE_BINS;
/// The inner part of a box that is compared, in half axes: the rim mixes with the background.
const PART: f64 = 0.75;

/// A histogram of hue, saturation and value that sums to one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Appearance", transparent)]
pub(super) struct Appearance {
    bins: Vec<f32>,
}

/// Room for a histogram; all zero.
impl Default for Appearance {
    fn default() -> Self {
        Self { bins: vec![0.0; LENGTH] }
    }
}

pursuit_estimation::checked!(Appearance);

impl Appearance {
    fn restored(self) -> Result<Self, &'static str> {
        let sound = self.bins.len() == LENGTH && self.bins.iter().all(|b| b.is_finite() && *b >= 0.0);
        if sound { Ok(self) } else { Err("its histogram of colours cannot be") }
    }
}

impl Appearance {
    /// Becomes the histogram of the middle of `bbox`.
    pub fn take(&mut self, blobs: &ColorBlobFinder, bbox: &BBox) {
        self.bins.fill(0.0);
        let mut count = 0.0;
        blobs.sample(bbox, 0.0..PART, |[hue, saturation, value]| {
            count += 1.0;
            // Shared between the two nearest bins, so that a lamp that changes a little changes the histogram a little.
            let (h0, h1, h) = share(f32::from(hue) / f32::from(HUES) * HUE_BINS as f32, HUE_BINS, true);
            let (s0, s1, s) = share(f32::from(saturation) / 256.0 * SATURATION_BINS as f32, SATURATION_BINS, false);
            let (v0, v1, v) = share(f32::from(value) / 256.0 * VALUE_BINS as f32, VALUE_BINS, false);
            for (hue_bin, a) in [(h0, 1.0 - h), (h1, h)] {
                for (saturation_bin, b) in [(s0, 1.0 - s), (s1, s)] {
                    for (value_bin, c) in [(v0, 1.0 - v), (v1, v)] {
                        let at = (hue_bin * SATURATION_BINS + saturation_bin) * VALUE_BINS + value_bin;
                        self.bins[at] += a * b * c;
                    }
                }
            }
        });
        if count > 0.0 {
            self.bins.iter_mut().for_each(|b| *b /= count);
        }
    }

    /// Bhattacharyya coefficient of both histograms, in `[0, 1]`: 1 when they are equal.
    pub fn likeness(&self, other: &Self) -> f64 {
        let sum: f32 = self.bins.iter().zip(&other.bins).map(|(a, b)| (a * b).sqrt()).sum();
        f64::from(sum).clamp(0.0, 1.0)
    }

    /// Moves the fraction `rate` of the way towards `seen`.
    pub fn follow(&mut self, seen: &Self, rate: f64) {
        let rate = rate as f32;
        for (mine, theirs) in self.bins.iter_mut().zip(&seen.bins) {
            *mine += rate * (theirs - *mine);
        }
    }
}

/// The two bins whose centres are nearest to `position` (in bins), and the weight of the second.
fn share(position: f32, bins: usize, wraps: bool) -> (usize, usize, f32) {
    let shifted = position - 0.5;
    let below = shifted.floor();
    let weight = shifted - below;
    let bin = |i: f32| {
        let i = i as isize;
        if wraps { i.rem_euclid(bins as isize) as usize } else { i.clamp(0, bins as isize - 1) as usize }
    };
    (bin(below), bin(below + 1.0), weight)
}
