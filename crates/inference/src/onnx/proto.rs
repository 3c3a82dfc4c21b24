//! The fields of onnx.proto (ONNX 1.18) that matter here, and protobuf messages whose other fields are left alone.

use prost::Message;
use prost::encoding::{decode_varint, encode_varint};
use std::collections::HashMap;

/// Element types.
pub const FLOAT: i32 = 1;
pub const INT64: i32 = 7;

/// The most fields that are decoded: an empty one takes two bytes in a file and a hundred times that in memory.
const MAX_FIELDS: usize = 400_000;

/// One field as it is stored.
struct Field<'a> {
    number: u64,
    /// The value, where it is bytes (text, a message, packed numbers).
    value: Option<&'a [u8]>,
    whole: &'a [u8],
}

/// Takes the first field off a message; `None` if it breaks off.
fn take<'a>(bytes: &mut &'a [u8]) -> Option<Field<'a>> {
    let start = *bytes;
    let key = decode_varint(bytes).ok()?;
    let mut value = None;
    match key & 7 {
        0 => drop(decode_varint(bytes).ok()?),
        1 => *bytes = bytes.get(8..)?,
        5 => *bytes = bytes.get(4..)?,
        2 => {
            let len = usize::try_from(decode_varint(bytes).ok()?).ok()?;
            let (taken, rest) = bytes.split_at_checked(len)?;
            (value, *bytes) = (Some(taken), rest);
        }
        _ => return None,
    }
    Some(Field { number: key >> 3, value, whole: &start[..start.len() - bytes.len()] })
}

/// A message with each field of bytes replaced by what `of` makes of it, or left out; `None` if it breaks off.
pub fn rewritten(mut bytes: &[u8], of: impl Fn(u64, &[u8]) -> Option<Option<Vec<u8>>>) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(bytes.len());
    while !bytes.is_empty() {
        let field = take(&mut bytes)?;
        match field.value {
            None => out.extend_from_slice(field.whole),
            Some(value) => {
                if let Some(value) = of(field.number, value)? {
                    encode_varint(field.number << 3 | 2, &mut out);
                    encode_varint(value.len() as u64, &mut out);
                    out.extend_from_slice(&value);
                }
            }
        }
    }
    Some(out)
}

/// Whether a model's fields are whole and few enough to be decoded.
pub fn is_bounded(model: &[u8]) -> bool {
    /// Field by field, from the model down, the messages that are decoded.
    const TREE: [&[u64]; 4] = [&[7], &[1, 5, 11, 12], &[5], &[5]];
    fn count(mut bytes: &[u8], level: usize, left: &mut usize) -> Option<()> {
        while !bytes.is_empty() {
            *left = left.checked_sub(1)?;
            let field = take(&mut bytes)?;
            let inner = TREE.get(level).is_some_and(|numbers| numbers.contains(&field.number));
            if let (true, Some(value)) = (inner, field.value) {
                count(value, level + 1, left)?;
            }
        }
        Some(())
    }
    count(model, 0, &mut { MAX_FIELDS }).is_some()
}

#[derive(Clone, PartialEq, Message)]
pub struct ModelProto {
    #[prost(message, optional, tag = "7")]
    pub graph: Option<Graph>,
}

/// What a file says of itself, without its network.
#[derive(Clone, PartialEq, Message)]
pub struct Properties {
    #[prost(message, repeated, tag = "14")]
    pub entries: Vec<Property>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Property {
    #[prost(string, tag = "1")]
    pub key: String,
    #[prost(string, tag = "2")]
    pub value: String,
}

#[derive(Clone, PartialEq, Message)]
pub struct Graph {
    #[prost(message, repeated, tag = "1")]
    pub nodes: Vec<Node>,
    #[prost(message, repeated, tag = "5")]
    pub initializers: Vec<Tensor>,
    #[prost(message, repeated, tag = "11")]
    pub inputs: Vec<Value>,
    #[prost(message, repeated, tag = "12")]
    pub outputs: Vec<Value>,
}

impl Graph {
    /// The constants by name, those of `Constant` nodes included.
    pub fn constants(&self) -> HashMap<&str, &Tensor> {
        let made = self.nodes.iter().filter(|n| n.op_type == "Constant").filter_map(|n| {
            let tensor = n.attributes.iter().find_map(|a| a.tensor.as_ref())?;
            Some((n.outputs.first()?.as_str(), tensor))
        });
        made.chain(self.initializers.iter().map(|t| (t.name.as_str(), t))).collect()
    }
}

#[derive(Clone, PartialEq, Message)]
pub struct Node {
    #[prost(string, repeated, tag = "1")]
    pub inputs: Vec<String>,
    #[prost(string, repeated, tag = "2")]
    pub outputs: Vec<String>,
    #[prost(string, tag = "4")]
    pub op_type: String,
    #[prost(message, repeated, tag = "5")]
    pub attributes: Vec<Attribute>,
    #[prost(string, tag = "7")]
    pub domain: String,
}

#[derive(Clone, PartialEq, Message)]
pub struct Attribute {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(int64, tag = "3")]
    pub int: i64,
    #[prost(message, optional, tag = "5")]
    pub tensor: Option<Tensor>,
    #[prost(float, repeated, tag = "7")]
    pub floats: Vec<f32>,
    #[prost(int64, repeated, tag = "8")]
    pub ints: Vec<i64>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Tensor {
    #[prost(int64, repeated, tag = "1")]
    pub dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    pub data_type: i32,
    #[prost(float, repeated, tag = "4")]
    pub float_data: Vec<f32>,
    #[prost(int64, repeated, tag = "7")]
    pub int64_data: Vec<i64>,
    #[prost(string, tag = "8")]
    pub name: String,
    #[prost(bytes = "vec", tag = "9")]
    pub raw_data: Vec<u8>,
    #[prost(bytes = "vec", repeated, tag = "13")]
    pub external_data: Vec<Vec<u8>>,
    #[prost(int32, tag = "14")]
    pub data_location: i32,
}

impl Tensor {
    pub fn values(&self) -> Vec<f64> {
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

#[derive(Clone, PartialEq, Message)]
pub struct Value {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(message, optional, tag = "2")]
    pub kind: Option<Kind>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Kind {
    #[prost(message, optional, tag = "1")]
    pub tensor: Option<TensorKind>,
}

#[derive(Clone, PartialEq, Message)]
pub struct TensorKind {
    #[prost(int32, tag = "1")]
    pub element: i32,
    #[prost(message, optional, tag = "2")]
    pub shape: Option<Shape>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Shape {
    #[prost(message, repeated, tag = "1")]
    pub dims: Vec<Dimension>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Dimension {
    #[prost(int64, tag = "1")]
    pub value: i64,
}
