//! The head of NanoTrack v3: for the score and for the box one branch, in which the features of the search image are
//! compared with those of the template in two ways, pixel by pixel (Yan et al. 2021, AlphaRefine, section 3.2) and
//! channel by channel (Li et al. 2019, SiamRPN++, section 3.3), before six separable convolutions.
//!
//! What depends on the template alone is worked out when the template is set, and linear layers that follow each other
//! without anything between them are merged, so that a frame costs less than the published graph: the result is the
//! same up to rounding.

use crate::Result;
use crate::backbone::FEATURES;
use crate::kernels::{Activation, Depthwise, DepthwiseShape, Excitation, Map, Pointwise, PointwiseInput, TOGETHER};
use crate::weights::{Layer, Weights};

/// Rows and columns of the template's features.
pub const TEMPLATE_SIDE: usize = 8;
/// Rows and columns of the search image's features.
pub const SEARCH_SIDE: usize = 16;
/// Rows and columns of the answer.
pub const ANSWER_SIDE: usize = 15;

const TEMPLATE_PIXELS: usize = TEMPLATE_SIDE * TEMPLATE_SIDE;
/// The correlation kernels are the middle 4 × 4 of the template.
const KERNEL_SIDE: usize = 4;
const KERNEL_PIXELS: usize = KERNEL_SIDE * KERNEL_SIDE;
const TOWER: usize = 6;

/// One of the two branches.
#[derive(Debug, Clone)]
pub struct Branch {
    layers: TemplateLayers,
    excitation: Excitation,
    pixelwise: Pixelwise,
    correlation: Correlation,
    /// The reduction and the tower: a layer that mixes the channels and one that filters each.
    stages: Vec<(Pointwise, Depthwise)>,
    output: Pointwise,
    mixed: Map,
    /// What one stage gives and the next one reads, by turns.
    filtered: [Map; 2],
    answer: Map,
}

/// Layers whose input is the template, and those merged with it.
#[derive(Debug, Clone)]
struct TemplateLayers {
    pixelwise: Layer,
    pixelwise_search: Layer,
    correlation: Layer,
}

/// What a branch compares the search features with.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Each of the 64 pixels of the template as a pointwise filter.
    pixels: Pointwise,
    /// Its weights and bias, in the order of a layer.
    pixel_layer: Layer,
    /// The middle of the template as a depthwise filter.
    middle: Depthwise,
}

/// The comparison pixel by pixel.
#[derive(Debug, Clone)]
struct Pixelwise {
    compared: Map,
    /// The 2 × 2 filters as trained, before the channels are weighed.
    trained: Vec<f32>,
    depthwise: Depthwise,
    out: Map,
}

/// The comparison channel by channel.
#[derive(Debug, Clone)]
struct Correlation {
    search: Pointwise,
    mixed: Map,
    out: Map,
}

impl Branch {
    /// The branch `name` (`score` or `box`) with `outputs` numbers a point.
    pub fn new(weights: &Weights<'_>, name: &str, outputs: usize) -> Result<Self> {
        let of = |layer: &str| format!("head.{name}.{layer}");
        let square = |layer: &str| weights.pointwise(&of(layer), FEATURES, FEATURES);
        let layers = TemplateLayers {
            pixelwise: square("pixelwise.template")?,
            pixelwise_search: square("pixelwise.search")?,
            correlation: square("correlation.template")?,
        };
        let pixelwise =
            |layer: &str| weights.pointwise(&of(&format!("pixelwise.{layer}")), TEMPLATE_PIXELS, TEMPLATE_PIXELS);
        let mix = pixelwise("mix")?;
        let reduce = weights.pointwise(&of("reduce"), TEMPLATE_PIXELS + FEATURES, FEATURES)?;
        let from_pixels = mix.then(&reduce.columns(0, TEMPLATE_PIXELS));
        let from_channels = reduce.columns(TEMPLATE_PIXELS, TEMPLATE_PIXELS + FEATURES).unbiased();
        let mut mix = from_pixels.beside(&from_channels);
        let mut stages = Vec::with_capacity(TOWER);
        for n in 0..TOWER {
            let filter = weights.depthwise(&of(&format!("tower.{n}.depthwise")), FEATURES, 3)?;
            let filter = Depthwise::new(DepthwiseShape::Three, &filter.weights, &filter.bias, Activation::Relu6);
            stages.push((pointwise(&mix), filter));
            mix = square(&format!("tower.{n}.pointwise"))?;
        }
        let output = mix.then(&weights.pointwise(&of("output"), FEATURES, outputs)?);
        let filtered = Map::dense(FEATURES, ANSWER_SIDE, ANSWER_SIDE);
        Ok(Self {
            layers,
            excitation: Excitation::new(pixelwise("squeeze")?, pixelwise("excite")?),
            pixelwise: Pixelwise::new(weights.depthwise(&of("pixelwise.depthwise"), TEMPLATE_PIXELS, 2)?),
            correlation: Correlation::new(&square("correlation.search")?),
            stages,
            output: pointwise(&output),
            mixed: Map::padded(TOGETHER, ANSWER_SIDE, ANSWER_SIDE, 1, 3),
            filtered: [filtered.clone(), filtered],
            answer: Map::dense(outputs, ANSWER_SIDE, ANSWER_SIDE),
        })
    }

    /// What is compared with, for the template's features, channel, row, column.
    pub fn comparison(&self, features: &[f32]) -> Comparison {
        let pixels = applied(&self.layers.pixelwise, features, TEMPLATE_PIXELS);
        // Comparison = Zᵀ(W x + b) = (ZᵀW) x + Zᵀb, with the template's pixels as the columns of Z.
        let transposed = Layer {
            weights: (0..FEATURES * TEMPLATE_PIXELS)
                .map(|i| pixels[i % FEATURES * TEMPLATE_PIXELS + i / FEATURES])
                .collect(),
            bias: vec![0.0; TEMPLATE_PIXELS],
        };
        let pixel_layer = self.layers.pixelwise_search.then(&transposed);

        let first = (TEMPLATE_SIDE - KERNEL_SIDE) / 2;
        let middle: Vec<f32> = (0..FEATURES * KERNEL_PIXELS)
            .map(|i| (i / KERNEL_PIXELS, first + i / KERNEL_SIDE % KERNEL_SIDE, first + i % KERNEL_SIDE))
            .map(|(c, y, x)| features[(c * TEMPLATE_SIDE + y) * TEMPLATE_SIDE + x])
            .collect();
        let kernels = applied(&self.layers.correlation, &middle, KERNEL_PIXELS);
        let middle = Depthwise::new(DepthwiseShape::Four, &kernels, &[0.0; FEATURES], Activation::None);
        Comparison { pixels: pointwise(&pixel_layer), pixel_layer, middle }
    }

    /// The answer to the search image's features, whose means over the pixels are `means`, beside a template's.
    pub fn run(&mut self, template: &Comparison, features: &mut Map, means: &[f32]) -> &Map {
        let factors = self.excitation.factors_of(&template.pixel_layer, means);
        self.pixelwise.run(&template.pixels, features, factors);
        self.correlation.run(&template.middle, features);
        let [mut from, mut to] = self.filtered.each_mut();
        for (n, (mix, filter)) in self.stages.iter().enumerate() {
            let mut input = match n {
                0 => PointwiseInput {
                    more: Some(&self.correlation.out),
                    ..PointwiseInput::plain(&mut self.pixelwise.out)
                },
                _ => PointwiseInput::plain(from),
            };
            mix.run_into(&mut input, &mut self.mixed, filter, to, &(0..ANSWER_SIDE));
            std::mem::swap(&mut from, &mut to);
        }
        self.output.run(PointwiseInput::plain(from), &mut self.answer);
        &self.answer
    }
}

impl Pixelwise {
    fn new(filter: Layer) -> Self {
        Self {
            compared: Map::padded(TOGETHER, SEARCH_SIDE, SEARCH_SIDE, 0, 2),
            depthwise: Depthwise::new(DepthwiseShape::Two, &filter.weights, &filter.bias, Activation::Relu6),
            trained: filter.weights,
            out: Map::dense(TEMPLATE_PIXELS, ANSWER_SIDE, ANSWER_SIDE),
        }
    }

    fn run(&mut self, pixels: &Pointwise, features: &mut Map, factors: &[f32]) {
        // A channel's factor times its pixels is the factor times its filter.
        let filters = self.depthwise.weights_mut().chunks_exact_mut(4).zip(self.trained.chunks_exact(4));
        for ((now, trained), factor) in filters.zip(factors) {
            now.iter_mut().zip(trained).for_each(|(n, t)| *n = t * factor);
        }
        let mut input = PointwiseInput::plain(features);
        pixels.run_into(&mut input, &mut self.compared, &self.depthwise, &mut self.out, &(0..ANSWER_SIDE));
    }
}

impl Correlation {
    fn new(search: &Layer) -> Self {
        Self {
            search: pointwise(search),
            mixed: Map::padded(TOGETHER, SEARCH_SIDE, SEARCH_SIDE, 1, KERNEL_SIDE),
            out: Map::dense(FEATURES, ANSWER_SIDE, ANSWER_SIDE),
        }
    }

    fn run(&mut self, middle: &Depthwise, features: &mut Map) {
        self.search.run_into(
            &mut PointwiseInput::plain(features),
            &mut self.mixed,
            middle,
            &mut self.out,
            &(0..ANSWER_SIDE),
        );
    }
}

/// W X + b of `pixels` pixels, channel by channel: only for templates, which are small and rare.
fn applied(layer: &Layer, x: &[f32], pixels: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(layer.bias.len() * pixels);
    for (row, &bias) in layer.weights.chunks_exact(layer.inputs()).zip(&layer.bias) {
        let mut sums = vec![bias; pixels];
        for (w, x) in row.iter().zip(x.chunks_exact(pixels)) {
            sums.iter_mut().zip(x).for_each(|(s, x)| *s += w * x);
        }
        out.extend(sums);
    }
    out
}

fn pointwise(layer: &Layer) -> Pointwise {
    Pointwise::new(&layer.weights, &layer.bias, Activation::None)
}
