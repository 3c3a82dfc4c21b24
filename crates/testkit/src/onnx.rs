//! Small ONNX files, byte by byte: no library that writes them is needed.

/// Numbers of fields and types in onnx.proto.
const FLOAT: u64 = 1;
const INT: u64 = 2;

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
