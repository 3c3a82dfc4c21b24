//! The head of LightFC: the search image's features are compared with each pixel of the template's, the comparison is refined (the
//! paper's efficient cross-correlation, section 3.3), and three towers of full convolutions say score, size and offset.
//!
//! Filters that are added are one, and a factor a channel is a factor of the filter behind it.

use crate::Result;
use crate::backbone::FEATURES;
use crate::kernels::{
    Activation, Depthwise, DepthwiseShape, Excitation, Map, Pointwise, PointwiseInput, TOGETHER, Winograd,
    WinogradInput, means,
};
use crate::weights::{Layer, Weights};

/// Rows and columns of the search image's features and of the answer.
pub const SIDE: usize = 16;
/// Pixels of the template's features.
pub const TEMPLATE_PIXELS: usize = 64;

const POINTS: usize = SIDE * SIDE;
/// Channels between the layers of a tower.
const TOWER: [usize; 4] = [256, 128, 64, 32];

/// What search features are compared with: each of the 64 pixels of the template as a pointwise filter.
#[derive(Debug, Clone)]
pub struct Comparison {
    pixels: Pointwise,
    /// Its weights, in the order of a layer.
    layer: Layer,
}

impl Comparison {
    /// For the template's features, channel, row, column.
    pub fn new(features: &[f32]) -> Self {
        let at = |i: usize| features[i % FEATURES * TEMPLATE_PIXELS + i / FEATURES];
        let weights = (0..FEATURES * TEMPLATE_PIXELS).map(at).collect();
        let layer = Layer { weights, bias: vec![0.0; TEMPLATE_PIXELS] };
        Self { pixels: Pointwise::new(&layer.weights, &layer.bias, Activation::None), layer }
    }
}

/// Comparison, refinement and towers.
#[derive(Debug, Clone)]
pub struct Head {
    means: Vec<f32>,
    excitation: Excitation,
    /// The filter as trained, before the channels are weighed.
    trained: Vec<f32>,
    filter: Depthwise,
    compared: Map,
    filtered: Map,
    widen: Pointwise,
    wide: Map,
    narrow: Pointwise,
    refined: Map,
    out: Pointwise,
    relation: Map,
    /// Relation and search features, which all towers read.
    fused: WinogradInput,
    towers: [Tower; 3],
    scratch: Scratch,
}

/// Four convolutions and an output; the first's channels are weighed.
#[derive(Debug, Clone)]
struct Tower {
    layers: [Winograd; 4],
    excitation: Excitation,
    output: Pointwise,
    answer: Map,
}

/// What one layer of a tower gives and the next one reads.
#[derive(Debug, Clone)]
struct Scratch {
    maps: [Map; 4],
    inputs: [WinogradInput; 3],
}

impl Head {
    /// From the layers called `head.…`.
    pub fn new(weights: &Weights<'_>) -> Result<Self> {
        let mix = |layer: &str, inputs, outputs| weights.pointwise(&format!("head.relation.{layer}"), inputs, outputs);
        let linear = |layer: Layer| Pointwise::new(&layer.weights, &layer.bias, Activation::None);
        let filter = whole_filter(weights)?;
        let widen = mix("widen", TEMPLATE_PIXELS, 2 * TEMPLATE_PIXELS)?;
        let dense = |channels| Map::dense(channels, SIDE, SIDE);
        let squeeze = mix("squeeze", TEMPLATE_PIXELS, TEMPLATE_PIXELS)?;
        let input = |channels| WinogradInput::new(channels, SIDE, SIDE);
        Ok(Self {
            means: vec![0.0; FEATURES],
            excitation: Excitation::new(squeeze, mix("excite", TEMPLATE_PIXELS, TEMPLATE_PIXELS)?),
            filter: Depthwise::new(DepthwiseShape::Three, &filter.weights, &filter.bias, Activation::None),
            trained: filter.weights,
            compared: Map::padded(TOGETHER, SIDE, SIDE, 1, 3),
            filtered: dense(TEMPLATE_PIXELS),
            widen: Pointwise::new(&widen.weights, &widen.bias, Activation::Gelu),
            wide: dense(2 * TEMPLATE_PIXELS),
            narrow: linear(mix("narrow", 2 * TEMPLATE_PIXELS, TEMPLATE_PIXELS)?),
            refined: dense(TEMPLATE_PIXELS),
            out: linear(mix("out", TEMPLATE_PIXELS, FEATURES)?),
            relation: dense(FEATURES),
            fused: input(2 * FEATURES),
            towers: [
                Tower::new(weights, "score", 1, Activation::Probability)?,
                Tower::new(weights, "size", 2, Activation::Probability)?,
                Tower::new(weights, "offset", 2, Activation::None)?,
            ],
            scratch: Scratch { maps: TOWER.map(dense), inputs: [TOWER[0], TOWER[1], TOWER[2]].map(input) },
        })
    }

    /// The answer to the search image's features: scores, and sizes and offsets.
    pub fn run(&mut self, template: &Comparison, features: &mut Map, scores: &mut [f32], boxes: &mut [f32]) {
        self.relate(template, features);
        self.fused.set(0, &self.relation, None);
        self.fused.set(FEATURES, features, None);
        let [score, size, offset] = &mut self.towers;
        let (sizes, offsets) = boxes.split_at_mut(2 * POINTS);
        score.run(&mut self.fused, &mut self.scratch).copy_to(scores);
        size.run(&mut self.fused, &mut self.scratch).copy_to(sizes);
        offset.run(&mut self.fused, &mut self.scratch).copy_to(offsets);
    }

    /// Compares, and refines the comparison.
    fn relate(&mut self, template: &Comparison, features: &mut Map) {
        // The means of the comparison are the comparison of the means.
        means(features, &mut self.means);
        let factors = self.excitation.factors_of(&template.layer, &self.means);
        let filters = self.filter.weights_mut().chunks_exact_mut(9).zip(self.trained.chunks_exact(9));
        for ((now, trained), factor) in filters.zip(factors) {
            now.iter_mut().zip(trained).for_each(|(n, t)| *n = t * factor);
        }
        let mut input = PointwiseInput::plain(features);
        template.pixels.run_into(&mut input, &mut self.compared, &self.filter, &mut self.filtered, &(0..SIDE));
        self.widen.run(PointwiseInput::plain(&mut self.filtered), &mut self.wide);
        let wide = PointwiseInput { residual: Some(&self.filtered), ..PointwiseInput::plain(&mut self.wide) };
        self.narrow.run(wide, &mut self.refined);
        self.out.run(PointwiseInput::plain(&mut self.refined), &mut self.relation);
    }
}

/// A map itself, its filter of one pixel and its filter of 3 × 3, added: one filter of 3 × 3 a channel.
fn whole_filter(weights: &Weights<'_>) -> Result<Layer> {
    let mut filter = weights.depthwise("head.relation.depthwise", TEMPLATE_PIXELS, 3)?;
    let point = weights.depthwise("head.relation.point", TEMPLATE_PIXELS, 1)?;
    for (taps, weight) in filter.weights.chunks_exact_mut(9).zip(&point.weights) {
        taps[4] += 1.0 + weight;
    }
    filter.bias.iter_mut().zip(&point.bias).for_each(|(b, p)| *b += p);
    Ok(filter)
}

impl Tower {
    fn new(weights: &Weights<'_>, name: &str, outputs: usize, activation: Activation) -> Result<Self> {
        let of = |layer: &str| format!("head.{name}.{layer}");
        let layer = |n: usize, inputs| -> Result<Winograd> {
            let layer = weights.convolution(&of(&n.to_string()), inputs, TOWER[n])?;
            Ok(Winograd::new(&layer.weights, &layer.bias, Activation::Relu))
        };
        let squeeze = weights.pointwise(&of("squeeze"), TOWER[0], TOWER[0] / 4)?;
        let excite = weights.pointwise(&of("excite"), TOWER[0] / 4, TOWER[0])?;
        let output = weights.pointwise(&of("output"), TOWER[3], outputs)?;
        Ok(Self {
            layers: [layer(0, 2 * FEATURES)?, layer(1, TOWER[0])?, layer(2, TOWER[1])?, layer(3, TOWER[2])?],
            excitation: Excitation::new(squeeze, excite),
            output: Pointwise::new(&output.weights, &output.bias, activation),
            answer: Map::dense(outputs, SIDE, SIDE),
        })
    }

    fn run(&mut self, input: &mut WinogradInput, scratch: &mut Scratch) -> &Map {
        let Scratch { maps, inputs } = scratch;
        self.layers[0].run(input, &mut maps[0]);
        let factors = self.excitation.factors(&maps[0]);
        inputs[0].set(0, &maps[0], Some(factors));
        self.layers[1].run(&mut inputs[0], &mut maps[1]);
        inputs[1].set(0, &maps[1], None);
        self.layers[2].run(&mut inputs[1], &mut maps[2]);
        inputs[2].set(0, &maps[2], None);
        self.layers[3].run(&mut inputs[2], &mut maps[3]);
        self.output.run(PointwiseInput::plain(&mut maps[3]), &mut self.answer);
        &self.answer
    }
}
