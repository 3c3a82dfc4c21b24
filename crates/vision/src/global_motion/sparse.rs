use super::{GlobalMotion, RobustFit, RobustFitParams};
use crate::VisionError;
use crate::error::require_range;
use crate::flow::{LucasKanade, LucasKanadeParams, Pyramid, RoundTrip};
use pursuit_geometry::{BBox, Point, Size};
use serde::{Deserialize, Serialize};

/// Parameters of [`SparseMotion`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SparseMotionParams {
    /// Points across and down the picture, 2 to 200 each.
    pub grid: Size,
    /// How points are followed.
    pub flow: LucasKanadeParams,
    /// Points that come back farther than this from where they started are left out, pixels, > 0.
    pub max_forward_backward_px: f64,
    /// How the motion is fitted.
    pub fit: RobustFitParams,
}

impl Default for SparseMotionParams {
    fn default() -> Self {
        Self {
            grid: Size::new(16, 12),
            flow: LucasKanadeParams { window: Size::new(15, 15), iterations: 15, ..LucasKanadeParams::default() },
            max_forward_backward_px: 0.5,
            fit: RobustFitParams::default(),
        }
    }
}

/// Estimates the motion of the picture from the flow on a regular grid; owns its scratch.
#[derive(Debug, Clone)]
pub struct SparseMotion {
    params: SparseMotionParams,
    flow: LucasKanade,
    fit: RobustFit,
    points: Vec<Point>,
    trips: Vec<RoundTrip>,
    pairs: Vec<(Point, Point)>,
}

impl SparseMotion {
    /// An estimator.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: SparseMotionParams) -> Result<Self, VisionError> {
        for side in [params.grid.width, params.grid.height] {
            require_range("the side of the grid", side as f64, (2.0, 200.0), "from 2 to 200 points")?;
        }
        let most = params.max_forward_backward_px;
        require_range("max_forward_backward_px", most, (f64::MIN_POSITIVE, f64::MAX), "positive and finite")?;
        Ok(Self {
            params,
            flow: LucasKanade::new(params.flow)?,
            fit: RobustFit::new(params.fit)?,
            points: Vec::new(),
            trips: Vec::new(),
            pairs: Vec::new(),
        })
    }

    /// The parameters.
    pub const fn params(&self) -> &SparseMotionParams {
        &self.params
    }

    /// The motion from the frame of `from` to that of `to`; points inside of `exclude` (the targets, which move by
    /// themselves) are not used. `None` when too few points agree.
    ///
    /// # Errors
    /// When the two frames are not equally large.
    pub fn estimate(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        exclude: &[BBox],
    ) -> Result<Option<GlobalMotion>, VisionError> {
        let (frame, grid) = (from.size(), self.params.grid);
        self.points.clear();
        for j in 0..grid.height {
            let y = frame.height as f64 * (j as f64 + 0.5) / grid.height as f64;
            let along =
                (0..grid.width).map(|i| Point::new(frame.width as f64 * (i as f64 + 0.5) / grid.width as f64, y));
            self.points.extend(along.filter(|p| !exclude.iter().any(|b| b.contains(*p))));
        }
        self.flow.track_there_and_back(from, to, &self.points, &mut self.trips)?;
        let steady =
            self.points.iter().zip(&self.trips).filter(|(_, t)| t.error_px <= self.params.max_forward_backward_px);
        self.pairs.clear();
        self.pairs.extend(steady.map(|(p, t)| (*p, t.there.point)));
        Ok(self.fit.fit(&self.pairs))
    }

    /// The points of the last estimate that came back to where they started: first frame, second frame.
    pub fn pairs(&self) -> &[(Point, Point)] {
        &self.pairs
    }
}
