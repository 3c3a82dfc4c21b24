//! What a filter is trained to: E(f) = Σ π_j ‖Σ_c x_jc ∗ f_c − y‖² + Σ_c ‖w·f_c‖² (danelljan2016, section 3.2; of a mixture
//! danelljan2017eco, eqs. 3 and 10), in Fourier coefficients, where convolution is a product of numbers.

use super::blocks::{Block, channels, channels_mut, len};
use super::gradients::{Operator, Unknown};
use super::memory::Memory;
use super::params::ConjugateGradientParams;
use super::sample_space::SampleSpace;
use super::spatial::{SpatialWeight, Weighing};
use multiversion::multiversion;
use pursuit_vision::fourier::{Complex32, spectra};

/// Label and weight, with scratch.
#[derive(Debug, Clone)]
pub(super) struct Objective {
    pub blocks: [Block; 2],
    /// Coefficients of y, which are real.
    pub label: Vec<f32>,
    weighings: Vec<Weighing>,
    weight_energy: f32,
    sum: Vec<Complex32>,
}

impl Objective {
    /// `at` are the frequencies of the coefficients, in their order.
    pub(super) fn new(blocks: [Block; 2], at: &[(usize, isize)], label: Vec<f32>, weight: &SpatialWeight) -> Self {
        let weighing = |b: &Block| Weighing::new(weight.clone(), b.order, &at[..b.each()]);
        Self {
            blocks,
            weighings: blocks.iter().map(weighing).collect(),
            weight_energy: weight.energy() as f32,
            sum: vec![Complex32::default(); label.len()],
            label,
        }
    }

    /// `out = Σ_c x_c ∗ f_c`.
    pub(super) fn respond(&self, sample: &[Complex32], filter: &[Complex32], out: &mut [Complex32]) {
        out.fill(Complex32::default());
        for (x, f) in channels(&self.blocks, sample).zip(channels(&self.blocks, filter)) {
            spectra::add_product(&mut out[..x.len()], x, f);
        }
    }

    /// `out = Σ_j π_j x̄_j (x_j·f − against)`: half the derivative of the first term of E, `against` being 0 or y.
    fn fit(&mut self, memory: &Memory, filter: &[Complex32], label: bool, out: &mut [Complex32]) {
        match memory {
            Memory::Mixture(space) => self.fit_mixture(space, filter, label, out),
            Memory::Every(moments) => {
                moments.apply(&self.blocks, filter, out);
                if label {
                    moments.subtract_label(&self.blocks, &self.label, out);
                }
            }
        }
    }

    /// The same of the components of a mixture.
    fn fit_mixture(&mut self, space: &SampleSpace, filter: &[Complex32], label: bool, out: &mut [Complex32]) {
        out.fill(Complex32::default());
        let mut sum = std::mem::take(&mut self.sum);
        for (weight, sample) in space.components() {
            self.respond(sample, filter, &mut sum);
            if label {
                subtract(&mut sum, &self.label);
            }
            sum.iter_mut().for_each(|s| *s *= weight as f32);
            for (x, out) in channels(&self.blocks, sample).zip(channels_mut(&self.blocks, out)) {
                spectra::add_conj_product(out, x, &sum[..x.len()]);
            }
        }
        self.sum = sum;
    }

    /// `out += w·w·f`: half the derivative of the second term of E.
    pub(super) fn weigh(&mut self, filter: &[Complex32], out: &mut [Complex32]) {
        let (mut filter, mut out) = (filter, out);
        for (block, weighing) in self.blocks.iter().zip(&mut self.weighings) {
            let ((f, f_rest), (o, o_rest)) = (filter.split_at(block.len()), out.split_at_mut(block.len()));
            for (f, o) in f.chunks_exact(block.each()).zip(o.chunks_exact_mut(block.each())) {
                weighing.add(f, o);
            }
            (filter, out) = (f_rest, o_rest);
        }
    }

    /// `out` = minus half the derivative of E at `filter`.
    pub(super) fn descent(&mut self, memory: &Memory, filter: &[Complex32], out: &mut [Complex32]) {
        self.fit(memory, filter, true, out);
        self.weigh(filter, out);
        out.iter_mut().for_each(|v| *v = -*v);
    }

    /// What coefficients of a residual are multiplied by where samples have these energies: about one over the operator's
    /// diagonal.
    pub(super) fn precondition(&self, params: &ConjugateGradientParams, energy: &[f32], out: &mut Vec<f32>) {
        let (own, regular) = (params.own_energy as f32, params.weight_energy as f32);
        out.clear();
        let mut energy = energy;
        for block in &self.blocks {
            let (ours, rest) = energy.split_at(block.len());
            energy = rest;
            let each = block.each();
            for channel in ours.chunks_exact(each) {
                out.extend(channel.iter().enumerate().map(|(i, e)| {
                    let mean = ours.iter().skip(i).step_by(each).sum::<f32>() / block.channels as f32;
                    let data = own * e + (1.0 - own) * mean;
                    1.0 / ((1.0 - regular) * data + regular * self.weight_energy)
                }));
            }
        }
    }

    /// Coefficients of all channels.
    pub(super) fn len(&self) -> usize {
        len(&self.blocks)
    }
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn subtract(sum: &mut [Complex32], label: &[f32]) {
    for (s, y) in sum.iter_mut().zip(label) {
        s.re -= y;
    }
}

/// `out = a · b`, of real b.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn scale_each(out: &mut [Complex32], a: &[Complex32], b: &[f32]) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = Complex32::new(a.re * b, a.im * b);
    }
}

/// The operator of the normal equations of E (danelljan2016, eq. 13).
pub(super) struct Normal<'a> {
    pub objective: &'a mut Objective,
    pub memory: &'a Memory,
    pub inverse: &'a [f32],
}

impl Operator for Normal<'_> {
    fn apply(&mut self, x: &Unknown, out: &mut Unknown) {
        self.objective.fit(self.memory, &x.filter.0, false, &mut out.filter.0);
        self.objective.weigh(&x.filter.0, &mut out.filter.0);
    }

    fn precondition(&self, x: &Unknown, out: &mut Unknown) {
        scale_each(&mut out.filter.0, &x.filter.0, self.inverse);
    }
}
