use super::{Activation, Columns, LANES, Map, lanes_at, pointwise::accumulate, pointwise::store};
use multiversion::{multiversion, target::target_cfg_f};

/// Outputs computed together.
const PANEL: usize = 8;
const SIDE: usize = 3;

/// The first layer: a full convolution of 3 × 3, stride 2, from few channels to many.
#[derive(Debug, Clone)]
pub struct Stem {
    outputs: usize,
    /// For each eight outputs, for each (row, channel, column) of the kernel, the eight weights.
    panels: Vec<[f32; PANEL]>,
    bias: Vec<[f32; PANEL]>,
    activation: Activation,
    /// Where the taps lie, from the first even column of the first row on, for the map this was made for.
    taps: Vec<usize>,
}

impl Stem {
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
        for y in 0..out.height {
            row(self, input, y, out);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx2+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn row(stem: &Stem, input: &Map, y: usize, out: &mut Map) {
    let is_wide = target_cfg_f!(target_feature = "avx512f");
    let is_fused = target_cfg_f!(any(target_feature = "fma", target_arch = "aarch64"));
    match (is_wide, is_fused) {
        (true, _) => row_with::<2, 8, true>(stem, input, y, out),
        (false, true) => row_with::<1, 4, true>(stem, input, y, out),
        (false, false) => row_with::<1, 4, false>(stem, input, y, out),
    }
}

/// `M` outputs of `P` segments at a time.
#[inline(always)]
pub(super) fn row_with<const P: usize, const M: usize, const FUSED: bool>(
    stem: &Stem,
    input: &Map,
    y: usize,
    out: &mut Map,
) {
    let whole = out.segments() / P * P;
    for s in (0..whole).step_by(P) {
        segments::<P, M, FUSED>(stem, input, y, s, out);
    }
    for s in whole..out.segments() {
        segments::<1, M, FUSED>(stem, input, y, s, out);
    }
}

#[inline(always)]
fn segments<const P: usize, const M: usize, const FUSED: bool>(
    stem: &Stem,
    input: &Map,
    y: usize,
    s: usize,
    out: &mut Map,
) {
    let source = input.padded_rows_from(2 * y);
    for (n, (bias, panel)) in stem.bias.iter().zip(stem.panels.chunks_exact(stem.taps.len())).enumerate() {
        for m in (0..PANEL).step_by(M) {
            let bias = std::array::from_fn(|i| [bias[m + i]; LANES]);
            let mut sums: [[[f32; LANES]; M]; P] = [bias; P];
            let at = |tap: usize, p: usize| lanes_at(source, tap + (s + p) * LANES);
            let columns = stem.taps.iter().map(|&tap| std::array::from_fn(|p| at(tap, p)));
            accumulate::<P, M, FUSED>(panel, m, columns, &mut sums);
            for (s, sums) in (s..).zip(&mut sums) {
                for i in 0..M {
                    if n * PANEL + m + i < stem.outputs {
                        stem.activation.of_lanes(&mut sums[i]);
                        store(out, y, n * PANEL + m + i, s, &sums[i]);
                    }
                }
            }
        }
    }
}
