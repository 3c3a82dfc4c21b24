use super::{ZoneList, Zones};
use crate::control::prediction::Prediction;
use crate::geometry::FieldsOfView;
use crate::mechanics::HeadLimits;
use crate::{Direction, Position};
use pursuit_geometry::Size;

/// The zones of a follower, and the camera for which they hold.
#[derive(Debug, Clone, Copy)]
pub(in crate::control) struct Permit<'a> {
    pub zones: &'a ZoneList,
    pub views: &'a FieldsOfView,
    pub size: Size,
    pub limits: &'a HeadLimits,
}

impl Permit<'_> {
    /// The zones for a head that looks there at such a zoom.
    pub fn zones(&self, direction: Direction, zoom: f64) -> Zones {
        if self.zones.0.is_empty() {
            return Zones::new(self.zones, Direction::AHEAD);
        }
        let reach = self.views.lens(zoom, self.size).map(|lens| lens.reach(direction.tilt_deg));
        // A picture whose reach is not known may show everything.
        Zones::new(self.zones, reach.unwrap_or(Direction::new(360.0, 180.0)))
    }

    /// Where to turn first on the way to where the target will be, and the zoom unless that would show what must not be shown.
    pub fn first(&self, head: Position, there: Prediction, zoom: Option<f64>) -> (Prediction, Option<f64>) {
        if self.zones.0.is_empty() {
            return (there, zoom);
        }
        // Counted on from where the head stands, the short way round.
        let goal = head.direction.turned(there.direction.from(head.direction));
        let wider = |zoom: f64| zoom < head.zoom;
        let zoom = zoom.filter(|&zoom| !wider(zoom) || self.on_the_way(head, goal, zoom).permits(head.direction));
        let first = self.on_the_way(head, goal, zoom.unwrap_or(head.zoom)).way(head.direction, goal, self.limits);
        if first == goal {
            (there, zoom)
        } else {
            (Prediction { direction: first, speed: Direction::AHEAD, is_waypoint: true, ..there }, zoom)
        }
    }

    /// Where to send the head in one go on the way to `goal`; `None` where it is to stay.
    pub fn goal(&self, head: Position, goal: Direction, zoom: Option<f64>) -> Option<Direction> {
        if self.zones.0.is_empty() {
            return Some(goal);
        }
        let zones = self.on_the_way(head, goal, zoom.unwrap_or(head.zoom));
        let first = zones.way(head.direction, goal, self.limits);
        (first != head.direction).then_some(first)
    }

    /// The zones for a head on its way to `goal`, where it zooms to `zoom`: as if the picture were all the time as wide as it gets.
    fn on_the_way(&self, head: Position, goal: Direction, zoom: f64) -> Zones {
        let steeper = if goal.tilt_deg.abs() > head.direction.tilt_deg.abs() { goal } else { head.direction };
        self.zones(steeper, zoom.min(head.zoom))
    }
}
