use super::masks::{Masks, Points};
use crate::nanotrack::Patch;
use crate::siamese::{Answer, AnswerCoding, SiameseConfig, SiameseNetwork, Sides};
use crate::{InferenceError, Network, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// A Siamese network of the user's. Clones share the libraries' sessions, which run one search at a time, and keep their own
/// images and templates.
#[derive(Clone)]
pub struct OnnxSiamese {
    networks: Arc<Mutex<Networks>>,
    sides: Sides,
    /// Planes of the images, by [`Patch`].
    template: Vec<f32>,
    search: Vec<f32>,
    /// What the search is compared with: features, or the template image itself.
    features: Vec<f32>,
    scores: Vec<f32>,
    boxes: Vec<f32>,
    /// What masks are drawn of, and the last one drawn.
    kept: Vec<Vec<f32>>,
    drawn: Vec<f32>,
}

struct Networks {
    /// Image to features; none where the search takes the template image itself.
    template: Option<Box<dyn Network>>,
    /// Image, and with no head the features, to features or answer.
    search: Box<dyn Network>,
    /// Template's and search image's features to the answer.
    head: Option<Box<dyn Network>>,
    /// Which inputs of the answering network are the template's and of the searching network the image's.
    template_input: usize,
    image_input: usize,
    /// Which outputs are the scores, and the numbers of boxes one after another.
    scores: usize,
    boxes: Vec<usize>,
    /// What draws masks, if anything does.
    masks: Option<Masks>,
}

impl Networks {
    /// What answers.
    fn answering(&self) -> &dyn Network {
        self.head.as_deref().unwrap_or(&*self.search)
    }
}

impl std::fmt::Debug for OnnxSiamese {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OnnxSiamese").field("sides", &self.sides).finish_non_exhaustive()
    }
}

impl OnnxSiamese {
    /// What a user should know of how its networks are run, a line each.
    pub fn notes(&self) -> Vec<String> {
        let networks = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        let drawing = networks.masks.as_ref().and_then(Masks::network);
        let all = [networks.template.as_deref(), Some(&*networks.search), networks.head.as_deref(), drawing];
        let mut notes: Vec<String> = all.into_iter().flatten().flat_map(Network::notes).cloned().collect();
        // Several files, one library: it lacks the same for all.
        notes.dedup();
        notes
    }

    /// From one network (template image and search image to answer), two (template; search image and template's features to
    /// answer), or three (template; search image; both features to answer). Images are one of three planes. The answer has an
    /// output for the scores and, by `coding`, one of four planes an anchor, or one of two planes for sizes before one of two for
    /// offsets, or no other.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if their inputs and outputs do not fit together.
    pub fn new(
        template: Option<Box<dyn Network>>,
        search: Box<dyn Network>,
        head: Option<Box<dyn Network>>,
        coding: &AnswerCoding,
    ) -> Result<Self> {
        let side = |network: &dyn Network, input: usize| match network.inputs().get(input).map(|p| p.shape.as_slice()) {
            Some(&[1, 3, height, width]) if height == width => Ok(width),
            _ => Err(misfit(network, "its input is no square image of three planes")),
        };
        let (template_side, image_input) = match &template {
            Some(template) => (side(&**template, 0)?, 0),
            // Of two images the template is the smaller one.
            None => {
                let sides = [side(&*search, 0)?, side(&*search, 1)?];
                (sides[0].min(sides[1]), usize::from(sides[1] >= sides[0]))
            }
        };
        let search_side = side(&*search, image_input)?;
        let answering: &dyn Network = head.as_deref().unwrap_or(&*search);
        let (scores, boxes) = outputs(answering, coding)?;
        let answer = answering.outputs()[scores].shape[3];
        let len = |network: &dyn Network, input: usize| network.inputs().get(input).map(|p| p.len());
        let template_input = match (&head, &template) {
            (Some(_), _) => 0,
            (None, Some(_)) => 1,
            (None, None) => 1 - image_input,
        };
        let features = match &template {
            Some(template) => template.outputs().first().map(|p| p.len()),
            None => Some(3 * template_side * template_side),
        };
        let fits = len(answering, template_input) == features
            && head.as_ref().is_none_or(|head| len(&**head, 1) == search.outputs().first().map(|p| p.len()));
        if !fits {
            return Err(misfit(answering, "it does not take the features that the template's network gives"));
        }
        let blank = |side: usize| vec![0.0; 3 * side * side];
        Ok(Self {
            sides: Sides { template: template_side, search: search_side, answer },
            template: blank(template_side),
            search: blank(search_side),
            features: vec![0.0; features.unwrap_or(0)],
            scores: Vec::new(),
            boxes: Vec::new(),
            kept: Vec::new(),
            drawn: Vec::new(),
            networks: Arc::new(Mutex::new(Networks {
                template,
                search,
                head,
                template_input,
                image_input,
                scores,
                boxes,
                masks: None,
            })),
        })
    }

    /// The same, which draws masks as `config` says: with `refine`, that network draws one of the outputs of the others that are called like its
    /// inputs, cut about the point; without, an output of the answering network has a plane for each place of the mask. Where `config` wants no
    /// masks, nothing is read but scores and boxes.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if their inputs and outputs do not fit together, or `refine` is given where no masks are wanted.
    pub fn with_masks(self, refine: Option<Box<dyn Network>>, config: &SiameseConfig) -> Result<Self> {
        let Sides { search: search_side, answer, .. } = self.sides;
        let mut guard = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        let networks = &mut *guard;
        networks.masks = match (refine, config.mask_side) {
            (None, 0) => None,
            (Some(refine), 0) => return Err(misfit(&*refine, "the description has no `mask_side` for what it draws")),
            (None, side) => Some(Masks::planes(networks.answering(), side, answer)?),
            (Some(refine), side) => {
                let points = Points { search: search_side, stride_px: config.stride_px };
                Some(Masks::refined(refine, side, &*networks.search, networks.head.as_deref(), points)?)
            }
        };
        drop(guard);
        Ok(self)
    }
}

/// Which outputs are the scores and the boxes.
fn outputs(network: &dyn Network, coding: &AnswerCoding) -> Result<(usize, Vec<usize>)> {
    let planes = |n: usize| {
        let shapes = network.outputs().iter().map(|p| p.shape.as_slice());
        let fits = move |s: &[usize]| matches!(*s, [1, planes, height, width] if planes == n && height == width);
        shapes.enumerate().filter(move |(_, s)| fits(s)).map(|(i, _)| i)
    };
    let anchors = coding.anchors();
    let found = match coding {
        AnswerCoding::Scores { .. } => planes(1).next().map(|scores| (scores, Vec::new())),
        AnswerCoding::Centres => {
            let pairs: Vec<usize> = planes(2).collect();
            planes(1).next().filter(|_| pairs.len() == 2).map(|scores| (scores, pairs))
        }
        _ => {
            // Two scores an anchor before one; four numbers of a box may be as many planes as four scores.
            let boxes = planes(4 * anchors).next_back();
            let scores = planes(2 * anchors).find(|s| Some(*s) != boxes).or_else(|| planes(anchors).next());
            boxes.zip(scores).map(|(boxes, scores)| (scores, vec![boxes]))
        }
    };
    let side = |i: usize| network.outputs()[i].shape[3];
    found.filter(|(scores, boxes)| boxes.iter().all(|&b| side(b) == side(*scores))).ok_or_else(|| {
        let shapes: Vec<String> = network.outputs().iter().map(|p| format!("{:?}", p.shape)).collect();
        misfit(network, &format!("its outputs {} are no scores and boxes of that layout", shapes.join(", ")))
    })
}

fn misfit(network: &dyn Network, why: &str) -> InferenceError {
    InferenceError::Model {
        what: network.name().to_owned(),
        why: why.into(),
        mend: "name the networks as template, search and head, and say in the description how they answer".into(),
    }
}

impl SiameseNetwork for OnnxSiamese {
    fn sides(&self) -> Sides {
        self.sides
    }

    fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        let (image, side) = match patch {
            Patch::Template => (&mut self.template, self.sides.template),
            Patch::Search => (&mut self.search, self.sides.search),
        };
        for (image, plane) in image.chunks_exact_mut(side * side).zip(planes) {
            image.iter_mut().skip(y * side).take(side).zip(plane).for_each(|(to, pixel)| *to = *pixel);
        }
    }

    fn embed(&mut self) -> Result<Vec<f32>> {
        let mut networks = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(template) = &mut networks.template else { return Ok(self.template.clone()) };
        template.set_input(0, &self.template)?;
        template.run()?;
        Ok(template.output(0).to_vec())
    }

    fn set_template(&mut self, features: &[f32]) -> Result<()> {
        if features.len() != self.features.len() {
            return Err(InferenceError::Tensor {
                what: "the Siamese network".into(),
                port: "template features".into(),
                expected: self.features.len(),
                actual: features.len(),
            });
        }
        self.features.copy_from_slice(features);
        Ok(())
    }

    fn search(&mut self) -> Result<Answer<'_>> {
        let mut networks = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        let Networks { search, head, template_input, image_input, scores, boxes, masks, .. } = &mut *networks;
        search.set_input(*image_input, &self.search)?;
        let answering: &mut dyn Network = match head {
            Some(head) => {
                search.run()?;
                head.set_input(1, search.output(0))?;
                &mut **head
            }
            None => &mut **search,
        };
        answering.set_input(*template_input, &self.features)?;
        answering.run()?;
        self.scores.clear();
        self.scores.extend_from_slice(answering.output(*scores));
        self.boxes.clear();
        boxes.iter().for_each(|&b| self.boxes.extend_from_slice(answering.output(b)));
        if let Some(masks) = masks {
            masks.keep(&**search, head.as_deref(), &mut self.kept);
        }
        Ok(Answer { scores: &self.scores, distances: &self.boxes })
    }

    fn mask(&mut self, point: (usize, usize)) -> Result<&[f32]> {
        let mut networks = self.networks.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(masks) = &mut networks.masks {
            masks.draw(&self.kept, point, self.sides.answer, &mut self.drawn)?;
        }
        Ok(&self.drawn)
    }
}
