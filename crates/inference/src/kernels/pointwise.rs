use super::{Activation, Columns, LANES, Map, add_product, lanes_at};
use multiversion::{multiversion, target::target_cfg_f};

/// Outputs computed together from a packed panel of weights.
const PANEL: usize = 8;

/// One sum for each name, of a place and an output, kept in registers: the compiler does so only if the loops over them are
/// written out.
macro_rules! unrolled {
    ($fused:ident, $weights:expr, $columns:expr, $m:literal, $sums:expr, $($name:ident $p:literal $i:literal),*) => {{
        $(let mut $name = $sums[$p][$i];)*
        for (w, x) in $weights.zip($columns) {
            let x = x.map(|x| *x);
            $(add_product::<$fused>(&mut $name, w[$m + $i], &x[$p]);)*
        }
        $($sums[$p][$i] = $name;)*
    }};
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
        for y in (0..out.height).step_by(2) {
            rows(self, &mut input, y, out);
        }
    }
}

/// Row `y` and, where there is one, the next.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx2+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn rows(p: &Pointwise, input: &mut PointwiseInput<'_>, y: usize, out: &mut Map) {
    let is_wide = target_cfg_f!(target_feature = "avx512f");
    let is_fused = target_cfg_f!(any(target_feature = "fma", target_arch = "aarch64"));
    match (is_wide, is_fused) {
        (true, _) => rows_with::<2, 8, true>(p, input, y, out),
        (false, true) => rows_with::<1, 4, true>(p, input, y, out),
        (false, false) => rows_with::<1, 4, false>(p, input, y, out),
    }
}

/// `M` outputs at `P` places of sixteen columns at a time: as many sums as there are registers for.
#[inline(always)]
pub(super) fn rows_with<const P: usize, const M: usize, const FUSED: bool>(
    p: &Pointwise,
    input: &mut PointwiseInput<'_>,
    y: usize,
    out: &mut Map,
) {
    let rows = (out.height - y).min(2);
    if let Some((factors, activation)) = input.gate {
        (y..y + rows).for_each(|y| gate(input.map.row_mut(y), factors, activation));
    }
    let segments = out.segments();
    let place = |n: usize| (y + n / segments, n % segments);
    let whole = rows * segments / P * P;
    for panel in 0..p.bias.len() {
        for m in (0..PANEL).step_by(M) {
            let first = panel * PANEL + m;
            for n in (0..whole).step_by(P) {
                tile::<P, M, FUSED>(p, input, first, std::array::from_fn(|i| place(n + i)), out);
            }
            for n in whole..rows * segments {
                tile::<1, M, FUSED>(p, input, first, [place(n)], out);
            }
        }
    }
}

/// `M` outputs from `first` on at each (row, segment) of `places`.
#[inline(always)]
fn tile<const P: usize, const M: usize, const FUSED: bool>(
    p: &Pointwise,
    input: &PointwiseInput<'_>,
    first: usize,
    places: [(usize, usize); P],
    out: &mut Map,
) {
    let (panel, m) = (first / PANEL, first % PANEL);
    let (head, tail) = p.panels[panel * p.inputs..(panel + 1) * p.inputs].split_at(input.map.channels);
    let bias = std::array::from_fn(|i| [p.bias[panel][m + i]; LANES]);
    let mut sums = [bias; P];
    accumulate::<P, M, FUSED>(head, m, columns(input.map, places), &mut sums);
    if let Some(more) = input.more {
        accumulate::<P, M, FUSED>(tail, m, columns(more, places), &mut sums);
    }
    for (&(y, s), sums) in places.iter().zip(&mut sums) {
        for i in 0..M {
            if first + i < p.outputs {
                if let Some(residual) = input.residual {
                    let residual = lanes_at(residual.row(y), residual.offset(first + i, s * LANES));
                    (0..LANES).for_each(|j| sums[i][j] += residual[j]);
                }
                p.activation.of_lanes(&mut sums[i]);
                store(out, y, first + i, s, &sums[i]);
            }
        }
    }
}

/// The columns of a dense map at some places, channel by channel.
#[inline(always)]
fn columns<const P: usize>(map: &Map, places: [(usize, usize); P]) -> impl Iterator<Item = [&[f32; LANES]; P]> {
    let rows = places.map(|(y, _)| map.row(y));
    (0..map.channels).map(move |c| std::array::from_fn(|i| lanes_at(rows[i], c * map.pitch + places[i].1 * LANES)))
}

/// sums[p][i] += Σ weights[k][m + i] · columns of input k at place p.
#[inline(always)]
pub(super) fn accumulate<'a, const P: usize, const M: usize, const FUSED: bool>(
    weights: &[[f32; PANEL]],
    m: usize,
    columns: impl Iterator<Item = [&'a [f32; LANES]; P]>,
    sums: &mut [[[f32; LANES]; M]; P],
) {
    let weights = weights.iter();
    match (P, M, m) {
        (2, 8, _) => unrolled!(
            FUSED, weights, columns, 0, sums,
            a0 0 0, a1 0 1, a2 0 2, a3 0 3, a4 0 4, a5 0 5, a6 0 6, a7 0 7,
            b0 1 0, b1 1 1, b2 1 2, b3 1 3, b4 1 4, b5 1 5, b6 1 6, b7 1 7
        ),
        (_, 8, _) => unrolled!(
            FUSED, weights, columns, 0, sums,
            a0 0 0, a1 0 1, a2 0 2, a3 0 3, a4 0 4, a5 0 5, a6 0 6, a7 0 7
        ),
        (_, _, 0) => unrolled!(FUSED, weights, columns, 0, sums, a0 0 0, a1 0 1, a2 0 2, a3 0 3),
        _ => unrolled!(FUSED, weights, columns, 4, sums, a0 0 0, a1 0 1, a2 0 2, a3 0 3),
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
            // One permutation of a whole register: halves read apart would wait for the store of the sums.
            let mut parted = [0.0; LANES];
            for j in 0..LANES {
                parted[j] = lanes[2 * j % LANES + 2 * j / LANES];
            }
            let (evens, odds) = parted.split_at(LANES / 2);
            let neighbour = if padding % 2 == 0 { at + half } else { at + 1 - half };
            let (n_first, n_second) = (valid.div_ceil(2), valid / 2);
            if valid == LANES {
                row[at..at + LANES / 2].copy_from_slice(evens);
                row[neighbour..neighbour + LANES / 2].copy_from_slice(odds);
            } else {
                row[at..at + n_first].copy_from_slice(&evens[..n_first]);
                row[neighbour..neighbour + n_second].copy_from_slice(&odds[..n_second]);
            }
        }
    }
}
