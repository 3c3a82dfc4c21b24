use super::{LANES, hard_sigmoid};

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
