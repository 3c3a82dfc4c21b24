use super::panels::{self, Panels, Sums, by_registers};
use super::{Activation, Columns, LANES, Map, pointwise::store, window_at};
use fearless_simd::{Level, Simd, dispatch};
use std::ops::Range;

const SIDE: usize = 3;

/// A full convolution of 3 × 3, stride 2, from few channels to many, a bias and an activation.
#[derive(Debug, Clone)]
pub struct Convolution {
    pub(super) panels: Panels,
    activation: Activation,
    /// Where the taps, by row, channel and column of the kernel, lie, from the first even column of the first row on, for the map this was made for.
    taps: Vec<usize>,
}

impl Convolution {
    /// From weights in output, input, row, column order, for inputs laid out as `input` is.
    pub fn new(weights: &[f32], bias: &[f32], activation: Activation, input: &Map) -> Self {
        let inputs = input.channels;
        let order: Vec<(usize, usize, usize)> = (0..SIDE)
            .flat_map(|row| (0..inputs).flat_map(move |c| (0..SIDE).map(move |column| (row, c, column))))
            .collect();
        let panels = Panels::new(bias, order.len(), |o, t| {
            let (row, c, column) = order[t];
            weights[((o * inputs + c) * SIDE + row) * SIDE + column]
        });
        let half = if let Columns::Split { half } = input.columns { half } else { 0 };
        let taps = order
            .iter()
            .map(|&(row, c, column)| row * input.row_len() + c * input.pitch + (column % 2) * half + column / 2)
            .collect();
        Self { panels, activation, taps }
    }

    /// Computes every row of `out`.
    pub fn run(&self, input: &Map, out: &mut Map) {
        self.run_rows(input, out, 0..out.height);
    }

    /// Computes rows `rows` of `out`.
    pub fn run_rows(&self, input: &Map, out: &mut Map, rows: Range<usize>) {
        dispatch!(Level::new(), simd => {
            for y in rows {
                by_registers!(simd => row(self, input, y, out));
            }
        });
    }
}

/// `M` outputs of `P` segments at a time.
#[inline(always)]
pub(super) fn row<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Convolution,
    input: &Map,
    y: usize,
    out: &mut Map,
) {
    let whole = out.segments() / P * P;
    for s in (0..whole).step_by(P) {
        segments::<S, P, M>(simd, layer, input, y, s, out);
    }
    for s in whole..out.segments() {
        segments::<S, 1, M>(simd, layer, input, y, s, out);
    }
}

#[inline(always)]
fn segments<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Convolution,
    input: &Map,
    y: usize,
    s: usize,
    out: &mut Map,
) {
    let source = input.padded_rows_from(2 * y);
    for n in 0..layer.panels.count() {
        let mut sums: Sums<S, P, M> = layer.panels.biases(simd, n);
        for (weights, &at) in layer.panels.weights(n).iter().zip(&layer.taps) {
            let mut x = [&[0.0; LANES]; P];
            for p in 0..P {
                x[p] = window_at(source, (s + p) * LANES + at);
            }
            panels::add(simd, weights, x, &mut sums);
        }
        for p in 0..P {
            let count = layer.panels.outputs() - n * M;
            store(simd, out, (y, s + p), n * M, layer.activation.of_lanes(sums[p]), count);
        }
    }
}
