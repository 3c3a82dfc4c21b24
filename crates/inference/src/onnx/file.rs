//! What is asked of a file before a library sees it, and the few changes made to it.

use super::proto::{
    Dimension, FLOAT, Graph, INT64, ModelProto, Node, Properties, Shape, Tensor, Value, is_bounded, rewritten,
};
use super::{Declared, OnnxOptions};
use crate::{InferenceError, Port, Result};
use prost::Message;
use std::io::Read;
use std::path::Path;

/// Operators that make, of inputs of bounded size, outputs of bounded size in bounded time.
const OPERATORS: &[&str] = &[
    "Abs",
    "Add",
    "And",
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
    "Cos",
    "DepthToSpace",
    "Div",
    "Dropout",
    "Elu",
    "Equal",
    "Erf",
    "Exp",
    "Expand",
    "Flatten",
    "Floor",
    "Gather",
    "GatherElements",
    "GatherND",
    "Gelu",
    "Gemm",
    "GlobalAveragePool",
    "GlobalMaxPool",
    "Greater",
    "GreaterOrEqual",
    "GridSample",
    "HardSigmoid",
    "HardSwish",
    "Identity",
    "InstanceNormalization",
    "LayerNormalization",
    "LeakyRelu",
    "Less",
    "LessOrEqual",
    "Log",
    "LogSoftmax",
    "MatMul",
    "Max",
    "MaxPool",
    "Mean",
    "Min",
    "Mish",
    "Mod",
    "Mul",
    "Neg",
    "NonMaxSuppression",
    "Not",
    "Or",
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
    "Round",
    "ScatterElements",
    "ScatterND",
    "Selu",
    "Shape",
    "Sigmoid",
    "Sign",
    "Sin",
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
    "Tile",
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
/// Operators that repeat their input as their second one says.
const REPEATING: &[&str] = &["Expand", "Tile"];
/// The most that padding, kernels and resizing may be.
const MOST: i64 = 4096;
const MAX_NODES: usize = 20_000;
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
        let name = path.file_name().map_or_else(|| path.to_string_lossy(), |n| n.to_string_lossy()).into_owned();
        Self::parse(name, &bytes_of(path, options)?, options)
    }

    /// From the bytes of a file.
    pub fn parse(name: String, bytes: &[u8], options: &OnnxOptions) -> Result<Self> {
        let wrong = |why: String, mend: &str| InferenceError::Model { what: name.clone(), why, mend: mend.into() };
        let damaged = DAMAGED;
        let graph = decoded(bytes, options).map_err(|(why, mend)| wrong(why, mend))?;
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
    pub fn refused(&self, library: &str, why: &impl std::fmt::Display) -> InferenceError {
        InferenceError::Model {
            what: self.name.clone(),
            why: format!("{library} refuses it: {why}"),
            mend: "export it again with operators of ONNX opset 17 or older, or try the other library".into(),
        }
    }

    /// The ports of outputs whose shapes a first run has shown.
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

/// The bytes of a file, one more than the most it may have where it has more.
fn bytes_of(path: &Path, options: &OnnxOptions) -> Result<Vec<u8>> {
    let unread = |source| InferenceError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(unread)?;
    file.take(options.max_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(unread)?;
    Ok(bytes)
}

/// What the file says of itself, key and value; nothing where it is no ONNX file, of which [`Model::read`] says more.
pub fn metadata(path: &Path, options: &OnnxOptions) -> Result<Vec<(String, String)>> {
    let bytes = bytes_of(path, options)?;
    if bytes.len() as u64 > options.max_bytes || !is_bounded(&bytes) {
        return Ok(Vec::new());
    }
    let said = Properties::decode(bytes.as_slice()).unwrap_or_default();
    Ok(said.entries.into_iter().map(|p| (p.key, p.value)).collect())
}

type Wrong = (String, &'static str);

const DAMAGED: &str = "get the file again: it is damaged or no ONNX file";

/// The graph in the bytes of a file.
fn decoded(bytes: &[u8], options: &OnnxOptions) -> Result<Graph, Wrong> {
    if bytes.len() as u64 > options.max_bytes {
        let why = format!("it has more than {} bytes", options.max_bytes);
        return Err((why, "raise the limit if it is meant to be that large"));
    }
    if !is_bounded(bytes) {
        return Err(("its fields break off or are too many".into(), DAMAGED));
    }
    let proto = ModelProto::decode(bytes).map_err(|e| (e.to_string(), DAMAGED))?;
    proto.graph.ok_or_else(|| ("it has no graph".into(), DAMAGED))
}

/// The inputs that a file declares and that are no constants.
pub fn declared_inputs(path: &Path, options: &OnnxOptions) -> Result<Vec<Declared>> {
    let name = path.file_name().map_or_else(|| path.to_string_lossy(), |n| n.to_string_lossy()).into_owned();
    let wrong = |(why, mend): Wrong| InferenceError::Model { what: name, why, mend: mend.into() };
    let graph = decoded(&bytes_of(path, options)?, options).map_err(wrong)?;
    let constants = graph.constants();
    let dims = |input: &Value| {
        let tensor = input.kind.as_ref().and_then(|k| k.tensor.as_ref());
        let dims = tensor.and_then(|t| t.shape.as_ref()).map(|s| s.dims.as_slice()).unwrap_or_default();
        dims.iter().map(|d| usize::try_from(d.value).ok().filter(|&side| side > 0)).collect()
    };
    let inputs = graph.inputs.iter().filter(|i| !constants.contains_key(i.name.as_str()));
    Ok(inputs.map(|input| Declared { name: input.name.clone(), shape: dims(input) }).collect())
}

fn check_graph(graph: &Graph, max_bytes: u64) -> Result<(), Wrong> {
    if graph.nodes.len() > MAX_NODES {
        return Err((format!("it has {} layers", graph.nodes.len()), "use a smaller network"));
    }
    for tensor in &graph.initializers {
        check_tensor(tensor, max_bytes)?;
    }
    let constants = graph.constants();
    // Not-a-number is not within.
    let within = |v: f64| v.abs() <= MOST as f64;
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
            if attribute.floats.iter().any(|&f| !within(f64::from(f))) && attribute.name == "scales" {
                return Err(enlarges(node));
            }
        }
        if REPEATING.contains(&node.op_type.as_str()) {
            // How often is known only where it stands in the file; together no more than an input may be large.
            let times = node.inputs.get(1).and_then(|i| constants.get(i.as_str())).map(|t| t.values());
            let Some(times) = times.filter(|t| !t.is_empty() && t.iter().all(|&v| within(v))) else {
                return Err(enlarges(node));
            };
            if times.iter().map(|v| v.abs().max(1.0)).product::<f64>() > max_bytes as f64 / 4.0 {
                return Err(enlarges(node));
            }
        }
        if ENLARGING_INPUTS.contains(&node.op_type.as_str()) {
            let given = node.inputs.iter().skip(1).filter_map(|i| constants.get(i.as_str()));
            // Resize may name the whole size of what comes out, so each number is held to the same limit.
            if given.flat_map(|t| t.values()).any(|v| !within(v)) {
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
    let constants = graph.constants();
    for input in graph.inputs.iter().filter(|i| !constants.contains_key(i.name.as_str())) {
        let tensor = input.kind.as_ref().and_then(|k| k.tensor.as_ref());
        let name = input.name.clone();
        if tensor.is_none_or(|t| t.element != FLOAT) {
            return Err((format!("its input `{name}` is not in single precision"), "export it in single precision"));
        }
        let dims = tensor.and_then(|t| t.shape.as_ref()).map(|s| s.dims.as_slice()).unwrap_or_default();
        let asked = options.shapes.iter().find(|(n, _)| *n == name).map(|(_, s)| s.clone());
        let image = options.image.filter(|_| dims.len() == 4 && dims[1].value == 3);
        // An open first dimension is the number of images.
        let size = |(i, d): (usize, &Dimension)| match (i, d.value, image) {
            (2, _, Some((_, height))) => Some(height),
            (3, _, Some((width, _))) => Some(width),
            (_, 1.., _) => usize::try_from(d.value).ok(),
            (0, 0, _) if dims.len() == 4 => Some(1),
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
