use super::panels::{self, Sums, outputs};
use super::{LANES, Map, functions, lanes_at, window_at};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use std::ops::Range;

/// What the number of keys, and that of channels, is a multiple of.
const PANEL: usize = 8;

/// The normalisation of each token over its channels (Ba et al. 2016, eq. 3), and a weight and a bias a channel.
///
/// Tokens are the pixels of a dense map sixteen columns wide.
#[derive(Debug, Clone)]
pub struct LayerNorm {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl LayerNorm {
    /// What is added to the variance.
    const EPSILON: f32 = 1e-5;

    /// From a weight and a bias a channel.
    pub const fn new(weights: Vec<f32>, bias: Vec<f32>) -> Self {
        Self { weights, bias }
    }

    /// Normalises rows `rows` of `input` to the rows of `out` from row `first` on.
    pub fn run(&self, input: &Map, rows: Range<usize>, (out, first): (&mut Map, usize)) {
        debug_assert_eq!((input.width, input.channels, out.channels), (LANES, self.bias.len(), self.bias.len()));
        dispatch!(Level::new(), simd => {
            for (y, from) in rows.enumerate() {
                self.row(simd, input.row(from).as_chunks().0, out.row_mut(first + y).as_chunks_mut().0);
            }
        });
    }

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, input: &[[f32; LANES]], out: &mut [[f32; LANES]]) {
        let share = 1.0 / self.bias.len() as f32;
        let mut sum = f32x16::splat(simd, 0.0);
        for x in input {
            sum += f32x16::load_array_ref(simd, x);
        }
        let mean = sum * share;
        let mut squares = f32x16::splat(simd, 0.0);
        for x in input {
            let d = f32x16::load_array_ref(simd, x) - mean;
            squares = d.mul_add(d, squares);
        }
        let scale = 1.0 / (squares * share + Self::EPSILON).sqrt();
        for (((x, out), &weight), &bias) in input.iter().zip(out).zip(&self.weights).zip(&self.bias) {
            let normal = (f32x16::load_array_ref(simd, x) - mean) * scale;
            normal.mul_add(weight, bias).store_array(out);
        }
    }
}

/// Attention of one head (Vaswani et al. 2017, eq. 1): each token becomes the mean of the values of all, weighed by the softmax of
/// its query's products with their keys.
#[derive(Debug, Clone)]
pub struct Attention {
    channels: usize,
    /// For each panel of keys, for each channel, the keys' numbers.
    keys: Vec<f32>,
    /// For each panel of channels, for each key, its numbers.
    values: Vec<f32>,
    /// Keys, or channels, of a panel: those that are handled together.
    together: usize,
    /// Of the queries that are looked at, two sixteens a key.
    products: Vec<f32>,
    /// Where each key's products begin.
    starts: Vec<usize>,
}

impl Attention {
    /// For `tokens` tokens, a whole number of sixteens, of `channels` channels, a whole number of eights.
    pub fn new(tokens: usize, channels: usize) -> Self {
        debug_assert!(tokens.is_multiple_of(LANES) && channels.is_multiple_of(PANEL));
        let panels = vec![0.0; tokens * channels];
        Self {
            channels,
            keys: panels.clone(),
            values: panels,
            together: dispatch!(Level::new(), simd => together(simd)),
            products: vec![0.0; tokens * 2 * LANES],
            starts: (0..tokens).map(|k| k * 2 * LANES).collect(),
        }
    }

    /// `out` for the tokens in rows `rows`, whose number is even. `input` has the channels of the queries, already divided by the
    /// square root of their number, those of the keys and those of the values.
    pub fn run(&mut self, input: &Map, rows: Range<usize>, out: &mut Map) {
        debug_assert_eq!((input.channels, input.width, out.channels), (3 * self.channels, LANES, self.channels));
        self.pack(input);
        dispatch!(Level::new(), simd => {
            for y in rows.step_by(2) {
                match together(simd) {
                    8 => self.rows::<_, 2, 8>(simd, input, y, out),
                    _ => (y..y + 2).for_each(|y| self.rows::<_, 1, 4>(simd, input, y, out)),
                }
            }
        });
    }

    /// Lays keys and values out as weights.
    fn pack(&mut self, input: &Map) {
        let (channels, tokens, together) = (self.channels, self.starts.len(), self.together);
        for y in 0..input.height {
            let (keys, values) = input.row(y)[channels * LANES..].split_at(channels * LANES);
            for (c, (keys, values)) in keys.as_chunks::<LANES>().0.iter().zip(values.as_chunks::<LANES>().0).enumerate()
            {
                for (n, keys) in keys.chunks_exact(together).enumerate() {
                    let panel = y * LANES / together + n;
                    self.keys[(panel * channels + c) * together..][..together].copy_from_slice(keys);
                }
                let first = c / together * tokens + y * LANES;
                for (to, value) in self.values[first * together..].chunks_exact_mut(together).zip(values) {
                    to[c % together] = *value;
                }
            }
        }
    }

    /// The tokens of `P` rows from row `y` on.
    #[inline(always)]
    fn rows<S: Simd, const P: usize, const M: usize>(&mut self, simd: S, input: &Map, y: usize, out: &mut Map) {
        let Self { channels, keys, values, products, starts, .. } = self;
        let mut most = [f32x16::splat(simd, f32::MIN); P];
        let queries: [&[f32]; P] = std::array::from_fn(|p| input.row(y + p));
        for (keys, starts) in keys.as_chunks::<M>().0.chunks_exact(*channels).zip(starts.chunks_exact(M)) {
            let mut sums: Sums<S, P, M> = [[f32x16::splat(simd, 0.0); M]; P];
            for (c, keys) in keys.iter().enumerate() {
                panels::add(simd, keys, queries.map(|query| window_at(query, c * LANES)), &mut sums);
            }
            for p in 0..P {
                for i in 0..M {
                    most[p] = most[p].max(sums[p][i]);
                    let at = starts[i] + p * LANES;
                    sums[p][i].store_slice(&mut products[at..at + LANES]);
                }
            }
        }
        let mut totals = [f32x16::splat(simd, 0.0); P];
        for &start in &*starts {
            for p in 0..P {
                let at = start + p * LANES;
                let share = functions::exp(lanes_at(simd, products, at) - most[p]);
                totals[p] += share;
                share.store_slice(&mut products[at..at + LANES]);
            }
        }
        let shares: [f32x16<S>; P] = std::array::from_fn(|p| 1.0 / totals[p]);
        for (n, values) in values.as_chunks::<M>().0.chunks_exact(starts.len()).enumerate() {
            let mut sums: Sums<S, P, M> = [[f32x16::splat(simd, 0.0); M]; P];
            for (values, &start) in values.iter().zip(&*starts) {
                let x = std::array::from_fn(|p| window_at(products, start + p * LANES));
                panels::add(simd, values, x, &mut sums);
            }
            for p in 0..P {
                let row = out.row_mut(y + p);
                for i in 0..M {
                    let at = (n * M + i) * LANES;
                    (sums[p][i] * shares[p]).store_slice(&mut row[at..at + LANES]);
                }
            }
        }
    }
}

/// How many keys, or channels, are handled together: no six of them, which does not divide their number.
#[inline(always)]
const fn together<S: Simd>(simd: S) -> usize {
    if outputs(simd) == 8 { 8 } else { 4 }
}
