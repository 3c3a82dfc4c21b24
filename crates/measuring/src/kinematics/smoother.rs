//! The two-pass smoother over a track, with the noises that the track itself shows.

use super::breaks::{self, Break};
use super::likelihood::{self, Likely, Pass, Scale, Sums, Tick};
use super::path::Walk;
use super::{Jump, Options, Place, State, Track};
use crate::calibration::median;
use crate::{MeasuringError, Result, Ruler};
use nalgebra::{SMatrix, SVector, Vector2};
use pursuit_estimation::filters::smooth;
use pursuit_estimation::{EstimationError, Gaussian, Transition};
use rayon::prelude::*;

/// What the smoother finds.
pub(super) struct Smoothed {
    /// A state for each sighting; none outside of what was measured.
    pub states: Vec<Option<State>>,
    /// How far the target had come at each, with its standard deviation.
    pub paths: Vec<Option<(f64, f64)>>,
    /// Variance of a measurement, square pixels.
    pub noise: f64,
    /// How many derivatives the model has: 3 constant acceleration, 4 constant jerk.
    pub order: usize,
    /// Intensity of what disturbs the highest of them, unit²/s^(2 order − 1).
    pub density: f64,
    /// Correlation of one residual and the next.
    pub correlation: f64,
    /// Where the velocity jumped.
    pub jumps: Vec<Jump>,
    pub warnings: Vec<String>,
}

/// Stretches of a long track that its noises are found from, and how many ticks each has: what a hundred thousand frames say
/// of two numbers, a few thousand say as well.
const STRETCHES: usize = 4;
const STRETCH: usize = 750;
/// In a track of more ticks than this only the likeliest noises are taken: they are known to a percent.
const LONG: usize = 20_000;
/// Residuals that are more alike than this make the standard deviations too small by a fifth and more.
const ALIKE: f64 = 0.2;

pub(super) fn run(track: &Track, places: &[Place], ruler: &Ruler, options: &Options) -> Result<Smoothed> {
    let failed = |source: EstimationError| MeasuringError::Smoothing { target: track.target, source };
    let scale = scale(track, places);
    let jumps = if options.bounces { breaks::find(places, &scale) } else { Vec::new() };
    let ticks = ticks(track, places, &scale, &jumps);
    let stretches = stretches(&ticks);
    let (acceleration, jerk) =
        rayon::join(|| likelihood::likely::<6>(&stretches), || likelihood::likely::<8>(&stretches));
    let (acceleration, jerk) = (acceleration.map_err(failed)?, jerk.map_err(failed)?);
    let made = Making { track, places, ruler, scale, ticks: &ticks };
    let smoothed = if jerk.evidence > acceleration.evidence {
        made.smoothed::<8>(&jerk)
    } else {
        made.smoothed::<6>(&acceleration)
    };
    let jump = |b: &Break| Some(Jump { index: places.get(b.place)?.index, time_s: b.time_s, error_s: b.error_s });
    let jumps = jumps.iter().filter_map(jump).collect();
    Ok(Smoothed { jumps, ..smoothed.map_err(failed)? })
}

/// What the states are made of.
struct Making<'a> {
    track: &'a Track,
    places: &'a [Place],
    ruler: &'a Ruler,
    scale: Scale,
    ticks: &'a [Tick],
}

impl Making<'_> {
    /// The states by the model of `N` numbers.
    fn smoothed<const N: usize>(&self, likely: &Likely) -> std::result::Result<Smoothed, EstimationError> {
        let (track, scale, count) = (self.track, &self.scale, self.ticks.len());
        let ratios = if count > LONG { &likely.ratios[..1] } else { &likely.ratios[..] };
        let weight: f64 = ratios.iter().map(|r| r.1).sum();
        let passes = ratios.par_iter().map(|(ratio, _)| Half::<N>::new(self.ticks, *ratio));
        let passes: Vec<Half<N>> = passes.collect::<std::result::Result<_, _>>()?;
        let (Some(first), Some((ratio, _))) = (passes.first(), ratios.first()) else {
            return Err(EstimationError::NoConvergence { what: "the search for the noises", iterations: 0 });
        };
        let unit = unit_of(scale);
        let begin = self.places.first().map_or(0, |p| p.index);
        let mut states = vec![None; track.sightings.len()];
        for (k, slot) in states.iter_mut().skip(begin).take(count).enumerate() {
            let parts = passes.iter().zip(ratios).map(|(pass, (_, w))| (w / weight, &pass.beliefs[k], pass.variance()));
            *slot = Some(mixed(parts, &unit));
        }
        let mut walk = Walk::new(self.ruler);
        let mut paths = vec![None; track.sightings.len()];
        let factor = first.variance() * scale.length * scale.length;
        for (k, slot) in paths.iter_mut().skip(begin).take(count).enumerate() {
            let belief = &first.beliefs[k];
            let at = Vector2::new(belief.mean()[0], belief.mean()[1]) * scale.length;
            *slot = Some(walk.on(at, belief.covariance() * factor, first.gains.get(k).copied()));
        }
        let correlation = correlation(&first.innovations);
        let mut warnings = Vec::new();
        if correlation > ALIKE {
            warnings.push(format!(
                "target {}: the errors of one frame and the next are alike (correlation {correlation:.2}), which standard deviations suppose they are not: take them for {:.1} times as large",
                track.target,
                ((1.0 + correlation) / (1.0 - correlation).max(0.05)).sqrt()
            ));
        }
        let (noise, order) = (first.sums.variance(), N / 2);
        let density = ratio * noise * scale.length.powi(2) / scale.step_s.powi(N as i32 - 1);
        Ok(Smoothed { states, paths, noise, order, density, correlation, jumps: Vec::new(), warnings })
    }
}

/// Pixels and steps: the ruler's unit in a pixel at the middle of the track, the median of the steps.
fn scale(track: &Track, places: &[Place]) -> Scale {
    let mut lengths: Vec<f64> = places.iter().map(|p| p.slope.determinant().abs().sqrt()).collect();
    let mut steps: Vec<f64> = track.sightings.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
    let length = median(&mut lengths).filter(|l| *l > 0.0).unwrap_or(1.0);
    Scale { length, step_s: median(&mut steps).filter(|s| *s > 0.0).unwrap_or(1.0) }
}

/// The sightings from the first measured to the last as ticks.
fn ticks(track: &Track, places: &[Place], scale: &Scale, jumps: &[Break]) -> Vec<Tick> {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return Vec::new() };
    let mut seen = places.iter().enumerate().peekable();
    let mut before = first.time_s;
    let span = track.sightings.iter().enumerate().take(last.index + 1).skip(first.index);
    span.map(|(index, sighting)| {
        let dt = (sighting.time_s - before) / scale.step_s;
        before = sighting.time_s;
        // Times are written to a microsecond: steps that differ by less are one.
        let dt = if (dt - dt.round()).abs() * scale.step_s < 2e-6 { dt.round() } else { dt };
        let here = seen.next_if(|(_, place)| place.index == index);
        let jump = here.and_then(|(i, place)| {
            let found = jumps.binary_search_by_key(&i, |jump| jump.place).ok()?;
            Some((place.time_s - jumps.get(found)?.time_s) / scale.step_s)
        });
        Tick { dt, seen: here.map(|(_, place)| scale.seen(place)), jump }
    })
    .collect()
}

/// What noises are found from: all of a short track, stretches of a long one.
fn stretches(ticks: &[Tick]) -> Vec<&[Tick]> {
    if ticks.len() <= STRETCHES * STRETCH {
        return vec![ticks];
    }
    let apart = (ticks.len() - STRETCH) / (STRETCHES - 1);
    let all = (0..STRETCHES).map(|i| &ticks[i * apart..i * apart + STRETCH]);
    let mut measured: Vec<&[Tick]> =
        all.filter(|t| t.iter().filter(|t| t.seen.is_some()).count() > STRETCH / 4).collect();
    if measured.is_empty() {
        measured.push(ticks);
    }
    measured
}

/// Both passes at one ratio.
struct Half<const N: usize> {
    beliefs: Vec<Gaussian<N>>,
    /// `C` of each step (see [`super::path`]).
    gains: Vec<SMatrix<f64, N, N>>,
    innovations: Vec<Option<Vector2<f64>>>,
    sums: Sums,
}

impl<const N: usize> Half<N> {
    fn new(ticks: &[Tick], ratio: f64) -> std::result::Result<Self, EstimationError> {
        let n = ticks.len();
        let mut pass =
            Pass { beliefs: Vec::with_capacity(n), steps: Vec::with_capacity(n), innovations: Vec::with_capacity(n) };
        let sums = likelihood::filter(ticks, ratio, Some(&mut pass))?;
        let Pass { mut beliefs, steps, innovations } = pass;
        let gains = beliefs.par_iter().zip(&steps).map(|(belief, step)| gain(belief, step)).collect();
        smooth(&mut beliefs, &steps)?;
        Ok(Self { beliefs, gains, innovations, sums })
    }

    /// The variance of a measurement; that it is estimated from few makes errors larger (the variance of Student's t).
    fn variance(&self) -> f64 {
        let n = self.sums.freedom;
        self.sums.variance() * if n > 4.0 { n / (n - 2.0) } else { 2.0 }
    }
}

/// `C = P Fᵀ (P⁻)⁻¹`.
fn gain<const N: usize>(belief: &Gaussian<N>, step: &Transition<N>) -> SMatrix<f64, N, N> {
    let across = belief.covariance() * step.matrix().transpose();
    let predicted = step.matrix() * across + step.noise();
    predicted.cholesky().map_or_else(SMatrix::zeros, |factor| factor.solve(&across.transpose()).transpose())
}

/// From pixels and steps to the ruler's unit and seconds.
fn unit_of(scale: &Scale) -> SMatrix<f64, 6, 6> {
    let Scale { length, step_s } = *scale;
    let (v, a) = (length / step_s, length / (step_s * step_s));
    SMatrix::from_diagonal(&SVector::from([length, length, v, v, a, a]))
}

/// The mean and the covariance of all that is likely.
fn mixed<'a, const N: usize>(
    parts: impl Iterator<Item = (f64, &'a Gaussian<N>, f64)> + Clone,
    unit: &SMatrix<f64, 6, 6>,
) -> State {
    let known = |belief: &Gaussian<N>| SVector::<f64, 6>::from_fn(|i, _| belief.mean()[i]);
    let mean = parts.clone().fold(SVector::<f64, 6>::zeros(), |sum, (w, belief, _)| sum + known(belief) * w);
    let covariance = parts.fold(SMatrix::<f64, 6, 6>::zeros(), |sum, (w, belief, variance)| {
        let apart = known(belief) - mean;
        let own = SMatrix::<f64, 6, 6>::from_fn(|i, j| belief.covariance()[(i, j)] * variance);
        sum + (own + apart * apart.transpose()) * w
    });
    State::new(unit * mean, unit * covariance * unit)
}

/// The correlation of each residual with the next.
fn correlation(innovations: &[Option<Vector2<f64>>]) -> f64 {
    let pairs = innovations.windows(2).filter_map(|pair| Some((pair[0]?, pair[1]?)));
    let (mut product, mut square) = (0.0, 0.0);
    for (a, b) in pairs {
        product += a.dot(&b);
        square += 0.5 * (a.norm_squared() + b.norm_squared());
    }
    if square > 0.0 { product / square } else { 0.0 }
}
