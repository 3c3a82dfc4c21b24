use crate::nanotrack::Patch;
use crate::siamese::{Answer, SiameseNetwork, Sides};
use crate::{InferenceError, Network, Result};

/// A Siamese network of the user's: one network for the template, one for the search image, and one that compares what
/// they give, if the second does not.
pub struct OnnxSiamese {
    /// Image to features.
    template: Box<dyn Network>,
    /// Image, and with no third network the template's features, to features or answer.
    search: Box<dyn Network>,
    /// Template's and search image's features to the answer.
    head: Option<Box<dyn Network>>,
    sides: Sides,
    /// Which outputs are the scores and the distances.
    scores: usize,
    distances: usize,
}

impl OnnxSiamese {
    /// From two networks (template; search image and template's features to answer), or three (template; search image;
    /// both features to answer). Images are one of three planes, the answer has one output with four planes, the
    /// distances, and one with one or two, the scores.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if their inputs and outputs do not fit together.
    pub fn new(template: Box<dyn Network>, search: Box<dyn Network>, head: Option<Box<dyn Network>>) -> Result<Self> {
        let side = |network: &dyn Network| match network.inputs().first().map(|p| p.shape.as_slice()) {
            Some(&[1, 3, height, width]) if height == width => Ok(width),
            _ => Err(misfit(network, "its first input is no square image of three planes")),
        };
        let answering: &dyn Network = head.as_deref().unwrap_or(&*search);
        let planes = |n: usize| {
            answering.outputs().iter().position(
                |p| matches!(p.shape.as_slice(), &[1, planes, height, width] if planes == n && height == width),
            )
        };
        let (Some(distances), Some(scores)) = (planes(4), planes(2).or_else(|| planes(1))) else {
            return Err(misfit(answering, "it has no output of four square planes and one of two or one"));
        };
        let sides = Sides {
            template: side(&*template)?,
            search: side(&*search)?,
            answer: answering.outputs()[distances].shape[3],
        };
        let len = |network: &dyn Network, input: usize| network.inputs().get(input).map(|p| p.len());
        let features = template.outputs().first().map(|p| p.len());
        let fits = match &head {
            Some(head) => len(&**head, 0) == features && len(&**head, 1) == search.outputs().first().map(|p| p.len()),
            None => len(&*search, 1) == features,
        };
        if !fits || answering.outputs()[scores].shape[3] != sides.answer {
            return Err(misfit(answering, "it does not take the features that the template's network gives"));
        }
        Ok(Self { template, search, head, sides, scores, distances })
    }

    fn answering(&mut self) -> &mut dyn Network {
        match &mut self.head {
            Some(head) => &mut **head,
            None => &mut *self.search,
        }
    }
}

fn misfit(network: &dyn Network, why: &str) -> InferenceError {
    InferenceError::Model {
        what: network.name().to_owned(),
        why: why.into(),
        mend: "name the networks in the order template, search, head, and give the shapes of their inputs".into(),
    }
}

impl SiameseNetwork for OnnxSiamese {
    fn sides(&self) -> Sides {
        self.sides
    }

    fn write_row(&mut self, patch: Patch, y: usize, pixels: &[[f32; 3]]) {
        let (network, side) = match patch {
            Patch::Template => (&mut self.template, self.sides.template),
            Patch::Search => (&mut self.search, self.sides.search),
        };
        for (c, plane) in network.input_mut(0).chunks_exact_mut(side * side).enumerate() {
            for (to, pixel) in plane.iter_mut().skip(y * side).zip(pixels.iter().take(side)) {
                *to = pixel[c];
            }
        }
    }

    fn embed(&mut self) -> Result<Vec<f32>> {
        self.template.run()?;
        Ok(self.template.output(0).to_vec())
    }

    fn set_template(&mut self, features: &[f32]) -> Result<()> {
        let input = usize::from(self.head.is_none());
        self.answering().set_input(input, features)
    }

    fn search(&mut self) -> Result<Answer<'_>> {
        self.search.run()?;
        if let Some(head) = &mut self.head {
            head.set_input(1, self.search.output(0))?;
            head.run()?;
        }
        let (scores, distances) = (self.scores, self.distances);
        let answering = self.answering();
        Ok(Answer { scores: answering.output(scores), distances: answering.output(distances) })
    }
}
