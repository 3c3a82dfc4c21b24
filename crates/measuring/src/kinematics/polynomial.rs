//! Two other ways, for whoever wants them: polynomials in a window, and raw differences. Both take the smoother's variance of a
//! measurement for their standard deviations.

use super::{Place, State, Track};
use nalgebra::{SMatrix, SVector};

/// Place, velocity and acceleration as sums of measured places: one row of weights each.
type Weights = Vec<[f64; 3]>;

/// Cubics fitted to `window` frames around each (Savitzky and Golay 1964), by their own times.
pub(super) fn savitzky_golay(track: &Track, places: &[Place], window: usize, noise: f64) -> Vec<Option<State>> {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return Vec::new() };
    let half = window / 2;
    let one = |(i, sighting): (usize, &super::Sighting)| {
        // At the ends the window stays inside what was measured.
        let middle = i.clamp((first.index + half).min(last.index), last.index.saturating_sub(half).max(first.index));
        let from = places.partition_point(|p| p.index + half < middle);
        let to = places.partition_point(|p| p.index <= middle + half);
        let inside = (first.index..=last.index).contains(&i).then(|| places.get(from..to)).flatten()?;
        combined(inside, &cubic(inside, sighting.time_s)?, noise)
    };
    track.sightings.iter().enumerate().map(one).collect()
}

/// The weights of a cubic's value and derivatives at `time_s`.
fn cubic(places: &[Place], time_s: f64) -> Option<Weights> {
    let span = places.last()?.time_s - places.first()?.time_s;
    if places.len() < 5 || span <= 0.0 {
        return None;
    }
    let row = |t: f64| {
        let s = (t - time_s) / span;
        SVector::<f64, 4>::from([1.0, s, s * s, s * s * s])
    };
    let normal =
        places.iter().fold(SMatrix::<f64, 4, 4>::zeros(), |sum, p| sum + row(p.time_s) * row(p.time_s).transpose());
    let factor = normal.cholesky()?;
    Some(
        places
            .iter()
            .map(|p| {
                let c = factor.solve(&row(p.time_s));
                [c[0], c[1] / span, 2.0 * c[2] / (span * span)]
            })
            .collect(),
    )
}

/// Central differences of the places before and after, where the target was measured.
pub(super) fn differences(track: &Track, places: &[Place], noise: f64) -> Vec<Option<State>> {
    let mut states = vec![None; track.sightings.len()];
    for three in places.windows(3) {
        let [a, b, c] = three else { continue };
        let (h, k) = (b.time_s - a.time_s, c.time_s - b.time_s);
        let velocity = [-k / (h * (h + k)), (k - h) / (h * k), h / (k * (h + k))];
        let acceleration = [2.0 / (h * (h + k)), -2.0 / (h * k), 2.0 / (k * (h + k))];
        let weights = (0..3).map(|i| [f64::from(u8::from(i == 1)), velocity[i], acceleration[i]]).collect::<Weights>();
        if let Some(slot) = states.get_mut(b.index) {
            *slot = combined(three, &weights, noise);
        }
    }
    states
}

/// What the weights make of the places, and the covariance of that.
fn combined(places: &[Place], weights: &Weights, noise: f64) -> Option<State> {
    let (mut mean, mut covariance) = (SVector::<f64, 6>::zeros(), SMatrix::<f64, 6, 6>::zeros());
    for (place, weights) in places.iter().zip(weights) {
        let error = place.slope * place.slope.transpose() * noise;
        for (i, w) in weights.iter().enumerate() {
            for axis in 0..2 {
                mean[2 * i + axis] += w * place.at[axis];
                for (j, v) in weights.iter().enumerate() {
                    for other in 0..2 {
                        covariance[(2 * i + axis, 2 * j + other)] += w * v * error[(axis, other)];
                    }
                }
            }
        }
    }
    mean.iter().chain(covariance.iter()).all(|v| v.is_finite()).then(|| State::new(mean, covariance))
}
