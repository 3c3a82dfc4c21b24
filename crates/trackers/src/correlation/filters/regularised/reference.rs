//! The slow, obvious solver: dense linear algebra in every bin, sums instead of transforms, double precision.

use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

pub type C = Complex<f64>;

/// The transform by its definition; not divided by anything.
pub fn dft(plane: &[C], w: usize, sign: f64) -> Vec<C> {
    let h = plane.len() / w;
    let bin = |k: usize| {
        let (u, v) = (k % w, k / w);
        let term = |i: usize| {
            let turns = (u * (i % w)) as f64 / w as f64 + (v * (i / w)) as f64 / h as f64;
            Complex::from_polar(1.0, sign * TAU * turns) * plane[i]
        };
        (0..plane.len()).map(term).sum()
    };
    (0..plane.len()).map(bin).collect()
}

pub struct Reference {
    pub width: usize,
    pub label: Vec<f64>,
    pub temporal: f64,
    pub spatial: f64,
    pub penalty: f64,
    pub growth: f64,
    pub iterations: usize,
}

impl Reference {
    fn spectra(&self, planes: &[Vec<f64>]) -> Vec<Vec<C>> {
        planes.iter().map(|p| dft(&p.iter().map(|&v| C::new(v, 0.0)).collect::<Vec<_>>(), self.width, -1.0)).collect()
    }

    fn planes(&self, spectra: &[Vec<C>]) -> Vec<Vec<f64>> {
        let n = self.label.len() as f64;
        spectra.iter().map(|s| dft(s, self.width, 1.0).iter().map(|v| v.re / n).collect()).collect()
    }

    /// Filters of all channels, in space.
    pub fn train(
        &self,
        x: &[Vec<f64>],
        last: Option<&[Vec<f64>]>,
        inside: impl Fn(usize, usize) -> bool,
    ) -> Vec<Vec<f64>> {
        let (n, d) = (self.label.len(), x.len());
        let zero = vec![vec![0.0; n]; d];
        let (spectra, label) = (self.spectra(x), &self.spectra(std::slice::from_ref(&self.label))[0]);
        let temporal = if last.is_some() { self.temporal } else { 0.0 };
        let last = self.spectra(last.unwrap_or(&zero));
        let (mut g, mut h, mut penalty) = (zero.clone(), zero, self.penalty);
        for i in 0.. {
            let target: Vec<Vec<f64>> =
                g.iter().zip(&h).map(|(g, h)| g.iter().zip(h).map(|(g, h)| g - h).collect()).collect();
            let target = self.spectra(&target);
            let mut f = vec![vec![C::default(); n]; d];
            for k in 0..n {
                let x = DVector::from_fn(d, |c, _| spectra[c][k]);
                let system =
                    &x * x.adjoint() / C::from(n as f64) + DMatrix::<C>::identity(d, d) * C::from(temporal + penalty);
                let right = DVector::from_fn(d, |c, _| {
                    x[c] * label[k].conj() / n as f64 + last[c][k] * temporal + target[c][k] * penalty
                });
                let solution = system.lu().solve(&right).unwrap();
                (0..d).for_each(|c| f[c][k] = solution[c]);
            }
            let f = self.planes(&f);
            if i + 1 == self.iterations {
                return f;
            }
            let next = penalty * self.growth;
            for c in 0..d {
                for k in 0..n {
                    let v = f[c][k] + h[c][k];
                    let kept = inside(k % self.width, k / self.width);
                    g[c][k] = if kept { penalty * v / (penalty + self.spatial) } else { 0.0 };
                    h[c][k] = (v - g[c][k]) * penalty / next;
                }
            }
            penalty = next;
        }
        unreachable!()
    }

    /// Correlation of filter and features, by its definition: Σ f(p)·x(p + shift).
    pub fn respond(&self, filter: &[Vec<f64>], x: &[Vec<f64>]) -> Vec<f64> {
        let (w, n) = (self.width, self.label.len());
        let h = n / w;
        let at = |k: usize, s: usize| (k / w + s / w) % h * w + (k % w + s % w) % w;
        let one = |s: usize| filter.iter().zip(x).map(|(f, x)| (0..n).map(|k| f[k] * x[at(k, s)]).sum::<f64>()).sum();
        (0..n).map(one).collect()
    }
}
