//! Two plain controllers, to be compared with.

use super::Controller;
use crate::error::require;
use crate::geometry::{Direction, FieldsOfView, qu2010};
use crate::{Command, Forecast, Result, Status, Velocity};
use pursuit_geometry::{Point, Size};
use pursuit_tracking::TrackState;

/// The offset of the target in the last frame, at the widest zoom.
fn offset(
    views: &FieldsOfView,
    size: Size,
    stamp_s: f64,
    forecast: &dyn Forecast,
) -> Result<Option<(Direction, Point)>> {
    let Some(aim) = forecast.at(stamp_s).filter(|aim| aim.state == TrackState::Tracking) else { return Ok(None) };
    let lens = views.lens(0.0, size)?;
    let center = aim.bbox.center();
    Ok(Some((qu2010::turn(&lens, center), center)))
}

/// A head driven at a speed proportional to the offset in the last frame, without any model: the textbook's first loop.
#[derive(Debug, Clone)]
pub struct Proportional {
    views: FieldsOfView,
    size: Size,
    gain_per_s: f64,
    period_s: f64,
    offset: Option<Direction>,
    next_s: f64,
}

impl Proportional {
    /// A loop of gain `gain_per_s`, one command every `period_s` seconds.
    ///
    /// # Errors
    /// Where a number is not positive.
    pub fn new(views: FieldsOfView, size: Size, gain_per_s: f64, period_s: f64) -> Result<Self> {
        require("gain_per_s", gain_per_s, gain_per_s > 0.0, "above 0")?;
        require("period_s", period_s, period_s > 0.0, "above 0 s")?;
        Ok(Self { views, size, gain_per_s, period_s, offset: None, next_s: f64::NEG_INFINITY })
    }
}

impl Controller for Proportional {
    fn see(&mut self, _now_s: f64, stamp_s: f64, forecast: &dyn Forecast) -> Result<()> {
        self.offset = offset(&self.views, self.size, stamp_s, forecast)?.map(|(offset, _)| offset);
        Ok(())
    }

    fn act(&mut self, now_s: f64, _status: Option<&Status>) -> Result<Option<Command>> {
        if now_s < self.next_s {
            return Ok(None);
        }
        self.next_s = now_s + self.period_s;
        let Some(offset) = self.offset else { return Ok(Some(Command::Stop)) };
        let (pan_deg_s, tilt_deg_s) = (self.gain_per_s * offset.pan_deg, self.gain_per_s * offset.tilt_deg);
        Ok(Some(Command::Move(Velocity { pan_deg_s, tilt_deg_s, zoom_per_s: 0.0 })))
    }
}

/// A head that is turned by the offset seen, and then left alone until it says that it stands: move, stop, wait. What
/// programs without a model of the head commonly do.
#[derive(Debug, Clone)]
pub struct StopAndGo {
    views: FieldsOfView,
    size: Size,
    /// Half the side of the zone that is left alone, as a fraction of half the picture.
    dead_zone: f64,
    /// For how long to wait for the head to say that it stands, seconds.
    idle_timeout_s: f64,
    /// How long after that to wait for a picture that was taken at rest, seconds.
    settle_s: f64,
    offset: Option<(Direction, Point)>,
    state: Turning,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Turning {
    /// Waits for a picture.
    Watching,
    /// Told to turn at this time; not yet believed to have begun.
    Told(f64),
    /// Stands since then, by its own account.
    Settling(f64),
}

impl StopAndGo {
    /// The head is polled from this long after a command on: right after it, it has not yet begun to move.
    const POLL_AFTER_S: f64 = 0.5;

    /// Leaves a zone of `dead_zone` (of half the picture) alone, waits `idle_timeout_s` at most for the head, and
    /// `settle_s` for a picture taken at rest.
    ///
    /// # Errors
    /// Where a number is out of its range.
    pub fn new(views: FieldsOfView, size: Size, dead_zone: f64, idle_timeout_s: f64, settle_s: f64) -> Result<Self> {
        require("dead_zone", dead_zone, (0.0..1.0).contains(&dead_zone), "at least 0 and below 1")?;
        require("idle_timeout_s", idle_timeout_s, idle_timeout_s > 0.0, "above 0 s")?;
        require("settle_s", settle_s, settle_s >= 0.0, "at least 0 s")?;
        Ok(Self { views, size, dead_zone, idle_timeout_s, settle_s, offset: None, state: Turning::Watching })
    }

    fn outside(&self, at: Point) -> bool {
        let half = Point::new(self.size.width as f64 / 2.0, self.size.height as f64 / 2.0);
        ((at.x - half.x) / half.x).abs() > self.dead_zone || ((at.y - half.y) / half.y).abs() > self.dead_zone
    }
}

impl Controller for StopAndGo {
    fn see(&mut self, _now_s: f64, stamp_s: f64, forecast: &dyn Forecast) -> Result<()> {
        self.offset = offset(&self.views, self.size, stamp_s, forecast)?;
        Ok(())
    }

    fn act(&mut self, now_s: f64, status: Option<&Status>) -> Result<Option<Command>> {
        match self.state {
            Turning::Told(since) => {
                let stands = status.and_then(|s| s.moving) == Some(false) && now_s >= since + Self::POLL_AFTER_S;
                if stands || now_s > since + self.idle_timeout_s {
                    self.state = Turning::Settling(now_s);
                }
                Ok(None)
            }
            Turning::Settling(since) => {
                if now_s >= since + self.settle_s {
                    self.offset = None;
                    self.state = Turning::Watching;
                }
                Ok(None)
            }
            Turning::Watching => {
                let Some((by, _)) = self.offset.filter(|(_, at)| self.outside(*at)) else { return Ok(None) };
                self.state = Turning::Told(now_s);
                Ok(Some(Command::TurnBy { by }))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aim, Still};
    use pursuit_geometry::BBox;

    const SIZE: Size = Size::new(640, 360);

    fn at(x: f64, y: f64) -> Still {
        let bbox = BBox::from_center_size(Point::new(x, y), 10.0, 20.0);
        Still(Some(Aim { bbox, covariance: None, state: TrackState::Tracking }))
    }

    fn views() -> FieldsOfView {
        FieldsOfView::fixed(30.0).unwrap()
    }

    #[test]
    fn proportional_is_proportional_and_stops_without_a_target() {
        let mut controller = Proportional::new(views(), SIZE, 2.0, 0.1).unwrap();
        controller.see(0.0, 0.0, &at(640.0, 180.0)).unwrap();
        let Some(Command::Move(velocity)) = controller.act(0.0, None).unwrap() else { panic!() };
        assert!((velocity.pan_deg_s - 60.0).abs() < 1e-9 && velocity.tilt_deg_s.abs() < 1e-9);
        assert_eq!(controller.act(0.05, None).unwrap(), None, "not before the period is over");
        controller.see(0.1, 0.1, &Still(None)).unwrap();
        assert_eq!(controller.act(0.1, None).unwrap(), Some(Command::Stop));
        assert!(Proportional::new(views(), SIZE, 0.0, 0.1).is_err());
        assert!(Proportional::new(views(), SIZE, 1.0, 0.0).is_err());
    }

    #[test]
    fn stop_and_go_turns_waits_settles_and_looks_again() {
        let mut controller = StopAndGo::new(views(), SIZE, 0.1, 10.0, 0.3).unwrap();
        let (moving, stands) =
            (Status { moving: Some(true), position: None }, Status { moving: Some(false), position: None });
        let mut act = |now: f64, seen: Still, status: &Status| {
            controller.see(now, now, &seen).unwrap();
            controller.act(now, Some(status)).unwrap()
        };
        assert_eq!(act(0.0, at(345.0, 185.0), &stands), None, "within the zone");
        let Some(Command::TurnBy { by }) = act(0.1, at(640.0, 180.0), &stands) else { panic!() };
        assert!((by.pan_deg - 30.0).abs() < 1e-9);
        assert_eq!(act(0.2, at(640.0, 180.0), &stands), None, "it cannot have begun yet");
        assert_eq!(act(1.0, at(640.0, 180.0), &moving), None);
        assert_eq!(act(2.0, at(400.0, 180.0), &stands), None);
        assert_eq!(act(2.2, at(400.0, 180.0), &stands), None, "not settled");
        assert_eq!(act(2.31, at(400.0, 180.0), &stands), None, "settled; the picture is from before");
        assert!(act(2.4, at(400.0, 180.0), &stands).is_some());
        // It never says that it stands: time-out.
        for tick in 1..100 {
            assert_eq!(act(2.4 + f64::from(tick) * 0.1, at(400.0, 180.0), &moving), None, "{tick}");
        }
        act(12.5, at(400.0, 180.0), &moving);
        act(12.9, at(400.0, 180.0), &moving);
        assert!(act(13.0, at(320.0, 10.0), &moving).is_some());
    }
}
