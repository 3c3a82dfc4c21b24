use super::{BounceParams, MotionFilter, Sight};
use crate::roles::Prior;
use crate::{BoxCovariance, Velocity};
use pursuit_estimation::Result;
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};

/// When a box counts as cut by what hides a part of the target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Completion {
    /// A side shorter than this share of the expected one may be cut.
    pub cut_below: f64,
    /// Sides that shrink in step, to within this ratio, mean a smaller (more distant) target, not a cut one.
    pub in_step: f64,
}

impl From<&BounceParams> for Completion {
    fn from(p: &BounceParams) -> Self {
        Self { cut_below: p.cut_below, in_step: p.in_step }
    }
}

impl Default for Completion {
    fn default() -> Self {
        (&BounceParams::default()).into()
    }
}

/// Which sides of a target are cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CutSides {
    /// Whether a part is hidden to the left or to the right.
    pub cut_x: bool,
    /// Whether a part is hidden above or below.
    pub cut_y: bool,
}

impl CutSides {
    /// Whether all of the target is seen.
    pub const fn is_whole(self) -> bool {
        !(self.cut_x || self.cut_y)
    }
}

/// The whole box of a target of which `visible` is seen and which was expected at `expected`.
///
/// When one side is much shorter than expected while the other is not (or less so), something hides a part: an edge that
/// moves in step with the prediction is the target's own, the other one is the occluder's. So the side is completed to
/// its expected length from the edge, or about the centre, that leaves the result nearest to the prediction.
pub fn complete(visible: &BBox, expected: &BBox, completion: Completion) -> (BBox, CutSides) {
    let ratio_x = visible.width() / expected.width();
    let ratio_y = visible.height() / expected.height();
    let whole = CutSides { cut_x: false, cut_y: false };
    if !(ratio_x > 0.0 && ratio_y > 0.0) || ratio_x.min(ratio_y) > completion.in_step * ratio_x.max(ratio_y) {
        return (*visible, whole);
    }
    let side = |low: f64, high: f64, expected_low: f64, expected_high: f64| {
        let length = expected_high - expected_low;
        if high - low >= completion.cut_below * length {
            return (low, high, false);
        }
        let expected_middle = f64::midpoint(expected_low, expected_high);
        let middle = f64::midpoint(low, high);
        let middles = [low + length / 2.0, high - length / 2.0, middle];
        let nearest = middles.into_iter().fold(middle, |best, m| {
            if (m - expected_middle).abs() < (best - expected_middle).abs() { m } else { best }
        });
        (nearest - length / 2.0, nearest + length / 2.0, true)
    };
    let (left, right, cut_x) = side(visible.left(), visible.right(), expected.left(), expected.right());
    let (top, bottom, cut_y) = side(visible.top(), visible.bottom(), expected.top(), expected.bottom());
    (BBox::from_ltrb(left, top, right, bottom), CutSides { cut_x, cut_y })
}

/// A motion filter that is told the visible part of a target and follows the whole of it.
///
/// While a target slides behind something its visible part shrinks and its visible centre slows down; a filter fed with
/// that loses the velocity just when it has to coast. This one corrects the inner filter by the completed box
/// ([`complete`]) and reports, on a side that is cut, what is visible.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartialOcclusion<M> {
    inner: M,
    completion: Completion,
    expected: BBox,
    visible: Option<(BBox, CutSides)>,
}

impl<M: MotionFilter> PartialOcclusion<M> {
    /// Wraps a filter that has been started.
    pub fn new(inner: M, completion: Completion) -> Self {
        Self { expected: inner.bbox(), inner, completion, visible: None }
    }

    /// The filter inside, which follows the whole target.
    pub const fn inner(&self) -> &M {
        &self.inner
    }
}

impl<M: MotionFilter> MotionFilter for PartialOcclusion<M> {
    fn predict(&mut self, dt_s: f64) -> Result<Prior> {
        let prior = self.inner.predict(dt_s)?;
        self.expected = prior.bbox;
        self.visible = None;
        Ok(prior)
    }

    fn correct(&mut self, sight: &Sight) -> Result<()> {
        let (bbox, cut) = complete(&sight.bbox, &self.expected, self.completion);
        self.inner.correct(&Sight { bbox, ..*sight })?;
        self.visible = (!cut.is_whole()).then_some((sight.bbox, cut));
        Ok(())
    }

    fn restart(&mut self, bbox: BBox) {
        self.inner.restart(bbox);
        self.expected = self.inner.bbox();
        self.visible = None;
    }

    fn bbox(&self) -> BBox {
        let whole = self.inner.bbox();
        let Some((seen, view)) = self.visible else { return whole };
        let (left, right) = if view.cut_x { (seen.left(), seen.right()) } else { (whole.left(), whole.right()) };
        let (top, bottom) = if view.cut_y { (seen.top(), seen.bottom()) } else { (whole.top(), whole.bottom()) };
        BBox::from_ltrb(left, top, right, bottom)
    }

    fn covariance(&self) -> Option<BoxCovariance> {
        self.inner.covariance()
    }

    fn velocity(&self) -> Option<Velocity> {
        self.inner.velocity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::Point;

    #[test]
    fn what_is_believed_of_the_whole_is_what_the_filter_inside_believes() {
        use crate::motion::{ManoeuvringBox, MotionParams};
        let inner = ManoeuvringBox::new(&MotionParams::ball(), BBox::from_ltwh(100.0, 50.0, 40.0, 40.0)).unwrap();
        let mut outer = PartialOcclusion::new(inner, Completion::default());
        outer.predict(0.1).unwrap();
        outer.correct(&Sight::of(BBox::from_ltwh(108.0, 50.0, 40.0, 40.0), None)).unwrap();
        assert_eq!((outer.covariance(), outer.velocity()), (outer.inner().covariance(), outer.inner().velocity()));
        assert!(outer.covariance().is_some() && outer.velocity().is_some_and(|v| v.x > 10.0));
        // Said is what is seen of it, believed the whole.
        outer.predict(0.1).unwrap();
        let (cut, whole) = (BBox::from_ltrb(140.0, 50.0, 156.0, 90.0), outer.bbox());
        outer.correct(&Sight::of(cut, None)).unwrap();
        assert_eq!((outer.bbox().left(), outer.bbox().right()), (cut.left(), cut.right()));
        assert!((outer.inner().bbox().width() - whole.width()).abs() < 1.0);
        // Seen whole again it is said whole.
        outer.predict(0.1).unwrap();
        outer.correct(&Sight::of(outer.inner().bbox(), None)).unwrap();
        assert_eq!(outer.bbox(), outer.inner().bbox());
    }

    #[test]
    fn the_edge_in_step_with_the_prediction_is_the_targets_own() {
        let expected = BBox::from_ltwh(100.0, 50.0, 40.0, 40.0);
        // Sliding left behind something at x = 110: the right edge is the target's own.
        let (whole, view) = complete(&BBox::from_ltrb(112.0, 50.0, 139.0, 90.0), &expected, Completion::default());
        assert_eq!((whole.left(), whole.right()), (99.0, 139.0));
        assert!(view.cut_x && !view.cut_y);
        // Coming out on the left: the left edge is.
        let (whole, _) = complete(&BBox::from_ltrb(101.0, 50.0, 110.0, 90.0), &expected, Completion::default());
        assert_eq!((whole.left(), whole.right()), (101.0, 141.0));
        // Half the size both ways: further off, nothing hidden.
        let smaller = BBox::from_center_size(Point::new(120.0, 70.0), 20.0, 21.0);
        assert_eq!(
            complete(&smaller, &expected, Completion::default()),
            (smaller, CutSides { cut_x: false, cut_y: false })
        );
    }
}
