use super::{LANES, Map, hard_sigmoid};
use crate::weights::Layer;

/// Squeeze and excite (Hu et al. 2018, eq. 2–3, with the hard sigmoid of MobileNet v3): a factor for each channel from
/// the means of all channels.
#[derive(Debug, Clone)]
pub struct SqueezeExcite {
    /// Hidden unit, channel.
    squeeze: Vec<f32>,
    squeeze_bias: Vec<f32>,
    /// Hidden unit, channel: the transpose of what a fully connected layer stores.
    excite: Vec<f32>,
    excite_bias: Vec<f32>,
    means: Vec<f32>,
    factors: Vec<f32>,
}

impl SqueezeExcite {
    /// From the weights of two fully connected layers, each in output, input order.
    pub fn new(squeeze: &[f32], squeeze_bias: &[f32], excite: &[f32], excite_bias: &[f32]) -> Self {
        let (hidden, channels) = (squeeze_bias.len(), excite_bias.len());
        let transposed = (0..hidden * channels).map(|i| excite[i % channels * hidden + i / channels]).collect();
        Self {
            squeeze: squeeze.to_vec(),
            squeeze_bias: squeeze_bias.to_vec(),
            excite: transposed,
            excite_bias: excite_bias.to_vec(),
            means: vec![0.0; channels],
            factors: vec![0.0; channels],
        }
    }

    /// The factors, given sixteen sums a channel of which the first `columns` count, over `pixels` pixels.
    pub fn factors(&mut self, sums: &[f32], columns: usize, pixels: usize) -> &[f32] {
        let channels = self.means.len();
        for (mean, sums) in self.means.iter_mut().zip(sums.as_chunks::<LANES>().0) {
            *mean = sums[..columns.min(LANES)].iter().sum::<f32>() / pixels as f32;
        }
        self.factors.copy_from_slice(&self.excite_bias);
        let layers = self.squeeze.chunks_exact(channels).zip(self.excite.chunks_exact(channels));
        for ((into, out_of), bias) in layers.zip(&self.squeeze_bias) {
            let hidden = (dot(into, &self.means) + bias).max(0.0);
            self.factors.iter_mut().zip(out_of).for_each(|(f, w)| *f += w * hidden);
        }
        self.factors.iter_mut().for_each(|f| *f = hard_sigmoid(*f));
        &self.factors
    }
}

/// Σ a · b in eight interleaved sums, so that it vectorises.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        (0..8).for_each(|j| sums[j] += a[j] * b[j]);
    }
    sums.iter().sum::<f32>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f32>()
}

/// Factors for channels from their means by two layers and a sigmoid (Hu et al. 2018, eq. 2 to 4).
#[derive(Debug, Clone)]
pub struct Excitation {
    squeeze: Layer,
    excite: Layer,
    means: Vec<f32>,
    hidden: Vec<f32>,
    factors: Vec<f32>,
}

impl Excitation {
    /// By these two layers.
    pub fn new(squeeze: Layer, excite: Layer) -> Self {
        let (channels, hidden) = (excite.bias.len(), squeeze.bias.len());
        let zeros = |count: usize| vec![0.0; count];
        Self { means: zeros(channels), hidden: zeros(hidden), factors: zeros(channels), squeeze, excite }
    }

    /// σ(W₂ max(0, W₁ m + b₁) + b₂), where the means m are those of what `layer` makes of the channels, whose own means are
    /// `means`.
    pub fn factors_of(&mut self, layer: &Layer, means: &[f32]) -> &[f32] {
        layer.apply(means, &mut self.means);
        self.excite()
    }

    /// The same for a dense map of whole sixteens.
    pub fn factors(&mut self, map: &Map) -> &[f32] {
        means(map, &mut self.means);
        self.excite()
    }

    fn excite(&mut self) -> &[f32] {
        self.squeeze.apply(&self.means, &mut self.hidden);
        self.hidden.iter_mut().for_each(|h| *h = h.max(0.0));
        self.excite.apply(&self.hidden, &mut self.factors);
        self.factors.iter_mut().for_each(|f| *f = 1.0 / (1.0 + (-*f).exp()));
        &self.factors
    }
}

/// The mean of each channel of a dense map of whole sixteens.
pub fn means(map: &Map, means: &mut [f32]) {
    let pixels = (map.width * map.height) as f32;
    means.fill(0.0);
    for y in 0..map.height {
        for (mean, columns) in means.iter_mut().zip(map.row(y).chunks_exact(map.pitch)) {
            *mean += columns.iter().sum::<f32>();
        }
    }
    means.iter_mut().for_each(|m| *m /= pixels);
}
