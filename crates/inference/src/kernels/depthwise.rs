use super::{Activation, Columns, LANES, Map, lanes_at, window_at};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use std::ops::Range;

/// Rows computed together.
const BLOCK: usize = 4;

/// Side and stride of a depthwise convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthwiseShape {
    /// 2 × 2, stride 1.
    Two,
    /// 3 × 3, stride 1.
    Three,
    /// 4 × 4, stride 1.
    Four,
    /// 5 × 5, stride 1.
    Five,
    /// 3 × 3, stride 2.
    ThreeByTwo,
    /// 5 × 5, stride 2.
    FiveByTwo,
}

impl DepthwiseShape {
    /// Rows and columns of the kernel.
    pub const fn side(self) -> usize {
        match self {
            Self::Two => 2,
            Self::Three | Self::ThreeByTwo => 3,
            Self::Four => 4,
            Self::Five | Self::FiveByTwo => 5,
        }
    }
}

/// A convolution of each channel with a kernel of its own, a bias and an activation.
#[derive(Debug, Clone)]
pub struct Depthwise {
    shape: DepthwiseShape,
    /// Channel, row, column of the kernel.
    weights: Vec<f32>,
    bias: Vec<f32>,
    activation: Activation,
}

impl Depthwise {
    /// From weights in channel, row, column order and one bias a channel.
    pub fn new(shape: DepthwiseShape, weights: &[f32], bias: &[f32], activation: Activation) -> Self {
        debug_assert_eq!(weights.len(), bias.len() * shape.side() * shape.side());
        Self { shape, weights: weights.to_vec(), bias: bias.to_vec(), activation }
    }

    /// The weights, to be replaced by others.
    pub fn weights_mut(&mut self) -> &mut [f32] {
        &mut self.weights
    }

    /// Computes every row of the dense map `out`; `sums`, sixteen a channel, receives the sums over the rows, column by
    /// column (modulo sixteen): of maps at most sixteen columns wide, or whole sixteens.
    #[cfg(test)]
    pub fn run(&self, input: &Map, out: &mut Map, sums: Option<&mut [f32]>) {
        debug_assert_eq!(input.channels, self.bias.len());
        self.run_rows(input, out, 0..out.height);
        self.sum_up(out, sums);
    }

    /// Computes rows `rows` of `out`, which are at least four or all.
    pub fn run_rows(&self, input: &Map, out: &mut Map, rows: Range<usize>) {
        dispatch!(Level::new(), simd => channels(simd, self, 0..self.bias.len(), input, out, &rows));
    }

    /// The sums over the rows of `out`, as in [`run`](Self::run).
    pub fn sum_up(&self, out: &Map, sums: Option<&mut [f32]>) {
        let Some(sums) = sums else { return };
        dispatch!(Level::new(), simd => {
            for (c, sum) in sums.chunks_exact_mut(LANES).enumerate() {
                sum_up(simd, out, c, !self.is_strided(), sum);
            }
        });
    }

    /// The rows of the input that rows `rows` of the output are made from.
    pub const fn reach(&self, rows: &Range<usize>, input: &Map) -> Range<usize> {
        let stride = if self.is_strided() { 2 } else { 1 };
        let last = (rows.end - 1) * stride + self.shape.side();
        let end = last.saturating_sub(input.padding);
        (rows.start * stride).saturating_sub(input.padding)..if end < input.height { end } else { input.height }
    }

    const fn is_strided(&self) -> bool {
        matches!(self.shape, DepthwiseShape::ThreeByTwo | DepthwiseShape::FiveByTwo)
    }
}

/// Rows `rows` of `channels` of `out`, which are those of `input` from its first on.
#[inline(always)]
pub(super) fn channels<S: Simd>(
    simd: S,
    d: &Depthwise,
    channels: Range<usize>,
    input: &Map,
    out: &mut Map,
    rows: &Range<usize>,
) {
    debug_assert_eq!(matches!(input.columns, Columns::Split { .. }), d.is_strided());
    for (i, c) in channels.enumerate() {
        // A call of its own: all that goes on around it would take registers from the sums.
        simd.vectorize(
            #[inline(always)]
            || match d.shape {
                DepthwiseShape::Two => channel::<S, 2, 4, 1, 17>(simd, d, c, (input, i), out, rows),
                DepthwiseShape::Three => channel::<S, 3, 9, 1, 18>(simd, d, c, (input, i), out, rows),
                DepthwiseShape::Four => channel::<S, 4, 16, 1, 19>(simd, d, c, (input, i), out, rows),
                DepthwiseShape::Five => channel::<S, 5, 25, 1, 20>(simd, d, c, (input, i), out, rows),
                DepthwiseShape::ThreeByTwo => channel::<S, 3, 9, 2, 17>(simd, d, c, (input, i), out, rows),
                DepthwiseShape::FiveByTwo => channel::<S, 5, 25, 2, 18>(simd, d, c, (input, i), out, rows),
            },
        );
    }
}

/// Rows `rows` of channel `c` of `out`, which is channel `i` of `input`, by a kernel of side `K` with `KK` taps and stride `T`, which
/// reads windows of `L` columns.
#[inline(always)]
fn channel<S: Simd, const K: usize, const KK: usize, const T: usize, const L: usize>(
    simd: S,
    d: &Depthwise,
    c: usize,
    (input, i): (&Map, usize),
    out: &mut Map,
    rows: &Range<usize>,
) {
    let taps = &d.weights.as_chunks::<KK>().0[c];
    let source = &input.padded_rows_from(rows.start * T)[i * input.pitch..];
    let layout = (input.row_len(), input.pitch / 2);
    let (height, segments, len, at) = (rows.len(), out.segments(), out.row_len(), c * out.pitch);
    let target = &mut out.rows_mut(rows.start, height)[at..];
    for s in 0..segments {
        let (source, target) = (&source[s * LANES..], &mut target[s * LANES..]);
        let mut y = 0;
        while y < height {
            if height >= BLOCK {
                // The last rows may be computed twice.
                let first = y.min(height - BLOCK);
                let sums =
                    weighted::<S, K, KK, T, L, BLOCK>(simd, taps, d.bias[c], &source[first * T * layout.0..], layout);
                store(d.activation.of_lanes(sums), &mut target[first * len..], len);
                y += BLOCK;
            } else {
                let sum = weighted::<S, K, KK, T, L, 1>(simd, taps, d.bias[c], &source[y * T * layout.0..], layout);
                store(d.activation.of_lanes(sum), &mut target[y * len..], len);
                y += 1;
            }
        }
    }
}

/// Writes `R` rows, `len` floats from one to the next.
#[inline(always)]
fn store<S: Simd, const R: usize>(rows: [f32x16<S>; R], target: &mut [f32], len: usize) {
    for r in 0..R {
        rows[r].store_slice(&mut target[r * len..r * len + LANES]);
    }
}

/// Adds up the rows of a channel, in pairs, so that fewer small numbers are added to a large one, or one by one.
#[inline(always)]
fn sum_up<S: Simd>(simd: S, map: &Map, channel: usize, in_pairs: bool, sum: &mut [f32]) {
    let at = |y: usize, s: usize| lanes_at(simd, map.row(y), map.offset(channel, s * LANES));
    let mut total = f32x16::splat(simd, 0.0);
    let paired = if in_pairs { map.height / 2 * 2 } else { 0 };
    for y in (0..paired).step_by(2) {
        for s in 0..map.segments() {
            total += at(y, s) + at(y + 1, s);
        }
    }
    for y in paired..map.height {
        for s in 0..map.segments() {
            total += at(y, s);
        }
    }
    total.store_slice(sum);
}

/// The weighted sums of one channel at sixteen columns of `R` rows: each window is read once for all of them.
#[inline(always)]
fn weighted<S: Simd, const K: usize, const KK: usize, const T: usize, const L: usize, const R: usize>(
    simd: S,
    taps: &[f32; KK],
    bias: f32,
    source: &[f32],
    (stride, half): (usize, usize),
) -> [f32x16<S>; R] {
    // Names instead of an array, and no loops: else the compiler gives the sums a place in memory and stores each whenever it changes.
    let [mut a, mut b, mut c, mut d] = [f32x16::splat(simd, bias); BLOCK];
    macro_rules! add {
        ($row:literal, $kx:literal, $even:ident, $odd:ident, $($sum:ident $r:literal)*) => {
            if $kx < K {
                let x = match T {
                    1 => lanes_at(simd, $even, $kx),
                    _ => lanes_at(simd, if $kx % 2 == 0 { $even } else { $odd }, $kx / 2),
                };
                $(
                    if $r < R && $row >= $r * T && $row < $r * T + K {
                        $sum = x.mul_add(taps[($row - $r * T) * K + $kx], $sum);
                    }
                )*
            }
        };
    }
    macro_rules! rows {
        ($($row:literal)*) => { $(
            if $row < (R - 1) * T + K {
                let even: &[f32; L] = window_at(source, $row * stride);
                let odd: &[f32; L] = if T == 1 { even } else { window_at(source, $row * stride + half) };
                add!($row, 0, even, odd, a 0 b 1 c 2 d 3);
                add!($row, 1, even, odd, a 0 b 1 c 2 d 3);
                add!($row, 2, even, odd, a 0 b 1 c 2 d 3);
                add!($row, 3, even, odd, a 0 b 1 c 2 d 3);
                add!($row, 4, even, odd, a 0 b 1 c 2 d 3);
            }
        )* };
    }
    rows!(0 1 2 3 4 5 6 7 8 9 10);
    let sums = [a, b, c, d];
    std::array::from_fn(|r| sums[r])
}
