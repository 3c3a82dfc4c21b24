//! NanoTrack v3 (github.com/HonglinChu/SiamTrackers, Apache-2.0), written out: its layers as code, its weights as plain
//! numbers in half precision.

mod head;

use crate::Result;
use crate::backbone::{Architecture, Backbone, FEATURES};
use crate::kernels::means;
use crate::shared::{Layers, Shared, Slot};
use crate::weights::Weights;
use head::{ANSWER_SIDE, Branch, Comparison, TEMPLATE_SIDE};

/// The weights (Apache-2.0; `weights/nanotrack_v3/ORIGIN.md`).
const WEIGHTS: &[u8] = include_bytes!("../../weights/nanotrack_v3/nanotrack_v3.safetensors");

/// NanoTrack v3 and a template. The layers and what they overwrite, some megabytes, are shared by all that run on a thread,
/// one after the other: once a thread has them, nothing is allocated but by [`set_template`](Self::set_template).
#[derive(Debug, Clone)]
pub struct NanoTrackV3 {
    engine: Shared<Engine>,
    score: Comparison,
    boxes: Comparison,
    /// Background and target (2 × 15 × 15), then the four distances (4 × 15 × 15).
    scores: Vec<f32>,
    distances: Vec<f32>,
}

/// Which of the two images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Patch {
    /// The target and its surroundings in the first frame.
    Template,
    /// Where it is looked for.
    Search,
}

impl NanoTrackV3 {
    /// Rows and columns of the template image.
    pub const TEMPLATE_SIDE: usize = 127;
    /// Rows and columns of the search image.
    pub const SEARCH_SIDE: usize = 255;
    /// Rows and columns of the answer.
    pub const ANSWER_SIDE: usize = ANSWER_SIDE;
    /// Numbers of the template's features.
    pub const TEMPLATE_LEN: usize = FEATURES * TEMPLATE_SIDE * TEMPLATE_SIDE;

    /// With the weights that are built in.
    ///
    /// # Errors
    /// [`InferenceError::Model`](crate::InferenceError::Model) if they are not what the layers need.
    pub fn new() -> Result<Self> {
        let mut shared = Shared::new()?;
        let (none, points) = ([0.0; Self::TEMPLATE_LEN], ANSWER_SIDE * ANSWER_SIDE);
        let (score, boxes) = shared.with(|engine: &mut Engine| engine.comparisons(&none));
        Ok(Self { engine: shared, score, boxes, scores: vec![0.0; 2 * points], distances: vec![0.0; 4 * points] })
    }

    /// Writes row `y` of one of the images in three planes, blue, green and red, from 0 to 255. An image is written, looked
    /// at and forgotten, one after the other: after each look another network may write its own in place of both.
    ///
    /// Rows and columns beyond the image are ignored.
    pub fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        let engine = self.engine.hold();
        let image = match patch {
            Patch::Template => engine.template.image_mut(),
            Patch::Search => engine.search.image_mut(),
        };
        image.write_row(y, planes);
    }

    /// The features of the template image that has been written: 96 × 8 × 8 numbers, channel, row, column.
    pub fn template_features(&mut self) -> Vec<f32> {
        let mut features = vec![0.0; Self::TEMPLATE_LEN];
        self.engine.hold().template.run().copy_to(&mut features);
        self.engine.release();
        features
    }

    /// Compares with these features from now on; others than [`TEMPLATE_LEN`](Self::TEMPLATE_LEN) are refused by
    /// `false`.
    pub fn set_template(&mut self, features: &[f32]) -> bool {
        let fits = features.len() == Self::TEMPLATE_LEN;
        if fits {
            (self.score, self.boxes) = self.engine.with(|engine| engine.comparisons(features));
        }
        fits
    }

    /// The answer to the search image that has been written: two logits, background and target, and four distances in
    /// pixels of the search image (left, top, right, bottom), each 15 × 15.
    pub fn search(&mut self) -> (&[f32], &[f32]) {
        let Self { engine, score, boxes, scores, distances } = self;
        engine.hold().search((score, boxes), (scores, distances));
        engine.release();
        (&self.scores, &self.distances)
    }
}

/// All layers that do not depend on a template, and the maps that they overwrite.
#[derive(Debug, Clone)]
struct Engine {
    template: Backbone,
    search: Backbone,
    score: Branch,
    boxes: Branch,
    means: Vec<f32>,
}

thread_local! {
    static ENGINE: Slot<Engine> = const { Slot::empty() };
}

impl Layers for Engine {
    const SLOT: &'static std::thread::LocalKey<Slot<Self>> = &ENGINE;

    fn new() -> Result<Self> {
        let weights = Weights::read("nanotrack-v3", WEIGHTS)?;
        let backbone = |side| Backbone::new(&weights, Architecture::MOBILENET_V3, side);
        Ok(Self {
            template: backbone(NanoTrackV3::TEMPLATE_SIDE)?,
            search: backbone(NanoTrackV3::SEARCH_SIDE)?,
            score: Branch::new(&weights, "score", 2)?,
            boxes: Branch::new(&weights, "box", 4)?,
            means: vec![0.0; FEATURES],
        })
    }
}

impl Engine {
    /// What both branches compare with, for the template's features.
    fn comparisons(&self, features: &[f32]) -> (Comparison, Comparison) {
        (self.score.comparison(features), self.boxes.comparison(features))
    }

    /// Compares the search image with a template in both branches.
    fn search(&mut self, template: (&Comparison, &Comparison), (scores, distances): (&mut [f32], &mut [f32])) {
        let features = self.search.run();
        means(features, &mut self.means);
        self.score.run(template.0, features, &self.means).copy_to(scores);
        self.boxes.run(template.1, features, &self.means).copy_to(distances);
        distances.iter_mut().for_each(|d| *d = d.exp());
    }
}
