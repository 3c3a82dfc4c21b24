//! All samples by what the normal equations need of them (danelljan2016, section 3.3): at each frequency the products of every
//! two channels, and the mean. Memory is that of a number of samples that does not grow.

use super::blocks::{Block, channels, len};
use crate::correlation::filters::Spectra;
use multiversion::multiversion;
use pursuit_vision::fourier::{Complex32, spectra};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Sums over all samples x_j with weights α_j, which add up to 1 and grow by 1/(1 − γ) from each sample to the next.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Moments {
    /// Samples learned.
    samples: usize,
    /// Σ α_j x̄_jc·x_jd of the channels c ≤ d, pair after pair, at the frequencies that both have.
    products: Spectra,
    /// Σ α_j x_j.
    mean: Spectra,
}

/// Where the coefficients of each channel stand.
fn places(blocks: &[Block]) -> impl Iterator<Item = Range<usize>> {
    let each = blocks.iter().flat_map(|block| std::iter::repeat_n(block.each(), block.channels));
    each.scan(0, |from, each| {
        let place = *from..*from + each;
        *from = place.end;
        Some(place)
    })
}

/// The number of products of all pairs of channels.
fn pairs_len(blocks: &[Block]) -> usize {
    let pair =
        |(c, own): (usize, Range<usize>)| places(blocks).skip(c).map(|other| own.len().min(other.len())).sum::<usize>();
    places(blocks).enumerate().map(pair).sum()
}

impl Moments {
    /// Whether a state that was read is one that learning leads to.
    pub(super) fn is_sound(&self, blocks: &[Block]) -> bool {
        let finite = |all: &Spectra| all.0.iter().all(|c| c.re.is_finite() && c.im.is_finite());
        let whole = self.mean.0.len() == len(blocks) && self.products.0.len() == pairs_len(blocks);
        self.samples > 0 && whole && finite(&self.mean) && finite(&self.products)
    }

    /// Learns a sample, and returns its weight γ / (1 − (1 − γ)ⁿ), n samples being learned.
    pub(super) fn learn(&mut self, rate: f64, blocks: &[Block], sample: &[Complex32]) -> f64 {
        if self.samples == 0 {
            self.products.0.resize(pairs_len(blocks), Complex32::default());
            self.mean.0.resize(sample.len(), Complex32::default());
        }
        self.samples = self.samples.saturating_add(1);
        let weight = rate / (1.0 - (1.0 - rate).powf(self.samples as f64));
        spectra::blend(&mut self.mean.0, sample, weight as f32);
        let mut rest = &mut self.products.0[..];
        for (c, a) in channels(blocks, sample).enumerate() {
            for b in channels(blocks, sample).skip(c) {
                let (pair, others) = rest.split_at_mut(a.len().min(b.len()));
                blend_conj_product(pair, a, b, weight as f32);
                rest = others;
            }
        }
        weight
    }

    /// `out = Σ_j α_j x̄_j·(x_j·f)`.
    pub(super) fn apply(&self, blocks: &[Block], filter: &[Complex32], out: &mut [Complex32]) {
        out.fill(Complex32::default());
        let mut rest = &self.products.0[..];
        for (c, own) in places(blocks).enumerate() {
            for (d, other) in places(blocks).enumerate().skip(c) {
                let (pair, others) = rest.split_at(own.len().min(other.len()));
                spectra::add_product(&mut out[own.start..own.start + pair.len()], pair, &filter[other.clone()]);
                if d > c {
                    spectra::add_conj_product(
                        &mut out[other.start..other.start + pair.len()],
                        pair,
                        &filter[own.clone()],
                    );
                }
                rest = others;
            }
        }
    }

    /// `out −= Σ_j α_j x̄_j·y`, of real y.
    pub(super) fn subtract_label(&self, blocks: &[Block], label: &[f32], out: &mut [Complex32]) {
        for (place, mean) in places(blocks).zip(channels(blocks, &self.mean.0)) {
            for (out, (mean, y)) in out[place].iter_mut().zip(mean.iter().zip(label)) {
                out.re -= mean.re * y;
                out.im += mean.im * y;
            }
        }
    }
}

/// `old += rate · (ā·b − old)`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn blend_conj_product(old: &mut [Complex32], a: &[Complex32], b: &[Complex32], rate: f32) {
    for (old, (a, b)) in old.iter_mut().zip(a.iter().zip(b)) {
        old.re += rate * (a.re * b.re + a.im * b.im - old.re);
        old.im += rate * (a.re * b.im - a.im * b.re - old.im);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;

    const BLOCKS: &[Block] = &[Block { channels: 2, order: 1 }, Block { channels: 2, order: 2 }];

    fn random(seed: u64) -> Vec<Complex32> {
        let mut numbers = SplitMix::after(seed);
        (0..len(BLOCKS)).map(|_| Complex32::new(numbers.unit() as f32 - 0.5, numbers.unit() as f32 - 0.5)).collect()
    }

    /// All samples are kept, with the weights of the paper: each counts by 1/(1 − γ) more than the one before.
    fn weights(rate: f64, n: usize) -> Vec<f64> {
        let all: Vec<f64> = (0..n).map(|j| (1.0 - rate).powi(-(j as i32))).collect();
        let sum: f64 = all.iter().sum();
        all.iter().map(|w| w / sum).collect()
    }

    #[test]
    fn sums_are_those_over_all_samples() {
        let (rate, n) = (0.06, 40);
        let samples: Vec<Vec<Complex32>> = (0..n).map(|j| random(100 + j)).collect();
        let mut moments = Moments::default();
        for (j, sample) in samples.iter().enumerate() {
            let weight = moments.learn(rate, BLOCKS, sample);
            assert!((weight - weights(rate, j + 1)[j]).abs() < 1e-12, "{j}: {weight}");
        }
        assert!(moments.is_sound(BLOCKS));
        let (filter, label) = (random(7), [0.5_f32, -0.25, 0.75, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, -0.9, -0.8]);
        let mut want = vec![Complex32::default(); len(BLOCKS)];
        for (sample, weight) in samples.iter().zip(weights(rate, samples.len())) {
            let mut misfit: Vec<Complex32> = label.iter().map(|y| Complex32::new(-y, 0.0)).collect();
            for (x, f) in channels(BLOCKS, sample).zip(channels(BLOCKS, &filter)) {
                misfit.iter_mut().zip(x.iter().zip(f)).for_each(|(m, (x, f))| *m += x * f);
            }
            for (place, x) in places(BLOCKS).zip(channels(BLOCKS, sample)) {
                want[place]
                    .iter_mut()
                    .zip(x.iter().zip(&misfit))
                    .for_each(|(w, (x, m))| *w += x.conj() * m * weight as f32);
            }
        }
        let mut got = random(8);
        moments.apply(BLOCKS, &filter, &mut got);
        moments.subtract_label(BLOCKS, &label, &mut got);
        for (got, want) in got.iter().zip(&want) {
            assert!((got - want).norm() < 1e-5, "{got} is not {want}");
        }
    }

    #[test]
    fn memory_does_not_grow() {
        let mut moments = Moments::default();
        moments.learn(0.01, BLOCKS, &random(1));
        let before = (moments.products.0.capacity(), moments.mean.0.capacity());
        (2..50).for_each(|seed| {
            moments.learn(0.01, BLOCKS, &random(seed));
        });
        assert_eq!((moments.products.0.capacity(), moments.mean.0.capacity()), before);
        // Of two channels of 5 and two of 13 coefficients: 3 pairs and 4 of 5, 3 of 13.
        assert_eq!(moments.products.0.len(), 7 * 5 + 3 * 13);
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let mut moments = Moments::default();
        assert!(!moments.is_sound(BLOCKS));
        moments.learn(0.01, BLOCKS, &random(1));
        assert!(moments.is_sound(BLOCKS) && !moments.is_sound(&BLOCKS[..1]));
        moments.products.0[3].im = f32::NAN;
        assert!(!moments.is_sound(BLOCKS));
    }
}
