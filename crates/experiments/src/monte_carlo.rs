//! Many seeds at once, and what to say of the results: the same numbers on any number of threads.

use super::random::Random;
use super::result::Spread;
use crate::ExperimentError;
use rayon::prelude::*;

/// Runs one experiment for each seed and returns the results in the order of the seeds.
///
/// `stream` keeps the random numbers of different experiments apart; give two filters the same stream to let them see the
/// same measurements.
pub(crate) fn over_seeds<T: Send>(
    seeds: u32,
    stream: u64,
    run: impl Fn(&mut Random) -> Result<T, ExperimentError> + Sync,
) -> Result<Vec<T>, ExperimentError> {
    (0..seeds).into_par_iter().map(|seed| run(&mut Random::new(stream, u64::from(seed)))).collect()
}

/// The quantile `at` ∈ [0, 1] of `sorted` (ascending), linear between neighbours; `None` of an empty sample.
fn quantile(sorted: &[f64], at: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = at.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let (a, b) = (*sorted.get(below)?, *sorted.get((below + 1).min(last))?);
    Some(a + (b - a) * (place - below as f64))
}

/// Median with the 5 % and 95 % quantiles.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> Spread {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let at = |p| quantile(&sorted, p);
    Spread { value: at(0.5).unwrap_or(f64::NAN), low: at(0.05), high: at(0.95) }
}

/// The quantile `at` of `values`.
pub(crate) fn quantile_of(values: impl IntoIterator<Item = f64>, at: f64) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    quantile(&sorted, at).unwrap_or(f64::NAN)
}

/// Arithmetic mean; not a number for an empty sample.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    sum / count
}

/// Root of the mean of squares.
pub(crate) fn root_mean_square(values: impl IntoIterator<Item = f64>) -> f64 {
    mean(values.into_iter().map(|v| v * v)).sqrt()
}

/// Share of `values` for which `holds`.
pub(crate) fn share<T>(values: &[T], holds: impl Fn(&T) -> bool) -> f64 {
    mean(values.iter().map(|v| f64::from(u8::from(holds(v)))))
}

/// `value`, with the 5 % and 95 % quantiles of `each`.
pub(crate) fn with_quantiles(value: f64, each: impl IntoIterator<Item = f64>) -> Spread {
    Spread { value, ..median(each) }
}

/// The candidate whose `cost` is least, and that cost.
pub(crate) fn best<C: Copy>(
    candidates: impl IntoIterator<Item = C>,
    mut cost: impl FnMut(C) -> Result<f64, ExperimentError>,
) -> Result<Option<(C, f64)>, ExperimentError> {
    let mut best: Option<(C, f64)> = None;
    for candidate in candidates {
        let now = cost(candidate)?;
        if best.is_none_or(|(_, least)| now < least) {
            best = Some((candidate, now));
        }
    }
    Ok(best)
}

/// Values from `low` to `high`, `per_decade` to a decade, evenly on a logarithmic scale.
pub(crate) fn decades(low: f64, high: f64, per_decade: u32) -> Vec<f64> {
    let steps = ((high / low).log10() * f64::from(per_decade)).round() as i32;
    (0..=steps).map(|i| low * 10_f64.powf(f64::from(i) / f64::from(per_decade))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_do_not_depend_on_the_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| over_seeds(64, 9, |random| Ok(random.normal())).unwrap())
        };
        assert_eq!(run(1), run(5));
    }

    #[test]
    fn quantiles_are_those_of_the_textbook() {
        let spread = median((1..=21).rev().map(f64::from));
        assert_eq!((spread.value, spread.low, spread.high), (11.0, Some(2.0), Some(20.0)));
        assert_eq!(quantile_of([1.0, 2.0], 0.25), 1.25);
        assert!(median([]).value.is_nan());
    }

    #[test]
    fn grids_and_minima() {
        let grid = decades(1e-2, 1.0, 2);
        assert_eq!(grid.len(), 5);
        assert!((grid[4] - 1.0).abs() < 1e-12);
        let (least, _) = best(grid, |q| Ok((q - 0.1).abs())).unwrap().unwrap();
        assert!((least - 0.1).abs() < 1e-12);
    }
}
