//! The network tracker `lightfc`: LightFC, its network written out in `pursuit-inference`, in the one loop with state, calibrated score and
//! re-detection. See `docs/papers/lightfc.md`.

use crate::siamese::{DOUBT_STAYS, ScoreWeights, SiameseLocalizer, SiameseModel, built_in};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::lightfc::LightFc;
use pursuit_inference::siamese::SiameseConfig;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the tracker by LightFC.
    pub struct LightFcParams {
        /// Weight of the cosine window that the network's score is multiplied by.
        pub window_weight: f64 = 1.0, in 0.0..=1.0, source "as released";
        /// Penalty on changes of size and shape.
        pub penalty: f64 = 0.0, in 0.0..=10.0, source "as released: none";
        /// How fast the size follows.
        pub size_rate: f64 = 1.0, in 0.0..=1.0, source "as released: at once";
        /// Least width and height of a box.
        pub min_side_px: f64 = 2.0, in above(0.0), unit "px", source "as released";
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = -6.5, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the log odds of the network's score.
        pub score_weight: f64 = 1.7, in 0.0.., source "ours, fitted";
        /// Score: weight of the likeness of the network's features in the box to those in the first one.
        pub score_embedding: f64 = 9.3, in Bounds::default(), source "ours, fitted";
    }
}

impl SiameseModel for LightFcParams {
    type Network = LightFc;

    const NAME: &'static str = "lightfc";

    fn open(&self) -> Result<(LightFc, SiameseConfig)> {
        let config = SiameseConfig::one_stream().with_weights(self.window_weight, self.penalty, self.size_rate);
        built_in(Self::NAME, LightFc::new(), config.and_then(|config| config.with_min_side_px(self.min_side_px)))
    }

    fn score_weights(&self) -> ScoreWeights {
        ScoreWeights { bias: self.score_bias, score: self.score_weight, embedding: self.score_embedding }
    }
}

impl LocalizerRecipe for LightFcParams {
    type Localizer = SiameseLocalizer<Self>;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<SiameseLocalizer<Self>> {
        SiameseLocalizer::remembering(self, frame, bbox)
    }
}

/// `lightfc`. The released tracker looks where the target was, and so does this one.
pub fn lightfc(name: &'static str) -> TrackerRecipe<LightFcParams> {
    let mut recipe = crate::siamese::recipe(name, LightFcParams::default());
    recipe.groups.policy.calibrated.lost_below = DOUBT_STAYS;
    recipe
}
