//! Small ONNX files, byte by byte: no library that writes them is needed.

/// Numbers of fields and types in onnx.proto.
const FLOAT: u64 = 1;
const INT: u64 = 2;
const INTS: u64 = 7;
/// An element type: whole numbers of 64 bits.
const INT64: u64 = 7;

/// A varint.
fn number(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push((value & 0x7f) as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// A field that is a whole number.
fn whole(field: u64, value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    number(field << 3, &mut out);
    number(value, &mut out);
    out
}

/// A field of bytes: text, or a message.
fn bytes(field: u64, value: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    number(field << 3 | 2, &mut out);
    number(value.len() as u64, &mut out);
    out.extend_from_slice(value);
    out
}

fn text(field: u64, value: &str) -> Vec<u8> {
    bytes(field, value.as_bytes())
}

/// `TensorProto` of floats.
fn tensor(name: &str, shape: &[usize], values: &[f32]) -> Vec<u8> {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let dims: Vec<u8> = shape.iter().flat_map(|&d| whole(1, d as u64)).collect();
    [dims, whole(2, FLOAT), text(8, name), bytes(9, &raw)].concat()
}

/// `TensorProto` of whole numbers, along one axis.
fn whole_tensor(name: &str, values: &[i64]) -> Vec<u8> {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    [whole(1, values.len() as u64), whole(2, INT64), text(8, name), bytes(9, &raw)].concat()
}

/// `ValueInfoProto` of floats; a side of 0 is left open.
fn value(name: &str, shape: &[usize]) -> Vec<u8> {
    let dimension = |&d: &usize| bytes(1, &if d > 0 { whole(1, d as u64) } else { text(2, "open") });
    let dims: Vec<u8> = shape.iter().flat_map(dimension).collect();
    let kind = bytes(1, &[whole(1, FLOAT), bytes(2, &dims)].concat());
    [text(1, name), bytes(2, &kind)].concat()
}

/// `NodeProto`; attributes are whole numbers.
fn node(operator: &str, inputs: &[&str], output: &str, attributes: &[(&str, u64)]) -> Vec<u8> {
    let mut out: Vec<u8> = inputs.iter().flat_map(|i| text(1, i)).collect();
    out.extend(text(2, output));
    out.extend(text(4, operator));
    for (name, value) in attributes {
        out.extend(bytes(5, &[text(1, name), whole(3, *value), whole(20, INT)].concat()));
    }
    out
}

/// An ONNX file of opset 13 that is put together node by node.
#[derive(Debug, Clone, Default)]
pub struct NetworkFile {
    graph: Vec<u8>,
}

impl NetworkFile {
    /// An input of floats; a side of 0 is left open.
    #[must_use]
    pub fn input(mut self, name: &str, shape: &[usize]) -> Self {
        self.graph.extend(bytes(11, &value(name, shape)));
        self
    }

    /// An output of floats, whose shape follows.
    #[must_use]
    pub fn output(mut self, name: &str, rank: usize) -> Self {
        self.graph.extend(bytes(12, &value(name, &vec![0; rank])));
        self
    }

    /// A constant of floats; without sides a single one.
    #[must_use]
    pub fn floats(mut self, name: &str, shape: &[usize], values: &[f32]) -> Self {
        self.graph.extend(bytes(5, &tensor(name, shape, values)));
        self
    }

    /// A constant of whole numbers along one axis.
    #[must_use]
    pub fn wholes(mut self, name: &str, values: &[i64]) -> Self {
        self.graph.extend(bytes(5, &whole_tensor(name, values)));
        self
    }

    /// A node; attributes are whole numbers.
    #[must_use]
    pub fn node(mut self, operator: &str, inputs: &[&str], output: &str, attributes: &[(&str, u64)]) -> Self {
        self.graph.extend(bytes(1, &node(operator, inputs, output, attributes)));
        self
    }

    /// A node; attributes are several whole numbers each.
    #[must_use]
    pub fn listed(mut self, operator: &str, inputs: &[&str], output: &str, attributes: &[(&str, &[u64])]) -> Self {
        let mut made = node(operator, inputs, output, &[]);
        for (name, values) in attributes {
            let values: Vec<u8> = values.iter().flat_map(|v| whole(8, *v)).collect();
            made.extend(bytes(5, &[text(1, name), values, whole(20, INTS)].concat()));
        }
        self.graph.extend(bytes(1, &made));
        self
    }

    /// A convolution of cells of `side` × `side` pixels that do not overlap, by the constant `weights` (planes out × planes in × side ×
    /// side).
    #[must_use]
    pub fn cells(self, input: &str, weights: &str, output: &str, side: u64) -> Self {
        self.listed("Conv", &[input, weights], output, &[("kernel_shape", &[side; 2]), ("strides", &[side; 2])])
    }

    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let graph = [self.graph.clone(), text(2, "made")].concat();
        [whole(1, 8), bytes(8, &[text(1, ""), whole(2, 13)].concat()), bytes(7, &graph)].concat()
    }
}

/// A network that takes an image of `1 × 3 × height × width` (0: left open) and always answers `answer`, of this shape; its file says of
/// itself what `properties` have.
pub fn network_that_answers(
    (width, height): (usize, usize),
    shape: &[usize],
    answer: &[f32],
    properties: &[(&str, &str)],
) -> Vec<u8> {
    // What it sees counts for nothing, but is looked at.
    let nodes = [
        node("ReduceMean", &["images"], "mean", &[("keepdims", 0)]),
        node("Mul", &["mean", "nothing"], "unseen", &[]),
        node("Add", &["answer", "unseen"], "output0", &[]),
    ];
    let mut graph: Vec<u8> = nodes.iter().flat_map(|n| bytes(1, n)).collect();
    graph.extend(text(2, "told"));
    graph.extend(bytes(5, &tensor("nothing", &[], &[0.0])));
    graph.extend(bytes(5, &tensor("answer", shape, answer)));
    graph.extend(bytes(11, &value("images", &[1, 3, height, width])));
    graph.extend(bytes(12, &value("output0", shape)));
    let mut model = [whole(1, 8), bytes(8, &[text(1, ""), whole(2, 13)].concat()), bytes(7, &graph)].concat();
    for (key, value) in properties {
        model.extend(bytes(14, &[text(1, key), text(2, value)].concat()));
    }
    model
}
