//! What the networks that are written out have in common: images that come row by row, the features of a template, an answer.

use crate::Result;
use crate::kernels::Map;
use crate::shared::{Layers, Shared};
use std::fmt::Debug;

/// Which of the two images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Patch {
    /// The target and its surroundings in the first frame.
    Template,
    /// Where it is looked for.
    Search,
}

/// What makes features of an image.
pub trait Embedding {
    /// The image, to be written before [`run`](Self::run): three planes, as the network wants them.
    fn image_mut(&mut self) -> &mut Map;

    /// The features of the image that has been written.
    fn run(&mut self) -> &mut Map;
}

/// The layers of one network, and the sizes of what it reads and gives.
pub trait Network: Layers + Debug + Clone + Send {
    /// Its name in errors.
    const NAME: &'static str;
    /// Rows and columns of the template image.
    const TEMPLATE_SIDE: usize;
    /// Rows and columns of the search image.
    const SEARCH_SIDE: usize;
    /// Rows and columns of the answer.
    const ANSWER_SIDE: usize;
    /// Numbers of the template's features.
    const TEMPLATE_LEN: usize;
    /// Scores of a point.
    const SCORES: usize;
    /// Numbers of the search image's features, where they are of use beside the answer.
    const SEARCH_LEN: usize = 0;

    /// What the template's features are made into to be compared with.
    type Comparison: Debug + Clone + Send;

    /// What reads the images.
    type Embedding: Embedding;

    /// That of the template image, and that of the search image.
    fn embeddings(&mut self) -> (&mut Self::Embedding, &mut Self::Embedding);

    /// For [`TEMPLATE_LEN`](Self::TEMPLATE_LEN) features, channel, row, column.
    fn comparison(&self, features: &[f32]) -> Self::Comparison;

    /// Compares the search image that has been written.
    fn search(&mut self, comparison: &Self::Comparison, scores: &mut [f32], boxes: &mut [f32]);

    /// Writes the [`SEARCH_LEN`](Self::SEARCH_LEN) features of the last search: channel, row, column.
    fn copy_features(&self, _features: &mut [f32]) {}
}

/// A network that is written out, and a template. The layers and what they overwrite, some megabytes, are shared by all that run on a
/// thread, one after the other: once a thread has them, nothing is allocated but by [`set_template`](Self::set_template).
#[derive(Debug, Clone)]
pub struct WrittenOut<N: Network> {
    engine: Shared<N>,
    comparison: N::Comparison,
    scores: Vec<f32>,
    boxes: Vec<f32>,
    features: Vec<f32>,
}

impl<N: Network> WrittenOut<N> {
    /// Rows and columns of the template image.
    pub const TEMPLATE_SIDE: usize = N::TEMPLATE_SIDE;
    /// Rows and columns of the search image.
    pub const SEARCH_SIDE: usize = N::SEARCH_SIDE;
    /// Rows and columns of the answer.
    pub const ANSWER_SIDE: usize = N::ANSWER_SIDE;
    /// Numbers of the template's features.
    pub const TEMPLATE_LEN: usize = N::TEMPLATE_LEN;

    /// With the weights that are built in.
    ///
    /// # Errors
    /// [`InferenceError::Model`](crate::InferenceError::Model) if they are not what the layers need.
    pub fn new() -> Result<Self> {
        let (mut engine, points) = (Shared::new()?, N::ANSWER_SIDE * N::ANSWER_SIDE);
        let comparison = engine.with(|engine: &mut N| engine.comparison(&vec![0.0; N::TEMPLATE_LEN]));
        let [scores, boxes] = [N::SCORES * points, 4 * points].map(|len| vec![0.0; len]);
        Ok(Self { engine, comparison, scores, boxes, features: Vec::new() })
    }

    /// Writes row `y` of one of the images in three planes, in the order and range of the network. An image is written, looked at and
    /// forgotten, one after the other: after each look another network may write its own in place of both. Rows and columns beyond
    /// the image are ignored.
    pub fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        let (template, search) = self.engine.hold().embeddings();
        let embedding = match patch {
            Patch::Template => template,
            Patch::Search => search,
        };
        embedding.image_mut().write_row(y, planes);
    }

    /// The features of the template image that has been written: channel, row, column.
    pub fn template_features(&mut self) -> Vec<f32> {
        let mut features = vec![0.0; N::TEMPLATE_LEN];
        self.engine.hold().embeddings().0.run().copy_to(&mut features);
        self.engine.release();
        features
    }

    /// Compares with these features from now on; others than [`TEMPLATE_LEN`](Self::TEMPLATE_LEN) are refused by `false`.
    pub fn set_template(&mut self, features: &[f32]) -> bool {
        let fits = features.len() == N::TEMPLATE_LEN;
        if fits {
            self.comparison = self.engine.with(|engine| engine.comparison(features));
        }
        fits
    }

    /// The answer to the search image that has been written: scores and boxes, a number a point, row by row, channel after channel.
    pub fn search(&mut self) -> (&[f32], &[f32]) {
        let Self { engine, comparison, scores, boxes, features } = self;
        let layers = engine.hold();
        layers.search(comparison, scores, boxes);
        if !features.is_empty() {
            layers.copy_features(features);
        }
        engine.release();
        (&self.scores, &self.boxes)
    }

    /// Keeps the features of every search image from now on, of a network that has any to keep.
    pub fn keep_features(&mut self) {
        self.features.resize(N::SEARCH_LEN, 0.0);
    }

    /// The features of the last search image, channel, row, column, if they are [kept](Self::keep_features); none otherwise.
    pub fn search_features(&self) -> &[f32] {
        &self.features
    }
}
