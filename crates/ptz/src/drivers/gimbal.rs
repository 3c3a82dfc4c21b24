//! A gimbal of a drone as a head, by the gimbal protocol v2 of MAVLink.

use super::{Capabilities, Head, Travel};
use crate::{Command, Direction, Position, PtzError, Result, Status, Velocity};
use pursuit_mavlink::{Attitude, AttitudeWatch, Endpoint, Gimbal, Identity, MavlinkError};

/// Asks how the gimbal is turned in the world; it may be kept after the head is gone, and then says nothing.
pub type AttitudeOf = AttitudeWatch;

/// A gimbal that is turned by rates. Pan 0 is where it looked when it was found: north means nothing to who follows.
///
/// Where the gimbal is held against the earth, or the autopilot says how the vehicle stands, directions are those of the earth:
/// that the vehicle turns is no motion of the target.
pub struct GimbalHead {
    gimbal: Gimbal,
    name: String,
    /// The yaw at pan 0.
    ahead_deg: f64,
    /// The pan said last, which goes on past half a turn.
    pan_deg: f64,
    leaves: bool,
}

/// A head that turns without end is given so many turns, degrees.
const ENDLESS_DEG: f64 = 36_000.0;

impl GimbalHead {
    /// Looks for a gimbal on `endpoint`, of this device where one is named, and takes control of it.
    ///
    /// # Errors
    /// Where none answers, or it refuses.
    pub fn find(endpoint: Endpoint, device: Option<u8>) -> Result<Self> {
        let gimbal = Gimbal::find(endpoint, device).map_err(of_gimbal)?;
        let id = gimbal.id();
        let name = format!("gimbal {} of {}/{}", id.device, id.system, id.component);
        let attitude = gimbal.wait_for_attitude().map_err(of_gimbal)?;
        Ok(Self { gimbal, name, ahead_deg: attitude.yaw_deg, pan_deg: 0.0, leaves: false })
    }

    /// Asks how it is turned, from elsewhere.
    pub fn attitude(&self) -> AttitudeOf {
        self.gimbal.watch()
    }

    fn position(&mut self) -> Option<Position> {
        let Attitude { yaw_deg, pitch_deg, .. } = self.gimbal.attitude()?;
        // The short way from where it was, so that half a turn is no jump.
        let turn = Direction::new(yaw_deg - self.ahead_deg, 0.0).from(Direction::new(self.pan_deg, 0.0));
        self.pan_deg += turn.pan_deg;
        Some(Position { direction: Direction::new(self.pan_deg, pitch_deg), zoom: 0.0 })
    }

    fn go_to(&self, direction: Direction) {
        let yaw = Direction::new(direction.pan_deg + self.ahead_deg, 0.0).from(Direction::AHEAD);
        self.gimbal.point(yaw.pan_deg, direction.tilt_deg);
    }
}

impl Head for GimbalHead {
    fn name(&self) -> &str {
        &self.name
    }

    fn capabilities(&self) -> Capabilities {
        let limits = self.gimbal.limits();
        let bounded = |(least, most): (f64, f64)| (least.max(-ENDLESS_DEG), most.min(ENDLESS_DEG));
        // Against the earth the ends of the yaw turn with the vehicle: the gimbal keeps to them itself.
        let is_of_earth = self.gimbal.attitude().is_none_or(|attitude| attitude.is_of_earth);
        let (least, most) = if is_of_earth { (-ENDLESS_DEG, ENDLESS_DEG) } else { bounded(limits.yaw_deg) };
        let pan_deg = if is_of_earth { (least, most) } else { (least - self.ahead_deg, most - self.ahead_deg) };
        let travel = Travel { pan_deg, tilt_deg: bounded(limits.pitch_deg) };
        let can =
            Capabilities { velocity: true, absolute: true, relative: true, status: true, ..Capabilities::default() };
        Capabilities { travel: Some(travel), ..can }
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        if let Some(Identity { system, component }) = self.gimbal.taken_by() {
            // Nobody in control is no reason not to take it again; somebody is not fought.
            let refused = |reason| PtzError::Refused { head: self.name.clone(), doing: "control", reason };
            if system != 0 {
                return Err(refused(format!("{system}/{component} has taken it over")));
            }
            self.gimbal.take_control().map_err(of_gimbal)?;
        }
        match command {
            Command::Move(Velocity { pan_deg_s, tilt_deg_s, .. }) => self.gimbal.turn(*pan_deg_s, *tilt_deg_s),
            Command::Stop => self.gimbal.turn(0.0, 0.0),
            Command::GoTo { direction, .. } => self.go_to(*direction),
            Command::TurnBy { by } => {
                let Some(here) = self.position() else {
                    return Err(PtzError::Unsupported {
                        head: self.name.clone(),
                        what: "turn by an angle before it has said how it is turned",
                    });
                };
                self.go_to(here.direction.turned(*by));
            }
            Command::Home => self.gimbal.neutral(),
            Command::Preset { .. } => {
                return Err(PtzError::Unsupported {
                    head: self.name.clone(),
                    what: "go to stored positions: it has none",
                });
            }
        }
        Ok(())
    }

    fn status(&mut self) -> Result<Option<Status>> {
        Ok(self.position().map(|position| Status { position: Some(position), moving: None }))
    }

    fn leave(&mut self) {
        self.leaves = true;
    }
}

impl Drop for GimbalHead {
    fn drop(&mut self) {
        if self.leaves {
            self.gimbal.leave();
        }
    }
}

fn of_gimbal(error: MavlinkError) -> PtzError {
    PtzError::Mavlink { reason: error.to_string() }
}
