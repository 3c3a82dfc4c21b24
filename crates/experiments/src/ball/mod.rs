//! `ball`: how near the predicted box (red in the paper) is to the detected one (green), for the motions that the paper
//! shows. It prints no numbers, one sentence: the two overlap to a large extent.

mod params;
mod pictures;

use super::Paper;
use super::filters::tuned;
use super::monte_carlo::{decades, mean, quantile_of, with_quantiles};
use super::result::{Bar, Finding, Reproduction, Row, Spread};
use super::table::number;
use crate::ExperimentError;
use params::{READINGS, SIZE_CHANGE, START_SPEED, STEADY, TUNING, TUNING_FROM, TUNING_SEEDS, reference};
use pursuit_estimation::MotionModel;
use pursuit_estimation::filters::SteadyState;
use pursuit_estimation::motion::StepBox;
use pursuit_geometry::BBox;
use pursuit_scenes::ball::{BallMotion, BallParams, BallTrack, ball_track};
use pursuit_tracking::motion::{
    BoxFilter, BoxNoise, ManoeuvringBox, MeasurementNoise, MotionFilter, MotionParams, RelativeNoise, Sight,
};
use rayon::prelude::*;

/// A filter of boxes.
#[derive(Debug, Clone, Copy)]
enum Filter {
    /// As printed.
    Printed,
    /// Constant velocity in physical units; the acceleration's density, in extents²/s³.
    Plain(f64),
    /// The system's own mode: steady motion, flight and jumps, interacting.
    Own,
}

impl Filter {
    fn start(self, bbox: BBox) -> Result<Box<dyn MotionFilter>, ExperimentError> {
        Ok(match self {
            Self::Printed => Box::new(BoxFilter::new(BoxNoise::PerStep(StepBox::ball()), bbox)?),
            Self::Plain(acceleration) => {
                let floor_px = BallParams::reference().measurement_variance.sqrt();
                let measurement = MeasurementNoise { position: 0.0, size: 0.0, floor_px };
                let noise = RelativeNoise {
                    acceleration,
                    wander: 0.0,
                    agile: None,
                    size_change: SIZE_CHANGE,
                    start_speed: START_SPEED,
                    measurement,
                };
                Box::new(BoxFilter::new(BoxNoise::Relative(noise), bbox)?)
            }
            Self::Own => Box::new(ManoeuvringBox::new(&MotionParams::ball(), bbox)?),
        })
    }
}

/// What a filter made of a track: priors and estimates, index 0 the first detection.
struct Boxes {
    predicted: Vec<BBox>,
    filtered: Vec<BBox>,
}

fn follow(track: &BallTrack, filter: Filter, dt_s: f64) -> Result<Boxes, ExperimentError> {
    let Some(first) = track.measured.first() else {
        return Ok(Boxes { predicted: Vec::new(), filtered: Vec::new() });
    };
    let mut filter = filter.start(*first)?;
    let mut boxes = Boxes { predicted: vec![*first], filtered: vec![*first] };
    for bbox in track.measured.iter().skip(1) {
        boxes.predicted.push(filter.predict(dt_s)?.bbox);
        filter.correct(&Sight::of(*bbox, None))?;
        boxes.filtered.push(filter.bbox());
    }
    Ok(boxes)
}

/// The errors of one seed, settled frames only.
#[derive(Debug, Clone)]
struct Errors {
    /// Mean squares, px².
    measured: f64,
    predicted: f64,
    filtered: f64,
    /// Overlap with the detection: of the prediction in each frame, and of the estimate on average.
    predicted_iou: Vec<f64>,
    filtered_iou: f64,
}

fn errors(
    motion: BallMotion,
    filter: Filter,
    dt_s: f64,
    seeds: std::ops::Range<u64>,
) -> Result<Vec<Errors>, ExperimentError> {
    let params = BallParams::reference();
    seeds
        .into_par_iter()
        .map(|seed| {
            let track = ball_track(motion, &params, seed);
            let boxes = follow(&track, filter, dt_s)?;
            let settled = params.settled_after;
            let square = |boxes: &[BBox]| {
                let pairs = boxes.iter().zip(&track.truth).skip(settled);
                mean(pairs.map(|(a, b)| a.center().distance(b.center()).powi(2)))
            };
            let overlap = |boxes: &[BBox]| -> Vec<f64> {
                boxes.iter().zip(&track.measured).skip(settled).map(|(a, b)| a.iou(b)).collect()
            };
            Ok(Errors {
                measured: square(&track.measured),
                predicted: square(&boxes.predicted),
                filtered: square(&boxes.filtered),
                predicted_iou: overlap(&boxes.predicted),
                filtered_iou: mean(overlap(&boxes.filtered)),
            })
        })
        .collect()
}

/// Root of the mean square over the seeds, with the quantiles over the seeds.
fn rms(all: &[Errors], of: impl Fn(&Errors) -> f64) -> Spread {
    with_quantiles(mean(all.iter().map(&of)).sqrt(), all.iter().map(|e| of(e).sqrt()))
}

/// The figures of one filter in the order of [`reference`].
fn figures(all: &[Errors]) -> [Spread; 5] {
    let overlaps = || all.iter().flat_map(|e| e.predicted_iou.iter().copied());
    let each = |e: &Errors| mean(e.predicted_iou.iter().copied());
    [
        rms(all, |e| e.predicted),
        rms(all, |e| e.filtered),
        with_quantiles(mean(overlaps()), all.iter().map(each)),
        quantile_of(overlaps(), 0.05).into(),
        with_quantiles(mean(all.iter().map(|e| e.filtered_iou)), all.iter().map(|e| e.filtered_iou)),
    ]
}

const FIGURES: [&str; 5] = [
    "prediction RMSE, px",
    "estimate RMSE, px",
    "IoU(prediction, detection), mean",
    "the same, 5 % quantile",
    "IoU(estimate, detection), mean",
];

/// Density of the tuned plain filter, by the prediction's error on seeds of its own.
fn tuned_plain(motion: BallMotion) -> Result<f64, ExperimentError> {
    let (low, high, per_decade) = TUNING;
    let seeds = TUNING_FROM..TUNING_FROM + u64::from(TUNING_SEEDS);
    tuned(&decades(low, high, per_decade), |density| {
        Ok(mean(errors(motion, Filter::Plain(density), READINGS[0].1, seeds.clone())?.iter().map(|e| e.predicted)))
    })
}

/// All rows of one motion: both readings of the printed filter; the tuned plain filter and the own mode know the time in
/// seconds and stand beside the first.
fn rows(motion: BallMotion, seeds: u32) -> Result<Vec<Row>, ExperimentError> {
    let seeds = 0..u64::from(seeds);
    let plain = errors(motion, Filter::Plain(tuned_plain(motion)?), READINGS[0].1, seeds.clone())?;
    let own = errors(motion, Filter::Own, READINGS[0].1, seeds.clone())?;
    let (plain_figures, own_figures) = (figures(&plain), figures(&own));
    let mut rows = Vec::new();
    for (reading, (name, dt_s)) in READINGS.into_iter().enumerate() {
        let setting = format!("{}, printed filter, {name}", motion.name());
        let all = errors(motion, Filter::Printed, dt_s, seeds.clone())?;
        let expected = reference(motion, reading);
        for (k, ours) in figures(&all).into_iter().enumerate() {
            let mut row = Row::new(&setting, FIGURES[k], ours).reference(expected[k]);
            if reading == 0 {
                row = row.beside(plain_figures[k].value, own_figures[k].value);
            }
            let bar = match (motion, reading, k) {
                (BallMotion::Linear, 0, 2) => Some(Bar::AtLeast(0.96)),
                (BallMotion::Rolling, 0, 2) => Some(Bar::AtLeast(0.93)),
                _ => None,
            };
            rows.push(row.bar_if(bar));
        }
        if motion == BallMotion::Linear && reading == 0 {
            let over =
                |of: fn(&Errors) -> f64| (mean(all.iter().map(of)) / mean(all.iter().map(|e| e.measured))).sqrt();
            let beside = |all: &[Errors], of: fn(&Errors) -> f64| {
                (mean(all.iter().map(of)) / mean(all.iter().map(|e| e.measured))).sqrt()
            };
            for (figure, of, expected, limit) in [
                ("prediction / measurement", (|e: &Errors| e.predicted) as fn(&Errors) -> f64, 0.389 / 0.447, 0.90),
                ("estimate / measurement", |e: &Errors| e.filtered, 0.301 / 0.447, 0.70),
            ] {
                let row = Row::new(&setting, figure, over(of)).reference(expected);
                rows.push(row.beside(beside(&plain, of), beside(&own, of)).bar(Bar::AtMost(limit)));
            }
        }
    }
    if motion == BallMotion::Bouncing {
        let setting = "bouncing, the system's own mode, dt = 1/30 s";
        let bars = [None, None, Some(Bar::AtLeast(0.74)), None, Some(Bar::AtLeast(0.98))];
        for (k, ours) in own_figures.into_iter().enumerate() {
            let row = Row::new(setting, FIGURES[k], ours);
            rows.push(row.beside(plain_figures[k].value, ours.value).bar_if(bars[k]));
        }
    }
    Ok(rows)
}

/// The printed filter's steady state against the reference's digits.
fn steady() -> Result<Vec<Row>, ExperimentError> {
    let filter = StepBox::ball();
    let sensor = filter.measurement()?;
    let mut rows = Vec::new();
    for (name, dt_s, expected) in STEADY {
        let found = SteadyState::solve(&filter.over(dt_s)?, &sensor)?;
        let ours =
            [found.gain[(0, 0)], found.gain[(2, 0)], found.prior_covariance[(0, 0)], found.prior_covariance[(2, 2)]];
        let worst = ours.iter().zip(expected).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f64::max);
        rows.push(
            Row::new("steady state of the printed filter", format!("{name}: gain of the position"), ours[0])
                .reference(expected[0]),
        );
        let figure = format!("{name}: largest deviation of gains and variances");
        rows.push(Row::new("steady state of the printed filter", figure, worst).bar(Bar::AtMost(1e-9)));
    }
    Ok(rows)
}

/// Runs the experiment.
pub(super) fn run(seeds: u32) -> Result<Reproduction, ExperimentError> {
    let mut table = steady()?;
    for motion in BallMotion::ALL {
        table.extend(rows(motion, seeds)?);
    }
    let overlap = |motion: BallMotion, reading: usize| {
        let setting = format!("{}, printed filter, {}", motion.name(), READINGS[reading].0);
        let found = table.iter().find(|r| r.setting == setting && r.figure == FIGURES[2]);
        found.map_or(f64::NAN, |r| r.ours.value)
    };
    let own = table.iter().find(|r| r.setting.contains("own mode") && r.figure == FIGURES[2]);
    let own = own.map_or(f64::NAN, |r| r.ours.value);
    let evidence = |motion| {
        format!(
            "mean IoU {} with time in seconds, {} with dt = 1",
            number(overlap(motion, 0)),
            number(overlap(motion, 1))
        )
    };
    let large = |motion| overlap(motion, 0) > 0.9 && overlap(motion, 1) > 0.9;
    let claim =
        |what: &str| format!("the predicted (red) and the detected (green) box overlap to a large extent: {what}");
    let findings = vec![
        Finding::new(claim("straight on"), large(BallMotion::Linear), evidence(BallMotion::Linear)),
        Finding::new(claim("rolling between walls"), large(BallMotion::Rolling), evidence(BallMotion::Rolling)),
        Finding::new(
            claim("bouncing"),
            large(BallMotion::Bouncing),
            format!(
                "{}; fixed noise lags behind gravity, and no filter predicts the frame of the bounce itself",
                evidence(BallMotion::Bouncing)
            ),
        ),
        Finding::new(
            "three interacting models (steady, flight, jump) mend the bounces",
            own >= 0.74,
            format!("mean IoU {} with time in seconds", number(own)),
        ),
    ];
    Ok(Reproduction {
        paper: Paper::Ball,
        title: "predicted against detected boxes of a ball that goes straight, rolls, and bounces".into(),
        seeds,
        rows: table,
        findings,
        charts: pictures::charts()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steady_state_has_the_references_digits() {
        let rows = steady().unwrap();
        assert_eq!(rows.len(), 10);
        assert!(rows.iter().all(|r| r.verdict != Some(super::super::Verdict::Miss)), "{rows:?}");
    }

    #[test]
    fn bounces_spoil_the_printed_filter() {
        let iou = |filter| figures(&errors(BallMotion::Bouncing, filter, READINGS[0].1, 0..5).unwrap())[2].value;
        assert!(iou(Filter::Printed) < 0.45);
        assert!(iou(Filter::Own) > 0.65);
    }
}
