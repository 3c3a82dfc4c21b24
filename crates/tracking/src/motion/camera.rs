//! The camera's own motion, taken out before the target's is predicted.

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_vision::flow::Pyramid;
use pursuit_vision::global_motion::{PhaseCorrelation, SparseMotion, SparseMotionParams};
use serde::{Deserialize, Serialize};

/// Levels of the pyramids that motion is estimated on.
const LEVELS: usize = 4;
/// Longest side of the level that phases are correlated on, in pixels.
const PHASE_SIDE_PX: usize = 160;

crate::choices! {
    /// How the camera's motion is found.
    pub enum CameraCompensation {
        /// It is not: the camera is taken to stand still.
        None = "none",
        /// By a robust fit of shift, turn and zoom to the flow of points all over the picture.
        Flow = "flow",
        /// By phase correlation of the whole picture: shifts alone, quicker.
        Phase = "phase",
    }
}

/// Says how far the picture moved at the target since the frame before.
///
/// The frame before is not saved: a tracker that is restored compensates from its second frame on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CameraShift {
    kind: CameraCompensation,
    #[serde(skip)]
    work: Option<Box<Work>>,
}

/// Scratch and the frame before.
#[derive(Debug, Clone)]
struct Work {
    estimator: Estimator,
    before: Pyramid,
    now: Pyramid,
}

#[derive(Debug, Clone)]
enum Estimator {
    Flow(Box<SparseMotion>),
    Phase(Box<PhaseCorrelation>),
}

impl CameraShift {
    /// Of this kind; no frame has been seen.
    pub const fn new(kind: CameraCompensation) -> Self {
        Self { kind, work: None }
    }

    /// How far the picture moved, in pixels to the right and down, at the place of `target` in the frame before; points
    /// inside the target do not count. `None` where nothing is compensated, in the first frame, and where no motion of the
    /// whole picture can be told.
    pub fn at(&mut self, frame: &Frame, target: &BBox) -> Option<(f64, f64)> {
        if self.kind == CameraCompensation::None {
            return None;
        }
        let Some(work) = &mut self.work else {
            let now = Pyramid::of(frame.gray(), LEVELS).ok()?;
            let estimator = match self.kind {
                CameraCompensation::Phase => Estimator::Phase(Box::new(PhaseCorrelation::new(PHASE_SIDE_PX))),
                _ => Estimator::Flow(Box::new(SparseMotion::new(SparseMotionParams::default()).ok()?)),
            };
            self.work = Some(Box::new(Work { estimator, before: now.clone(), now }));
            return None;
        };
        std::mem::swap(&mut work.before, &mut work.now);
        work.now.build(frame.gray(), LEVELS).ok()?;
        work.shift(target)
    }
}

impl Work {
    fn shift(&mut self, target: &BBox) -> Option<(f64, f64)> {
        let Self { estimator, before, now } = self;
        match estimator {
            Estimator::Phase(phase) => phase.estimate(before, now).ok()?.map(|s| (s.dx, s.dy)),
            Estimator::Flow(flow) => {
                let motion = flow.estimate(before, now, std::slice::from_ref(target)).ok()??;
                let center = target.center();
                let Point { x, y } = motion.second_from_first.apply(center);
                Some((x - center.x, y - center.y))
            }
        }
        .filter(|(dx, dy)| dx.is_finite() && dy.is_finite())
    }
}
