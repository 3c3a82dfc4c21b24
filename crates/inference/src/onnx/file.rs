//! What is asked of a file before a library sees it, and the few changes made to it.

use super::OnnxOptions;
use crate::{InferenceError, Port, Result};
use prost::Message;
use std::io::Read;
use std::path::Path;

/// Operators that make, of inputs of bounded size, outputs of bounded size in bounded time.
const OPERATORS: &[&str] = &[
    "Abs",
    "Add",
    "ArgMax",
    "AveragePool",
    "BatchNormalization",
    "Cast",
    "Ceil",
    "Clip",
    "Concat",
    "Constant",
    "Conv",
    "ConvTranspose",
    "DepthToSpace",
    "Div",
    "Dropout",
    "Elu",
    "Equal",
    "Erf",
    "Exp",
    "Flatten",
    "Floor",
    "Gather",
    "Gelu",
    "Gemm",
    "GlobalAveragePool",
    "GlobalMaxPool",
    "Greater",
    "HardSigmoid",
    "HardSwish",
    "Identity",
    "InstanceNormalization",
    "LayerNormalization",
    "LeakyRelu",
    "Less",
    "Log",
    "LogSoftmax",
    "MatMul",
    "Max",
    "MaxPool",
    "Mean",
    "Min",
    "Mish",
    "Mul",
    "Neg",
    "PRelu",
    "Pad",
    "Pow",
    "Reciprocal",
    "ReduceMax",
    "ReduceMean",
    "ReduceMin",
    "ReduceSum",
    "Relu",
    "Reshape",
    "Resize",
    "Selu",
    "Shape",
    "Sigmoid",
    "Slice",
    "Softmax",
    "Softplus",
    "SpaceToDepth",
    "Split",
    "Sqrt",
    "Squeeze",
    "Sub",
    "Sum",
    "Tanh",
    "TopK",
    "Transpose",
    "Unsqueeze",
    "Upsample",
    "Where",
];
/// Attributes that enlarge: strides shrink and are harmless.
const ENLARGING: &[&str] = &["pads", "output_padding", "output_shape", "dilations", "kernel_shape", "blocksize"];
/// Operators whose constant inputs may enlarge.
const ENLARGING_INPUTS: &[&str] = &["Pad", "Resize", "Upsample"];
/// The most that padding, kernels and resizing may be.
const MOST: i64 = 4096;
const MAX_NODES: usize = 20_000;
const FLOAT: i32 = 1;
const INT64: i32 = 7;
const EXTERNAL: i32 = 1;

/// A file that has been looked through.
#[derive(Debug)]
pub struct Model {
    /// What it is called in messages: the file's name.
    pub name: String,
    pub inputs: Vec<Port>,
    pub outputs: Vec<String>,
    /// The file, with the shapes that were asked for.
    pub bytes: Vec<u8>,
    pub max_len: u64,
}

impl Model {
    pub fn read(path: &Path, options: &OnnxOptions) -> Result<Self> {
        let unread = |source| InferenceError::Read { path: path.to_owned(), source };
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(unread)?;
        file.take(options.max_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(unread)?;
        let name = path.file_name().map_or_else(|| path.to_string_lossy(), |n| n.to_string_lossy()).into_owned();
        Self::parse(name, &bytes, options)
    }

    /// From the bytes of a file.
    pub fn parse(name: String, bytes: &[u8], options: &OnnxOptions) -> Result<Self> {
        let wrong = |why: String, mend: &str| InferenceError::Model { what: name.clone(), why, mend: mend.into() };
        if bytes.len() as u64 > options.max_bytes {
            let why = format!("it has more than {} bytes", options.max_bytes);
            return Err(wrong(why, "raise the limit if it is meant to be that large"));
        }
        let damaged = "get the file again: it is damaged or no ONNX file";
        let proto = ModelProto::decode(bytes).map_err(|e| wrong(e.to_string(), damaged))?;
        let graph = proto.graph.ok_or_else(|| wrong("it has no graph".into(), damaged))?;
        if graph.outputs.is_empty() || graph.nodes.is_empty() {
            return Err(wrong("its graph computes nothing".into(), damaged));
        }
        check_graph(&graph, options.max_bytes).map_err(|(why, mend)| wrong(why, mend))?;
        let inputs = inputs(&graph, options).map_err(|(why, mend)| wrong(why, mend))?;
        if let Some((unknown, _)) = options.shapes.iter().find(|(n, _)| inputs.iter().all(|p| p.name != *n)) {
            let names: Vec<&str> = inputs.iter().map(|p| p.name.as_str()).collect();
            return Err(wrong(format!("it has no input `{unknown}`"), &format!("name one of {}", names.join(", "))));
        }
        let outputs = graph.outputs.iter().map(|o| o.name.clone()).collect();
        let bytes = reshaped(bytes, &inputs).ok_or_else(|| wrong("its fields break off".into(), damaged))?;
        Ok(Self { inputs, outputs, bytes, max_len: options.max_bytes / 4, name })
    }

    /// What a library said against it.
    #[cfg(any(feature = "onnxruntime", feature = "rten"))]
    pub fn refused(&self, library: &str, why: &impl std::fmt::Display) -> InferenceError {
        InferenceError::Model {
            what: self.name.clone(),
            why: format!("{library} refuses it: {why}"),
            mend: "export it again with operators of ONNX opset 17 or older, or try the other library".into(),
        }
    }

    /// The ports of outputs whose shapes a first run has shown.
    #[cfg(any(feature = "onnxruntime", feature = "rten"))]
    pub fn output_ports(&self, shapes: Vec<Vec<usize>>) -> Result<Vec<Port>> {
        let ports: Vec<Port> =
            self.outputs.iter().cloned().zip(shapes).map(|(name, shape)| Port { name, shape }).collect();
        match ports.iter().find(|p| p.len() as u64 > self.max_len) {
            None => Ok(ports),
            Some(port) => Err(InferenceError::Model {
                what: self.name.clone(),
                why: format!("its output `{}` is {:?} large", port.name, port.shape),
                mend: "give it smaller inputs or raise the limit".into(),
            }),
        }
    }
}

type Wrong = (String, &'static str);

fn check_graph(graph: &Graph, max_bytes: u64) -> Result<(), Wrong> {
    if graph.nodes.len() > MAX_NODES {
        return Err((format!("it has {} layers", graph.nodes.len()), "use a smaller network"));
    }
    for tensor in &graph.initializers {
        check_tensor(tensor, max_bytes)?;
    }
    for node in &graph.nodes {
        let known = node.domain.is_empty() || node.domain == "ai.onnx";
        if !known || !OPERATORS.contains(&node.op_type.as_str()) {
            let domain = if known { String::new() } else { format!("{}.", node.domain) };
            return Err((
                format!("it uses the operator `{domain}{}`", node.op_type),
                "export it with plain layers only: no loops, branches, custom or generating operators",
            ));
        }
        for attribute in &node.attributes {
            if let Some(tensor) = &attribute.tensor {
                check_tensor(tensor, max_bytes)?;
            }
            let values = attribute.ints.iter().chain([&attribute.int]);
            if ENLARGING.contains(&attribute.name.as_str()) && values.clone().any(|v| v.abs() > MOST) {
                return Err(enlarges(node));
            }
            if attribute.floats.iter().any(|&f| !(f.abs() <= MOST as f32)) && attribute.name == "scales" {
                return Err(enlarges(node));
            }
        }
        if ENLARGING_INPUTS.contains(&node.op_type.as_str()) {
            let constants = node.inputs.iter().skip(1).filter_map(|i| graph.constant(i));
            // Resize may name the whole size of what comes out, so each number is held to the same limit.
            if constants.flat_map(Tensor::values).any(|v| !(v.abs() <= MOST as f64)) {
                return Err(enlarges(node));
            }
        }
    }
    Ok(())
}

fn enlarges(node: &Node) -> Wrong {
    (format!("`{}` would enlarge its input beyond {MOST}", node.op_type), "use a network for images of ordinary size")
}

fn check_tensor(tensor: &Tensor, max_bytes: u64) -> Result<(), Wrong> {
    let name = &tensor.name;
    if tensor.data_location == EXTERNAL || !tensor.external_data.is_empty() {
        return Err((format!("its weights `{name}` lie in another file"), "save the network with its weights inside"));
    }
    let len = tensor.dims.iter().try_fold(1u64, |len, &d| len.checked_mul(u64::try_from(d).ok()?));
    let Some(len) = len.filter(|&l| l <= max_bytes) else {
        return Err((format!("its constant `{name}` has the shape {:?}", tensor.dims), "get the file again"));
    };
    let bytes = tensor.raw_data.len() as u64;
    let given = match tensor.data_type {
        FLOAT if bytes > 0 => bytes / 4,
        INT64 if bytes > 0 => bytes / 8,
        FLOAT => tensor.float_data.len() as u64,
        INT64 => tensor.int64_data.len() as u64,
        // Other types have at least half a byte a number, or are stored one by one; the library checks them itself.
        _ => len,
    };
    if given != len {
        return Err((format!("its constant `{name}` has {given} numbers instead of {len}"), "get the file again"));
    }
    Ok(())
}

/// The inputs that are no constants, with all their dimensions.
fn inputs(graph: &Graph, options: &OnnxOptions) -> Result<Vec<Port>, Wrong> {
    let mut ports = Vec::new();
    for input in graph.inputs.iter().filter(|i| graph.initializers.iter().all(|c| c.name != i.name)) {
        let tensor = input.kind.as_ref().and_then(|k| k.tensor.as_ref());
        let name = input.name.clone();
        if tensor.is_none_or(|t| t.element != FLOAT) {
            return Err((format!("its input `{name}` is not in single precision"), "export it in single precision"));
        }
        let dims = tensor.and_then(|t| t.shape.as_ref()).map(|s| s.dims.as_slice()).unwrap_or_default();
        let asked = options.shapes.iter().find(|(n, _)| *n == name).map(|(_, s)| s.clone());
        // An open first dimension is the number of images.
        let size = |(i, d): (usize, &Dimension)| match (i, d.value) {
            (_, 1..) => usize::try_from(d.value).ok(),
            (0, 0) if dims.len() == 4 => Some(1),
            _ => None,
        };
        let shape = match asked {
            Some(shape) => Some(shape),
            None if dims.is_empty() => None,
            None => dims.iter().enumerate().map(size).collect(),
        };
        let Some(shape) = shape else {
            return Err((format!("the shape of its input `{name}` is open"), "give the shape of that input"));
        };
        let len = shape.iter().try_fold(1u64, |len, &d| len.checked_mul(d as u64));
        if !len.is_some_and(|l| (1..=options.max_bytes / 4).contains(&l)) {
            return Err((format!("its input `{name}` would be {shape:?} large"), "give the shape of that input"));
        }
        ports.push(Port { name, shape });
    }
    if ports.is_empty() {
        return Err(("it has no input".into(), "get the file again"));
    }
    Ok(ports)
}

/// The file with the shapes of its inputs set, and those of its outputs and of everything between forgotten: they
/// follow. All other fields are copied as they are.
fn reshaped(bytes: &[u8], inputs: &[Port]) -> Option<Vec<u8>> {
    const GRAPH: u64 = 7;
    const INPUT: u64 = 11;
    const OUTPUT: u64 = 12;
    const BETWEEN: u64 = 13;
    rewritten(bytes, |field, graph| match field {
        GRAPH => Some(Some(rewritten(graph, |field, value| match field {
            BETWEEN => Some(None),
            INPUT | OUTPUT => {
                let mut value = Value::decode(value).ok()?;
                let port = inputs.iter().find(|p| field == INPUT && p.name == value.name);
                if field == OUTPUT || port.is_some() {
                    let tensor = value.kind.as_mut().and_then(|k| k.tensor.as_mut());
                    let dimension = |&d: &usize| Dimension { value: d as i64 };
                    let shape = port.map(|p| Shape { dims: p.shape.iter().map(dimension).collect() });
                    tensor.into_iter().for_each(|t| t.shape = shape.clone());
                }
                Some(Some(value.encode_to_vec()))
            }
            _ => Some(Some(value.to_vec())),
        })?)),
        _ => Some(Some(graph.to_vec())),
    })
}

/// A message with each field of bytes replaced by what `of` makes of it, or left out; `None` if it breaks off.
fn rewritten(mut bytes: &[u8], of: impl Fn(u64, &[u8]) -> Option<Option<Vec<u8>>>) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(bytes.len());
    while !bytes.is_empty() {
        let start = bytes;
        let key = prost::encoding::decode_varint(&mut bytes).ok()?;
        let skip = match key & 7 {
            0 => {
                prost::encoding::decode_varint(&mut bytes).ok()?;
                0
            }
            1 => 8,
            5 => 4,
            2 => {
                let len = usize::try_from(prost::encoding::decode_varint(&mut bytes).ok()?).ok()?;
                let (value, rest) = bytes.split_at_checked(len)?;
                bytes = rest;
                if let Some(value) = of(key >> 3, value)? {
                    prost::encoding::encode_varint(key, &mut out);
                    prost::encoding::encode_varint(value.len() as u64, &mut out);
                    out.extend_from_slice(&value);
                }
                continue;
            }
            _ => return None,
        };
        bytes = bytes.get(skip..)?;
        out.extend_from_slice(&start[..start.len() - bytes.len()]);
    }
    Some(out)
}

// The fields of onnx.proto (ONNX 1.18) that matter here.

#[derive(Message)]
struct ModelProto {
    #[prost(message, optional, tag = "7")]
    graph: Option<Graph>,
}

#[derive(Message)]
struct Graph {
    #[prost(message, repeated, tag = "1")]
    nodes: Vec<Node>,
    #[prost(message, repeated, tag = "5")]
    initializers: Vec<Tensor>,
    #[prost(message, repeated, tag = "11")]
    inputs: Vec<Value>,
    #[prost(message, repeated, tag = "12")]
    outputs: Vec<Value>,
}

impl Graph {
    fn constant(&self, name: &str) -> Option<&Tensor> {
        let made = |n: &&Node| n.op_type == "Constant" && n.outputs.iter().any(|o| o == name);
        let initializer = self.initializers.iter().find(|t| t.name == name);
        initializer.or_else(|| self.nodes.iter().find(made)?.attributes.iter().find_map(|a| a.tensor.as_ref()))
    }
}

#[derive(Message)]
struct Node {
    #[prost(string, repeated, tag = "1")]
    inputs: Vec<String>,
    #[prost(string, repeated, tag = "2")]
    outputs: Vec<String>,
    #[prost(string, tag = "4")]
    op_type: String,
    #[prost(message, repeated, tag = "5")]
    attributes: Vec<Attribute>,
    #[prost(string, tag = "7")]
    domain: String,
}

#[derive(Message)]
struct Attribute {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(int64, tag = "3")]
    int: i64,
    #[prost(message, optional, tag = "5")]
    tensor: Option<Tensor>,
    #[prost(float, repeated, tag = "7")]
    floats: Vec<f32>,
    #[prost(int64, repeated, tag = "8")]
    ints: Vec<i64>,
}

#[derive(Message)]
struct Tensor {
    #[prost(int64, repeated, tag = "1")]
    dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    data_type: i32,
    #[prost(float, repeated, tag = "4")]
    float_data: Vec<f32>,
    #[prost(int64, repeated, tag = "7")]
    int64_data: Vec<i64>,
    #[prost(string, tag = "8")]
    name: String,
    #[prost(bytes = "vec", tag = "9")]
    raw_data: Vec<u8>,
    #[prost(bytes = "vec", repeated, tag = "13")]
    external_data: Vec<Vec<u8>>,
    #[prost(int32, tag = "14")]
    data_location: i32,
}

impl Tensor {
    fn values(&self) -> Vec<f64> {
        match (self.data_type, self.raw_data.is_empty()) {
            (FLOAT, true) => self.float_data.iter().map(|&v| f64::from(v)).collect(),
            (INT64, true) => self.int64_data.iter().map(|&v| v as f64).collect(),
            (FLOAT, false) => {
                self.raw_data.as_chunks::<4>().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect()
            }
            (INT64, false) => self.raw_data.as_chunks::<8>().0.iter().map(|&b| i64::from_le_bytes(b) as f64).collect(),
            _ => Vec::new(),
        }
    }
}

#[derive(Message)]
struct Value {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, optional, tag = "2")]
    kind: Option<Kind>,
}

#[derive(Message)]
struct Kind {
    #[prost(message, optional, tag = "1")]
    tensor: Option<TensorKind>,
}

#[derive(Message)]
struct TensorKind {
    #[prost(int32, tag = "1")]
    element: i32,
    #[prost(message, optional, tag = "2")]
    shape: Option<Shape>,
}

#[derive(Clone, Message)]
struct Shape {
    #[prost(message, repeated, tag = "1")]
    dims: Vec<Dimension>,
}

#[derive(Clone, Message)]
struct Dimension {
    #[prost(int64, tag = "1")]
    value: i64,
}
