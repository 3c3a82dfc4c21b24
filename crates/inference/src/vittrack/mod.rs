//! VitTrack (opencv_zoo's `object_tracking_vittrack_2023sep`, Apache-2.0), written out: its layers as code, its weights as plain numbers
//! in single precision. The pixels of template and search image are one sequence of tokens, as in OSTrack (Ye et al. 2022,
//! arXiv:2203.11991), so that every search looks at both.

mod block;
mod head;
mod stem;

use crate::Result;
use crate::kernels::{LayerNorm, Map};
use crate::nanotrack::Patch;
use crate::shared::{Layers, Shared, Slot};
use crate::weights::Weights;
use block::Block;
use head::Tower;
use std::ops::Range;
use stem::Stem;

/// The weights (Apache-2.0; `weights/vittrack/ORIGIN.md`).
const WEIGHTS: &[u8] = include_bytes!("../../weights/vittrack/vittrack.safetensors");

/// Channels of a token.
const CHANNELS: usize = 48;
/// Tokens in a row of the map that holds them.
const COLUMNS: usize = 16;
/// Rows of the template's tokens, and of the search image's.
const ROWS: [usize; 2] = [4, 16];
const TOKEN_ROWS: usize = ROWS[0] + ROWS[1];
const POINTS: usize = COLUMNS * ROWS[1];

/// VitTrack and a template. As of [`NanoTrackV3`](crate::nanotrack::NanoTrackV3), layers and scratch are those of the thread, and
/// only [`set_template`](Self::set_template) allocates.
#[derive(Debug, Clone)]
pub struct VitTrack {
    engine: Shared<Engine>,
    /// Channel, row, column.
    template: Vec<f32>,
    /// 16 × 16.
    scores: Vec<f32>,
    /// Width, height, offsets across and down (4 × 16 × 16).
    boxes: Vec<f32>,
}

impl VitTrack {
    /// Rows and columns of the template image.
    pub const TEMPLATE_SIDE: usize = 128;
    /// Rows and columns of the search image.
    pub const SEARCH_SIDE: usize = 256;
    /// Rows and columns of the answer.
    pub const ANSWER_SIDE: usize = ROWS[1];
    /// Numbers of the template's features.
    pub const TEMPLATE_LEN: usize = CHANNELS * COLUMNS * ROWS[0];

    /// With the weights that are built in.
    ///
    /// # Errors
    /// [`InferenceError::Model`](crate::InferenceError::Model) if they are not what the layers need.
    pub fn new() -> Result<Self> {
        let zeros = |count: usize| vec![0.0; count];
        let template = zeros(Self::TEMPLATE_LEN);
        Ok(Self { engine: Shared::new()?, template, scores: zeros(POINTS), boxes: zeros(4 * POINTS) })
    }

    /// Writes row `y` of one of the images in three planes, red, green and blue, normalised. An image is written, looked at and
    /// forgotten, one after the other; rows and columns beyond it are ignored.
    pub fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        let engine = self.engine.hold();
        let image = match patch {
            Patch::Template => engine.template.image_mut(),
            Patch::Search => engine.search.image_mut(),
        };
        image.write_row(y, planes);
    }

    /// The features of the template image that has been written: 48 × 8 × 8 numbers, channel, row, column.
    pub fn template_features(&mut self) -> Vec<f32> {
        let mut features = vec![0.0; Self::TEMPLATE_LEN];
        self.engine.hold().template.run().copy_to(&mut features);
        self.engine.release();
        features
    }

    /// Compares with these features from now on; others than [`TEMPLATE_LEN`](Self::TEMPLATE_LEN) are refused by `false`.
    pub fn set_template(&mut self, features: &[f32]) -> bool {
        let fits = features.len() == Self::TEMPLATE_LEN;
        if fits {
            self.template = features.to_vec();
        }
        fits
    }

    /// The answer to the search image that has been written: the probability of each point (16 × 16), and its box: width and height
    /// by the side of the image, middle relative to the point in points, across and down (4 × 16 × 16).
    pub fn search(&mut self) -> (&[f32], &[f32]) {
        let Self { engine, template, scores, boxes } = self;
        engine.hold().search(template, scores, boxes);
        engine.release();
        (&self.scores, &self.boxes)
    }
}

/// All layers, and the maps that they overwrite.
#[derive(Debug, Clone)]
struct Engine {
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
            template: Stem::new(&weights, VitTrack::TEMPLATE_SIDE)?,
            search: Stem::new(&weights, VitTrack::SEARCH_SIDE)?,
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

impl Engine {
    fn search(&mut self, template: &[f32], scores: &mut [f32], boxes: &mut [f32]) {
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
