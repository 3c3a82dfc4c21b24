//! A mixture of Gaussians of colours, as `GrabCut` has it: Rother, Kolmogorov and Blake (2004), "`GrabCut`: interactive foreground
//! extraction using iterated graph cuts", section 3.

use serde::{Deserialize, Serialize};

/// Sums over the colours of a part, as shares of the whole: of ones, of each channel, and of the products of two channels (00, 01, 02, 11,
/// 12, 22).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Sums {
    share: f64,
    first: [f64; 3],
    second: [f64; 6],
}

const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Sums {
    fn add(&mut self, color: [f32; 3]) {
        let c = color.map(f64::from);
        self.share += 1.0;
        self.first.iter_mut().zip(c).for_each(|(sum, v)| *sum += v);
        self.second.iter_mut().zip(PAIRS).for_each(|(sum, (i, j))| *sum += c[i] * c[j]);
    }

    /// This times `weight`, and `other` times `theirs`.
    fn mixed(&self, weight: f64, other: &Self, theirs: f64) -> Self {
        let mix = |a: f64, b: f64| weight * a + theirs * b;
        let mut sums = Self { share: mix(self.share, other.share), ..*self };
        sums.first.iter_mut().zip(other.first).for_each(|(a, b)| *a = mix(*a, b));
        sums.second.iter_mut().zip(other.second).for_each(|(a, b)| *a = mix(*a, b));
        sums
    }

    fn mean(&self) -> [f64; 3] {
        self.first.map(|v| v / self.share)
    }

    /// 00, 01, 02, 11, 12, 22.
    fn covariance(&self) -> [f64; 6] {
        let mean = self.mean();
        let mut covariance = self.second;
        covariance.iter_mut().zip(PAIRS).for_each(|(v, (i, j))| *v = *v / self.share - mean[i] * mean[j]);
        covariance
    }
}

/// What [`cost`](ColorMixture::cost) needs of a part: its mean, the inverse of its covariance, and −ln of its share and √det.
#[derive(Debug, Clone, Copy)]
struct Gaussian {
    mean: [f32; 3],
    inverse: [f32; 6],
    offset: f32,
}

/// What colours something has: few Gaussians, each a part of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct ColorMixture {
    noise: f64,
    parts: Vec<Sums>,
    gaussians: Vec<Gaussian>,
    /// Not state: sums over the colours being learnt.
    fresh: Vec<Sums>,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    noise: f64,
    parts: Vec<Sums>,
}

impl From<ColorMixture> for Saved {
    fn from(mixture: ColorMixture) -> Self {
        Self { noise: mixture.noise, parts: mixture.parts }
    }
}

impl TryFrom<Saved> for ColorMixture {
    type Error = &'static str;

    fn try_from(Saved { noise, parts }: Saved) -> Result<Self, &'static str> {
        let finite = |s: &Sums| {
            s.share >= 0.0 && [s.share].iter().chain(&s.first).chain(&s.second).all(|v| v.is_finite() && v.abs() < 1e9)
        };
        if !(1..=MOST_PARTS).contains(&parts.len()) || !parts.iter().all(finite) || !(1.0..1e3).contains(&noise) {
            return Err("its mixture of colours is none");
        }
        let mut mixture = Self { noise, parts, gaussians: Vec::new(), fresh: Vec::new() };
        mixture.prepare();
        Ok(mixture)
    }
}

/// More parts are not kept.
const MOST_PARTS: usize = 16;
/// A part of less is left out: it says nothing of its shape.
const LEAST_SHARE: f64 = 1e-4;
/// What a colour costs where nothing is known.
const UNKNOWN: f32 = 30.0;

impl ColorMixture {
    /// A mixture of at most `parts` Gaussians of `colors` (channels from 0 to 255), divided as Orchard and Bouman (1991) do: the part
    /// that is spread most, across the direction in which it is. `noise` ≥ 1 is the least standard deviation of a part, in codes.
    pub fn fit(colors: &[[f32; 3]], parts: usize, noise: f64) -> Self {
        let parts = parts.clamp(1, MOST_PARTS);
        let sums = |colors: &[[f32; 3]]| {
            let mut sums = Sums::default();
            colors.iter().for_each(|c| sums.add(*c));
            sums
        };
        let mut groups = vec![(colors.to_vec(), sums(colors))];
        while groups.len() < parts {
            let spread = |s: &Sums| if s.share > 1.0 { s.share * principal(&s.covariance()).1 } else { 0.0 };
            let widest = groups.iter().enumerate().max_by(|a, b| spread(&a.1.1).total_cmp(&spread(&b.1.1)));
            let Some((at, _)) = widest.filter(|(_, (_, s))| spread(s) > s.share * noise * noise) else { break };
            let (all, whole) = groups.swap_remove(at);
            let (mean, (axis, _)) = (whole.mean(), principal(&whole.covariance()));
            let is_beyond = |c: &[f32; 3]| (0..3).map(|i| (f64::from(c[i]) - mean[i]) * axis[i]).sum::<f64>() > 0.0;
            let (beyond, before): (Vec<_>, Vec<_>) = all.into_iter().partition(is_beyond);
            for half in [before, beyond] {
                let own = sums(&half);
                groups.push((half, own));
            }
        }
        let count = colors.len().max(1) as f64;
        let parts = groups.iter().map(|(_, s)| s.mixed(1.0 / count, &Sums::default(), 0.0)).collect();
        let mut mixture = Self { noise: noise.max(1.0), parts, gaussians: Vec::new(), fresh: Vec::new() };
        mixture.prepare();
        mixture
    }

    /// How unlike it a colour is: −ln of the weighted density of the part that explains it best, less a constant (eq. 9 of the paper).
    pub fn cost(&self, color: [f32; 3]) -> f32 {
        self.nearest(color).1
    }

    fn nearest(&self, color: [f32; 3]) -> (usize, f32) {
        let mut best = (0, UNKNOWN);
        for (k, g) in self.gaussians.iter().enumerate() {
            let [x, y, z] = [color[0] - g.mean[0], color[1] - g.mean[1], color[2] - g.mean[2]];
            let [a, b, c, d, e, f] = g.inverse;
            let distance = a * x * x + d * y * y + f * z * z + 2.0 * (b * x * y + c * x * z + e * y * z);
            let cost = g.offset + 0.5 * distance;
            if k == 0 || cost < best.1 {
                best = (k, cost);
            }
        }
        best
    }

    /// Learns `colors`: each is a colour of the part that explains it best; `rate`, in `[0, 1]`, is their weight against all before.
    pub fn learn(&mut self, colors: impl IntoIterator<Item = [f32; 3]>, rate: f64) {
        let mut fresh = std::mem::take(&mut self.fresh);
        fresh.clear();
        fresh.resize(self.parts.len(), Sums::default());
        let mut count = 0.0;
        for color in colors {
            fresh[self.nearest(color).0].add(color);
            count += 1.0;
        }
        if count > 0.0 {
            for (part, new) in self.parts.iter_mut().zip(&fresh) {
                *part = part.mixed(1.0 - rate, new, rate / count);
            }
            self.prepare();
        }
        self.fresh = fresh;
    }

    fn prepare(&mut self) {
        let floor = self.noise * self.noise;
        self.gaussians.clear();
        self.gaussians.extend(self.parts.iter().map(|part| {
            if part.share < LEAST_SHARE {
                return Gaussian { mean: [0.0; 3], inverse: [0.0; 6], offset: UNKNOWN };
            }
            let mut covariance = part.covariance();
            [0, 3, 5].into_iter().for_each(|k| covariance[k] = covariance[k].max(0.0) + floor);
            let [a, b, c, d, e, f] = covariance;
            let [aa, bb, cc] = [d * f - e * e, c * e - b * f, b * e - c * d];
            // Rounding must not make what is nearly flat negative.
            let det = (a * aa + b * bb + c * cc).max(floor.powi(3) * 1e-3);
            let inverse = [aa, bb, cc, a * f - c * c, b * c - a * e, a * d - b * b].map(|v| (v / det) as f32);
            let offset = (0.5 * det.ln() - part.share.ln()) as f32;
            Gaussian { mean: part.mean().map(|v| v as f32), inverse, offset }
        }));
    }
}

/// The direction in which a covariance is widest, and the variance along it, by repeated multiplication.
fn principal(&[a, b, c, d, e, f]: &[f64; 6]) -> ([f64; 3], f64) {
    const ROUNDS: usize = 24;
    let times =
        |v: [f64; 3]| [a * v[0] + b * v[1] + c * v[2], b * v[0] + d * v[1] + e * v[2], c * v[0] + e * v[1] + f * v[2]];
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Not along an axis, nor a diagonal: these may be directions of no variance.
    let mut axis = [0.61, 0.67, 0.42];
    let mut variance = 0.0;
    for _ in 0..ROUNDS {
        let next = times(axis);
        variance = length(next);
        if variance <= 0.0 {
            break;
        }
        axis = next.map(|x| x / variance);
    }
    (axis, variance)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Three bands of colours, each with a little spread of its own.
    fn colors() -> Vec<[f32; 3]> {
        let spread = |k: usize, by: f32| by * ((k * 7919 % 101) as f32 / 50.0 - 1.0);
        (0..300)
            .map(|k| {
                let base = [[200.0, 40.0, 30.0], [30.0, 180.0, 60.0], [90.0, 90.0, 220.0]][k % 3];
                [base[0] + spread(k, 6.0), base[1] + spread(k + 31, 9.0), base[2] + spread(k + 57, 4.0)]
            })
            .collect()
    }

    #[test]
    fn costs_are_those_of_the_density() {
        // One part: the mean and the covariance of all, by their definitions.
        let colors = colors();
        let mixture = ColorMixture::fit(&colors, 1, 2.0);
        let n = colors.len() as f64;
        let mean = mean_of(&colors);
        let mut m = [[0.0_f64; 3]; 3];
        for c in &colors {
            for i in 0..3 {
                for j in 0..3 {
                    m[i][j] += (f64::from(c[i]) - mean[i]) * (f64::from(c[j]) - mean[j]) / n;
                }
            }
        }
        (0..3).for_each(|i| m[i][i] += 4.0);
        let det = det3(&m);
        for color in [[0.0, 0.0, 0.0], [100.0, 120.0, 90.0], [250.0, 20.0, 255.0]] {
            let d: Vec<f64> = (0..3).map(|i| f64::from(color[i]) - mean[i]).collect();
            // Cramer's rule: the solution of m x = d, then dᵀx.
            let distance: f64 = (0..3)
                .map(|k| {
                    let mut replaced = m;
                    (0..3).for_each(|i| replaced[i][k] = d[i]);
                    d[k] * det3(&replaced) / det
                })
                .sum();
            let wanted = 0.5 * det.ln() + 0.5 * distance;
            let said = f64::from(mixture.cost(color));
            assert!((said - wanted).abs() < 1e-3 * wanted.abs(), "{color:?}: {said} {wanted}");
        }
    }

    fn mean_of(colors: &[[f32; 3]]) -> [f64; 3] {
        [0, 1, 2].map(|i| colors.iter().map(|c| f64::from(c[i])).sum::<f64>() / colors.len() as f64)
    }

    fn det3(m: &[[f64; 3]; 3]) -> f64 {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    }

    #[test]
    fn parts_find_the_bands_and_follow_them() {
        let colors = colors();
        let mut mixture = ColorMixture::fit(&colors, 5, 5.0);
        let near = mixture.cost([200.0, 40.0, 30.0]);
        assert!(near + 10.0 < mixture.cost([120.0, 120.0, 120.0]), "{near}");
        // The red becomes orange.
        let changed = |c: &[f32; 3]| if c[0] > 150.0 { [c[0], c[1] + 60.0, c[2]] } else { *c };
        for _ in 0..30 {
            mixture.learn(colors.iter().map(changed), 0.2);
        }
        assert!(mixture.cost([200.0, 100.0, 30.0]) + 5.0 < mixture.cost([200.0, 40.0, 30.0]));
    }

    #[test]
    fn colours_without_spread_have_costs() {
        for colors in [&[][..], &[[9.0; 3]; 4][..]] {
            let mut mixture = ColorMixture::fit(colors, 5, 5.0);
            mixture.learn(std::iter::empty(), 0.5);
            assert!(mixture.cost([9.0; 3]).is_finite() && mixture.cost([200.0; 3]).is_finite());
        }
    }

    #[test]
    fn what_is_saved_is_checked() {
        let mixture = ColorMixture::fit(&colors(), 5, 5.0);
        let text = serde_json::to_string(&mixture).unwrap();
        let back: ColorMixture = serde_json::from_str(&text).unwrap();
        assert_eq!(back.cost([50.0, 90.0, 70.0]), mixture.cost([50.0, 90.0, 70.0]));
        assert!(serde_json::from_str::<ColorMixture>(r#"{"noise":5.0,"parts":[]}"#).is_err());
        assert!(serde_json::from_str::<ColorMixture>(&text.replacen("5.0", "0.0", 1)).is_err());
    }
}
