//! The slow, obvious coder: circulant matrices written out, dense algebra, double precision.

use nalgebra::{DMatrix, DVector};

pub struct Dense {
    /// Rows: all channels of a window. Columns: all shifts of the templates.
    dictionary: DMatrix<f64>,
}

fn soft(v: f64, by: f64) -> f64 {
    v.signum() * (v.abs() - by).max(0.0)
}

impl Dense {
    /// `templates`: all channels one after the other, each `width` · `height` values, row by row.
    pub fn new(templates: &[Vec<f64>], (width, height): (usize, usize), channels: usize) -> Self {
        let cells = width * height;
        let dictionary = DMatrix::from_fn(channels * cells, templates.len() * cells, |row, column| {
            let (channel, at) = (row / cells, row % cells);
            let (template, shift) = (column / cells, column % cells);
            let x = (at % width + width - shift % width) % width;
            let y = (at / width + height - shift / width) % height;
            templates[template][channel * cells + y * width + x]
        });
        Self { dictionary }
    }

    pub fn objective(&self, x: &[f64], z: &[f64], lambda: f64) -> f64 {
        let rest = DVector::from_column_slice(x) - &self.dictionary * DVector::from_column_slice(z);
        0.5 * rest.norm_squared() + lambda * z.iter().map(|v| v.abs()).sum::<f64>()
    }

    /// The alternating directions, step by step.
    pub fn alternate(&self, x: &[f64], lambda: f64, penalty: f64, iterations: usize) -> Vec<f64> {
        let a = &self.dictionary;
        let n = a.ncols();
        let inverse = (a.transpose() * a + penalty * DMatrix::identity(n, n)).try_inverse().unwrap();
        let seen = a.transpose() * DVector::from_column_slice(x);
        let (mut y, mut u) = (DVector::zeros(n), DVector::zeros(n));
        for _ in 0..iterations {
            let z = &inverse * (&seen + penalty * (&y - &u));
            y = (&z + &u).map(|v| soft(v, lambda / penalty));
            u += &z - &y;
        }
        y.as_slice().to_vec()
    }

    /// Iterated shrinking along the gradient: another way to the same least.
    pub fn shrink(&self, x: &[f64], lambda: f64, iterations: usize) -> Vec<f64> {
        let a = &self.dictionary;
        let gram = a.transpose() * a;
        let seen = a.transpose() * DVector::from_column_slice(x);
        let bound = gram.column_iter().map(|c| c.lp_norm(1)).fold(0.0, f64::max);
        let mut z = DVector::zeros(a.ncols());
        for _ in 0..iterations {
            z = (&z + (&seen - &gram * &z) / bound).map(|v| soft(v, lambda / bound));
        }
        z.as_slice().to_vec()
    }
}
