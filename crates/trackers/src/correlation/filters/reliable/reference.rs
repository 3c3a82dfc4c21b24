//! The slow, obvious solver: sums instead of transforms, double precision, eqs. 9 to 12 of lukezic2017 as they stand.

use super::super::regularised::reference::{C, dft};

pub struct Reference {
    pub width: usize,
    pub label: Vec<f64>,
    pub lambda: f64,
    pub penalty: f64,
    pub growth: f64,
    pub iterations: usize,
}

impl Reference {
    fn forward(&self, plane: &[f64]) -> Vec<C> {
        dft(&plane.iter().map(|&v| C::new(v, 0.0)).collect::<Vec<_>>(), self.width, -1.0)
    }

    fn inverse(&self, spectrum: &[C]) -> Vec<f64> {
        dft(spectrum, self.width, 1.0).iter().map(|v| v.re / spectrum.len() as f64).collect()
    }

    /// The filter of one channel in space.
    pub fn train(&self, x: &[f64], cells: &[f64], last: Option<&[f64]>) -> Vec<f64> {
        let (x, y) = (self.forward(x), self.forward(&self.label));
        let masked = |h: &[f64]| h.iter().zip(cells).map(|(h, m)| h * m).collect::<Vec<_>>();
        let ridge: Vec<C> = x.iter().zip(&y).map(|(x, y)| x * y.conj() / (x.norm_sqr() + self.lambda)).collect();
        let mut confined = masked(&last.map_or_else(|| self.inverse(&ridge), <[f64]>::to_vec));
        let mut dual = vec![C::default(); x.len()];
        let mut penalty = self.penalty;
        for _ in 0..self.iterations {
            let h = self.forward(&confined);
            let free: Vec<C> = (0..x.len())
                .map(|k| (x[k] * y[k].conj() + h[k] * penalty - dual[k]) / (x[k].norm_sqr() + penalty))
                .collect();
            let both: Vec<C> = free.iter().zip(&dual).map(|(free, dual)| dual + free * penalty).collect();
            let share = self.lambda / (2.0 * x.len() as f64) + penalty;
            confined = masked(&self.inverse(&both)).iter().map(|h| h / share).collect();
            let h = self.forward(&confined);
            dual = (0..x.len()).map(|k| dual[k] + (free[k] - h[k]) * penalty).collect();
            penalty *= self.growth;
        }
        confined
    }

    /// Correlation of filter and features, by its definition: Σ f(p)·x(p + shift).
    pub fn respond(&self, filter: &[f64], x: &[f64]) -> Vec<f64> {
        let (w, n) = (self.width, self.label.len());
        let at = |k: usize, s: usize| (k / w + s / w) % (n / w) * w + (k % w + s % w) % w;
        (0..n).map(|s| (0..n).map(|k| filter[k] * x[at(k, s)]).sum()).collect()
    }
}
