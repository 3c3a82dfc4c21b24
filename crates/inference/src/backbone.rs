//! Inverted residual blocks up to stride 16: MobileNet v2 (Sandler et al. 2018, table 2) and MobileNet v3 small (Howard et al. 2019,
//! table 2), each up to the block that gives 96 channels.

use crate::Result;
use crate::kernels::{
    Activation, Convolution, Depthwise, DepthwiseShape, LANES, Map, Pointwise, PointwiseInput, SqueezeExcite, TOGETHER,
};
use crate::weights::{Layer, Weights};
use crate::written::Embedding;
use Activation::{HardSwish, None as Linear, Relu, Relu6};
use std::ops::Range;

/// Channels of the features.
pub const FEATURES: usize = 96;
const CHANNELS: usize = 3;
/// Rows of a band.
const BAND: usize = 16;

/// One row of a paper's table 2.
#[derive(Clone, Copy)]
pub struct BlockSpec {
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

/// A table.
#[derive(Clone, Copy)]
pub struct Architecture {
    /// Channels and activation of the first layer.
    stem: (usize, Activation),
    /// The first does not expand.
    blocks: &'static [BlockSpec],
}

impl Architecture {
    /// MobileNet v3 small.
    pub const MOBILENET_V3: Self = Self {
        stem: (16, HardSwish),
        blocks: &[
            block(3, 16, 16, 8, Relu, 2),
            block(3, 72, 24, 0, Relu, 2),
            block(3, 88, 24, 0, Relu, 1),
            block(5, 96, 40, 24, HardSwish, 2),
            block(5, 240, 40, 64, HardSwish, 1),
            block(5, 240, 40, 64, HardSwish, 1),
            block(5, 120, 48, 32, HardSwish, 1),
            block(5, 144, 48, 40, HardSwish, 1),
            block(5, 288, 96, 72, HardSwish, 1),
        ],
    };

    /// MobileNet v2.
    pub const MOBILENET_V2: Self = Self {
        stem: (32, Relu6),
        blocks: &[
            block(3, 32, 16, 0, Relu6, 1),
            block(3, 96, 24, 0, Relu6, 2),
            block(3, 144, 24, 0, Relu6, 1),
            block(3, 144, 32, 0, Relu6, 2),
            block(3, 192, 32, 0, Relu6, 1),
            block(3, 192, 32, 0, Relu6, 1),
            block(3, 192, 64, 0, Relu6, 2),
            block(3, 384, 64, 0, Relu6, 1),
            block(3, 384, 64, 0, Relu6, 1),
            block(3, 384, 64, 0, Relu6, 1),
            block(3, 384, 96, 0, Relu6, 1),
            block(3, 576, 96, 0, Relu6, 1),
            block(3, 576, 96, 0, Relu6, 1),
        ],
    };
}

/// The backbone, prepared for square images of one size.
#[derive(Debug, Clone)]
pub struct Backbone {
    image: Map,
    stem: Convolution,
    first: Filter,
    /// The projection of the first block, unless it is part of the second.
    first_project: Option<(Pointwise, Map)>,
    /// From the second on. Where that takes less time, the projection of the first and the expansion of the second are one layer,
    /// there being nothing between them.
    blocks: Vec<Block>,
}

/// Expand, filter each channel, weigh the channels, project.
#[derive(Debug, Clone)]
struct Block {
    expand: Pointwise,
    filter: Filter,
    project: Pointwise,
    is_residual: bool,
    out: Map,
}

/// Filter each channel, weigh the channels.
#[derive(Debug, Clone)]
struct Filter {
    /// What is filtered: all channels, or some at a time.
    expanded: Map,
    depthwise: Depthwise,
    filtered: Map,
    attention: Option<Attention>,
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
    pub fn new(weights: &Weights<'_>, architecture: Architecture, side: usize) -> Result<Self> {
        let (channels, activation) = architecture.stem;
        let blocks = architecture.blocks;
        let image = Map::split(CHANNELS, side, side, 1, 3);
        let stem = weights.layer("backbone.stem", &[channels, CHANNELS, 3, 3])?;
        let stem = Convolution::new(&stem.weights, &stem.bias, activation, &image);
        let mut side = side.div_ceil(2);
        let first = Filter::new(weights, blocks[0], 1, side, channels)?;
        let project = weights.pointwise(&name(1, "project"), blocks[0].expanded, blocks[0].out)?;
        // One layer instead of two has as many inputs as the first, and as many outputs as the second.
        let is_merged = blocks[0].expanded <= blocks[0].out;
        let first_project = (!is_merged).then(|| {
            let side = side.div_ceil(blocks[0].stride);
            (pointwise(&project, Linear), Map::dense(blocks[0].out, side, side))
        });
        let mut made = Vec::with_capacity(blocks.len() - 1);
        for (i, pair) in blocks.windows(2).enumerate() {
            side = side.div_ceil(pair[0].stride);
            let merged = (i == 0 && is_merged).then_some(&project);
            made.push(Block::new(weights, i + 2, (pair[0], pair[1]), merged, side)?);
        }
        Ok(Self { image, stem, first, first_project, blocks: made })
    }

    /// What [`run`](Embedding::run) gave last.
    pub fn features(&self) -> Option<&Map> {
        self.blocks.last().map(|block| &block.out)
    }
}

impl Embedding for Backbone {
    fn image_mut(&mut self) -> &mut Map {
        &mut self.image
    }

    /// 96 channels at a sixteenth of its size.
    fn run(&mut self) -> &mut Map {
        let mut input = self.first.run_behind(&self.stem, &self.image, &mut self.first_project);
        for block in &mut self.blocks {
            input = PointwiseInput::plain(block.run(input));
        }
        input.map
    }
}

/// `height` rows in bands of [`BAND`], or in one if they are few: what a band of a large map reads and writes stays in the nearest caches
/// from one layer to the next, but the rows around it are made twice.
fn bands(height: usize) -> impl Iterator<Item = Range<usize>> {
    let count = if height < 4 * BAND { 1 } else { height / BAND };
    (0..count).map(move |i| i * height / count..(i + 1) * height / count)
}

impl Block {
    /// The block of this number, behind the one `before`, for maps of `side` × `side`; `merged` is a layer in front of it that is
    /// made part of it.
    fn new(
        weights: &Weights<'_>,
        number: usize,
        (before, spec): (BlockSpec, BlockSpec),
        merged: Option<&Layer>,
        side: usize,
    ) -> Result<Self> {
        let mut expand = weights.pointwise(&name(number, "expand"), before.out, spec.expanded)?;
        if let Some(first) = merged {
            expand = first.then(&expand);
        }
        let out_side = side.div_ceil(spec.stride);
        Ok(Self {
            expand: pointwise(&expand, spec.activation),
            filter: Filter::new(weights, spec, number, side, TOGETHER)?,
            project: pointwise(&weights.pointwise(&name(number, "project"), spec.expanded, spec.out)?, Linear),
            is_residual: spec.stride == 1 && before.out == spec.out,
            out: Map::dense(spec.out, out_side, out_side),
        })
    }

    fn run(&mut self, mut input: PointwiseInput<'_>) -> &mut Map {
        if self.filter.attention.is_some() {
            let mut filtered = self.filter.run_on(&self.expand, &mut input);
            filtered.residual = self.is_residual.then_some(&*input.map);
            self.project.run(filtered, &mut self.out);
            return &mut self.out;
        }
        let Filter { expanded, depthwise, filtered, .. } = &mut self.filter;
        for rows in bands(filtered.height) {
            self.expand.run_into(&mut input, expanded, depthwise, filtered, &rows);
            let residual = self.is_residual.then_some(&*input.map);
            self.project.run_rows(PointwiseInput { residual, ..PointwiseInput::plain(filtered) }, &mut self.out, rows);
        }
        &mut self.out
    }
}

impl Filter {
    /// That of the block of this number, for maps of `side` × `side` and `together` channels at a time.
    fn new(weights: &Weights<'_>, spec: BlockSpec, number: usize, side: usize, together: usize) -> Result<Self> {
        let layer = weights.depthwise(&name(number, "depthwise"), spec.expanded, spec.side)?;
        // The squeezed blocks with hard swish apply it after the weighing.
        let gate = if spec.squeezed > 0 && spec.activation == HardSwish { HardSwish } else { Linear };
        let direct = if gate == HardSwish { Linear } else { spec.activation };
        let (shape, expanded) = match (spec.side, spec.stride) {
            (3, 1) => (DepthwiseShape::Three, Map::padded(together, side, side, 1, 3)),
            (3, _) => (DepthwiseShape::ThreeByTwo, Map::split(together, side, side, 1, 3)),
            (_, 1) => (DepthwiseShape::Five, Map::padded(together, side, side, 2, 5)),
            (_, _) => (DepthwiseShape::FiveByTwo, Map::split(together, side, side, 2, 5)),
        };
        let side = side.div_ceil(spec.stride);
        Ok(Self {
            expanded,
            depthwise: Depthwise::new(shape, &layer.weights, &layer.bias, direct),
            filtered: Map::dense(spec.expanded, side, side),
            attention: Attention::new(weights, number, spec, gate)?,
        })
    }

    /// Filters what `stem` makes of `image`, and projects it if there is a layer that does.
    fn run_behind<'a>(
        &'a mut self,
        stem: &Convolution,
        image: &Map,
        project: &'a mut Option<(Pointwise, Map)>,
    ) -> PointwiseInput<'a> {
        let mut made = 0;
        for rows in bands(self.filtered.height) {
            let reach = self.depthwise.reach(&rows, &self.expanded);
            stem.run_rows(image, &mut self.expanded, made..reach.end);
            made = reach.end;
            self.depthwise.run_rows(&self.expanded, &mut self.filtered, rows.clone());
            if let Some((project, out)) = project {
                project.run_rows(PointwiseInput::plain(&mut self.filtered), out, rows);
            }
        }
        match project {
            Some((_, out)) => PointwiseInput::plain(out),
            None => self.weighed(),
        }
    }

    /// Filters what `expand` makes of `input`.
    fn run_on(&mut self, expand: &Pointwise, input: &mut PointwiseInput<'_>) -> PointwiseInput<'_> {
        for rows in bands(self.filtered.height) {
            expand.run_into(input, &mut self.expanded, &self.depthwise, &mut self.filtered, &rows);
        }
        self.weighed()
    }

    /// What was filtered and the factors of its channels.
    fn weighed(&mut self) -> PointwiseInput<'_> {
        self.depthwise.sum_up(&self.filtered, self.attention.as_mut().map(|a| a.sums.as_mut_slice()));
        let map = &mut self.filtered;
        let gate = self.attention.as_mut().map(|a| {
            let (columns, pixels) = (map.width, map.width * map.height);
            (a.squeeze.factors(&a.sums, columns, pixels), a.activation)
        });
        PointwiseInput { map, more: None, gate, residual: None }
    }
}

impl Attention {
    fn new(weights: &Weights<'_>, number: usize, spec: BlockSpec, activation: Activation) -> Result<Option<Self>> {
        if spec.squeezed == 0 {
            return Ok(None);
        }
        let (channels, hidden) = (spec.expanded, spec.squeezed);
        let squeeze = weights.layer(&name(number, "squeeze"), &[hidden, channels])?;
        let excite = weights.layer(&name(number, "excite"), &[channels, hidden])?;
        let squeeze = SqueezeExcite::new(&squeeze.weights, &squeeze.bias, &excite.weights, &excite.bias);
        Ok(Some(Self { squeeze, sums: vec![0.0; channels * LANES], activation }))
    }
}

fn name(number: usize, layer: &str) -> String {
    format!("backbone.{number}.{layer}")
}

fn pointwise(layer: &Layer, activation: Activation) -> Pointwise {
    Pointwise::new(&layer.weights, &layer.bias, activation)
}
