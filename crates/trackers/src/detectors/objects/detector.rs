use super::ObjectsParams;
use crate::runtime::unusable;
use pursuit_imaging::Frame;
use pursuit_inference::detection::{Limits, Object, ObjectDetector};
use pursuit_parameters::ParameterError;
use pursuit_tracking::{Class, Detection, Detector, DetectorRecipe, Followed, Needs, Result, TrackingError};

/// The name in the registry.
const NAME: &str = "objects";

impl DetectorRecipe for ObjectsParams {
    const NEEDS: Needs = Needs { color: false, file: true };

    fn detector(&self) -> Result<Box<dyn Detector>> {
        let wrong = |name: &str, problem: String| TrackingError::from(ParameterError::new(NAME, name, problem));
        let Some(model) = self.model.path() else {
            let problem = "names no network; give the ONNX file of one, for example `--set model=yolox_nano.onnx`";
            return Err(wrong("model", problem.to_owned()));
        };
        let opened = ObjectDetector::open(model, &self.runtime.options());
        let mut network = opened.map_err(unusable(NAME, "model"))?;
        if let Err(name) = network.look_for(&self.classes.0) {
            let known = network.config().classes.join(", ");
            return Err(wrong("classes", format!("the network knows no `{name}`; it knows: {known}")));
        }
        let limits = Limits { score: self.score, overlap: self.overlap, candidates: self.candidates, most: self.most };
        let classes = network.config().classes.iter().map(|c| Class::from(c.as_str())).collect();
        Ok(Box::new(Objects { network, limits, classes }))
    }
}

/// Finds objects all over the frame.
struct Objects {
    network: ObjectDetector,
    limits: Limits,
    /// Those that the network knows, in its order.
    classes: Vec<Class>,
}

impl Detector for Objects {
    fn notes(&self) -> Vec<String> {
        self.network.notes()
    }

    fn detect(&mut self, frame: &Frame, _: &[Followed]) -> Result<Vec<Detection>> {
        let found = self.network.detect(frame.color(), &self.limits).map_err(|e| TrackingError::Computation {
            tracker: NAME.to_owned(),
            index: frame.index(),
            source: Box::new(e),
        })?;
        let detection =
            |o: &Object| Detection { class: self.classes.get(o.class).cloned(), ..Detection::new(o.bbox, o.score) };
        Ok(found.iter().map(detection).collect())
    }
}
