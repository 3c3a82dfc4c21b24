use super::{MotionParams, SeenAt};
use crate::geometry::{AngleFormula, FieldsOfView, Lens, direction_of};
use crate::{Aim, Direction, Forecast, Position, Result, Velocity};
use pursuit_geometry::{BBox, Size};

/// What one frame showed of the target, and how the camera stood then.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sighting {
    /// When the picture was taken, seconds.
    pub taken_s: f64,
    pub lens: Lens,
    pub bbox: BBox,
    /// Where the target was, in the world.
    pub seen: SeenAt,
    /// The tracker's forecast, every [`Sighting::KNOT_S`] seconds from the picture on.
    forecast: [Option<Direction>; Sighting::KNOTS],
}

/// What it takes to turn boxes into directions.
pub(super) struct View<'a> {
    pub views: &'a FieldsOfView,
    pub size: Size,
    pub formula: AngleFormula,
    pub motion: &'a MotionParams,
}

impl Sighting {
    const KNOTS: usize = 9;
    const KNOT_S: f64 = 0.125;

    /// The sighting of `aim` in a frame of time stamp `stamp_s` that was taken at `taken_s`, when the camera stood at
    /// `pose`, turned at `turning`, by what is believed of the head. The tracker's forecast is asked for where it is used.
    pub fn new(
        view: &View<'_>,
        (stamp_s, taken_s): (f64, f64),
        (pose, turning): (Position, Velocity),
        aim: &Aim,
        forecast: Option<&dyn Forecast>,
    ) -> Result<Self> {
        let lens = view.views.lens(pose.zoom, view.size)?;
        let look = |bbox: &BBox| direction_of(&lens, pose.direction, bbox.center(), view.formula);
        let mut knots = [None; Self::KNOTS];
        for (index, knot) in knots.iter_mut().enumerate() {
            let later_s = stamp_s + index as f64 * Self::KNOT_S;
            *knot = forecast.and_then(|forecast| forecast.at(later_s)).map(|aim| look(&aim.bbox));
        }
        let sigma_deg = sigma_deg(&lens, aim, view.motion);
        let turning_deg_s = Direction::new(turning.pan_deg_s, turning.tilt_deg_s);
        let direction = look(&aim.bbox);
        let seen = SeenAt { direction, sigma_deg, turning_deg_s, late_s: 0.0, drift: Direction::AHEAD };
        Ok(Self { taken_s, lens, bbox: aim.bbox, seen, forecast: knots })
    }

    /// All directions are counted from elsewhere: what was at 0 is at `by`.
    pub fn shift(&mut self, by: Direction) {
        self.seen.direction = self.seen.direction.turned(by);
        self.forecast.iter_mut().flatten().for_each(|knot| *knot = knot.turned(by));
    }

    /// What the same frame shows if the head stood at `pose` and turned at `turning`, which it did by its model `late_s` earlier.
    pub fn by(&self, view: &View<'_>, (pose, turning): (Position, Velocity), late_s: f64, aim: &Aim) -> SeenAt {
        let direction = direction_of(&self.lens, pose.direction, aim.bbox.center(), view.formula);
        let turning_deg_s = Direction::new(turning.pan_deg_s, turning.tilt_deg_s);
        SeenAt { direction, turning_deg_s, late_s, ..self.seen }
    }

    /// Where the tracker says the target will be at `time_s`, and how fast it moves then, degrees per second; the last
    /// that it says when it is asked for later.
    pub fn forecast_at(&self, time_s: f64) -> Option<(Direction, Direction)> {
        let said = self.forecast.iter().map_while(|knot| *knot).count();
        let last = said.checked_sub(2)?;
        let at = ((time_s - self.taken_s) / Self::KNOT_S).max(0.0);
        let index = (at as usize).min(last);
        let (from, to) = (self.forecast.get(index).copied()??, self.forecast.get(index + 1).copied()??);
        let step = to.from(from);
        let part = at - index as f64;
        let there = from.turned(Direction::new(step.pan_deg * part, step.tilt_deg * part));
        Some((there, Direction::new(step.pan_deg / Self::KNOT_S, step.tilt_deg / Self::KNOT_S)))
    }
}

/// How uncertain a sighting is by the tracker's covariance.
fn sigma_deg(lens: &Lens, aim: &Aim, motion: &MotionParams) -> Direction {
    let (px_x, px_y) = lens.px_per_deg();
    let axis = |variance_px2: Option<f64>, px_per_deg: f64| {
        let seen_px = variance_px2.map_or(0.0, |v| v.max(0.0).sqrt());
        seen_px.max(motion.sigma_px) / px_per_deg
    };
    let variance = |i: usize| aim.covariance.map(|c| c[(i, i)]).filter(|v| v.is_finite());
    Direction::new(axis(variance(0), px_x), axis(variance(1), px_y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;
    use pursuit_geometry::Point;
    use pursuit_tracking::TrackState;

    fn aim(x: f64) -> Aim {
        let bbox = BBox::from_center_size(Point::new(x, 180.0), 20.0, 40.0);
        Aim { bbox, covariance: None, state: TrackState::Tracking }
    }

    fn sighting(forecast: &dyn Forecast) -> Sighting {
        let views = FieldsOfView::fixed(30.0).unwrap();
        let motion = MotionParams::default();
        let size = Size::new(640, 360);
        let view = View { views: &views, size, formula: AngleFormula::PanThenTilt, motion: &motion };
        let pose = Position { direction: Direction::new(10.0, 0.0), zoom: 0.0 };
        let seen = forecast.at(5.0).unwrap();
        Sighting::new(&view, (5.0, 4.9), (pose, Velocity::ZERO), &seen, Some(forecast)).unwrap()
    }

    #[test]
    fn the_trackers_forecast_is_read_on_the_clock_of_the_frames() {
        let seen = sighting(&|time_s: f64| Some(aim(320.0 + 40.0 * (time_s - 5.0))));
        assert!((seen.seen.direction.pan_deg - 10.0).abs() < 1e-12);
        // Stamped 5.0, taken 4.9: half a second after it was taken the tracker's clock shows 5.5.
        let (there, speed) = seen.forecast_at(5.4).unwrap();
        let expected = 10.0 + (20.0 / 320.0 * 30f64.to_radians().tan()).atan().to_degrees();
        assert!((there.pan_deg - expected).abs() < 1e-3, "{there:?} {expected}");
        assert!((speed.pan_deg - 2.0 * (expected - 10.0)).abs() < 0.01, "{speed:?}");
        assert!(speed.tilt_deg.abs() < 1e-9);
        let (before, _) = seen.forecast_at(1.0).unwrap();
        assert!((before.pan_deg - 10.0).abs() < 1e-12);
    }

    #[test]
    fn a_forecast_that_ends_is_continued_and_one_that_says_nothing_is_none() {
        let ends = sighting(&|time_s: f64| (time_s < 5.3).then(|| aim(320.0 + 40.0 * (time_s - 5.0))));
        let goes_on = sighting(&|time_s: f64| Some(aim(320.0 + 40.0 * (time_s - 5.0))));
        let (a, b) = (ends.forecast_at(5.6).unwrap().0, goes_on.forecast_at(5.6).unwrap().0);
        assert!((a.pan_deg - b.pan_deg).abs() < 0.01);
        let once = sighting(&|time_s: f64| (time_s <= 5.0).then(|| aim(320.0)));
        assert_eq!(once.forecast_at(5.1), None);
    }

    #[test]
    fn uncertainty_comes_from_the_tracker() {
        let lens = Lens::new(Size::new(640, 360), 30.0).unwrap();
        let motion = MotionParams { sigma_px: 2.0, ..MotionParams::default() };
        let (px_x, px_y) = lens.px_per_deg();
        let mut covariance = Matrix4::identity();
        covariance[(0, 0)] = (3.0 * px_x).powi(2);
        let known = Aim { covariance: Some(covariance), ..aim(1.0) };
        let sigma = sigma_deg(&lens, &known, &motion);
        assert!((sigma.pan_deg - 3.0).abs() < 1e-9 && (sigma.tilt_deg - 2.0 / px_y).abs() < 1e-12, "{sigma:?}");
        assert_eq!(sigma_deg(&lens, &aim(1.0), &motion), Direction::new(2.0 / px_x, 2.0 / px_y));
    }
}
