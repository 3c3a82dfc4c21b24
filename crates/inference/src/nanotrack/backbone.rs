//! The backbone of NanoTrack v3: MobileNet v3 small (Howard et al. 2019, table 2) up to its ninth block and stride 16,
//! whose last block gives 96 channels.

use super::weights::{Layer, Weights};
use crate::Result;
use crate::kernels::{
    Activation, Depthwise, DepthwiseShape, LANES, Map, Pointwise, PointwiseInput, SqueezeExcite, Stem,
};
use Activation::{HardSwish, None as Linear, Relu};

/// Channels of the features.
pub const FEATURES: usize = 96;
const STEM: usize = 16;
const CHANNELS: usize = 3;

/// One row of the paper's table 2.
#[derive(Clone, Copy)]
struct BlockSpec {
    side: usize,
    expanded: usize,
    out: usize,
    /// Hidden units of squeeze-and-excite, or 0.
    squeezed: usize,
    activation: Activation,
    stride: usize,
}

const fn block(
    side: usize,
    expanded: usize,
    out: usize,
    squeezed: usize,
    activation: Activation,
    stride: usize,
) -> BlockSpec {
    BlockSpec { side, expanded, out, squeezed, activation, stride }
}

const BLOCKS: [BlockSpec; 9] = [
    block(3, 16, 16, 8, Relu, 2),
    block(3, 72, 24, 0, Relu, 2),
    block(3, 88, 24, 0, Relu, 1),
    block(5, 96, 40, 24, HardSwish, 2),
    block(5, 240, 40, 64, HardSwish, 1),
    block(5, 240, 40, 64, HardSwish, 1),
    block(5, 120, 48, 32, HardSwish, 1),
    block(5, 144, 48, 40, HardSwish, 1),
    block(5, 288, 96, 72, HardSwish, 1),
];

/// The backbone, prepared for square images of one size.
#[derive(Debug, Clone)]
pub struct Backbone {
    image: Map,
    stem: Stem,
    blocks: Vec<Block>,
    /// `dense[n]` is what block n reads and block n − 1 writes; the last are the features.
    dense: Vec<Map>,
}

/// Expand, filter each channel, weigh the channels, project.
#[derive(Debug, Clone)]
struct Block {
    /// `None` where the projection of the block before is merged with it, there being nothing between them.
    expand: Option<Pointwise>,
    expanded: Map,
    depthwise: Depthwise,
    filtered: Map,
    attention: Option<Attention>,
    project: Pointwise,
    is_residual: bool,
}

#[derive(Debug, Clone)]
struct Attention {
    squeeze: SqueezeExcite,
    sums: Vec<f32>,
    /// What follows the weighing.
    activation: Activation,
}

impl Backbone {
    /// For images of `side` × `side` pixels.
    pub fn new(weights: &Weights<'_>, side: usize) -> Result<Self> {
        let image = Map::split(CHANNELS, side, side, 1, 3);
        let stem = weights.layer("backbone.stem", &[STEM, CHANNELS, 3, 3])?;
        let stem = Stem::new(&stem.weights, &stem.bias, HardSwish, &image);
        let (mut side, mut channels) = (side.div_ceil(2), STEM);
        let (mut blocks, mut dense) = (Vec::with_capacity(BLOCKS.len()), Vec::with_capacity(BLOCKS.len() + 1));
        for (number, spec) in (1..).zip(BLOCKS) {
            dense.push(Map::dense(channels, side, side));
            blocks.push(Block::new(weights, number, spec, channels, side)?);
            (channels, side) = (spec.out, side.div_ceil(spec.stride));
        }
        dense.push(Map::dense(channels, side, side));
        Ok(Self { image, stem, blocks, dense })
    }

    /// The image, to be written before [`run`](Self::run): blue, green and red from 0 to 255.
    pub const fn image_mut(&mut self) -> &mut Map {
        &mut self.image
    }

    /// The features of the image: 96 channels at a sixteenth of its size.
    pub fn run(&mut self) -> &mut Map {
        self.stem.run(&self.image, &mut self.blocks[0].expanded);
        for n in 0..self.blocks.len() {
            let (until, after) = self.blocks.split_at_mut(n + 1);
            let (input, output) = self.dense.split_at_mut(n + 1);
            // Two linear layers meet after the first block, and are one.
            let out = if n == 0 { &mut after[0].expanded } else { &mut output[0] };
            until[n].run(&mut input[n], out);
        }
        &mut self.dense[BLOCKS.len()]
    }
}

impl Block {
    fn new(weights: &Weights<'_>, number: usize, spec: BlockSpec, inputs: usize, side: usize) -> Result<Self> {
        let name = |layer: &str| format!("backbone.{number}.{layer}");
        let expand = match number {
            1 | 2 => None,
            _ => Some(pointwise(weights.pointwise(&name("expand"), inputs, spec.expanded)?, spec.activation)),
        };
        let filter = weights.depthwise(&name("depthwise"), spec.expanded, spec.side)?;
        // The squeezed blocks with hard swish apply it after the weighing.
        let gate = if spec.squeezed > 0 && spec.activation == HardSwish { HardSwish } else { Linear };
        let direct = if gate == HardSwish { Linear } else { spec.activation };
        let project = weights.pointwise(&name("project"), spec.expanded, spec.out)?;
        let project = match number {
            1 => {
                let next = BLOCKS[1];
                let expand = weights.pointwise("backbone.2.expand", spec.out, next.expanded)?;
                pointwise(project.then(&expand), next.activation)
            }
            _ => pointwise(project, Linear),
        };
        let (shape, expanded) = match (spec.side, spec.stride) {
            (3, 1) => (DepthwiseShape::Three, Map::padded(spec.expanded, side, side, 1, 3)),
            (3, _) => (DepthwiseShape::ThreeByTwo, Map::split(spec.expanded, side, side, 1, 3)),
            (_, 1) => (DepthwiseShape::Five, Map::padded(spec.expanded, side, side, 2, 5)),
            (_, _) => (DepthwiseShape::FiveByTwo, Map::split(spec.expanded, side, side, 2, 5)),
        };
        let out_side = side.div_ceil(spec.stride);
        Ok(Self {
            expand,
            expanded,
            depthwise: Depthwise::new(shape, &filter.weights, &filter.bias, direct),
            filtered: Map::dense(spec.expanded, out_side, out_side),
            attention: Attention::new(weights, number, spec, gate)?,
            project,
            is_residual: spec.stride == 1 && inputs == spec.out,
        })
    }

    fn run(&mut self, input: &mut Map, out: &mut Map) {
        if let Some(expand) = &self.expand {
            expand.run(PointwiseInput::plain(input), &mut self.expanded);
        }
        let sums = self.attention.as_mut().map(|a| a.sums.as_mut_slice());
        self.depthwise.run(&self.expanded, &mut self.filtered, sums);
        let gate = self.attention.as_mut().map(|a| {
            let (columns, pixels) = (self.filtered.width, self.filtered.width * self.filtered.height);
            (a.squeeze.factors(&a.sums, columns, pixels), a.activation)
        });
        let residual = self.is_residual.then_some(&*input);
        self.project.run(PointwiseInput { map: &mut self.filtered, more: None, gate, residual }, out);
    }
}

impl Attention {
    fn new(weights: &Weights<'_>, number: usize, spec: BlockSpec, activation: Activation) -> Result<Option<Self>> {
        if spec.squeezed == 0 {
            return Ok(None);
        }
        let (channels, hidden) = (spec.expanded, spec.squeezed);
        let squeeze = weights.layer(&format!("backbone.{number}.squeeze"), &[hidden, channels])?;
        let excite = weights.layer(&format!("backbone.{number}.excite"), &[channels, hidden])?;
        let squeeze = SqueezeExcite::new(&squeeze.weights, &squeeze.bias, &excite.weights, &excite.bias);
        Ok(Some(Self { squeeze, sums: vec![0.0; channels * LANES], activation }))
    }
}

fn pointwise(layer: Layer, activation: Activation) -> Pointwise {
    Pointwise::new(&layer.weights, &layer.bias, activation)
}
