//! Trajectories of a ball without pictures, for the experiment of paper key `ball`.
//!
//! The paper names the motions but not their speeds. Those of [`BallParams::reference`] were chosen so that the paper's
//! filter (Q = diag(.01, .01, 5, 5, .01, .01), R = 0.1 I, dt = 1/30 s) shows the root mean square errors and overlaps of
//! the independent reference computation, frames before [`BallParams::settled_after`] left out: a filter that starts at
//! rest needs some ten frames to learn a velocity. Their test repeats the comparison.

use crate::hash;
use pursuit_geometry::{BBox, Point};

/// How the ball moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BallMotion {
    /// Straight on at constant speed.
    Linear,
    /// Rolling to rest on a table whose walls throw it back.
    Rolling,
    /// Bouncing on the floor.
    Bouncing,
}

impl BallMotion {
    /// All motions, in the order in which they are reported.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Rolling, Self::Bouncing];

    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rolling => "rolling+walls",
            Self::Bouncing => "bouncing",
        }
    }
}

/// The world in which the ball moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallParams {
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub fps: f64,
    /// First frame that counts in errors: the filter has settled by then.
    pub settled_after: usize,
    /// The ball's diameter in pixels.
    pub diameter_px: f64,
    /// Variance of the measurement noise of each of x, y, w, h, in square pixels (the paper's R).
    pub measurement_variance: f64,
    /// Speed of linear motion, in pixels per second; the direction is random.
    pub linear_speed_px_s: f64,
    /// First speed of rolling, in pixels per second; the direction is random.
    pub rolling_speed_px_s: f64,
    /// Rolling friction: speed falls as exp(-friction · t), in 1/s.
    pub rolling_friction: f64,
    /// The table's width and height between the points where the ball's centre turns, in pixels.
    pub table_px: (f64, f64),
    /// Gravity, in pixels per square second.
    pub gravity_px_s2: f64,
    /// Height from which the bouncing ball falls, in pixels.
    pub drop_px: f64,
    /// Speed after a bounce over speed before it.
    pub restitution: f64,
    /// Sideways speed of bouncing, in pixels per second.
    pub sideways_px_s: f64,
}

impl BallParams {
    /// PAPERS "Seed 000": 90 frames at 30 fps, a 40 px ball, noise of variance 0.1, g = 3000 px/s². Speeds, friction,
    /// height and restitution are ours (see the module's text).
    pub const fn reference() -> Self {
        Self {
            frames: 90,
            fps: 30.0,
            settled_after: 10,
            diameter_px: 40.0,
            measurement_variance: 0.1,
            linear_speed_px_s: 270.0,
            rolling_speed_px_s: 270.0,
            rolling_friction: 1.0,
            table_px: (600.0, 440.0),
            gravity_px_s2: 3000.0,
            drop_px: 220.0,
            restitution: 0.87,
            sideways_px_s: 100.0,
        }
    }
}

/// A ball's true and measured boxes, frame by frame.
#[derive(Debug, Clone, PartialEq)]
pub struct BallTrack {
    /// Time of each frame, in seconds.
    pub time_s: Vec<f64>,
    /// Where the ball is.
    pub truth: Vec<BBox>,
    /// Where it was measured: centre, width and height each with normal noise.
    pub measured: Vec<BBox>,
}

/// Simulates one ball; a pure function of its arguments.
pub fn ball_track(motion: BallMotion, params: &BallParams, seed: u64) -> BallTrack {
    let key = hash::mix(seed, motion as u64);
    let time_s: Vec<f64> = (0..params.frames).map(|k| k as f64 / params.fps).collect();
    let side = params.diameter_px;
    let truth: Vec<BBox> =
        time_s.iter().map(|&t| BBox::from_center_size(center(motion, params, key, t), side, side)).collect();
    let deviation = params.measurement_variance.max(0.0).sqrt();
    let noisy = |(k, b): (usize, &BBox)| {
        let noise = |axis: u64| deviation * hash::normal(hash::mix(key, 0x401e), 4 * k as u64 + axis);
        let at = Point::new(b.center().x + noise(0), b.center().y + noise(1));
        BBox::from_center_size(at, b.width() + noise(2), b.height() + noise(3))
    };
    let measured = truth.iter().enumerate().map(noisy).collect();
    BallTrack { time_s, truth, measured }
}

fn center(motion: BallMotion, params: &BallParams, key: u64, t: f64) -> Point {
    let direction = hash::between(key, 1, 0.0, std::f64::consts::TAU);
    let (width, height) = params.table_px;
    let start = Point::new(hash::between(key, 2, 0.0, width), hash::between(key, 3, 0.0, height));
    let along = |distance: f64| Point::new(start.x + distance * direction.cos(), start.y + distance * direction.sin());
    match motion {
        BallMotion::Linear => along(params.linear_speed_px_s * t),
        BallMotion::Rolling => {
            let friction = params.rolling_friction;
            let path = if friction > 0.0 { -(-friction * t).exp_m1() / friction } else { t };
            let free = along(params.rolling_speed_px_s * path);
            Point::new(folded(free.x, width), folded(free.y, height))
        }
        BallMotion::Bouncing => Point::new(start.x + params.sideways_px_s * t, height - bounce_height(params, t)),
    }
}

/// Where a point that would be at `x` is when walls at 0 and `length` throw it back.
fn folded(x: f64, length: f64) -> f64 {
    let around = x.rem_euclid(2.0 * length);
    if around > length { 2.0 * length - around } else { around }
}

/// Height above the floor, `t` seconds after the ball was let go.
fn bounce_height(params: &BallParams, t: f64) -> f64 {
    let gravity = params.gravity_px_s2;
    let falls = (2.0 * params.drop_px / gravity).sqrt();
    if t < falls {
        return params.drop_px - gravity * t * t / 2.0;
    }
    let (mut since, mut speed) = (t - falls, gravity * falls * params.restitution);
    // Below 1 px/s the ball lies; that also bounds the number of bounces.
    while speed > 1.0 {
        let flight = 2.0 * speed / gravity;
        if since < flight {
            return speed * since - gravity * since * since / 2.0;
        }
        since -= flight;
        speed *= params.restitution.min(0.999);
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One axis of the paper's filter (position and velocity, or a size alone): the 6-state filter falls apart into these.
    struct Axis {
        position: f64,
        velocity: f64,
        covariance: [f64; 3],
        noise: [f64; 2],
    }

    impl Axis {
        fn predict(&mut self, dt: f64) -> f64 {
            let [p, c, v] = self.covariance;
            self.position += dt * self.velocity;
            self.covariance = [p + 2.0 * dt * c + dt * dt * v + self.noise[0], c + dt * v, v + self.noise[1]];
            self.position
        }

        fn correct(&mut self, measured: f64) -> f64 {
            let [p, c, v] = self.covariance;
            let (gain, gain_v) = (p / (p + 0.1), c / (p + 0.1));
            let innovation = measured - self.position;
            self.position += gain * innovation;
            self.velocity += gain_v * innovation;
            self.covariance = [(1.0 - gain) * p, (1.0 - gain) * c, v - gain_v * c];
            self.position
        }
    }

    /// Root mean square errors of prediction and estimate, mean overlap of both with the detection.
    fn figures(motion: BallMotion, dt: f64, seeds: u64) -> [f64; 4] {
        let params = BallParams::reference();
        let (mut sums, mut count) = ([0.0; 4], 0.0);
        for seed in 0..seeds {
            let track = ball_track(motion, &params, seed);
            let values = |b: &BBox| [b.center().x, b.center().y, b.width(), b.height()];
            let first = values(&track.measured[0]);
            let mut axes: [Axis; 4] = std::array::from_fn(|k| Axis {
                position: first[k],
                velocity: 0.0,
                covariance: if k < 2 { [1.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] },
                noise: if k < 2 { [0.01, 5.0] } else { [0.01, 0.0] },
            });
            for k in 1..params.frames {
                let measured = values(&track.measured[k]);
                let prior: [f64; 4] = std::array::from_fn(|a| axes[a].predict(dt));
                let posterior: [f64; 4] = std::array::from_fn(|a| axes[a].correct(measured[a]));
                if k < params.settled_after {
                    continue;
                }
                let boxed = |v: [f64; 4]| BBox::from_center_size(Point::new(v[0], v[1]), v[2], v[3]);
                let truth = track.truth[k].center();
                for (half, b) in [boxed(prior), boxed(posterior)].into_iter().enumerate() {
                    sums[half] += b.center().distance(truth).powi(2);
                    sums[half + 2] += b.iou(&track.measured[k]);
                }
                count += 1.0;
            }
        }
        [(sums[0] / count).sqrt(), (sums[1] / count).sqrt(), sums[2] / count, sums[3] / count]
    }

    #[test]
    fn the_papers_filter_shows_the_reference_figures() {
        // PAPERS "Seed 000", dt in seconds and dt = 1: prediction and estimate RMSE in px, their overlaps.
        let reference = [
            (BallMotion::Linear, 1.0 / 30.0, [0.389, 0.301, 0.965, 0.982]),
            (BallMotion::Linear, 1.0, [0.938, 0.439, 0.942, 0.990]),
            (BallMotion::Rolling, 1.0 / 30.0, [1.61, 0.791, 0.938, 0.969]),
            (BallMotion::Rolling, 1.0, [1.06, 0.439, 0.941, 0.990]),
            (BallMotion::Bouncing, 1.0 / 30.0, [26.2, 12.2, 0.344, 0.598]),
            (BallMotion::Bouncing, 1.0, [11.1, 0.482, 0.746, 0.987]),
        ];
        for (motion, dt, expected) in reference {
            let found = figures(motion, dt, 200);
            for (f, e) in found.iter().zip(expected) {
                assert!(
                    (f / e - 1.0).abs() < 0.06,
                    "{} dt {dt:.3}: {found:.3?}, reference {expected:?}",
                    motion.name()
                );
            }
        }
    }

    #[test]
    fn noise_has_the_size_it_claims() {
        let params = BallParams::reference();
        let errors: Vec<f64> = (0..200)
            .map(|seed| ball_track(BallMotion::Linear, &params, seed))
            .flat_map(|t| {
                t.truth
                    .iter()
                    .zip(&t.measured)
                    .map(|(a, b)| a.center().distance(b.center()).powi(2))
                    .collect::<Vec<_>>()
            })
            .collect();
        let rms = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
        assert!((rms - 0.447).abs() < 0.005, "{rms}");
    }

    #[test]
    fn a_bouncing_ball_obeys_gravity_between_bounces_and_never_sinks() {
        let params = BallParams::reference();
        let h = 1e-3;
        for k in 0..3000 {
            let heights = [-1.0, 0.0, 1.0].map(|d| bounce_height(&params, f64::from(k) * h + d * h));
            assert!(heights.iter().all(|y| (0.0..=params.drop_px).contains(y)));
            let acceleration = (heights[0] - 2.0 * heights[1] + heights[2]) / (h * h);
            assert!(
                acceleration > 0.0 || (acceleration + 3000.0).abs() < 1.0 || k == 0 || heights.contains(&0.0),
                "{k} {acceleration}"
            );
        }
    }
}
