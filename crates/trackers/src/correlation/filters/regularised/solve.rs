//! The two steps of an iteration, as kernels over planes and bins.

use multiversion::multiversion;
use pursuit_vision::fourier::Complex32;

/// Weights of one frequency step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    /// μ.
    pub temporal: f32,
    /// γ.
    pub penalty: f32,
}

/// `bins *= factor`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn scale(bins: &mut [Complex32], factor: f32) {
    for bin in bins {
        bin.re *= factor;
        bin.im *= factor;
    }
}

/// The step in space. `plane` comes in as f and `dual` as h. With v = f + h, g = `inside`·v in the cells that are 1 and 0
/// elsewhere; h becomes (v − g)·`rescale`, rescaled for the next penalty, and `plane` becomes g − h.
pub(super) fn confine(plane: &mut [f32], dual: &mut [f32], cells: &[f32], inside: f32, rescale: f32) {
    for ((f, h), cell) in plane.iter_mut().zip(dual).zip(cells) {
        let v = *f + *h;
        let g = inside * cell * v;
        *h = (v - g) * rescale;
        *f = g - *h;
    }
}

/// Multiplies what is in the cells that are 1 by `factor` and clears the others.
pub(super) fn keep(plane: &mut [f32], cells: &[f32], factor: f32) {
    plane.iter_mut().zip(cells).for_each(|(v, cell)| *v *= factor * cell);
}

/// `bins = from − factor · bins`.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn subtract_from(from: &[Complex32], factor: f32, bins: &mut [Complex32]) {
    for (bin, from) in bins.iter_mut().zip(from) {
        bin.re = from.re - factor * bin.re;
        bin.im = from.im - factor * bin.im;
    }
}

/// The first step in the frequency domain where μ = 0 and t = 0: f = x·ȳ/(γ + |x|²), ridge regression.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn ridge_bins(
    model: &[Complex32],
    label: &[Complex32],
    filter: &mut [Complex32],
    power: &[f32],
    dots: &mut [Complex32],
    penalty: f32,
) {
    for (dot, (y, p)) in dots.iter_mut().zip(label.iter().zip(power)) {
        let share = 1.0 / (penalty + p);
        *dot = Complex32::new(y.re * share, -y.im * share);
    }
    for (x, f) in model.chunks_exact(label.len()).zip(filter.chunks_exact_mut(label.len())) {
        for ((x, f), d) in x.iter().zip(f).zip(dots.iter()) {
            f.re = x.re * d.re - x.im * d.im;
            f.im = x.re * d.im + x.im * d.re;
        }
    }
}

/// The step in the frequency domain, for all bins: (x·xᴴ + (μ + γ)·I)·f = x·ȳ + μ·f_last + γ·t by Sherman–Morrison
/// (li2018, eq. 10). `target` comes in as t = g − h and becomes f; `power` is |x|² summed over the channels.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn solve_bins(
    model: &[Complex32],
    label: &[Complex32],
    last: &[Complex32],
    target: &mut [Complex32],
    power: &[f32],
    dots: &mut [Complex32],
    weights: Weights,
) {
    let (bins, Weights { temporal, penalty }) = (label.len(), weights);
    // xᴴq, where q is the right-hand side; its data term is |x|²·ȳ.
    for (dot, (y, p)) in dots.iter_mut().zip(label.iter().zip(power)) {
        *dot = Complex32::new(p * y.re, -p * y.im);
    }
    for ((x, f), t) in model.chunks_exact(bins).zip(last.chunks_exact(bins)).zip(target.chunks_exact_mut(bins)) {
        for (((x, f), t), dot) in x.iter().zip(f).zip(t).zip(dots.iter_mut()) {
            t.re = temporal * f.re + penalty * t.re;
            t.im = temporal * f.im + penalty * t.im;
            dot.re += x.re * t.re + x.im * t.im;
            dot.im += x.re * t.im - x.im * t.re;
        }
    }
    // f = (q − x·(xᴴq)/(ρ + |x|²))/ρ: what each bin multiplies x by is the same for all channels.
    let rho = temporal + penalty;
    for (dot, (y, p)) in dots.iter_mut().zip(label.iter().zip(power)) {
        let share = 1.0 / (rho + p);
        dot.re = y.re - dot.re * share;
        dot.im = -y.im - dot.im * share;
    }
    let inverse = 1.0 / rho;
    for (x, t) in model.chunks_exact(bins).zip(target.chunks_exact_mut(bins)) {
        for ((x, t), d) in x.iter().zip(t).zip(dots.iter()) {
            t.re = (t.re + x.re * d.re - x.im * d.im) * inverse;
            t.im = (t.im + x.re * d.im + x.im * d.re) * inverse;
        }
    }
}
