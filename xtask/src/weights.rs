//! The weights of our default network: read from the ONNX files of NanoTrack v3, written as plain numbers.
//!
//! The order of the layers is that of the two graphs; what each does stands in `crates/inference/src/nanotrack`.

use crate::run;
use anyhow::{Context, Result, bail, ensure};
use prost::Message;
use safetensors::tensor::{Dtype, TensorView};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::Path;

/// File, SHA-256 of the release (HonglinChu/SiamTrackers, commit 248663f, `NanoTrack/models/nanotrackv3`), layers.
const SOURCES: [(&str, &str, &str, &[&str]); 2] = [
    (
        "nanotrack_backbone.onnx",
        "50be1320abf9384fd3479ea829f95e244cf3f3838190c5ab60c750fb8c1ce828",
        "backbone",
        &[
            "stem",
            "1.depthwise",
            "1.squeeze",
            "1.excite",
            "1.project",
            "2.expand",
            "2.depthwise",
            "2.project",
            "3.expand",
            "3.depthwise",
            "3.project",
            "4.expand",
            "4.depthwise",
            "4.squeeze",
            "4.excite",
            "4.project",
            "5.expand",
            "5.depthwise",
            "5.squeeze",
            "5.excite",
            "5.project",
            "6.expand",
            "6.depthwise",
            "6.squeeze",
            "6.excite",
            "6.project",
            "7.expand",
            "7.depthwise",
            "7.squeeze",
            "7.excite",
            "7.project",
            "8.expand",
            "8.depthwise",
            "8.squeeze",
            "8.excite",
            "8.project",
            "9.expand",
            "9.depthwise",
            "9.squeeze",
            "9.excite",
            "9.project",
        ],
    ),
    (
        "nanotrack_head.onnx",
        "75357903be3f4817c965af16cb5a11fd32b1467f597a408405a98635ac63f61d",
        "head",
        &[
            "box.pixelwise.template",
            "box.pixelwise.search",
            "box.pixelwise.squeeze",
            "box.pixelwise.excite",
            "box.pixelwise.depthwise",
            "box.pixelwise.mix",
            "score.pixelwise.template",
            "score.pixelwise.search",
            "score.pixelwise.squeeze",
            "score.pixelwise.excite",
            "score.pixelwise.depthwise",
            "score.pixelwise.mix",
            "box.correlation.template",
            "box.correlation.search",
            "score.correlation.template",
            "score.correlation.search",
            "box.reduce",
            "score.reduce",
            "score.tower.0.depthwise",
            "score.tower.0.pointwise",
            "score.tower.1.depthwise",
            "score.tower.1.pointwise",
            "score.tower.2.depthwise",
            "score.tower.2.pointwise",
            "score.tower.3.depthwise",
            "score.tower.3.pointwise",
            "score.tower.4.depthwise",
            "score.tower.4.pointwise",
            "score.tower.5.depthwise",
            "score.tower.5.pointwise",
            "score.output",
            "box.tower.0.depthwise",
            "box.tower.0.pointwise",
            "box.tower.1.depthwise",
            "box.tower.1.pointwise",
            "box.tower.2.depthwise",
            "box.tower.2.pointwise",
            "box.tower.3.depthwise",
            "box.tower.3.pointwise",
            "box.tower.4.depthwise",
            "box.tower.4.pointwise",
            "box.tower.5.depthwise",
            "box.tower.5.pointwise",
            "box.output",
        ],
    ),
];

const TARGET: &str = "crates/inference/weights/nanotrack_v3/nanotrack_v3.safetensors";

/// Writes the weights, or, with `check`, compares what would be written with what is there.
pub fn make(folder: &Path, check: bool) -> Result<()> {
    let mut tensors = Vec::new();
    for (file, sha256, part, layers) in SOURCES {
        let path = folder.join(file);
        let bytes = std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        ensure!(hex(&bytes) == sha256, "{} is not the released file: its SHA-256 is {}", path.display(), hex(&bytes));
        tensors.extend(read(&bytes, part, layers)?);
    }
    let views = tensors
        .iter()
        .map(|t| Ok((t.name.as_str(), TensorView::new(Dtype::F16, t.shape.clone(), &t.bytes)?)))
        .collect::<Result<Vec<_>>>()?;
    let bytes = safetensors::serialize(views, None)?;
    let target = run::root().join(TARGET);
    if check {
        ensure!(std::fs::read(&target)? == bytes, "{TARGET} differs from what these files give");
    } else {
        std::fs::write(&target, &bytes)?;
    }
    println!("{TARGET}: {} tensors, {} bytes, SHA-256 {}", tensors.len(), bytes.len(), hex(&bytes));
    Ok(())
}

struct Tensor {
    name: String,
    shape: Vec<usize>,
    /// Half precision, little-endian.
    bytes: Vec<u8>,
}

/// Weights and biases of the layers that have any, under our names.
fn read(onnx: &[u8], part: &str, layers: &[&str]) -> Result<Vec<Tensor>> {
    let graph = Model::decode(onnx)?.graph.context("an ONNX file without a graph")?;
    let numbers: HashMap<&str, &Initializer> = graph.initializers.iter().map(|i| (i.name.as_str(), i)).collect();
    let weighty: Vec<&Node> = graph
        .nodes
        .iter()
        .filter(|n| ["Conv", "Gemm"].contains(&n.op_type.as_str()))
        .filter(|n| n.inputs.get(1).is_some_and(|w| numbers.contains_key(w.as_str())))
        .collect();
    ensure!(weighty.len() == layers.len(), "{} layers with weights instead of {}", weighty.len(), layers.len());
    let mut tensors = Vec::new();
    for (node, layer) in weighty.iter().zip(layers) {
        for (input, what) in node.inputs[1..].iter().zip(["weight", "bias"]) {
            let from = numbers.get(input.as_str()).with_context(|| format!("no numbers called `{input}`"))?;
            tensors.push(halved(from, format!("{part}.{layer}.{what}"))?);
        }
    }
    Ok(tensors)
}

/// The numbers rounded to half precision, to nearest, ties to even.
fn halved(from: &Initializer, name: String) -> Result<Tensor> {
    let shape = from.dims.iter().map(|&d| usize::try_from(d)).collect::<Result<Vec<_>, _>>()?;
    ensure!(from.data_type == 1, "`{name}` is not in single precision");
    let (numbers, rest) = from.raw_data.as_chunks::<4>();
    ensure!(
        rest.is_empty() && numbers.len() == shape.iter().product::<usize>(),
        "`{name}` has not as many numbers as its shape"
    );
    let mut bytes = Vec::with_capacity(2 * numbers.len());
    for &number in numbers {
        let half = half::f16::from_f32(f32::from_le_bytes(number));
        if !half.is_finite() {
            bail!("`{name}` has a number beyond half precision");
        }
        bytes.extend_from_slice(&half.to_le_bytes());
    }
    Ok(Tensor { name, shape, bytes })
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
    #[prost(string, tag = "8")]
    name: String,
    #[prost(bytes = "vec", tag = "9")]
    raw_data: Vec<u8>,
}
