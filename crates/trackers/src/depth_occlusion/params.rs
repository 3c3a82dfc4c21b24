use crate::depth::{HistogramParams, RegionParams};
use crate::kcf::{KcfFeatures, KcfParams};

pursuit_parameters::parameters! {
    /// Parameters of the depth-aware tracker.
    pub struct DepthOcclusionParams {
        /// ε: what a metre of difference between the mean depths, before and here, takes from the response.
        pub epsilon: f64 = 0.15, in 0.0..=10.0, unit "1/m", source "zhai2024, eq. 20; section 3: 0.1 to 0.2";
        /// ε′: the same while the target is out of sight.
        pub epsilon_again: f64 = 0.2, in 0.0..=10.0, unit "1/m", source "zhai2024, eq. 30; section 3: 0.2";
        /// minFz: below this response the target is occluded.
        pub min_response: f64 = 0.2, in 0.0..=1.0, source "zhai2024, section 3: 0.2";
        /// The same where nothing nearer covers it and what is there is as far away as it was: a target that only looks
        /// different is no occluded one. Equal to `min_response`: the paper.
        pub min_clear: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Δf: a target out of sight is found where the response is less than this below the usual one.
        pub response_drop: f64 = 0.2, in 0.0..=1.0, source "zhai2024, eq. 30; section 3: 0.15 to 0.25";
        /// The same about where it is expected, where most of what is there is as far away as the target was: then it may look
        /// more different. Equal to `response_drop`: the paper.
        pub drop_clear: f64 = 0.35, in 0.0..=1.0, source "ours";
        /// Whether a target in sight whose response has dropped by Δf is looked for where it was last too: it may have turned back,
        /// or stopped, against the prediction; false: the paper.
        pub look_back: bool = true, source "ours";
        /// What being wholly covered by something nearer takes from the response; 0: the paper.
        pub cover_weight: f64 = 0.3, in 0.0..=10.0, source "ours";
        /// A distance elsewhere counts for at most this much: where the target was lost, camera and target may have moved.
        pub farthest_m: f64 = 1.0, in above(0.0), unit "m", source "ours";
        /// How fast the usual response follows what is seen.
        pub usual_rate: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// The share of a box that has to be as far away as the target was for the target to be there.
        pub here: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Things nearer than the target by this cover it.
        pub nearer_by: f64 = 0.12, in above(0.0), unit "m", source "ours";
        /// How far from its mean distance what is part of the target may be.
        pub half_depth: f64 = 0.3, in above(0.0), unit "m", source "ours";
        /// A target of which more than this share is covered is not learned.
        pub learn_covered: f64 = 0.15, in 0.0..=1.0, source "ours";
        /// The velocity takes of its correction the share to which the response is left, to this power, with the motion model
        /// `constant-velocity`; 0: the paper.
        pub velocity_doubt: f64 = 4.0, in 0.0..=20.0, source "ours";
        /// Change of the response that changes the odds of the score by e.
        pub softness: f64 = 0.05, in above(0.0), source "ours";
        /// Particles, N.
        pub particles: usize = 50, in 1..=10_000, source "ours; zhai2024 leaves it open";
        /// Width σ of the likelihood.
        pub likelihood_sigma: f64 = 0.1, in above(0.0), source "ours; zhai2024, eq. 27 leaves it open";
        /// Depths less similar to the target's than this say nothing: a hidden target's are those of what hides it.
        pub least_similarity: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Particles are drawn anew where N_eff falls below this share of them.
        pub resample_below: f64 = 0.5, in 0.0..=1.0, source "ours; zhai2024, section 2.2.5 leaves it open";
        /// Share of a new histogram of depths in the target's.
        pub histogram_rate: f64 = 0.1, in 0.0..=1.0, source "ours";
        /// Places nearer to each other than this are one.
        pub apart: f64 = 0.4, in 0.0..=10.0, unit "target sizes", source "ours";
        /// Places about the particles that are searched with the model as it was.
        pub clusters: usize = 3, in 0..=32, source "ours";
        /// Whether the edges of what hides the target are searched too.
        pub occluder_edges: bool = true, source "ours";
        /// Whether the size follows the distance.
        pub scale_from_depth: bool = true, source "ours";
        /// At another place than the expected one a target may be this many times larger or smaller than it was.
        pub most_resize: f64 = 2.0, in 1.0..=10.0, source "ours";
        /// A depth image with data in fewer points than this share is none.
        pub least_depth: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// Points along a side of the grid by which that is told.
        pub probes: usize = 24, in 1..=256, unit "points", source "ours";
        /// Where a smaller share of the target's box has depth, the filter on the picture judges: what is nearer than the sensor
        /// reaches, black, shiny or a window has none. 0: the paper.
        pub scarce_depth: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// What speaks against a target out of sight that the picture shows where there is no depth, less by the share of what borders
        /// it that is nearer than the target was: holes before near things are what came too close to be measured.
        pub hole_doubt: f64 = 1.5, in 0.0..=20.0, unit "nats", source "ours";
        /// How much what the picture says counts beside depth, of a target that is found again; 0: the paper.
        pub picture_again: f64 = 1.0, in 0.0..=10.0, source "ours";
        /// The filter on the picture, for frames without depth, learns every so many frames.
        pub picture_every: usize = 4, in 1..=1000, unit "frames", source "ours";
        /// What hides the target.
        pub occluder: OccluderParams = OccluderParams::default();
        /// The path in space.
        pub space: SpaceParams = SpaceParams::default();
        /// How the depth of a box is looked at.
        pub region: RegionParams = RegionParams::default();
        /// Histograms of depth.
        pub histogram: HistogramParams = HistogramParams::default();
        /// The filter on depth.
        pub filter: KcfParams = KcfParams { features: KcfFeatures::DepthHog, ..KcfParams::fixed() };
        /// The filter on the picture, for frames without depth.
        pub picture: KcfParams = KcfParams::default();
    }
}

impl DepthOcclusionParams {
    /// The paper alone: no cover, no edges, a size that stays.
    pub fn zhai2024() -> Self {
        Self {
            min_clear: 0.2,
            drop_clear: 0.2,
            cover_weight: 0.0,
            learn_covered: 1.0,
            look_back: false,
            velocity_doubt: 0.0,
            occluder_edges: false,
            scale_from_depth: false,
            scarce_depth: 0.0,
            picture_again: 0.0,
            ..Self::default()
        }
    }
}

pursuit_parameters::parameters! {
    /// How what hides the target is followed.
    pub struct OccluderParams {
        /// Pixels within this of its distance are its own.
        pub thickness_m: f64 = 0.25, in above(0.0), unit "m", source "ours";
        /// Its edges are looked for this far from the target's expected place.
        pub reach: f64 = 4.0, in 0.0..=100.0, unit "target sizes", source "ours";
        /// Pixels of something else, or without data, that do not end it.
        pub gap_px: usize = 6, in 0..=1000, unit "px", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The target's path in space, where the camera's lens is known.
    pub struct SpaceParams {
        /// Spectral density of the white acceleration.
        pub acceleration: f64 = 1.0, in above(0.0), unit "m²/s³", source "ours";
        /// Standard deviation of a measured centre.
        pub center_px: f64 = 1.0, in above(0.0), unit "px", source "ours";
        /// Standard deviation of a distance, over its square.
        pub distance: f64 = 1.425e-3, in above(0.0), unit "1/m", source "Khoshelham & Elberink 2012, eq. 8";
        /// Standard deviation of the velocity at the start.
        pub start_speed: f64 = 1.0, in above(0.0), unit "m/s", source "ours";
        /// What is nearer than this cannot be projected.
        pub nearest_m: f64 = 0.1, in above(0.0), unit "m", source "ours";
    }
}
