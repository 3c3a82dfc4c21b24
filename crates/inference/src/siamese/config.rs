use crate::{InferenceError, Result};
use serde::{Deserialize, Serialize};

/// In which order a network takes its channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelOrder {
    /// Blue, green, red.
    Bgr,
    /// Red, green, blue.
    Rgb,
}

/// What the scores of a network are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScoreCoding {
    /// Two logits a point, background before target: a softmax.
    Softmax,
    /// One logit a point: a sigmoid.
    Sigmoid,
    /// One probability a point.
    Probability,
}

/// How a window of the frame is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CropShape {
    /// A square, so that the target keeps its shape: SiamFC and its successors.
    #[default]
    Square,
    /// As wide and high as the target, with `context` of its width and height to each side of the template and `search_context`
    /// of the search, stretched to a square: FEAR.
    Stretched,
}

/// What a network answers for each point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AnswerCoding {
    /// One or two scores, and the distances to the left, top, right and bottom edge in pixels of the search image: NanoTrack,
    /// LightTrack, FEAR.
    #[default]
    Distances,
    /// Two scores or one an anchor, and four numbers an anchor: the middle relative to the anchor's in its sizes, and the
    /// logarithm of the size in its sizes; planes in the order x of all anchors, y, width, height: SiamRPN, SiamRPN++. An anchor
    /// for each scale of each ratio (height by width), ⌊stride / √ratio⌋ · scale wide and ⌊that width · ratio⌋ · scale high (PySOT,
    /// `pysot/utils/anchor.py`).
    Anchors {
        /// Heights by widths, > 0.
        ratios: Vec<f64>,
        /// Sizes in strides, > 0.
        scales: Vec<f64>,
    },
    /// One score a point and no box, of `scales` windows of which each is `step` times as large as the one before, the middle one as
    /// ever; responses are enlarged `enlarged` times before their peak is sought: SiamFC. The target keeps its shape, and its
    /// size follows the best window's by `rate`.
    Scores {
        /// Above 1, at most 2.
        step: f64,
        /// Odd, 1 to 9.
        scales: usize,
        /// 1 to 32, to at most 1024 rows and columns.
        enlarged: usize,
    },
    /// One score, width and height by the side of the search image, and the middle relative to the point, in strides, counted
    /// from the point's upper left: VitTrack.
    Centres,
}

impl AnswerCoding {
    /// Boxes to a point.
    pub fn anchors(&self) -> usize {
        match self {
            Self::Anchors { ratios, scales } => ratios.len() * scales.len(),
            _ => 1,
        }
    }
}

/// Everything about a Siamese tracker that its network does not say: sizes, normalisation, decoding, penalties.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct SiameseConfig(Raw);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    template_side_px: usize,
    search_side_px: usize,
    answer_side: usize,
    stride_px: f64,
    channels: ChannelOrder,
    #[serde(default)]
    mean: [f32; 3],
    #[serde(default = "ones")]
    deviation: [f32; 3],
    scores: ScoreCoding,
    context: f64,
    window: f64,
    penalty: f64,
    rate: f64,
    #[serde(default)]
    template_shift_px: f64,
    #[serde(default = "smallest")]
    min_side_px: f64,
    #[serde(default)]
    crop: CropShape,
    #[serde(default)]
    search_context: f64,
    #[serde(default = "one")]
    extent: f64,
    #[serde(default)]
    answer: AnswerCoding,
}

const fn one() -> f64 {
    1.0
}

const fn ones() -> [f32; 3] {
    [1.0; 3]
}

const fn smallest() -> f64 {
    10.0
}

impl SiameseConfig {
    /// NanoTrack v3 as released: `models/config/configv3.yaml` and `nanotrack/tracker/nano_tracker.py`.
    pub const fn nanotrack_v3() -> Self {
        Self(Raw {
            template_side_px: 127,
            search_side_px: 255,
            answer_side: 15,
            stride_px: 16.0,
            channels: ChannelOrder::Bgr,
            mean: [0.0; 3],
            deviation: [1.0; 3],
            scores: ScoreCoding::Softmax,
            context: 0.5,
            window: 0.455,
            penalty: 0.138,
            rate: 0.348,
            template_shift_px: -0.5,
            min_side_px: 10.0,
            crop: CropShape::Square,
            search_context: 0.0,
            extent: 1.0,
            answer: AnswerCoding::Distances,
        })
    }

    /// NanoTrack v2 with the weights of window, penalty and size that OpenCV's `TrackerNano` gives it (`tracker_nano.cpp`).
    pub fn nanotrack_v2() -> Self {
        let Self(mut raw) = Self::nanotrack_v3();
        raw.answer_side = 16;
        raw.penalty = 0.055;
        raw.rate = 0.37;
        Self(raw)
    }

    /// FEAR-XS as released (Borsuk et al. 2022, arXiv:2112.07957; github.com/PinataFarms/FEARTracker, `fear_tracker.py`), its
    /// deviations being within the network. The released tracker weighs a new size by the square of penalty times score times
    /// .765; the rate here is that square.
    pub const fn fear_xs() -> Self {
        Self(Raw {
            template_side_px: 128,
            search_side_px: 256,
            answer_side: 16,
            stride_px: 16.0,
            channels: ChannelOrder::Rgb,
            mean: [123.675, 116.28, 103.53],
            deviation: [1.0; 3],
            scores: ScoreCoding::Sigmoid,
            context: 0.2,
            window: 0.38,
            penalty: 0.062,
            rate: 0.585,
            template_shift_px: 0.0,
            min_side_px: 3.0,
            crop: CropShape::Stretched,
            search_context: 2.0,
            extent: 1.0,
            answer: AnswerCoding::Distances,
        })
    }

    /// Rows and columns of the template image, 1 to 1024.
    pub const fn template_side(&self) -> usize {
        self.0.template_side_px
    }

    /// Rows and columns of the search image, at least those of the template, at most 1024.
    pub const fn search_side(&self) -> usize {
        self.0.search_side_px
    }

    /// Rows and columns of the answer, 3 to 128.
    pub const fn answer_side(&self) -> usize {
        self.0.answer_side
    }

    /// Pixels of the search image from one point of the answer to the next, > 0.
    pub const fn stride_px(&self) -> f64 {
        self.0.stride_px
    }

    /// Order of the channels.
    pub const fn channels(&self) -> ChannelOrder {
        self.0.channels
    }

    /// What is subtracted from each channel (in the network's order), in grey levels.
    pub const fn mean(&self) -> [f32; 3] {
        self.0.mean
    }

    /// What each channel is divided by afterwards, > 0.
    pub const fn deviation(&self) -> [f32; 3] {
        self.0.deviation
    }

    /// What the scores are.
    pub const fn scores(&self) -> ScoreCoding {
        self.0.scores
    }

    /// p: the template image covers √((w + p (w + h)) (h + p (w + h))) pixels of the frame, times [`extent`](Self::extent); of
    /// stretched windows 1 + 2p of the target's width and height. 0 to 4.
    pub const fn context(&self) -> f64 {
        self.0.context
    }

    /// How windows are cut.
    pub const fn crop(&self) -> CropShape {
        self.0.crop
    }

    /// Of stretched windows: the search image covers 1 + 2 times this of the target's width and height, 0 to 8.
    pub const fn search_context(&self) -> f64 {
        self.0.search_context
    }

    /// How many times larger square windows are, > 0, at most 8.
    pub const fn extent(&self) -> f64 {
        self.0.extent
    }

    /// What the network answers for each point.
    pub const fn answer(&self) -> &AnswerCoding {
        &self.0.answer
    }

    /// Weight of the cosine window against the score, 0 to 1.
    pub const fn window(&self) -> f64 {
        self.0.window
    }

    /// k of the penalty exp(−k (r s − 1)) on changes of aspect ratio r and scale s, ≥ 0.
    pub const fn penalty(&self) -> f64 {
        self.0.penalty
    }

    /// How fast the size follows: its weight is this times penalty times score, 0 to 1.
    pub const fn rate(&self) -> f64 {
        self.0.rate
    }

    /// How far from the middle of the box the template is cut, in pixels of the frame, both ways; −0.5 in trackers that
    /// take (x + (w − 1) / 2) for the middle.
    pub const fn template_shift_px(&self) -> f64 {
        self.0.template_shift_px
    }

    /// The least width and height of a box, in pixels of the frame, > 0.
    pub const fn min_side_px(&self) -> f64 {
        self.0.min_side_px
    }

    /// The same with another least side: the released 10 px is more than some thermal targets have.
    ///
    /// # Errors
    /// [`InferenceError::Config`] unless it is positive and finite.
    pub fn with_min_side_px(self, min_side_px: f64) -> Result<Self> {
        Self::try_from(Raw { min_side_px, ..self.0 })
    }

    /// The same with other weights of window, penalty and size.
    ///
    /// # Errors
    /// [`InferenceError::Config`] if one is out of its range.
    pub fn with_weights(self, window: f64, penalty: f64, rate: f64) -> Result<Self> {
        Self::try_from(Raw { window, penalty, rate, ..self.0 })
    }
}

impl TryFrom<Raw> for SiameseConfig {
    type Error = InferenceError;

    fn try_from(raw: Raw) -> Result<Self> {
        let least = raw.template_side_px;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let within = |x: f64, most: f64| (0.0..=most).contains(&x);
        let anchors = match &raw.answer {
            AnswerCoding::Anchors { ratios, scales } => {
                (1..=64).contains(&raw.answer.anchors()) && ratios.iter().chain(scales).all(|&v| positive(v))
            }
            _ => true,
        };
        let scales = match &raw.answer {
            AnswerCoding::Scores { step, scales, enlarged } => {
                (*step > 1.0 && *step <= 2.0)
                    && (1..=9).contains(scales)
                    && scales % 2 == 1
                    && (1..=32).contains(enlarged)
                    && raw.answer_side.saturating_mul(*enlarged) <= 1024
                    && raw.scores != ScoreCoding::Softmax
            }
            _ => true,
        };
        let checks: [(bool, &'static str, String, &'static str); 16] = [
            ((1..=1024).contains(&least), "template_side_px", least.to_string(), "from 1 to 1024"),
            (
                (least.max(1)..=1024).contains(&raw.search_side_px),
                "search_side_px",
                raw.search_side_px.to_string(),
                "from template_side_px to 1024",
            ),
            ((3..=128).contains(&raw.answer_side), "answer_side", raw.answer_side.to_string(), "from 3 to 128"),
            (positive(raw.stride_px), "stride_px", raw.stride_px.to_string(), "positive"),
            (raw.mean.iter().all(|m| m.is_finite()), "mean", format!("{:?}", raw.mean), "finite"),
            (
                raw.deviation.iter().all(|&d| positive(f64::from(d))),
                "deviation",
                format!("{:?}", raw.deviation),
                "positive",
            ),
            (within(raw.context, 4.0), "context", raw.context.to_string(), "from 0 to 4"),
            (within(raw.window, 1.0), "window", raw.window.to_string(), "from 0 to 1"),
            (within(raw.penalty, f64::MAX), "penalty", raw.penalty.to_string(), "at least 0"),
            (within(raw.rate, 1.0), "rate", raw.rate.to_string(), "from 0 to 1"),
            (
                raw.template_shift_px.abs() <= 2.0,
                "template_shift_px",
                raw.template_shift_px.to_string(),
                "from -2 to 2",
            ),
            (positive(raw.min_side_px), "min_side_px", raw.min_side_px.to_string(), "positive"),
            (within(raw.search_context, 8.0), "search_context", raw.search_context.to_string(), "from 0 to 8"),
            (positive(raw.extent) && raw.extent <= 8.0, "extent", raw.extent.to_string(), "above 0 and at most 8"),
            (anchors, "answer", format!("{:?}", raw.answer), "1 to 64 anchors of positive ratios and scales"),
            (
                scales,
                "answer",
                format!("{:?}", raw.answer),
                "a step above 1 and at most 2, an odd number of scales up to 9, enlarged 1 to 32 times to at most 1024; scores a sigmoid or a probability",
            ),
        ];
        match checks.into_iter().find(|(good, ..)| !good) {
            Some((_, name, value, range)) => Err(InferenceError::Config { name, value, range }),
            None => Ok(Self(raw)),
        }
    }
}

impl From<SiameseConfig> for Raw {
    fn from(config: SiameseConfig) -> Self {
        config.0
    }
}
