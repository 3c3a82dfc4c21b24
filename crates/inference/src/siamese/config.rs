use crate::{InferenceError, Result};
use pursuit_parameters::{Bounds, Field, Kind, ParameterError, Parameters, Value, choices, parameters};
use serde::{Deserialize, Serialize};
use std::ops::Deref;

choices! {
    /// In which order a network takes its channels.
    pub enum ChannelOrder {
        /// Blue, green, red.
        Bgr = "bgr",
        /// Red, green, blue.
        Rgb = "rgb",
    }
}

choices! {
    /// What the scores of a network are.
    pub enum ScoreCoding {
        /// Two logits a point, background before target: a softmax.
        Softmax = "softmax",
        /// One logit a point: a sigmoid.
        Sigmoid = "sigmoid",
        /// One probability a point.
        Probability = "probability",
    }
}

choices! {
    /// How a window of the frame is cut.
    pub enum CropShape {
        /// A square, so that the target keeps its shape: SiamFC and its successors.
        Square = "square",
        /// As wide and high as the target, with `context` of its width and height to each side of the template and
        /// `search_context` of the search, stretched to a square: FEAR.
        Stretched = "stretched",
        /// A square whose side is rounded up and whose corner is rounded, in pixels of the frame: STARK, OSTrack, LightFC, VitTrack.
        Rounded = "rounded",
        /// A square a pixel larger than `square`, with its first and its last pixels taken in, resampled without rounding to grey levels:
        /// MMTracking.
        Inclusive = "inclusive",
    }
}

choices! {
    /// Where a square window begins that would begin midway between two pixels, as it often does about a box of whole numbers.
    pub enum Ties {
        /// At the later one: PySOT.
        Up = "up",
        /// At the even one, as NumPy and Python 3 round: LightTrack, siamfc-pytorch, SiamMask's authors.
        Even = "even",
        /// At that farther from the frame's first, as Python 2 rounds: DaSiamRPN.
        Away = "away",
    }
}

choices! {
    /// What lies outside the frame.
    pub enum Fill {
        /// The mean colour of the first frame, rounded down.
        Mean = "mean",
        /// The same, rounded to the nearest: siamfc-pytorch.
        NearestMean = "nearest-mean",
        /// Black.
        Black = "black",
    }
}

choices! {
    /// How the cosine window and a score become one.
    pub enum WindowUse {
        /// The weighted mean of both; the window is zero at the outermost points.
        Added = "added",
        /// Their product, the window's share being its weight; the window is zero beyond the outermost points: STARK, OSTrack.
        Multiplied = "multiplied",
    }
}

choices! {
    /// What becomes of the best point's box.
    pub enum BoxRule {
        /// Its size follows by `rate` times penalty times score, and its middle stays inside the frame.
        Smoothed = "smoothed",
        /// As `smoothed`, by the square of that product: Ocean and LightTrack smooth the size they have smoothed once more.
        SmoothedTwice = "smoothed-twice",
        /// Its size follows by `rate`, and what lies outside the frame is cut off, but for `min_side_px`.
        Clipped = "clipped",
    }
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
            Self::Distances | Self::Scores { .. } | Self::Centres => 1,
        }
    }
}

/// A word, or a table with the numbers of `anchors` or of `scores`.
impl Field for AnswerCoding {
    fn kind(&self, _: Bounds) -> Kind {
        Kind::Choice { choices: vec!["distances", "anchors", "scores", "centres"] }
    }

    fn value(&self) -> Option<Value> {
        Value::try_from(self).ok()
    }

    fn check(&self, _: &Bounds) -> Result<(), (String, String)> {
        let wrong = |problem: &str| Err((String::new(), format!("must be {problem}, not {self:?}")));
        match self {
            Self::Anchors { ratios, scales }
                if !(1..=64).contains(&self.anchors())
                    || !ratios.iter().chain(scales).all(|&v| v > 0.0 && v.is_finite()) =>
            {
                wrong("1 to 64 anchors of positive ratios and scales")
            }
            Self::Scores { step, scales, enlarged }
                if !(*step > 1.0
                    && *step <= 2.0
                    && (1..=9).contains(scales)
                    && scales % 2 == 1
                    && (1..=32).contains(enlarged)) =>
            {
                wrong("a step above 1 and at most 2, an odd number of scales up to 9, enlarged 1 to 32 times")
            }
            Self::Distances | Self::Anchors { .. } | Self::Scores { .. } | Self::Centres => Ok(()),
        }
    }

    fn set(&mut self, _: &str, value: &Value) -> Result<(), String> {
        *self = value.clone().try_into().map_err(|e: toml::de::Error| e.message().to_owned())?;
        Ok(())
    }
}

parameters! {
    /// Everything about a Siamese tracker that its network does not say: sizes, normalisation, decoding, penalties. The default is
    /// NanoTrack v3 as released: `models/config/configv3.yaml` and `nanotrack/tracker/nano_tracker.py`.
    pub struct SiameseParams {
        /// Rows and columns of the template image.
        pub template_side_px: usize = 127, in 1..=1024;
        /// Rows and columns of the search image, at least those of the template.
        pub search_side_px: usize = 255, in 1..=1024;
        /// Rows and columns of the answer.
        pub answer_side: usize = 15, in 3..=128;
        /// Pixels of the search image from one point of the answer to the next.
        pub stride_px: f64 = 16.0, in above(0.0), unit "px";
        /// Order of the channels.
        pub channels: ChannelOrder = ChannelOrder::Bgr;
        /// What is subtracted from each channel (in the network's order).
        pub mean: [f32; 3] = [0.0; 3], unit "grey levels";
        /// What each channel is divided by afterwards.
        pub deviation: [f32; 3] = [1.0; 3], in above(0.0);
        /// What the scores are.
        pub scores: ScoreCoding = ScoreCoding::Softmax;
        /// p: the template image covers √((w + p (w + h)) (h + p (w + h))) pixels of the frame, times `extent`; of stretched
        /// windows 1 + 2p of the target's width and height.
        pub context: f64 = 0.5, in 0.0..=4.0;
        /// Weight of the cosine window against the score.
        pub window: f64 = 0.455, in 0.0..=1.0;
        /// k of the penalty exp(−k (r s − 1)) on changes of aspect ratio r and scale s.
        pub penalty: f64 = 0.138, in 0.0..;
        /// How fast the size follows: its weight is this, times penalty times score if boxes are smoothed, and the square of all that if
        /// they are smoothed twice.
        pub rate: f64 = 0.348, in 0.0..=1.0;
        /// How far from the middle of the box the template is cut, in pixels of the frame, both ways; −0.5 in trackers that
        /// take (x + (w − 1) / 2) for the middle.
        pub template_shift_px: f64 = 0.0, in -2.0..=2.0, unit "px";
        /// The same of the search image; the answer is counted from the middle of the box all the same. Both are 0.5 in siamfc-pytorch,
        /// which rounds where a window begins that others round down.
        pub search_shift_px: f64 = 0.0, in -2.0..=2.0, unit "px";
        /// The least width and height of a box, in pixels of the frame.
        pub min_side_px: f64 = 10.0, in above(0.0), unit "px";
        /// How windows are cut.
        pub crop: CropShape = CropShape::Square;
        /// Where square windows begin that would begin midway between two pixels.
        pub ties: Ties = Ties::Up;
        /// Of stretched windows: the search image covers 1 + 2 times this of the target's width and height.
        pub search_context: f64 = 0.0, in 0.0..=8.0;
        /// How many times larger square windows are.
        pub extent: f64 = 1.0, in above(0.0).at_most(8.0);
        /// How many times larger square windows of the search are still, beside what the sides of the images say: 1.25 where a template of
        /// 192 pixels shows twice the target, and a search image of 384 five times (OSTrack of 384 pixels).
        pub search_extent: f64 = 1.0, in above(0.0).at_most(8.0);
        /// Whether it is told in double precision where samples of a window lie, and not in single, as OpenCV does.
        pub double_precision: bool = false;
        /// What lies outside the frame.
        pub fill: Fill = Fill::Mean;
        /// How the cosine window and a score become one.
        pub window_use: WindowUse = WindowUse::Added;
        /// What becomes of the best point's box.
        pub boxes: BoxRule = BoxRule::Smoothed;
        /// What the network answers for each point.
        pub answer: AnswerCoding = AnswerCoding::Distances;
        /// Rows and columns of the mask that a network draws about each point of its answer, of a window as large as the template image
        /// (SiamMask: 63, refined 127); 0 of networks that draw none.
        pub mask_side: usize = 0, in 0..=512, source "SiamMask";
        /// What a place of the mask says with a greater probability is the target's.
        pub mask_threshold: f64 = 0.3, in 0.0..=1.0, source "PySOT, `pysot/core/config.py`";
    }
    ordered { template_side_px <= search_side_px }
}

impl SiameseParams {
    /// What a description must say: a network of which it is not known cannot be used.
    pub(super) const REQUIRED: [&str; 10] = [
        "template_side_px",
        "search_side_px",
        "answer_side",
        "stride_px",
        "channels",
        "scores",
        "context",
        "window",
        "penalty",
        "rate",
    ];
}

/// Sound parameters of a Siamese tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SiameseParams", into = "SiameseParams")]
pub struct SiameseConfig(SiameseParams);

impl Deref for SiameseConfig {
    type Target = SiameseParams;

    fn deref(&self) -> &SiameseParams {
        &self.0
    }
}

impl SiameseConfig {
    /// NanoTrack v3 as released.
    pub fn nanotrack_v3() -> Self {
        Self(SiameseParams { template_shift_px: -0.5, ..SiameseParams::default() })
    }

    /// NanoTrack v2 with the weights of window, penalty and size that OpenCV's `TrackerNano` gives it (`tracker_nano.cpp`).
    pub fn nanotrack_v2() -> Self {
        Self(SiameseParams { answer_side: 16, penalty: 0.055, rate: 0.37, ..Self::nanotrack_v3().0 })
    }

    /// FEAR-XS as released (Borsuk et al. 2022, arXiv:2112.07957; github.com/PinataFarms/FEARTracker, `fear_tracker.py`), its
    /// deviations being within the network. The released tracker weighs a new size by the square of penalty times score times
    /// .765; the rate here is that square.
    pub fn fear_xs() -> Self {
        Self(SiameseParams {
            template_side_px: 128,
            search_side_px: 256,
            answer_side: 16,
            channels: ChannelOrder::Rgb,
            mean: [123.675, 116.28, 103.53],
            scores: ScoreCoding::Sigmoid,
            context: 0.2,
            window: 0.38,
            penalty: 0.062,
            rate: 0.585,
            min_side_px: 3.0,
            crop: CropShape::Stretched,
            search_context: 2.0,
            ..SiameseParams::default()
        })
    }

    /// LightFC and VitTrack as released (github.com/LiYunfengLYF/LightFC, `lib/test/tracker/lightfc.py`; OpenCV's `tracker_vit.cpp`,
    /// which rounds boxes to whole pixels; this does not): a template of twice, and a search of four times the root of the area;
    /// red, green and blue normalised by the means and deviations of ImageNet.
    pub fn one_stream() -> Self {
        Self(SiameseParams {
            template_side_px: 128,
            search_side_px: 256,
            answer_side: 16,
            channels: ChannelOrder::Rgb,
            mean: [0.485 * 255.0, 0.456 * 255.0, 0.406 * 255.0],
            deviation: [0.229 * 255.0, 0.224 * 255.0, 0.225 * 255.0],
            scores: ScoreCoding::Probability,
            context: 0.0,
            extent: 2.0,
            window: 1.0,
            penalty: 0.0,
            rate: 1.0,
            min_side_px: 2.0,
            crop: CropShape::Rounded,
            fill: Fill::Black,
            window_use: WindowUse::Multiplied,
            boxes: BoxRule::Clipped,
            answer: AnswerCoding::Centres,
            ..SiameseParams::default()
        })
    }

    /// The same with another least side: the released 10 px is more than some thermal targets have.
    ///
    /// # Errors
    /// [`InferenceError::Config`] unless it is positive and finite.
    pub fn with_min_side_px(self, min_side_px: f64) -> Result<Self> {
        Self::try_from(SiameseParams { min_side_px, ..self.0 })
    }

    /// The same with samples of which it is told in double precision where they lie. What judges the answers of a built-in network was
    /// fitted to those: of OpenCV's, one grey level in a thousand is another, and the default tracker with its judge as it is then says
    /// `tracking` in 23 % of the frames without the target, not in 18 % (docs/log/2026-11-28-networks-beside-pytorch.md).
    #[must_use]
    pub fn in_double_precision(self) -> Self {
        Self(SiameseParams { double_precision: true, ..self.0 })
    }

    /// The same with other weights of window, penalty and size.
    ///
    /// # Errors
    /// [`InferenceError::Config`] if one is out of its range.
    pub fn with_weights(self, window: f64, penalty: f64, rate: f64) -> Result<Self> {
        Self::try_from(SiameseParams { window, penalty, rate, ..self.0 })
    }
}

impl TryFrom<SiameseParams> for SiameseConfig {
    type Error = InferenceError;

    fn try_from(params: SiameseParams) -> Result<Self> {
        params.validate("config")?;
        if let AnswerCoding::Scores { enlarged, .. } = params.answer
            && (params.answer_side.saturating_mul(enlarged) > 1024 || params.scores == ScoreCoding::Softmax)
        {
            let problem = "must be enlarged to at most 1024 rows; scores a sigmoid or a probability";
            return Err(ParameterError::new("config", "answer", problem).into());
        }
        if params.mask_side > 0 && matches!(params.answer, AnswerCoding::Scores { .. }) {
            let problem = "must be 0 where the answer is scores alone, of windows at several scales";
            return Err(ParameterError::new("config", "mask_side", problem).into());
        }
        Ok(Self(params))
    }
}

impl From<SiameseConfig> for SiameseParams {
    fn from(config: SiameseConfig) -> Self {
        config.0
    }
}
