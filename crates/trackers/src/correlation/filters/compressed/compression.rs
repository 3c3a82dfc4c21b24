use crate::correlation::scale::dot;
use multiversion::multiversion;
use nalgebra::SMatrix;
use nalgebra::linalg::SymmetricEigen;
use pursuit_vision::sampling::Planes;
use serde::{Deserialize, Serialize};

/// Channels that can be compressed: 31 of oriented gradients and one of grey.
pub const CHANNELS: usize = 32;

/// Sweeps of the eigenvalue iteration after which it is given up.
const MOST_SWEEPS: usize = 500;

/// P, the projection of features onto the directions in which a template varies most (danelljan2017, section 4.1): row by
/// row, the eigenvectors of C = Σₙ u(n) u(n)ᵀ with the largest eigenvalues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compression {
    dimensions: usize,
    rows: Vec<f32>,
}

impl Compression {
    /// Onto `dimensions` of the [`CHANNELS`] directions, at first the channels themselves.
    pub fn new(dimensions: usize) -> Self {
        let dimensions = dimensions.clamp(1, CHANNELS);
        let mut rows = vec![0.0; dimensions * CHANNELS];
        rows.iter_mut().step_by(CHANNELS + 1).for_each(|v| *v = 1.0);
        Self { dimensions, rows }
    }

    /// The number of compressed channels.
    pub const fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Whether a state read from outside holds together.
    pub fn is_consistent(&self) -> bool {
        (1..=CHANNELS).contains(&self.dimensions) && self.rows.len() == self.dimensions * CHANNELS
    }

    /// Fits the projection to a template: [`CHANNELS`] planes one after the other.
    pub fn fit(&mut self, template: &[f32]) {
        let cells = template.len() / CHANNELS;
        let plane = |c: usize| &template[c * cells..(c + 1) * cells];
        let mut products = SMatrix::<f64, CHANNELS, CHANNELS>::zeros();
        for i in 0..CHANNELS {
            for j in 0..=i {
                let product = f64::from(dot(plane(i), plane(j)));
                products[(i, j)] = product;
                products[(j, i)] = product;
            }
        }
        // A template without numbers to speak of leaves the projection as it is.
        if !products.iter().all(|v| v.is_finite()) {
            return;
        }
        let Some(eigen) = SymmetricEigen::try_new(products, f64::EPSILON, MOST_SWEEPS) else { return };
        let mut order: [usize; CHANNELS] = std::array::from_fn(|i| i);
        order.sort_unstable_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]).then(a.cmp(&b)));
        for (row, &k) in self.rows.chunks_exact_mut(CHANNELS).zip(&order) {
            row.iter_mut().zip(eigen.eigenvectors.column(k).iter()).for_each(|(out, v)| *out = *v as f32);
        }
    }

    /// Projects planes one after the other; `out` becomes the compressed ones.
    pub fn apply(&self, features: &[f32], size: pursuit_geometry::Size, out: &mut Planes) {
        out.reshape(size, self.dimensions);
        for (row, out) in self.rows.chunks_exact(CHANNELS).zip(out.planes_mut()) {
            out.fill(0.0);
            for (weight, plane) in row.iter().zip(features.chunks_exact(out.len().max(1))) {
                add_scaled(out, plane, *weight);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn add_scaled(out: &mut [f32], plane: &[f32], weight: f32) {
    out.iter_mut().zip(plane).for_each(|(out, v)| *out += weight * v);
}
