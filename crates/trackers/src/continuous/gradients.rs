//! Conjugate gradients (shewchuk1994) on a filter and, beside it, a compression matrix.

use super::blocks::{Block, inner_product};
use super::coefficients::{add_scaled, scale_and_add};
use crate::correlation::filters::Spectra;
use pursuit_vision::fourier::Complex32;
use serde::{Deserialize, Serialize};

/// What is solved for, or a residual of it.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Unknown {
    /// Coefficients of the filter.
    pub filter: Spectra,
    /// Entries of the matrix; none where it is fixed.
    pub matrix: Vec<f32>,
}

impl Unknown {
    /// Zeros.
    pub(super) fn zeros(filter: usize, matrix: usize) -> Self {
        Self { filter: Spectra(vec![Complex32::default(); filter]), matrix: vec![0.0; matrix] }
    }

    /// Copies `other`, which has the same lengths.
    pub(super) fn set(&mut self, other: &Self) {
        self.filter.0.copy_from_slice(&other.filter.0);
        self.matrix.copy_from_slice(&other.matrix);
    }

    /// `self += factor · other`.
    fn add_scaled(&mut self, factor: f32, other: &Self) {
        add_scaled(&mut self.filter.0, &other.filter.0, factor);
        self.matrix.iter_mut().zip(&other.matrix).for_each(|(a, b)| *a += factor * b);
    }

    /// `self = other + factor · self`.
    fn scale_and_add(&mut self, factor: f32, other: &Self) {
        scale_and_add(&mut self.filter.0, factor, &other.filter.0);
        self.matrix.iter_mut().zip(&other.matrix).for_each(|(a, b)| *a = b + factor * *a);
    }

    /// The inner product.
    pub(super) fn inner(&self, blocks: &[Block], other: &Self) -> f64 {
        let entries: f64 = self.matrix.iter().zip(&other.matrix).map(|(a, b)| f64::from(a * b)).sum();
        inner_product(blocks, &self.filter.0, &other.filter.0) + entries
    }

    /// Whether a state that was read has the length of such filters, and is of numbers.
    pub(super) fn is_sound(&self, filter: usize, matrix: usize) -> bool {
        let finite = self.filter.0.iter().all(|c| c.re.is_finite() && c.im.is_finite());
        self.filter.0.len() == filter
            && self.matrix.len() == matrix
            && finite
            && self.matrix.iter().all(|v| v.is_finite())
    }
}

/// A symmetric positive definite operator A, and an approximation of its inverse.
pub(super) trait Operator {
    /// `out = A·x`.
    fn apply(&mut self, x: &Unknown, out: &mut Unknown);

    /// `out` becomes about A⁻¹·x.
    fn precondition(&self, x: &Unknown, out: &mut Unknown);
}

/// What conjugate gradients go on from: the last direction, the last residual and its size.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Directions {
    pub direction: Unknown,
    pub last: Unknown,
    /// ⟨r, M⁻¹r⟩; 0 before the first step.
    pub size: f64,
}

impl Directions {
    pub(super) fn zeros(filter: usize, matrix: usize) -> Self {
        let zeros = Unknown::zeros(filter, matrix);
        Self { direction: zeros.clone(), last: zeros, size: 0.0 }
    }
}

/// Scratch.
#[derive(Debug, Clone)]
pub(super) struct Steps {
    pub residual: Unknown,
    preconditioned: Unknown,
    image: Unknown,
}

impl Steps {
    pub(super) fn new(filter: usize, matrix: usize) -> Self {
        let zeros = Unknown::zeros(filter, matrix);
        Self { residual: zeros.clone(), preconditioned: zeros.clone(), image: zeros }
    }

    /// Takes `iterations` steps from `x`, whose residual b − A·x is in `self.residual`. Directions follow Polak and Ribière's
    /// formula, which bears that A and b have changed since the last call.
    pub(super) fn take(
        &mut self,
        blocks: &[Block],
        operator: &mut dyn Operator,
        x: &mut Unknown,
        on: &mut Directions,
        iterations: usize,
    ) {
        let Self { residual, preconditioned, image } = self;
        for _ in 0..iterations {
            operator.precondition(residual, preconditioned);
            let size = residual.inner(blocks, preconditioned);
            if !(size.is_finite() && size > 0.0) {
                break;
            }
            let kept =
                if on.size > 0.0 { ((size - on.last.inner(blocks, preconditioned)) / on.size).max(0.0) } else { 0.0 };
            on.direction.scale_and_add(if kept.is_finite() { kept as f32 } else { 0.0 }, preconditioned);
            on.last.set(residual);
            on.size = size;
            operator.apply(&on.direction, image);
            let curvature = on.direction.inner(blocks, image);
            // The exact minimum along the direction, which need not be conjugate to those before.
            let step = on.direction.inner(blocks, residual) / curvature;
            if !(curvature > 0.0 && step.is_finite()) {
                break;
            }
            x.add_scaled(step as f32, &on.direction);
            residual.add_scaled(-step as f32, image);
        }
    }
}
