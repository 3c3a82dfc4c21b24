use super::{Activation, Columns, LANES, Map, add_product, lanes_at};
use multiversion::{multiversion, target::target_cfg_f};

/// Outputs computed together from a packed panel of weights.
const PANEL: usize = 8;

/// One sum for each name, kept in registers: the compiler does so only if the loop over them is written out.
macro_rules! unrolled {
    ($fused:ident, $weights:expr, $columns:expr, $m:literal, $sums:expr, $($name:ident $i:literal),*) => {
        $(let mut $name = $sums[$i];)*
        for (w, x) in $weights.zip($columns) {
            $(add_product::<$fused>(&mut $name, w[$m + $i], x);)*
        }
        $($sums[$i] = $name;)*
    };
}

/// A convolution of 1 × 1: for every pixel, `outputs` weighted sums of its channels, a bias and an activation.
#[derive(Debug, Clone)]
pub struct Pointwise {
    inputs: usize,
    outputs: usize,
    /// For each eight outputs, for each input, the eight weights; missing outputs have weights of zero.
    panels: Vec<[f32; PANEL]>,
    bias: Vec<[f32; PANEL]>,
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
        let outputs = bias.len();
        let mut this = Self {
            inputs: weights.len() / outputs,
            outputs,
            panels: vec![[0.0; PANEL]; weights.len() / outputs * outputs.div_ceil(PANEL)],
            bias: vec![[0.0; PANEL]; outputs.div_ceil(PANEL)],
            activation,
        };
        this.set(weights, bias);
        this
    }

    /// Replaces weights and bias by others of the same lengths.
    pub fn set(&mut self, weights: &[f32], bias: &[f32]) {
        for o in 0..self.outputs {
            self.bias[o / PANEL][o % PANEL] = bias[o];
            for i in 0..self.inputs {
                self.panels[o / PANEL * self.inputs + i][o % PANEL] = weights[o * self.inputs + i];
            }
        }
    }

    /// Computes every row of `out`.
    pub fn run(&self, mut input: PointwiseInput<'_>, out: &mut Map) {
        debug_assert_eq!(input.map.channels + input.more.map_or(0, |m| m.channels), self.inputs);
        debug_assert_eq!((input.map.height, input.map.width), (out.height, out.width));
        debug_assert_eq!(out.channels, self.outputs);
        for y in 0..out.height {
            row(self, &mut input, y, out);
        }
    }
}

#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn row(p: &Pointwise, input: &mut PointwiseInput<'_>, y: usize, out: &mut Map) {
    if target_cfg_f!(any(target_feature = "fma", target_arch = "aarch64")) {
        row_with::<4, true>(p, input, y, out);
    } else {
        row_with::<4, false>(p, input, y, out);
    }
}

#[inline(always)]
fn row_with<const M: usize, const FUSED: bool>(p: &Pointwise, input: &mut PointwiseInput<'_>, y: usize, out: &mut Map) {
    if let Some((factors, activation)) = input.gate {
        gate(input.map.row_mut(y), factors, activation);
    }
    let first = input.map.row(y).as_chunks::<LANES>().0;
    let more = input.more.map_or(&[][..], |m| m.row(y)).as_chunks::<LANES>().0;
    let residual = input.residual.map(|m| m.row(y));
    let segments = out.segments();
    for (n, (bias, panel)) in p.bias.iter().zip(p.panels.chunks_exact(p.inputs)).enumerate() {
        let (head, tail) = panel.split_at(input.map.channels);
        for m in (0..PANEL).step_by(M) {
            for s in 0..segments {
                let mut sums = [[0.0; LANES]; M];
                for i in 0..M {
                    sums[i] = [bias[m + i]; LANES];
                }
                accumulate::<M, FUSED>(head, m, first[s..].iter().step_by(segments), &mut sums);
                accumulate::<M, FUSED>(tail, m, more.iter().skip(s).step_by(segments), &mut sums);
                for i in 0..M.min(p.outputs.saturating_sub(n * PANEL + m)) {
                    let channel = n * PANEL + m + i;
                    if let Some(residual) = residual {
                        let residual = lanes_at(residual, (channel * segments + s) * LANES);
                        (0..LANES).for_each(|j| sums[i][j] += residual[j]);
                    }
                    p.activation.of_lanes(&mut sums[i]);
                    store(out, y, channel, s, &sums[i]);
                }
            }
        }
    }
}

/// sums[i] += Σ weights[k][m + i] · columns of input k.
#[inline(always)]
pub(super) fn accumulate<'a, const M: usize, const FUSED: bool>(
    weights: &[[f32; PANEL]],
    m: usize,
    columns: impl Iterator<Item = &'a [f32; LANES]>,
    sums: &mut [[f32; LANES]; M],
) {
    if M == 8 {
        unrolled!(FUSED, weights.iter(), columns, 0, sums, a0 0, a1 1, a2 2, a3 3, a4 4, a5 5, a6 6, a7 7);
    } else if m == 0 {
        unrolled!(FUSED, weights.iter(), columns, 0, sums, a0 0, a1 1, a2 2, a3 3);
    } else {
        unrolled!(FUSED, weights.iter(), columns, 4, sums, a0 0, a1 1, a2 2, a3 3);
    }
}

/// x = activation(factor · x), channel by channel.
#[inline(always)]
fn gate(row: &mut [f32], factors: &[f32], activation: Activation) {
    let pitch = row.len() / factors.len();
    for (channel, &factor) in row.chunks_exact_mut(pitch).zip(factors) {
        for x in channel.as_chunks_mut::<LANES>().0 {
            (0..LANES).for_each(|j| x[j] *= factor);
            activation.of_lanes(x);
        }
    }
}

/// Writes sixteen columns of a channel, as far as the map reaches, so that its padding stays zero.
#[inline(always)]
pub(super) fn store(out: &mut Map, y: usize, channel: usize, segment: usize, lanes: &[f32; LANES]) {
    let valid = (out.width - segment * LANES).min(LANES);
    let at = out.offset(channel, segment * LANES);
    let (columns, padding) = (out.columns, out.padding);
    let row = out.row_mut(y);
    match columns {
        Columns::Straight if valid == LANES => row[at..at + LANES].copy_from_slice(lanes),
        Columns::Straight => row[at..at + valid].copy_from_slice(&lanes[..valid]),
        Columns::Split { half } => {
            // The first column is even, counted with the padding, or it lies among the odd ones: its neighbour then is
            // the next even one.
            let (mut evens, mut odds) = ([0.0; LANES / 2], [0.0; LANES / 2]);
            for j in 0..LANES / 2 {
                (evens[j], odds[j]) = (lanes[2 * j], lanes[2 * j + 1]);
            }
            let neighbour = if padding % 2 == 0 { at + half } else { at + 1 - half };
            let (n_first, n_second) = (valid.div_ceil(2), valid / 2);
            if valid == LANES {
                row[at..at + LANES / 2].copy_from_slice(&evens);
                row[neighbour..neighbour + LANES / 2].copy_from_slice(&odds);
            } else {
                row[at..at + n_first].copy_from_slice(&evens[..n_first]);
                row[neighbour..neighbour + n_second].copy_from_slice(&odds[..n_second]);
            }
        }
    }
}
