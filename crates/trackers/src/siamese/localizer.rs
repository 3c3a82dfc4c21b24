use pursuit_estimation::{logit, sigmoid};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::InferenceError;
use pursuit_inference::siamese::{Exemplar, Location, SiameseConfig, SiameseNetwork, SiameseTracker};
use pursuit_parameters::Parameters;
use pursuit_tracking::{Figure, Figures, Localizer, Measurement, Result, Search, TrackingError, ViewSize};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::fmt::Debug;

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

    /// Constant of the logistic regression of a score, and weight of the log odds of the network's score.
    fn score_weights(&self) -> (f64, f64);
}

/// Finds the target by a network that compares a window with the target as it was at the start. It learns nothing.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved<P>", into = "Saved<P>", bound = "P: SiameseModel")]
pub struct SiameseLocalizer<P: SiameseModel> {
    pub(crate) params: P,
    pub(crate) tracker: SiameseTracker<P::Network>,
}

/// What is stored: the network itself is not.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "P: SiameseModel")]
struct Saved<P: SiameseModel> {
    params: P,
    exemplar: Exemplar,
}

impl<P: SiameseModel> From<SiameseLocalizer<P>> for Saved<P> {
    fn from(localizer: SiameseLocalizer<P>) -> Self {
        Self { params: localizer.params, exemplar: localizer.tracker.exemplar().clone() }
    }
}

impl<P: SiameseModel> TryFrom<Saved<P>> for SiameseLocalizer<P> {
    type Error = TrackingError;

    fn try_from(Saved { params, exemplar }: Saved<P>) -> Result<Self> {
        let (network, config) = params.open()?;
        let tracker = SiameseTracker::restore(network, config, exemplar)
            .map_err(|e| TrackingError::Snapshot { tracker: P::NAME.to_owned(), problem: e.to_string() })?;
        Ok(Self { params, tracker })
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
        Ok(Self { params: params.clone(), tracker })
    }

    /// Where the target is by the network, looked for about `about` at its size.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub fn look(&mut self, frame: &Frame, about: &BBox) -> Result<Option<Location>> {
        let size = (about.width(), about.height());
        self.tracker.locate(frame, about.center(), size).map_err(failed::<P>(frame.index()))
    }

    /// The probability that a box of the network's score is right.
    fn probability(&self, score: f64) -> f64 {
        let (score, (bias, weight)) = (score.clamp(1e-6, 1.0 - 1e-6), self.params.score_weights());
        sigmoid(bias + weight * logit(score))
    }
}

impl<P: SiameseModel> Localizer for SiameseLocalizer<P> {
    type Finding = ();

    const FIGURES: &[&[Figure]] = &[SiameseFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ())>> {
        let Some(found) = self.look(frame, &search.expected)? else { return Ok(None) };
        let diagnostics = SiameseFigures { network_score: found.score, penalty: found.penalty }.into();
        let confidence = self.probability(found.score);
        Ok(Some((Measurement { strength: found.score, diagnostics, ..Measurement::new(found.bbox, confidence) }, ())))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, (): &()) -> Result<()> {
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        // The network is open already.
        let (network, config) = (self.tracker.network().clone(), self.tracker.config().clone());
        self.tracker = SiameseTracker::new(network, config, frame, bbox).map_err(failed::<P>(frame.index()))?;
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let (width, height) = self.tracker.search_extent((expected.width(), expected.height()));
        Some(ViewSize { width, height })
    }
}
