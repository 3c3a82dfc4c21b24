//! Motions in the plane for the guide "which filter for which motion".

use super::random::Random;
use nalgebra::Vector2;
use std::f64::consts::TAU;

type Point = Vector2<f64>;

/// A way of moving; all at about 4 px a frame, one frame per time unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    Straight,
    /// A right angle, at once.
    Turn,
    Circle,
    /// The same, measured four times as badly.
    NoisyCircle,
    /// Falling and bouncing.
    Bounce,
    /// Walking, standing, walking on.
    StopAndGo,
}

/// Frames of each.
const FRAMES: usize = 120;
/// Speed, px a frame.
const SPEED: f64 = 4.0;
/// Frames for a circle.
const PERIOD: f64 = 100.0;
/// Gravity, px a frame²: a ball 40 px across and 12 cm wide at 30 frames a second falls about so.
const GRAVITY: f64 = 3.0;
/// First drop, px, and speed kept at a bounce.
const DROP: f64 = 250.0;
const RESTITUTION: f64 = 0.87;
/// Frames of walking and of standing.
const WALK: usize = 25;

impl Motion {
    pub const ALL: [Self; 6] =
        [Self::Straight, Self::Turn, Self::Circle, Self::NoisyCircle, Self::Bounce, Self::StopAndGo];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Turn => "turn",
            Self::Circle => "circle",
            Self::NoisyCircle => "noisy circle",
            Self::Bounce => "bounce",
            Self::StopAndGo => "stop and go",
        }
    }

    /// Deviation of the measurement noise, px.
    pub const fn sigma_px(self) -> f64 {
        match self {
            Self::NoisyCircle => 4.0,
            Self::Straight | Self::Turn | Self::Circle | Self::Bounce | Self::StopAndGo => 1.0,
        }
    }

    /// Positions, one a frame, in a direction and with a start of their own.
    pub fn path(self, random: &mut Random) -> Vec<Point> {
        let heading = random.uniform(0.0, TAU);
        let along = |angle: f64| Point::new(angle.cos(), angle.sin());
        match self {
            Self::Straight => (0..FRAMES).map(|k| along(heading) * (SPEED * k as f64)).collect(),
            Self::Turn => {
                let at = random.uniform(50.0, 70.0);
                let after = along(heading + TAU / 4.0 * random.sign());
                let path = |t: f64| along(heading) * (SPEED * t.min(at)) + after * (SPEED * (t - at).max(0.0));
                (0..FRAMES).map(|k| path(k as f64)).collect()
            }
            Self::Circle | Self::NoisyCircle => {
                let (radius, way) = (SPEED * PERIOD / TAU, random.sign());
                (0..FRAMES).map(|k| along(heading + way * TAU * k as f64 / PERIOD) * radius).collect()
            }
            Self::Bounce => bounce(random),
            Self::StopAndGo => {
                let first = (random.uniform(0.0, 1.0) * WALK as f64) as usize;
                let mut at = Point::zeros();
                let walks = |k: usize| ((k + first) / WALK).is_multiple_of(2);
                (0..FRAMES)
                    .map(|k| {
                        let here = at;
                        at += if walks(k) { along(heading) * SPEED } else { Point::zeros() };
                        here
                    })
                    .collect()
            }
        }
    }
}

/// Integrated in small steps, so that bounces happen between frames.
fn bounce(random: &mut Random) -> Vec<Point> {
    const STEPS: usize = 50;
    let (mut at, mut velocity) = (Point::new(0.0, -DROP * random.uniform(0.6, 1.0)), Point::new(SPEED, 0.0));
    let mut path = Vec::with_capacity(FRAMES);
    for _ in 0..FRAMES {
        path.push(at);
        for _ in 0..STEPS {
            velocity.y += GRAVITY / STEPS as f64;
            at += velocity / STEPS as f64;
            if at.y > 0.0 && velocity.y > 0.0 {
                velocity.y *= -RESTITUTION;
            }
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_motion_has_its_character() {
        for motion in Motion::ALL {
            let path = motion.path(&mut Random::new(0, 3));
            assert_eq!(path.len(), FRAMES, "{motion:?}");
            assert!(path.iter().all(|p| p.iter().all(|v| v.is_finite())));
            let steps: Vec<f64> = path.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
            let (least, most) = steps.iter().fold((f64::MAX, 0.0_f64), |(a, b), s| (a.min(*s), b.max(*s)));
            match motion {
                Motion::Straight => assert!((least - SPEED).abs() < 1e-9 && (most - SPEED).abs() < 1e-9),
                Motion::StopAndGo => assert!(least == 0.0 && (most - SPEED).abs() < 1e-9),
                Motion::Bounce => assert!(most > 5.0 * SPEED && path.iter().all(|p| p.y < 2.0)),
                _ => assert!(most <= SPEED + 1e-9 && least > 2.0),
            }
        }
    }
}
