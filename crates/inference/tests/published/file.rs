//! Writes ONNX files: as much of onnx.proto as the networks here need, with weights drawn from a seed.

/// A graph that grows node by node. Tensors are called by the names that its functions return.
pub struct File {
    graph: Vec<u8>,
    names: usize,
    state: u64,
}

/// An attribute of a node.
pub enum Attribute<'a> {
    Int(&'a str, i64),
    Ints(&'a str, &'a [i64]),
}

/// A convolution: planes in and out, side of the kernel, and how it goes over its input.
#[derive(Clone, Copy)]
pub struct Layer {
    pub planes: (usize, usize),
    pub kernel: usize,
    pub stride: i64,
    pub pad: i64,
    pub dilation: i64,
    pub groups: usize,
    /// Standard deviation of what comes out, where what goes in has one of 1.
    pub gain: f64,
}

impl Layer {
    pub fn new(inputs: usize, outputs: usize, kernel: usize) -> Self {
        Self { planes: (inputs, outputs), kernel, stride: 1, pad: 0, dilation: 1, groups: 1, gain: 1.4 }
    }
}

fn varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 128 {
        out.push(value as u8 | 128);
        value >>= 7;
    }
    out.push(value as u8);
}

fn number(field: u64, value: i64, out: &mut Vec<u8>) {
    varint(field << 3, out);
    varint(value as u64, out);
}

fn bytes(field: u64, value: &[u8], out: &mut Vec<u8>) {
    varint(field << 3 | 2, out);
    varint(value.len() as u64, out);
    out.extend_from_slice(value);
}

fn message(write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out);
    out
}

impl File {
    pub fn new(seed: u64) -> Self {
        Self { graph: Vec::new(), names: 0, state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1 }
    }

    fn name(&mut self) -> String {
        self.names += 1;
        format!("t{}", self.names)
    }

    /// Evenly distributed from 0 to 1 (xorshift64*).
    fn even(&mut self) -> f64 {
        self.state ^= self.state >> 12;
        self.state ^= self.state << 25;
        self.state ^= self.state >> 27;
        (self.state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of mean 0 and deviation 1: the sum of twelve even draws.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }

    fn port(&mut self, field: u64, name: &str, shape: &[usize]) {
        let dims = message(|out| {
            shape.iter().for_each(|&side| bytes(1, &message(|dim| number(1, side as i64, dim)), out));
        });
        let tensor = message(|out| {
            number(1, 1, out);
            bytes(2, &dims, out);
        });
        let value = message(|out| {
            bytes(1, name.as_bytes(), out);
            bytes(2, &message(|kind| bytes(1, &tensor, kind)), out);
        });
        bytes(field, &value, &mut self.graph);
    }

    pub fn input(&mut self, name: &str, shape: &[usize]) -> String {
        self.port(11, name, shape);
        name.to_owned()
    }

    /// Makes `tensor` an output of that name.
    pub fn output(&mut self, name: &str, tensor: &str, shape: &[usize]) {
        self.append("Identity", &[tensor], &[], name);
        self.port(12, name, shape);
    }

    fn append(&mut self, operator: &str, inputs: &[&str], attributes: &[Attribute<'_>], output: &str) {
        let node = message(|out| {
            inputs.iter().for_each(|name| bytes(1, name.as_bytes(), out));
            bytes(2, output.as_bytes(), out);
            bytes(4, operator.as_bytes(), out);
            for attribute in attributes {
                let attribute = message(|out| match attribute {
                    Attribute::Int(name, value) => {
                        bytes(1, name.as_bytes(), out);
                        number(3, *value, out);
                        number(20, 2, out);
                    }
                    Attribute::Ints(name, values) => {
                        bytes(1, name.as_bytes(), out);
                        values.iter().for_each(|v| number(8, *v, out));
                        number(20, 7, out);
                    }
                });
                bytes(5, &attribute, out);
            }
        });
        bytes(1, &node, &mut self.graph);
    }

    pub fn node(&mut self, operator: &str, inputs: &[&str], attributes: &[Attribute<'_>]) -> String {
        let output = self.name();
        self.append(operator, inputs, attributes, &output);
        output
    }

    fn tensor(&mut self, dims: &[usize], kind: i64, raw: &[u8]) -> String {
        let name = self.name();
        let tensor = message(|out| {
            dims.iter().for_each(|&side| number(1, side as i64, out));
            number(2, kind, out);
            bytes(8, name.as_bytes(), out);
            bytes(9, raw, out);
        });
        bytes(5, &tensor, &mut self.graph);
        name
    }

    pub fn numbers(&mut self, dims: &[usize], values: &[f32]) -> String {
        self.tensor(dims, 1, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())
    }

    pub fn whole_numbers(&mut self, values: &[i64]) -> String {
        self.tensor(&[values.len()], 7, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())
    }

    /// Drawn numbers of a standard deviation.
    pub fn drawn(&mut self, dims: &[usize], deviation: f64) -> String {
        let values: Vec<f32> = (0..dims.iter().product()).map(|_| (deviation * self.normal()) as f32).collect();
        self.numbers(dims, &values)
    }

    pub fn reshape(&mut self, tensor: &str, shape: &[i64]) -> String {
        let shape = self.whole_numbers(shape);
        self.node("Reshape", &[tensor, &shape], &[])
    }

    pub fn relu(&mut self, tensor: &str) -> String {
        self.node("Relu", &[tensor], &[])
    }

    pub fn pool(&mut self, tensor: &str, pad: i64) -> String {
        use Attribute::Ints;
        self.node(
            "MaxPool",
            &[tensor],
            &[Ints("kernel_shape", &[3, 3]), Ints("strides", &[2, 2]), Ints("pads", &[pad; 4])],
        )
    }

    /// A convolution with drawn filters, each of mean 0, so that evenness answers nothing.
    pub fn convolution(&mut self, tensor: &str, layer: Layer) -> String {
        let (inputs, outputs) = layer.planes;
        let each = inputs / layer.groups * layer.kernel * layer.kernel;
        let mut weights = Vec::with_capacity(outputs * each);
        for _ in 0..outputs {
            let filter: Vec<f64> = (0..each).map(|_| self.normal()).collect();
            let mean = if layer.kernel > 1 { filter.iter().sum::<f64>() / each as f64 } else { 0.0 };
            weights.extend(filter.iter().map(|v| ((v - mean) * layer.gain / (each as f64).sqrt()) as f32));
        }
        let weights = self.numbers(&[outputs, inputs / layer.groups, layer.kernel, layer.kernel], &weights);
        self.correlation(tensor, &weights, layer)
    }

    /// A convolution whose filters are a tensor: cross-correlation.
    pub fn correlation(&mut self, tensor: &str, filters: &str, layer: Layer) -> String {
        use Attribute::{Int, Ints};
        self.node(
            "Conv",
            &[tensor, filters],
            &[
                Ints("kernel_shape", &[layer.kernel as i64; 2]),
                Ints("strides", &[layer.stride; 2]),
                Ints("pads", &[layer.pad; 4]),
                Ints("dilations", &[layer.dilation; 2]),
                Int("group", layer.groups as i64),
            ],
        )
    }

    /// A transposed convolution with drawn filters: `stride` places for each.
    pub fn enlarged(&mut self, tensor: &str, (inputs, outputs): (usize, usize), kernel: usize, stride: i64) -> String {
        use Attribute::Ints;
        let weights = self.drawn(&[inputs, outputs, kernel, kernel], 1.4 / (inputs as f64).sqrt());
        let sides = [Ints("kernel_shape", &[kernel as i64; 2]), Ints("strides", &[stride; 2])];
        self.node("ConvTranspose", &[tensor, &weights], &sides)
    }

    /// `factor` times `tensor`, and `constant` more.
    pub fn line(&mut self, tensor: &str, factor: f32, constant: f32) -> String {
        let (factor, constant) = (self.numbers(&[1], &[factor]), self.numbers(&[1], &[constant]));
        let scaled = self.node("Mul", &[tensor, &factor], &[]);
        self.node("Add", &[&scaled, &constant], &[])
    }

    /// The bytes of the file: IR version 8, opset 17.
    pub fn finish(mut self) -> Vec<u8> {
        bytes(2, b"drawn", &mut self.graph);
        message(|out| {
            number(1, 8, out);
            bytes(7, &self.graph, out);
            bytes(
                8,
                &message(|opset| {
                    bytes(1, b"", opset);
                    number(2, 17, opset);
                }),
                out,
            );
        })
    }
}
