//! Tensors by name from a safetensors file in half precision.

use crate::{InferenceError, Result};
use half::f16;
use half::slice::HalfFloatSliceExt;
use safetensors::{Dtype, SafeTensors};

/// The weights of NanoTrack v3 (Apache-2.0; `weights/nanotrack_v3/ORIGIN.md`).
const NANOTRACK_V3: &[u8] = include_bytes!("../../weights/nanotrack_v3/nanotrack_v3.safetensors");
const NAME: &str = "nanotrack-v3";

/// An opened file of weights.
pub struct Weights<'a> {
    tensors: SafeTensors<'a>,
}

impl Weights<'static> {
    /// Those built in.
    pub fn nanotrack_v3() -> Result<Self> {
        Weights::read(NANOTRACK_V3)
    }
}

impl<'a> Weights<'a> {
    /// From the bytes of a safetensors file.
    pub fn read(bytes: &'a [u8]) -> Result<Self> {
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| broken(&e.to_string()))?;
        Ok(Self { tensors })
    }

    /// The numbers called `NAME.weight`, whose shape must be `shape`, and as many called `NAME.bias` as it has outputs.
    pub fn layer(&self, name: &str, shape: &[usize]) -> Result<Layer> {
        let weights = self.numbers(&format!("{name}.weight"), shape)?;
        let bias = self.numbers(&format!("{name}.bias"), &shape[..1])?;
        Ok(Layer { weights, bias })
    }

    /// As [`layer`](Self::layer), for a pointwise convolution.
    pub fn pointwise(&self, name: &str, inputs: usize, outputs: usize) -> Result<Layer> {
        self.layer(name, &[outputs, inputs, 1, 1])
    }

    /// As [`layer`](Self::layer), for a depthwise convolution of `side` × `side`.
    pub fn depthwise(&self, name: &str, channels: usize, side: usize) -> Result<Layer> {
        self.layer(name, &[channels, 1, side, side])
    }

    fn numbers(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>> {
        let tensor = self.tensors.tensor(name).map_err(|e| broken(&e.to_string()))?;
        if tensor.dtype() != Dtype::F16 || tensor.shape() != shape {
            let (dtype, found) = (tensor.dtype(), tensor.shape());
            return Err(broken(&format!("`{name}` is {dtype:?} of shape {found:?} instead of F16 of {shape:?}")));
        }
        let halves: Vec<f16> = tensor.data().as_chunks::<2>().0.iter().map(|&b| f16::from_le_bytes(b)).collect();
        let mut numbers = vec![0.0; halves.len()];
        halves.convert_to_f32_slice(&mut numbers);
        Ok(numbers)
    }
}

/// Weights and bias of one layer, outputs first.
#[derive(Debug, Clone)]
pub struct Layer {
    pub weights: Vec<f32>,
    pub bias: Vec<f32>,
}

impl Layer {
    /// Inputs of a pointwise layer.
    pub fn inputs(&self) -> usize {
        self.weights.len() / self.bias.len()
    }

    /// The layer that does what `self` and then `next` do, with nothing between them: W = W₂W₁, b = W₂b₁ + b₂.
    ///
    /// Sums are made in double precision, so that the product is as good as its factors.
    pub fn then(&self, next: &Self) -> Self {
        let (inputs, middle, outputs) = (self.inputs(), self.bias.len(), next.bias.len());
        let mut weights = Vec::with_capacity(outputs * inputs);
        let mut bias = Vec::with_capacity(outputs);
        for o in 0..outputs {
            let row = &next.weights[o * middle..(o + 1) * middle];
            let sum = |of: &dyn Fn(usize) -> f32| -> f64 {
                row.iter().enumerate().map(|(m, &w)| f64::from(w) * f64::from(of(m))).sum()
            };
            weights.extend((0..inputs).map(|i| sum(&|m| self.weights[m * inputs + i]) as f32));
            bias.push((sum(&|m| self.bias[m]) + f64::from(next.bias[o])) as f32);
        }
        Self { weights, bias }
    }

    /// A pointwise layer's part over inputs `from..to`, with its bias.
    pub fn columns(&self, from: usize, to: usize) -> Self {
        let weights = self.weights.chunks_exact(self.inputs()).flat_map(|row| &row[from..to]).copied().collect();
        Self { weights, bias: self.bias.clone() }
    }

    /// Two pointwise layers over two inputs, added: one over their concatenation.
    pub fn beside(&self, other: &Self) -> Self {
        let rows = self.weights.chunks_exact(self.inputs()).zip(other.weights.chunks_exact(other.inputs()));
        let weights = rows.flat_map(|(a, b)| a.iter().chain(b)).copied().collect();
        Self { weights, bias: self.bias.iter().zip(&other.bias).map(|(a, b)| a + b).collect() }
    }

    /// The same weights without bias.
    pub fn unbiased(mut self) -> Self {
        self.bias.fill(0.0);
        self
    }
}

fn broken(why: &str) -> InferenceError {
    InferenceError::Model {
        what: NAME.into(),
        why: why.into(),
        mend: "make its weights again with `cargo xtask weights`".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(weights: &[f32], bias: &[f32]) -> Layer {
        Layer { weights: weights.to_vec(), bias: bias.to_vec() }
    }

    fn applied(layer: &Layer, x: &[f32]) -> Vec<f32> {
        let rows = layer.weights.chunks_exact(layer.inputs()).zip(&layer.bias);
        rows.map(|(row, b)| row.iter().zip(x).map(|(w, x)| w * x).sum::<f32>() + b).collect()
    }

    #[test]
    fn merged_layers_do_what_their_parts_do() {
        let first = layer(&[1.0, 2.0, -3.0, 4.0, 5.0, 0.5], &[0.5, -1.0]); // 3 to 2
        let second = layer(&[2.0, -1.0, 0.0, 3.0, 1.0, 1.0, 4.0, -2.0], &[1.0, 2.0, 3.0, 4.0]); // 2 to 4
        let x = [3.0, -1.0, 2.0];
        assert_eq!(applied(&first.then(&second), &x), applied(&second, &applied(&first, &x)));

        let both = [3.0, -1.0, 2.0, 7.0, -5.0];
        let other = layer(&[1.0, -1.0, 6.0, 2.0], &[10.0, 20.0]); // 2 to 2
        let joined = first.beside(&other);
        let sums: Vec<f32> = applied(&first, &x).iter().zip(applied(&other, &both[3..])).map(|(a, b)| a + b).collect();
        assert_eq!(applied(&joined, &both), sums);
        let part = joined.columns(3, 5).unbiased();
        assert_eq!((part.weights.as_slice(), part.bias.as_slice()), (&other.weights[..], &[0.0; 2][..]));
    }

    #[test]
    fn weights_that_are_not_what_the_layers_need_are_refused() {
        let weights = Weights::nanotrack_v3().unwrap();
        let stem = weights.layer("backbone.stem", &[16, 3, 3, 3]).unwrap();
        assert_eq!((stem.weights.len(), stem.bias.len()), (432, 16));
        let wrong = weights.layer("backbone.stem", &[16, 3, 5, 5]).unwrap_err().to_string();
        assert!(wrong.contains("backbone.stem.weight") && wrong.contains("xtask weights"), "{wrong}");
        assert!(weights.layer("backbone.trunk", &[16, 3, 3, 3]).is_err());
        let damaged = [&NANOTRACK_V3[..NANOTRACK_V3.len() - 1], &NANOTRACK_V3[..100], b"", &[0xff; 40]];
        assert!(damaged.iter().all(|bytes| Weights::read(bytes).is_err()));
    }
}
