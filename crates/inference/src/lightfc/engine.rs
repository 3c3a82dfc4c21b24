//! The layers of LightFC.

use super::head::{Comparison, Head, SIDE, TEMPLATE_PIXELS};
use crate::Result;
use crate::backbone::{Architecture, Backbone, FEATURES};
use crate::shared::{Layers, Slot};
use crate::weights::Weights;
use crate::written::{Embedding, Network};

/// The weights (MIT; `weights/lightfc/ORIGIN.md`).
const WEIGHTS: &[u8] = include_bytes!("../../weights/lightfc/lightfc.safetensors");

/// All layers that do not depend on a template, and the maps that they overwrite.
#[derive(Debug, Clone)]
pub struct Engine {
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
            template: backbone(Self::TEMPLATE_SIDE)?,
            search: backbone(Self::SEARCH_SIDE)?,
            head: Head::new(&weights)?,
        })
    }
}

impl Network for Engine {
    const NAME: &'static str = "lightfc";
    const TEMPLATE_SIDE: usize = 128;
    const SEARCH_SIDE: usize = 256;
    const ANSWER_SIDE: usize = SIDE;
    const TEMPLATE_LEN: usize = FEATURES * TEMPLATE_PIXELS;
    const SCORES: usize = 1;
    const SEARCH_LEN: usize = FEATURES * SIDE * SIDE;

    type Comparison = Comparison;
    type Embedding = Backbone;

    fn embeddings(&mut self) -> (&mut Backbone, &mut Backbone) {
        (&mut self.template, &mut self.search)
    }

    fn comparison(&self, features: &[f32]) -> Comparison {
        Comparison::new(features)
    }

    fn search(&mut self, comparison: &Comparison, scores: &mut [f32], boxes: &mut [f32]) {
        self.head.run(comparison, self.search.run(), scores, boxes);
    }

    fn copy_features(&self, features: &mut [f32]) {
        if let Some(map) = self.search.features() {
            map.copy_to(features);
        }
    }
}
