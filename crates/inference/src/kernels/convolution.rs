use super::{Activation, Columns, LANES, Map, is_wide, pointwise::accumulate, pointwise::biased, pointwise::store};
use fearless_simd::{Level, Simd, dispatch};
use std::ops::Range;

/// Outputs computed together.
const PANEL: usize = 8;
const SIDE: usize = 3;

/// A full convolution of 3 × 3, stride 2, from few channels to many, a bias and an activation.
#[derive(Debug, Clone)]
pub struct Convolution {
    outputs: usize,
    /// For each eight outputs, for each (row, channel, column) of the kernel, the eight weights.
    panels: Vec<[f32; PANEL]>,
    bias: Vec<[f32; PANEL]>,
    activation: Activation,
    /// Where the taps lie, from the first even column of the first row on, for the map this was made for.
    taps: Vec<usize>,
}

impl Convolution {
    /// From weights in output, input, row, column order, for inputs laid out as `input` is.
    pub fn new(weights: &[f32], bias: &[f32], activation: Activation, input: &Map) -> Self {
        let (inputs, outputs) = (input.channels, bias.len());
        let order: Vec<(usize, usize, usize)> = (0..SIDE)
            .flat_map(|row| (0..inputs).flat_map(move |c| (0..SIDE).map(move |column| (row, c, column))))
            .collect();
        let mut panels = vec![[0.0; PANEL]; order.len() * outputs.div_ceil(PANEL)];
        let mut biases = vec![[0.0; PANEL]; outputs.div_ceil(PANEL)];
        for o in 0..outputs {
            biases[o / PANEL][o % PANEL] = bias[o];
            for (t, &(row, c, column)) in order.iter().enumerate() {
                panels[o / PANEL * order.len() + t][o % PANEL] =
                    weights[((o * inputs + c) * SIDE + row) * SIDE + column];
            }
        }
        let half = if let Columns::Split { half } = input.columns { half } else { 0 };
        let taps = order
            .iter()
            .map(|&(row, c, column)| row * input.row_len() + c * input.pitch + (column % 2) * half + column / 2)
            .collect();
        Self { outputs, panels, bias: biases, activation, taps }
    }

    /// Computes every row of `out`.
    pub fn run(&self, input: &Map, out: &mut Map) {
        self.run_rows(input, out, 0..out.height);
    }

    /// Computes rows `rows` of `out`.
    pub fn run_rows(&self, input: &Map, out: &mut Map, rows: Range<usize>) {
        dispatch!(Level::new(), simd => {
            for y in rows {
                match is_wide(simd) {
                    true => row::<_, 2, 8>(simd, self, input, y, out),
                    false => row::<_, 1, 4>(simd, self, input, y, out),
                }
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
    for (n, (bias, panel)) in layer.bias.iter().zip(layer.panels.chunks_exact(layer.taps.len())).enumerate() {
        for m in (0..PANEL).step_by(M) {
            let first = n * PANEL + m;
            let sums: [[_; M]; P] = [biased(simd, bias, m); P];
            let sources = std::array::from_fn(|p| &source[(s + p) * LANES..]);
            let sums = accumulate(simd, (panel, m), layer.taps.iter().copied(), sources, sums);
            for p in 0..P {
                let count = layer.outputs.saturating_sub(first);
                store(simd, out, (y, s + p), first, layer.activation.of_lanes(sums[p]), count);
            }
        }
    }
}
