use super::{PhaseCorrelation, SparseMotion, SparseMotionParams};
use crate::Result;
use crate::flow::Pyramid;
use crate::warp::Affine;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::ImageView;

/// Levels of the pyramids that motion is estimated on.
const LEVELS: usize = 4;
/// Longest side of the level that phases are correlated on, in pixels.
const PHASE_SIDE_PX: usize = 160;

/// Says from picture to picture how far the whole of it moved.
#[derive(Debug, Clone)]
pub struct PictureMotion {
    estimator: Estimator,
    before: Pyramid,
    now: Pyramid,
}

#[derive(Debug, Clone)]
enum Estimator {
    Flow(Box<SparseMotion>),
    Phase(Box<PhaseCorrelation>),
}

impl PictureMotion {
    /// By a robust fit of shift, turn and zoom to the flow of points all over the picture; `first` is the first picture.
    ///
    /// # Errors
    /// A picture that is too small.
    pub fn by_flow(first: ImageView<'_, u8>) -> Result<Self> {
        Self::new(first, Estimator::Flow(Box::new(SparseMotion::new(SparseMotionParams::default())?)))
    }

    /// By phase correlation of the whole picture: shifts alone, quicker.
    ///
    /// # Errors
    /// A picture that is too small.
    pub fn by_phase(first: ImageView<'_, u8>) -> Result<Self> {
        Self::new(first, Estimator::Phase(Box::new(PhaseCorrelation::new(PHASE_SIDE_PX))))
    }

    fn new(first: ImageView<'_, u8>, estimator: Estimator) -> Result<Self> {
        let now = Pyramid::of(first, LEVELS)?;
        Ok(Self { estimator, before: now.clone(), now })
    }

    /// How the picture moved since the one before; points inside `targets`, boxes there, do not count. `None` where no motion of
    /// the whole picture can be told.
    pub fn shift(&mut self, gray: ImageView<'_, u8>, targets: &[BBox]) -> Option<PictureShift> {
        let Self { estimator, before, now } = self;
        std::mem::swap(before, now);
        now.build(gray, LEVELS).ok()?;
        match estimator {
            Estimator::Phase(phase) => {
                phase.estimate(before, now).ok()?.map(|s| PictureShift::Everywhere { dx: s.dx, dy: s.dy })
            }
            Estimator::Flow(flow) => {
                flow.estimate(before, now, targets).ok()?.map(|motion| PictureShift::Mapped(motion.second_from_first))
            }
        }
    }
}

/// How a picture moved since the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PictureShift {
    /// By as many pixels to the right and down everywhere.
    Everywhere {
        /// To the right.
        dx: f64,
        /// Down.
        dy: f64,
    },
    /// By shift, turn and zoom.
    Mapped(Affine),
}

impl PictureShift {
    /// How far what was at `place` has moved, in pixels to the right and down; `None` where that is no finite number.
    pub fn at(&self, place: Point) -> Option<(f64, f64)> {
        let (dx, dy) = match self {
            Self::Everywhere { dx, dy } => (*dx, *dy),
            Self::Mapped(map) => {
                let Point { x, y } = map.apply(place);
                (x - place.x, y - place.y)
            }
        };
        (dx.is_finite() && dy.is_finite()).then_some((dx, dy))
    }
}
