use super::difference::{Channels, check, check_sizes, mark_changed, replace_unless};
use super::{BackgroundModel, Learning};
use crate::Result;
use crate::error::{VisionError, require_range};
use multiversion::multiversion;
use pursuit_imaging::{Image, ImageView};
use serde::{Deserialize, Serialize};

/// Parameters of [`TemporalMedian`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TemporalMedianParams {
    /// Frames of which the median is taken, 1 to 255. Of an even number the upper median.
    pub samples: usize,
    /// Every how many frames one is taken as a sample, ≥ 1: what stands for `samples · every / 2` frames becomes background.
    pub every: usize,
    /// A channel that differs by more than this is foreground, codes.
    pub threshold: u8,
}

impl Default for TemporalMedianParams {
    fn default() -> Self {
        Self { samples: 15, every: 10, threshold: 25 }
    }
}

/// Difference to the median of samples of the past, exact for every channel.
///
/// A rate of 0 takes no sample from a frame; any other rate is as good as `None`. Where learning is forbidden the sample
/// is the present background.
#[derive(Debug, Clone)]
pub struct TemporalMedian<P> {
    params: TemporalMedianParams,
    /// The samples there are; the oldest is at `next` when all are there.
    samples: Vec<Image<P>>,
    next: usize,
    /// Frames since the last sample.
    waited: usize,
    background: Option<Image<P>>,
}

/// Channels of which the median is found at a time: they and their samples stay in the first cache.
const BLOCK: usize = 256;

impl<P: Channels> TemporalMedian<P> {
    /// A model.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: TemporalMedianParams) -> Result<Self, VisionError> {
        require_range("samples", params.samples as f64, (1.0, 255.0), "from 1 to 255")?;
        require_range("every", params.every as f64, (1.0, f64::INFINITY), "at least 1")?;
        Ok(Self { params, samples: Vec::new(), next: 0, waited: 0, background: None })
    }

    fn take_sample(&mut self, frame: ImageView<'_, P>, protect: Option<ImageView<'_, u8>>) {
        let Some(background) = &mut self.background else {
            self.background = Some(frame.to_image());
            self.samples.push(frame.to_image());
            self.next = 1 % self.params.samples;
            return;
        };
        if self.samples.len() < self.params.samples {
            self.samples.push(background.clone());
            self.next = self.samples.len() - 1;
        }
        let sample = &mut self.samples[self.next];
        sample.as_mut_slice().copy_from_slice(background.as_slice());
        for (y, row) in frame.rows().enumerate() {
            match protect {
                None => sample.row_mut(y).copy_from_slice(row),
                Some(protect) => {
                    let open = sample.row_mut(y).iter_mut().zip(row).zip(protect.row(y)).filter(|(_, p)| **p == 0);
                    open.for_each(|((sample, pixel), _)| *sample = *pixel);
                }
            }
        }
        self.next = (self.next + 1) % self.params.samples;
        let out = P::channels_mut(background.as_mut_slice());
        for (i, out) in out.chunks_mut(BLOCK).enumerate() {
            let n = out.len();
            median_of(self.samples.iter().map(|s| &P::channels(s.as_slice())[i * BLOCK..][..n]), out);
        }
    }
}

impl<P: Channels> BackgroundModel<P> for TemporalMedian<P> {
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()> {
        check(self.background.as_ref().map(Image::size), frame.size(), learning)?;
        mask.resize_for_overwrite(frame.size(), 0)?;
        match &self.background {
            Some(background) => {
                for (y, row) in frame.rows().enumerate() {
                    mark_changed(row, background.row(y), self.params.threshold, mask.row_mut(y));
                }
            }
            None => mask.as_mut_slice().fill(0),
        }
        self.waited += 1;
        if learning.rate != Some(0.0) && (self.waited >= self.params.every || self.background.is_none()) {
            self.waited = 0;
            self.take_sample(frame, learning.protect);
        }
        Ok(())
    }

    fn background(&self, out: &mut Image<P>) -> Result<bool> {
        super::fixed::copy(self.background.as_ref(), out)
    }

    fn sample(&self, x: usize, y: usize) -> Option<P> {
        super::fixed::sample(self.background.as_ref(), x, y)
    }

    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()> {
        check_sizes(self.background.as_ref().map(Image::size), frame.size(), keep)?;
        let background = self.background.get_or_insert_with(|| frame.to_image());
        for (y, row) in frame.rows().enumerate() {
            replace_unless(background.row_mut(y), row, gain, keep.map(|k| k.row(y)));
        }
        self.samples.truncate(1);
        match self.samples.first_mut() {
            Some(sample) => sample.as_mut_slice().copy_from_slice(background.as_slice()),
            None => self.samples.push(background.clone()),
        }
        (self.next, self.waited) = (1 % self.params.samples, 0);
        Ok(())
    }
}

/// The upper median of every channel, bit by bit from the highest: a value is at most the median when at least half of
/// the samples are not below it.
fn median_of<'a>(samples: impl ExactSizeIterator<Item = &'a [u8]> + Clone, out: &mut [u8]) {
    // Of n samples the upper median is the greatest value that at least n − ⌊n/2⌋ samples reach.
    let enough = (samples.len() - samples.len() / 2) as u8;
    let mut counts = [0u8; BLOCK];
    out.fill(0);
    for bit in (0..8).rev() {
        let counts = &mut counts[..out.len()];
        counts.fill(0);
        for sample in samples.clone() {
            count_reached(sample, out, 1 << bit, counts);
        }
        for (out, &count) in out.iter_mut().zip(counts.iter()) {
            *out |= if count >= enough { 1 << bit } else { 0 };
        }
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn count_reached(sample: &[u8], known: &[u8], bit: u8, counts: &mut [u8]) {
    for ((count, &v), &known) in counts.iter_mut().zip(sample).zip(known) {
        *count += u8::from(v >= known | bit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_testkit::Noise;

    proptest! {
        #[test]
        fn the_median_is_the_middle_of_the_sorted(n in 1usize..20, seed in any::<u32>()) {
            let mut noise = Noise::new(seed | 1);
            let samples: Vec<Vec<u8>> = (0..n).map(|_| (0..37).map(|_| noise.byte()).collect()).collect();
            let mut out = vec![0; 37];
            median_of(samples.iter().map(Vec::as_slice), &mut out);
            for (i, got) in out.iter().enumerate() {
                let mut column: Vec<u8> = samples.iter().map(|s| s[i]).collect();
                column.sort_unstable();
                prop_assert_eq!(*got, column[n / 2]);
            }
        }
    }
}
