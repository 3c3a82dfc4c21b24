//! Files that a library never gets to see, and what is changed in those that it does.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::OnnxOptions;
use super::file::Model;
use super::proto::*;
use prost::Message;

fn value(name: &str, dims: &[i64]) -> Value {
    let shape = Shape { dims: dims.iter().map(|&value| Dimension { value }).collect() };
    let tensor = TensorKind { element: FLOAT, shape: Some(shape) };
    Value { name: name.into(), kind: Some(Kind { tensor: Some(tensor) }) }
}

fn node(op_type: &str, inputs: &[&str]) -> Node {
    Node {
        inputs: inputs.iter().map(|&i| i.into()).collect(),
        outputs: vec!["out".into()],
        op_type: op_type.into(),
        ..Node::default()
    }
}

fn floats(name: &str, dims: &[i64], numbers: usize) -> Tensor {
    Tensor {
        dims: dims.to_vec(),
        data_type: FLOAT,
        name: name.into(),
        raw_data: vec![0; 4 * numbers],
        ..Tensor::default()
    }
}

/// One convolution of a 1 × 3 × 8 × 8 image.
fn graph() -> Graph {
    Graph {
        nodes: vec![node("Conv", &["image", "weights"])],
        initializers: vec![floats("weights", &[2, 3, 1, 1], 6)],
        inputs: vec![value("image", &[1, 3, 8, 8]), value("weights", &[2, 3, 1, 1])],
        outputs: vec![value("out", &[1, 2, 8, 8])],
    }
}

fn parsed(graph: Graph, options: &OnnxOptions) -> Result<Model, String> {
    let bytes = ModelProto { graph: Some(graph) }.encode_to_vec();
    Model::parse("net.onnx".into(), &bytes, options).map_err(|e| e.to_string())
}

fn refused(change: impl FnOnce(&mut Graph), words: &str) {
    let mut graph = graph();
    change(&mut graph);
    let error = parsed(graph, &OnnxOptions::default()).unwrap_err();
    assert!(error.contains("net.onnx is no usable network") && error.contains(words), "{error}");
}

#[test]
fn a_plain_network_passes_and_keeps_its_weights() {
    let model = parsed(graph(), &OnnxOptions::default()).unwrap();
    assert_eq!(model.inputs.len(), 1);
    assert_eq!((model.inputs[0].name.as_str(), model.inputs[0].shape.as_slice()), ("image", &[1, 3, 8, 8][..]));
    assert_eq!(model.outputs, ["out"]);
    let again = ModelProto::decode(model.bytes.as_slice()).unwrap().graph.unwrap();
    assert_eq!(again.initializers, graph().initializers);
    assert_eq!(again.nodes, graph().nodes);
}

#[test]
fn shapes_that_are_asked_for_replace_those_of_the_file() {
    let options = |name: &str| OnnxOptions { shapes: vec![(name.into(), vec![1, 3, 4, 4])], ..OnnxOptions::default() };
    let model = parsed(graph(), &options("image")).unwrap();
    assert_eq!(model.inputs[0].shape, [1, 3, 4, 4]);
    let again = ModelProto::decode(model.bytes.as_slice()).unwrap().graph.unwrap();
    assert_eq!(again.inputs[0], value("image", &[1, 3, 4, 4]));
    assert_eq!(again.inputs[1], value("weights", &[2, 3, 1, 1]));
    assert_eq!(again.outputs[0].kind.as_ref().unwrap().tensor.as_ref().unwrap().shape, None);
    assert!(parsed(graph(), &options("picture")).unwrap_err().contains("name one of image"));
}

#[test]
fn open_shapes_are_asked_for() {
    let mut open = graph();
    open.inputs[0] = value("image", &[0, 3, 8, 8]);
    assert_eq!(parsed(open, &OnnxOptions::default()).unwrap().inputs[0].shape, [1, 3, 8, 8]);
    refused(|g| g.inputs[0] = value("image", &[1, 3, 0, 8]), "the shape of its input `image` is open");
    refused(|g| g.inputs[0] = value("image", &[1, 3, 1 << 40, 1 << 40]), "would be");
    refused(|g| g.inputs.clear(), "no input");
}

#[test]
fn operators_that_loop_or_generate_are_refused() {
    for operator in ["Loop", "If", "Scan", "ConstantOfShape", "Range", "RandomNormal", "Nonsense"] {
        refused(|g| g.nodes.push(node(operator, &["out"])), &format!("operator `{operator}`"));
    }
    refused(|g| g.nodes[0].domain = "com.example".into(), "`com.example.Conv`");
    refused(|g| g.nodes.clear(), "computes nothing");
}

#[test]
fn files_that_ask_for_much_are_refused() {
    let attribute = |name: &str, value| Attribute { name: name.into(), ints: vec![0, value], ..Attribute::default() };
    refused(|g| g.nodes[0].attributes.push(attribute("pads", 4097)), "enlarge");
    refused(|g| g.nodes[0].attributes.push(attribute("dilations", -4097)), "enlarge");
    let mut harmless = graph();
    harmless.nodes[0].attributes.push(attribute("pads", 4096));
    harmless.nodes[0].attributes.push(attribute("axes", i64::MAX));
    assert!(parsed(harmless, &OnnxOptions::default()).is_ok());
    refused(
        |g| {
            g.nodes.push(node("Resize", &["out", "", "scales"]));
            g.initializers.push(Tensor { raw_data: 1e9f32.to_le_bytes().to_vec(), ..floats("scales", &[1], 1) });
        },
        "`Resize` would enlarge",
    );
    let repeated = |times: &[i64]| {
        let mut graph = graph();
        graph.nodes.push(node("Tile", &["out", "times"]));
        let raw_data = times.iter().flat_map(|t| t.to_le_bytes()).collect();
        let dims = vec![times.len() as i64];
        graph.initializers.push(Tensor { dims, data_type: INT64, name: "times".into(), raw_data, ..Tensor::default() });
        parsed(graph, &OnnxOptions::default())
    };
    assert!(repeated(&[1, 1, 2, 4]).is_ok());
    assert!(repeated(&[1, 1, 1, 4097]).unwrap_err().contains("`Tile` would enlarge"));
    assert!(repeated(&[4096, 4096, 4096, 1]).unwrap_err().contains("`Tile` would enlarge"));
    // How often is computed, so nobody knows.
    refused(|g| g.nodes.push(node("Expand", &["out", "image"])), "`Expand` would enlarge");
    refused(|g| g.initializers[0] = floats("weights", &[i64::MAX, 3], 0), "has the shape");
    refused(|g| g.initializers[0] = floats("weights", &[-2, 3], 6), "has the shape");
    refused(|g| g.initializers[0] = floats("weights", &[2, 3, 1, 1], 5), "5 numbers instead of 6");
    refused(|g| g.initializers[0].data_location = 1, "lie in another file");
    refused(|g| g.initializers[0].external_data.push(vec![]), "lie in another file");
    refused(|g| g.nodes = vec![node("Relu", &["out"]); 20_001], "20001 layers");
    refused(|g| g.nodes = vec![Node::default(); 400_000], "too many");
    let small = OnnxOptions { max_bytes: 16, ..OnnxOptions::default() };
    assert!(parsed(graph(), &small).unwrap_err().contains("more than 16 bytes"));
}

#[test]
fn what_breaks_off_anywhere_is_refused_or_read_without_a_crash() {
    let bytes = ModelProto { graph: Some(graph()) }.encode_to_vec();
    for cut in 1..bytes.len() {
        assert!(Model::parse("cut".into(), &bytes[..cut], &OnnxOptions::default()).is_err(), "cut at {cut}");
    }
    for at in 0..bytes.len() {
        for bit in 0..8 {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << bit;
            let _ = Model::parse("damaged".into(), &damaged, &OnnxOptions::default());
        }
    }
}
