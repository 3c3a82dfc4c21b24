use super::{Activation, Columns, LANES, Map, is_wide, lanes_at};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

/// Outputs computed together from a packed panel of weights.
const PANEL: usize = 8;

/// The number of each lane.
const NUMBERS: [f32; LANES] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

/// Of `M` outputs at `P` places.
type Sums<S, const P: usize, const M: usize> = [[f32x16<S>; M]; P];

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
        let (inputs, outputs) = (weights.len() / bias.len(), bias.len());
        let mut panels = vec![[0.0; PANEL]; inputs * outputs.div_ceil(PANEL)];
        let mut biases = vec![[0.0; PANEL]; outputs.div_ceil(PANEL)];
        for o in 0..outputs {
            biases[o / PANEL][o % PANEL] = bias[o];
            for i in 0..inputs {
                panels[o / PANEL * inputs + i][o % PANEL] = weights[o * inputs + i];
            }
        }
        Self { inputs, outputs, panels, bias: biases, activation }
    }

    /// Computes every row of `out`.
    pub fn run(&self, mut input: PointwiseInput<'_>, out: &mut Map) {
        debug_assert_eq!(input.map.channels + input.more.map_or(0, |m| m.channels), self.inputs);
        debug_assert_eq!((input.map.height, input.map.width), (out.height, out.width));
        debug_assert_eq!(out.channels, self.outputs);
        dispatch!(Level::new(), simd => {
            for y in (0..out.height).step_by(2) {
                match is_wide(simd) {
                    true => rows::<_, 2, 8>(simd, self, &mut input, y, out),
                    false => rows::<_, 1, 4>(simd, self, &mut input, y, out),
                }
            }
        });
    }
}

/// Row `y` and, where there is one, the next: `M` outputs at `P` places of sixteen columns at a time, as many sums as
/// there are registers for.
#[inline(always)]
pub(super) fn rows<S: Simd, const P: usize, const M: usize>(
    simd: S,
    p: &Pointwise,
    input: &mut PointwiseInput<'_>,
    y: usize,
    out: &mut Map,
) {
    let rows = (out.height - y).min(2);
    if let Some((factors, activation)) = input.gate {
        for y in y..y + rows {
            gate(simd, input.map.row_mut(y), factors, activation);
        }
    }
    let segments = out.segments();
    let place = |n: usize| (y + n / segments, n % segments);
    let whole = rows * segments / P * P;
    for panel in 0..p.bias.len() {
        for m in (0..PANEL).step_by(M) {
            let first = panel * PANEL + m;
            for n in (0..whole).step_by(P) {
                tile::<S, P, M>(simd, p, input, first, std::array::from_fn(|i| place(n + i)), out);
            }
            for n in whole..rows * segments {
                tile::<S, 1, M>(simd, p, input, first, [place(n)], out);
            }
        }
    }
}

/// `M` outputs from `first` on at each (row, segment) of `places`.
#[inline(always)]
fn tile<S: Simd, const P: usize, const M: usize>(
    simd: S,
    p: &Pointwise,
    input: &PointwiseInput<'_>,
    first: usize,
    places: [(usize, usize); P],
    out: &mut Map,
) {
    let (panel, m) = (first / PANEL, first % PANEL);
    let (head, tail) = p.panels[panel * p.inputs..(panel + 1) * p.inputs].split_at(input.map.channels);
    let mut sums: Sums<S, P, M> = [biased(simd, &p.bias[panel], m); P];
    sums = accumulate(simd, (head, m), offsets(input.map), sources(input.map, places), sums);
    if let Some(more) = input.more {
        sums = accumulate(simd, (tail, m), offsets(more), sources(more, places), sums);
    }
    // A call of its own: what it needs would take registers from the sums.
    simd.vectorize(
        #[inline(always)]
        || finish(simd, p, input.residual, first, (&places, &sums), out),
    );
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
) {
    for n in 0..P {
        let (y, s) = places[n];
        for i in 0..M {
            if first + i < p.outputs {
                let mut sum = sums[n][i];
                if let Some(residual) = residual {
                    sum += lanes_at(simd, residual.row(y), residual.offset(first + i, s * LANES));
                }
                store(simd, out, y, first + i, s, p.activation.of_lanes(sum));
            }
        }
    }
}

/// Where the channels of a dense map begin in a row.
fn offsets(map: &Map) -> impl Iterator<Item = usize> {
    let pitch = map.pitch;
    (0..map.channels).map(move |c| c * pitch)
}

/// Each (row, segment) of a map, and all that follows it in the row.
fn sources<const P: usize>(map: &Map, places: [(usize, usize); P]) -> [&[f32]; P] {
    places.map(|(y, s)| &map.row(y)[s * LANES..])
}

/// The biases of `M` outputs from `m` on.
#[inline(always)]
pub(super) fn biased<S: Simd, const M: usize>(simd: S, bias: &[f32; PANEL], m: usize) -> [f32x16<S>; M] {
    let mut lanes = [f32x16::splat(simd, 0.0); M];
    for i in 0..M {
        lanes[i] = f32x16::splat(simd, bias[m + i]);
    }
    lanes
}

/// sums[p][i] += Σ weights[k][m + i] · columns of input k at place p, which begin at `offsets[k]` of `sources[p]`.
#[inline(always)]
pub(super) fn accumulate<S: Simd, const P: usize, const M: usize>(
    simd: S,
    (weights, m): (&[[f32; PANEL]], usize),
    offsets: impl Iterator<Item = usize>,
    sources: [&[f32]; P],
    mut sums: Sums<S, P, M>,
) -> Sums<S, P, M> {
    for (w, at) in weights.iter().zip(offsets) {
        let mut x = [f32x16::splat(simd, 0.0); P];
        for p in 0..P {
            x[p] = lanes_at(simd, sources[p], at);
        }
        for i in 0..M {
            for p in 0..P {
                sums[p][i] = x[p].mul_add(w[m + i], sums[p][i]);
            }
        }
    }
    sums
}

/// x = activation(factor · x), channel by channel.
#[inline(always)]
fn gate<S: Simd>(simd: S, row: &mut [f32], factors: &[f32], activation: Activation) {
    let pitch = row.len() / factors.len();
    for (channel, &factor) in row.chunks_exact_mut(pitch).zip(factors) {
        for x in channel.as_chunks_mut::<LANES>().0 {
            activation.of_lanes(f32x16::load_array_ref(simd, x) * factor).store_array(x);
        }
    }
}

/// Writes sixteen columns of a channel, zeros for those that the map does not have, so that its padding stays zero.
#[inline(always)]
pub(super) fn store<S: Simd>(simd: S, out: &mut Map, y: usize, channel: usize, segment: usize, lanes: f32x16<S>) {
    let valid = out.width - segment * LANES;
    let lanes = match valid < LANES {
        true => {
            let is_valid = f32x16::load_array_ref(simd, &NUMBERS).simd_lt(valid as f32);
            is_valid.select(lanes, f32x16::splat(simd, 0.0))
        }
        false => lanes,
    };
    let at = out.offset(channel, segment * LANES);
    let (columns, padding) = (out.columns, out.padding);
    let row = out.row_mut(y);
    match columns {
        Columns::Straight => lanes.store_slice(&mut row[at..at + LANES]),
        Columns::Split { half } => {
            // The first column is even, counted with the padding, or it lies among the odd ones: its neighbour then is
            // the next even one.
            let neighbour = if padding % 2 == 0 { at + half } else { at + 1 - half };
            lanes.unzip_low(lanes).split().0.store_slice(&mut row[at..at + LANES / 2]);
            lanes.unzip_high(lanes).split().0.store_slice(&mut row[neighbour..neighbour + LANES / 2]);
        }
    }
}
