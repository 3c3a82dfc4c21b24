//! What happens to a target: turns, bounces, stops, crossings of lines, entries into zones; each with its time and the error of that.

mod crossing;
mod stay;
mod stops;

pub use crossing::{Line, Zone};
pub use stay::{Stay, stays};

use crate::kinematics::Jump;
use crate::{Measured, State};
use serde::Serialize;

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Its x stopped growing or falling.
    TurnX,
    /// Its y stopped growing or falling.
    TurnY,
    /// Its velocity jumped.
    Bounce,
    /// It came to rest.
    Stop,
    /// It moved again.
    Start,
    /// It crossed a line.
    Crossing,
    /// It came into a zone.
    Entry,
    /// It left a zone.
    Exit,
}

impl Kind {
    /// Its name.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::TurnX => "turn-x",
            Self::TurnY => "turn-y",
            Self::Bounce => "bounce",
            Self::Stop => "stop",
            Self::Start => "start",
            Self::Crossing => "crossing",
            Self::Entry => "entry",
            Self::Exit => "exit",
        }
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Number of the target.
    pub target: u64,
    /// What.
    pub kind: Kind,
    /// The first frame after it.
    pub frame: u64,
    /// When, in seconds.
    pub time_s: f64,
    /// The standard deviation of that.
    pub time_error_s: f64,
    /// Where, in the ruler's unit.
    pub at: [f64; 2],
    /// The line or zone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// What to look for besides turns, bounces and stops.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Watched {
    /// Lines that may be crossed.
    pub lines: Vec<Line>,
    /// Zones that may be entered.
    pub zones: Vec<Zone>,
}

/// What happened to a target, in order of time.
pub fn find(measured: &Measured, watched: &Watched) -> Vec<Event> {
    let mut events = turns(measured);
    events.extend(bounces(measured));
    events.extend(stops::find(measured));
    watched.lines.iter().for_each(|line| events.extend(line.crossings(measured)));
    watched.zones.iter().for_each(|zone| events.extend(zone.passages(measured)));
    events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    events
}

/// Two moments that follow on each other, of which something is known.
fn steps(measured: &Measured) -> impl Iterator<Item = (usize, &State, &State, f64, f64)> {
    let moments = &measured.moments;
    (1..moments.len()).filter_map(move |i| {
        let (a, b) = (&moments[i - 1], &moments[i]);
        Some((i, a.state.as_ref()?, b.state.as_ref()?, a.time_s, b.time_s))
    })
}

/// Where a share of the way from one state to the next is: the cubic that has both places and both velocities.
fn between(a: &State, b: &State, dt: f64, share: f64) -> [f64; 2] {
    let s = share;
    let (h00, h10) = (2.0 * s.powi(3) - 3.0 * s * s + 1.0, s.powi(3) - 2.0 * s * s + s);
    let (h01, h11) = (3.0 * s * s - 2.0 * s.powi(3), s.powi(3) - s * s);
    let axis = |i: usize| {
        h00 * a.position()[i] + h10 * dt * a.velocity()[i] + h01 * b.position()[i] + h11 * dt * b.velocity()[i]
    };
    [axis(0), axis(1)]
}

/// Where the velocity along an axis goes through 0, having been clearly one way before and being clearly the other after.
fn turns(measured: &Measured) -> Vec<Event> {
    let mut events = Vec::new();
    for (axis, kind) in [(0, Kind::TurnX), (1, Kind::TurnY)] {
        let component = 2 + axis;
        // The sign that the velocity had when it was last clear, and the last change of sign since.
        let (mut clear, mut change) = (0.0, None);
        for (i, a, b, from, to) in steps(measured) {
            if measured.jumps.iter().any(|jump| jump.index == i) {
                // A bounce is no turn.
                (clear, change) = (0.0, None);
                continue;
            }
            let (va, vb) = (a.mean()[component], b.mean()[component]);
            if va * vb <= 0.0 && va != vb {
                let share = va / (va - vb);
                let error = 0.5 * (a.deviation(component) + b.deviation(component)) / ((vb - va).abs() / (to - from));
                change = Some(Event {
                    target: measured.target,
                    kind,
                    frame: measured.moments[i].frame,
                    time_s: from + share * (to - from),
                    time_error_s: error,
                    at: between(a, b, to - from, share),
                    name: None,
                });
            }
            if vb.abs() > 3.0 * b.deviation(component) {
                if clear * vb < 0.0 {
                    events.extend(change.take());
                }
                (clear, change) = (vb.signum(), None);
            }
        }
    }
    events
}

/// Where the velocity jumped.
fn bounces(measured: &Measured) -> Vec<Event> {
    let one = |jump: &Jump| {
        let after = measured.moments.get(jump.index)?;
        let state = after.state.as_ref()?;
        let back = after.time_s - jump.time_s;
        let at = [0, 1].map(|axis| state.position()[axis] - back * state.velocity()[axis]);
        let (target, frame, time_s) = (measured.target, after.frame, jump.time_s);
        Some(Event { target, kind: Kind::Bounce, frame, time_s, time_error_s: jump.error_s, at, name: None })
    };
    measured.jumps.iter().filter_map(one).collect()
}
