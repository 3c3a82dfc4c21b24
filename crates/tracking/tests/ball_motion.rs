//! The ball's motion filters on simulated measurements: the independent reference's scenes and bars (200 seeds, 90 frames,
//! 30 frames per second, a 40 px ball, noise of variance .1 px² on centre and size).
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_estimation::motion::StepBox;
use pursuit_geometry::{BBox, Point};
use pursuit_tracking::motion::{BoxFilter, BoxNoise, ManoeuvreNoise, ManoeuvringBox};
use pursuit_tracking::{Diagnostics, Measurement, MotionFilter};
use rand_core::Rng;
use rand_pcg::Pcg64;

const SEEDS: u64 = 200;
const FRAMES: usize = 90;
const FPS: f64 = 30.0;
const BALL_PX: f64 = 40.0;
const NOISE_VARIANCE: f64 = 0.1;
/// The filters start at rest; errors count from here on.
const BURN_IN: usize = 30;

struct Random(Pcg64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(Pcg64::new(u128::from(seed), 7))
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
        radius * self.uniform(0.0, std::f64::consts::TAU).cos()
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    Linear,
    /// Rolling on a table with friction, reflected by its walls.
    Rolling,
    /// Falling under 3000 px/s² and bouncing.
    Bouncing,
}

/// Centres of the ball, one a frame: integrated in 20 steps a frame, so that bounces happen between frames.
fn path(motion: Motion, random: &mut Random) -> Vec<Point> {
    let (width, height) = (1280.0, 720.0);
    let angle = random.uniform(0.0, std::f64::consts::TAU);
    let (mut x, mut y, mut vx, mut vy) = match motion {
        Motion::Linear => {
            let speed = random.uniform(100.0, 400.0);
            (random.uniform(300.0, 900.0), random.uniform(200.0, 500.0), speed * angle.cos(), speed * angle.sin())
        }
        Motion::Rolling => {
            let speed = random.uniform(100.0, 300.0);
            (random.uniform(100.0, 1180.0), random.uniform(100.0, 620.0), speed * angle.cos(), speed * angle.sin())
        }
        Motion::Bouncing => {
            (random.uniform(100.0, 400.0), random.uniform(50.0, 250.0), random.uniform(100.0, 400.0), 0.0)
        }
    };
    let step = 1.0 / (20.0 * FPS);
    let mut centres = Vec::with_capacity(FRAMES);
    for _ in 0..FRAMES {
        centres.push(Point::new(x, y));
        for _ in 0..20 {
            if motion == Motion::Bouncing {
                vy += 3000.0 * step;
            }
            if motion == Motion::Rolling {
                let slower = (-0.3 * step).exp();
                (vx, vy) = (vx * slower, vy * slower);
            }
            (x, y) = (x + vx * step, y + vy * step);
            if motion != Motion::Linear {
                let r = BALL_PX / 2.0;
                if (x < r && vx < 0.0) || (x > width - r && vx > 0.0) {
                    vx *= -0.9;
                }
                if (y < r && vy < 0.0) || (y > height - r && vy > 0.0) {
                    vy *= -0.9;
                }
            }
        }
    }
    centres
}

#[derive(Debug, Default, Clone, Copy)]
struct Outcome {
    measured_rmse: f64,
    predicted_rmse: f64,
    filtered_rmse: f64,
    /// Mean overlap of prediction and measurement, as the paper shows them.
    predicted_iou: f64,
    filtered_iou: f64,
}

fn run(motion: Motion, dt_s: f64, filter: impl Fn(BBox) -> Box<dyn MotionFilter>) -> Outcome {
    let mut sum = Outcome::default();
    let mut n = 0.0;
    for seed in 0..SEEDS {
        let mut random = Random::new(seed);
        let centres = path(motion, &mut random);
        let sigma = NOISE_VARIANCE.sqrt();
        let mut noisy = |c: Point| {
            let centre = Point::new(c.x + sigma * random.normal(), c.y + sigma * random.normal());
            BBox::from_center_size(centre, BALL_PX + sigma * random.normal(), BALL_PX + sigma * random.normal())
        };
        let mut filter = filter(noisy(centres[0]));
        for (k, centre) in centres.iter().enumerate().skip(1) {
            let bbox = noisy(*centre);
            let prior = filter.predict(dt_s).unwrap();
            let measurement =
                Measurement { bbox, confidence: 1.0, sigma_px: None, diagnostics: Diagnostics::default() };
            filter.correct(&measurement).unwrap();
            if k < BURN_IN {
                continue;
            }
            sum.measured_rmse += bbox.center().distance(*centre).powi(2);
            sum.predicted_rmse += prior.bbox.center().distance(*centre).powi(2);
            sum.filtered_rmse += filter.bbox().center().distance(*centre).powi(2);
            sum.predicted_iou += prior.bbox.iou(&bbox);
            sum.filtered_iou += filter.bbox().iou(&bbox);
            n += 1.0;
        }
    }
    Outcome {
        measured_rmse: (sum.measured_rmse / n).sqrt(),
        predicted_rmse: (sum.predicted_rmse / n).sqrt(),
        filtered_rmse: (sum.filtered_rmse / n).sqrt(),
        predicted_iou: sum.predicted_iou / n,
        filtered_iou: sum.filtered_iou / n,
    }
}

fn paper(dt_s: f64, motion: Motion) -> Outcome {
    let noise = BoxNoise::PerStep(StepBox::ball());
    run(motion, dt_s, |bbox| Box::new(BoxFilter::new(noise, bbox).unwrap()))
}

fn adaptive(motion: Motion) -> Outcome {
    run(motion, 1.0 / FPS, |bbox| Box::new(ManoeuvringBox::new(ManoeuvreNoise::ball(), bbox).unwrap()))
}

impl Outcome {
    fn predicted_ratio(&self) -> f64 {
        self.predicted_rmse / self.measured_rmse
    }

    fn filtered_ratio(&self) -> f64 {
        self.filtered_rmse / self.measured_rmse
    }
}

#[test]
fn linear_motion_is_filtered_below_the_noise_by_both_modes() {
    for outcome in [paper(1.0 / FPS, Motion::Linear), adaptive(Motion::Linear)] {
        println!("{outcome:?}");
        assert!(outcome.filtered_ratio() <= 0.70, "{outcome:?}");
        assert!(outcome.predicted_ratio() <= 0.90, "{outcome:?}");
        assert!(outcome.predicted_iou >= 0.96, "{outcome:?}");
    }
}

#[test]
fn rolling_balls_are_predicted_by_both_modes() {
    for outcome in [paper(1.0 / FPS, Motion::Rolling), adaptive(Motion::Rolling)] {
        println!("{outcome:?}");
        assert!(outcome.predicted_iou >= 0.93, "{outcome:?}");
    }
}

#[test]
fn bouncing_balls_need_the_adaptive_mode() {
    let (printed, ours) = (paper(1.0 / FPS, Motion::Bouncing), adaptive(Motion::Bouncing));
    println!("{printed:?}\n{ours:?}");
    // What the printed noise does with a bounce when time is in seconds: the reference has .344 and .598.
    assert!(printed.predicted_iou < 0.40 && printed.filtered_iou < 0.65, "{printed:?}");
    assert!(ours.predicted_iou >= 0.74 && ours.filtered_iou >= 0.98, "{ours:?}");
}

#[test]
fn the_adaptive_mode_is_the_default_because_it_is_better_on_every_scene() {
    for motion in [Motion::Linear, Motion::Rolling, Motion::Bouncing] {
        let (printed, ours) = (paper(1.0 / FPS, motion), adaptive(motion));
        assert!(ours.predicted_rmse < printed.predicted_rmse, "{motion:?} {printed:?} {ours:?}");
        assert!(ours.filtered_rmse < printed.filtered_rmse, "{motion:?} {printed:?} {ours:?}");
        assert!(ours.predicted_iou > printed.predicted_iou, "{motion:?} {printed:?} {ours:?}");
    }
}
