use super::{Activation, Columns, LANES, Map, add_product, lanes_at, window_at};
use multiversion::{multiversion, target::target_cfg_f};

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
        rows(self, input, out, sums.unwrap_or_default());
    }

    const fn is_strided(&self) -> bool {
        matches!(self.shape, DepthwiseShape::ThreeByTwo | DepthwiseShape::FiveByTwo)
    }
}

// Not for AVX-512: windows that begin at any column cross cache lines, whole registers of sixteen always.
#[multiversion(targets("x86_64+avx2+fma", "aarch64+neon"))]
fn rows(d: &Depthwise, input: &Map, out: &mut Map, sums: &mut [f32]) {
    if target_cfg_f!(any(target_feature = "fma", target_arch = "aarch64")) {
        rows_of::<true>(d, input, out, sums);
    } else {
        rows_of::<false>(d, input, out, sums);
    }
}

#[inline(always)]
fn rows_of<const FUSED: bool>(d: &Depthwise, input: &Map, out: &mut Map, sums: &mut [f32]) {
    match d.shape {
        DepthwiseShape::Two => by_one::<2, 4, 17, FUSED>(d, input, out, sums),
        DepthwiseShape::Three => by_one::<3, 9, 18, FUSED>(d, input, out, sums),
        DepthwiseShape::Four => by_one::<4, 16, 19, FUSED>(d, input, out, sums),
        DepthwiseShape::Five => by_one::<5, 25, 20, FUSED>(d, input, out, sums),
        DepthwiseShape::ThreeByTwo => by_two::<3, 9, 17, FUSED>(d, input, out, sums),
        DepthwiseShape::FiveByTwo => by_two::<5, 25, 18, FUSED>(d, input, out, sums),
    }
}

/// The taps of a kernel row written out, so that the sum stays in a register.
macro_rules! taps {
    ($fused:ident, $side:ident, $w:ident, $windows:ident, $sum:ident, $($kx:literal)*) => {
        for (w, window) in $w.chunks_exact($side).zip($windows) {
            $(add_product::<$fused>(&mut $sum, w[$kx], lanes_at(window, $kx));)*
        }
    };
}

/// Stride 1: a kernel of side `K` with `KK` taps reads windows of `L` columns in `K` rows.
#[inline(always)]
fn by_one<const K: usize, const KK: usize, const L: usize, const FUSED: bool>(
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
                let mut result = [bias; LANES];
                match K {
                    2 => taps!(FUSED, K, w, windows, result, 0 1),
                    3 => taps!(FUSED, K, w, windows, result, 0 1 2),
                    4 => taps!(FUSED, K, w, windows, result, 0 1 2 3),
                    _ => taps!(FUSED, K, w, windows, result, 0 1 2 3 4),
                }
                d.activation.of_lanes(&mut result);
                let at = c * pitch + s * LANES;
                target[at..at + LANES].copy_from_slice(&result);
                if let Some(sum) = sums.get_mut(c * LANES..(c + 1) * LANES) {
                    if is_second {
                        let above = lanes_at(above, at);
                        (0..LANES).for_each(|j| sum[j] += above[j] + result[j]);
                    } else if y + 1 == height {
                        (0..LANES).for_each(|j| sum[j] += result[j]);
                    }
                }
            }
        }
    }
}

/// Stride 2 over even and odd columns that stand apart: windows of `L` columns in `K` rows.
#[inline(always)]
fn by_two<const K: usize, const KK: usize, const L: usize, const FUSED: bool>(
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
                let mut result = [bias; LANES];
                for ky in 0..K {
                    let even: &[f32; L] = window_at(source, ky * stride + at);
                    let odd: &[f32; L] = window_at(source, ky * stride + at + half);
                    let w = &w[ky * K..(ky + 1) * K];
                    add_product::<FUSED>(&mut result, w[0], lanes_at(even, 0));
                    add_product::<FUSED>(&mut result, w[1], lanes_at(odd, 0));
                    add_product::<FUSED>(&mut result, w[2], lanes_at(even, 1));
                    if K == 5 {
                        add_product::<FUSED>(&mut result, w[3], lanes_at(odd, 1));
                        add_product::<FUSED>(&mut result, w[4], lanes_at(even, 2));
                    }
                }
                d.activation.of_lanes(&mut result);
                let at = c * pitch + s * LANES;
                target[at..at + LANES].copy_from_slice(&result);
                if let Some(sum) = sums.get_mut(c * LANES..(c + 1) * LANES) {
                    (0..LANES).for_each(|j| sum[j] += result[j]);
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
