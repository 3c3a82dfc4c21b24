use super::FlowDetectorParams;
use super::residual::Residual;
use crate::detectors::motion::detected_motion;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image};
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::{
    Detection, Detector, DetectorRecipe, Diagnostics, Figure, Figures, Followed, Result, TrackingError,
};
use pursuit_vision::VisionError;
use pursuit_vision::flow::Pyramid;
use pursuit_vision::flow::dense::{DenseFlow, DenseFlowParams, FlowField};
use pursuit_vision::global_motion::{RobustFitParams, SparseMotion, SparseMotionParams};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::regions::RegionFinder;
use pursuit_vision::warp::Affine;

impl DetectorRecipe for FlowDetectorParams {
    const FIGURES: &[&[Figure]] = &[SceneFigures::ALL];

    fn detector(&self) -> Result<Box<dyn Detector>> {
        let wrong =
            |e: VisionError| TrackingError::Computation { tracker: NAME.to_owned(), index: 0, source: Box::new(e) };
        let dense = DenseFlowParams {
            finest: 0,
            patch_px: self.patch_px.div_ceil(4) * 4,
            overlap: self.overlap,
            ..DenseFlowParams::default()
        };
        let fit = RobustFitParams { least_inliers: self.agreement, ..RobustFitParams::default() };
        let camera = SparseMotionParams { fit, ..SparseMotionParams::default() };
        let empty = || Image::filled(1, 1, 0u8).map_err(|e| wrong(e.into()));
        Ok(Box::new(FlowDetector {
            params: self.clone(),
            size: None,
            dense: DenseFlow::new(dense).map_err(wrong)?,
            camera: SparseMotion::new(camera).map_err(wrong)?,
            halvings: None,
            pyramids: None,
            field: FlowField::zero(Size::new(1, 1)).map_err(wrong)?,
            residual: Residual::default(),
            mask: empty()?,
            closed: empty()?,
            morphology: MorphologyScratch::default(),
            regions: RegionFinder::default(),
            known: Vec::new(),
            sight: Sight::default(),
        }))
    }
}

const NAME: &str = "flow";

/// Finds what moves against the scene.
struct FlowDetector {
    params: FlowDetectorParams,
    /// Of the first frame, as every further one must be.
    size: Option<Size>,
    dense: DenseFlow,
    camera: SparseMotion,
    /// The frame, halved until it is small enough.
    halvings: Option<Pyramid>,
    /// The small picture of the frame before, and of this one.
    pyramids: Option<[Pyramid; 2]>,
    field: FlowField,
    residual: Residual,
    mask: Image<u8>,
    closed: Image<u8>,
    morphology: MorphologyScratch,
    regions: RegionFinder,
    /// What was found in the frame before, pixels of the frame.
    known: Vec<BBox>,
    sight: Sight,
}

/// What was seen of the scene.
#[derive(Debug, Clone, Copy, Default)]
struct Sight {
    known: bool,
    shift_px: f64,
    moving: f64,
}

pursuit_tracking::figures! {
    /// What is seen of the scene.
    struct SceneFigures {
        /// 1 where the camera's motion is known, else 0: nothing is told then.
        camera_known;
        /// How far the middle of the picture moved with the camera.
        camera_shift_px in "px";
        /// Share of the picture that moves against the scene.
        moving;
    }
}

/// Picture levels until the shorter side is no longer than `most`.
fn halvings(size: Size, most: usize) -> usize {
    let side = size.width.min(size.height);
    (0..Pyramid::MAX_LEVELS - 1).find(|&level| side.div_ceil(1 << level) <= most).unwrap_or(Pyramid::MAX_LEVELS - 1)
}

impl FlowDetector {
    fn look(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>, VisionError> {
        self.sight = Sight::default();
        let level = halvings(frame.size(), self.params.resolution_px);
        let halved = match self.halvings.as_mut() {
            Some(pyramid) => {
                pyramid.build(frame.gray(), level + 1)?;
                pyramid
            }
            None => self.halvings.insert(Pyramid::of(frame.gray(), level + 1)?),
        };
        let level = level.min(halved.levels() - 1);
        let Some(small) = halved.level(level) else { return Ok(Vec::new()) };
        let levels = self.dense.levels(small.size()).max(4);
        let Some([before, now]) = &mut self.pyramids else {
            let first = Pyramid::of(small, levels)?;
            self.pyramids = Some([first.clone(), first]);
            return Ok(Vec::new());
        };
        std::mem::swap(before, now);
        now.build(small, levels)?;
        let scale = (1usize << level) as f64;
        let known = std::mem::take(&mut self.known);
        let patch = self.dense.params().patch_px;
        if small.width().min(small.height()) < patch.max(16) {
            return Ok(Vec::new());
        }
        // Targets move by themselves. From this frame back to the one before, so that what is marked lies in this one.
        let excluded: Vec<BBox> = followed.iter().map(|f| f.bbox).filter(|b| b.is_finite() && !b.is_empty()).collect();
        let shrunk: Vec<BBox> = excluded
            .iter()
            .map(|b| BBox::from_ltwh(b.left() / scale, b.top() / scale, b.width() / scale, b.height() / scale))
            .collect();
        let motion = match self.camera.estimate(now, before, &shrunk)? {
            None if !shrunk.is_empty() => self.camera.estimate(now, before, &[])?,
            motion => motion,
        };
        let Some(motion) = motion else { return Ok(Vec::new()) };
        self.dense.estimate(now, before, &mut self.field)?;
        let camera = motion.second_from_first;
        let size = small.size();
        let (Some(first), Some(second)) = (now.level(0), before.level(0)) else { return Ok(Vec::new()) };
        let moving = self.residual.mark([first, second], &self.field, &camera, &self.params, &mut self.mask)?;
        let center = size.bounds().center();
        self.sight = Sight { known: true, shift_px: scale * camera.apply(center).distance(center), moving };
        if moving > self.params.most_area {
            return Ok(Vec::new());
        }
        self.gather(&camera, scale, frame.size(), &known)
    }

    /// The regions of the mask, with how sure each is to be a mover.
    fn gather(
        &mut self,
        camera: &Affine,
        scale: f64,
        frame: Size,
        known: &[BBox],
    ) -> Result<Vec<Detection>, VisionError> {
        let size = self.mask.size();
        let closing = (self.params.closing * size.height as f64).round() as usize;
        self.closed.resize_for_overwrite(size, 0)?;
        self.closed.as_mut_slice().copy_from_slice(self.mask.as_slice());
        dilate(&mut self.closed, closing, &mut self.morphology)?;
        erode(&mut self.closed, closing, &mut self.morphology)?;
        let least = ((self.params.least_area * size.area() as f64).ceil() as usize).max(4);
        let mut detections = Vec::new();
        for region in self.regions.find(self.closed.view(), least) {
            let window = region.bounds.to_bbox();
            let side = |from: f64, to: f64, n: usize| (from.max(0.0) as usize).min(n)..(to.max(0.0) as usize).min(n);
            let columns = side(window.left(), window.right(), size.width);
            let rows = side(window.top(), window.bottom(), size.height);
            let length = self.residual.mean_length(self.mask.view(), columns, rows);
            // Pixel x of a level is pixel x · scale of the frame.
            let to_frame = |v: f64| (v - 0.5) * scale + 0.5;
            let bbox = BBox::from_ltrb(
                to_frame(window.left()).max(0.0),
                to_frame(window.top()).max(0.0),
                to_frame(window.right()).min(frame.width as f64),
                to_frame(window.bottom()).min(frame.height as f64),
            );
            if bbox.is_empty() {
                continue;
            }
            self.known.push(bbox);
            // Where the region would have been, had it stood still in the scene: its own motion is small against its size.
            let center = window.center();
            let then = camera.apply(center);
            let came = bbox.translated(scale * (then.x - center.x), scale * (then.y - center.y));
            let seen = known.iter().any(|b| b.iou(&came) >= self.params.known || b.iou(&bbox) >= self.params.known);
            let sure = 1.0 - 0.5 * (self.params.threshold_px / length.max(self.params.threshold_px));
            detections.push(Detection::new(bbox, if seen { sure } else { self.params.first * sure }));
        }
        detections.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        Ok(detections)
    }
}

impl Detector for FlowDetector {
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        if let Some(expected) = self.size.filter(|size| *size != frame.size()) {
            return Err(TrackingError::FrameSize { index: frame.index(), expected, actual: frame.size() });
        }
        self.size = Some(frame.size());
        self.look(frame, followed).map_err(|e| TrackingError::Computation {
            tracker: NAME.to_owned(),
            index: frame.index(),
            source: Box::new(e),
        })
    }

    fn watches(&self) -> bool {
        true
    }

    fn motion(&self) -> Option<MotionParams> {
        Some(detected_motion())
    }

    fn diagnostics(&self) -> Diagnostics {
        let Sight { known, shift_px, moving } = self.sight;
        SceneFigures { camera_known: f64::from(u8::from(known)), camera_shift_px: shift_px, moving }.into()
    }
}
