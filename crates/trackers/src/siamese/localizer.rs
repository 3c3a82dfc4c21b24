use pursuit_estimation::{logit, sigmoid};
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;
use pursuit_inference::InferenceError;
use pursuit_inference::siamese::{
    DrawnMask, Embedding, Exemplar, Location, SiameseConfig, SiameseNetwork, SiameseTracker,
};
use pursuit_parameters::Parameters;
use pursuit_tracking::{Figure, Figures, Localizer, Measurement, Result, Search, TrackingError, ViewSize};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::fmt::Debug;

/// What stands for the likeness of the features where nothing is remembered of the target: what it is of most right boxes.
const USUAL_EMBEDDING: f64 = 0.87;

/// Parameters that say which Siamese network is used, and what its score is worth.
pub trait SiameseModel: Parameters + Debug + Serialize + DeserializeOwned {
    /// The network.
    type Network: SiameseNetwork + Clone + Debug + 'static;

    /// What errors call it.
    const NAME: &'static str;

    /// The network, ready to run, and how it is used.
    ///
    /// # Errors
    /// When there is no such network, or it does not fit its description.
    fn open(&self) -> Result<(Self::Network, SiameseConfig)>;

    /// What the score is made of.
    fn score_weights(&self) -> ScoreWeights;
}

/// The logistic regression that makes a probability of what the network says of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreWeights {
    /// Constant.
    pub bias: f64,
    /// Weight of the log odds of the network's score.
    pub score: f64,
    /// Weight of the likeness of the network's features in the box to those in the first one, of a network that keeps them.
    pub embedding: f64,
}

/// Finds the target by a network that compares a window with the target as it was at the start. It learns nothing.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved<P>", into = "Saved<P>", bound = "P: SiameseModel")]
pub struct SiameseLocalizer<P: SiameseModel> {
    pub(crate) params: P,
    pub(crate) tracker: SiameseTracker<P::Network>,
    /// What the target looked like to the network at first, of a network that keeps its features.
    first: Option<Embedding>,
    /// About what the last look was, if there was one.
    pub(crate) looked: Option<BBox>,
}

/// What is stored: the network itself is not.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "P: SiameseModel")]
struct Saved<P: SiameseModel> {
    params: P,
    exemplar: Exemplar,
    first: Option<Embedding>,
}

impl<P: SiameseModel> From<SiameseLocalizer<P>> for Saved<P> {
    fn from(localizer: SiameseLocalizer<P>) -> Self {
        Self { params: localizer.params, exemplar: localizer.tracker.exemplar().clone(), first: localizer.first }
    }
}

impl<P: SiameseModel> TryFrom<Saved<P>> for SiameseLocalizer<P> {
    type Error = TrackingError;

    fn try_from(Saved { params, exemplar, first }: Saved<P>) -> Result<Self> {
        let refuse = |problem: String| TrackingError::Snapshot { tracker: P::NAME.to_owned(), problem };
        let (network, config) = params.open()?;
        let mut tracker = SiameseTracker::restore(network, config, exemplar).map_err(|e| refuse(e.to_string()))?;
        if let Some(first) = &first {
            tracker.keep_features();
            if !(first.is_sound() && tracker.has_features_of(first)) {
                return Err(refuse("what the target looked like is not of this network".to_owned()));
            }
        }
        Ok(Self { params, tracker, first, looked: None })
    }
}

fn failed<P: SiameseModel>(index: u64) -> impl FnOnce(InferenceError) -> TrackingError {
    move |e| TrackingError::Computation { tracker: P::NAME.to_owned(), index, source: Box::new(e) }
}

pursuit_tracking::figures! {
    /// What the network says.
    struct SiameseFigures {
        /// Score of the box, 0 to 1.
        network_score;
        /// What the score was multiplied by because size and shape changed, 0 to 1.
        penalty;
        /// Likeness of the network's features in the box to those in the first one, −1 to 1; 0 of networks that keep none.
        embedding;
    }
}

impl<P: SiameseModel> SiameseLocalizer<P> {
    /// Starts on the target at `bbox`.
    ///
    /// # Errors
    /// When the network cannot be opened or run.
    pub fn new(params: &P, frame: &Frame, bbox: BBox) -> Result<Self> {
        let (network, config) = params.open()?;
        let tracker = SiameseTracker::new(network, config, frame, bbox).map_err(failed::<P>(frame.index()))?;
        Ok(Self { params: params.clone(), tracker, first: None, looked: None })
    }

    /// The same, which remembers what the target looks like.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn remembering(params: &P, frame: &Frame, bbox: BBox) -> Result<Self> {
        let mut this = Self::new(params, frame, bbox)?;
        this.look_first(frame, &bbox)?;
        Ok(this)
    }

    /// Looks at the target, which is at `bbox`, and remembers what it looks like: what is scored from now on is compared with that.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub fn look_first(&mut self, frame: &Frame, bbox: &BBox) -> Result<Option<Location>> {
        self.tracker.keep_features();
        let found = self.look(frame, bbox)?;
        let (center, size) = (bbox.center(), (bbox.width(), bbox.height()));
        let seen = bbox.clipped_to(frame.size());
        let first = seen.and_then(|seen| self.tracker.embedding_of(center, size, &seen));
        self.first = first.filter(Embedding::is_sound);
        Ok(found)
    }

    /// How much `bbox` looks like the target to the network in its last look, −1 to 1, and 0 where that saw nothing of it; `None` where nothing is
    /// remembered of the target.
    pub fn embedding(&self, frame: &Frame, bbox: &BBox) -> Option<f64> {
        let first = self.first.as_ref()?;
        let likeness = |(about, bbox): (BBox, BBox)| {
            self.tracker.likeness_of(first, about.center(), (about.width(), about.height()), &bbox)
        };
        Some(self.looked.zip(bbox.clipped_to(frame.size())).and_then(likeness).unwrap_or(0.0))
    }

    /// Where the target is by the network, looked for about `about` at its size.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub fn look(&mut self, frame: &Frame, about: &BBox) -> Result<Option<Location>> {
        let size = (about.width(), about.height());
        self.looked = Some(*about);
        self.tracker.locate(frame, about.center(), size).map_err(failed::<P>(frame.index()))
    }

    /// The probability that a box is right whose score and embedding these are.
    fn probability(&self, score: f64, embedding: Option<f64>) -> f64 {
        let embedding = embedding.unwrap_or(USUAL_EMBEDDING);
        let weights = self.params.score_weights();
        let score = logit(score.clamp(1e-6, 1.0 - 1e-6));
        sigmoid(weights.bias + weights.score * score + weights.embedding * embedding)
    }
}

impl<P: SiameseModel> Localizer for SiameseLocalizer<P> {
    /// What a network that draws masks has drawn.
    type Finding = Option<DrawnMask>;

    const FIGURES: &[&[Figure]] = &[SiameseFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, Option<DrawnMask>)>> {
        let Some(found) = self.look(frame, &search.expected)? else { return Ok(None) };
        let embedding = self.embedding(frame, &found.bbox);
        let figures = SiameseFigures {
            network_score: found.score,
            penalty: found.penalty,
            embedding: embedding.unwrap_or_default(),
        };
        let diagnostics = figures.into();
        let confidence = self.probability(found.score, embedding);
        let (about, size) = (search.expected.center(), (search.expected.width(), search.expected.height()));
        let drawn = self.tracker.mask(frame.size(), about, size, &found).map_err(failed::<P>(frame.index()))?;
        let measurement =
            Measurement { strength: found.score, diagnostics, ..Measurement::new(found.bbox, confidence) };
        Ok(Some((measurement, drawn)))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, _: &Option<DrawnMask>) -> Result<()> {
        Ok(())
    }

    fn mask(&self, frame: &Frame, drawn: &Option<DrawnMask>) -> Option<Mask> {
        Some(drawn.as_ref()?.in_frame(frame.size()))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        // The network is open already.
        let (network, config) = (self.tracker.network().clone(), self.tracker.config().clone());
        self.tracker = SiameseTracker::new(network, config, frame, bbox).map_err(failed::<P>(frame.index()))?;
        if self.first.is_some() {
            self.look_first(frame, &bbox)?;
        }
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let (width, height) = self.tracker.search_extent((expected.width(), expected.height()));
        Some(ViewSize { width, height })
    }
}
