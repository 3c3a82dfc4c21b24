//! The weights of the networks that are built in: read from the ONNX files of their authors, written as plain numbers.
//!
//! The order of the layers is that of the graphs; what each does stands in `crates/inference/src`.

use crate::run;
use anyhow::{Context, Result, bail, ensure};
use prost::Message;
use safetensors::tensor::{Dtype, TensorView};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::Path;

mod networks;

/// A network of which the project has the weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Network {
    /// NanoTrack v3
    Nanotrack,
    /// LightFC
    Lightfc,
    /// VitTrack
    Vittrack,
}

/// How weights are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coding {
    /// In half precision, to nearest, ties to even.
    Half,
    /// In eight bits with a scale a filter, biases in single precision; refused unless that loses less than a ten-thousandth of a step.
    EightBits,
    /// As they are.
    Single,
}

/// A file of the release.
struct Source {
    file: &'static str,
    sha256: &'static str,
    tensors: Names,
}

/// What the numbers of a file are called with us.
enum Names {
    /// Those of the layers that have weights, in the order of the graph: a part and the layers.
    InOrder(&'static str, &'static [&'static str]),
    /// Name in the file, our name; a matrix in input, output order is turned where the flag says so.
    ByName(&'static [(&'static str, &'static str, bool)]),
}

/// Writes the weights, or, with `check`, compares what would be written with what is there.
pub fn make(network: Network, folder: &Path, check: bool) -> Result<()> {
    let (sources, coding, path) = network.release();
    let mut tensors = Vec::new();
    for Source { file, sha256, tensors: names } in sources {
        let path = folder.join(file);
        let bytes = std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        ensure!(hex(&bytes) == *sha256, "{} is not the released file: its SHA-256 is {}", path.display(), hex(&bytes));
        tensors.extend(read(&bytes, names, coding)?);
    }
    let views = tensors
        .iter()
        .map(|t| Ok((t.name.as_str(), TensorView::new(t.dtype, t.shape.clone(), &t.bytes)?)))
        .collect::<Result<Vec<_>>>()?;
    let bytes = safetensors::serialize(views, None)?;
    let target = run::root().join(path);
    if check {
        ensure!(std::fs::read(&target)? == bytes, "{path} differs from what these files give");
    } else {
        std::fs::write(&target, &bytes)?;
    }
    println!("{path}: {} tensors, {} bytes, SHA-256 {}", tensors.len(), bytes.len(), hex(&bytes));
    Ok(())
}

struct Tensor {
    name: String,
    shape: Vec<usize>,
    dtype: Dtype,
    /// Little-endian.
    bytes: Vec<u8>,
}

impl Tensor {
    fn single(name: String, shape: Vec<usize>, numbers: &[f32]) -> Self {
        Self { name, shape, dtype: Dtype::F32, bytes: numbers.iter().flat_map(|n| n.to_le_bytes()).collect() }
    }
}

/// The numbers of a file, under our names.
fn read(onnx: &[u8], names: &Names, coding: Coding) -> Result<Vec<Tensor>> {
    let graph = Model::decode(onnx)?.graph.context("an ONNX file without a graph")?;
    let numbers: HashMap<&str, &Initializer> = graph.initializers.iter().map(|i| (i.name.as_str(), i)).collect();
    let called = |name: &str| numbers.get(name).with_context(|| format!("no numbers called `{name}`"));
    let mut tensors = Vec::new();
    match names {
        Names::InOrder(part, layers) => {
            let weighty: Vec<&Node> = graph
                .nodes
                .iter()
                .filter(|n| ["Conv", "Gemm"].contains(&n.op_type.as_str()))
                .filter(|n| n.inputs.get(1).is_some_and(|w| numbers.contains_key(w.as_str())))
                .collect();
            ensure!(weighty.len() == layers.len(), "{} layers with weights instead of {}", weighty.len(), layers.len());
            for (node, layer) in weighty.iter().zip(*layers) {
                for (input, what) in node.inputs[1..].iter().zip(["weight", "bias"]) {
                    let (shape, numbers) = called(input)?.numbers()?;
                    tensors.extend(coded(format!("{part}.{layer}.{what}"), shape, &numbers, coding)?);
                }
            }
        }
        Names::ByName(pairs) => {
            for &(theirs, ours, is_turned) in *pairs {
                let (mut shape, mut numbers) = called(theirs)?.numbers()?;
                if shape.first() == Some(&1) && shape.len() == 3 {
                    shape.remove(0);
                }
                if is_turned {
                    let [rows, columns] = shape[..] else { bail!("`{theirs}` is no matrix") };
                    numbers = (0..rows * columns).map(|i| numbers[i % rows * columns + i / rows]).collect();
                    shape.reverse();
                }
                tensors.extend(coded(ours.to_owned(), shape, &numbers, coding)?);
            }
        }
    }
    Ok(tensors)
}

/// The numbers as they are written: one tensor, or one and its scales.
fn coded(name: String, shape: Vec<usize>, numbers: &[f32], coding: Coding) -> Result<Vec<Tensor>> {
    match coding {
        Coding::Half => {
            let halves: Vec<half::f16> = numbers.iter().map(|&n| half::f16::from_f32(n)).collect();
            ensure!(halves.iter().all(|h| h.is_finite()), "`{name}` has a number beyond half precision");
            let bytes = halves.iter().flat_map(|h| h.to_le_bytes()).collect();
            Ok(vec![Tensor { name, shape, dtype: Dtype::F16, bytes }])
        }
        Coding::EightBits if name.ends_with(".weight") => {
            let filters = numbers.chunks_exact(numbers.len() / shape[0]);
            let steps = filters.map(|filter| eight_bits(filter).with_context(|| format!("`{name}` is on no grid")));
            let steps = steps.collect::<Result<Vec<_>>>()?;
            let scales: Vec<f32> = steps.iter().map(|s| s.0).collect();
            let scale = Tensor::single(name.replace(".weight", ".scale"), vec![shape[0]], &scales);
            let bytes = steps.iter().flat_map(|s| s.1.iter().map(|q| q.cast_unsigned())).collect();
            Ok(vec![Tensor { name, shape, dtype: Dtype::I8, bytes }, scale])
        }
        Coding::EightBits | Coding::Single => Ok(vec![Tensor::single(name, shape, numbers)]),
    }
}

/// The scale and the steps of a filter whose numbers lie on a symmetric grid of at most 127 steps.
fn eight_bits(filter: &[f32]) -> Option<(f32, Vec<i8>)> {
    let most = filter.iter().fold(0.0f64, |m, &w| m.max(f64::from(w).abs()));
    if most == 0.0 {
        return Some((0.0, vec![0; filter.len()]));
    }
    (1..=127).rev().find_map(|steps| {
        let scale = most / f64::from(steps);
        let on_grid = |&w: &f32| {
            let q = f64::from(w) / scale;
            ((q - q.round()).abs() < 1e-4).then_some(q.round() as i8)
        };
        Some((scale as f32, filter.iter().map(on_grid).collect::<Option<_>>()?))
    })
}

fn hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// The few fields of an ONNX file that are needed here (onnx.proto of ONNX 1.7 and later).
#[derive(Message)]
struct Model {
    #[prost(message, optional, tag = "7")]
    graph: Option<Graph>,
}

#[derive(Message)]
struct Graph {
    #[prost(message, repeated, tag = "1")]
    nodes: Vec<Node>,
    #[prost(message, repeated, tag = "5")]
    initializers: Vec<Initializer>,
}

#[derive(Message)]
struct Node {
    #[prost(string, repeated, tag = "1")]
    inputs: Vec<String>,
    #[prost(string, tag = "4")]
    op_type: String,
}

#[derive(Message)]
struct Initializer {
    #[prost(int64, repeated, tag = "1")]
    dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    data_type: i32,
    #[prost(float, repeated, tag = "4")]
    float_data: Vec<f32>,
    #[prost(string, tag = "8")]
    name: String,
    #[prost(bytes = "vec", tag = "9")]
    raw_data: Vec<u8>,
}

impl Initializer {
    /// Shape and numbers.
    fn numbers(&self) -> Result<(Vec<usize>, Vec<f32>)> {
        let name = &self.name;
        let shape = self.dims.iter().map(|&d| usize::try_from(d)).collect::<Result<Vec<_>, _>>()?;
        ensure!(self.data_type == 1, "`{name}` is not in single precision");
        let numbers: Vec<f32> = match self.float_data.is_empty() {
            true => self.raw_data.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
            false => self.float_data.clone(),
        };
        ensure!(numbers.len() == shape.iter().product::<usize>(), "`{name}` has not as many numbers as its shape");
        Ok((shape, numbers))
    }
}
