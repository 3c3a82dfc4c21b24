//! Tensors by name from the safetensors files of the networks that are built in.

use crate::{InferenceError, Result};
use half::f16;
use half::slice::HalfFloatSliceExt;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};

/// An opened file of weights: in single or half precision, or whole numbers of eight bits with a scale an output (`NAME.scale`).
pub struct Weights<'a> {
    /// What errors call the network.
    network: &'static str,
    tensors: SafeTensors<'a>,
}

impl<'a> Weights<'a> {
    /// From the bytes of a safetensors file.
    pub fn read(network: &'static str, bytes: &'a [u8]) -> Result<Self> {
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| broken(network, &e.to_string()))?;
        Ok(Self { network, tensors })
    }

    /// The numbers called `NAME.weight`, whose shape must be `shape`, and as many called `NAME.bias` as it has outputs.
    pub fn layer(&self, name: &str, shape: &[usize]) -> Result<Layer> {
        let mut weights = self.numbers(&format!("{name}.weight"), shape)?;
        if self.tensors.tensor(&format!("{name}.weight")).is_ok_and(|t| t.dtype() == Dtype::I8) {
            let scales = self.numbers(&format!("{name}.scale"), &shape[..1])?;
            let of_output = weights.len() / scales.len().max(1);
            for (filter, scale) in weights.chunks_exact_mut(of_output.max(1)).zip(scales) {
                filter.iter_mut().for_each(|w| *w *= scale);
            }
        }
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

    /// As [`layer`](Self::layer), for a full convolution of 3 × 3.
    pub fn convolution(&self, name: &str, inputs: usize, outputs: usize) -> Result<Layer> {
        self.layer(name, &[outputs, inputs, 3, 3])
    }

    /// The numbers called `name`, whose shape must be `shape`; those of eight bits as they are.
    pub fn numbers(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>> {
        let tensor = self.tensors.tensor(name).map_err(|e| self.broken(&e.to_string()))?;
        let (dtype, found) = (tensor.dtype(), tensor.shape());
        match decoded(&tensor) {
            Some(numbers) if found == shape => Ok(numbers),
            _ => Err(self.broken(&format!("`{name}` is {dtype:?} of shape {found:?} instead of numbers of {shape:?}"))),
        }
    }

    fn broken(&self, why: &str) -> InferenceError {
        broken(self.network, why)
    }
}

/// The numbers of a tensor in one of the forms that are used here.
fn decoded(tensor: &TensorView<'_>) -> Option<Vec<f32>> {
    let data = tensor.data();
    match tensor.dtype() {
        Dtype::F32 => Some(data.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect()),
        Dtype::F16 => {
            let halves: Vec<f16> = data.as_chunks::<2>().0.iter().map(|&b| f16::from_le_bytes(b)).collect();
            let mut numbers = vec![0.0; halves.len()];
            halves.convert_to_f32_slice(&mut numbers);
            Some(numbers)
        }
        Dtype::I8 => Some(data.iter().map(|b| f32::from(b.cast_signed())).collect()),
        _ => None,
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

    /// W x + b of one pixel.
    pub fn apply(&self, x: &[f32], out: &mut [f32]) {
        for ((out, row), bias) in out.iter_mut().zip(self.weights.chunks_exact(self.inputs())).zip(&self.bias) {
            *out = row.iter().zip(x).map(|(w, x)| w * x).sum::<f32>() + bias;
        }
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

fn broken(network: &str, why: &str) -> InferenceError {
    InferenceError::Model {
        what: network.into(),
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

    /// Two filters of two inputs in eight bits.
    fn eight_bits() -> Vec<u8> {
        let (scales, bias) = ([0.5f32, 0.25].map(f32::to_le_bytes), [1.0f32, -1.0].map(f32::to_le_bytes));
        let view = |dtype, shape: &[usize], data| TensorView::new(dtype, shape.to_vec(), data).unwrap();
        let tensors = [
            ("mix.weight", view(Dtype::I8, &[2, 2, 1, 1], &[1, 254, 127, 0])),
            ("mix.scale", view(Dtype::F32, &[2], scales.as_flattened())),
            ("mix.bias", view(Dtype::F32, &[2], bias.as_flattened())),
        ];
        safetensors::serialize(tensors, None).unwrap()
    }

    #[test]
    fn eight_bits_are_scaled_filter_by_filter() {
        let bytes = eight_bits();
        let layer = Weights::read("net", &bytes).unwrap().pointwise("mix", 2, 2).unwrap();
        assert_eq!((layer.weights, layer.bias), (vec![0.5, -1.0, 31.75, 0.0], vec![1.0, -1.0]));
    }

    #[test]
    fn weights_that_are_not_what_the_layers_need_are_refused() {
        let bytes = eight_bits();
        let weights = Weights::read("net", &bytes).unwrap();
        let wrong = weights.layer("mix", &[2, 3, 1, 1]).unwrap_err().to_string();
        assert!(wrong.contains("mix.weight") && wrong.contains("xtask weights"), "{wrong}");
        assert!(weights.layer("stir", &[2, 2, 1, 1]).is_err());
        let damaged = [&bytes[..bytes.len() - 1], &bytes[..100], b"", &[0xff; 40]];
        assert!(damaged.iter().all(|bytes| Weights::read("net", bytes).is_err()));
    }
}
