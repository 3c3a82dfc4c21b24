use super::{LucasKanade, LucasKanadeParams, Pyramid, RoundTrip, Start};
use crate::error::{VisionError, require_range};
use crate::patch::{correlation, take_patch};
use pursuit_geometry::{BBox, Point, Size};
use serde::{Deserialize, Serialize};

/// How the scale follows from the ratios of pairwise distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScaleRule {
    /// The median ratio (Kalal, Mikolajczyk and Matas 2010).
    #[default]
    Median,
    /// The mean ratio (zhu2014, equation (9)).
    Mean,
}

/// Parameters of [`MedianFlow`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MedianFlowParams {
    /// Points across and down the box, 2 to 64 each (10 and 10: Kalal 2010, zhu2014).
    pub grid: Size,
    /// How points are followed.
    pub flow: LucasKanadeParams,
    /// Side of the square patches that are correlated, 3 to 64 pixels.
    pub patch_px: usize,
    /// How the scale is estimated.
    pub scale: ScaleRule,
    /// The box is lost when the median deviation of the points from the median displacement exceeds this, pixels.
    pub max_residual_px: f64,
    /// The box is lost when the median forward-backward error exceeds this, pixels.
    pub max_forward_backward_px: f64,
}

impl Default for MedianFlowParams {
    /// 10×10 points, 10-pixel patches, failure beyond 10 pixels (Kalal, Mikolajczyk and Matas 2010 and 2012).
    fn default() -> Self {
        Self {
            grid: Size::new(10, 10),
            flow: LucasKanadeParams { window: Size::new(11, 11), levels: 5, ..LucasKanadeParams::default() },
            patch_px: 10,
            scale: ScaleRule::Median,
            max_residual_px: 10.0,
            max_forward_backward_px: 10.0,
        }
    }
}

/// What became of one point: the input of [`box_motion`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairing {
    /// Where it was.
    pub before: Point,
    /// Where it is.
    pub after: Point,
    /// Forward-backward error, pixels.
    pub error_px: f64,
    /// Normalised cross-correlation of the patches about both, −1 to 1.
    pub correlation: f64,
}

/// How a box moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxMotion {
    /// The box now: its centre moved, its sides scaled.
    pub bbox: BBox,
    /// Median displacement of the kept points along x and y, pixels.
    pub displacement: (f64, f64),
    /// Scale: the new sides over the old ones.
    pub scale: f64,
    /// Median forward-backward error of all points, pixels.
    pub forward_backward_px: f64,
    /// Median normalised cross-correlation of all points.
    pub correlation: f64,
    /// Median distance of the kept points' displacements from the median displacement, pixels.
    pub residual_px: f64,
    /// Points kept.
    pub kept: usize,
}

/// Why the motion of a box could not be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FlowFailure {
    /// Fewer than two points could be followed and were better than the median.
    FewPoints {
        /// Points that were left.
        kept: usize,
    },
    /// The points do not come back to where they started.
    Inconsistent {
        /// Median forward-backward error, pixels.
        forward_backward_px: f64,
    },
    /// The points do not move together.
    Scattered {
        /// Median distance from the median displacement, pixels.
        residual_px: f64,
    },
}

/// Estimates how boxes move from one frame to the next (Kalal, Mikolajczyk and Matas 2010, “Forward-backward error”);
/// owns its scratch, so nothing is allocated from frame to frame.
#[derive(Debug, Clone)]
pub struct MedianFlow {
    params: MedianFlowParams,
    flow: LucasKanade,
    points: Vec<Point>,
    trips: Vec<RoundTrip>,
    pairings: Vec<Pairing>,
    patches: [Vec<f32>; 2],
    scratch: Vec<f64>,
}

impl MedianFlow {
    /// An estimator.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: MedianFlowParams) -> Result<Self, VisionError> {
        for side in [params.grid.width, params.grid.height] {
            require_range("the side of the grid", side as f64, (2.0, 64.0), "from 2 to 64 points")?;
        }
        require_range("patch_px", params.patch_px as f64, (3.0, 64.0), "from 3 to 64 pixels")?;
        require_range("max_residual_px", params.max_residual_px, (0.0, f64::MAX), "finite and not negative")?;
        let most = params.max_forward_backward_px;
        require_range("max_forward_backward_px", most, (0.0, f64::MAX), "finite and not negative")?;
        let patch = vec![0.0; params.patch_px * params.patch_px];
        Ok(Self {
            params,
            flow: LucasKanade::new(params.flow)?,
            points: Vec::new(),
            trips: Vec::new(),
            pairings: Vec::new(),
            patches: [patch.clone(), patch],
            scratch: Vec::new(),
        })
    }

    /// The parameters.
    pub const fn params(&self) -> &MedianFlowParams {
        &self.params
    }

    /// How `bbox` of the frame of `from` moved in the frame of `to`; the inner `Err` says why it cannot be told.
    ///
    /// # Errors
    /// When the two frames are not equally large.
    pub fn estimate(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        bbox: &BBox,
    ) -> Result<Result<BoxMotion, FlowFailure>, VisionError> {
        self.estimate_from(from, to, bbox, Start::default())
    }

    /// As [`estimate`](Self::estimate), looking for the points first where `start` says.
    ///
    /// # Errors
    /// When the two frames are not equally large.
    pub fn estimate_from(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        bbox: &BBox,
        start: Start,
    ) -> Result<Result<BoxMotion, FlowFailure>, VisionError> {
        grid(bbox, self.params.grid, &mut self.points);
        self.flow.track_there_and_back_from(from, to, &self.points, start, &mut self.trips)?;
        self.pairings.clear();
        let (Some(first), Some(second)) = (from.level(0), to.level(0)) else {
            return Ok(Err(FlowFailure::FewPoints { kept: 0 }));
        };
        let patch = Size::new(self.params.patch_px, self.params.patch_px);
        for (&before, trip) in self.points.iter().zip(&self.trips) {
            if trip.error_px.is_finite() {
                let [a, b] = &mut self.patches;
                take_patch(first, before, patch, a);
                take_patch(second, trip.there.point, patch, b);
                let correlation = f64::from(correlation(a, b));
                let after = trip.there.point;
                self.pairings.push(Pairing { before, after, error_px: trip.error_px, correlation });
            }
        }
        Ok(box_motion(&self.pairings, bbox, self.params.scale, &mut self.scratch).and_then(|m| self.believe(m)))
    }

    /// What became of the points of the last estimate that came back at all.
    pub fn pairings(&self) -> &[Pairing] {
        &self.pairings
    }

    fn believe(&self, motion: BoxMotion) -> Result<BoxMotion, FlowFailure> {
        let BoxMotion { forward_backward_px, residual_px, .. } = motion;
        if forward_backward_px > self.params.max_forward_backward_px {
            Err(FlowFailure::Inconsistent { forward_backward_px })
        } else if residual_px > self.params.max_residual_px {
            Err(FlowFailure::Scattered { residual_px })
        } else {
            Ok(motion)
        }
    }
}

/// Writes a regular grid of points over `bbox` to `points`, row by row, the outermost on its border.
pub fn grid(bbox: &BBox, size: Size, points: &mut Vec<Point>) {
    points.clear();
    let along = |from: f64, length: f64, i: usize, n: usize| from + length * i as f64 / (n.max(2) - 1) as f64;
    for j in 0..size.height {
        let y = along(bbox.top(), bbox.height(), j, size.height);
        points.extend((0..size.width).map(|i| Point::new(along(bbox.left(), bbox.width(), i, size.width), y)));
    }
}

/// The motion of `bbox` from that of its points: of the points whose forward-backward error is at most the median and
/// whose correlation is at least the median, the median displacement and the median (or mean) ratio of pairwise
/// distances (Kalal, Mikolajczyk and Matas 2010; zhu2014, equations (8) and (9)). The centre moves by the displacement,
/// the sides are scaled about it.
///
/// # Errors
/// [`FlowFailure::FewPoints`] when fewer than two points with a distance between them are left.
pub fn box_motion(
    points: &[Pairing],
    bbox: &BBox,
    rule: ScaleRule,
    scratch: &mut Vec<f64>,
) -> Result<BoxMotion, FlowFailure> {
    let none = FlowFailure::FewPoints { kept: 0 };
    let forward_backward_px = median_of(points.iter().map(|p| p.error_px), scratch).ok_or(none)?;
    let correlation = median_of(points.iter().map(|p| p.correlation), scratch).ok_or(none)?;
    let kept = || points.iter().filter(|p| p.error_px <= forward_backward_px && p.correlation >= correlation);
    let count = kept().count();
    let few = FlowFailure::FewPoints { kept: count };
    let dx = median_of(kept().map(|p| p.after.x - p.before.x), scratch).ok_or(few)?;
    let dy = median_of(kept().map(|p| p.after.y - p.before.y), scratch).ok_or(few)?;
    let off = |p: &Pairing| (p.after.x - p.before.x - dx).hypot(p.after.y - p.before.y - dy);
    let residual_px = median_of(kept().map(off), scratch).ok_or(few)?;
    let ratios = kept().enumerate().flat_map(|(i, a)| {
        kept().skip(i + 1).filter_map(|b| {
            // Some thousand pairs: lengths of pixels need no care for overflow.
            let squared = |a: Point, b: Point| (a.x - b.x).powi(2) + (a.y - b.y).powi(2);
            let before = squared(a.before, b.before);
            (before > 0.0).then(|| (squared(a.after, b.after) / before).sqrt())
        })
    });
    let scale = match rule {
        ScaleRule::Median => median_of(ratios, scratch),
        ScaleRule::Mean => mean_of(ratios),
    };
    let scale = scale.filter(|s| *s > 0.0 && s.is_finite()).ok_or(few)?;
    let center = Point::new(bbox.center().x + dx, bbox.center().y + dy);
    let bbox = BBox::from_center_size(center, bbox.width() * scale, bbox.height() * scale);
    let displacement = (dx, dy);
    Ok(BoxMotion { bbox, displacement, scale, forward_backward_px, correlation, residual_px, kept: count })
}

/// The median, of an even number of values the mean of the two in the middle.
fn median_of(values: impl Iterator<Item = f64>, scratch: &mut Vec<f64>) -> Option<f64> {
    scratch.clear();
    scratch.extend(values);
    let n = scratch.len();
    if n == 0 {
        return None;
    }
    let (below, middle, _) = scratch.select_nth_unstable_by(n / 2, f64::total_cmp);
    let upper = *middle;
    if n % 2 == 1 {
        return Some(upper);
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some((lower + upper) / 2.0)
}

fn mean_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0u32), |(sum, n), v| (sum + v, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}
