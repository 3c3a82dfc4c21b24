//! When a target comes to rest, and moves again.

use super::{Event, Kind};
use crate::{Measured, State};

/// It has to rest for so long.
const LEAST_S: f64 = 0.2;
/// A speed is clear from this many standard deviations on.
const CLEAR: f64 = 4.0;
/// It rests where its speed cannot be told from 0: `vᵀ P⁻¹ v` below the 95 % quantile of χ² with two degrees of freedom, and is
/// less than this share of how fast it was.
const QUANTILE: f64 = 5.991;
const SHARE: f64 = 0.1;

pub(super) fn find(measured: &Measured) -> Vec<Event> {
    let mut events = Vec::new();
    let mut fastest: f64 = 0.0;
    let mut since: Option<usize> = None;
    let mut resting = false;
    for (i, moment) in measured.moments.iter().enumerate() {
        let Some(state) = &moment.state else { continue };
        let (speed, error) = state.speed();
        if is_still(state) && speed <= SHARE * fastest {
            let start = *since.get_or_insert(i);
            if !resting && moment.time_s - measured.moments[start].time_s >= LEAST_S {
                events.extend(event(measured, Kind::Stop, start));
                resting = true;
            }
            continue;
        }
        if speed > CLEAR * error {
            if resting {
                events.extend(event(measured, Kind::Start, i));
                (resting, fastest) = (false, 0.0);
            }
            (fastest, since) = (fastest.max(speed), None);
        }
    }
    events
}

fn is_still(state: &State) -> bool {
    let block = state.covariance().fixed_view::<2, 2>(2, 2).into_owned();
    let v = state.mean().fixed_rows::<2>(2).into_owned();
    block.try_inverse().is_some_and(|inverse| (v.transpose() * inverse * v)[0] < QUANTILE)
}

/// An event at a moment, as exact as the frames are dense and as the speed tells it.
fn event(measured: &Measured, kind: Kind, i: usize) -> Option<Event> {
    let moment = measured.moments.get(i)?;
    let state = moment.state.as_ref()?;
    let dt = moment.time_s - measured.moments.get(i.saturating_sub(1))?.time_s;
    let (acceleration, _) = state.acceleration_magnitude();
    let by_speed = state.speed().1 / acceleration.max(f64::MIN_POSITIVE);
    let (target, frame, time_s) = (measured.target, moment.frame, moment.time_s);
    Some(Event {
        target,
        kind,
        frame,
        time_s,
        time_error_s: dt.max(by_speed.min(LEAST_S)),
        at: state.position(),
        name: None,
    })
}
