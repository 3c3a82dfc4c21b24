//! The layers of VitTrack.

use super::block::{self, Block};
use super::head::{self, Tower};
use super::stem::Stem;
use super::{CHANNELS, COLUMNS, POINTS, ROWS, TOKEN_ROWS};
use crate::Result;
use crate::kernels::{LayerNorm, Map};
use crate::shared::{Layers, Slot};
use crate::weights::Weights;
use crate::written::{Embedding, Network};
use std::ops::Range;

/// The weights (Apache-2.0; `weights/vittrack/ORIGIN.md`).
const WEIGHTS: &[u8] = include_bytes!("../../weights/vittrack/vittrack.safetensors");

/// All layers, and the maps that they overwrite.
#[derive(Debug, Clone)]
pub struct Engine {
    template: Stem,
    search: Stem,
    /// Where the tokens of template and search image are: channel, token.
    positions: [Vec<f32>; 2],
    tokens: Map,
    /// The search image's features in channel, row, column order.
    image: Vec<f32>,
    blocks: Vec<Block>,
    scratch: block::Scratch,
    norm: LayerNorm,
    features: Map,
    /// Score, size, offset.
    towers: [Tower; 3],
    between: head::Scratch,
}

thread_local! {
    static ENGINE: Slot<Engine> = const { Slot::empty() };
}

impl Layers for Engine {
    const SLOT: &'static std::thread::LocalKey<Slot<Self>> = &ENGINE;

    fn new() -> Result<Self> {
        let weights = Weights::read("vittrack", WEIGHTS)?;
        let norm = weights.layer("norm", &[CHANNELS])?;
        let [template, search] = ROWS.map(|rows| [CHANNELS, rows * COLUMNS]);
        let blocks: Result<Vec<Block>> = (0..3).map(|n| Block::new(&weights, n)).collect();
        Ok(Self {
            template: Stem::new(&weights, Self::TEMPLATE_SIDE)?,
            search: Stem::new(&weights, Self::SEARCH_SIDE)?,
            positions: [weights.numbers("position.template", &template)?, weights.numbers("position.search", &search)?],
            tokens: Map::dense(CHANNELS, TOKEN_ROWS, COLUMNS),
            image: vec![0.0; CHANNELS * POINTS],
            blocks: blocks?,
            scratch: block::Scratch::new(),
            norm: LayerNorm::new(norm.weights, norm.bias),
            features: Map::dense(CHANNELS, ROWS[1], COLUMNS),
            towers: [
                Tower::new(&weights, "score", 1)?,
                Tower::new(&weights, "size", 2)?,
                Tower::new(&weights, "offset", 2)?,
            ],
            between: head::Scratch::new(),
        })
    }
}

impl Network for Engine {
    const NAME: &'static str = "vittrack";
    const TEMPLATE_SIDE: usize = 128;
    const SEARCH_SIDE: usize = 256;
    const ANSWER_SIDE: usize = ROWS[1];
    const TEMPLATE_LEN: usize = CHANNELS * COLUMNS * ROWS[0];
    const SCORES: usize = 1;

    /// The features themselves.
    type Comparison = Vec<f32>;
    type Embedding = Stem;

    fn embeddings(&mut self) -> (&mut Stem, &mut Stem) {
        (&mut self.template, &mut self.search)
    }

    fn comparison(&self, features: &[f32]) -> Vec<f32> {
        features.to_vec()
    }

    fn search(&mut self, template: &Vec<f32>, scores: &mut [f32], boxes: &mut [f32]) {
        let Self { search, positions, tokens, image, blocks, scratch, norm, features, towers, between, .. } = self;
        place(template, &positions[0], tokens, 0..ROWS[0]);
        search.run().copy_to(image);
        place(image, &positions[1], tokens, ROWS[0]..TOKEN_ROWS);
        let last = blocks.len() - 1;
        for (n, block) in blocks.iter().enumerate() {
            // Behind the last block nobody looks at the template's tokens.
            let rows = if n == last { ROWS[0]..TOKEN_ROWS } else { 0..TOKEN_ROWS };
            block.run(tokens, rows, scratch);
        }
        norm.run(tokens, ROWS[0]..TOKEN_ROWS, (features, 0));
        let (sizes, offsets) = boxes.split_at_mut(2 * POINTS);
        head::run(towers, features, between, [scores, sizes, offsets]);
    }
}

/// Writes features and their positions, added, to rows `rows` of the tokens.
fn place(features: &[f32], positions: &[f32], tokens: &mut Map, rows: Range<usize>) {
    let count = rows.len() * COLUMNS;
    let planes = || features.chunks_exact(count).zip(positions.chunks_exact(count));
    for (n, y) in rows.enumerate() {
        let at = n * COLUMNS..(n + 1) * COLUMNS;
        for (to, (features, positions)) in tokens.row_mut(y).as_chunks_mut::<COLUMNS>().0.iter_mut().zip(planes()) {
            let sums = features[at.clone()].iter().zip(&positions[at.clone()]);
            to.iter_mut().zip(sums).for_each(|(t, (f, p))| *t = f + p);
        }
    }
}
