use super::canvas::LANES;
use multiversion::multiversion;
use serde::{Deserialize, Serialize};

/// A normal distribution of a feature's values, told online.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Normal {
    pub mean: f32,
    pub variance: f32,
}

/// Least variance, in units of the feature squared.
const LEAST_VARIANCE: f32 = 1e-3;

impl Normal {
    /// Of some values; of none, that of grey codes before anything is known.
    pub fn of(values: impl ExactSizeIterator<Item = f32> + Clone) -> Self {
        let n = values.len().max(1) as f32;
        let mean = values.clone().sum::<f32>() / n;
        let variance = values.map(|v| (v - mean) * (v - mean)).sum::<f32>() / n;
        Self { mean, variance: variance.max(LEAST_VARIANCE) }
    }

    /// Moves by a share towards that of new values.
    pub fn blend(&mut self, new: &Self, rate: f32) {
        self.mean += rate * (new.mean - self.mean);
        self.variance = (self.variance + rate * (new.variance - self.variance)).max(LEAST_VARIANCE);
    }

    /// Whether it is one.
    pub fn is_sound(&self) -> bool {
        self.mean.is_finite() && self.variance.is_finite() && self.variance > 0.0
    }
}

/// The logarithm of how much likelier a value is under one normal distribution than under another: c + b·v + a·v².
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct LogRatio {
    c: f32,
    b: f32,
    a: f32,
}

impl LogRatio {
    pub fn new(positive: &Normal, negative: &Normal) -> Self {
        let term = |n: &Normal| {
            let w = 0.5 / n.variance;
            (-0.5 * n.variance.ln() - w * n.mean * n.mean, 2.0 * w * n.mean, -w)
        };
        let (p, n) = (term(positive), term(negative));
        Self { c: p.0 - n.0, b: p.1 - n.1, a: p.2 - n.2 }
    }

    pub fn of(&self, v: f32) -> f32 {
        self.c + v * (self.b + v * self.a)
    }

    /// Adds those of some values.
    pub fn add(&self, values: &[f32; LANES], out: &mut [f32; LANES]) {
        add_polynomial(self.c, self.b, self.a, values, out);
    }
}

#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn add_polynomial(c: f32, b: f32, a: f32, values: &[f32; LANES], out: &mut [f32; LANES]) {
    for i in 0..LANES {
        out[i] += c + values[i] * (b + values[i] * a);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_of_densities() {
        let (p, n) = (Normal { mean: 3.0, variance: 2.0 }, Normal { mean: -1.0, variance: 5.0 });
        let density = |d: &Normal, v: f32| (-(v - d.mean).powi(2) / (2.0 * d.variance)).exp() / d.variance.sqrt();
        let ratio = LogRatio::new(&p, &n);
        for v in [-4.0, 0.0, 1.5, 6.0] {
            assert!((ratio.of(v) - (density(&p, v) / density(&n, v)).ln()).abs() < 1e-4);
        }
        let mut out = [1.0; LANES];
        ratio.add(&[1.5; LANES], &mut out);
        assert!(out.iter().all(|o| (o - 1.0 - ratio.of(1.5)).abs() < 1e-6));
    }

    #[test]
    fn distributions_move_by_their_share() {
        let mut known = Normal::of([1.0, 3.0].into_iter());
        assert_eq!((known.mean, known.variance), (2.0, 1.0));
        known.blend(&Normal { mean: 6.0, variance: 5.0 }, 0.25);
        assert_eq!((known.mean, known.variance), (3.0, 2.0));
        assert!(Normal::of([4.0; 3].into_iter()).is_sound());
    }
}
