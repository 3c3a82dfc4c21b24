//! How long a target was in a zone, and what it did there.

use super::crossing::Zone;
use super::{Kind, steps};
use crate::Measured;
use serde::Serialize;

/// A target's time in a zone, all its visits together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stay {
    /// Number of the target.
    pub target: u64,
    /// The zone.
    pub zone: String,
    /// How long it was inside, in seconds.
    pub inside_s: f64,
    /// The standard deviation of that: of the moments of entry and exit.
    pub inside_error_s: f64,
    /// The same as a share of the time in which it is known where the target was, 0 to 1.
    pub share: f64,
    /// How often it came, its being there from the start among them.
    pub visits: usize,
    /// When it was inside first, in seconds; `None`: never.
    pub first_s: Option<f64>,
    /// How far it went inside, in the ruler's unit.
    pub path: f64,
    /// How fast it was inside on average, in the ruler's unit a second; `None` where it was not there.
    pub speed: Option<f64>,
}

/// The time of a target in each of the zones. Between two moments it goes straight on: a visit shorter than a frame is not noticed.
pub fn stays(measured: &Measured, zones: &[Zone]) -> Vec<Stay> {
    zones.iter().map(|zone| stay(measured, zone)).collect()
}

fn stay(measured: &Measured, zone: &Zone) -> Stay {
    let passages = zone.passages(measured);
    let (mut inside_s, mut known_s, mut path, mut first_s) = (0.0, 0.0, 0.0, None);
    let mut visits = passages.iter().filter(|event| event.kind == Kind::Entry).count();
    let mut begun = false;
    for (i, a, b, from, to) in steps(measured) {
        let (was, is) = (zone.contains(a.position()), zone.contains(b.position()));
        visits += usize::from(was && !begun);
        begun = true;
        // The moment of passing, where there is one in this step.
        let passed = passages.iter().find(|event| event.frame == measured.moments[i].frame).map(|event| event.time_s);
        let (begin, end) = match (was, is) {
            (true, true) => (from, to),
            (true, false) => (from, passed.unwrap_or(to)),
            (false, true) => (passed.unwrap_or(from), to),
            (false, false) => (from, from),
        };
        known_s += to - from;
        inside_s += end - begin;
        if end > begin {
            first_s = first_s.or(Some(begin));
            let step = (b.position()[0] - a.position()[0]).hypot(b.position()[1] - a.position()[1]);
            path += step * (end - begin) / (to - from);
        }
    }
    Stay {
        target: measured.target,
        zone: zone.name.clone(),
        inside_s,
        inside_error_s: passages.iter().map(|event| event.time_error_s * event.time_error_s).sum::<f64>().sqrt(),
        share: if known_s > 0.0 { inside_s / known_s } else { 0.0 },
        visits,
        first_s,
        path,
        speed: (inside_s > 0.0).then(|| path / inside_s),
    }
}
