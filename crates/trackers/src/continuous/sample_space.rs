//! The model of the target's looks: a mixture of Gaussians of the same width, of which means and weights are kept
//! (danelljan2017eco, section 3.2).

use super::blocks::{Block, inner_product, len};
use super::coefficients::add_scaled;
use super::params::SampleParams;
use crate::correlation::filters::Spectra;
use pursuit_vision::fourier::Complex32;
use serde::{Deserialize, Serialize};

/// Means and weights of the components.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct SampleSpace {
    /// Weights π, which add up to 1.
    weights: Vec<f64>,
    /// Means μ, one after the other.
    means: Spectra,
    /// Inner products of all means, row by row.
    products: Vec<f64>,
}

impl SampleSpace {
    /// Whether a state that was read is one that learning leads to.
    pub(super) fn is_sound(&self, params: &SampleParams, blocks: &[Block]) -> bool {
        let n = self.weights.len();
        let positive = self.weights.iter().all(|w| w.is_finite() && *w >= 0.0);
        let numbers = self.means.0.iter().all(|c| c.re.is_finite() && c.im.is_finite());
        let finite = numbers && self.products.iter().all(|p| p.is_finite());
        let whole = self.means.0.len() == n * len(blocks) && self.products.len() == n * n;
        (1..=params.components).contains(&n) && positive && finite && whole
    }

    /// Weights and means.
    pub(super) fn components(&self) -> impl ExactSizeIterator<Item = (f64, &[Complex32])> {
        let each = self.means.0.len() / self.weights.len().max(1);
        self.weights.iter().copied().zip(self.means.0.chunks_exact(each.max(1)))
    }

    /// Learns a sample, the first with weight 1, others with weight γ; returns that. `scratch` is overwritten.
    pub(super) fn learn(
        &mut self,
        params: &SampleParams,
        blocks: &[Block],
        sample: &[Complex32],
        scratch: &mut Vec<f64>,
    ) -> f64 {
        let (n, rate) = (self.weights.len(), params.learning_rate);
        if n == 0 {
            self.reserve(params.components, sample.len());
            self.push(1.0, sample, &[], inner_product(blocks, sample, sample));
            return 1.0;
        }
        scratch.clear();
        scratch.extend(self.components().map(|(_, mean)| inner_product(blocks, mean, sample)));
        let own = inner_product(blocks, sample, sample);
        self.weights.iter_mut().for_each(|w| *w *= 1.0 - rate);
        if n < params.components {
            self.push(rate, sample, scratch, own);
            return rate;
        }
        let least = rate * (1.0 - rate).powi(params.dropped_after.min(1 << 20) as i32);
        let lightest = (0..n).min_by(|a, b| self.weights[*a].total_cmp(&self.weights[*b])).unwrap_or(0);
        if self.weights[lightest] < least {
            self.replace(lightest, rate, sample, scratch, own);
        } else {
            self.merge_closest(rate, sample, scratch, own);
        }
        let sum: f64 = self.weights.iter().sum();
        self.weights.iter_mut().for_each(|w| *w /= sum);
        rate
    }

    /// Of all components and the new one, merges the two whose means are closest.
    fn merge_closest(&mut self, rate: f64, sample: &[Complex32], with_sample: &mut [f64], own: f64) {
        let n = self.weights.len();
        let apart =
            |k: usize, l: usize| self.products[k * n + k] + self.products[l * n + l] - 2.0 * self.products[k * n + l];
        let from_sample = |k: usize| self.products[k * n + k] + own - 2.0 * with_sample[k];
        let nearest = |best: (f64, usize), k: usize| if from_sample(k) < best.0 { (from_sample(k), k) } else { best };
        let (to_sample, at) = (0..n).fold((f64::INFINITY, 0), nearest);
        let mut closest = (f64::INFINITY, 0, 0);
        for k in 0..n {
            for l in k + 1..n {
                let distance = apart(k, l);
                if distance < closest.0 {
                    closest = (distance, k, l);
                }
            }
        }
        // Of what is no number nothing is closest.
        if to_sample <= closest.0 || closest.1 == closest.2 {
            let share = rate / (self.weights[at] + rate);
            let mixed = |old: f64, new: f64| (1.0 - share) * old + share * new;
            let square = {
                let (old, cross) = (self.products[at * n + at], with_sample[at]);
                mixed(mixed(old, cross), mixed(cross, own))
            };
            for k in (0..n).filter(|k| *k != at) {
                let product = mixed(self.products[at * n + k], with_sample[k]);
                (self.products[at * n + k], self.products[k * n + at]) = (product, product);
            }
            self.products[at * n + at] = square;
            self.weights[at] += rate;
            let each = sample.len();
            blend(&mut self.means.0[at * each..(at + 1) * each], sample, share as f32);
        } else {
            let (_, k, l) = closest;
            let share = self.weights[l] / (self.weights[k] + self.weights[l]);
            let mixed = |a: f64, b: f64| (1.0 - share) * a + share * b;
            let (kk, kl, ll) = (self.products[k * n + k], self.products[k * n + l], self.products[l * n + l]);
            let square = mixed(mixed(kk, kl), mixed(kl, ll));
            for m in (0..n).filter(|m| *m != k && *m != l) {
                let product = mixed(self.products[k * n + m], self.products[l * n + m]);
                (self.products[k * n + m], self.products[m * n + k]) = (product, product);
            }
            self.products[k * n + k] = square;
            with_sample[k] = mixed(with_sample[k], with_sample[l]);
            self.weights[k] += self.weights[l];
            let each = sample.len();
            let (before, after) = self.means.0.split_at_mut(l * each);
            blend(&mut before[k * each..(k + 1) * each], &after[..each], share as f32);
            self.replace(l, rate, sample, with_sample, own);
        }
    }

    fn reserve(&mut self, components: usize, each: usize) {
        self.weights.reserve_exact(components);
        self.means.0.reserve_exact(components * each);
        self.products.reserve_exact(components * components);
    }

    /// One more component.
    fn push(&mut self, weight: f64, sample: &[Complex32], with_sample: &[f64], own: f64) {
        let n = self.weights.len();
        self.weights.push(weight);
        self.means.0.extend_from_slice(sample);
        // From n × n to (n + 1) × (n + 1), in place, from the end.
        self.products.resize((n + 1) * (n + 1), own);
        for k in (0..n).rev() {
            for l in (0..n).rev() {
                self.products[k * (n + 1) + l] = self.products[k * n + l];
            }
        }
        for (k, product) in with_sample.iter().enumerate() {
            (self.products[k * (n + 1) + n], self.products[n * (n + 1) + k]) = (*product, *product);
        }
        self.products[n * (n + 1) + n] = own;
    }

    /// The sample in place of component `at`.
    fn replace(&mut self, at: usize, weight: f64, sample: &[Complex32], with_sample: &[f64], own: f64) {
        let (n, each) = (self.weights.len(), sample.len());
        self.weights[at] = weight;
        self.means.0[at * each..(at + 1) * each].copy_from_slice(sample);
        for k in 0..n {
            (self.products[at * n + k], self.products[k * n + at]) = (with_sample[k], with_sample[k]);
        }
        self.products[at * n + at] = own;
    }
}

/// `a += share · (b − a)`.
fn blend(a: &mut [Complex32], b: &[Complex32], share: f32) {
    a.iter_mut().for_each(|a| *a *= 1.0 - share);
    add_scaled(a, b, share);
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;

    const BLOCKS: &[Block] = &[Block { channels: 2, order: 1 }, Block { channels: 1, order: 2 }];

    /// By the words of the paper, with the distances anew each time.
    #[derive(Default)]
    struct Slow(Vec<(f64, Vec<Complex32>)>);

    impl Slow {
        fn learn(&mut self, params: &SampleParams, sample: &[Complex32]) {
            let rate = params.learning_rate;
            if self.0.is_empty() {
                return self.0.push((1.0, sample.to_vec()));
            }
            self.0.iter_mut().for_each(|c| c.0 *= 1.0 - rate);
            if self.0.len() == params.components {
                let lightest = (0..self.0.len()).min_by(|a, b| self.0[*a].0.total_cmp(&self.0[*b].0)).unwrap();
                if self.0[lightest].0 < rate * (1.0 - rate).powi(params.dropped_after as i32) {
                    self.0.remove(lightest);
                }
            }
            self.0.push((rate, sample.to_vec()));
            if self.0.len() > params.components {
                let pairs = (0..self.0.len()).flat_map(|k| (0..k).map(move |l| (k, l)));
                let apart = |k: usize, l: usize| {
                    let difference: Vec<Complex32> = self.0[k].1.iter().zip(&self.0[l].1).map(|(a, b)| a - b).collect();
                    inner_product(BLOCKS, &difference, &difference)
                };
                let (k, l) = pairs.min_by(|a, b| apart(a.0, a.1).total_cmp(&apart(b.0, b.1))).unwrap();
                let (weight, mean) = self.0.remove(k);
                let into = &mut self.0[l];
                let sum = into.0 + weight;
                for (a, b) in into.1.iter_mut().zip(&mean) {
                    *a = (*a * into.0 as f32 + b * weight as f32) / sum as f32;
                }
                into.0 = sum;
            }
            let sum: f64 = self.0.iter().map(|c| c.0).sum();
            self.0.iter_mut().for_each(|c| c.0 /= sum);
        }
    }

    #[test]
    fn components_are_merged_and_dropped_as_the_paper_says() {
        for (components, dropped_after, rate) in [(6, 12, 0.05), (4, 10_000, 0.02), (5, 3, 0.2)] {
            let params = SampleParams { components, dropped_after, learning_rate: rate, ..SampleParams::default() };
            let (mut fast, mut slow, mut scratch) = (SampleSpace::default(), Slow::default(), Vec::new());
            let mut numbers = SplitMix::after(components as u64);
            for step in 0..60 {
                let sample: Vec<Complex32> = (0..len(BLOCKS))
                    .map(|i| {
                        let drift = (step as f32 * 0.3 + i as f32).sin();
                        Complex32::new(drift + numbers.unit() as f32, numbers.unit() as f32)
                    })
                    .collect();
                fast.learn(&params, BLOCKS, &sample, &mut scratch);
                slow.learn(&params, &sample);
                assert!(fast.is_sound(&params, BLOCKS));
                assert!((fast.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                assert_eq!(fast.weights.len(), slow.0.len());
                for (weight, mean) in fast.components() {
                    let same = |c: &&(f64, Vec<Complex32>)| {
                        (c.0 - weight).abs() < 1e-9 && c.1.iter().zip(mean).all(|(a, b)| (a - b).norm() < 1e-4)
                    };
                    assert_eq!(slow.0.iter().filter(same).count(), 1, "{components} at {step}: {weight}");
                }
            }
            let means: Vec<&[Complex32]> = fast.components().map(|c| c.1).collect();
            for (k, a) in means.iter().enumerate() {
                for (l, b) in means.iter().enumerate() {
                    let (got, want) = (fast.products[k * means.len() + l], inner_product(BLOCKS, a, b));
                    assert!((got - want).abs() < 1e-3 * want.abs().max(1.0), "{got} is not {want}");
                }
            }
        }
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let params = SampleParams { components: 3, ..SampleParams::default() };
        let mut space = SampleSpace::default();
        assert!(!space.is_sound(&params, BLOCKS));
        let sample = vec![Complex32::new(1.0, 0.0); len(BLOCKS)];
        space.learn(&params, BLOCKS, &sample, &mut Vec::new());
        assert!(space.is_sound(&params, BLOCKS));
        assert!(!space.is_sound(&params, &BLOCKS[..1]));
        space.weights[0] = f64::NAN;
        assert!(!space.is_sound(&params, BLOCKS));
        space.weights = vec![0.2; 4];
        assert!(!space.is_sound(&params, BLOCKS));
    }
}
