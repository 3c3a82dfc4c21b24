use super::random::Random;
use super::wave::Wave;
use crate::{Command, Direction, Position, Status, Velocity};
use pursuit_parameters::{choices, parameters};

choices! {
    /// What a gimbal holds its yaw against.
    pub enum GimbalYaw {
        /// The earth: the vehicle may turn below it.
        Lock = "lock",
        /// The vehicle: it turns with that.
        Follow = "follow",
    }
}

choices! {
    /// How a drone flies, beside what the wind does to it.
    pub enum Flight {
        /// It stays where it is.
        Hover = "hover",
        /// It flies past to the right, in a straight line: after 15 s it is where it would hover.
        Transit = "transit",
        /// It flies round the place before which the target moves, and turns so that it always faces that.
        Orbit = "orbit",
    }
}

parameters! {
    /// What the drone is like that carries a simulated head.
    #[derive(Copy)]
    pub struct DroneParams {
        /// How it flies.
        pub flight: Flight = Flight::Hover;
        /// Of `transit` and `orbit`: how fast.
        pub flight_m_s: f64 = 5.0, in 0.0..=50.0, unit "m/s";
        /// How high it flies.
        pub altitude_m: f64 = 20.0, in 2.0..=500.0, unit "m";
        /// How far it is from the place before which the target moves.
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
        /// How far that is off, root mean square.
        pub told_off_deg: f64 = 0.3, in 0.0..=30.0, unit "deg";
    }
}

/// A drone in the wind: a pure function of time once made.
#[derive(Debug, Clone)]
pub struct Drone {
    params: DroneParams,
    /// To the right and away.
    gusts: [Wave; 2],
    yaw: Wave,
    pitch: Wave,
    roll: Wave,
    /// Of pan and of tilt.
    vibration: [Wave; 2],
    /// By how much its autopilot is wrong about its yaw.
    error: Wave,
}

/// How long it takes to be blown to and fro, seconds.
const GUST_S: f64 = 9.0;
/// How long the autopilot's error takes to come and go, seconds.
const ERROR_S: f64 = 1.0;
/// When a drone that flies past is before the place, seconds.
const PAST_S: f64 = 15.0;

impl Drone {
    /// The drone of this seed.
    pub fn new(params: DroneParams, seed: u64) -> Self {
        let mut random = Random::new(seed, 5);
        let mut wave = |period_s| Wave::new(&mut random, period_s);
        let (gusts, shake_s) = ([wave(GUST_S), wave(GUST_S)], 1.0 / params.vibration_hz);
        let (yaw, pitch, roll) = (wave(params.swing_s), wave(params.swing_s), wave(params.swing_s));
        let (vibration, error) = ([wave(shake_s), wave(shake_s)], wave(ERROR_S));
        Self { params, gusts, yaw, pitch, roll, vibration, error }
    }

    /// Where it is, metres to the right, away and up from where walkers are measured.
    pub fn place(&self, time_s: f64) -> [f64; 3] {
        let DroneParams { flight_m_s, altitude_m, distance_m, wander_m_s, .. } = self.params;
        let [x, away] = match self.params.flight {
            Flight::Hover => [0.0, -distance_m],
            Flight::Transit => [flight_m_s * (time_s - PAST_S), -distance_m],
            Flight::Orbit => {
                let (sine, cosine) = (self.orbiting_rad_s() * time_s).sin_cos();
                [-distance_m * sine, -distance_m * cosine]
            }
        };
        let [to_the_right, further] = self.gusts.each_ref().map(|gust| wander_m_s / gust.speed() * gust.at(time_s).0);
        [x + to_the_right, away + further, altitude_m]
    }

    /// How fast it flies round. No vehicle flies round itself: it keeps a metre from the middle in this.
    fn orbiting_rad_s(&self) -> f64 {
        match self.params.flight {
            Flight::Orbit => self.params.flight_m_s / self.params.distance_m.max(1.0),
            Flight::Hover | Flight::Transit => 0.0,
        }
    }

    /// How far the vehicle is turned to the right from where it faced at first, degrees, and how fast.
    fn yaw(&self, time_s: f64) -> (f64, f64) {
        let (angle, rate) = self.yaw.at(time_s);
        let orbiting = self.orbiting_rad_s().to_degrees();
        (self.params.swing_deg * angle + orbiting * time_s, self.params.swing_deg * rate + orbiting)
    }

    /// The same as the autopilot says it at a time: a while ago, and not quite so.
    fn told_yaw(&self, now_s: f64) -> (f64, f64) {
        let then_s = now_s - self.params.told_after_s;
        let ((angle, rate), (off, off_rate)) = (self.yaw(then_s), self.error.at(then_s));
        (angle + self.params.told_off_deg * off, rate + self.params.told_off_deg * off_rate)
    }

    /// How far the camera is turned from where its gimbal is, and how far the horizon rolls, degrees.
    pub fn disturbance(&self, time_s: f64) -> (Direction, f64) {
        let p = &self.params;
        let left = |swing: &Wave| p.left_over * p.swing_deg * swing.at(time_s).0;
        let [shake_pan, shake_tilt] = self.vibration.each_ref().map(|shake| p.vibration_deg * shake.at(time_s).0);
        let yaw = match p.yaw {
            GimbalYaw::Lock => left(&self.yaw),
            GimbalYaw::Follow => self.yaw(time_s).0,
        };
        let roll_deg = p.roll_deg * self.roll.at(time_s).0;
        (Direction::new(yaw + shake_pan, left(&self.pitch) + shake_tilt), roll_deg)
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
        let (yaw, rate) = self.told_yaw(now_s);
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
        let (yaw, _) = self.told_yaw(now_s);
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

    fn calm(flight: Flight) -> DroneParams {
        DroneParams { flight, wander_m_s: 0.0, swing_deg: 0.0, ..DroneParams::default() }
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
        assert!((rms(times().map(|t| drone.disturbance(t).0.pan_deg)) - 5.0).abs() < 0.3);
        let tilt = rms(times().map(|t| drone.disturbance(t).0.tilt_deg));
        assert!((tilt - 0.15_f64.hypot(0.05)).abs() < 0.02, "{tilt}");
    }

    #[test]
    fn the_same_seed_gives_the_same_drone() {
        let at = |seed| {
            let drone = Drone::new(DroneParams::default(), seed);
            (drone.place(3.0), drone.disturbance(3.0))
        };
        assert_eq!(at(1), at(1));
        assert_ne!(at(1), at(2));
    }

    #[test]
    fn a_transit_passes_before_the_place() {
        let at = |time_s| Drone::new(calm(Flight::Transit), 1).place(time_s);
        assert_eq!((at(15.0), at(17.0)), ([0.0, -20.0, 20.0], [10.0, -20.0, 20.0]));
    }

    #[test]
    fn an_orbit_keeps_its_distance_and_faces_inward() {
        let drone = Drone::new(calm(Flight::Orbit), 1);
        for time_s in [0.0, 3.0, 11.0, 29.0] {
            let ([x, away, _], (yaw, rate)) = (drone.place(time_s), drone.yaw(time_s));
            assert!((x.hypot(away) - 20.0).abs() < 1e-9);
            let inward = Direction::new((-x).atan2(-away).to_degrees(), 0.0);
            assert!(inward.from(Direction::new(yaw, 0.0)).pan_deg.abs() < 1e-9);
            assert!((rate.to_radians() * 20.0 - 5.0).abs() < 1e-9);
        }
        let above = Drone::new(DroneParams { distance_m: 0.0, ..calm(Flight::Orbit) }, 1);
        assert!(above.place(9.0).iter().all(|v| v.is_finite()) && above.yaw(9.0).0.is_finite());
    }

    #[test]
    fn a_locked_gimbal_is_commanded_as_it_is() {
        let drone = Drone::new(DroneParams::default(), 1);
        assert_eq!(drone.handed_on(2.0, Command::Stop), Command::Stop);
        assert_eq!(drone.in_world(2.0, None), None);
    }

    #[test]
    fn a_gimbal_that_turns_along_is_turned_back() {
        let exact = DroneParams { yaw: GimbalYaw::Follow, told_off_deg: 0.0, ..DroneParams::default() };
        let follow = Drone::new(exact, 1);
        let turned = |drone: &Drone| match drone.handed_on(2.0, Command::Stop) {
            Command::Move(velocity) => velocity.pan_deg_s,
            other => panic!("{other:?}"),
        };
        assert_eq!(turned(&follow), -follow.yaw(1.95).1);
        let status = Some(Status { position: Some(Position::default()), moving: None });
        let said = |drone: &Drone| drone.in_world(2.0, status).unwrap().position.unwrap().direction.pan_deg;
        assert_eq!(said(&follow), follow.yaw(1.95).0);
        let wrong = Drone::new(DroneParams { told_off_deg: 0.3, ..exact }, 1);
        let (off, rate) = (said(&wrong) - said(&follow), turned(&follow) - turned(&wrong));
        assert!(off != 0.0 && off.abs() < 1.5 && rate != 0.0 && rate.abs() < 10.0, "{off} {rate}");
        let untold = Drone::new(DroneParams { told: false, ..exact }, 1);
        assert_eq!(untold.handed_on(2.0, Command::Stop), Command::Stop);
    }
}
