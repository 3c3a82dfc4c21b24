use super::palette::BallColor;
use serde::{Deserialize, Serialize};

/// How the ball's motion is filtered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BallMotionMode {
    /// Three interacting motion models: steady, flight under constant acceleration, sudden change of velocity.
    Adaptive,
    /// The filter of the paper with its printed noise.
    Paper,
}

crate::parameters! {
    /// Parameters of the `ball` tracker.
    pub struct BallParams for "ball" {
        /// Colour of the ball: `auto` learns it from the box; `yellow`, `orange`, `green`, `white`, `red` and `blue` are
        /// tolerant ranges of hue, saturation and value within which it is then learned.
        pub color: BallColor = BallColor::Auto,
        /// Whether a preset's range is narrowed to the colour seen in the box (`auto` always learns).
        pub learn_range: bool = true,
        /// How motion is filtered: `adaptive`, or `paper` for the printed Q and R.
        pub motion: BallMotionMode = BallMotionMode::Adaptive,
        /// Radius of the erosion and the dilation as a fraction of the ball's size, at least one pixel; 0.05 is the
        /// paper's two 3x3 iterations for a ball of 40 pixels. In [0, 0.2].
        pub opening_radius: f64 = 0.05,
        /// Least squareness min(w/h, h/w), relative to the box started on, of a region that may be the ball come back
        /// after it was lost. Close to the prediction a streak or a part is accepted too. In [0, 1].
        pub min_squareness: f64 = 0.75,
        /// Greatest factor by which the size may differ from the expected one close to the prediction; squared after the
        /// ball was lost. At least 1.
        pub max_size_ratio: f64 = 1.8,
        /// Gate: greatest squared distance of a candidate's centre from the prediction, in units of the innovation
        /// covariance (chi-square with 2 degrees of freedom; 13.8 is its 99.9 % quantile). Positive.
        pub gate_chi2: f64 = 13.8,
        /// Standard deviation added to the gate, as a fraction of the ball's size: what segmentation does to the centre
        /// of a blurred or shaded ball. Not negative.
        pub gate_slack: f64 = 0.35,
        /// Least confidence of a candidate while the ball is tracked. In [0, 1].
        pub min_confidence: f64 = 0.25,
        /// Least confidence once it has been missed: like-coloured things nearby must not pass for it. In [0, 1].
        pub min_confidence_unseen: f64 = 0.5,
        /// Frames in a row without the ball before it counts as lost.
        pub misses_before_lost: u32 = 20,
        /// How fast the remembered appearance follows what is seen. In [0, 1].
        pub learning_rate: f64 = 0.05,
    }
    validate(self) {
        let fraction = |name: &str, value: f64, most: f64| {
            if (0.0..=most).contains(&value) { Ok(()) } else { Err(Self::reject(name, format!("must be between 0 and {most}"))) }
        };
        fraction("opening_radius", self.opening_radius, 0.2)?;
        fraction("min_squareness", self.min_squareness, 1.0)?;
        fraction("gate_slack", self.gate_slack, 10.0)?;
        fraction("min_confidence", self.min_confidence, 1.0)?;
        fraction("min_confidence_unseen", self.min_confidence_unseen, 1.0)?;
        fraction("learning_rate", self.learning_rate, 1.0)?;
        if !(self.max_size_ratio >= 1.0 && self.max_size_ratio.is_finite()) {
            return Err(Self::reject("max_size_ratio", "must be at least 1"));
        }
        if !(self.gate_chi2 > 0.0 && self.gate_chi2.is_finite()) {
            return Err(Self::reject("gate_chi2", "must be positive"));
        }
    }
}

crate::parameters! {
    /// Parameters of the `ball` detector.
    pub struct BallDetectorParams for "ball" {
        /// Colour of the ball: `yellow`, `orange`, `green`, `white`, `red`, `blue`, or `auto` for whatever looks most like a
        /// ball in any of them but white.
        pub color: BallColor = BallColor::Auto,
        /// Least squareness min(w/h, h/w) of the bounding rectangle. In [0, 1].
        pub min_squareness: f64 = 0.75,
        /// Least area as a fraction of the frame (0.0003: a ball of 11 pixels in 640x480). In [0, 1].
        pub min_area: f64 = 0.0003,
        /// Greatest area as a fraction of the frame. In [0, 1].
        pub max_area: f64 = 0.25,
        /// Least likeness to a ball (roundness, solidity, contrast to its surroundings) to be believed at once. In [0, 1].
        pub min_likeness: f64 = 0.6,
        /// Least likeness of one that has been seen in the frame before too. In [0, 1].
        pub min_likeness_again: f64 = 0.5,
    }
    validate(self) {
        let values = [
            ("min_squareness", self.min_squareness), ("min_area", self.min_area), ("max_area", self.max_area),
            ("min_likeness", self.min_likeness), ("min_likeness_again", self.min_likeness_again),
        ];
        if let Some((name, _)) = values.iter().find(|(_, v)| !(0.0..=1.0).contains(v)) {
            return Err(Self::reject(name, "must be between 0 and 1"));
        }
        if self.min_area > self.max_area {
            return Err(Self::reject("min_area", "must not exceed max_area"));
        }
    }
}
