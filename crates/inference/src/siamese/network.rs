use crate::written::{Network, Patch, WrittenOut};
use crate::{InferenceError, Result};

/// Sides of the square images and of the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sides {
    /// Rows and columns of the template image.
    pub template: usize,
    /// Rows and columns of the search image.
    pub search: usize,
    /// Rows and columns of the answer.
    pub answer: usize,
}

/// What a network says about a search image, a number a point, row by row, channel after channel.
#[derive(Debug, Clone, Copy)]
pub struct Answer<'a> {
    /// One or two numbers a point; what they are is a matter of configuration.
    pub scores: &'a [f32],
    /// The box of each point: of NanoTrack distances to the left, top, right and bottom edge of the target, in pixels of the search
    /// image; see [`AnswerCoding`](super::AnswerCoding) for others.
    pub distances: &'a [f32],
}

/// A network that compares a template with a search image.
pub trait SiameseNetwork: Send {
    /// Sides of its images and of its answer.
    fn sides(&self) -> Sides;

    /// Takes row `y` of an image, a plane a channel: normalised pixels, channels in the network's order.
    fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]);

    /// The features of the template image that has been written.
    ///
    /// # Errors
    /// Whatever running the network may bring.
    fn embed(&mut self) -> Result<Vec<f32>>;

    /// Compares with these features from now on.
    ///
    /// # Errors
    /// [`InferenceError::Tensor`](crate::InferenceError::Tensor) unless there are as many as [`embed`](Self::embed)
    /// gives.
    fn set_template(&mut self, features: &[f32]) -> Result<()>;

    /// The answer to the search image that has been written.
    ///
    /// # Errors
    /// Whatever running the network may bring.
    fn search(&mut self) -> Result<Answer<'_>>;

    /// What the network draws about a point (row, column) of the last answer: logits of the target, row by row, over a window as large as the
    /// template image. Empty of networks that draw no masks.
    ///
    /// # Errors
    /// Whatever running the network may bring.
    fn mask(&mut self, point: (usize, usize)) -> Result<&[f32]> {
        let _ = point;
        Ok(&[])
    }

    /// Keeps the features of every search image from now on, if it is a network that has any to keep.
    fn keep_features(&mut self) {}

    /// The features of the last search image, as far apart as the network's stride: channel, row, column. Empty where none are kept.
    fn search_features(&self) -> &[f32] {
        &[]
    }
}

impl<N: Network> SiameseNetwork for WrittenOut<N> {
    fn sides(&self) -> Sides {
        Sides { template: N::TEMPLATE_SIDE, search: N::SEARCH_SIDE, answer: N::ANSWER_SIDE }
    }

    fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        Self::write_row(self, patch, y, planes);
    }

    fn embed(&mut self) -> Result<Vec<f32>> {
        Ok(self.template_features())
    }

    fn set_template(&mut self, features: &[f32]) -> Result<()> {
        if Self::set_template(self, features) {
            return Ok(());
        }
        Err(InferenceError::Tensor {
            what: N::NAME.into(),
            port: "template features".into(),
            expected: N::TEMPLATE_LEN,
            actual: features.len(),
        })
    }

    fn search(&mut self) -> Result<Answer<'_>> {
        let (scores, distances) = Self::search(self);
        Ok(Answer { scores, distances })
    }

    fn keep_features(&mut self) {
        Self::keep_features(self);
    }

    fn search_features(&self) -> &[f32] {
        Self::search_features(self)
    }
}

impl SiameseNetwork for Box<dyn SiameseNetwork> {
    fn sides(&self) -> Sides {
        (**self).sides()
    }

    fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        (**self).write_row(patch, y, planes);
    }

    fn embed(&mut self) -> Result<Vec<f32>> {
        (**self).embed()
    }

    fn set_template(&mut self, features: &[f32]) -> Result<()> {
        (**self).set_template(features)
    }

    fn search(&mut self) -> Result<Answer<'_>> {
        (**self).search()
    }

    fn mask(&mut self, point: (usize, usize)) -> Result<&[f32]> {
        (**self).mask(point)
    }

    fn keep_features(&mut self) {
        (**self).keep_features();
    }

    fn search_features(&self) -> &[f32] {
        (**self).search_features()
    }
}
