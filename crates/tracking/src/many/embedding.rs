//! What makes embeddings of detections that come without, and of which of them.

use super::association::Claimant;
use pursuit_parameters::FileName;

pursuit_parameters::choices! {
    /// What says what a detection looks like.
    pub enum EmbeddingModel {
        /// Nothing but what comes with the detections themselves.
        None = "none",
        /// Colours and edges in cells of the box: nothing to install, and for things whose colours differ.
        Colors = "colors",
        /// A network for re-identification by file, such as OSNet.
        Network = "network",
    }
}

pursuit_parameters::parameters! {
    /// What detections look like, where that decides whose they are and frames have pixels.
    pub struct EmbeddingParams {
        /// What says it; embeddings that come with detections are taken as they are.
        pub model: EmbeddingModel = EmbeddingModel::None, source "ours";
        /// Beside what is near two targets, or near a target that was missed, a detection is looked at where its target was not for so long.
        pub every_s: f64 = 0.5, in 0.0.., unit "s", source "ours";
        /// By colours.
        pub colors: ColorsEmbeddingParams = ColorsEmbeddingParams::default(), of [EmbeddingModel::Colors];
        /// By a network.
        pub network: NetworkEmbeddingParams = NetworkEmbeddingParams::default(), of [EmbeddingModel::Network];
    }
}

pursuit_parameters::parameters! {
    /// Colour names and oriented gradients in cells of the box.
    pub struct ColorsEmbeddingParams {
        /// The likeness that speaks neither for a pair nor against it, in place of `association.nearest.look_even`.
        pub even: f64 = 0.72, in -1.0..=1.0, source "ours, people of two clips";
    }
}

pursuit_parameters::parameters! {
    /// A network that says what the inside of a box looks like.
    pub struct NetworkEmbeddingParams {
        /// An ONNX file whose one input is an image of three planes, red, green and blue, less the means of ImageNet and over its
        /// deviations.
        pub file: FileName = FileName::default();
        /// Width of its image, where the file leaves it open.
        pub width_px: usize = 128, in 8..=1024, unit "pixels", source "zhou2019, section 4.1";
        /// Height of its image, likewise.
        pub height_px: usize = 256, in 8..=1024, unit "pixels", source "zhou2019, section 4.1";
        /// The likeness that speaks neither for a pair nor against it, in place of `association.nearest.look_even`.
        pub even: f64 = 0.64, in -1.0..=1.0, source "ours, OSNet on people of two clips";
        /// The file of the onnxruntime library, or the folder it is in; empty: the first found where systems put it.
        pub onnxruntime: FileName = FileName::default();
    }
}

impl EmbeddingParams {
    /// The likeness that speaks neither for a pair nor against it, of embeddings that it makes.
    pub(super) const fn even(&self) -> Option<f64> {
        match self.model {
            EmbeddingModel::None => None,
            EmbeddingModel::Colors => Some(self.colors.even),
            EmbeddingModel::Network => Some(self.network.even),
        }
    }
}

/// The detections whose looks decide something.
#[derive(Debug, Default)]
pub(super) struct Undecided {
    /// How many detections are near each target, and how many targets near each detection.
    near: (Vec<u32>, Vec<u32>),
    /// Of each detection, whether it is one.
    is: Vec<bool>,
}

impl Undecided {
    /// Looks at the pairs `(target, detection)` inside the gates: those of a target near which there are two detections, or that was
    /// missed, or whose looks are due; and those of a detection near two targets.
    pub fn find(
        &mut self,
        targets: &[Claimant<'_>],
        detections: usize,
        pairs: impl Iterator<Item = (usize, usize)> + Clone,
        every_s: f64,
    ) -> &[bool] {
        let (of_target, of_detection) = &mut self.near;
        of_target.clear();
        of_target.resize(targets.len(), 0);
        of_detection.clear();
        of_detection.resize(detections, 0);
        self.is.clear();
        self.is.resize(detections, false);
        let pairs = pairs.filter(|(target, _)| targets[*target].confirmed);
        for (target, detection) in pairs.clone() {
            of_target[target] += 1;
            of_detection[detection] += 1;
        }
        for (target, detection) in pairs {
            let Claimant { look, unseen_s, .. } = &targets[target];
            let contested = of_target[target] > 1 || of_detection[detection] > 1;
            self.is[detection] |= contested || *unseen_s > 0.0 || look.is_due(every_s);
        }
        &self.is
    }
}
