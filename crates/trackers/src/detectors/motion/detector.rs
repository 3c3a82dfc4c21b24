use super::coarse::Coarse;
use super::detected_motion;
use super::found::Found;
use super::params::{MotionDetectorParams, StartParams};
use super::scene::{Scene, Sight};
use super::turning::Turning;
use pursuit_geometry::BBox;
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
        let detector = MotionDetector {
            params: self.clone(),
            scene: None,
            last: None,
            turning: None,
            is_away: false,
            came_until_s: f64::NEG_INFINITY,
            sight: Sight::default(),
        };
        Ok(Box::new(Coarse::new(Box::new(detector), self.sight_px)))
    }
}

/// For so long after a camera has come back to the scene, what stands out of it has come meanwhile, and so moves though it stands: seconds.
const CAME_S: f64 = 0.5;

/// Finds what stands out of the background.
struct MotionDetector {
    params: MotionDetectorParams,
    /// `None` before the first frame.
    scene: Option<Kind>,
    /// The frame before.
    last: Option<Frame>,
    /// Of a camera that says how it stands: the background all about.
    turning: Option<Turning>,
    /// Whether that camera is turned away from the scene.
    is_away: bool,
    /// Until when what stands out is taken to have come while it was, seconds.
    came_until_s: f64,
    sight: Sight,
}

/// By what the first frame had.
enum Kind {
    Gray(Scene<u8>),
    Color(Scene<Rgb8>),
}

impl Kind {
    fn new(frame: &Frame, params: &MotionDetectorParams) -> Result<Self, VisionError> {
        Ok(if frame.has_color() { Self::Color(Scene::new(params)?) } else { Self::Gray(Scene::new(params)?) })
    }

    fn foreground(&mut self, params: &MotionDetectorParams) -> Option<Arc<Image<u8>>> {
        match self {
            Self::Gray(scene) => scene.foreground(params),
            Self::Color(scene) => scene.foreground(params),
        }
    }

    const fn wait(&mut self, time_s: f64) {
        match self {
            Self::Gray(scene) => scene.wait(time_s),
            Self::Color(scene) => scene.wait(time_s),
        }
    }
}

impl MotionDetector {
    fn look(&mut self, frame: &Frame, followed: &[Followed]) -> Result<(), VisionError> {
        if self.scene.is_none() {
            self.scene = Some(Kind::new(frame, &self.params)?);
        }
        let is_again = self.last.as_ref().is_some_and(|last| is_same(last, frame));
        self.last = Some(frame.clone());
        let boxes: Vec<BBox> = followed.iter().map(|f| f.bbox).collect();
        // A head that does not say how it stood when one picture was taken is taken to stand as before.
        let pose = frame.camera().copied().or_else(|| self.turning.as_ref().map(Turning::pose));
        let Some(pose) = pose else { return self.look_at_scene(frame, is_again, &boxes) };
        let mut turning = match self.turning.take() {
            Some(turning) => turning,
            None => Turning::new(frame, pose, &self.params)?,
        };
        turning.place(frame, pose, &boxes);
        self.is_away = !turning.is_home(frame.size(), &self.params);
        if self.is_away && turning.stays(&self.params) {
            self.scene = Some(Kind::new(frame, &self.params)?);
            self.is_away = false;
        }
        if self.is_away {
            self.came_until_s = frame.time_s() + CAME_S;
            self.scene.iter_mut().for_each(|scene| scene.wait(frame.time_s()));
            turning.look(frame, is_again, &boxes, &self.params)?;
            self.sight = Sight { changed: turning.changed(), ..Sight::default() };
        } else {
            self.look_at_scene(frame, is_again, &boxes)?;
            turning.learn(frame, self.scene.as_mut().and_then(|s| s.foreground(&self.params)).as_deref(), &boxes);
        }
        self.turning = Some(turning);
        Ok(())
    }

    /// Of a camera that looks where the scene is known.
    fn look_at_scene(&mut self, frame: &Frame, is_again: bool, boxes: &[BBox]) -> Result<(), VisionError> {
        let (boxes, params) = (boxes.iter().copied(), &self.params);
        let shown = (frame.time_s(), is_again);
        self.sight = match &mut self.scene {
            Some(Kind::Gray(scene)) => scene.look(frame.gray(), shown, boxes, params)?,
            Some(Kind::Color(scene)) => scene.look(frame.color(), shown, boxes, params)?,
            None => Sight::default(),
        };
        Ok(())
    }

    fn away(&self) -> Option<&Turning> {
        self.turning.as_ref().filter(|_| self.is_away)
    }

    fn found(&self) -> &[Found] {
        if let Some(turning) = self.away() {
            return turning.found();
        }
        match &self.scene {
            Some(Kind::Gray(scene)) => scene.found(),
            Some(Kind::Color(scene)) => scene.found(),
            None => &[],
        }
    }

    fn colors(&self) -> &[Option<Arc<[f32]>>] {
        match self.scene.as_ref().filter(|_| !self.is_away) {
            Some(Kind::Gray(scene)) => scene.colors(),
            Some(Kind::Color(scene)) => scene.colors(),
            None => &[],
        }
    }
}

impl Detector for MotionDetector {
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        self.look(frame, followed).map_err(|e| TrackingError::Computation {
            tracker: "motion".to_owned(),
            index: frame.index(),
            source: Box::new(e),
        })?;
        let least = *self.params.rule.ranges(frame.size()).area_px.start();
        let targets: Vec<BBox> = followed.iter().map(|f| place(f, self.found(), &self.params.start)).collect();
        let colors = self.colors().iter().cloned().chain(std::iter::repeat(None));
        let came = !self.is_away && frame.time_s() < self.came_until_s;
        let said = |f: &Found| {
            let moved = if came { Found { stirred: 1.0, ..*f } } else { *f };
            detection(&moved, least, (followed, &targets), &self.params)
        };
        let detections = self.found().iter().zip(colors).map(|(f, embedding)| Detection { embedding, ..said(f) });
        let mut detections: Vec<Detection> = detections.collect();
        detections.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        Ok(detections)
    }

    fn watches(&self) -> bool {
        true
    }

    /// Away from the scene the picture lies on the background only about.
    fn measures(&self) -> bool {
        !self.is_away
    }

    fn standing_out(&self, bbox: &BBox) -> Option<f64> {
        if let Some(turning) = self.away() {
            return turning.standing_out(bbox);
        }
        match &self.scene {
            Some(Kind::Gray(scene)) => scene.standing_out(bbox, &self.params),
            Some(Kind::Color(scene)) => scene.standing_out(bbox, &self.params),
            None => None,
        }
    }

    fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        match (&mut self.turning, &mut self.scene) {
            (Some(turning), _) if self.is_away => turning.foreground(),
            (_, scene) => scene.as_mut()?.foreground(&self.params),
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

/// Whether a frame is shown once more: videos do that where the camera is slower than they are.
fn is_same(a: &Frame, b: &Frame) -> bool {
    let is_colored = a.has_color() && b.has_color();
    a.size() == b.size()
        && if is_colored { a.color().rows().eq(b.color().rows()) } else { a.gray().rows().eq(b.gray().rows()) }
}

/// Where a target is: in the region that it overlaps most, else where it was expected.
fn place(target: &Followed, found: &[Found], params: &StartParams) -> BBox {
    let overlaps = found.iter().map(|f| (f.features.bounds, f.features.bounds.iou(&target.bbox)));
    let known = overlaps.filter(|(_, overlap)| *overlap >= params.known);
    known.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(target.bbox, |(bounds, _)| bounds)
}

/// Whether something new is a part of a target, or its shadow: it lies in the target's box, or touches it and is much smaller.
fn is_part(new: &BBox, target: &BBox, params: &MotionDetectorParams) -> bool {
    let (dx, dy) = (params.start.near * target.width(), params.start.near * target.height());
    let about = BBox::from_ltrb(target.left() - dx, target.top() - dy, target.right() + dx, target.bottom() + dy);
    let small = new.area() < params.start.small * target.area();
    new.fraction_inside(target) > params.start.part || (small && new.fraction_inside(&about) > 0.0)
}

/// The larger a region, the less likely it is noise: one of the least area counts one half. What nobody follows yet counts
/// half as much, so that it starts no target, when it does not move (a seam of light, a chair that was moved), is background that
/// something uncovers, or lies within a target's box.
/// `targets` are the places of the targets `followed`.
fn detection(
    found: &Found,
    least_area_px: f64,
    (followed, targets): (&[Followed], &[BBox]),
    params: &MotionDetectorParams,
) -> Detection {
    let bbox = found.features.bounds;
    let size = 1.0 - 0.5 * (least_area_px / found.features.area_px).min(1.0);
    let known = followed.iter().any(|f| f.bbox.iou(&bbox) >= params.start.known);
    let part = targets.iter().any(|target| is_part(&bbox, target, params));
    let moves = known || (found.stirred >= params.stirred && !found.uncovered && !part);
    Detection::new(bbox, if moves { size } else { params.start.still * size })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_vision::region_features::RegionFeatures;

    fn found(left: f64, top: f64, width: f64, height: f64) -> Found {
        let (bounds, area_px, perimeter_px) =
            (BBox::from_ltwh(left, top, width, height), width * height, 2.0 * (width + height));
        let (aspect_ratio, complexity) = (height / width, perimeter_px * perimeter_px / area_px);
        let features =
            RegionFeatures { area_px, perimeter_px, aspect_ratio, complexity, centroid: bounds.center(), bounds };
        Found { features, stirred: 0.5, uncovered: false, part: false }
    }

    /// Somebody who walks through a room, each picture shown twice.
    #[test]
    fn a_picture_that_is_shown_twice_has_not_stood_still() {
        let picture = |left: usize| {
            let inside = |x: usize, y: usize| (left..left + 24).contains(&x) && (40..110).contains(&y);
            Image::from_fn(240, 160, |x, y| if inside(x, y) { [220, 40, 30] } else { [(60 + x / 4) as u8, 90, 70] })
        };
        let mut detector = MotionDetectorParams::default().detector().unwrap();
        let mut sure = 0;
        for k in 0..60_usize {
            let left = if k < 20 { 400 } else { 20 + 6 * ((k - 20) / 2) };
            let frame = Frame::new(k as u64, k as f64 / 25.0, picture(left).unwrap());
            let found = detector.detect(&frame, &[]).unwrap();
            sure += usize::from(k >= 24 && found.first().is_some_and(|d| d.confidence > 0.5));
        }
        assert!(sure >= 34, "in {sure} of 36 pictures");
    }

    #[test]
    fn feet_left_behind_and_uncovered_background_start_nothing() {
        let params = MotionDetectorParams::default();
        let (walker, foot) = (found(100.0, 50.0, 60.0, 160.0), found(72.0, 180.0, 24.0, 25.0));
        // Expected farther on than it is.
        let expected = BBox::from_ltwh(112.0, 50.0, 60.0, 160.0);
        let followed = [Followed { bbox: expected, measured: true }];
        let place = place(&followed[0], &[foot, walker], &params.start);
        assert_eq!(place, walker.features.bounds);
        let confidence = |found: &Found, place| detection(found, 200.0, (&followed, &[place]), &params).confidence;
        assert!(confidence(&walker, place) > 0.5 && confidence(&foot, place) < 0.5);
        assert!(confidence(&foot, expected) > 0.5, "it is beside the walker, not beside what was expected");
        let uncovered = Found { uncovered: true, ..found(300.0, 50.0, 60.0, 160.0) };
        assert!(confidence(&uncovered, place) < 0.5);
        assert!(confidence(&Found { uncovered: false, ..uncovered }, place) > 0.5);
        assert!(confidence(&Found { uncovered: true, ..walker }, place) > 0.5, "somebody who is followed goes on");
    }
}
