/// Whether one axis lets a standing target be: it comes to rest well inside the zone and starts again outside of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DeadZone {
    resting: bool,
}

impl DeadZone {
    /// How far inside the zone the head goes before it rests, as a fraction of the zone.
    const INNER: f64 = 0.4;

    /// Whether to rest, for a target `away_deg` from the middle that moves at `speed_deg_s`, the zone being `zone_deg`
    /// wide to each side. A target that is significantly faster than `still_deg_s` is never left alone.
    pub fn rests(&mut self, away_deg: f64, speed_deg_s: f64, zone_deg: f64, still_deg_s: f64) -> bool {
        let (zone, still) =
            if self.resting { (zone_deg, 2.0 * still_deg_s) } else { (Self::INNER * zone_deg, still_deg_s) };
        self.resting = away_deg.abs() <= zone && speed_deg_s.abs() <= still;
        self.resting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_begins_inside_and_ends_outside() {
        let mut zone = DeadZone::default();
        assert!(!zone.rests(2.0, 0.0, 3.0, 1.0), "in the zone, but not yet at its middle");
        assert!(zone.rests(-1.2, 0.9, 3.0, 1.0));
        assert!(zone.rests(-3.0, -1.9, 3.0, 1.0), "once at rest, the whole zone and twice the speed are borne");
        assert!(!zone.rests(3.1, 0.0, 3.0, 1.0));
        assert!(!zone.rests(2.9, 0.0, 3.0, 1.0));
        assert!(zone.rests(0.0, 0.0, 3.0, 1.0));
        assert!(!zone.rests(0.0, 2.1, 3.0, 1.0), "a target that walks is followed");
        assert!(!zone.rests(0.0, 1.1, 3.0, 1.0));
    }

    #[test]
    fn without_a_zone_only_the_middle_rests() {
        let mut zone = DeadZone::default();
        assert!(!zone.rests(0.01, 0.0, 0.0, 1.0));
        assert!(zone.rests(0.0, 0.0, 0.0, 1.0));
    }
}
