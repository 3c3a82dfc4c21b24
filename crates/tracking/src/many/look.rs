//! What a target looks like, by the embeddings of its detections.

use serde::{Deserialize, Serialize};

/// A mean of embeddings, the newest counting most (wojke2017; zhang2021: moving average).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Look {
    mean: Vec<f32>,
    /// Time since an embedding was learned, in seconds.
    age_s: f64,
}

/// How much of the mean stays when an embedding joins it.
const KEPT: f32 = 0.9;

impl Look {
    /// Takes the embedding of a detection; one that is none, or all zeros, changes nothing, one of another length starts anew.
    pub fn learn(&mut self, embedding: &[f32]) {
        let length = embedding.iter().map(|v| v * v).sum::<f32>().sqrt();
        if !length.is_finite() || length <= f32::MIN_POSITIVE {
            return;
        }
        self.age_s = 0.0;
        let unit = embedding.iter().map(|v| v / length);
        if self.mean.len() == embedding.len() {
            self.mean.iter_mut().zip(unit).for_each(|(mean, new)| *mean = KEPT * *mean + (1.0 - KEPT) * new);
        } else {
            self.mean.clear();
            self.mean.extend(unit);
        }
    }

    /// Time goes by.
    pub fn wait(&mut self, dt_s: f64) {
        self.age_s += dt_s;
    }

    /// Whether nothing was learned yet, or nothing for so long.
    pub fn is_due(&self, every_s: f64) -> bool {
        self.mean.is_empty() || self.age_s >= every_s
    }

    /// The cosine of the angle between the mean and an embedding, in [−1, 1]; `None` where they cannot be compared.
    pub fn likeness(&self, embedding: &[f32]) -> Option<f64> {
        if self.mean.is_empty() || self.mean.len() != embedding.len() {
            return None;
        }
        let (mut dot, mut own, mut other) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (a, b) in self.mean.iter().zip(embedding) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            (dot, own, other) = (dot + a * b, own + a * a, other + b * b);
        }
        let cosine = dot / (own * other).sqrt();
        cosine.is_finite().then(|| cosine.clamp(-1.0, 1.0))
    }

    /// Whether it can be a mean: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        self.mean.iter().all(|v| v.is_finite()) && self.age_s.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn likeness_is_the_cosine_to_the_mean() {
        let mut look = Look::default();
        assert_eq!(look.likeness(&[1.0, 0.0]), None, "nothing was learned");
        look.learn(&[2.0, 0.0]);
        assert_eq!(look.likeness(&[5.0, 0.0]), Some(1.0));
        assert_eq!(look.likeness(&[0.0, 1.0]), Some(0.0));
        look.learn(&[0.0, 3.0]);
        let mean = (0.9_f64.powi(2) + 0.1_f64.powi(2)).sqrt();
        assert!((look.likeness(&[1.0, 0.0]).unwrap() - 0.9 / mean).abs() < 1e-6);
        let before = look.clone();
        for none in [&[f32::NAN, 0.0][..], &[0.0, 0.0], &[]] {
            look.learn(none);
            assert_eq!((look == before, look.likeness(none)), (true, None), "{none:?}");
        }
        assert_eq!(look.likeness(&[1.0]), None, "another length");
    }
}
