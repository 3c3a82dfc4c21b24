//! Where the head may look: zones of pan and tilt, the way around them, and how fast it may move before their edges.

mod permit;
mod zone;

pub(super) use permit::Permit;
pub use zone::{Rule, Zone, ZoneList};

use crate::mechanics::HeadLimits;
use crate::{Direction, Velocity};

/// The zones for a camera that sees a certain angle: private ones are wider by half of what the picture shows.
#[derive(Debug, Clone)]
pub(super) struct Zones {
    zones: Vec<Zone>,
}

impl Zones {
    /// How far from the edges of forbidden zones ways are planned, degrees: a head is not exactly where it is believed to be.
    const MARGIN_DEG: f64 = 0.5;

    /// The zones of `list` for a picture that reaches `half` to each side of the optical axis.
    pub fn new(list: &ZoneList, half: Direction) -> Self {
        let grown = |zone: &Zone| match zone.rule {
            Rule::Allowed | Rule::Forbidden => *zone,
            Rule::Private => zone.grown(half),
        };
        Self { zones: list.0.iter().map(grown).collect() }
    }

    /// The same with the forbidden ones wider to each side, for planning.
    fn wider(&self, by_deg: f64) -> Self {
        let by = Direction::new(by_deg, by_deg);
        let grown = |zone: &Zone| if zone.rule == Rule::Allowed { *zone } else { zone.grown(by) };
        Self { zones: self.zones.iter().map(grown).collect() }
    }

    /// Whether the optical axis may point there.
    pub fn permits(&self, direction: Direction) -> bool {
        let mut allowed = self.zones.iter().filter(|zone| zone.rule == Rule::Allowed).peekable();
        let is_allowed = allowed.peek().is_none() || allowed.any(|zone| zone.holds(direction, true));
        let mut others = self.zones.iter().filter(|zone| zone.rule != Rule::Allowed);
        is_allowed && !others.any(|zone| zone.holds(direction, false))
    }

    /// The nearest direction that is permitted and that the head reaches; `None` where there is none.
    pub fn nearest(&self, direction: Direction, limits: &HeadLimits) -> Option<Direction> {
        let wanted = limits.reachable(direction);
        if self.permits(wanted) {
            return Some(wanted);
        }
        // The nearest one is where it was wanted on one axis or at an edge, and so is it on the other.
        let edges = |of: fn(&Zone) -> (f64, f64), own: f64| {
            let both = self.zones.iter().flat_map(move |zone| <[f64; 2]>::from(of(zone)));
            std::iter::once(own).chain(both).collect::<Vec<f64>>()
        };
        let (pans, tilts) = (edges(|z| z.pan_deg, wanted.pan_deg), edges(|z| z.tilt_deg, wanted.tilt_deg));
        let grid = pans.iter().flat_map(|&pan| tilts.iter().map(move |&tilt| Direction::new(pan, tilt)));
        let there = grid.filter(|&place| limits.reachable(place) == place && self.permits(place));
        there.min_by(|a, b| distance(wanted, *a).total_cmp(&distance(wanted, *b)))
    }

    /// Whether the head may turn from one direction straight to another.
    fn is_free(&self, from: Direction, to: Direction) -> bool {
        // Between two crossings of lines that edges lie on, all is permitted or nothing.
        let mut cuts = vec![0.0, 1.0];
        for zone in &self.zones {
            let cut = |edge: f64, from: f64, to: f64| (edge - from) / (to - from);
            cuts.extend(<[f64; 2]>::from(zone.pan_deg).map(|edge| cut(edge, from.pan_deg, to.pan_deg)));
            cuts.extend(<[f64; 2]>::from(zone.tilt_deg).map(|edge| cut(edge, from.tilt_deg, to.tilt_deg)));
        }
        cuts.retain(|cut| (0.0..=1.0).contains(cut));
        cuts.sort_by(f64::total_cmp);
        let middle = |pair: &[f64]| pair.iter().sum::<f64>() / 2.0;
        let at = |part: f64| {
            let along = |from: f64, to: f64| from + part * (to - from);
            Direction::new(along(from.pan_deg, to.pan_deg), along(from.tilt_deg, to.tilt_deg))
        };
        cuts.windows(2).all(|pair| self.permits(at(middle(pair)))) && self.permits(to)
    }

    /// Where to turn first on the way to `goal`: there where nothing is in the way, else to a corner of a zone, else as near as
    /// the head comes. A head that is where it must not be leaves first.
    pub fn way(&self, from: Direction, goal: Direction, limits: &HeadLimits) -> Direction {
        let wide = self.wider(Self::MARGIN_DEG);
        let (Some(goal), Some(start)) = (wide.nearest(goal, limits), wide.nearest(from, limits)) else { return from };
        if !self.permits(from) {
            return start;
        }
        if wide.is_free(start, goal) {
            return goal;
        }
        // Further out than the edges, so that a head that comes close to a corner is past it.
        let corners = self.wider(2.0 * Self::MARGIN_DEG).corners(limits);
        let corners: Vec<Direction> = corners.into_iter().filter(|&corner| wide.permits(corner)).collect();
        let rest = |corner: Direction| {
            if wide.is_free(corner, goal) {
                return distance(corner, goal);
            }
            let further = corners.iter().filter(|&&next| wide.is_free(corner, next) && wide.is_free(next, goal));
            further.map(|&next| distance(corner, next) + distance(next, goal)).fold(f64::INFINITY, f64::min)
        };
        let is_past = |corner: Direction| distance(start, corner) <= Self::MARGIN_DEG;
        let costs = corners.iter().filter(|&&corner| !is_past(corner) && wide.is_free(start, corner));
        let costs = costs.map(|&corner| (distance(start, corner) + rest(corner), corner));
        let best = costs.filter(|(cost, _)| cost.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(from, |(_, corner)| corner)
    }

    /// The corners of the zones that the head reaches.
    fn corners(&self, limits: &HeadLimits) -> Vec<Direction> {
        let of = |zone: &Zone| {
            let (pan, tilt) = (zone.pan_deg, zone.tilt_deg);
            [(pan.0, tilt.0), (pan.0, tilt.1), (pan.1, tilt.0), (pan.1, tilt.1)].map(|(p, t)| Direction::new(p, t))
        };
        self.zones.iter().flat_map(of).filter(|&corner| limits.reachable(corner) == corner).collect()
    }

    /// The velocity, slower where the head could not stop before an edge: it keeps it for `period_s` and then brakes.
    pub fn braked(&self, from: Direction, velocity: Velocity, limits: &HeadLimits, period_s: f64) -> Velocity {
        const PARTS: [f64; 6] = [1.0, 0.7, 0.5, 0.3, 0.15, 0.05];
        if !self.permits(from) {
            return velocity;
        }
        let slower = |part: f64| Velocity {
            pan_deg_s: part * velocity.pan_deg_s,
            tilt_deg_s: part * velocity.tilt_deg_s,
            ..velocity
        };
        let stops = |v: &Velocity| {
            let way = |speed: f64, brake: f64| speed * period_s + speed * speed.abs() / (2.0 * brake);
            let pan = way(v.pan_deg_s, limits.pan.max_acceleration_deg_s2);
            from.turned(Direction::new(pan, way(v.tilt_deg_s, limits.tilt.max_acceleration_deg_s2)))
        };
        let kept = PARTS.into_iter().map(slower).find(|velocity| self.is_free(from, stops(velocity)));
        kept.unwrap_or_else(|| slower(0.0))
    }
}

fn distance(a: Direction, b: Direction) -> f64 {
    (a.pan_deg - b.pan_deg).hypot(a.tilt_deg - b.tilt_deg)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zones(texts: &[&str], half: Direction) -> Zones {
        Zones::new(&ZoneList(texts.iter().map(|text| text.parse().unwrap()).collect()), half)
    }

    fn at(pan: f64, tilt: f64) -> Direction {
        Direction::new(pan, tilt)
    }

    const LIMITS: HeadLimits = HeadLimits {
        pan: crate::mechanics::AxisLimits::PAN,
        tilt: crate::mechanics::AxisLimits::TILT,
        zoom_per_s: 0.3,
    };

    #[test]
    fn kinds_of_zones_permit_what_they_say() {
        let both = zones(&["allowed pan -90..90", "forbidden pan 0..10 tilt 0..10"], Direction::AHEAD);
        assert!(both.permits(at(-90.0, 0.0)) && !both.permits(at(-91.0, 0.0)));
        assert!(!both.permits(at(5.0, 5.0)) && both.permits(at(5.0, 10.0)) && both.permits(at(11.0, 5.0)));
        let private = zones(&["private pan 0..10 tilt 0..10"], at(20.0, 10.0));
        assert!(!private.permits(at(29.0, 0.0)) && private.permits(at(30.0, 0.0)) && private.permits(at(5.0, -10.0)));
        assert!(zones(&[], Direction::AHEAD).permits(at(999.0, 99.0)));
    }

    #[test]
    fn the_nearest_permitted_direction_is_found() {
        let one = zones(&["forbidden pan 0..10 tilt -5..50"], Direction::AHEAD);
        assert_eq!(one.nearest(at(3.0, 10.0), &LIMITS), Some(at(0.0, 10.0)));
        assert_eq!(one.nearest(at(5.0, -4.0), &LIMITS), Some(at(5.0, -5.0)));
        assert_eq!(one.nearest(at(200.0, 0.0), &LIMITS), Some(at(170.0, 0.0)));
        let low = zones(&["forbidden pan 0..10 tilt -40..50"], Direction::AHEAD);
        assert_eq!(
            low.nearest(at(5.0, -29.0), &LIMITS),
            Some(at(0.0, -29.0)),
            "the head does not reach below the zone"
        );
        assert_eq!(zones(&["forbidden pan -999..999"], Direction::AHEAD).nearest(at(0.0, 0.0), &LIMITS), None);
    }

    #[test]
    fn ways_lead_around_zones() {
        let wall = zones(&["forbidden pan 0..10 tilt -20..20"], Direction::AHEAD);
        assert_eq!(wall.way(at(-5.0, 0.0), at(-2.0, 3.0), &LIMITS), at(-2.0, 3.0), "nothing is in the way");
        let (mut head, goal, mut steps) = (at(-5.0, 12.0), at(20.0, 12.0), Vec::new());
        while head != goal && steps.len() < 9 {
            let next = wall.way(head, goal, &LIMITS);
            assert!(wall.is_free(head, next), "{head:?} {next:?}");
            steps.push(next);
            head = next;
        }
        assert_eq!(steps, [at(-1.0, 21.0), at(11.0, 21.0), goal]);
        assert_eq!(wall.way(at(4.0, 0.0), goal, &LIMITS), at(-0.5, 0.0), "it leaves first");
        assert_eq!(wall.way(at(-0.9, 20.7), goal, &LIMITS), at(11.0, 21.0), "near a corner is past it");
        assert_eq!(wall.way(at(-0.2, 3.0), goal, &LIMITS), at(-1.0, 21.0), "within the margin is not within the zone");
        let shut = zones(&["forbidden pan 0..10"], Direction::AHEAD);
        assert_eq!(shut.way(at(-5.0, 0.0), at(30.0, 0.0), &LIMITS), at(-5.0, 0.0), "there is no way");
    }

    #[test]
    fn the_head_brakes_before_an_edge() {
        let wall = zones(&["forbidden pan 0..10"], Direction::AHEAD);
        let fast = Velocity { pan_deg_s: 60.0, ..Velocity::ZERO };
        assert_eq!(wall.braked(at(-40.0, 0.0), fast, &LIMITS, 0.04), fast);
        let near = wall.braked(at(-5.0, 0.0), fast, &LIMITS, 0.04);
        assert!(near.pan_deg_s > 0.0 && near.pan_deg_s.powi(2) / 240.0 < 5.0, "{near:?}");
        assert_eq!(wall.braked(at(0.0, 0.0), fast, &LIMITS, 0.04).pan_deg_s, 0.0);
        let away = Velocity { pan_deg_s: -60.0, ..Velocity::ZERO };
        assert_eq!(wall.braked(at(0.0, 0.0), away, &LIMITS, 0.04), away);
    }
}
