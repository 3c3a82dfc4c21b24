use super::detected_motion;
use super::params::MotionDetectorParams;
use super::scene::{Found, Scene, Sight};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::{
    Detection, Detector, DetectorRecipe, Diagnostics, Figure, Figures, Followed, Result, TrackingError,
};
use pursuit_vision::VisionError;
use std::sync::Arc;

impl DetectorRecipe for MotionDetectorParams {
    const FIGURES: &[&[Figure]] = &[SceneFigures::ALL, LightFigures::ALL];

    fn detector(&self) -> Result<Box<dyn Detector>> {
        Ok(Box::new(MotionDetector {
            params: self.clone(),
            scene: None,
            size: Size::new(0, 0),
            sight: Sight::default(),
        }))
    }
}

/// Finds what stands out of the background.
struct MotionDetector {
    params: MotionDetectorParams,
    /// `None` before the first frame.
    scene: Option<Kind>,
    /// Of that first frame, as every further one must be.
    size: Size,
    sight: Sight,
}

/// By what the first frame had.
enum Kind {
    Gray(Scene<u8>),
    Color(Scene<Rgb8>),
}

impl MotionDetector {
    fn look(&mut self, frame: &Frame, followed: &[Followed]) -> Result<(), VisionError> {
        let params = &self.params;
        if self.scene.is_none() {
            self.size = frame.size();
            self.scene = Some(if frame.has_color() {
                Kind::Color(Scene::new(params)?)
            } else {
                Kind::Gray(Scene::new(params)?)
            });
        }
        let boxes = followed.iter().map(|f| f.bbox);
        self.sight = match &mut self.scene {
            Some(Kind::Gray(scene)) => scene.look(frame.gray(), frame.time_s(), boxes, params)?,
            Some(Kind::Color(scene)) => scene.look(frame.color(), frame.time_s(), boxes, params)?,
            None => Sight::default(),
        };
        Ok(())
    }

    fn found(&self) -> &[Found] {
        match &self.scene {
            Some(Kind::Gray(scene)) => scene.found(),
            Some(Kind::Color(scene)) => scene.found(),
            None => &[],
        }
    }
}

impl Detector for MotionDetector {
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        if self.scene.is_some() && self.size != frame.size() {
            return Err(TrackingError::FrameSize { index: frame.index(), expected: self.size, actual: frame.size() });
        }
        self.look(frame, followed).map_err(|e| TrackingError::Computation {
            tracker: "motion".to_owned(),
            index: frame.index(),
            source: Box::new(e),
        })?;
        let least = *self.params.rule.ranges(frame.size()).area_px.start();
        let mut detections: Vec<Detection> =
            self.found().iter().map(|f| detection(f, least, followed, &self.params)).collect();
        detections.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        Ok(detections)
    }

    fn watches(&self) -> bool {
        true
    }

    fn standing_out(&self, bbox: &BBox) -> Option<f64> {
        match &self.scene {
            Some(Kind::Gray(scene)) => scene.standing_out(bbox, &self.params),
            Some(Kind::Color(scene)) => scene.standing_out(bbox, &self.params),
            None => None,
        }
    }

    fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        match &mut self.scene {
            Some(Kind::Gray(scene)) => scene.foreground(&self.params),
            Some(Kind::Color(scene)) => scene.foreground(&self.params),
            None => None,
        }
    }

    fn motion(&self) -> Option<MotionParams> {
        Some(detected_motion())
    }

    fn diagnostics(&self) -> Diagnostics {
        let Sight { changed, ghosts, step } = &self.sight;
        let mut said = Diagnostics::from(SceneFigures { foreground: *changed, ghosts: *ghosts as f64 });
        if let Some(step) = step {
            LightFigures { light_step_gain: step.gain, light_step_explained: step.explained }.report(&mut said);
        }
        said
    }
}

pursuit_tracking::figures! {
    /// What is seen of the scene.
    struct SceneFigures {
        /// Share of the picture that differs from the background.
        foreground;
        /// Ghosts that were learnt into the background.
        ghosts;
    }
}

pursuit_tracking::figures! {
    /// What a step of the light did.
    struct LightFigures {
        /// How many times brighter the picture became.
        light_step_gain;
        /// Share of the picture whose change the light explains.
        light_step_explained;
    }
}

/// Whether something new is a part of a target, or its shadow: it lies in the target's box, or touches it and is much smaller.
fn is_part(new: &BBox, target: &BBox, params: &MotionDetectorParams) -> bool {
    let (dx, dy) = (params.start.near * target.width(), params.start.near * target.height());
    let about = BBox::from_ltrb(target.left() - dx, target.top() - dy, target.right() + dx, target.bottom() + dy);
    let small = new.area() < params.start.small * target.area();
    new.fraction_inside(target) > params.start.part || (small && new.fraction_inside(&about) > 0.0)
}

/// The larger a region, the less likely it is noise: one of the least area counts one half. What nobody follows yet counts
/// half as much, so that it starts no target, when it does not move (a seam of light, a chair that was moved) or lies within
/// a target's box.
fn detection(found: &Found, least_area_px: f64, followed: &[Followed], params: &MotionDetectorParams) -> Detection {
    let bbox = found.features.bounds;
    let size = 1.0 - 0.5 * (least_area_px / found.features.area_px).min(1.0);
    let known = followed.iter().any(|f| f.bbox.iou(&bbox) >= params.start.known);
    let part = followed.iter().any(|f| is_part(&bbox, &f.bbox, params));
    let moves = known || (found.stirred >= params.stirred && !part);
    Detection::new(bbox, if moves { size } else { params.start.still * size })
}
