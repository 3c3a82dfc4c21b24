use super::{CHANNELS, COLUMNS, ROWS};
use crate::Result;
use crate::kernels::{Activation, Map, Pointwise, PointwiseInput, Winograd, WinogradInput};
use crate::weights::Weights;

/// Channels behind the four layers of a tower.
const WIDTHS: [usize; 4] = [32, 16, 8, 4];

/// Score, size or offset of each point, by four convolutions and an output.
#[derive(Debug, Clone)]
pub struct Tower {
    layers: Vec<Winograd>,
    output: Pointwise,
    answer: Map,
}

/// What the towers read and overwrite.
#[derive(Debug, Clone)]
pub struct Scratch {
    /// What each layer reads.
    inputs: Vec<WinogradInput>,
    maps: Vec<Map>,
}

impl Scratch {
    /// For all points.
    pub fn new() -> Self {
        let inputs = [CHANNELS, WIDTHS[0], WIDTHS[1], WIDTHS[2]];
        Self {
            inputs: inputs.map(|channels| WinogradInput::new(channels, ROWS[1], COLUMNS)).to_vec(),
            maps: WIDTHS.map(|channels| Map::dense(channels, ROWS[1], COLUMNS)).to_vec(),
        }
    }
}

impl Tower {
    /// The tower `name` with `outputs` numbers a point.
    pub fn new(weights: &Weights<'_>, name: &str, outputs: usize) -> Result<Self> {
        let layers: Result<Vec<Winograd>> = (0..WIDTHS.len())
            .map(|n| {
                let inputs = if n == 0 { CHANNELS } else { WIDTHS[n - 1] };
                let layer = weights.convolution(&format!("head.{name}.{n}"), inputs, WIDTHS[n])?;
                Ok(Winograd::new(&layer.weights, &layer.bias, Activation::Relu))
            })
            .collect();
        let output = weights.pointwise(&format!("head.{name}.output"), WIDTHS[3], outputs)?;
        let activation = if name == "offset" { Activation::None } else { Activation::Probability };
        Ok(Self {
            layers: layers?,
            output: Pointwise::new(&output.weights, &output.bias, activation),
            answer: Map::dense(outputs, ROWS[1], COLUMNS),
        })
    }

    fn run(&mut self, Scratch { inputs, maps }: &mut Scratch) -> &Map {
        for (n, (layer, map)) in self.layers.iter().zip(&mut *maps).enumerate() {
            layer.run(&mut inputs[n], map);
            if let Some(next) = inputs.get_mut(n + 1) {
                next.set(0, map, None);
            }
        }
        self.output.run(PointwiseInput::plain(&mut maps[WIDTHS.len() - 1]), &mut self.answer);
        &self.answer
    }
}

/// What score, size and offset are by the features of the points, to the three of `answers`.
pub fn run(towers: &mut [Tower; 3], features: &Map, scratch: &mut Scratch, answers: [&mut [f32]; 3]) {
    scratch.inputs[0].set(0, features, None);
    for (tower, answer) in towers.iter_mut().zip(answers) {
        tower.run(scratch).copy_to(answer);
    }
}
