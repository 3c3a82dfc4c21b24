use super::{CHANNELS, COLUMNS, TOKEN_ROWS};
use crate::Result;
use crate::kernels::{Activation, Attention, LayerNorm, Map, Pointwise, PointwiseInput};
use crate::weights::Weights;
use std::ops::Range;

/// Channels between the two layers behind the attention.
const HIDDEN: usize = 4 * CHANNELS;

/// One layer of a transformer with one head (Vaswani et al. 2017), normalised in front of its parts (Xiong et al. 2020).
#[derive(Debug, Clone)]
pub struct Block {
    norms: [LayerNorm; 2],
    /// Queries, keys and values; the queries divided by the square root of their number.
    question: Pointwise,
    project: Pointwise,
    widen: Pointwise,
    narrow: Pointwise,
}

/// What all blocks overwrite.
#[derive(Debug, Clone)]
pub struct Scratch {
    normal: Map,
    questions: Map,
    attention: Attention,
    attended: Map,
    wide: Map,
    tokens: Map,
}

impl Scratch {
    /// For all tokens.
    pub fn new() -> Self {
        let map = |channels| Map::dense(channels, TOKEN_ROWS, COLUMNS);
        Self {
            normal: map(CHANNELS),
            questions: map(3 * CHANNELS),
            attention: Attention::new(TOKEN_ROWS * COLUMNS, CHANNELS),
            attended: map(CHANNELS),
            wide: map(HIDDEN),
            tokens: map(CHANNELS),
        }
    }
}

impl Block {
    /// Block `number`, from 0.
    pub fn new(weights: &Weights<'_>, number: usize) -> Result<Self> {
        let name = |layer: &str| format!("blocks.{number}.{layer}");
        let norm = |layer: &str| -> Result<LayerNorm> {
            let layer = weights.layer(&name(layer), &[CHANNELS])?;
            Ok(LayerNorm::new(layer.weights, layer.bias))
        };
        let mix = |layer: &str, inputs: usize, outputs: usize| weights.layer(&name(layer), &[outputs, inputs]);
        let mut question = mix("question", CHANNELS, 3 * CHANNELS)?;
        let root = (CHANNELS as f32).sqrt();
        question.weights[..CHANNELS * CHANNELS].iter_mut().for_each(|w| *w /= root);
        question.bias[..CHANNELS].iter_mut().for_each(|b| *b /= root);
        let (project, widen) = (mix("project", CHANNELS, CHANNELS)?, mix("widen", CHANNELS, HIDDEN)?);
        let narrow = mix("narrow", HIDDEN, CHANNELS)?;
        Ok(Self {
            norms: [norm("norm1")?, norm("norm2")?],
            question: Pointwise::new(&question.weights, &question.bias, Activation::None),
            project: Pointwise::new(&project.weights, &project.bias, Activation::None),
            widen: Pointwise::new(&widen.weights, &widen.bias, Activation::Gelu),
            narrow: Pointwise::new(&narrow.weights, &narrow.bias, Activation::None),
        })
    }

    /// What becomes of the tokens in rows `rows`, beside all others.
    pub fn run(&self, tokens: &mut Map, rows: Range<usize>, scratch: &mut Scratch) {
        let Scratch { normal, questions, attention, attended, wide, tokens: next } = scratch;
        self.norms[0].run(tokens, 0..TOKEN_ROWS, (normal, 0));
        self.question.run(PointwiseInput::plain(normal), questions);
        attention.run(questions, rows.clone(), attended);
        let residual = PointwiseInput { residual: Some(&*tokens), ..PointwiseInput::plain(attended) };
        self.project.run_rows(residual, next, rows.clone());
        self.norms[1].run(next, rows.clone(), (normal, rows.start));
        self.widen.run_rows(PointwiseInput::plain(normal), wide, rows.clone());
        let residual = PointwiseInput { residual: Some(&*next), ..PointwiseInput::plain(wide) };
        self.narrow.run_rows(residual, tokens, rows);
    }
}
