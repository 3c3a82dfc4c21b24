//! Parameters of TLD. Those said to be of the released TLD are that program's where it departs from kalal2012.

use crate::appearance::SimilarityForm;
use crate::flow::FlowParams;

pursuit_parameters::choices! {
    /// Which windows a region picks.
    pub enum GateBy {
        /// Those whose centre lies in it, of sizes near the expected one.
        Center = "center",
        /// Those that touch it, of any size (zhu2014, claim 6).
        Intersection = "intersection",
    }
}

pursuit_parameters::parameters! {
    /// The grid of windows and its gate.
    pub struct ScanParams {
        /// Ratio of neighbouring sizes.
        pub scale_step: f64 = 1.2, in above(1.0).at_most(2.0), source "kalal2012, section 5.3: 1.2";
        /// Sizes below, and above, that at the start.
        pub scales: usize = 10, in 0..=20, source "released TLD: 10";
        /// Least side of a window; that of the target at the start where that is shorter.
        pub least_window_px: f64 = 20.0, in 4.0..=200.0, unit "px", source "kalal2012, section 5.3; zhu2014: 20";
        /// Where the search leaves some of the frame out, the whole of it is gone through in so many frames all the same, a band
        /// at a time: what looks like the target elsewhere is learned before the target is lost. 0: it is not.
        pub turn_frames: usize = 20, in 0..=1000, unit "frames", source "ours; zhu2014: 0";
        /// Which windows the region of the search picks.
        pub gate_by: GateBy = GateBy::Center, source "ours; zhu2014: intersection";
        /// Of `center`: sizes below, and above, the expected one.
        pub gate_scales: usize = 3, in 0..=40, source "ours";
        /// Shares of the windows that are scanned side by side, by threads common to all trackers; what is found is the same.
        pub threads: usize = 1, in 1..=16, source "ours";
        /// A target with a shorter side than this is looked at with its surroundings, up to this.
        pub least_view_px: f64 = 10.0, in 1.0..=100.0, unit "px", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The ensemble of random ferns.
    pub struct FernParams {
        /// Ferns.
        pub count: usize = 10, in 1..=16, source "kalal2012, section 5.3: 10";
        /// Comparisons of a fern.
        pub comparisons: usize = 13, in 1..=14, source "kalal2012, section 5.3: 13";
        /// Windows of more than this mean posterior pass.
        pub posterior: f64 = 0.5, in 0.0..=1.0, source "kalal2012, section 5.3: 0.5";
        /// Radius of the means that are compared, in pixels of the picture at least.
        pub smooth_px: f64 = 1.5, in 0.5..=20.0, unit "px", source "ours; kalal2012: a Gaussian of 3 px";
        /// Most windows handed on, the likeliest first.
        pub most_windows: usize = 100, in 1..=1000, source "released TLD: 100";
        /// Least variance of a window, as a share of the target's at the start.
        pub variance: f64 = 0.5, in 0.0..=1.0, source "kalal2012, section 5.3: 50 %";
    }
}

pursuit_parameters::choices! {
    /// By which patches a box is put right.
    pub enum RefineBy {
        /// By none: it stays where it was followed to.
        Nothing = "nothing",
        /// By all of the object.
        All = "all",
        /// By the earliest half.
        Early = "early",
    }
}

pursuit_parameters::parameters! {
    /// Small moves of a box to where it resembles the object more.
    pub struct RefineParams {
        /// By which patches.
        pub by: RefineBy = RefineBy::Early, source "ours; kalal2012: nothing";
        /// A box of less conservative similarity is left where it is: it may be anything.
        pub from: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// A move, in sides.
        pub shift: f64 = 0.04, in 0.0..=0.5, unit "target sizes", source "ours";
        /// A change of size.
        pub resize: f64 = 0.03, in 0.0..=0.5, source "ours";
        /// Most rounds of moves.
        pub rounds: usize = 2, in 0..=20, source "ours";
        /// What a move must gain in similarity.
        pub gain: f64 = 0.005, in 0.0..=1.0, source "ours";
    }
    renamed { "scale" => ["resize"] }
}

impl RefineParams {
    /// In small steps, for comparing similarities: windows of the grid lie a few hundredths beside the target.
    fn fine() -> Self {
        Self { shift: 0.02, resize: 0.02, rounds: 8, gain: 0.001, ..Self::default() }
    }
}

pursuit_parameters::parameters! {
    /// The nearest-neighbour classifier.
    pub struct NeighborParams {
        /// Side of its patches.
        pub side: usize = 15, in 5..=31, unit "px", source "kalal2012, section 5.1: 15";
        /// How similarities are joined.
        pub similarity: SimilarityForm = SimilarityForm::Distance, source "released TLD";
        /// Windows of more than this relative similarity are the object.
        pub threshold: f64 = 0.6, in 0.0..=1.0, source "kalal2012, section 5.2: 0.6 (released TLD: 0.65)";
        /// A trajectory is valid once its conservative similarity exceeds this.
        pub valid: f64 = 0.7, in 0.0..=1.0, source "released TLD: 0.7";
        /// And no longer when it falls below this.
        pub invalid: f64 = 0.3, in 0.0..=1.0, source "ours; kalal2012: 0";
        /// A box that was followed to where the conservative similarity is below this is no longer the target.
        pub followed: f64 = 0.1, in 0.0..=1.0, source "ours; kalal2012: 0";
        /// So is one of which a smaller share than this is in the frame.
        pub inside: f64 = 0.5, in 0.0..=1.0, source "ours; kalal2012: 0";
        /// And one that is so many times smaller than the detector's smallest windows, or larger than its largest.
        pub beyond: f64 = 1.5, in 1.0..=100.0, source "ours; kalal2012: no limit";
        /// Points are no longer followed when the target was not seen for so long, unless the detector sees it there.
        pub patience_s: f64 = 1e9, in 0.0.., unit "s", source "ours; kalal2012: no limit";
        /// What is detected is another thing if the log odds of its conservative similarity are lower by this than those of what
        /// was seen lately: of a target that was matched closely a poor match is a look-alike.
        pub as_before: f64 = 0.45, in 0.0.., source "ours; kalal2012: no limit";
        /// How long ago "lately" is.
        pub memory_s: f64 = 0.5, in above(0.0), unit "s", source "ours";
        /// What is seen is put right, for that, in one frame of so many.
        pub compare_every: usize = 5, in 1..=1000, unit "frames", source "ours";
        /// Of several places detected the best one counts if its conservative similarity exceeds that of the next by this.
        pub margin: f64 = 0.1, in 0.0..=1.0, source "ours; kalal2012: none counts";
        /// Patches of the object are added up to this relative similarity.
        pub learn_below: f64 = 0.65, in 0.0..=1.0, source "released TLD: 0.65";
        /// Most patches of either kind.
        pub capacity: usize = 100, in 2..=1000, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// What is learned.
    pub struct LearningParams {
        /// Windows nearest to the box that are warped.
        pub closest: usize = 10, in 1..=100, source "kalal2012, section 5.3: 10";
        /// Warps of each at the start.
        pub first_warps: usize = 20, in 0..=200, source "kalal2012, section 5.3: 20";
        /// Warps of each later.
        pub warps: usize = 10, in 0..=200, source "kalal2012, section 5.4: 10";
        /// Largest turn of a warp at the start, either way.
        pub first_turn_deg: f64 = 10.0, in 0.0..=90.0, unit "degrees", source "kalal2012, section 5.3: ±10";
        /// Largest turn of a warp later.
        pub turn_deg: f64 = 5.0, in 0.0..=90.0, unit "degrees", source "kalal2012, section 5.4: ±5";
        /// Largest shift, in sides, and change of size of a warp.
        pub shift: f64 = 0.01, in 0.0..=0.2, source "kalal2012, section 5.3: ±1 %";
        /// Standard deviation of the noise added to a warp.
        pub noise: f64 = 5.0, in 0.0..=50.0, unit "grey codes", source "kalal2012, section 5.3: 5";
        /// Windows that overlap the box less than this are not the object.
        pub negative_overlap: f64 = 0.2, in 0.0..=1.0, source "kalal2012, section 5.3: 0.2";
        /// Patches of these that the classifier starts with.
        pub first_negatives: usize = 100, in 0..=1000, source "released TLD: 100";
        /// A box of less relative similarity changed too fast to be learned from.
        pub least_similarity: f64 = 0.45, in 0.0..=1.0, source "ours; released TLD: 0.5";
        /// So was one of less conservative similarity.
        pub least_conservative: f64 = 0.35, in 0.0..=1.0, source "ours; kalal2012: 0";
        /// Windows that overlap the box more than this may be warped.
        pub near_overlap: f64 = 0.6, in 0.0..=1.0, source "released TLD: 0.6";
        /// Windows about the box that are tried for nearness, in shifts either way.
        pub near_reach: usize = 3, in 0..=10, source "ours";
        /// Most windows that pass the ferns while the classifiers are first trained.
        pub most_first: usize = 5000, in 1..=100_000, source "ours";
        /// Rounds of training, at the start, on what passes by mistake.
        pub first_rounds: usize = 2, in 0..=20, source "ours";
        /// Most patches that one frame adds to what is not the object.
        pub most_negatives: usize = 10, in 0..=100, source "ours";
        /// Windows elsewhere of more than this relative similarity are learned as not the object.
        pub negative_from: f64 = 0.5, in 0.0..=1.0, source "released TLD: 0.5";
        /// Chooses ferns, warps, and what is forgotten.
        pub seed: u64 = 1, in Bounds::default(), source "ours";
    }
}

pursuit_parameters::parameters! {
    /// How what was followed and what was detected are joined (kalal2012, section 5.6).
    pub struct IntegratorParams {
        /// Detections that overlap by at least this mean one thing.
        pub same_from: f64 = 0.5, in above(0.0).at_most(1.0), source "kalal2012, section 5.6: 0.5";
        /// Detections that overlap the followed box by more refine it.
        pub near: f64 = 0.7, in 0.0..=1.0, source "released TLD: 0.7";
        /// One that overlaps the followed box by less is somewhere else, and may take over.
        pub elsewhere: f64 = 0.5, in 0.0..=1.0, source "released TLD: 0.5";
        /// And does, if its conservative similarity exceeds that of the followed box by this.
        pub better: f64 = 0.1, in 0.0..=1.0, source "ours; kalal2012: 0";
        /// What the followed box weighs against one detection in their mean.
        pub followed_weight: f64 = 10.0, in 0.0..=1000.0, source "released TLD: 10";
    }
}

pursuit_parameters::parameters! {
    /// What a filtered box must prove (zhu2014, claim 3).
    pub struct GuideParams {
        /// The filtered box replaces the one that was followed above this conservative similarity; above 1: never.
        pub replace_above: f64 = 0.85, in 0.0..=2.0, source "zhu2014, claim 3: 0.85";
        /// The filtered box must also resemble the target at least as much as the one followed.
        pub no_worse: bool = true, source "ours; zhu2014, claim 3: false";
        /// Below this the motion model starts anew.
        pub restart_below: f64 = 0.6, in 0.0..=1.0, source "zhu2014, claim 3: 0.6";
        /// And after so many frames; 0: never.
        pub restart_every: usize = 30, in 0..=100_000, unit "frames", source "zhu2014, claim 3: open; ours: 30";
    }
}

impl GuideParams {
    /// No filtered box is ever taken, and the motion model goes on as it is.
    pub fn none() -> Self {
        Self { replace_above: 2.0, no_worse: true, restart_below: 0.0, restart_every: 0 }
    }
}

pursuit_parameters::parameters! {
    /// The score: log odds of the box being right, by logistic regression on the conservative similarity alone. The relative
    /// similarity and validity say nothing more of sequences that were left out: both grow with what is learned by mistake.
    pub struct TldScoreParams {
        /// Constant.
        pub bias: f64 = -3.64, in Bounds::default(), source "ours, fitted";
        /// Weight of the conservative similarity.
        pub conservative: f64 = 8.17, in Bounds::default(), source "ours, fitted";
    }
}

pursuit_parameters::parameters! {
    /// Parameters of TLD (kalal2012).
    pub struct TldParams {
        /// How the box is followed.
        pub flow: FlowParams = FlowParams::eight_px();
        /// The grid of windows and its gate.
        pub scan: ScanParams = ScanParams::default();
        /// The ensemble of random ferns.
        pub ferns: FernParams = FernParams::default();
        /// The nearest-neighbour classifier.
        pub neighbor: NeighborParams = NeighborParams::default();
        /// How followed and detected boxes are joined.
        pub integrator: IntegratorParams = IntegratorParams::default();
        /// Small moves to where the box resembles the object more.
        pub refine: RefineParams = RefineParams::default();
        /// The same, of the boxes whose similarity is compared with that of what was seen lately (`neighbor.as_before`).
        pub align: RefineParams = RefineParams::fine();
        /// What is learned.
        pub learning: LearningParams = LearningParams::default();
        /// What a filtered box must prove.
        pub guide: GuideParams = GuideParams::none();
        /// The score.
        pub score: TldScoreParams = TldScoreParams::default();
    }
}
