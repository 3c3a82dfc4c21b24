//! The layers of NanoTrack v3.

use super::head::{ANSWER_SIDE, Branch, Comparison, SEARCH_SIDE, TEMPLATE_SIDE};
use crate::Result;
use crate::backbone::{Architecture, Backbone, FEATURES};
use crate::kernels::means;
use crate::shared::{Layers, Slot};
use crate::weights::Weights;
use crate::written::{Embedding, Network};

/// The weights (Apache-2.0; `weights/nanotrack_v3/ORIGIN.md`).
const WEIGHTS: &[u8] = include_bytes!("../../weights/nanotrack_v3/nanotrack_v3.safetensors");

/// All layers that do not depend on a template, and the maps that they overwrite.
#[derive(Debug, Clone)]
pub struct Engine {
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
            template: backbone(Self::TEMPLATE_SIDE)?,
            search: backbone(Self::SEARCH_SIDE)?,
            score: Branch::new(&weights, "score", 2)?,
            boxes: Branch::new(&weights, "box", 4)?,
            means: vec![0.0; FEATURES],
        })
    }
}

impl Network for Engine {
    const NAME: &'static str = "nanotrack-v3";
    const TEMPLATE_SIDE: usize = 127;
    const SEARCH_SIDE: usize = 255;
    const ANSWER_SIDE: usize = ANSWER_SIDE;
    const TEMPLATE_LEN: usize = FEATURES * TEMPLATE_SIDE * TEMPLATE_SIDE;
    const SCORES: usize = 2;
    const SEARCH_LEN: usize = FEATURES * SEARCH_SIDE * SEARCH_SIDE;

    /// Of score and boxes.
    type Comparison = (Comparison, Comparison);
    type Embedding = Backbone;

    fn embeddings(&mut self) -> (&mut Backbone, &mut Backbone) {
        (&mut self.template, &mut self.search)
    }

    fn comparison(&self, features: &[f32]) -> Self::Comparison {
        (self.score.comparison(features), self.boxes.comparison(features))
    }

    fn search(&mut self, (score, boxes): &Self::Comparison, scores: &mut [f32], distances: &mut [f32]) {
        let features = self.search.run();
        means(features, &mut self.means);
        self.score.run(score, features, &self.means).copy_to(scores);
        self.boxes.run(boxes, features, &self.means).copy_to(distances);
        distances.iter_mut().for_each(|d| *d = d.exp());
    }

    fn copy_features(&self, features: &mut [f32]) {
        if let Some(map) = self.search.features() {
            map.copy_to(features);
        }
    }
}
