use super::World;
use super::ball::RADIUS_M;
use crate::hash;

/// Gravity in metres per square second of clip time: the clip plays at 0.6 of real time, 9.81 · 0.6².
const GRAVITY: f64 = 3.53;

/// A ball touches the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    time_s: f64,
    x: f64,
    z: f64,
    /// Whether it rolls from here to the next contact instead of flying.
    rolls: bool,
}

const fn bounce(time_s: f64, x: f64, z: f64) -> Contact {
    Contact { time_s, x, z, rolls: false }
}

const fn roll(time_s: f64, x: f64, z: f64) -> Contact {
    Contact { time_s, x, z, rolls: true }
}

/// The ball in play: bounces to the right, comes back with backspin, settles, rolls behind the hand and out of the picture,
/// and is thrown in again. Times between bounces shrink by about 0.89, as real balls' do.
const PLAYED: &[Contact] = &[
    bounce(-0.35, -0.36, 0.95),
    bounce(0.35, -0.12, 0.90),
    bounce(0.97, 0.10, 0.86),
    bounce(1.52, 0.26, 0.83),
    bounce(2.01, 0.20, 0.85),
    bounce(2.45, 0.08, 0.88),
    bounce(2.84, -0.03, 0.90),
    bounce(3.18, -0.12, 0.91),
    bounce(3.48, -0.19, 0.92),
    bounce(3.74, -0.235, 0.92),
    bounce(3.96, -0.265, 0.92),
    bounce(4.14, -0.28, 0.92),
    bounce(4.28, -0.285, 0.92),
    roll(4.38, -0.28, 0.92),
    roll(4.80, -0.20, 0.92),
    // From here on at 0.265 m/s.
    roll(7.63, 0.55, 0.92),
    bounce(7.70, 0.57, 0.92),
    bounce(8.40, 0.31, 0.89),
    bounce(9.02, 0.07, 0.86),
    bounce(9.57, -0.13, 0.84),
    bounce(10.06, -0.29, 0.83),
    bounce(10.50, -0.42, 0.82),
    bounce(10.89, -0.53, 0.81),
];

/// A ball that lies still at the left.
const RESTING: &[Contact] = &[roll(0.0, -0.42, 1.02), roll(1.0, -0.42, 1.02)];

/// A ball that rolls by from right to left, farther away, and meets the played one before it reaches the hand.
const ROLLING_BY: &[Contact] = &[roll(2.0, 0.62, 1.13), roll(8.0, -0.88, 1.15)];

/// Where a ball is, at any time.
#[derive(Debug, Clone)]
pub(super) struct Path(Vec<Contact>);

impl Path {
    pub(super) fn played(seed: u64) -> Self {
        Self::varied(PLAYED, seed, 0.010)
    }

    pub(super) fn resting(seed: u64) -> Self {
        Self::varied(RESTING, seed ^ 1, 0.0)
    }

    pub(super) fn rolling_by(seed: u64) -> Self {
        Self::varied(ROLLING_BY, seed ^ 2, 0.015)
    }

    /// Each seed plays a little differently: every contact is moved by up to `spread` metres.
    fn varied(contacts: &[Contact], seed: u64, spread: f64) -> Self {
        let jitter = |k: usize, axis: u64| hash::between(hash::mix(seed, 71 + axis), k as u64, -spread, spread);
        let moved = |(k, c): (usize, &Contact)| Contact { x: c.x + jitter(k, 0), z: c.z + jitter(k, 1), ..*c };
        Self(contacts.iter().enumerate().map(moved).collect())
    }

    /// The ball's centre. Before the first contact and after the last it goes on as between the nearest two.
    pub(super) fn at(&self, time_s: f64) -> World {
        let next = self.0.partition_point(|c| c.time_s <= time_s).clamp(1, self.0.len() - 1);
        let (from, to) = (self.0[next - 1], self.0[next]);
        let (elapsed, whole) = (time_s - from.time_s, to.time_s - from.time_s);
        let share = elapsed / whole;
        let height = if from.rolls { 0.0 } else { (GRAVITY / 2.0 * elapsed * (whole - elapsed)).max(0.0) };
        World { x: from.x + (to.x - from.x) * share, y: RADIUS_M + height, z: from.z + (to.z - from.z) * share }
    }
}
