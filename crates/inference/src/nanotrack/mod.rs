//! NanoTrack v3 (github.com/HonglinChu/SiamTrackers, Apache-2.0), written out: its layers as code, its weights as plain
//! numbers in half precision.

mod backbone;
mod head;
mod weights;

use crate::Result;
use crate::kernels::{Columns, Map};
use backbone::{Backbone, FEATURES};
use head::{ANSWER_SIDE, Branch, Comparison, TEMPLATE_SIDE};
use std::cell::Cell;
use weights::Weights;

/// NanoTrack v3 and a template. The layers and what they overwrite, some megabytes, are shared by all that run on a thread,
/// one after the other: once a thread has them, nothing is allocated but by [`set_template`](Self::set_template).
#[derive(Debug, Clone)]
pub struct NanoTrackV3 {
    /// Only from the first row of an image until that has been looked at.
    engine: Option<Box<Engine>>,
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
        let engine = Engine::of_thread()?;
        let (none, points) = ([0.0; Self::TEMPLATE_LEN], ANSWER_SIDE * ANSWER_SIDE);
        let (score, boxes) = (engine.score.comparison(&none), engine.boxes.comparison(&none));
        engine.put_back();
        Ok(Self { engine: None, score, boxes, scores: vec![0.0; 2 * points], distances: vec![0.0; 4 * points] })
    }

    /// Writes row `y` of one of the images in three planes, blue, green and red, from 0 to 255. An image is written, looked
    /// at and forgotten, one after the other: after each look another network may write its own in place of both.
    ///
    /// Rows and columns beyond the image are ignored.
    pub fn write_row(&mut self, patch: Patch, y: usize, planes: [&[f32]; 3]) {
        let engine = self.engine();
        let image = match patch {
            Patch::Template => engine.template.image_mut(),
            Patch::Search => engine.search.image_mut(),
        };
        if y < image.height {
            write_row(image, y, planes);
        }
    }

    /// The features of the template image that has been written: 96 × 8 × 8 numbers, channel, row, column.
    pub fn template_features(&mut self) -> Vec<f32> {
        let mut features = vec![0.0; Self::TEMPLATE_LEN];
        self.engine().template.run().copy_to(&mut features);
        self.put_back();
        features
    }

    /// Compares with these features from now on; others than [`TEMPLATE_LEN`](Self::TEMPLATE_LEN) are refused by
    /// `false`.
    pub fn set_template(&mut self, features: &[f32]) -> bool {
        let fits = features.len() == Self::TEMPLATE_LEN;
        if fits {
            let holds_an_image = self.engine.is_some();
            let engine = self.engine();
            let (score, boxes) = (engine.score.comparison(features), engine.boxes.comparison(features));
            (self.score, self.boxes) = (score, boxes);
            if !holds_an_image {
                self.put_back();
            }
        }
        fits
    }

    /// The answer to the search image that has been written: two logits, background and target, and four distances in
    /// pixels of the search image (left, top, right, bottom), each 15 × 15.
    pub fn search(&mut self) -> (&[f32], &[f32]) {
        self.engine();
        let Self { engine, score, boxes, scores, distances } = self;
        if let Some(engine) = engine {
            engine.search((score, boxes), (scores, distances));
        }
        self.put_back();
        (&self.scores, &self.distances)
    }

    fn engine(&mut self) -> &mut Engine {
        self.engine.get_or_insert_with(|| match Engine::of_thread() {
            Ok(engine) => engine,
            Err(_) => unreachable!("`new` has read the same weights"),
        })
    }

    /// The next on this thread may have the layers.
    fn put_back(&mut self) {
        if let Some(engine) = self.engine.take() {
            engine.put_back();
        }
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
    /// That of this thread, while none of its networks holds an image. It is constants and scratch: what a network answers
    /// does not depend on who had it before.
    static ENGINE: Cell<Option<Box<Engine>>> = const { Cell::new(None) };
}

impl Engine {
    /// The one of this thread, or a new one.
    fn of_thread() -> Result<Box<Self>> {
        match ENGINE.take() {
            Some(engine) => Ok(engine),
            None => Self::new().map(Box::new),
        }
    }

    fn put_back(self: Box<Self>) {
        ENGINE.set(Some(self));
    }

    fn new() -> Result<Self> {
        let weights = Weights::nanotrack_v3()?;
        Ok(Self {
            template: Backbone::new(&weights, NanoTrackV3::TEMPLATE_SIDE)?,
            search: Backbone::new(&weights, NanoTrackV3::SEARCH_SIDE)?,
            score: Branch::new(&weights, "score", 2)?,
            boxes: Branch::new(&weights, "box", 4)?,
            means: vec![0.0; FEATURES],
        })
    }

    /// Compares the search image with a template in both branches.
    fn search(&mut self, template: (&Comparison, &Comparison), (scores, distances): (&mut [f32], &mut [f32])) {
        let features = self.search.run();
        let pixels = (features.width * features.height) as f32;
        self.means.fill(0.0);
        for y in 0..features.height {
            for (mean, columns) in self.means.iter_mut().zip(features.row(y).chunks_exact(features.pitch)) {
                *mean += columns.iter().sum::<f32>();
            }
        }
        self.means.iter_mut().for_each(|m| *m /= pixels);
        self.score.run(template.0, features, &self.means).copy_to(scores);
        self.boxes.run(template.1, features, &self.means).copy_to(distances);
        distances.iter_mut().for_each(|d| *d = d.exp());
    }
}

/// Sorts a row's even and odd columns apart.
fn write_row(image: &mut Map, y: usize, planes: [&[f32]; 3]) {
    let Columns::Split { half } = image.columns else { return };
    let (width, pitch) = (image.width, image.pitch);
    let row = image.row_mut(y).chunks_exact_mut(pitch);
    for (to, plane) in row.zip(planes) {
        let (pairs, last) = plane[..plane.len().min(width)].as_chunks::<2>();
        // One column of padding stands before the image, so that its first column is an odd one.
        let (evens, odds) = to.split_at_mut(half);
        for (([odd, even], to_odd), to_even) in pairs.iter().zip(&mut *odds).zip(&mut evens[1..]) {
            (*to_odd, *to_even) = (*odd, *even);
        }
        if let ([last], Some(to)) = (last, odds.get_mut(pairs.len())) {
            *to = *last;
        }
    }
}
