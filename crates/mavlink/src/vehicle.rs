use crate::rotation::Rotation;
use crate::{Identity, Incoming};
use mavlink::dialects::common::MavMessage;
use std::time::{Duration, Instant};

/// What the autopilot of a vehicle says of attitude and position.
#[derive(Debug, Clone, Default)]
pub struct Vehicle {
    attitude: Option<(Instant, Stand)>,
    position: Option<(Instant, Position)>,
}

/// How a vehicle stands and turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stand {
    pub rotation: Rotation,
    pub yaw_deg: f64,
    pub yaw_rate_deg_s: f64,
}

/// Where a vehicle is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees.
    pub longitude_deg: f64,
    /// Above the sea, metres.
    pub altitude_m: f64,
    /// Above the place where it started, metres.
    pub above_ground_m: f64,
}

impl Vehicle {
    /// What is older than this is not known any more.
    const LASTS: Duration = Duration::from_secs(2);
    /// The component of an autopilot.
    const AUTOPILOT: u8 = 1;

    /// Takes a message; only the autopilot of `identity`'s own vehicle is believed.
    pub fn take(&mut self, identity: Identity, incoming: &Incoming, now: Instant) {
        if (incoming.system, incoming.component) != (identity.system, Self::AUTOPILOT) {
            return;
        }
        match &*incoming.message {
            MavMessage::ATTITUDE(a) => {
                let angles = [a.roll, a.pitch, a.yaw, a.yawspeed].map(f64::from);
                if angles.iter().all(|angle| angle.is_finite()) {
                    let [roll, pitch, yaw, rate] = angles;
                    let rotation = Rotation::from_euler(roll, pitch, yaw);
                    let stand = Stand { rotation, yaw_deg: yaw.to_degrees(), yaw_rate_deg_s: rate.to_degrees() };
                    self.attitude = Some((now, stand));
                }
            }
            MavMessage::GLOBAL_POSITION_INT(p) => {
                let position = Position {
                    latitude_deg: f64::from(p.lat) * 1e-7,
                    longitude_deg: f64::from(p.lon) * 1e-7,
                    altitude_m: f64::from(p.alt) * 1e-3,
                    above_ground_m: f64::from(p.relative_alt) * 1e-3,
                };
                // An autopilot without a position says zero.
                self.position = ((p.lat, p.lon) != (0, 0)).then_some((now, position));
            }
            _ => {}
        }
    }

    pub(crate) fn stand(&self, now: Instant) -> Option<Stand> {
        fresh(self.attitude, now)
    }

    /// Where it is, where that was said within the last two seconds.
    pub fn position(&self, now: Instant) -> Option<Position> {
        fresh(self.position, now)
    }
}

fn fresh<T>(said: Option<(Instant, T)>, now: Instant) -> Option<T> {
    said.filter(|(at, _)| now.saturating_duration_since(*at) < Vehicle::LASTS).map(|(_, what)| what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::common::{ATTITUDE_DATA, GLOBAL_POSITION_INT_DATA};
    use std::sync::Arc;

    fn said(component: u8, message: MavMessage) -> Incoming {
        Incoming { system: 1, component, message: Arc::new(message) }
    }

    #[test]
    fn the_own_autopilot_is_believed_for_two_seconds() {
        let (mut vehicle, now) = (Vehicle::default(), Instant::now());
        let attitude = |yaw: f32| MavMessage::ATTITUDE(ATTITUDE_DATA { yaw, yawspeed: 0.1, ..Default::default() });
        vehicle.take(Identity::default(), &said(2, attitude(1.0)), now);
        assert_eq!(vehicle.stand(now), None, "it is no autopilot");
        vehicle.take(Identity::default(), &said(1, attitude(f32::NAN)), now);
        assert_eq!(vehicle.stand(now), None);
        vehicle.take(Identity::default(), &said(1, attitude(1.0)), now);
        let stand = vehicle.stand(now).unwrap();
        assert!((stand.yaw_deg - 57.29578).abs() < 1e-3 && (stand.yaw_rate_deg_s - 5.729578).abs() < 1e-3);
        assert_eq!(vehicle.stand(now + Vehicle::LASTS), None);
        let place =
            GLOBAL_POSITION_INT_DATA { lat: 480_000_000, lon: 110_000_000, relative_alt: 50_000, ..Default::default() };
        vehicle.take(Identity::default(), &said(1, MavMessage::GLOBAL_POSITION_INT(place)), now);
        assert_eq!(vehicle.position(now).map(|p| (p.latitude_deg, p.above_ground_m)), Some((48.0, 50.0)));
        vehicle.take(Identity::default(), &said(1, MavMessage::GLOBAL_POSITION_INT(Default::default())), now);
        assert_eq!(vehicle.position(now), None, "it has lost its position");
    }
}
