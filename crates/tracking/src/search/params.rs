//! The group `[search]`.

pursuit_parameters::choices! {
    /// Where the loop looks.
    pub enum SearchModel {
        /// Near the prediction, always.
        Near = "near",
        /// Near the prediction, and all over the frame once the target is lost.
        NearThenWide = "near-then-wide",
        /// In the gate of the innovation covariance, and all over the frame once the target is lost.
        Gate = "gate",
        /// Near the prediction; while the target is unseen, as far as the innovation covariance says, step by step; all over
        /// the frame once it is lost.
        Widening = "widening",
        /// All over the frame, always, by localizers that take it in at one look; others look as with `near-then-wide`.
        Everywhere = "everywhere",
    }
}

pursuit_parameters::parameters! {
    /// Where the loop looks.
    pub struct SearchParams {
        /// The rule.
        pub model: SearchModel = SearchModel::NearThenWide, source "ours";
        /// How far the predicted motion moves the search: 0 looks where the target was, 1 where it is predicted.
        pub prediction_gain: f64 = 1.0, in 0.0..=1.0, source "ours";
        /// Side of the region about the prediction in which the target moves on; what is found outside came from elsewhere.
        pub reach: f64 = 2.5, in 1.0..=20.0, unit "target sizes", source "ours";
        /// Windows looked at per frame while searching all over.
        pub wide_windows: usize = 8, in 1..=1000, source "ours", of WIDE;
        /// Windows looked at elsewhere per frame while unsure of what is followed.
        pub side_windows: usize = 0, in 0..=1000, source "ours", of SIDEWAYS;
        /// Least probability from which what such a window shows is believed, where that is more than leaves no doubt.
        pub side_from: f64 = 0.0, in 0.0..=1.0, source "ours", of SIDEWAYS;
        /// Whether a lost target is looked for at the size that it had when it was seen whole, away from the border.
        pub whole_size: bool = false, source "ours", of WIDE;
        /// Sizes at which the frame is gone over, one after the other: 1, or 3: once as large, twice, half.
        pub sizes: usize = 1, in 1..=3, source "ours", of WIDE;
        /// Frames that going over the frame once may take, where the windows that are looked at would take longer; 0: as long as it takes.
        pub pass_frames: usize = 0, in 0..=1000, source "ours", of WIDE;
        /// Most windows looked at per frame for the sake of `pass_frames`.
        pub most_windows: usize = 24, in 1..=1000, source "ours", of WIDE;
        /// Places that are looked at again in the next frames before one is believed to show the lost target; 0: one look is enough.
        pub tentative: usize = 0, in 0..=3, source "ours", of WIDE;
        /// Log odds that a place must gather over its looks.
        pub believe_at: f64 = 4.6, in 0.0..=50.0, unit "log odds", source "wald1945: ln((1 − β)/α), α = β = 0.01";
        /// Log odds that one look must exceed to speak for a place.
        pub neutral: f64 = 0.0, in -20.0..=20.0, unit "log odds", source "ours";
        /// Share of what one look says that is new beside the look of the frame before.
        pub news: f64 = 0.5, in above(0.0).at_most(1.0), source "ours";
        /// A place whose find was doubted on probation (`policy.probation_s`) is not looked at again for so long, so that a look-alike
        /// does not hide the target from the search; 0: it is.
        pub refuse_s: f64 = 0.0, in 0.0..=3600.0, unit "s", source "ours", of WIDE;
        /// Whether a centre that is seen outside of the frame is moved to its border.
        pub keep_inside: bool = false, source "ours";
        /// A target that is not seen is expected no farther outside of the picture than that: it left where it left; 0: wherever it is
        /// predicted.
        pub outside: f64 = 0.0, in 0.0..=1000.0, unit "target sizes", source "ours";
        /// Greatest squared distance from the prediction in units of the innovation covariance (χ² with 2 degrees of
        /// freedom; 13.8 is its 99.9 % quantile).
        pub gate_chi2: f64 = 13.8, in above(0.0), source "ours";
        /// A gate that is searched.
        pub gate: GateParams = GateParams::default(), of [SearchModel::Gate];
        /// A region that grows.
        pub widening: WideningParams = WideningParams::default(), of [SearchModel::Widening];
    }
    renamed {
        "gate_slack" => ["gate.slack"],
        "gate_margin" => ["gate.margin"],
        "gate_unseen" => ["gate.unseen"],
        "widening_per_s" => ["widening.growth_per_s"],
    }
}

/// The models that look all over the frame once the target is lost.
const WIDE: [SearchModel; 4] =
    [SearchModel::NearThenWide, SearchModel::Gate, SearchModel::Widening, SearchModel::Everywhere];
/// The models that look elsewhere while unsure of what is followed.
const SIDEWAYS: [SearchModel; 4] =
    [SearchModel::Near, SearchModel::NearThenWide, SearchModel::Gate, SearchModel::Everywhere];

pursuit_parameters::parameters! {
    /// The search `gate`.
    pub struct GateParams {
        /// Standard deviation added to the gate, for what blur and shadow do to a measured centre.
        pub slack: f64 = 0.35, in 0.0..=10.0, unit "target sizes", source "ours";
        /// Looked at on every side beyond the gate.
        pub margin: f64 = 1.0, in 0.0..=10.0, unit "target sizes", source "ours";
        /// What the gate's covariance is multiplied by while the target is coasted. A hidden target may bounce behind what hides
        /// it, but far more often what shows up far away is something else.
        pub unseen: f64 = 0.5, in above(0.0).at_most(1.0), source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The search `widening`.
    pub struct WideningParams {
        /// How fast the region grows at least while the target is unseen.
        pub growth_per_s: f64 = 10.0, in 0.0..=1000.0, unit "target sizes/s", source "ours";
    }
}

impl SearchParams {
    /// Looks where the target was seen last, as the papers of correlation filters and Siamese networks do: on real sequences no
    /// prediction does better (`docs/guide/motion-models.md`).
    pub fn at_last_place() -> Self {
        Self { prediction_gain: 0.0, ..Self::default() }
    }
}
