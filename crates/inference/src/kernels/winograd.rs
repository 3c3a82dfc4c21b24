use super::panels::{self, Panels, Sums, TOGETHER, by_registers};
use super::pointwise::{store, windows};
use super::{Activation, LANES, Map, lanes_at, window_at};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use std::ops::Range;

const SIDE: usize = 3;
/// Rows of the answer that are made together, and of what they are made from.
const ROWS: usize = 4;
const TRANSFORMED: usize = ROWS + SIDE - 1;
/// Panels that go over the transformed rows together: so many times fewer are these fetched from outside the nearest caches.
const PANELS: usize = 4;
/// Channels that all of those panels sum up before the next: what they read of the input and of the weights stays in the nearest cache.
const BLOCK: usize = 64;
/// Columns that three neighbouring taps read for sixteen of the answer.
const REACH: usize = LANES + SIDE - 1;

/// G of F(4, 3): what each column of a kernel becomes (Lavin and Gray 2016, "Fast Algorithms for Convolutional Neural Networks",
/// section 4.3).
const KERNEL: [[f64; SIDE]; TRANSFORMED] = [
    [1.0 / 4.0, 0.0, 0.0],
    [-1.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0],
    [-1.0 / 6.0, 1.0 / 6.0, -1.0 / 6.0],
    [1.0 / 24.0, 1.0 / 12.0, 1.0 / 6.0],
    [1.0 / 24.0, -1.0 / 12.0, 1.0 / 6.0],
    [0.0, 0.0, 1.0],
];

/// A full convolution of 3 × 3, stride 1, with zeros around its input, a bias and an activation: by Winograd's algorithm F(4, 3)
/// down the columns, and as it is defined along the rows, so that neighbouring columns stay together. It takes half as many
/// multiplications.
#[derive(Debug, Clone)]
pub struct Winograd {
    /// One for each of the six transformed rows; its taps are (channel, column of the kernel).
    pub(super) rows: [Panels; TRANSFORMED],
    bias: Vec<f32>,
    activation: Activation,
}

/// What such convolutions read: maps, one after the other, four rows transformed to six. Several layers may read the same.
#[derive(Debug, Clone)]
pub struct WinogradInput {
    /// Row `r · groups + g` is the r-th of the transformed rows of the g-th four.
    rows: Map,
    groups: usize,
    /// Rows of what is transformed.
    height: usize,
    /// Of some panels: for each transformed row, panel and place, the sums of the outputs.
    sums: Vec<[f32; LANES]>,
}

impl WinogradInput {
    /// For `channels` of `height` × `width`.
    pub fn new(channels: usize, height: usize, width: usize) -> Self {
        let groups = height.div_ceil(ROWS);
        let rows = Map::padded(channels, TRANSFORMED * groups, width, 1, SIDE);
        let sums = vec![[0.0; LANES]; TRANSFORMED * PANELS * groups * rows.segments() * TOGETHER];
        Self { rows, groups, height, sums }
    }

    /// Takes the channels of `map`, which is dense, for those from `first` on, each times its factor where there are factors.
    pub fn set(&mut self, first: usize, map: &Map, factors: Option<&[f32]>) {
        debug_assert_eq!((map.height, map.width), (self.height, self.rows.width));
        dispatch!(Level::new(), simd => {
            for g in 0..self.groups {
                for c in 0..map.channels {
                    let factor = factors.map_or(1.0, |f| f[c]);
                    for s in 0..map.segments() {
                        let mut d = [f32x16::splat(simd, 0.0); TRANSFORMED];
                        for i in 0..TRANSFORMED {
                            let y = ROWS * g + i;
                            if (1..=self.height).contains(&y) {
                                d[i] = lanes_at(simd, map.row(y - 1), map.offset(c, s * LANES)) * factor;
                            }
                        }
                        let rows = transformed(d);
                        for r in 0..TRANSFORMED {
                            store(simd, &mut self.rows, (r * self.groups + g, s), first + c, [rows[r]], 1);
                        }
                    }
                }
            }
        });
    }
}

impl Winograd {
    /// From weights in output, input, row, column order.
    pub fn new(weights: &[f32], bias: &[f32], activation: Activation) -> Self {
        let taps = weights.len() / (bias.len() * SIDE);
        let rows = KERNEL.map(|kernel| {
            Panels::new(bias, taps, |o, tap| {
                let weight = |row| f64::from(weights[(o * taps + tap / SIDE * SIDE + row) * SIDE + tap % SIDE]);
                kernel.iter().enumerate().map(|(row, k)| k * weight(row)).sum::<f64>() as f32
            })
        });
        Self { rows, bias: bias.to_vec(), activation }
    }

    /// Computes every row of `out`.
    pub fn run(&self, input: &mut WinogradInput, out: &mut Map) {
        debug_assert_eq!((self.rows[0].taps(), self.bias.len()), (input.rows.channels * SIDE, out.channels));
        debug_assert_eq!((out.height, out.width), (input.height, input.rows.width));
        dispatch!(Level::new(), simd => by_registers!(simd => all(self, input, out)));
    }
}

/// Every row of `out`, panel by panel.
#[inline(always)]
pub(super) fn all<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Winograd,
    input: &mut WinogradInput,
    out: &mut Map,
) {
    let count = layer.rows[0].count();
    for first in (0..count).step_by(PANELS) {
        let panels = first..(first + PANELS).min(count);
        sum_up::<S, P, M>(simd, layer, input, panels.clone());
        finish(simd, layer, input, panels, out);
    }
}

/// The sums of `panels` over all taps: `M` outputs of `P` fours of rows at a time.
#[inline(always)]
fn sum_up<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Winograd,
    input: &mut WinogradInput,
    panels: Range<usize>,
) {
    let WinogradInput { rows, groups, sums, .. } = input;
    let segments = rows.segments();
    let places = *groups * segments;
    let whole = places / P * P;
    let sums: &mut [[[f32; LANES]; M]] = sums.as_chunks_mut().0;
    for r in 0..TRANSFORMED {
        let place = |i: usize| (r * *groups + i / segments, i % segments);
        for first in (0..rows.channels).step_by(BLOCK) {
            for n in panels.clone() {
                let weights = layer.rows[r].weights(n);
                let sums = &mut sums[(r * PANELS + n - panels.start) * places..][..places];
                for i in (0..whole).step_by(P) {
                    let Some(sums) = sums[i..].first_chunk_mut() else { continue };
                    add::<S, P, M>(simd, weights, rows, std::array::from_fn(|k| place(i + k)), first, sums);
                }
                for i in whole..places {
                    let Some(sums) = sums[i..].first_chunk_mut() else { continue };
                    add::<S, 1, M>(simd, weights, rows, [place(i)], first, sums);
                }
            }
        }
    }
}

/// Adds what a block of channels from `first` on gives at (row, segment) of `places`; the first begins the sums.
#[inline(always)]
fn add<S: Simd, const P: usize, const M: usize>(
    simd: S,
    weights: &[[f32; M]],
    rows: &Map,
    places: [(usize, usize); P],
    first: usize,
    sums: &mut [[[f32; LANES]; M]; P],
) {
    // A call of its own: what goes on around it would take registers from the sums.
    simd.vectorize(
        #[inline(always)]
        || {
            let mut lanes: Sums<S, P, M> = [[f32x16::splat(simd, 0.0); M]; P];
            if first > 0 {
                for p in 0..P {
                    for i in 0..M {
                        lanes[p][i] = f32x16::load_array_ref(simd, &sums[p][i]);
                    }
                }
            }
            let mut channels: [_; P] = places.map(|(y, s)| windows::<REACH>(rows, y, s).skip(first));
            for weights in weights.as_chunks::<SIDE>().0[first..].iter().take(BLOCK) {
                let mut columns = [&[0.0; REACH]; P];
                for p in 0..P {
                    let Some(window) = channels[p].next() else { continue };
                    columns[p] = window;
                }
                for (column, weights) in weights.iter().enumerate() {
                    panels::add(simd, weights, columns.map(|window| window_at(window, column)), &mut lanes);
                }
            }
            for p in 0..P {
                for i in 0..M {
                    lanes[p][i].store_array(&mut sums[p][i]);
                }
            }
        },
    );
}

/// Makes the rows of the answer of the sums over the transformed ones, and writes them.
#[inline(always)]
fn finish<S: Simd>(simd: S, layer: &Winograd, input: &WinogradInput, panels: Range<usize>, out: &mut Map) {
    let (segments, together) = (out.segments(), layer.rows[0].together());
    let places = input.groups * segments;
    for o in panels.start * together..(panels.end * together).min(layer.bias.len()) {
        let (panel, i) = (o / together - panels.start, o % together);
        for place in 0..places {
            let (g, s) = (place / segments, place % segments);
            let at = |r: usize| ((r * PANELS + panel) * places + place) * together + i;
            let sums = std::array::from_fn(|r| f32x16::load_array_ref(simd, &input.sums[at(r)]));
            let mut rows = answer(sums);
            rows.iter_mut().for_each(|row| *row += layer.bias[o]);
            for (y, row) in layer.activation.of_lanes(rows).into_iter().enumerate() {
                if ROWS * g + y < out.height {
                    store(simd, out, (ROWS * g + y, s), o, [row], 1);
                }
            }
        }
    }
}

/// Bᵀ d of F(4, 3).
#[inline(always)]
fn transformed<S: Simd>(d: [f32x16<S>; TRANSFORMED]) -> [f32x16<S>; TRANSFORMED] {
    let (even, odd) = (d[4] - d[2] * 4.0, d[3] - d[1] * 4.0);
    let (near, far) = (d[4] - d[2], (d[3] - d[1]) * 2.0);
    [d[0] * 4.0 - d[2] * 5.0 + d[4], even + odd, even - odd, near + far, near - far, d[1] * 4.0 - d[3] * 5.0 + d[5]]
}

/// Aᵀ m of F(4, 3).
#[inline(always)]
fn answer<S: Simd>(m: [f32x16<S>; TRANSFORMED]) -> [f32x16<S>; ROWS] {
    let (sum, difference) = (m[1] + m[2], m[1] - m[2]);
    let (far_sum, far_difference) = (m[3] + m[4], m[3] - m[4]);
    [
        m[0] + sum + far_sum,
        difference + far_difference * 2.0,
        sum + far_sum * 4.0,
        difference + far_difference * 8.0 + m[5],
    ]
}
