//! The error that is minimised by its definition, in double precision, and what minimises it by dense algebra.

use super::blocks::{Block, len};
use super::coefficients::frequencies;
use super::factorised::{self, FirstSample, Linearised};
use super::gradients::{Directions, Steps, Unknown};
use super::interpolation::label;
use super::memory::Memory;
use super::model::shift;
use super::objective::{Normal, Objective};
use super::params::{CompressionParams, ConjugateGradientParams, SampleModel, SampleParams, SpatialWeightParams};
use super::spatial::SpatialWeight;
use nalgebra::{DMatrix, DVector};
use pursuit_testkit::SplitMix;
use pursuit_vision::fourier::Complex32;
use std::f64::consts::TAU;

type C = nalgebra::Complex<f64>;

const BLOCKS: [Block; 2] = [Block { channels: 2, order: 2 }, Block { channels: 1, order: 3 }];
const RAW: [Block; 2] = [Block { channels: 4, order: 2 }, Block { channels: 3, order: 3 }];
/// Places a side at which functions are looked at: more than twice the highest order of w·f, so that sums of squares are integrals.
const FINE: usize = 12;

/// Numbers of a given seed, the first of each channel real.
fn random(blocks: &[Block], seed: u64) -> Vec<Complex32> {
    let mut numbers = SplitMix::after(seed);
    let mut next = || numbers.unit() as f32 - 0.5;
    let mut all = Vec::new();
    for block in blocks {
        for _ in 0..block.channels {
            all.push(Complex32::new(next(), 0.0));
            all.extend((1..block.each()).map(|_| Complex32::new(next(), next())));
        }
    }
    all
}

fn at() -> Vec<(usize, isize)> {
    frequencies(&BLOCKS.map(|b| b.order))
}

fn weight() -> SpatialWeight {
    let params = SpatialWeightParams { center: 0.05, edge: 0.2, sparse_below: 0.06, ..SpatialWeightParams::default() };
    let weight = SpatialWeight::new(&params, (30.0, 20.0), 60);
    assert!(2 * (BLOCKS[1].order + weight.reach()) < FINE, "{weight:?}");
    weight
}

fn objective() -> Objective {
    Objective::new(BLOCKS, &at(), label(0.1, &at()), &weight())
}

/// The value at a place of the function with these coefficients.
fn value(coefficients: &[C], x: f64, y: f64) -> f64 {
    let term = |(&(u, v), c): (&(usize, isize), &C)| {
        let turn = TAU * (u as f64 * x + v as f64 * y);
        let twice = if (u, v) == (0, 0) { 1.0 } else { 2.0 };
        twice * (c.re * turn.cos() - c.im * turn.sin())
    };
    at().iter().zip(coefficients).map(term).sum()
}

/// ∫ of the square of a function over a period, by a sum over places.
fn square(function: impl Fn(f64, f64) -> f64) -> f64 {
    let place = |k: usize| k as f64 / FINE as f64;
    let all = (0..FINE * FINE).map(|k| function(place(k % FINE), place(k / FINE)).powi(2));
    all.sum::<f64>() / (FINE * FINE) as f64
}

fn split<'a>(blocks: &'a [Block], all: &'a [C]) -> Vec<&'a [C]> {
    let mut rest = all;
    let mut channels = Vec::new();
    for block in blocks {
        for _ in 0..block.channels {
            let (own, others) = rest.split_at(block.each());
            channels.push(own);
            rest = others;
        }
    }
    channels
}

fn double(all: &[Complex32]) -> Vec<C> {
    all.iter().map(|c| C::new(f64::from(c.re), f64::from(c.im))).collect()
}

/// ‖Σ_c x_c ∗ f_c − y‖², as functions.
fn misfit(sample: &[C], filter: &[C]) -> f64 {
    let mut sum: Vec<C> = label(0.1, &at()).iter().map(|y| C::new(-f64::from(*y), 0.0)).collect();
    for (x, f) in split(&BLOCKS, sample).into_iter().zip(split(&BLOCKS, filter)) {
        for (s, (x, f)) in sum.iter_mut().zip(x.iter().zip(f)) {
            *s += x * f;
        }
    }
    square(|x, y| value(&sum, x, y))
}

/// Σ_c ‖w·f_c‖², as functions.
fn weighed(filter: &[C]) -> f64 {
    let weight = weight();
    split(&BLOCKS, filter).into_iter().map(|f| square(|x, y| weight.value(x, y) * value(f, x, y))).sum()
}

/// E.
fn error(samples: &[(f64, Vec<C>)], filter: &[C]) -> f64 {
    samples.iter().map(|(weight, sample)| weight * misfit(sample, filter)).sum::<f64>() + weighed(filter)
}

/// Samples, each with its weight.
type Weighed = Vec<(f64, Vec<C>)>;

/// Both kinds of memory after a few samples, each with the samples that its error is summed over.
fn memories() -> [(Memory, Weighed); 2] {
    [SampleModel::Mixture, SampleModel::Every].map(|model| {
        let params = SampleParams { model, components: 3, learning_rate: 0.3, ..SampleParams::default() };
        let mut memory = Memory::new(&params);
        let given: Vec<Vec<Complex32>> = (0..5).map(|seed| random(&BLOCKS, seed)).collect();
        let mut weights = Vec::new();
        for sample in &given {
            let weight = memory.learn(&params, &BLOCKS, sample, &mut Vec::new());
            weights.iter_mut().for_each(|w| *w *= 1.0 - weight);
            weights.push(weight);
        }
        assert!(memory.is_sound(&params, &BLOCKS));
        let samples = match &memory {
            Memory::Mixture(space) => space.components().map(|(weight, mean)| (weight, double(mean))).collect(),
            Memory::Every(_) => weights.into_iter().zip(given.iter().map(|sample| double(sample))).collect(),
        };
        (memory, samples)
    })
}

#[test]
fn the_descent_is_that_of_the_error() {
    memories().iter().for_each(|(memory, samples)| descent_is_that_of_the_error(memory, samples));
}

fn descent_is_that_of_the_error(memory: &Memory, samples: &[(f64, Vec<C>)]) {
    let (filter, direction) = (random(&BLOCKS, 20), random(&BLOCKS, 21));
    let mut descent = random(&BLOCKS, 22);
    objective().descent(memory, &filter, &mut descent);
    let got: f64 = split_inner(&descent, &direction);
    let (filter, direction) = (double(&filter), double(&direction));
    let along = |step: f64| -> f64 {
        let moved: Vec<C> = filter.iter().zip(&direction).map(|(f, d)| f + d * step).collect();
        error(samples, &moved)
    };
    let slope = (along(1e-3) - along(-1e-3)) / 2e-3;
    assert!((-2.0 * got - slope).abs() < 1e-3 * slope.abs(), "{} is not {slope}", -2.0 * got);
}

fn split_inner(a: &[Complex32], b: &[Complex32]) -> f64 {
    super::blocks::inner_product(&BLOCKS, a, b)
}

/// Coefficients as a vector of real numbers, and back.
fn to_coefficients(numbers: &[f64]) -> Vec<C> {
    let mut rest = numbers.iter().copied();
    let mut next = || rest.next().unwrap();
    let mut all = Vec::new();
    for block in BLOCKS {
        for _ in 0..block.channels {
            all.push(C::new(next(), 0.0));
            all.extend((1..block.each()).map(|_| C::new(next(), next())));
        }
    }
    all
}

/// The error is quadratic: its coefficients are told by its values at all sums of two unit vectors.
fn dense_minimum(error: &dyn Fn(&[C]) -> f64) -> Vec<C> {
    let n = 2 * len(&BLOCKS) - BLOCKS.iter().map(|b| b.channels).sum::<usize>();
    let unit = |places: &[usize]| {
        let mut numbers = vec![0.0; n];
        places.iter().for_each(|k| numbers[*k] += 1.0);
        error(&to_coefficients(&numbers))
    };
    let (none, one): (f64, Vec<f64>) = (unit(&[]), (0..n).map(|i| unit(&[i])).collect());
    let mut matrix = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let entry = 0.5 * (unit(&[i, j]) - one[i] - one[j] + none);
            (matrix[(i, j)], matrix[(j, i)]) = (entry, entry);
        }
    }
    let right = DVector::from_fn(n, |i, _| 0.5 * (none + matrix[(i, i)] - one[i]));
    to_coefficients(matrix.cholesky().unwrap().solve(&right).as_slice())
}

#[test]
fn conjugate_gradients_reach_the_minimum_of_the_error() {
    memories().iter().for_each(|(memory, samples)| minimum_is_reached(memory, samples));
}

fn minimum_is_reached(memory: &Memory, samples: &[(f64, Vec<C>)]) {
    let mut objective = objective();
    let want = dense_minimum(&|filter| error(samples, filter));
    let n = objective.len();
    let energy: Vec<f32> = random(&BLOCKS, 3).iter().map(Complex32::norm_sqr).collect();
    let mut inverse = Vec::new();
    objective.precondition(&ConjugateGradientParams::default(), &energy, &mut inverse);
    let (mut x, mut on, mut steps) = (Unknown::zeros(n, 0), Directions::zeros(n, 0), Steps::new(n, 0));
    let mut last = f64::INFINITY;
    // As in tracking: a few steps at a time, each time from where the last ended.
    for _ in 0..30 {
        objective.descent(memory, &x.filter.0, &mut steps.residual.filter.0);
        let mut normal = Normal { objective: &mut objective, memory, inverse: &inverse };
        steps.take(&BLOCKS, &mut normal, &mut x, &mut on, 5);
        let now = error(samples, &double(&x.filter.0));
        assert!(now <= last + 1e-6, "{now} after {last}");
        last = now;
    }
    let least = error(samples, &want);
    assert!(last < least * 1.001 + 1e-6, "{last} is not {least}");
    let size: f64 = want.iter().map(|c| c.norm_sqr()).sum();
    let apart: f64 = want.iter().zip(double(&x.filter.0)).map(|(a, b)| (a - b).norm_sqr()).sum();
    assert!(apart < 1e-4 * size, "{apart} of {size}");
}

/// The sample compressed by the matrix: z_c = Σ_d P[c, d]·x_d.
fn compressed(raw: &[C], matrix: &[f64]) -> Vec<C> {
    let (channels, mut rows, mut from, mut all) = (split(&RAW, raw), matrix, 0, Vec::new());
    for (own, block) in RAW.iter().zip(BLOCKS) {
        for _ in 0..block.channels {
            let (row, rest) = rows.split_at(own.channels);
            rows = rest;
            for i in 0..block.each() {
                all.push((0..own.channels).map(|d| channels[from + d][i] * row[d]).sum());
            }
        }
        from += own.channels;
    }
    all
}

/// The error of filter and matrix together (danelljan2017eco, eq. 6).
fn factorised_error(raw: &[C], matrix: &[f64], filter: &[C], lambda: f64) -> f64 {
    misfit(&compressed(raw, matrix), filter) + weighed(filter) + lambda * matrix.iter().map(|p| p * p).sum::<f64>()
}

#[test]
fn the_descent_of_filter_and_matrix_is_that_of_their_error() {
    let (raw, filter) = (random(&RAW, 30), random(&BLOCKS, 31));
    let entries = RAW.iter().zip(BLOCKS).map(|(a, b)| a.channels * b.channels).sum::<usize>();
    let mut numbers = SplitMix::after(32);
    let mut matrix = || -> Vec<f32> { (0..entries).map(|_| numbers.unit() as f32 - 0.5).collect() };
    let (matrix, matrix_step, filter_step) = (matrix(), matrix(), random(&BLOCKS, 33));
    let params = ConjugateGradientParams::default();
    let (mut objective, first) = (objective(), FirstSample { blocks: &RAW, sample: &raw });
    let mut operator = Linearised::new(&mut objective, &first, 0.1, entries);
    operator.linearise(&params, &matrix, &filter, false);
    let mut descent = Unknown::zeros(len(&BLOCKS), entries);
    operator.descent(&matrix, &filter, &mut descent);
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    let got = split_inner(&descent.filter.0, &filter_step) + dot(&descent.matrix, &matrix_step);

    let along = |step: f64| {
        let matrix: Vec<f64> =
            matrix.iter().zip(&matrix_step).map(|(p, d)| f64::from(*p) + step * f64::from(*d)).collect();
        let filter: Vec<C> = double(&filter).iter().zip(double(&filter_step)).map(|(f, d)| f + d * step).collect();
        factorised_error(&double(&raw), &matrix, &filter, 0.1)
    };
    let slope = (along(1e-3) - along(-1e-3)) / 2e-3;
    assert!((-2.0 * got - slope).abs() < 2e-3 * slope.abs(), "{} is not {slope}", -2.0 * got);
}

#[test]
fn learning_the_matrix_lowers_the_error_below_that_of_any_filter_without() {
    let raw = random(&RAW, 40);
    let entries = RAW.iter().zip(BLOCKS).map(|(a, b)| a.channels * b.channels).sum::<usize>();
    let mut numbers = SplitMix::after(41);
    let start: Vec<f32> = (0..entries).map(|_| numbers.unit() as f32 - 0.5).collect();
    let (compression, solver) =
        (CompressionParams { weight: 1e-4, ..CompressionParams::default() }, ConjugateGradientParams::default());
    let double_of = |matrix: &[f32]| matrix.iter().copied().map(f64::from).collect::<Vec<f64>>();
    let fixed = double_of(&start);
    let best = dense_minimum(&|filter| factorised_error(&double(&raw), &fixed, filter, 1e-4));
    let without = factorised_error(&double(&raw), &fixed, &best, 1e-4);
    let (mut matrix, mut filter) = (start, vec![Complex32::default(); len(&BLOCKS)]);
    let first = FirstSample { blocks: &RAW, sample: &raw };
    factorised::learn(&mut objective(), &first, (&compression, &solver), &mut matrix, &mut filter);
    let with = factorised_error(&double(&raw), &double_of(&matrix), &double(&filter), 1e-4);
    assert!(with < 0.9 * without, "{with} is not below {without}");
}

#[test]
fn a_shifted_sample_is_the_function_elsewhere() {
    let mut sample = random(&BLOCKS, 50);
    let before = double(&sample);
    shift(&BLOCKS, &at(), (0.13, -0.31), &mut sample, &mut Vec::new());
    for (a, b) in split(&BLOCKS, &before).into_iter().zip(split(&BLOCKS, &double(&sample))) {
        for (x, y) in [(0.0, 0.0), (0.4, 0.7), (0.9, 0.2)] {
            assert!((value(a, x + 0.13, y - 0.31) - value(b, x, y)).abs() < 1e-4);
        }
    }
}
