use super::{Activation, Columns, LANES, Map, lanes_at, window_at};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

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
    pub fn run(&self, input: &Map, out: &mut Map, mut sums: Option<&mut [f32]>) {
        debug_assert_eq!(input.channels, self.bias.len());
        debug_assert_eq!(matches!(input.columns, Columns::Split { .. }), self.is_strided());
        if let Some(sums) = sums.as_deref_mut() {
            sums.fill(0.0);
        }
        let sums = sums.unwrap_or_default();
        dispatch!(Level::new(), simd => rows(simd, self, input, out, sums));
    }

    const fn is_strided(&self) -> bool {
        matches!(self.shape, DepthwiseShape::ThreeByTwo | DepthwiseShape::FiveByTwo)
    }
}

#[inline(always)]
fn rows<S: Simd>(simd: S, d: &Depthwise, input: &Map, out: &mut Map, sums: &mut [f32]) {
    match d.shape {
        DepthwiseShape::Two => by_one::<S, 2, 4, 17>(simd, d, input, out, sums),
        DepthwiseShape::Three => by_one::<S, 3, 9, 18>(simd, d, input, out, sums),
        DepthwiseShape::Four => by_one::<S, 4, 16, 19>(simd, d, input, out, sums),
        DepthwiseShape::Five => by_one::<S, 5, 25, 20>(simd, d, input, out, sums),
        DepthwiseShape::ThreeByTwo => by_two::<S, 3, 9, 17>(simd, d, input, out, sums),
        DepthwiseShape::FiveByTwo => by_two::<S, 5, 25, 18>(simd, d, input, out, sums),
    }
}

/// Stride 1: a kernel of side `K` with `KK` taps reads windows of `L` columns in `K` rows.
#[inline(always)]
fn by_one<S: Simd, const K: usize, const KK: usize, const L: usize>(
    simd: S,
    d: &Depthwise,
    input: &Map,
    out: &mut Map,
    sums: &mut [f32],
) {
    let taps = d.weights.as_chunks::<KK>().0;
    let segments = out.segments();
    let (stride, pitch) = (input.row_len(), out.pitch);
    let height = out.height;
    for y in 0..height {
        let source = input.padded_rows_from(y);
        // Rows are summed in pairs, so that fewer small numbers are added to a large one.
        let is_second = y % 2 == 1;
        let (above, target) = row_and_above(out, y);
        for (c, (w, &bias)) in taps.iter().zip(&d.bias).enumerate() {
            for s in 0..segments {
                let at = c * input.pitch + s * LANES;
                let windows: [&[f32; L]; K] = std::array::from_fn(|r| window_at(source, r * stride + at));
                let mut result = f32x16::splat(simd, bias);
                for (ky, window) in windows.into_iter().enumerate() {
                    for kx in 0..K {
                        result = lanes_at(simd, window, kx).mul_add(w[ky * K + kx], result);
                    }
                }
                let result = d.activation.of_lanes(result);
                let at = c * pitch + s * LANES;
                result.store_slice(&mut target[at..at + LANES]);
                if let Some(sum) = sums.get_mut(c * LANES..(c + 1) * LANES) {
                    if is_second {
                        (lanes_at(simd, sum, 0) + (lanes_at(simd, above, at) + result)).store_slice(sum);
                    } else if y + 1 == height {
                        (lanes_at(simd, sum, 0) + result).store_slice(sum);
                    }
                }
            }
        }
    }
}

/// Stride 2 over even and odd columns that stand apart: windows of `L` columns in `K` rows.
#[inline(always)]
fn by_two<S: Simd, const K: usize, const KK: usize, const L: usize>(
    simd: S,
    d: &Depthwise,
    input: &Map,
    out: &mut Map,
    sums: &mut [f32],
) {
    let taps = d.weights.as_chunks::<KK>().0;
    let segments = out.segments();
    let (stride, half, pitch) = (input.row_len(), input.pitch / 2, out.pitch);
    for y in 0..out.height {
        let source = input.padded_rows_from(2 * y);
        let target = out.row_mut(y);
        for (c, (w, &bias)) in taps.iter().zip(&d.bias).enumerate() {
            for s in 0..segments {
                let at = c * input.pitch + s * LANES;
                let mut result = f32x16::splat(simd, bias);
                for ky in 0..K {
                    let even: &[f32; L] = window_at(source, ky * stride + at);
                    let odd: &[f32; L] = window_at(source, ky * stride + at + half);
                    for kx in 0..K {
                        let x = lanes_at(simd, if kx % 2 == 0 { even } else { odd }, kx / 2);
                        result = x.mul_add(w[ky * K + kx], result);
                    }
                }
                let result = d.activation.of_lanes(result);
                let at = c * pitch + s * LANES;
                result.store_slice(&mut target[at..at + LANES]);
                if let Some(sum) = sums.get_mut(c * LANES..(c + 1) * LANES) {
                    (lanes_at(simd, sum, 0) + result).store_slice(sum);
                }
            }
        }
    }
}

/// Row `y`, to be written, and the one above it, or none above the first.
#[inline(always)]
fn row_and_above(map: &mut Map, y: usize) -> (&[f32], &mut [f32]) {
    let len = map.row_len();
    match y {
        0 => (&[], map.row_mut(0)),
        _ => {
            let (above, row) = map.rows_mut(y - 1, 2).split_at_mut(len);
            (above, row)
        }
    }
}
