//! The ball's motion filters on simulated measurements: the independent reference's scenes and bars over 200 seeds (90
//! frames, 30 frames per second, a 40 px ball, noise of variance .1 px² on centre and size).
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_estimation::motion::StepBox;
use pursuit_geometry::BBox;
use pursuit_scenes::ball::{BallMotion, BallParams, ball_track};
use pursuit_tracking::motion::{BoxFilter, BoxNoise, ManoeuvringBox, MotionFilter, MotionParams, Sight};

const SEEDS: u64 = 200;

/// Root mean square errors in pixels, and mean overlaps with the measurement, as the paper shows them.
#[derive(Debug, Default, Clone, Copy)]
struct Outcome {
    measured_rmse: f64,
    predicted_rmse: f64,
    filtered_rmse: f64,
    predicted_iou: f64,
    filtered_iou: f64,
}

impl Outcome {
    fn predicted_ratio(&self) -> f64 {
        self.predicted_rmse / self.measured_rmse
    }

    fn filtered_ratio(&self) -> f64 {
        self.filtered_rmse / self.measured_rmse
    }
}

fn run(motion: BallMotion, filter: impl Fn(BBox) -> Box<dyn MotionFilter>) -> Outcome {
    let params = BallParams::reference();
    let (mut sum, mut n) = (Outcome::default(), 0.0);
    for seed in 0..SEEDS {
        let track = ball_track(motion, &params, seed);
        let mut filter = filter(track.measured[0]);
        for k in 1..track.truth.len() {
            let (truth, bbox) = (track.truth[k].center(), track.measured[k]);
            let prior = filter.predict(track.time_s[k] - track.time_s[k - 1]).unwrap();
            filter.correct(&Sight::of(bbox, None)).unwrap();
            if k < params.settled_after {
                continue;
            }
            sum.measured_rmse += bbox.center().distance(truth).powi(2);
            sum.predicted_rmse += prior.bbox.center().distance(truth).powi(2);
            sum.filtered_rmse += filter.bbox().center().distance(truth).powi(2);
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

fn paper(motion: BallMotion) -> Outcome {
    let noise = BoxNoise::PerStep(StepBox::ball());
    let outcome = run(motion, |bbox| Box::new(BoxFilter::new(noise, bbox).unwrap()));
    println!("{} paper    {outcome:.3?}", motion.name());
    outcome
}

fn adaptive(motion: BallMotion) -> Outcome {
    let outcome = run(motion, |bbox| Box::new(ManoeuvringBox::new(&MotionParams::ball(), bbox).unwrap()));
    println!("{} adaptive {outcome:.3?}", motion.name());
    outcome
}

#[test]
fn both_modes_filter_linear_motion_below_noise() {
    for outcome in [paper(BallMotion::Linear), adaptive(BallMotion::Linear)] {
        assert!(outcome.filtered_ratio() <= 0.70, "{outcome:?}");
        assert!(outcome.predicted_ratio() <= 0.90, "{outcome:?}");
        assert!(outcome.predicted_iou >= 0.96, "{outcome:?}");
    }
}

#[test]
fn rolling_balls_are_predicted_by_both_modes() {
    for outcome in [paper(BallMotion::Rolling), adaptive(BallMotion::Rolling)] {
        assert!(outcome.predicted_iou >= 0.93, "{outcome:?}");
    }
}

#[test]
fn bouncing_balls_need_the_adaptive_mode() {
    let (printed, ours) = (paper(BallMotion::Bouncing), adaptive(BallMotion::Bouncing));
    // What the printed noise does with a bounce when time is in seconds: the reference has .344 and .598.
    assert!((printed.predicted_iou - 0.344).abs() < 0.08 && (printed.filtered_iou - 0.598).abs() < 0.08, "{printed:?}");
    assert!(ours.predicted_iou >= 0.74 && ours.filtered_iou >= 0.98, "{ours:?}");
}

#[test]
fn the_adaptive_mode_is_better_on_every_scene() {
    for motion in BallMotion::ALL {
        let (printed, ours) = (paper(motion), adaptive(motion));
        assert!(ours.predicted_rmse < printed.predicted_rmse, "{motion:?} {printed:?} {ours:?}");
        assert!(ours.filtered_rmse < printed.filtered_rmse, "{motion:?} {printed:?} {ours:?}");
        assert!(ours.predicted_iou > printed.predicted_iou, "{motion:?} {printed:?} {ours:?}");
    }
}
