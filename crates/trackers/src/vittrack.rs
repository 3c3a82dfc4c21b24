//! The network tracker `vittrack`: VitTrack, its network written out in `pursuit-inference`, in the one loop with state, calibrated score and
//! re-detection. See `docs/papers/vittrack.md`.

use crate::siamese::{ScoreWeights, SiameseLocalizer, SiameseModel, built_in};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::siamese::SiameseConfig;
use pursuit_inference::vittrack::VitTrack;
use pursuit_tracking::{LocalizerRecipe, Result, TrackerRecipe};

pursuit_parameters::parameters! {
    /// Parameters of the tracker by VitTrack.
    pub struct VitTrackParams {
        /// Weight of the cosine window that the network's score is multiplied by.
        pub window_weight: f64 = 1.0, in 0.0..=1.0, source "as released";
        /// Penalty on changes of size and shape.
        pub penalty: f64 = 0.0, in 0.0..=10.0, source "as released: none";
        /// How fast the size follows.
        pub size_rate: f64 = 1.0, in 0.0..=1.0, source "as released: at once";
        /// Least width and height of a box.
        pub min_side_px: f64 = 2.0, in above(0.0), unit "px", source "as released";
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = 0.70, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the log odds of the network's score.
        pub score_weight: f64 = 4.18, in 0.0.., source "ours, fitted";
    }
}

impl SiameseModel for VitTrackParams {
    type Network = VitTrack;

    const NAME: &'static str = "vittrack";

    fn open(&self) -> Result<(VitTrack, SiameseConfig)> {
        let config = SiameseConfig::one_stream().with_weights(self.window_weight, self.penalty, self.size_rate);
        built_in(Self::NAME, VitTrack::new(), config.and_then(|config| config.with_min_side_px(self.min_side_px)))
    }

    fn score_weights(&self) -> ScoreWeights {
        ScoreWeights { bias: self.score_bias, score: self.score_weight, embedding: 0.0 }
    }
}

impl LocalizerRecipe for VitTrackParams {
    type Localizer = SiameseLocalizer<Self>;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<SiameseLocalizer<Self>> {
        SiameseLocalizer::new(self, frame, bbox)
    }
}

/// `vittrack`. The released tracker looks where the target was, and so does this one.
pub fn vittrack(name: &'static str) -> TrackerRecipe<VitTrackParams> {
    crate::siamese::recipe(name, VitTrackParams::default())
}
