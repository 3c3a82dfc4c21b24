use super::panels::{self, Panels, Sums, TOGETHER, by_registers};
use super::{Activation, Columns, Depthwise, LANES, Map, depthwise, lanes_at, window_at};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use std::ops::Range;

/// The number of each lane.
const NUMBERS: [f32; LANES] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

/// A convolution of 1 × 1: for every pixel, `outputs` weighted sums of its channels, a bias and an activation.
#[derive(Debug, Clone)]
pub struct Pointwise {
    pub(super) panels: Panels,
    activation: Activation,
}

/// What a pointwise convolution reads.
#[derive(Debug)]
pub struct PointwiseInput<'a> {
    /// Dense map with the first channels. With a gate it is overwritten by what the gate makes of it.
    pub map: &'a mut Map,
    /// Dense map with the other channels, where the input is a concatenation.
    pub more: Option<&'a Map>,
    /// A factor for each channel, and the activation after it, applied to `map` before the convolution.
    pub gate: Option<(&'a [f32], Activation)>,
    /// Dense map that is added to the outputs, before the activation.
    pub residual: Option<&'a Map>,
}

impl<'a> PointwiseInput<'a> {
    /// A map and nothing else.
    pub const fn plain(map: &'a mut Map) -> Self {
        Self { map, more: None, gate: None, residual: None }
    }
}

impl Pointwise {
    /// From weights in output, input order (`outputs · inputs` numbers) and one bias an output.
    pub fn new(weights: &[f32], bias: &[f32], activation: Activation) -> Self {
        let inputs = weights.len() / bias.len();
        Self { panels: Panels::new(bias, inputs, |o, i| weights[o * inputs + i]), activation }
    }

    /// Computes every row of `out`.
    pub fn run(&self, input: PointwiseInput<'_>, out: &mut Map) {
        self.run_rows(input, out, 0..out.height);
    }

    /// Computes these rows of `out`.
    pub fn run_rows(&self, mut input: PointwiseInput<'_>, out: &mut Map, rows: Range<usize>) {
        debug_assert_eq!(out.channels, self.panels.outputs());
        self.check(&input, out);
        dispatch!(Level::new(), simd => {
            for y in rows.clone().step_by(2) {
                let rows = y..(y + 2).min(rows.end);
                gate(simd, &mut input, rows.clone());
                for n in 0..self.panels.count() {
                    let first = n * self.panels.together();
                    by_registers!(simd => panel(self, &input, n, rows.clone(), out, first));
                }
            }
        });
    }

    /// Computes rows `rows` of `out`, at least four or all, a convolution of what this one gives, which are to follow each other from
    /// the first on. In between lie no more than the eight channels of `between`, laid out as `next` wants them: those rows of them
    /// that are asked for stay in the nearest caches if they are few.
    pub fn run_into(
        &self,
        input: &mut PointwiseInput<'_>,
        between: &mut Map,
        next: &Depthwise,
        out: &mut Map,
        rows: &Range<usize>,
    ) {
        debug_assert_eq!((between.channels, out.channels), (TOGETHER, self.panels.outputs()));
        self.check(input, between);
        let reach = next.reach(rows, between);
        dispatch!(Level::new(), simd => {
            if rows.start == 0 {
                gate(simd, input, 0..between.height);
            }
            for n in 0..self.panels.count() {
                by_registers!(simd => panel(self, input, n, reach.clone(), between, 0));
                let together = self.panels.together();
                let channels = n * together..((n + 1) * together).min(self.panels.outputs());
                depthwise::channels(simd, next, channels, between, out, rows);
            }
        });
    }

    fn check(&self, input: &PointwiseInput<'_>, out: &Map) {
        debug_assert_eq!(input.map.channels + input.more.map_or(0, |m| m.channels), self.panels.taps());
        debug_assert_eq!((input.map.height, input.map.width), (out.height, out.width));
    }
}

/// The `M` outputs of panel `n` in `rows`, at `P` places of sixteen columns at a time. They are written to the channels of `out` from
/// `at` on.
#[inline(always)]
pub(super) fn panel<S: Simd, const P: usize, const M: usize>(
    simd: S,
    p: &Pointwise,
    input: &PointwiseInput<'_>,
    n: usize,
    rows: Range<usize>,
    out: &mut Map,
    at: usize,
) {
    let segments = out.segments();
    let place = |i: usize| (rows.start + i / segments, i % segments);
    let places = rows.len() * segments;
    let whole = places / P * P;
    for i in (0..whole).step_by(P) {
        tile::<S, P, M>(simd, p, input, n, std::array::from_fn(|k| place(i + k)), out, at);
    }
    for i in whole..places {
        tile::<S, 1, M>(simd, p, input, n, [place(i)], out, at);
    }
}

/// The outputs of panel `n` at each (row, segment) of `places`.
#[inline(always)]
fn tile<S: Simd, const P: usize, const M: usize>(
    simd: S,
    p: &Pointwise,
    input: &PointwiseInput<'_>,
    n: usize,
    places: [(usize, usize); P],
    out: &mut Map,
    at: usize,
) {
    let (head, tail) = p.panels.weights::<M>(n).split_at(input.map.channels);
    let sums = add(simd, head, input.map, places, p.panels.biases(simd, n));
    let sums = match input.more {
        Some(more) => add(simd, tail, more, places, sums),
        None => sums,
    };
    finish(simd, p, input.residual, n * M, (&places, &sums), out, at);
}

/// Adds what the channels of `map` give at `places`.
#[inline(always)]
fn add<S: Simd, const P: usize, const M: usize>(
    simd: S,
    weights: &[[f32; M]],
    map: &Map,
    places: [(usize, usize); P],
    mut sums: Sums<S, P, M>,
) -> Sums<S, P, M> {
    let mut channels: [_; P] = places.map(|(y, s)| windows(map, y, s));
    for weights in weights {
        let mut x = [&[0.0; LANES]; P];
        for p in 0..P {
            let Some(columns) = channels[p].next() else { continue };
            x[p] = columns;
        }
        panels::add(simd, weights, x, &mut sums);
    }
    sums
}

/// `L` columns of each channel of a row, from the `segment`-th sixteen on.
#[inline(always)]
pub(super) fn windows<const L: usize>(map: &Map, row: usize, segment: usize) -> impl Iterator<Item = &[f32; L]> {
    map.row(row).chunks_exact(map.pitch).map(move |columns| window_at(columns, segment * LANES))
}

/// Adds the residual to the `sums` of `M` outputs from `first` on, applies the activation, and writes them.
#[inline(always)]
fn finish<S: Simd, const P: usize, const M: usize>(
    simd: S,
    p: &Pointwise,
    residual: Option<&Map>,
    first: usize,
    (places, sums): (&[(usize, usize); P], &Sums<S, P, M>),
    out: &mut Map,
    at: usize,
) {
    let count = p.panels.outputs().saturating_sub(first).min(M);
    for n in 0..P {
        let (y, s) = places[n];
        let mut sums = sums[n];
        if let Some(residual) = residual {
            let row = residual.row(y);
            for i in 0..M {
                if i < count {
                    sums[i] += lanes_at(simd, row, residual.offset(first + i, s * LANES));
                }
            }
        }
        store(simd, out, (y, s), at, p.activation.of_lanes(sums), count);
    }
}

/// x = activation(factor · x), channel by channel, where there are factors.
#[inline(always)]
fn gate<S: Simd>(simd: S, input: &mut PointwiseInput<'_>, rows: Range<usize>) {
    let Some((factors, activation)) = input.gate else { return };
    let pitch = input.map.pitch;
    for y in rows {
        for (channel, &factor) in input.map.row_mut(y).chunks_exact_mut(pitch).zip(factors) {
            for x in channel.as_chunks_mut::<LANES>().0 {
                activation.of_lanes([f32x16::load_array_ref(simd, x) * factor])[0].store_array(x);
            }
        }
    }
}

/// Writes sixteen columns of the first `count` of `M` channels from `channel` on, zeros for columns that the map does not
/// have, so that its padding stays zero.
#[inline(always)]
pub(super) fn store<S: Simd, const M: usize>(
    simd: S,
    out: &mut Map,
    (y, segment): (usize, usize),
    channel: usize,
    mut lanes: [f32x16<S>; M],
    count: usize,
) {
    let valid = out.width - segment * LANES;
    if valid < LANES {
        let is_valid = f32x16::load_array_ref(simd, &NUMBERS).simd_lt(valid as f32);
        for i in 0..M {
            lanes[i] = is_valid.select(lanes[i], f32x16::splat(simd, 0.0));
        }
    }
    let at = out.offset(channel, segment * LANES);
    let (columns, padding, pitch) = (out.columns, out.padding, out.pitch);
    let row = out.row_mut(y);
    match columns {
        Columns::Straight => {
            for i in 0..M {
                if i < count {
                    lanes[i].store_slice(&mut row[at + i * pitch..at + i * pitch + LANES]);
                }
            }
        }
        Columns::Split { half } => {
            // The first column is even, counted with the padding, or it lies among the odd ones: its neighbour then is
            // the next even one.
            let neighbour = if padding % 2 == 0 { at + half } else { at + 1 - half };
            for i in 0..M {
                if i < count {
                    let (first, second) = (at + i * pitch, neighbour + i * pitch);
                    lanes[i].unzip_low(lanes[i]).split().0.store_slice(&mut row[first..first + LANES / 2]);
                    lanes[i].unzip_high(lanes[i]).split().0.store_slice(&mut row[second..second + LANES / 2]);
                }
            }
        }
    }
}
