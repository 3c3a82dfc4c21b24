//! Factorised convolution: the filter and the matrix that compresses the features are learned together in the first frame
//! (danelljan2017eco, section 3.1).

use super::blocks::{Block, channels, channels_mut};
use super::coefficients::{add_scaled, inner, multiply_conj};
use super::gradients::{Directions, Operator, Steps, Unknown};
use super::objective::{Objective, scale_each};
use super::params::{CompressionParams, ConjugateGradientParams};
use nalgebra::{DMatrix, SymmetricEigen};
use pursuit_vision::fourier::{Complex32, spectra};
use pursuit_vision::sampling::Planes;

/// The principal components of features: `kept` rows of one weight a channel, the strongest first.
pub(super) fn principal_components(features: &Planes, kept: usize) -> Vec<f32> {
    let (n, area) = (features.channels(), features.size().area().max(1));
    let means: Vec<f64> =
        features.planes().map(|p| p.iter().map(|v| f64::from(*v)).sum::<f64>() / area as f64).collect();
    let covariance = DMatrix::from_fn(n, n, |a, b| {
        let products = features.plane(a).iter().zip(features.plane(b)).map(|(a, b)| f64::from(*a) * f64::from(*b));
        products.sum::<f64>() / area as f64 - means[a] * means[b]
    });
    let eigen = SymmetricEigen::new(covariance);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let column = |k: &usize| eigen.eigenvectors.column(*k).iter().map(|v| *v as f32).collect::<Vec<f32>>();
    order.iter().take(kept).flat_map(column).collect()
}

/// The first sample before it is compressed.
pub(super) struct FirstSample<'a> {
    /// As the filter's blocks, with as many channels as there are features.
    pub blocks: &'a [Block],
    /// Coefficients.
    pub sample: &'a [Complex32],
}

impl FirstSample<'_> {
    /// The channels and rows of the matrix of each block: raw channels, first entry.
    fn compress(&self, compressed: &[Block], matrix: &[f32], out: &mut [Complex32]) {
        out.fill(Complex32::default());
        let (mut raw, mut rows, mut out) = (self.sample, matrix, out);
        for (own, block) in self.blocks.iter().zip(compressed) {
            let (x, raw_rest) = raw.split_at(own.len());
            let (p, rows_rest) = rows.split_at(own.channels * block.channels);
            let (z, out_rest) = out.split_at_mut(block.len());
            for (row, z) in p.chunks_exact(own.channels).zip(z.chunks_exact_mut(block.each())) {
                for (weight, x) in row.iter().zip(x.chunks_exact(own.each())) {
                    add_scaled(z, x, *weight);
                }
            }
            (raw, rows, out) = (raw_rest, rows_rest, out_rest);
        }
    }
}

/// Learns filter and matrices from the first sample. `matrix` has the rows of all blocks, one after the other.
pub(super) fn learn(
    objective: &mut Objective,
    first: &FirstSample<'_>,
    (compression, solver): (&CompressionParams, &ConjugateGradientParams),
    matrix: &mut [f32],
    filter: &mut [Complex32],
) {
    let blocks = objective.blocks;
    let n = objective.len();
    let mut x = Unknown::zeros(n, matrix.len());
    let mut steps = Steps::new(n, matrix.len());
    let mut operator = Linearised::new(objective, first, compression.weight, matrix.len());
    // The matrix says nothing about a filter of zeros: step 0 finds one for the principal components.
    for step in 0..=compression.steps {
        operator.linearise(solver, matrix, &x.filter.0, step == 0);
        x.matrix.fill(0.0);
        operator.descent(matrix, &x.filter.0, &mut steps.residual);
        let mut on = Directions::zeros(n, matrix.len());
        steps.take(&blocks, &mut operator, &mut x, &mut on, solver.first_iterations);
        matrix.iter_mut().zip(&x.matrix).for_each(|(p, change)| *p += change);
    }
    filter.copy_from_slice(&x.filter.0);
}

/// The least-squares problem about a filter f and a matrix P: z(P)·f' + z(ΔP)·f ≈ y (danelljan2017eco, eqs. 7 and 8).
pub(super) struct Linearised<'a> {
    objective: &'a mut Objective,
    first: &'a FirstSample<'a>,
    /// λ.
    weight: f32,
    /// The sample, compressed by P.
    compressed: Vec<Complex32>,
    /// f.
    filter: Vec<Complex32>,
    inverse: Vec<f32>,
    inverse_matrix: Vec<f32>,
    /// Scratch: the sample, compressed by ΔP.
    moved: Vec<Complex32>,
    sum: Vec<Complex32>,
    product: Vec<Complex32>,
}

impl<'a> Linearised<'a> {
    /// With matrices of so many `entries`, of weight λ.
    pub(super) fn new(objective: &'a mut Objective, first: &'a FirstSample<'a>, weight: f64, entries: usize) -> Self {
        let zeros = vec![Complex32::default(); objective.len()];
        let sum = vec![Complex32::default(); objective.label.len()];
        Self {
            weight: weight as f32,
            compressed: zeros.clone(),
            filter: zeros.clone(),
            inverse: Vec::new(),
            inverse_matrix: vec![0.0; entries],
            moved: zeros,
            product: sum.clone(),
            sum,
            objective,
            first,
        }
    }

    /// About this matrix and this filter.
    pub(super) fn linearise(
        &mut self,
        params: &ConjugateGradientParams,
        matrix: &[f32],
        filter: &[Complex32],
        matrix_is_fixed: bool,
    ) {
        self.first.compress(&self.objective.blocks, matrix, &mut self.compressed);
        self.filter.copy_from_slice(filter);
        let energy: Vec<f32> = self.compressed.iter().map(Complex32::norm_sqr).collect();
        self.objective.precondition(params, &energy, &mut self.inverse);
        // One over the diagonal: ‖x_d·f_c‖² + λ.
        let (mut raw, mut filter, mut out) = (self.first.sample, &self.filter[..], &mut self.inverse_matrix[..]);
        for (own, block) in self.first.blocks.iter().zip(&self.objective.blocks) {
            let (x, raw_rest) = raw.split_at(own.len());
            let (f, filter_rest) = filter.split_at(block.len());
            let (entries, out_rest) = out.split_at_mut(own.channels * block.channels);
            for (row, f) in entries.chunks_exact_mut(own.channels).zip(f.chunks_exact(block.each())) {
                for (entry, x) in row.iter_mut().zip(x.chunks_exact(own.each())) {
                    let energies = x.iter().zip(f).map(|(x, f)| x.norm_sqr() * f.norm_sqr());
                    *entry = if matrix_is_fixed { 0.0 } else { 1.0 / (2.0 * energies.sum::<f32>() + self.weight) };
                }
            }
            (raw, filter, out) = (raw_rest, filter_rest, out_rest);
        }
    }

    /// `out.filter = z̄·sum` and `out.matrix[c, d] = ∫ (x_d ∗ f_c)·sum`, with `self.sum`.
    fn adjoint(&mut self, out: &mut Unknown) {
        let Self { objective, first, compressed, filter, sum, product, .. } = self;
        out.filter.0.fill(Complex32::default());
        let z = channels(&objective.blocks, compressed);
        for (z, out) in z.zip(channels_mut(&objective.blocks, &mut out.filter.0)) {
            spectra::add_conj_product(out, z, &sum[..z.len()]);
        }
        let (mut raw, mut filter, mut out) = (first.sample, &filter[..], &mut out.matrix[..]);
        for (own, block) in first.blocks.iter().zip(&objective.blocks) {
            let (x, raw_rest) = raw.split_at(own.len());
            let (f, filter_rest) = filter.split_at(block.len());
            let (entries, out_rest) = out.split_at_mut(own.channels * block.channels);
            for (row, f) in entries.chunks_exact_mut(own.channels).zip(f.chunks_exact(block.each())) {
                let product = &mut product[..f.len()];
                multiply_conj(product, f, &sum[..f.len()]);
                for (entry, x) in row.iter_mut().zip(x.chunks_exact(own.each())) {
                    *entry = inner(x, product) as f32;
                }
            }
            (raw, filter, out) = (raw_rest, filter_rest, out_rest);
        }
    }

    /// Minus half the derivative at f' = `filter`, ΔP = 0.
    pub(super) fn descent(&mut self, matrix: &[f32], filter: &[Complex32], out: &mut Unknown) {
        self.objective.respond(&self.compressed, filter, &mut self.sum);
        for (s, y) in self.sum.iter_mut().zip(&self.objective.label) {
            s.re -= y;
        }
        self.adjoint(out);
        self.objective.weigh(filter, &mut out.filter.0);
        out.filter.0.iter_mut().for_each(|v| *v = -*v);
        out.matrix.iter_mut().zip(matrix).for_each(|(v, p)| *v = -*v - self.weight * p);
    }
}

impl Operator for Linearised<'_> {
    fn apply(&mut self, x: &Unknown, out: &mut Unknown) {
        let blocks = &self.objective.blocks;
        self.first.compress(blocks, &x.matrix, &mut self.moved);
        self.objective.respond(&self.compressed, &x.filter.0, &mut self.sum);
        for (z, f) in channels(blocks, &self.moved).zip(channels(blocks, &self.filter)) {
            spectra::add_product(&mut self.sum[..z.len()], z, f);
        }
        self.adjoint(out);
        self.objective.weigh(&x.filter.0, &mut out.filter.0);
        out.matrix.iter_mut().zip(&x.matrix).for_each(|(v, p)| *v += self.weight * p);
    }

    fn precondition(&self, x: &Unknown, out: &mut Unknown) {
        scale_each(&mut out.filter.0, &x.filter.0, &self.inverse);
        let entries = x.matrix.iter().zip(&self.inverse_matrix);
        out.matrix.iter_mut().zip(entries).for_each(|(out, (v, inverse))| *out = v * inverse);
    }
}
