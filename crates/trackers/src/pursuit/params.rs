//! Parameters of `pursuit` and `pursuit-light`.

use super::judge::{JointEvidence, JudgeParams};
use crate::correlation::{
    ColorParams, GuideParams, Likeness, PeakParams, ScaleFilterParams, ScoreParams, SolverParams, Subpixel, SweepBy,
    WindowParams, WindowShape,
};
use crate::lightfc::LightFcParams;
use crate::nanotrack::NanoTrackParams;
use pursuit_tracking::Taken;

/// Area of the default patch: 40 cells of 4 pixels each way (galoogahi2017: 50; ours is as accurate and faster).
const PATCH_PX: f64 = 160.0 * 160.0;

pursuit_parameters::parameters! {
    /// Parameters of `pursuit-light`, and of the filter of `pursuit`. What is not said to be ours is that of the paper it names.
    pub struct FilterParams {
        /// Standard deviation of the label as a share of the target's side.
        pub label_sigma: f64 = 0.0625, in above(0.0).below(1.0), source "galoogahi2017, section 4: 1/16";
        /// Share of the new sample per frame, η.
        pub learning_rate: f64 = 0.013, in 0.0..=1.0, source "galoogahi2017, section 4: 0.013";
        /// The window.
        pub window: WindowParams = WindowParams {
            shape: WindowShape::Square,
            padding: 4.0,
            smallest_area_px: PATCH_PX,
            largest_area_px: PATCH_PX,
            ..WindowParams::default()
        };
        /// The filter's solver.
        pub solver: SolverParams = SolverParams::default();
        /// A mask that says what of the box is learnt.
        pub guide: GuideParams = GuideParams::none();
        /// The filter along scale.
        pub scale: ScaleFilterParams =
            ScaleFilterParams { on_return: true, size_kept_px: 8.0, size_followed_px: 24.0, ..ScaleFilterParams::default() };
        /// How responses are read.
        pub peaks: PeakParams =
            PeakParams { candidates: 3, subpixel: Subpixel::Series, ..PeakParams::default() };
        /// Colours, as evidence.
        pub color: ColorParams = ColorParams::default();
        /// The score, fitted as `docs/papers/pursuit.md` says.
        pub score: ScoreParams = ScoreParams {
            bias: -8.0,
            peak: 3.4,
            likeness: 17.2,
            likeness_by: Likeness::Cosine,
            color: 1.72,
            sweep_by: SweepBy::Score,
            ..ScoreParams::default()
        };
    }
}

pursuit_parameters::parameters! {
    /// How the two witnesses are brought together.
    pub struct FusionParams {
        /// Boxes that overlap by this much are of one thing.
        pub agree_from: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// Boxes that overlap by this much are as good as each other: below, down to `agree_from`, the network's counts for more.
        pub same_from: f64 = 0.7, in 0.0..=1.0, source "ours";
        /// Of boxes as good as each other, the network's share in the place.
        pub network_center: f64 = 0.65, in 0.0..=1.0, source "ours";
        /// Of boxes as good as each other, the network's share in the size.
        pub network_size: f64 = 0.75, in 0.0..=1.0, source "ours";
        /// A filter that agrees this much goes its own way: it looks and learns where it saw the target itself.
        pub own_from: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Share of the difference between the first box and the network's there that the places of later ones are put right by.
        pub convention_center: f64 = 0.25, in 0.0..=1.0, source "ours";
        /// The same for the sizes.
        pub convention_size: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// A difference of the place, in sizes, or of the logarithm of a side beyond this is a mistake of the network, and no convention.
        pub convention_limit: f64 = 0.5, in 0.0..=2.0, source "ours";
        /// Where only the network is believed, the filter learns from this probability.
        pub teach_from: f64 = 0.88, in 0.0..=1.0, source "ours";
        /// From this on the network sees something like the target: what is not believed there has `changed`, or is one of several
        /// (`confused`); below, it is `covered`. Only the word in the files goes by it.
        pub seen_from: f64 = 4.0, in -20.0..=20.0, unit "log odds", source "ours";
        /// The same of LightFC, which has the last word where it was asked.
        pub lightfc_seen_from: f64 = -0.5, in -20.0..=20.0, unit "log odds", source "ours";
        /// While both agree beyond doubt, the network is asked in every so many frames; in between its last answer stands
        /// beside what the filter says. 1: in every frame.
        pub ask_every: usize = 1, in 1..=1000, source "ours";
        /// While both agree beyond doubt, the network may take so long a frame on average; 0: as long as it takes. Boxes then
        /// depend on how fast the machine is.
        pub budget_ms: f64 = 0.0, in 0.0..=10_000.0, unit "ms", source "ours";
        /// From this probability on, what both agree on is beyond doubt.
        pub sure_from: f64 = 0.85, in 0.5..=0.999, source "ours";
    }
    ordered { agree_from <= same_from }
}

pursuit_parameters::parameters! {
    /// Which network is asked when.
    pub struct NetworksParams {
        /// LightFC is asked in every so many frames, sooner where there is a doubt, and its box is taken; 0: never.
        pub lightfc_every: usize = 5, in 0..=1000, source "ours";
        /// What is less likely than this is a doubt, as are witnesses that differ.
        pub lightfc_below: f64 = 0.6, in 0.01..=0.99, source "ours";
        /// In doubt LightFC is asked in every so many frames, if it is asked at all.
        pub lightfc_doubtful_every: usize = 2, in 1..=1000, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Whom to follow where the witnesses disagree: a logistic regression of the differences between what is known of the
    /// filter's box and of the network's, fitted to the frames of real sequences where they disagree and one is right.
    pub struct ArbitrationParams {
        /// Log odds for the filter where nothing speaks for either.
        pub bias: f64 = -1.4, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of ln of the filter's peak.
        pub peak: f64 = 1.1, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of ln of the mean likelihood of the colours.
        pub color: f64 = 1.1, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of the log odds of the network's score.
        pub network: f64 = 0.12, in Bounds::default(), source "ours, fitted";
        /// One frame says no more than this for either.
        pub frame_limit: f64 = 6.0, in above(0.0).at_most(100.0), unit "log odds", source "ours";
        /// Share of a frame in what is remembered of earlier frames.
        pub rate: f64 = 0.2, in above(0.0).at_most(1.0), source "ours";
        /// How much what is remembered counts beside the frame at hand.
        pub memory: f64 = 1.0, in 0.0.., source "ours";
        /// From this on, in log odds remembered, the loser is put where the winner is.
        pub settled_from: f64 = 1.0, in 0.0.., unit "log odds", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Whether LightFC's box is taken where it differs from what the other witnesses take for the target: a logistic regression of
    /// how much better the filter, which has learned the target's later looks, answers at LightFC's place.
    pub struct ExpertArbitrationParams {
        /// Log odds for LightFC where nothing speaks for either.
        pub bias: f64 = 1.6, in Bounds::default(), source "ours, fitted";
        /// Weight of the difference of ln of the filter's peak.
        pub peak: f64 = 6.0, in Bounds::default(), source "ours, fitted";
    }
}

impl ExpertArbitrationParams {
    /// Log odds that LightFC's box is the right one of two.
    pub fn odds(&self, expert: &JointEvidence, other: &JointEvidence) -> f64 {
        let ln = |v| Taken::Ln.of(v);
        self.bias + self.peak * (ln(expert.peak) - ln(other.peak))
    }
}

pursuit_parameters::parameters! {
    /// Parameters of the default tracker.
    pub struct PursuitParams {
        /// The witness that learns: a correlation filter.
        pub filter: FilterParams = FilterParams {
            // Of the size the network has the greater part.
            scale: ScaleFilterParams { area_px: 512.0, ..FilterParams::default().scale },
            ..FilterParams::default()
        };
        /// The witness that does not: a network.
        pub network: NanoTrackParams = NanoTrackParams::default();
        /// The network that sees better, asked now and then.
        pub expert: LightFcParams = LightFcParams::default();
        /// Which network is asked when.
        pub networks: NetworksParams = NetworksParams::default();
        /// How they are brought together.
        pub fusion: FusionParams = FusionParams::default();
        /// Whom to follow where they disagree.
        pub arbitration: ArbitrationParams = ArbitrationParams::default();
        /// Whether LightFC's box is taken where it differs.
        pub expert_arbitration: ExpertArbitrationParams = ExpertArbitrationParams::default();
        /// The judge.
        pub judge: JudgeParams = JudgeParams::default();
        /// The judge of a target that was doubted in the frame before: what is followed then is another thing more often.
        pub doubted: JudgeParams = JudgeParams {
            bias: -3.6,
            likeness: 3.0,
            network: 0.35,
            overlap: -0.1,
            lightfc: 1.95,
            lightfc_overlap: 0.0,
            colors_fall: 0.25,
            embedding_fall: 0.4,
            ..JudgeParams::default()
        };
        /// The judge of what is found again: of one place against every other.
        pub returns: JudgeParams = JudgeParams {
            bias: -3.1,
            likeness: 0.0,
            network: 0.59,
            overlap: 0.0,
            lightfc: 0.0,
            lightfc_overlap: 0.0,
            likeness_fall: 3.5,
            lightfc_fall: 0.57,
            colors_fall: 0.3,
            embedding_fall: 0.7,
            ..JudgeParams::default()
        };
    }
}
