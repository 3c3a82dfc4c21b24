use super::random::Random;
use crate::{Command, Direction, Position, Status, Velocity};
use pursuit_parameters::{choices, parameters};
use std::f64::consts::{SQRT_2, TAU};

choices! {
    /// What a gimbal holds its yaw against.
    pub enum GimbalYaw {
        /// The earth: the vehicle may turn below it.
        Lock = "lock",
        /// The vehicle: it turns with that.
        Follow = "follow",
    }
}

parameters! {
    /// What the drone is like that carries a simulated head.
    #[derive(Copy)]
    pub struct DroneParams {
        /// How high it hovers.
        pub altitude_m: f64 = 20.0, in 2.0..=500.0, unit "m";
        /// How far it hovers from the place before which the target moves.
        pub distance_m: f64 = 20.0, in 0.0..=2000.0, unit "m";
        /// How fast it is blown about, root mean square.
        pub wander_m_s: f64 = 1.5, in 0.0..=30.0, unit "m/s";
        /// How far it swings in yaw, in pitch and in roll, root mean square.
        pub swing_deg: f64 = 5.0, in 0.0..=60.0, unit "deg";
        /// How long a swing takes.
        pub swing_s: f64 = 4.0, in 0.2..=60.0, unit "s";
        /// What the gimbal holds its yaw against.
        pub yaw: GimbalYaw = GimbalYaw::Lock;
        /// Which part of the swings the gimbal leaves in the picture.
        pub left_over: f64 = 0.03, in 0.0..=1.0;
        /// How much the camera vibrates, root mean square.
        pub vibration_deg: f64 = 0.05, in 0.0..=5.0, unit "deg";
        /// How quickly.
        pub vibration_hz: f64 = 15.0, in 0.1..=200.0, unit "Hz";
        /// How far the horizon rolls, root mean square.
        pub roll_deg: f64 = 1.0, in 0.0..=45.0, unit "deg";
        /// Whether the autopilot says how the vehicle is turned, so that a gimbal that turns with it can be turned back.
        pub told: bool = true;
        /// How old that is when it arrives.
        pub told_after_s: f64 = 0.05, in 0.0..=2.0, unit "s";
    }
}

/// A drone that hovers in the wind: a pure function of time once made.
#[derive(Debug, Clone)]
pub struct Drone {
    params: DroneParams,
    /// Of each motion, in turns.
    phases: [[f64; 3]; 8],
}

/// How long it takes to be blown to and fro, seconds.
const GUST_S: f64 = 9.0;
/// The periods that a motion is made of, in parts of its own: none is a multiple of another.
const PERIODS: [f64; 3] = [1.0, 0.618, 1.732];

impl Drone {
    /// The drone of this seed.
    pub fn new(params: DroneParams, seed: u64) -> Self {
        let mut random = Random::new(seed, 5);
        Self { params, phases: std::array::from_fn(|_| std::array::from_fn(|_| random.unit())) }
    }

    /// One of its motions at a time, and how fast that changes, per second: root mean square 1, and 1 for a period of a turn.
    fn wave(&self, which: usize, time_s: f64, period_s: f64) -> (f64, f64) {
        let phases = self.phases.get(which).copied().unwrap_or_default();
        let scale = SQRT_2 / (PERIODS.len() as f64).sqrt();
        let parts = PERIODS.iter().zip(phases).map(|(part, phase)| {
            let rate = TAU / (part * period_s);
            let (sine, cosine) = (rate * time_s + TAU * phase).sin_cos();
            (scale * sine, scale * rate * cosine)
        });
        parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1))
    }

    /// Where it is, metres to the right, away and up from where walkers are measured.
    pub fn place(&self, time_s: f64) -> [f64; 3] {
        // A motion of this period and speed goes so far.
        let reach = self.params.wander_m_s * GUST_S / TAU / PERIODS.map(|p| 1.0 / (p * p)).iter().sum::<f64>().sqrt()
            * 3_f64.sqrt();
        let [x, away] = [0, 1].map(|k| reach * self.wave(k, time_s, GUST_S).0);
        [x, away - self.params.distance_m, self.params.altitude_m]
    }

    /// How far the vehicle is turned to the right, degrees, and how fast.
    fn yaw(&self, time_s: f64) -> (f64, f64) {
        let (angle, rate) = self.wave(2, time_s, self.params.swing_s);
        (self.params.swing_deg * angle, self.params.swing_deg * rate)
    }

    /// How far the camera is turned from where its gimbal is, and how far the horizon rolls, degrees.
    pub fn disturbance(&self, time_s: f64) -> (Direction, f64) {
        let p = &self.params;
        let left = |which| p.left_over * p.swing_deg * self.wave(which, time_s, p.swing_s).0;
        let shake = |which| p.vibration_deg * self.wave(which, time_s, 1.0 / p.vibration_hz).0;
        let yaw = match p.yaw {
            GimbalYaw::Lock => left(2),
            GimbalYaw::Follow => self.yaw(time_s).0,
        };
        let roll_deg = p.roll_deg * self.wave(4, time_s, p.swing_s).0;
        (Direction::new(yaw + shake(5), left(3) + shake(6)), roll_deg)
    }

    /// Whether the head's own directions are those of the vehicle, and somebody knows how that is turned.
    fn turns_back(&self) -> bool {
        self.params.yaw == GimbalYaw::Follow && self.params.told
    }

    /// A command as whoever knows how the vehicle is turned hands it on to the gimbal.
    pub fn handed_on(&self, now_s: f64, command: Command) -> Command {
        if !self.turns_back() {
            return command;
        }
        let (yaw, rate) = self.yaw(now_s - self.params.told_after_s);
        match command {
            Command::Move(velocity) => Command::Move(Velocity { pan_deg_s: velocity.pan_deg_s - rate, ..velocity }),
            // Standing in the world is turning back on the vehicle.
            Command::Stop => Command::Move(Velocity { pan_deg_s: -rate, ..Velocity::ZERO }),
            Command::GoTo { direction, zoom } => {
                Command::GoTo { direction: Direction::new(direction.pan_deg - yaw, direction.tilt_deg), zoom }
            }
            other => other,
        }
    }

    /// What the gimbal says of itself, in the world.
    pub fn in_world(&self, now_s: f64, status: Option<Status>) -> Option<Status> {
        if !self.turns_back() {
            return status;
        }
        let (yaw, _) = self.yaw(now_s - self.params.told_after_s);
        status.map(|status| Status {
            position: status.position.map(|position| Position {
                direction: Direction::new(position.direction.pan_deg + yaw, position.direction.tilt_deg),
                ..position
            }),
            ..status
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
        (sum / count).sqrt()
    }

    #[test]
    fn motions_are_as_strong_as_said() {
        let params = DroneParams { yaw: GimbalYaw::Follow, ..DroneParams::default() };
        let drone = Drone::new(params, 7);
        let times = || (0..40_000).map(|k| f64::from(k) * 0.02);
        let speed = |k: usize| rms(times().map(|t| (drone.place(t + 1e-3)[k] - drone.place(t)[k]) * 1e3));
        assert!((speed(0) - 1.5).abs() < 0.1 && (speed(1) - 1.5).abs() < 0.1, "{} {}", speed(0), speed(1));
        assert_eq!(drone.place(3.0)[2], 20.0);
        assert!((rms(times().map(|t| drone.disturbance(t).1)) - 1.0).abs() < 0.1);
        assert!((rms(times().map(|t| drone.yaw(t).0)) - 5.0).abs() < 0.3);
        let slope = |t: f64| (drone.yaw(t + 1e-5).0 - drone.yaw(t - 1e-5).0) / 2e-5;
        assert!(times().take(100).all(|t| (slope(t) - drone.yaw(t).1).abs() < 1e-3));
    }

    #[test]
    fn the_same_seed_gives_the_same_drone() {
        let at = |seed| Drone::new(DroneParams::default(), seed).disturbance(3.0);
        assert_eq!(at(1), at(1));
        assert_ne!(at(1), at(2));
    }

    #[test]
    fn a_locked_gimbal_is_commanded_as_it_is() {
        let drone = Drone::new(DroneParams::default(), 1);
        assert_eq!(drone.handed_on(2.0, Command::Stop), Command::Stop);
        let follow = Drone::new(DroneParams { yaw: GimbalYaw::Follow, ..DroneParams::default() }, 1);
        let Command::Move(velocity) = follow.handed_on(2.0, Command::Stop) else { panic!("it turns back") };
        assert_eq!(velocity.pan_deg_s, -follow.yaw(1.95).1);
        let status = Some(Status { position: Some(Position::default()), moving: None });
        let said = follow.in_world(2.0, status).unwrap().position.unwrap();
        assert_eq!(said.direction.pan_deg, follow.yaw(1.95).0);
    }
}
