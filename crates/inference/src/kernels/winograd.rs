use super::{Activation, LANES, Map, is_wide, lanes_at, pointwise::accumulate, pointwise::store};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

/// Outputs computed together.
const PANEL: usize = 8;
const SIDE: usize = 3;
/// Rows of the answer that are made together, and of what they are made from.
const ROWS: usize = 4;
const TRANSFORMED: usize = ROWS + SIDE - 1;

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
    outputs: usize,
    /// For each eight outputs, for each of the six transformed rows, for each (channel, column of the kernel), the eight weights.
    panels: Vec<[f32; PANEL]>,
    bias: Vec<[f32; PANEL]>,
    activation: Activation,
    channels: usize,
}

/// What such convolutions read: maps, one after the other, four rows transformed to six. Several layers may read the same.
#[derive(Debug, Clone)]
pub struct WinogradInput {
    /// Row `r · groups + g` is the r-th of the transformed rows of the g-th four.
    rows: Map,
    groups: usize,
    /// Rows of what is transformed.
    height: usize,
    /// Where the taps of a row lie.
    taps: Vec<usize>,
}

impl WinogradInput {
    /// For `channels` of `height` × `width`.
    pub fn new(channels: usize, height: usize, width: usize) -> Self {
        let groups = height.div_ceil(ROWS);
        let rows = Map::padded(channels, TRANSFORMED * groups, width, 1, SIDE);
        let taps = (0..channels * SIDE).map(|i| i / SIDE * rows.pitch + i % SIDE).collect();
        Self { rows, groups, height, taps }
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
        let outputs = bias.len();
        let channels = weights.len() / (outputs * SIDE * SIDE);
        let taps = channels * SIDE;
        let mut panels = vec![[0.0; PANEL]; outputs.div_ceil(PANEL) * TRANSFORMED * taps];
        let mut biases = vec![[0.0; PANEL]; outputs.div_ceil(PANEL)];
        for o in 0..outputs {
            biases[o / PANEL][o % PANEL] = bias[o];
            for (r, kernel) in KERNEL.iter().enumerate() {
                for tap in 0..taps {
                    let (c, column) = (tap / SIDE, tap % SIDE);
                    let weight = |row: usize| f64::from(weights[((o * channels + c) * SIDE + row) * SIDE + column]);
                    let sum: f64 = kernel.iter().enumerate().map(|(row, k)| k * weight(row)).sum();
                    panels[(o / PANEL * TRANSFORMED + r) * taps + tap][o % PANEL] = sum as f32;
                }
            }
        }
        Self { outputs, panels, bias: biases, activation, channels }
    }

    /// Computes every row of `out`.
    pub fn run(&self, input: &WinogradInput, out: &mut Map) {
        debug_assert_eq!((self.channels, self.outputs), (input.rows.channels, out.channels));
        debug_assert_eq!((out.height, out.width), (input.height, input.rows.width));
        dispatch!(Level::new(), simd => {
            for n in 0..self.bias.len() {
                match is_wide(simd) {
                    true => panel::<_, 2, 8>(simd, self, input, n, out),
                    false => panel::<_, 1, 4>(simd, self, input, n, out),
                }
            }
        });
    }
}

/// Eight outputs, the `n`-th of such: `M` outputs of `P` fours of rows at a time.
#[inline(always)]
pub(super) fn panel<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Winograd,
    input: &WinogradInput,
    n: usize,
    out: &mut Map,
) {
    let segments = out.segments();
    let places = input.groups * segments;
    let place = |i: usize| (i / segments, i % segments);
    let whole = places / P * P;
    for m in (0..PANEL).step_by(M) {
        for i in (0..whole).step_by(P) {
            tile::<S, P, M>(simd, layer, input, (n, m), std::array::from_fn(|k| place(i + k)), out);
        }
        for i in whole..places {
            tile::<S, 1, M>(simd, layer, input, (n, m), [place(i)], out);
        }
    }
}

/// `M` outputs of panel `n` from its `m`-th on, at each (four of rows, segment) of `places`.
#[inline(always)]
fn tile<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Winograd,
    input: &WinogradInput,
    (n, m): (usize, usize),
    places: [(usize, usize); P],
    out: &mut Map,
) {
    let count = input.taps.len();
    let weights = &layer.panels[n * TRANSFORMED * count..(n + 1) * TRANSFORMED * count];
    let mut sums = [[[f32x16::splat(simd, 0.0); M]; P]; TRANSFORMED];
    for (r, weights) in weights.chunks_exact(count).enumerate() {
        let mut sources: [&[f32]; P] = [&[]; P];
        for k in 0..P {
            let (g, s) = places[k];
            sources[k] = &input.rows.row(r * input.groups + g)[s * LANES..];
        }
        let zeros = [[f32x16::splat(simd, 0.0); M]; P];
        sums[r] = accumulate(simd, (weights, m), input.taps.iter().copied(), sources, zeros);
    }
    // A call of its own: what it needs would take registers from the sums.
    simd.vectorize(
        #[inline(always)]
        || finish(simd, layer, (n, m), (&places, &sums), out),
    );
}

/// Sums of `M` panels at `P` places, one for each transformed row.
type Sums<S, const P: usize, const M: usize> = [[[f32x16<S>; M]; P]; TRANSFORMED];

/// Makes the rows of the answer of the sums over the transformed ones, and writes them.
#[inline(always)]
fn finish<S: Simd, const P: usize, const M: usize>(
    simd: S,
    layer: &Winograd,
    (n, m): (usize, usize),
    (places, sums): (&[(usize, usize); P], &Sums<S, P, M>),
    out: &mut Map,
) {
    let first = n * PANEL + m;
    let count = layer.outputs.saturating_sub(first).min(M);
    for k in 0..P {
        let (g, s) = places[k];
        let mut rows = [[f32x16::splat(simd, 0.0); M]; ROWS];
        for i in 0..M {
            let answer = answer(std::array::from_fn(|r| sums[r][k][i]));
            for y in 0..ROWS {
                rows[y][i] = answer[y] + layer.bias[n][m + i];
            }
        }
        for (y, row) in rows.into_iter().enumerate() {
            if ROWS * g + y < out.height {
                store(simd, out, (ROWS * g + y, s), first, layer.activation.of_lanes(row), count);
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
