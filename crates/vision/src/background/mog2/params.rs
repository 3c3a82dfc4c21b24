use crate::background::mixture::MOST;
use crate::error::{VisionError, require_range};
use serde::{Deserialize, Serialize};

/// Parameters of [`Mog2`](super::Mog2); the names of OpenCV's `BackgroundSubtractorMOG2` in parentheses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mog2Params {
    /// Frames that the background remembers, ≥ 1 (`history`): where [`Learning::rate`](crate::background::Learning::rate) leaves it to the model, frame n has
    /// the weight 1/min(2n, history).
    pub history_frames: usize,
    /// Most Gaussians a pixel, 1 to 8 (`nmixtures`).
    pub most_modes: usize,
    /// Squared distance from a Gaussian, in variances, below which a value is background (`varThreshold`), > 0.
    pub background_distance: f64,
    /// Squared distance, in variances, below which a value belongs to a Gaussian (`varThresholdGen`), > 0.
    pub match_distance: f64,
    /// The heaviest Gaussians that together weigh this are background, 0 to 1 (`backgroundRatio`).
    pub background_ratio: f64,
    /// Variance of a new Gaussian, codes² (`varInit`), from the least to the greatest.
    pub initial_variance: f64,
    /// Least variance, codes² (`varMin`), > 0.
    pub least_variance: f64,
    /// Greatest variance, codes² (`varMax`).
    pub most_variance: f64,
    /// Prior weight against many Gaussians, 0 to 0.5 (`complexityReductionThreshold`, c_T).
    pub complexity_reduction: f64,
    /// How dark a shadow may be relative to the background, 0 to 1 (`shadowThreshold`, τ); `None`: shadows are foreground.
    /// In grey images everything darkened that little is a shadow.
    pub shadow_ratio: Option<f64>,
}

impl Default for Mog2Params {
    /// OpenCV's.
    fn default() -> Self {
        Self::OPENCV
    }
}

impl Mog2Params {
    /// For a tracker that protects the pixels of what it follows ([`protect_foreground`](crate::background::protect_foreground)):
    /// wider Gaussians, so that light that drifts is background and seldom connected with a target. Without protection
    /// what stands still is background sooner than with OpenCV's values.
    pub const fn protected() -> Self {
        Self { background_distance: 36.0, match_distance: 25.0, ..Self::OPENCV }
    }

    const OPENCV: Self = Self {
        history_frames: 500,
        most_modes: 5,
        background_distance: 16.0,
        match_distance: 9.0,
        background_ratio: 0.9,
        initial_variance: 15.0,
        least_variance: 4.0,
        most_variance: 75.0,
        complexity_reduction: 0.05,
        shadow_ratio: Some(0.5),
    };

    pub(super) fn check(&self) -> Result<(), VisionError> {
        let positive = (f64::MIN_POSITIVE, f64::from(f32::MAX));
        require_range("history_frames", self.history_frames as f64, (1.0, f64::INFINITY), "at least 1")?;
        require_range("most_modes", self.most_modes as f64, (1.0, MOST as f64), "from 1 to 8")?;
        for (name, value) in [
            ("background_distance", self.background_distance),
            ("match_distance", self.match_distance),
            ("least_variance", self.least_variance),
        ] {
            require_range(name, value, positive, "positive and finite")?;
        }
        let most = (self.least_variance, f64::from(f32::MAX));
        require_range("most_variance", self.most_variance, most, "finite and at least least_variance")?;
        let between = (self.least_variance, self.most_variance);
        require_range("initial_variance", self.initial_variance, between, "from least_variance to most_variance")?;
        require_range("background_ratio", self.background_ratio, (0.0, 1.0), "from 0 to 1")?;
        require_range("complexity_reduction", self.complexity_reduction, (0.0, 0.5), "from 0 to 0.5")?;
        require_range("shadow_ratio", self.shadow_ratio.unwrap_or(0.0), (0.0, 1.0), "from 0 to 1")
    }
}
