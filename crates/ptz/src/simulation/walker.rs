use super::random::Random;
use crate::Direction;
use serde::{Deserialize, Serialize};

/// How a simulated person moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Walk {
    /// Walks along a line 5 m away at 1.5 m/s, within 4 m to each side; turns round, and now and then stands for a while.
    Pacing,
    /// Walks past along a line 5 m away at 1.5 m/s, from one side to the other.
    Passing,
    /// Stands 5 m away, 15° to one side.
    Standing,
    /// Runs at 4 m/s, 5 m to 11 m away, and changes direction abruptly.
    DogLeg,
    /// Runs across at 5 m/s, from one side to the other.
    Crossing,
    /// Runs at 4 m/s, stops within half a second, stands for a while, goes on, not always the same way.
    Stopping,
    /// Walks to and fro as [`Pacing`](Self::Pacing), and is behind something for one to three seconds now and then.
    Hiding,
}

impl Walk {
    /// Those before a camera that stands.
    pub const ALL: [Self; 4] = [Self::Pacing, Self::Passing, Self::Standing, Self::DogLeg];

    /// Those and what drones look down on.
    pub const EVERY: [Self; 7] =
        [Self::Pacing, Self::Passing, Self::Standing, Self::DogLeg, Self::Crossing, Self::Stopping, Self::Hiding];

    /// Its name, as in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pacing => "pacing",
            Self::Passing => "passing",
            Self::Standing => "standing",
            Self::DogLeg => "dog_leg",
            Self::Crossing => "crossing",
            Self::Stopping => "stopping",
            Self::Hiding => "hiding",
        }
    }
}

/// A stretch of constant acceleration over the ground: metres to the right and away from the camera.
#[derive(Debug, Clone, Copy)]
struct Leg {
    start_s: f64,
    at: [f64; 2],
    speed: [f64; 2],
    acceleration: [f64; 2],
}

impl Leg {
    fn place(&self, time_s: f64) -> [f64; 2] {
        let t = time_s - self.start_s;
        std::array::from_fn(|i| self.at[i] + self.speed[i] * t + 0.5 * self.acceleration[i] * t * t)
    }
}

/// A simulated person: a pure function of time once made.
#[derive(Debug, Clone)]
pub struct Walker {
    legs: Vec<Leg>,
    /// When it is behind something, seconds from and to.
    hidden: Vec<(f64, f64)>,
    /// The gait sways when the person may walk: metres, Hz, phases in turns.
    sway: f64,
    step_hz: f64,
    phase: f64,
}

impl Walker {
    /// How high the camera hangs, metres.
    const CAMERA_M: f64 = 2.5;
    /// A person's height and width, metres.
    const HEIGHT_M: f64 = 1.7;
    const WIDTH_M: f64 = 0.5;
    /// A walker's acceleration, m/s².
    const ACCELERATION: f64 = 2.0;
    const PACE: f64 = 1.5;
    const RUN: f64 = 4.0;

    /// The person of this seed, for `duration_s` seconds at least (an hour at most).
    pub fn new(walk: Walk, seed: u64, duration_s: f64) -> Self {
        let mut random = Random::new(seed, 2);
        let until = duration_s.clamp(0.0, 3600.0);
        let legs = match walk {
            Walk::Pacing | Walk::Hiding => pacing(&mut random, until),
            Walk::Crossing => {
                let side = if random.happens(0.5) { 1.0 } else { -1.0 };
                let start = side * random.between(50.0, 60.0);
                vec![Leg { start_s: 0.0, at: [start, 5.0], speed: [-side * 5.0, 0.0], acceleration: [0.0; 2] }]
            }
            Walk::Stopping => stopping(&mut random, until),
            Walk::Passing => {
                let side = if random.happens(0.5) { 1.0 } else { -1.0 };
                let start = side * random.between(6.0, 9.0);
                vec![Leg { start_s: 0.0, at: [start, 5.0], speed: [-side * Self::PACE, 0.0], acceleration: [0.0; 2] }]
            }
            Walk::Standing => {
                let side = if random.happens(0.5) { 1.0 } else { -1.0 };
                let at = [side * 5.0 * 15f64.to_radians().tan(), 5.0];
                vec![Leg { start_s: 0.0, at, speed: [0.0; 2], acceleration: [0.0; 2] }]
            }
            Walk::DogLeg => dog_leg(&mut random, until),
        };
        let sway = if walk == Walk::Standing { 0.0 } else { 0.02 };
        let (step_hz, phase) = (random.between(1.6, 2.0), random.unit());
        let hidden = if walk == Walk::Hiding { hiding(&mut random, until) } else { Vec::new() };
        Self { legs, hidden, sway, step_hz, phase }
    }

    /// Where a camera looks at first that has the person in view: straight at them, but straight ahead for
    /// [`Walk::Standing`], whose person stands to one side.
    pub fn first_view(&self, walk: Walk) -> Direction {
        let (direction, _, _) = self.at(0.0);
        if walk == Walk::Standing { Direction::new(0.0, direction.tilt_deg) } else { direction }
    }

    /// Where the person stands on the ground, metres to the right and away from the camera.
    fn place(&self, time_s: f64) -> [f64; 2] {
        let index = self.legs.partition_point(|leg| leg.start_s <= time_s).saturating_sub(1);
        self.legs.get(index).map_or([0.0, 5.0], |leg| leg.place(time_s))
    }

    /// When it is behind something, seconds from and to.
    pub fn hidden(&self) -> &[(f64, f64)] {
        &self.hidden
    }

    /// Whether it is behind something at a time.
    pub fn hides(&self, time_s: f64) -> bool {
        self.hidden.iter().any(|(from, to)| (*from..*to).contains(&time_s))
    }

    /// The direction of the middle of the body, and the tangents of its width and height, at `time_s`.
    pub fn at(&self, time_s: f64) -> (Direction, f64, f64) {
        self.seen_from(time_s, [0.0, 0.0, Self::CAMERA_M])
    }

    /// The same from another place, metres to the right, away and up.
    pub fn seen_from(&self, time_s: f64, [eye_x, eye_away, eye_up]: [f64; 3]) -> (Direction, f64, f64) {
        let [x, away] = self.place(time_s);
        let turn = std::f64::consts::TAU * (self.step_hz * time_s + self.phase);
        let (x, away) = (x + self.sway * (0.5 * turn).sin() - eye_x, away - eye_away);
        let up = Self::HEIGHT_M / 2.0 - eye_up + self.sway * turn.sin();
        let far = x.hypot(away);
        let direction = Direction::new(x.atan2(away).to_degrees(), up.atan2(far).to_degrees());
        let distance = far.hypot(up);
        (direction, Self::WIDTH_M / distance, Self::HEIGHT_M / distance)
    }
}

/// Runs, stops, stands, and goes on, three times out of four the same way.
fn stopping(random: &mut Random, until_s: f64) -> Vec<Leg> {
    const RAMP_S: f64 = 0.5;
    let mut legs = Vec::new();
    let (mut now, mut x) = (0.0, random.between(-15.0, 15.0));
    let mut way = if x > 0.0 { -1.0 } else { 1.0 };
    while now <= until_s {
        let mut leg = |lasts: f64, speed: f64, acceleration: f64| {
            legs.push(Leg { start_s: now, at: [x, 5.0], speed: [speed, 0.0], acceleration: [acceleration, 0.0] });
            (now, x) = (now + lasts, x + lasts * (speed + 0.5 * acceleration * lasts));
        };
        let speed = way * Walker::RUN;
        leg(random.between(1.0, 3.0), 0.0, 0.0);
        leg(RAMP_S, 0.0, speed / RAMP_S);
        leg(random.between(2.0, 5.0), speed, 0.0);
        leg(RAMP_S, speed, -speed / RAMP_S);
        way *= if random.happens(0.25) || x.abs() > 30.0 && x * way > 0.0 { -1.0 } else { 1.0 };
    }
    legs
}

/// When it is behind something: for one to three seconds, with four to eight between.
fn hiding(random: &mut Random, until_s: f64) -> Vec<(f64, f64)> {
    let mut times = Vec::new();
    let mut now = random.between(4.0, 8.0);
    while now <= until_s {
        let lasts = random.between(1.0, 3.0);
        times.push((now, now + lasts));
        now += lasts + random.between(4.0, 8.0);
    }
    times
}

/// Walks to and fro: legs of speed, joined by ramps.
fn pacing(random: &mut Random, until_s: f64) -> Vec<Leg> {
    const REACH_M: f64 = 4.0;
    let mut legs = Vec::new();
    let (mut now, mut x, mut speed) = (0.0, random.between(-2.0, 2.0), 0.0);
    while now <= until_s {
        let stands = speed != 0.0 && random.happens(0.3);
        let side = match x {
            x if x > REACH_M - 2.0 => -1.0,
            x if x < 2.0 - REACH_M => 1.0,
            _ if random.happens(0.5) => 1.0,
            _ => -1.0,
        };
        let goal = if stands { 0.0 } else { side * Walker::PACE };
        let change: f64 = goal - speed;
        if change != 0.0 {
            let acceleration = change.signum() * Walker::ACCELERATION;
            legs.push(Leg { start_s: now, at: [x, 5.0], speed: [speed, 0.0], acceleration: [acceleration, 0.0] });
            let ramp = change.abs() / Walker::ACCELERATION;
            x += ramp * 0.5 * (speed + goal);
            now += ramp;
        }
        legs.push(Leg { start_s: now, at: [x, 5.0], speed: [goal, 0.0], acceleration: [0.0; 2] });
        let longest = if stands { 3.0 } else { ((REACH_M - side * x) / Walker::PACE).clamp(0.3, 4.0) };
        let lasts = random.between(0.3_f64.max(longest * 0.4), longest.max(0.31));
        x += goal * lasts;
        now += lasts;
        speed = goal;
    }
    legs
}

/// Runs, and turns abruptly by 60° to 150°, within a field.
fn dog_leg(random: &mut Random, until_s: f64) -> Vec<Leg> {
    let mut legs = Vec::new();
    let (mut now, mut at) = (0.0, [random.between(-2.0, 2.0), random.between(6.0, 9.0)]);
    let mut heading = random.between(0.0, std::f64::consts::TAU);
    while now <= until_s {
        let lasts = random.between(0.8, 1.3);
        let ends = |heading: f64| {
            let (sine, cosine) = heading.sin_cos();
            [at[0] + Walker::RUN * lasts * cosine, at[1] + Walker::RUN * lasts * sine]
        };
        let inside = |[x, away]: [f64; 2]| x.abs() <= 5.0 && (5.0..=11.0).contains(&away);
        let turns: Vec<f64> = (0..64)
            .map(|_| {
                let turn = random.between(60f64.to_radians(), 150f64.to_radians());
                if random.happens(0.5) { heading + turn } else { heading - turn }
            })
            .collect();
        // Where no turn leads to a place inside of the field: towards its middle.
        let back = (8.0 - at[1]).atan2(-at[0]);
        heading = turns.into_iter().find(|turned| inside(ends(*turned))).unwrap_or(back);
        let (sine, cosine) = heading.sin_cos();
        let speed = [Walker::RUN * cosine, Walker::RUN * sine];
        legs.push(Leg { start_s: now, at, speed, acceleration: [0.0; 2] });
        at = ends(heading);
        now += lasts;
    }
    legs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest change of place and of speed between samples 5 ms apart.
    fn smoothness(walker: &Walker) -> (f64, f64) {
        let places: Vec<[f64; 2]> = (0..12_000).map(|k| walker.place(f64::from(k) * 0.005)).collect();
        let speed = |w: &[[f64; 2]]| [(w[1][0] - w[0][0]) / 0.005, (w[1][1] - w[0][1]) / 0.005];
        let speeds: Vec<[f64; 2]> = places.windows(2).map(speed).collect();
        let fastest = speeds.iter().map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
        let jerk = speeds.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).fold(0.0, f64::max);
        (fastest, jerk)
    }

    #[test]
    fn a_pacer_keeps_to_the_line_the_speed_and_the_acceleration() {
        for seed in 0..50 {
            let walker = Walker::new(Walk::Pacing, seed, 60.0);
            let (fastest, jerk) = smoothness(&walker);
            assert!((fastest - 1.5).abs() < 1e-6 && jerk < 0.0101, "{seed}: {fastest} {jerk}");
            let widest = (0..600).map(|k| walker.place(f64::from(k) * 0.1)[0].abs()).fold(0.0, f64::max);
            assert!(widest < 5.5 && widest > 1.0, "{seed}: {widest}");
            let stood =
                (0..600).filter(|k| walker.place(f64::from(*k) * 0.1) == walker.place(f64::from(*k) * 0.1 + 0.05));
            assert!(stood.count() < 400);
        }
    }

    #[test]
    fn a_runner_who_crosses_passes_the_camera() {
        for seed in 0..20 {
            let walker = Walker::new(Walk::Crossing, seed, 30.0);
            let (start, end) = (walker.place(0.0)[0], walker.place(30.0)[0]);
            assert!(start * end < 0.0 && (smoothness(&walker).0 - 5.0).abs() < 1e-6, "{seed}: {start} {end}");
        }
    }

    #[test]
    fn a_runner_who_stops_stands_and_goes_on() {
        for seed in 0..20 {
            let walker = Walker::new(Walk::Stopping, seed, 60.0);
            let (fastest, jerk) = smoothness(&walker);
            assert!((fastest - 4.0).abs() < 1e-6 && jerk < 0.0401, "{seed}: {fastest} {jerk}");
            let stands = |k: &i32| walker.place(f64::from(*k) * 0.1) == walker.place(f64::from(*k) * 0.1 + 0.05);
            assert!((100..400).contains(&(0..600).filter(stands).count()), "{seed}");
        }
    }

    #[test]
    fn who_hides_is_gone_for_seconds_and_comes_back() {
        for seed in 0..20 {
            let walker = Walker::new(Walk::Hiding, seed, 60.0);
            let (mut last, hidden) = (0.0, walker.hidden());
            assert!(hidden.len() >= 5 && !walker.hides(0.0));
            for (from, to) in hidden {
                assert!((1.0..3.0).contains(&(to - from)) && from - last >= 4.0, "{seed}");
                assert!(walker.hides(*from) && !walker.hides(*to));
                last = *to;
            }
            assert!(Walker::new(Walk::Pacing, seed, 60.0).hidden().is_empty());
        }
    }

    #[test]
    fn a_runner_turns_at_once_and_stays_in_the_field() {
        for seed in 0..50 {
            let walker = Walker::new(Walk::DogLeg, seed, 60.0);
            let (fastest, jerk) = smoothness(&walker);
            assert!((fastest - 4.0).abs() < 1e-6 && jerk > 1.0, "{seed}: {fastest} {jerk}");
            assert!((0..600).all(|k| (2.9..13.0).contains(&walker.place(f64::from(k) * 0.1)[1])), "{seed}");
        }
    }

    #[test]
    fn directions_and_sizes_are_those_of_a_person_below_the_camera() {
        let walker = Walker::new(Walk::Standing, 1, 10.0);
        let (direction, width, height) = walker.at(3.0);
        assert!((direction.pan_deg.abs() - 15.0).abs() < 1e-9 && direction.tilt_deg < -15.0);
        assert!(width < height && (height / width - 3.4).abs() < 1e-9 && (0.3..0.34).contains(&height));
        assert_eq!(walker.at(9.0), walker.at(3.0));
        let (start, end) =
            (Walker::new(Walk::Passing, 4, 10.0).at(0.0).0, Walker::new(Walk::Passing, 4, 10.0).at(10.0).0);
        assert!(start.pan_deg.signum() != end.pan_deg.signum() && start.pan_deg.abs() > 45.0);
    }
}
