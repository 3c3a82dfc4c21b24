//! Whether one tracker is better than another: paired differences of the success AUC, with intervals by bootstrap.

use crate::metrics::mean;
use crate::{EvaluationError, Result, Results};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Resamples of the sequences.
const RESAMPLES: usize = 10_000;
/// Share of the resamples that lie outside of the interval on either side.
const TAIL: f64 = 0.025;
/// Fewer sequences than this allow no judgement.
const FEWEST: usize = 6;

/// What can be said of two trackers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// The whole interval is above zero.
    Better,
    /// The whole interval is below zero.
    Worse,
    /// The interval holds zero, or there are too few sequences.
    CannotTell,
}

impl std::fmt::Display for Judgement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Better => "better",
            Self::Worse => "worse",
            Self::CannotTell => "cannot tell",
        })
    }
}

/// One tracker against another on the sequences that both have run on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The tracker.
    pub tracker: String,
    /// What it is compared with.
    pub against: String,
    /// Sequences that both have.
    pub sequences: usize,
    /// Mean success AUC of the other on them.
    pub against_auc: f64,
    /// Mean of the differences of the success AUCs, tracker less the other.
    pub difference: f64,
    /// 95 % interval of that mean, by resampling sequences.
    pub interval: [f64; 2],
    /// What follows.
    pub judgement: Judgement,
}

/// Success AUCs by sequence.
pub type Aucs = BTreeMap<String, f64>;

impl Comparison {
    /// Compares by the sequences in both; `None` when there are none.
    pub fn new((tracker, aucs): (&str, &Aucs), (against, others): (&str, &Aucs)) -> Option<Self> {
        let pairs: Vec<(f64, f64)> = aucs
            .iter()
            .filter_map(|(name, auc)| Some((*auc, *others.get(name).or_else(|| others.get(last_part(name)))?)))
            .collect();
        let differences: Vec<f64> = pairs.iter().map(|(a, b)| a - b).collect();
        let interval = interval(&differences)?;
        let judgement = match interval {
            _ if differences.len() < FEWEST => Judgement::CannotTell,
            [low, _] if low > 0.0 => Judgement::Better,
            [_, high] if high < 0.0 => Judgement::Worse,
            _ => Judgement::CannotTell,
        };
        Some(Self {
            tracker: tracker.to_owned(),
            against: against.to_owned(),
            sequences: differences.len(),
            against_auc: mean(&pairs.iter().map(|(_, b)| *b).collect::<Vec<_>>()),
            difference: mean(&differences),
            interval,
            judgement,
        })
    }
}

/// The name that other programs' results have for a sequence: without the folders of the data set.
fn last_part(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// 95 % percentile interval of the mean of `values`, by resampling them with replacement (Efron and Tibshirani 1993,
/// section 13.3); the same for the same values. `None` without values.
fn interval(values: &[f64]) -> Option<[f64; 2]> {
    if values.is_empty() {
        return None;
    }
    let mut generator = Pcg64Mcg::seed_from_u64(RESAMPLES as u64);
    let count = values.len() as u64;
    let mut draw = || {
        // The upper bits of a product: an even choice to within 2⁻⁶⁴ times the count.
        let at = (u128::from(generator.next_u64()) * u128::from(count)) >> 64;
        values.get(at as usize).copied().unwrap_or(0.0)
    };
    let mut means: Vec<f64> =
        (0..RESAMPLES).map(|_| values.iter().map(|_| draw()).sum::<f64>() / count as f64).collect();
    means.sort_by(f64::total_cmp);
    let skipped = (TAIL * RESAMPLES as f64) as usize;
    Some([*means.get(skipped)?, *means.get(RESAMPLES - 1 - skipped)?])
}

/// 95 % interval of the mean of `values`; `None` of so few that they allow no judgement.
pub(crate) fn mean_interval(values: &[f64]) -> Option<[f64; 2]> {
    if values.len() < FEWEST { None } else { interval(values) }
}

/// Compares every tracker with those ranked below it, gives each the ranks that this leaves it, and compares all with
/// `others`; best ranked first.
pub(crate) fn compare(results: &mut Results, others: &BTreeMap<String, Aucs>) {
    let aucs = |name: &str| -> Aucs {
        let of = results.trackers.get(name).map(|t| &t.sequences);
        of.into_iter().flatten().map(|(sequence, score)| (sequence.clone(), score.auc)).collect()
    };
    let ours: Vec<(String, Aucs)> = results.ranking().into_iter().map(|name| (name.to_owned(), aucs(name))).collect();
    // How many are clearly better than each, and how many clearly worse.
    let mut clear = vec![(0, 0); ours.len()];
    let mut all = Vec::new();
    for (i, (name, aucs)) in ours.iter().enumerate() {
        for (j, (below, their)) in ours.iter().enumerate().skip(i + 1) {
            let Some(comparison) = Comparison::new((name, aucs), (below, their)) else { continue };
            match comparison.judgement {
                Judgement::Better => (clear[j].0 += 1, clear[i].1 += 1),
                Judgement::Worse => (clear[i].0 += 1, clear[j].1 += 1),
                Judgement::CannotTell => ((), ()),
            };
            all.push(comparison);
        }
        let theirs = others.iter().map(|(other, aucs)| (other.as_str(), aucs));
        all.extend(theirs.filter_map(|other| Comparison::new((name, aucs), other)));
    }
    for ((name, _), (ahead, behind)) in ours.iter().zip(clear) {
        if let Some(tracker) = results.trackers.get_mut(name).filter(|_| ours.len() > 1) {
            tracker.mean.rank = Some([1 + ahead, ours.len() - behind]);
        }
    }
    results.comparisons = all;
}

/// Stored results to compare with: a `results.json`, or any file of `trackers` → NAME → `sequences` → NAME → `auc`.
#[derive(Deserialize)]
struct Stored {
    trackers: BTreeMap<String, StoredTracker>,
}

#[derive(Deserialize)]
struct StoredTracker {
    sequences: BTreeMap<String, StoredScore>,
}

#[derive(Deserialize)]
struct StoredScore {
    auc: f64,
}

/// Reads what `--against` names.
///
/// # Errors
/// A file that cannot be read or is not such a file.
pub(crate) fn read_others(path: &Path) -> Result<BTreeMap<String, Aucs>> {
    let failed = |reason: String| EvaluationError::dataset(path, None, reason);
    let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    let stored: Stored = serde_json::from_slice(&bytes).map_err(|e| {
        failed(format!("{e}; results to compare with have `trackers`, by name, with `sequences`, by name, with `auc`"))
    })?;
    let aucs = |t: StoredTracker| {
        t.sequences
            .into_iter()
            .map(|(name, s)| (last_part(&name).to_owned(), s.auc))
            .filter(|(_, auc)| auc.is_finite())
            .collect()
    };
    Ok(stored.trackers.into_iter().map(|(name, t)| (name, aucs(t))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aucs(values: &[f64]) -> Aucs {
        values.iter().enumerate().map(|(i, v)| (format!("set/s{i}"), *v)).collect()
    }

    fn stored(values: &[f64]) -> Aucs {
        values.iter().enumerate().map(|(i, v)| (format!("s{i}"), *v)).collect()
    }

    #[test]
    fn only_clear_differences_are_called_better() {
        let ours = aucs(&[0.6, 0.7, 0.5, 0.8, 0.65, 0.75, 0.55, 0.7]);
        let lower: Vec<f64> = ours.values().enumerate().map(|(i, v)| v - 0.02 - 0.01 * i as f64).collect();
        let better = Comparison::new(("a", &ours), ("b", &stored(&lower))).unwrap();
        assert_eq!((better.judgement, better.sequences), (Judgement::Better, 8));
        assert!(
            (better.difference - 0.055).abs() < 1e-12
                && (better.against_auc - (mean(&[0.6, 0.7, 0.5, 0.8, 0.65, 0.75, 0.55, 0.7]) - 0.055)).abs() < 1e-12
        );
        assert!(better.interval[0] > 0.02 && better.interval[0] < 0.055 && better.interval[1] > 0.055);
        let worse = Comparison::new(("b", &aucs(&lower)), ("a", &ours)).unwrap();
        assert_eq!(worse.judgement, Judgement::Worse);
        let mixed: Vec<f64> =
            ours.values().enumerate().map(|(i, v)| if i % 2 == 0 { v + 0.1 } else { v - 0.11 }).collect();
        assert_eq!(Comparison::new(("a", &ours), ("c", &stored(&mixed))).unwrap().judgement, Judgement::CannotTell);
        let few = Comparison::new(("a", &aucs(&[0.5; 5])), ("d", &stored(&[0.1; 5]))).unwrap();
        assert_eq!((few.judgement, few.interval), (Judgement::CannotTell, [0.4, 0.4]));
        assert!(Comparison::new(("a", &ours), ("e", &Aucs::new())).is_none());
    }

    #[test]
    fn ranks_span_the_trackers_that_cannot_be_told_apart() {
        let mut results = Results::default();
        let base = [0.6, 0.7, 0.5, 0.8, 0.65, 0.75, 0.55, 0.7];
        let shifted =
            |by: &dyn Fn(usize) -> f64| -> Vec<f64> { base.iter().enumerate().map(|(i, v)| v + by(i)).collect() };
        let mixed = |i: usize| if i.is_multiple_of(2) { 0.05 } else { -0.06 };
        for (name, values) in [("a", base.to_vec()), ("b", shifted(&mixed)), ("c", shifted(&|_| -0.2))] {
            let tracker = results.trackers.entry(name.to_owned()).or_default();
            tracker.mean.auc = mean(&values);
            for (sequence, auc) in aucs(&values) {
                tracker.sequences.entry(sequence).or_default().auc = auc;
            }
        }
        // What is stored under the name of a tracker that ran is no tracker of its own.
        compare(&mut results, &BTreeMap::from([("a".to_owned(), stored(&[0.9; 8]))]));
        let ranks: Vec<_> = results.trackers.values().map(|t| t.mean.rank).collect();
        assert_eq!(ranks, [Some([1, 2]), Some([1, 2]), Some([3, 3])]);
    }

    #[test]
    fn the_interval_is_that_of_the_mean() {
        // For many values the interval is the mean ± 1.96 standard errors.
        let values: Vec<f64> = (0..400).map(|i| f64::from((i * 37) % 101) / 101.0).collect();
        let (m, n) = (mean(&values), values.len() as f64);
        let error = (values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / n / n).sqrt();
        let [low, high] = interval(&values).unwrap();
        assert!((low - (m - 1.96 * error)).abs() < 0.1 * error, "{low} {m} {error}");
        assert!((high - (m + 1.96 * error)).abs() < 0.1 * error, "{high} {m} {error}");
        assert_eq!(interval(&[]), None);
        assert_eq!(interval(&[0.25]), Some([0.25, 0.25]));
    }

    #[test]
    fn incomplete_stored_results_are_refused_by_name() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(
            file.path(),
            r#"{"note": "x", "trackers": {"peer": {"sequences": {"set/s1": {"auc": 0.5, "more": 1}}}}}"#,
        )
        .unwrap();
        assert_eq!(read_others(file.path()).unwrap()["peer"], Aucs::from([("s1".to_owned(), 0.5)]));
        std::fs::write(file.path(), r#"{"trackers": {"peer": {}}}"#).unwrap();
        let message = read_others(file.path()).unwrap_err().to_string();
        assert!(message.contains("sequences") && message.contains("`auc`"), "{message}");
        assert!(read_others(Path::new("no/such/file.json")).unwrap_err().to_string().contains("no/such/file.json"));
    }
}
