use super::SiameseParams;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::InferenceError;
use pursuit_inference::onnx::OnnxSiamese;
use pursuit_inference::siamese::{Exemplar, SiameseTracker};
use pursuit_tracking::{
    Diagnostics, Localizer, LocalizerRecipe, Measurement, Needs, Result, Search, TrackingError, ViewSize,
};
use serde::{Deserialize, Serialize};

/// Finds the target by a network that compares a window with the target as it was at the start. It learns nothing.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct SiameseLocalizer {
    params: SiameseParams,
    tracker: SiameseTracker<OnnxSiamese>,
}

/// What is stored: the network itself is not, its file is opened again.
#[derive(Clone, Serialize, Deserialize)]
struct Saved {
    params: SiameseParams,
    exemplar: Exemplar,
}

impl From<SiameseLocalizer> for Saved {
    fn from(localizer: SiameseLocalizer) -> Self {
        Self { params: localizer.params, exemplar: localizer.tracker.exemplar().clone() }
    }
}

impl TryFrom<Saved> for SiameseLocalizer {
    type Error = TrackingError;

    fn try_from(Saved { params, exemplar }: Saved) -> Result<Self> {
        let (network, config) = params.open()?;
        let tracker = SiameseTracker::restore(network, config, exemplar)
            .map_err(|e| TrackingError::Snapshot { tracker: "siamese".to_owned(), problem: e.to_string() })?;
        Ok(Self { params, tracker })
    }
}

fn failed(frame: &Frame) -> impl FnOnce(InferenceError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "siamese".to_owned(), index, source: Box::new(e) }
}

impl LocalizerRecipe for SiameseParams {
    type Localizer = SiameseLocalizer;

    const NEEDS: Needs = Needs { color: false, file: true };

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<SiameseLocalizer> {
        let (network, config) = self.open()?;
        let tracker = SiameseTracker::new(network, config, frame, bbox).map_err(failed(frame))?;
        Ok(SiameseLocalizer { params: self.clone(), tracker })
    }
}

impl Localizer for SiameseLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let expected = &search.expected;
        let size = (expected.width(), expected.height());
        let found = self.tracker.locate(frame, expected.center(), size).map_err(failed(frame))?;
        Ok(found.map(|found| Measurement {
            strength: found.score,
            peak: Some(found.score),
            diagnostics: Diagnostics::default().with("network_score", found.score).with("penalty", found.penalty),
            ..Measurement::new(found.bbox, self.params.probability(found.score))
        }))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, _: &Measurement) -> Result<()> {
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        // The networks are open already.
        let network = self.tracker.network().clone();
        self.tracker =
            SiameseTracker::new(network, self.tracker.config().clone(), frame, bbox).map_err(failed(frame))?;
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let (width, height) = self.tracker.search_extent((expected.width(), expected.height()));
        Some(ViewSize { width, height })
    }
}
