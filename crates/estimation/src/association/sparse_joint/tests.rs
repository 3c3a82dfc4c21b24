use super::*;
use pursuit_testkit::SplitMix;

/// Pairs of a share of all, with likelihoods of `mean` ± `spread` nats.
fn problem(numbers: &mut SplitMix, size: (usize, usize), share: f64, mean: f64, spread: f64) -> Vec<Likelihood> {
    let all = (0..size.0).flat_map(|target| (0..size.1).map(move |detection| (target, detection)));
    let mut pairs = Vec::new();
    for (target, detection) in all {
        let nats = mean + spread * (2.0 * numbers.unit() - 1.0);
        if numbers.unit() < share {
            pairs.push(Likelihood { target, detection, nats });
        }
    }
    pairs
}

/// The probability of each pair, and of each target that it was missed, by all events one after the other.
fn tried(targets: usize, pairs: &[Likelihood]) -> (Vec<f64>, Vec<f64>) {
    struct All<'a> {
        targets: usize,
        pairs: &'a [Likelihood],
        of: Vec<f64>,
        missed: Vec<f64>,
        total: f64,
    }
    fn go(all: &mut All<'_>, target: usize, taken: &mut Vec<Option<usize>>, weight: f64) {
        if target == all.targets {
            all.total += weight;
            for (target, pair) in taken.iter().enumerate() {
                match pair {
                    Some(pair) => all.of[*pair] += weight,
                    None => all.missed[target] += weight,
                }
            }
            return;
        }
        taken.push(None);
        go(all, target + 1, taken, weight);
        taken.pop();
        for at in 0..all.pairs.len() {
            let pair = all.pairs[at];
            let free = taken.iter().flatten().all(|other| all.pairs[*other].detection != pair.detection);
            if pair.target == target && free {
                taken.push(Some(at));
                go(all, target + 1, taken, weight * pair.nats.exp());
                taken.pop();
            }
        }
    }
    let mut all = All { targets, pairs, of: vec![0.0; pairs.len()], missed: vec![0.0; targets], total: 0.0 };
    go(&mut all, 0, &mut Vec::new(), 1.0);
    let All { mut of, mut missed, total, .. } = all;
    of.iter_mut().chain(&mut missed).for_each(|value| *value /= total);
    (of, missed)
}

/// That the probabilities of each target sum to one.
fn check_sums(targets: usize, pairs: &[Likelihood], found: &[f64], missed: &[f64]) {
    let mut sums = missed.to_vec();
    assert_eq!((sums.len(), found.len()), (targets, pairs.len()));
    pairs.iter().zip(found).for_each(|(pair, probability)| sums[pair.target] += probability);
    assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 1e-9), "{sums:?}");
    assert!(found.iter().chain(missed).all(|p| (0.0..=1.0 + 1e-12).contains(p)));
}

#[test]
fn events_are_summed_up_and_propagation_comes_near() {
    let (mut exact, mut near, mut numbers) = (SparseJoint::new(), SparseJoint::new(), SplitMix(11));
    let (mut worst, mut all, mut count) = (0.0_f64, 0.0, 0);
    for trial in 0..120 {
        let size = (trial % 7, trial / 7 % 7);
        let (mean, spread) = ([-2.0, 0.0, 3.0][trial % 3], [1.0, 4.0][trial % 2]);
        let share = if size.0.max(size.1) > 5 { 0.6 } else { 0.9 };
        let pairs = problem(&mut numbers, size, share, mean, spread);
        let (expected, expected_missed) = tried(size.0, &pairs);
        let found = exact.solve(size.0, size.1, &pairs, usize::MAX).unwrap().to_vec();
        check_sums(size.0, &pairs, &found, exact.missed());
        for (a, b) in found.iter().chain(exact.missed()).zip(expected.iter().chain(&expected_missed)) {
            assert!((a - b).abs() < 1e-9, "trial {trial}: {a}, not {b}");
        }
        let found = near.solve(size.0, size.1, &pairs, 1).unwrap().to_vec();
        check_sums(size.0, &pairs, &found, near.missed());
        for (a, b) in found.iter().chain(near.missed()).zip(expected.iter().chain(&expected_missed)) {
            worst = worst.max((a - b).abs());
            (all, count) = (all + (a - b).abs(), count + 1);
        }
    }
    let mean = all / f64::from(count);
    assert!(worst < 0.25 && mean < 0.02, "at worst {worst}, {mean} in the mean");
}

/// What is alike is shared alike, and ends, however many there are.
#[test]
fn dense_clusters_end() {
    let (mut joint, mut numbers) = (SparseJoint::new(), SplitMix(12));
    for size in [10, 30, 300] {
        for spread in [0.0, 3.0, 300.0] {
            let pairs = problem(&mut numbers, (size, size), 1.0, 5.0, spread);
            let found = joint.solve(size, size, &pairs, 10_000).unwrap().to_vec();
            check_sums(size, &pairs, &found, joint.missed());
            if spread == 0.0 {
                let each = (1.0 - joint.missed()[0]) / size as f64;
                assert!(found.iter().all(|p| (p - each).abs() < 1e-9) && each > 0.8 / size as f64, "{each}");
            }
            // Once messages have settled no detection is of several.
            let mut of = vec![0.0; size];
            pairs.iter().zip(&found).for_each(|(pair, p)| of[pair.detection] += p);
            assert!(size > 30 || spread > 100.0 || of.iter().all(|sum| *sum < 1.05), "{of:?}");
        }
    }
}

#[test]
fn the_order_of_pairs_does_not_matter() {
    let (mut joint, mut numbers) = (SparseJoint::new(), SplitMix(13));
    let mut pairs = problem(&mut numbers, (5, 6), 0.5, 1.0, 2.0);
    let found = joint.solve(5, 6, &pairs, 10_000).unwrap().to_vec();
    pairs.reverse();
    let back = joint.solve(5, 6, &pairs, 10_000).unwrap();
    assert!(found.iter().rev().zip(back).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn pairs_that_cannot_be_are_refused() {
    let mut joint = SparseJoint::new();
    let pair = |target, detection, nats| [Likelihood { target, detection, nats }];
    assert!(matches!(joint.solve(2, 2, &pair(2, 0, 0.0), 1), Err(EstimationError::Index { what: "target", .. })));
    assert!(matches!(joint.solve(2, 2, &pair(0, 2, 0.0), 1), Err(EstimationError::Index { what: "detection", .. })));
    for nats in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(matches!(joint.solve(2, 2, &pair(0, 0, nats), 1), Err(EstimationError::NotFinite { .. })));
    }
    assert_eq!(joint.missed(), [0.0; 0]);
    assert_eq!(joint.solve(0, 0, &[], 1).unwrap(), [0.0; 0]);
    // Likelihoods beyond what numbers hold are as good as certain.
    for nats in [1e300, 800.0] {
        assert_eq!(joint.solve(1, 1, &pair(0, 0, nats), 1).unwrap(), [1.0]);
        let two = [0, 1].map(|target| Likelihood { target, detection: 0, nats });
        let found = joint.solve(2, 1, &two, 1).unwrap().to_vec();
        assert!((found[0] - found[1]).abs() < 1e-9 && (found[0] - 0.5).abs() < 1e-3, "{found:?}");
    }
}
