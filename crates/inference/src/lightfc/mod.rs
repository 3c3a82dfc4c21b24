//! LightFC (Li et al. 2024, arXiv:2310.05392; github.com/LiYunfengLYF/LightFC, MIT), written out: its layers as code, its weights as
//! whole numbers of eight bits with a scale a filter, which hold the released ones without loss.

mod head;

use crate::Result;
use crate::backbone::{Architecture, Backbone, FEATURES};
use crate::nanotrack::Patch;
use crate::shared::{Layers, Shared, Slot};
use crate::weights::Weights;
use head::{Comparison, Head};

/// The weights (MIT; `weights/lightfc/ORIGIN.md`).
const WEIGHTS: &[u8] = include_bytes!("../../weights/lightfc/lightfc.safetensors");

/// LightFC and a template. As of [`NanoTrackV3`](crate::nanotrack::NanoTrackV3), layers and scratch are those of the thread, and
/// only [`set_template`](Self::set_template) allocates.
#[derive(Debug, Clone)]
pub struct LightFc {
    engine: Shared<Engine>,
    comparison: Comparison,
    /// 16 × 16.
    scores: Vec<f32>,
    /// Width, height, offsets across and down (4 × 16 × 16).
    boxes: Vec<f32>,
}

impl LightFc {
    /// Rows and columns of the template image.
    pub const TEMPLATE_SIDE: usize = 128;
    /// Rows and columns of the search image.
    pub const SEARCH_SIDE: usize = 256;
    /// Rows and columns of the answer.
    pub const ANSWER_SIDE: usize = head::SIDE;
    /// Numbers of the template's features.
    pub const TEMPLATE_LEN: usize = FEATURES * head::TEMPLATE_PIXELS;

    /// With the weights that are built in.
    ///
    /// # Errors
    /// [`InferenceError::Model`](crate::InferenceError::Model) if they are not what the layers need.
    pub fn new() -> Result<Self> {
        let points = Self::ANSWER_SIDE * Self::ANSWER_SIDE;
        let comparison = Comparison::new(&[0.0; Self::TEMPLATE_LEN]);
        Ok(Self { engine: Shared::new()?, comparison, scores: vec![0.0; points], boxes: vec![0.0; 4 * points] })
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

    /// The features of the template image that has been written: 96 × 8 × 8 numbers, channel, row, column.
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
            self.comparison = Comparison::new(features);
        }
        fits
    }

    /// The answer to the search image that has been written: the probability of each point (16 × 16), and its box: width and height
    /// by the side of the image, middle relative to the point in points, across and down (4 × 16 × 16).
    pub fn search(&mut self) -> (&[f32], &[f32]) {
        let Self { engine, comparison, scores, boxes } = self;
        let Engine { search, head, .. } = engine.hold();
        head.run(comparison, search.run(), scores, boxes);
        engine.release();
        (&self.scores, &self.boxes)
    }
}

/// All layers that do not depend on a template, and the maps that they overwrite.
#[derive(Debug, Clone)]
struct Engine {
    template: Backbone,
    search: Backbone,
    head: Head,
}

thread_local! {
    static ENGINE: Slot<Engine> = const { Slot::empty() };
}

impl Layers for Engine {
    const SLOT: &'static std::thread::LocalKey<Slot<Self>> = &ENGINE;

    fn new() -> Result<Self> {
        let weights = Weights::read("lightfc", WEIGHTS)?;
        let backbone = |side| Backbone::new(&weights, Architecture::MOBILENET_V2, side);
        Ok(Self {
            template: backbone(LightFc::TEMPLATE_SIDE)?,
            search: backbone(LightFc::SEARCH_SIDE)?,
            head: Head::new(&weights)?,
        })
    }
}
