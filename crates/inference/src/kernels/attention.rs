use super::{LANES, Map, functions, is_wide, lanes_at, pointwise::accumulate};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use std::ops::Range;

/// Keys, or channels, handled together.
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
    /// For each eight keys, for each channel, the eight.
    keys: Vec<[f32; PANEL]>,
    /// For each eight channels, for each key, the eight.
    values: Vec<[f32; PANEL]>,
    /// Of the queries that are looked at, two sixteens a key.
    products: Vec<f32>,
    /// Where each key's products begin.
    starts: Vec<usize>,
}

impl Attention {
    /// For `tokens` tokens, a whole number of sixteens, of `channels` channels, a whole number of eights.
    pub fn new(tokens: usize, channels: usize) -> Self {
        debug_assert!(tokens.is_multiple_of(LANES) && channels.is_multiple_of(PANEL));
        let panels = vec![[0.0; PANEL]; tokens * channels / PANEL];
        Self {
            channels,
            keys: panels.clone(),
            values: panels,
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
                match is_wide(simd) {
                    true => self.rows::<_, 2, 8>(simd, input, y, out),
                    false => (y..y + 2).for_each(|y| self.rows::<_, 1, 4>(simd, input, y, out)),
                }
            }
        });
    }

    /// Lays keys and values out as weights.
    fn pack(&mut self, input: &Map) {
        let (channels, tokens) = (self.channels, self.starts.len());
        for y in 0..input.height {
            let (keys, values) = input.row(y)[channels * LANES..].split_at(channels * LANES);
            for (c, (keys, values)) in keys.as_chunks::<LANES>().0.iter().zip(values.as_chunks::<LANES>().0).enumerate()
            {
                let panel = y * LANES / PANEL * channels + c;
                for (half, keys) in keys.as_chunks::<PANEL>().0.iter().enumerate() {
                    self.keys[panel + half * channels] = *keys;
                }
                let first = c / PANEL * tokens + y * LANES;
                for (to, value) in self.values[first..first + LANES].iter_mut().zip(values) {
                    to[c % PANEL] = *value;
                }
            }
        }
    }

    /// The tokens of `P` rows from row `y` on.
    #[inline(always)]
    fn rows<S: Simd, const P: usize, const M: usize>(&mut self, simd: S, input: &Map, y: usize, out: &mut Map) {
        let Self { channels, keys, values, products, starts } = self;
        let mut most = [f32x16::splat(simd, f32::MIN); P];
        let queries: [&[f32]; P] = std::array::from_fn(|p| input.row(y + p));
        for (n, keys) in keys.chunks_exact(*channels).enumerate() {
            for m in (0..PANEL).step_by(M) {
                let zeros = [[f32x16::splat(simd, 0.0); M]; P];
                let sums = accumulate(simd, (keys, m), (0..*channels).map(|c| c * LANES), queries, zeros);
                for p in 0..P {
                    for i in 0..M {
                        most[p] = most[p].max(sums[p][i]);
                        let at = starts[n * PANEL + m + i] + p * LANES;
                        sums[p][i].store_slice(&mut products[at..at + LANES]);
                    }
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
        let sources: [&[f32]; P] = std::array::from_fn(|p| &products[p * LANES..]);
        for (n, values) in values.chunks_exact(starts.len()).enumerate() {
            for m in (0..PANEL).step_by(M) {
                let zeros = [[f32x16::splat(simd, 0.0); M]; P];
                let sums = accumulate(simd, (values, m), starts.iter().copied(), sources, zeros);
                for p in 0..P {
                    let row = out.row_mut(y + p);
                    for i in 0..M {
                        let at = (n * PANEL + m + i) * LANES;
                        (sums[p][i] * shares[p]).store_slice(&mut row[at..at + LANES]);
                    }
                }
            }
        }
    }
}
