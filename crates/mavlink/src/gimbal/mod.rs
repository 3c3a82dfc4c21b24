//! A gimbal by the gimbal protocol v2: <https://mavlink.io/en/services/gimbal_v2.html>.

mod heard;

use crate::{Endpoint, Identity, MavlinkError, Result};
use heard::Heard;
use mavlink::dialects::common::{
    COMMAND_LONG_DATA, GIMBAL_MANAGER_INFORMATION_DATA, GIMBAL_MANAGER_SET_PITCHYAW_DATA, GimbalManagerCapFlags,
    GimbalManagerFlags, MavCmd, MavMessage, MavResult,
};
use std::sync::Arc;
use std::time::{Duration, Instant};

const MANAGER_INFORMATION: u32 = 280;
const ATTITUDE_STATUS: u32 = 285;

/// Which gimbal it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GimbalId {
    /// The system of its manager.
    pub system: u8,
    /// The component that manages it: an autopilot, or the gimbal itself.
    pub component: u8,
    /// The gimbal: its component, or 1 to 6 for one that speaks no MAVLink.
    pub device: u8,
}

impl GimbalId {
    /// Whether its manager says it.
    fn is_managed_by(self, sender: Identity) -> bool {
        (sender.system, sender.component) == (self.system, self.component)
    }

    /// Whether an attitude is its: it says so itself, or its manager for it, by number where it has several.
    fn is_told_by(self, sender: Identity, device: u8) -> bool {
        let itself = (sender.system, sender.component) == (self.system, self.device);
        itself || self.is_managed_by(sender) && [0, self.device].contains(&device)
    }
}

/// How far a gimbal turns, degrees; infinite where nothing is said. Yaw is as seen from the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GimbalLimits {
    /// Lowest and highest pitch.
    pub pitch_deg: (f64, f64),
    /// Leftmost and rightmost yaw.
    pub yaw_deg: (f64, f64),
}

/// How a gimbal is turned, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// To the right: of north where the gimbal is held against the earth, else of the vehicle's nose.
    pub yaw_deg: f64,
    /// Above the horizon.
    pub pitch_deg: f64,
    /// Clockwise as seen from behind.
    pub roll_deg: f64,
    /// Whether yaw is against north.
    pub is_of_earth: bool,
}

/// A gimbal under this component's control. It is stopped and given back when this value is dropped.
pub struct Gimbal {
    endpoint: Endpoint,
    id: GimbalId,
    limits: GimbalLimits,
    can: GimbalManagerCapFlags,
    leaves: bool,
    heard: Arc<Heard>,
}

/// Asks a gimbal how it is turned; once that is let go of it says nothing more.
#[derive(Clone)]
pub struct AttitudeWatch {
    id: GimbalId,
    heard: Arc<Heard>,
}

impl AttitudeWatch {
    /// Which gimbal it is.
    pub const fn id(&self) -> GimbalId {
        self.id
    }

    /// How it is turned, where it has said so within the last second.
    pub fn attitude(&self) -> Option<Attitude> {
        self.heard.attitude()
    }
}

impl Gimbal {
    /// How long an answer is waited for before the question is asked again, and how often it is asked.
    const ANSWER: Duration = Duration::from_millis(500);
    const ATTEMPTS: u32 = 6;
    /// How often a gimbal is to say how it is turned, microseconds.
    const ATTITUDE_US: f32 = 50_000.0;
    /// An attitude older than this is not known any more.
    const LASTS: Duration = Duration::from_millis(1000);

    /// Looks for a gimbal (of this device, where one is named), takes control of it, and asks it how it is turned 20 times a second.
    ///
    /// # Errors
    /// [`MavlinkError::NoGimbal`], [`MavlinkError::Refused`], [`MavlinkError::TimedOut`].
    pub fn find(endpoint: Endpoint, device: Option<u8>) -> Result<Self> {
        let heard = Arc::<Heard>::default();
        let (theirs, incoming, identity) = (heard.clone(), endpoint.listen(), endpoint.identity());
        let thread = std::thread::Builder::new().name("mavlink gimbal".to_owned());
        let started = thread.spawn(move || theirs.listen(identity, &incoming));
        started.map_err(|source| MavlinkError::Io { link: "MAVLink".into(), doing: "starting a thread", source })?;
        let ask = |system: u8| {
            let command = MavCmd::MAV_CMD_REQUEST_MESSAGE;
            let data =
                COMMAND_LONG_DATA { command, param1: MANAGER_INFORMATION as f32, target_system: system, ..none() };
            endpoint.send(&MavMessage::COMMAND_LONG(data));
        };
        let fits = |information: &GIMBAL_MANAGER_INFORMATION_DATA| {
            device.is_none_or(|device| information.gimbal_device_id == device)
        };
        let found = (0..Self::ATTEMPTS).find_map(|_| {
            // The own vehicle's, and any that answers.
            ask(identity.system);
            ask(0);
            heard.wait_for(Self::ANSWER, |state| state.found.iter().find(|(_, i)| fits(i)).cloned())
        });
        let Some((manager, information)) = found else {
            heard.lock().ended = true;
            return Err(MavlinkError::NoGimbal { after_s: (Self::ATTEMPTS * Self::ANSWER).as_secs_f64() });
        };
        let device = information.gimbal_device_id;
        let id = GimbalId { system: manager.system, component: manager.component, device };
        heard.lock().id = Some(id);
        let gimbal =
            Self { id, limits: limits(&information), can: information.cap_flags, leaves: false, endpoint, heard };
        gimbal.take_control()?;
        gimbal.ask_for_attitude();
        Ok(gimbal)
    }

    /// Which gimbal it is.
    pub const fn id(&self) -> GimbalId {
        self.id
    }

    /// How far it turns.
    pub const fn limits(&self) -> GimbalLimits {
        self.limits
    }

    /// Whether it holds its yaw against the earth, so that the vehicle may turn below it.
    pub fn holds_yaw(&self) -> bool {
        self.can.contains(GimbalManagerCapFlags::GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK)
    }

    /// Becomes the one in control.
    ///
    /// # Errors
    /// [`MavlinkError::Refused`], [`MavlinkError::TimedOut`].
    pub fn take_control(&self) -> Result<()> {
        let Identity { system, component } = self.endpoint.identity();
        self.configure(f32::from(system), f32::from(component), "control")
    }

    fn configure(&self, system: f32, component: f32, doing: &'static str) -> Result<()> {
        let command = MavCmd::MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE;
        let data = COMMAND_LONG_DATA { param1: system, param2: component, param3: -1.0, param4: -1.0, ..none() };
        let data = COMMAND_LONG_DATA { command, param7: f32::from(self.id.device), ..data };
        match self.command(data, doing)? {
            MavResult::MAV_RESULT_ACCEPTED => Ok(()),
            other => Err(MavlinkError::Refused { doing, reason: format!("{other:?}") }),
        }
    }

    /// Sends a command to the manager until it answers.
    fn command(&self, data: COMMAND_LONG_DATA, doing: &'static str) -> Result<MavResult> {
        for confirmation in 0..3 {
            self.heard.lock().answer = None;
            let to = COMMAND_LONG_DATA { confirmation, ..data.clone() };
            let to = COMMAND_LONG_DATA { target_system: self.id.system, target_component: self.id.component, ..to };
            self.endpoint.send(&MavMessage::COMMAND_LONG(to));
            let answered = self.heard.wait_for(Self::ANSWER, |state| {
                state.answer.filter(|(command, _)| *command == data.command).map(|(_, result)| result)
            });
            if let Some(result) = answered {
                return Ok(result);
            }
        }
        Err(MavlinkError::TimedOut { doing, after_s: (3 * Self::ANSWER).as_secs_f64() })
    }

    /// Not every gimbal can be asked: those that say it anyhow need not be.
    fn ask_for_attitude(&self) {
        let data = COMMAND_LONG_DATA { param1: ATTITUDE_STATUS as f32, param2: Self::ATTITUDE_US, ..none() };
        let data = COMMAND_LONG_DATA { command: MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, ..data };
        let device = if self.id.device > 6 { self.id.device } else { self.id.component };
        let to = COMMAND_LONG_DATA { target_system: self.id.system, target_component: device, ..data };
        self.endpoint.send(&MavMessage::COMMAND_LONG(to));
    }

    /// Who else has taken control, if somebody has. Who took it over by hand is not fought.
    pub fn taken_by(&self) -> Option<Identity> {
        let own = self.endpoint.identity();
        self.heard.lock().primary.filter(|who| *who != own)
    }

    /// How it is turned, where it has said so within the last second.
    pub fn attitude(&self) -> Option<Attitude> {
        self.heard.attitude()
    }

    /// Asks the same from elsewhere.
    pub fn watch(&self) -> AttitudeWatch {
        AttitudeWatch { id: self.id, heard: self.heard.clone() }
    }

    /// Waits until it has said how it is turned.
    ///
    /// # Errors
    /// [`MavlinkError::TimedOut`]: without that nobody can follow by it.
    pub fn wait_for_attitude(&self) -> Result<Attitude> {
        for _ in 0..Self::ATTEMPTS {
            let said = self.heard.wait_for(Self::ANSWER, |state| state.attitude.as_ref().map(drop));
            if let Some(attitude) = said.and_then(|()| self.attitude()) {
                return Ok(attitude);
            }
            self.ask_for_attitude();
        }
        Err(MavlinkError::TimedOut {
            doing: "how the gimbal is turned",
            after_s: (Self::ATTEMPTS * Self::ANSWER).as_secs_f64(),
        })
    }

    /// Lets it finish what it was told last when this value is dropped.
    pub fn leave(&mut self) {
        self.leaves = true;
    }

    /// Turns at these rates, degrees per second to the right and upward, against the earth where that is known.
    pub fn turn(&self, yaw_deg_s: f64, pitch_deg_s: f64) {
        // One that turns with the vehicle is turned back by as much.
        let with_vehicle = if self.holds_yaw() { None } else { self.stand() };
        let yaw_deg_s = yaw_deg_s - with_vehicle.map_or(0.0, |stand| stand.yaw_rate_deg_s);
        self.set(self.flags(), [f64::NAN, f64::NAN, pitch_deg_s, yaw_deg_s]);
    }

    /// Turns to these angles, degrees, in the frame of [`attitude`](Self::attitude).
    pub fn point(&self, yaw_deg: f64, pitch_deg: f64) {
        let with_vehicle = if self.holds_yaw() { None } else { self.stand() };
        let yaw_deg = with_vehicle.map_or(yaw_deg, |stand| wrapped(yaw_deg - stand.yaw_deg));
        self.set(self.flags(), [pitch_deg, yaw_deg, f64::NAN, f64::NAN]);
    }

    /// Goes to where it looks ahead and level.
    pub fn neutral(&self) {
        self.set(self.flags() | GimbalManagerFlags::GIMBAL_MANAGER_FLAGS_NEUTRAL, [f64::NAN; 4]);
    }

    fn stand(&self) -> Option<crate::vehicle::Stand> {
        self.heard.lock().vehicle.stand(Instant::now())
    }

    fn flags(&self) -> GimbalManagerFlags {
        let level =
            GimbalManagerFlags::GIMBAL_MANAGER_FLAGS_ROLL_LOCK | GimbalManagerFlags::GIMBAL_MANAGER_FLAGS_PITCH_LOCK;
        let in_earth = GimbalManagerCapFlags::GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME;
        match (self.holds_yaw(), self.can.contains(in_earth)) {
            (true, true) => {
                level
                    | GimbalManagerFlags::GIMBAL_MANAGER_FLAGS_YAW_LOCK
                    | GimbalManagerFlags::GIMBAL_MANAGER_FLAGS_YAW_IN_EARTH_FRAME
            }
            (true, false) => level | GimbalManagerFlags::GIMBAL_MANAGER_FLAGS_YAW_LOCK,
            (false, _) => level,
        }
    }

    /// Pitch, yaw and their rates, in degrees; NaN for what is not said.
    fn set(&self, flags: GimbalManagerFlags, degrees: [f64; 4]) {
        let [pitch, yaw, pitch_rate, yaw_rate] = degrees.map(|degrees| degrees.to_radians() as f32);
        self.endpoint.send(&MavMessage::GIMBAL_MANAGER_SET_PITCHYAW(GIMBAL_MANAGER_SET_PITCHYAW_DATA {
            flags,
            pitch,
            yaw,
            pitch_rate,
            yaw_rate,
            target_system: self.id.system,
            target_component: self.id.component,
            gimbal_device_id: self.id.device,
        }));
    }
}

impl Drop for Gimbal {
    fn drop(&mut self) {
        if self.taken_by().is_none() {
            if !self.leaves {
                self.turn(0.0, 0.0);
            }
            // −3 gives up control where one has it; who does not answer keeps it.
            if let Err(error) = self.configure(-3.0, -3.0, "giving back control") {
                tracing::warn!("{error}");
            }
        }
        self.heard.lock().ended = true;
    }
}

/// A command without any parameter.
fn none() -> COMMAND_LONG_DATA {
    COMMAND_LONG_DATA::default()
}

fn limits(information: &GIMBAL_MANAGER_INFORMATION_DATA) -> GimbalLimits {
    let range = |low: f32, high: f32| {
        let (low, high) = (f64::from(low).to_degrees(), f64::from(high).to_degrees());
        // Nothing said is no limit.
        if low < high { (low, high) } else { (f64::NEG_INFINITY, f64::INFINITY) }
    };
    let yaw_deg =
        if information.cap_flags.contains(GimbalManagerCapFlags::GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_INFINITE_YAW) {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            range(information.yaw_min, information.yaw_max)
        };
    GimbalLimits { pitch_deg: range(information.pitch_min, information.pitch_max), yaw_deg }
}

/// An angle brought into (−180, 180] degrees.
fn wrapped(degrees: f64) -> f64 {
    let turned = degrees.rem_euclid(360.0);
    if turned > 180.0 { turned - 360.0 } else { turned }
}
