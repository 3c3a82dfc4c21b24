//! A particle filter on a square target: few particles with learnt motion noise against many with a fixed one.
//!
//! A particle's likelihood is that of equation (27) with ρ = √overlap, the Bhattacharyya coefficient of two-bin histograms
//! of a target on another background: an exact stand-in for rendered pictures.

use super::params::{COUNTS, DETECTOR_PX, FIXED_PX, NOISES, Noise, PositionFrom, SETTINGS, Toy, bounded, reference};
use super::{Bar, Finding, Row, number};
use crate::ExperimentError;
use crate::monte_carlo::{mean, over_seeds, share, with_quantiles};
use crate::random::Random;
use nalgebra::Vector2;
use pursuit_estimation::particle::ParticleOptions;
use pursuit_estimation::zhai2024::{LikelihoodNoiseFilter, VarianceParams, VarianceRule, similarity_log_likelihood};

const STREAM: u64 = 20_240;

type Point = Vector2<f64>;

/// A path of the target, one position a frame.
pub(super) fn path(toy: &Toy, random: &mut Random) -> Vec<Point> {
    let mut kick = |sigma: f64| Point::from_fn(|_, _| sigma * random.normal());
    let (mut at, mut velocity) = (Point::zeros(), kick(toy.start_speed));
    let mut positions = vec![at];
    for _ in 1..toy.frames {
        velocity += kick(toy.acceleration);
        at += velocity;
        positions.push(at);
    }
    positions
}

/// √overlap of two squares of side `side_px` whose centres are `apart`.
fn similarity(apart: &Point, side_px: f64) -> f64 {
    let covered = |d: f64| ((side_px - d.abs()) / side_px).max(0.0);
    (covered(apart.x) * covered(apart.y)).sqrt()
}

/// What a filter made of one path.
pub(super) struct Followed {
    pub estimates: Vec<Point>,
    /// Standard deviation that the particles were spread by, mean of both axes.
    pub spread_px: Vec<f64>,
    /// Effective share of the particles, mean over the frames.
    pub effective: f64,
}

/// Follows the path with `count` particles; the estimate is their weighted mean, equation (29).
pub(super) fn follow(
    toy: &Toy,
    path: &[Point],
    (noise, found): (Noise, PositionFrom),
    count: usize,
    random: &mut Random,
) -> Result<Followed, ExperimentError> {
    let params = match noise {
        // Floor and cap leave no other value.
        Noise::Fixed => {
            VarianceParams { rule: VarianceRule::Corrected, floor: FIXED_PX * FIXED_PX, cap: FIXED_PX * FIXED_PX }
        }
        Noise::Learnt(rule) => bounded(rule),
    };
    let options = ParticleOptions { threshold: 1.0, ..ParticleOptions::default() };
    let start = path.first().copied().unwrap_or_default();
    // Any number will do, as long as it is this run's own.
    let seed = (random.uniform(0.0, 1.0) * 1e15) as u64;
    let mut filter = LikelihoodNoiseFilter::new(count, start, params, options, seed)?;
    let mut followed = Followed { estimates: vec![start], spread_px: vec![0.0], effective: 0.0 };
    for truth in path.iter().skip(1) {
        followed.spread_px.push(filter.variance_px2().map(f64::sqrt).mean());
        filter.predict(1.0)?;
        let weigh = |state: &Point| similarity_log_likelihood(similarity(&(state - truth), toy.side_px), toy.sigma_w);
        let likelihoods: Vec<f64> = filter.particles().states().iter().map(weigh).collect();
        filter.particles_mut().weigh(&likelihoods)?;
        followed.effective += filter.particles().effective_sample_size() / count as f64 / (path.len() - 1) as f64;
        let estimate = filter.particles().mean();
        followed.estimates.push(estimate);
        let detected = truth + Point::from_fn(|_, _| DETECTOR_PX * random.normal());
        filter.correct(if found == PositionFrom::Detector { &detected } else { &estimate })?;
    }
    Ok(followed)
}

/// One seed: mean square error, whether the target was lost at the end, effective share.
#[derive(Debug, Clone, Copy)]
struct Errors {
    square: f64,
    lost: bool,
    effective: f64,
}

fn errors(
    acceleration: f64,
    how: (Noise, PositionFrom),
    count: usize,
    seeds: u32,
) -> Result<Vec<Errors>, ExperimentError> {
    let toy = Toy::new(acceleration);
    over_seeds(seeds, STREAM, |random| {
        let path = path(&toy, random);
        let followed = follow(&toy, &path, how, count, random)?;
        let distances: Vec<f64> = followed.estimates.iter().zip(&path).map(|(a, b)| (a - b).norm()).collect();
        let lost = distances.last().is_none_or(|d| *d > toy.side_px);
        Ok(Errors { square: mean(distances.iter().skip(1).map(|d| d * d)), lost, effective: followed.effective })
    })
}

/// Error of the runs that keep their target, with the quantiles over the seeds.
fn rmse(all: &[Errors]) -> crate::Spread {
    let kept = || all.iter().filter(|e| !e.lost).map(|e| e.square);
    with_quantiles(mean(kept()).sqrt(), kept().map(f64::sqrt))
}

/// All rows of the toy target.
pub(super) fn rows(seeds: u32) -> Result<(Vec<Row>, Vec<Finding>), ExperimentError> {
    let mut rows = Vec::new();
    let mut ratios = Vec::new();
    for (setting, acceleration, found) in SETTINGS {
        let setting = format!("particles on a 20 px target, {setting}");
        // The bars are of the paper's own arrangement on smooth motion.
        let smooth = acceleration < 1.0 && found == PositionFrom::Detector;
        for (name, noise) in NOISES {
            for count in COUNTS {
                let all = errors(acceleration, (noise, found), count, seeds)?;
                let (expected, expected_lost) = reference(acceleration, name, count);
                let lost = share(&all, |e| e.lost);
                let figure = format!("{name}, {count} particles: RMSE, px");
                rows.push(Row::new(&setting, figure, rmse(&all)).reference_if(expected));
                let judged = smooth && name == "maximum likelihood" && count == 20;
                let bar = judged.then_some(Bar::AtMost(0.0));
                if lost > 0.0 || expected_lost.is_some() || bar.is_some() {
                    let figure = format!("{name}, {count} particles: lost");
                    rows.push(Row::new(&setting, figure, lost).reference_if(expected_lost).bar_if(bar));
                }
                if count == 20 || (count == 100 && noise == Noise::Fixed) {
                    let figure = format!("{name}, {count} particles: effective share");
                    rows.push(Row::new(&setting, figure, mean(all.iter().map(|e| e.effective))));
                }
            }
        }
        let of = |name: &str, count: usize| {
            let figure = format!("{name}, {count} particles: RMSE, px");
            rows.iter().find(|r| r.setting == setting && r.figure == figure).map_or(f64::NAN, |r| r.ours.value)
        };
        let few = of("maximum likelihood", 20) / of("fixed 15 px", 100);
        let many = of("maximum likelihood", 500) / of("fixed 15 px", 500);
        let row = Row::new(&setting, "20 learnt / 100 fixed", few);
        let row = row.reference(if acceleration < 1.0 { 1.02 / 1.18 } else { 2.02 / 1.20 });
        rows.push(row.bar_if(smooth.then_some(Bar::AtMost(1.0))));
        rows.push(Row::new(&setting, "500 learnt / 500 fixed", many).reference_if(smooth.then_some(0.74 / 0.44)));
        ratios.push((few, many));
    }
    let lost = rows.iter().filter(|r| r.figure == "as printed, 20 particles: lost").map(|r| r.ours.value);
    let lost = lost.fold(0.0, f64::max);
    Ok((rows, findings(&ratios, lost)))
}

fn findings(ratios: &[(f64, f64)], lost: f64) -> Vec<Finding> {
    let at = |k: usize| ratios.get(k).copied().unwrap_or((f64::NAN, f64::NAN));
    let ((few, many), (few_strong, _)) = (at(0), at(1));
    vec![
        Finding::new(
            "maximum likelihood lets fewer particles do the work, on smooth motion",
            few <= 1.0,
            format!("20 of them have {} of the error of 100 with a fixed 15 px", number(few)),
        ),
        Finding::new(
            "it also does with many particles, and on strong manoeuvres",
            many <= 1.0 && few_strong <= 1.0,
            format!(
                "500 learnt against 500 fixed: {}; 20 against 100 on strong manoeuvres: {} (a likelihood without noise: wide \
                 clouds cost nothing here)",
                number(many),
                number(few_strong)
            ),
        ),
        Finding::new(
            "equation (25) as printed can be used",
            lost < 0.01,
            format!(
                "its variance grows with every frame, and fed by the particles' own mean it feeds itself: 20 particles lose \
                 {} of the targets",
                number(lost)
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_overlap_as_squares_do() {
        assert_eq!(similarity(&Point::zeros(), 20.0), 1.0);
        assert!((similarity(&Point::new(10.0, -10.0), 20.0) - 0.5).abs() < 1e-15);
        assert_eq!(similarity(&Point::new(20.0, 0.0), 20.0), 0.0);
    }

    #[test]
    fn twenty_learning_particles_follow_smooth_motion() {
        let all = errors(0.5, (Noise::Learnt(VarianceRule::Corrected), PositionFrom::Detector), 20, 10).unwrap();
        assert!(all.iter().all(|e| !e.lost));
        assert!(rmse(&all).value < 2.0, "{:?}", rmse(&all));
    }
}
