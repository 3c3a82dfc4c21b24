use super::{Attitude, Gimbal, GimbalId, wrapped};
use crate::rotation::Rotation;
use crate::{Identity, Incoming, Vehicle};
use mavlink::dialects::common::{
    GIMBAL_DEVICE_ATTITUDE_STATUS_DATA, GIMBAL_MANAGER_INFORMATION_DATA, GimbalDeviceFlags, MavCmd, MavMessage,
    MavResult,
};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What was heard of a gimbal, by the thread that listens.
#[derive(Default)]
pub(super) struct Heard {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
pub(super) struct State {
    /// Which gimbal is listened to, once that is known.
    pub id: Option<GimbalId>,
    pub found: Vec<(Identity, GIMBAL_MANAGER_INFORMATION_DATA)>,
    pub answer: Option<(MavCmd, MavResult)>,
    pub attitude: Option<(Instant, GIMBAL_DEVICE_ATTITUDE_STATUS_DATA)>,
    /// Who is in control, where the manager has said so.
    pub primary: Option<Identity>,
    pub vehicle: Vehicle,
    pub ended: bool,
}

impl Heard {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `found` gives something.
    pub fn wait_for<T>(&self, patience: Duration, mut found: impl FnMut(&mut State) -> Option<T>) -> Option<T> {
        let until = Instant::now() + patience;
        let mut state = self.lock();
        loop {
            if let Some(what) = found(&mut state) {
                return Some(what);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    pub fn attitude(&self) -> Option<Attitude> {
        let state = self.lock();
        let now = Instant::now();
        let (at, said) = state.attitude.as_ref()?;
        if now.saturating_duration_since(*at) > Gimbal::LASTS {
            return None;
        }
        let (roll, pitch, yaw) = Rotation::of(said.q)?.euler();
        let vehicle_yaw = state.vehicle.stand(now).map(|stand| stand.yaw_deg);
        // A gimbal that knows how the vehicle is turned says so itself. Zero is what one says that does not know this newer part of the
        // message: what is cut off its end reads as zero.
        let vehicle_yaw =
            Some(f64::from(said.delta_yaw).to_degrees()).filter(|v| v.is_finite() && *v != 0.0).or(vehicle_yaw);
        let yaw_deg = yaw.to_degrees();
        let (yaw_deg, is_of_earth) = match (is_of_earth(said.flags), vehicle_yaw) {
            (true, _) => (yaw_deg, true),
            (false, Some(vehicle)) => (wrapped(yaw_deg + vehicle), true),
            (false, None) => (yaw_deg, false),
        };
        Some(Attitude { yaw_deg, pitch_deg: pitch.to_degrees(), roll_deg: roll.to_degrees(), is_of_earth })
    }

    pub fn listen(&self, identity: Identity, incoming: &Receiver<Incoming>) {
        loop {
            match incoming.recv_timeout(Duration::from_millis(100)) {
                Ok(incoming) => self.take(identity, &incoming),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if self.lock().ended {
                return;
            }
        }
    }

    fn take(&self, identity: Identity, incoming: &Incoming) {
        let now = Instant::now();
        let sender = Identity { system: incoming.system, component: incoming.component };
        let mut state = self.lock();
        state.vehicle.take(identity, incoming, now);
        let id = state.id;
        match &*incoming.message {
            MavMessage::GIMBAL_MANAGER_INFORMATION(information) => {
                state
                    .found
                    .retain(|(of, known)| *of != sender || known.gimbal_device_id != information.gimbal_device_id);
                if state.found.len() < 16 {
                    state.found.push((sender, information.clone()));
                }
            }
            MavMessage::GIMBAL_MANAGER_STATUS(status)
                if id.is_some_and(|id| id.is_managed_by(sender) && id.device == status.gimbal_device_id) =>
            {
                let (system, component) = (status.primary_control_sysid, status.primary_control_compid);
                state.primary = Some(Identity { system, component });
            }
            MavMessage::GIMBAL_DEVICE_ATTITUDE_STATUS(attitude)
                if id.is_some_and(|id| id.is_told_by(sender, attitude.gimbal_device_id)) =>
            {
                state.attitude = Some((now, attitude.clone()));
            }
            MavMessage::COMMAND_ACK(answer) if id.is_some_and(|id| id.is_managed_by(sender)) => {
                state.answer = Some((answer.command, answer.result));
            }
            _ => return,
        }
        drop(state);
        self.changed.notify_all();
    }
}

/// Whether the yaw of an attitude is against north: by the flag of its frame, else by whether it is held.
fn is_of_earth(flags: GimbalDeviceFlags) -> bool {
    if flags.contains(GimbalDeviceFlags::GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME) {
        return true;
    }
    !flags.contains(GimbalDeviceFlags::GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME)
        && flags.contains(GimbalDeviceFlags::GIMBAL_DEVICE_FLAGS_YAW_LOCK)
}
