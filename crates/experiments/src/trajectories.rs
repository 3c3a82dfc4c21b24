//! The paths that the papers' targets take, as functions of time and of random numbers given.

use super::random::Random;
use nalgebra::{Rotation2, SVector, Vector2};

/// A path on one axis at unit steps, as in `gao2007`.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    /// Positions, one a frame.
    pub positions: Vec<SVector<f64, 1>>,
    /// Velocity at frame 0.
    pub velocity: f64,
}

impl Path {
    fn new(frames: usize, velocity: f64, at: impl Fn(f64) -> f64) -> Self {
        Self { positions: (0..frames).map(|k| SVector::<f64, 1>::new(at(k as f64))).collect(), velocity }
    }

    /// Straight on at `before`; from frame `turn_at` on at `after`.
    pub fn turn(frames: usize, before: f64, after: f64, turn_at: usize) -> Self {
        let turn = turn_at as f64;
        Self::new(frames, before, |t| if t <= turn { before * t } else { before * turn + after * (t - turn) })
    }

    /// One axis of a circle: `r cos(2π k / period + phase)`. Its first velocity is that of the first step.
    pub fn circle(frames: usize, radius: f64, period: f64, phase: f64) -> Self {
        let at = |t: f64| radius * (std::f64::consts::TAU * t / period + phase).cos();
        Self::new(frames, at(1.0) - at(0.0), at)
    }

    /// Measurements with noise of deviation `sigma`.
    pub fn measured(&self, sigma: f64, random: &mut Random) -> Vec<SVector<f64, 1>> {
        noisy(&self.positions, sigma, random)
    }
}

/// `path` with independent normal noise of deviation `sigma` on each axis.
pub(crate) fn noisy<const M: usize>(path: &[SVector<f64, M>], sigma: f64, random: &mut Random) -> Vec<SVector<f64, M>> {
    path.iter().map(|p| p + SVector::from_fn(|_, _| sigma * random.normal())).collect()
}

/// A path in the plane at unit steps whose velocity turns at unknown instants, as `zhu2014` has in mind.
#[derive(Debug, Clone)]
pub(crate) struct TurningPath {
    /// Positions, one a frame.
    pub positions: Vec<Vector2<f64>>,
    /// Velocity at frame 0, px a frame.
    pub velocity: Vector2<f64>,
    /// First frame after each turn: a turn lies within the step that ends there.
    pub turn_frames: Vec<usize>,
}

/// What a [`TurningPath`] is made from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turns {
    /// Frames.
    pub frames: usize,
    /// Speed, px a frame.
    pub speed: f64,
    /// Number of turns.
    pub count: usize,
    /// Angle of each, in degrees, to the left or to the right.
    pub degrees: f64,
    /// No turn in as many frames at either end.
    pub margin: f64,
    /// At least so many frames between turns.
    pub apart: f64,
}

impl TurningPath {
    /// A path with turns at instants uniform in time, as far apart as asked for.
    pub fn new(turns: &Turns, random: &mut Random) -> Self {
        let instants = instants(turns, random);
        let heading = random.uniform(0.0, std::f64::consts::TAU);
        let start = Rotation2::new(heading) * Vector2::new(turns.speed, 0.0);
        let (mut at, mut velocity) = (Vector2::zeros(), start);
        let mut positions = vec![at];
        for frame in 1..turns.frames {
            let (mut now, end) = (frame as f64 - 1.0, frame as f64);
            for &instant in instants.iter().filter(|t| end - 1.0 < **t && **t <= end) {
                at += velocity * (instant - now);
                velocity = Rotation2::new(turns.degrees.to_radians() * random.sign()) * velocity;
                now = instant;
            }
            at += velocity * (end - now);
            positions.push(at);
        }
        let turn_frames = instants.iter().map(|t| t.ceil() as usize).collect();
        Self { positions, velocity: start, turn_frames }
    }

    /// Whether `frame` is among the `count` that follow the end of a turn's own step.
    pub fn follows_turn(&self, frame: usize, count: usize) -> bool {
        self.turn_frames.iter().any(|turn| (turn + 1..=turn + count).contains(&frame))
    }
}

/// Sorted instants, drawn again until they are far enough apart.
fn instants(turns: &Turns, random: &mut Random) -> Vec<f64> {
    let last = turns.frames as f64 - 1.0 - turns.margin;
    loop {
        let mut instants: Vec<f64> = (0..turns.count).map(|_| random.uniform(turns.margin, last)).collect();
        instants.sort_by(f64::total_cmp);
        if instants.windows(2).all(|pair| pair[1] - pair[0] > turns.apart) {
            return instants;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_and_circles_are_those_of_the_fixtures() {
        // Last positions and first velocities of the independent fixtures of gao2007.
        let turn = Path::turn(100, 2.25, -1.65, 50);
        assert!((turn.positions[99][0] - 31.65).abs() < 1e-12);
        let circle = Path::circle(100, 50.0, 100.0, 0.3);
        assert!((circle.positions[0][0] - 47.766_824_46).abs() < 1e-8);
        assert!((circle.positions[99][0] - 48.600_360_9).abs() < 1e-7);
        assert!((circle.velocity + 1.022_050_282_155_092_5).abs() < 1e-12);
    }

    #[test]
    fn turning_paths_keep_speed_and_schedule() {
        let turns = Turns { frames: 60, speed: 10.0, count: 3, degrees: 90.0, margin: 5.0, apart: 7.0 };
        for seed in 0..20 {
            let path = TurningPath::new(&turns, &mut Random::new(0, seed));
            assert_eq!((path.positions.len(), path.turn_frames.len()), (60, 3));
            for frame in 1..60 {
                let step = (path.positions[frame] - path.positions[frame - 1]).norm();
                let turns_here = path.turn_frames.contains(&frame);
                assert!(if turns_here { step <= 10.0 + 1e-9 } else { (step - 10.0).abs() < 1e-9 }, "{frame}: {step}");
            }
            assert!((path.positions[1] - path.velocity).norm() < 1e-9);
            let turn = path.turn_frames[0];
            assert!(!path.follows_turn(turn, 5) && path.follows_turn(turn + 5, 5) && !path.follows_turn(turn + 6, 5));
        }
    }
}
