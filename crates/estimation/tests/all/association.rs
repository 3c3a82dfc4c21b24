//! Association against everything tried.

use crate::common::{assert_close, assert_near};
use nalgebra::{SMatrix, SVector, matrix, vector};
use pursuit_estimation::association::{Cost, Distances, JointParams, JointProbabilities, NearestNeighbours, unmatched};
use pursuit_estimation::consistency::{Gate, chi_square_cumulative};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::{EstimationError, Gaussian, LinearMeasurement, MotionModel};

fn at(x: f64, y: f64, sigma: f64) -> Gaussian<2> {
    Gaussian::from_variances(vector![x, y], vector![sigma * sigma, sigma * sigma]).unwrap()
}

fn gate() -> Gate {
    Gate::from_probability(2, 0.99).unwrap()
}

#[test]
fn the_whole_counts_and_not_the_nearest() {
    // The middle detection is nearer to both, but only one can have it.
    let targets = [at(0.0, 0.0, 1.0), at(2.0, 0.0, 1.0)];
    let detections = [vector![1.2, 0.0], vector![3.5, 0.0]];
    let mut nearest = NearestNeighbours::new(gate(), Cost::Distance).unwrap();
    assert_eq!(nearest.associate(&targets, &detections).unwrap(), [Some(0), Some(1)]);
    // One is out of everybody's reach, and one target has none.
    let detections = [vector![40.0, 0.0], vector![2.1, 0.3]];
    let found = nearest.associate(&targets, &detections).unwrap();
    assert_eq!(found, [None, Some(1)]);
    assert_eq!(unmatched(found, 2).collect::<Vec<_>>(), [0]);
    assert_eq!(nearest.associate::<2>(&[], &detections).unwrap(), []);
    assert_eq!(nearest.associate(&targets, &[]).unwrap(), [None, None]);
}

#[test]
fn likelihood_does_not_favour_the_ignorant() {
    // The vague target is as near in its own deviations, but says so of half the picture.
    let targets = [at(0.0, 0.0, 1.0), at(30.0, 0.0, 20.0)];
    let detections = [vector![2.0, 0.0]];
    let mut by_distance = NearestNeighbours::new(gate(), Cost::Distance).unwrap();
    assert_eq!(by_distance.associate(&targets, &detections).unwrap(), [None, Some(0)]);
    let cost = Cost::Likelihood { detection_probability: 0.9, clutter_density: 1e-6 };
    let mut by_likelihood = NearestNeighbours::new(gate(), cost).unwrap();
    assert_eq!(by_likelihood.associate(&targets, &detections).unwrap(), [Some(0), None]);
    // In thick clutter a far detection is more likely false than the target's: −ln(P_D N/λ) > −ln(1 − P_D).
    let alone = [at(0.0, 0.0, 1.0)];
    let edge = |density: f64, p: f64| {
        let cost = Cost::Likelihood { detection_probability: p, clutter_density: density };
        let mut it = NearestNeighbours::new(gate(), cost).unwrap();
        it.associate(&alone, &detections).unwrap()[0].is_some()
    };
    let density = (-2.0_f64).exp() / std::f64::consts::TAU;
    // Equal where λ (1 − P_D) = P_D N(ν).
    assert!(edge(density * 9.0 * 0.99, 0.9) && !edge(density * 9.0 * 1.01, 0.9));
}

#[test]
fn most_pairs_come_first_then_the_likeliest() {
    // Alone the near target is much likelier to have the near detection, but then the far one would go without.
    let targets = [at(0.0, 0.0, 1.0), at(2.0, 0.0, 1.0)];
    let detections = [vector![0.5, 0.0], vector![-2.5, 0.0]];
    let mut most = NearestNeighbours::new(gate(), Cost::MostPairs).unwrap();
    assert_eq!(most.associate(&targets, &detections).unwrap(), [Some(1), Some(0)]);
    // Both pair once; a target known well is likelier to be where it is expected.
    let targets = [at(0.0, 0.0, 3.0), at(0.2, 0.0, 1.0)];
    assert_eq!(most.associate(&targets, &detections[..1]).unwrap(), [None, Some(0)]);
    assert_eq!(most.associate::<2>(&[], &detections).unwrap(), []);
}

/// Every injective assignment there is: the most pairs, then the least cost.
fn most_then_least(costs: &[Vec<f64>], row: usize, taken: u32) -> (usize, f64) {
    let Some(own) = costs.get(row) else { return (0, 0.0) };
    let mut best = most_then_least(costs, row + 1, taken);
    for (column, cost) in own.iter().enumerate().filter(|(c, cost)| taken >> c & 1 == 0 && cost.is_finite()) {
        let (pairs, sum) = most_then_least(costs, row + 1, taken | 1 << column);
        if pairs + 1 > best.0 || (pairs + 1 == best.0 && sum + cost < best.1) {
            best = (pairs + 1, sum + cost);
        }
    }
    best
}

#[test]
fn no_other_way_makes_more_or_likelier_pairs() {
    let mut most = NearestNeighbours::new(gate(), Cost::MostPairs).unwrap();
    let mut distances = Distances::new();
    for problem in 0..300_u32 {
        let (rows, columns) = (1 + problem as usize % 4, 1 + problem as usize / 4 % 5);
        // A number in [-40, 60), a third of all pairs forbidden.
        let cost = |t: usize, d: usize| {
            let hash = (problem * 64 + (t * 8 + d) as u32 + 1).wrapping_mul(2_654_435_761) >> 8;
            if hash.is_multiple_of(3) { f64::INFINITY } else { f64::from(hash % 1000) / 10.0 - 40.0 }
        };
        distances.fill(&vec![at(0.0, 0.0, 1.0); rows], &vec![vector![0.0, 0.0]; columns]).unwrap();
        let pairs = || (0..rows).flat_map(|t| (0..columns).map(move |d| (t, d)));
        pairs().filter(|(t, d)| cost(*t, *d).is_infinite()).for_each(|(t, d)| distances.add(t, d, f64::INFINITY));
        let found = most.assign(&distances, cost).unwrap();
        let each: Vec<f64> = (0..).zip(found).filter_map(|(t, d)| Some(cost(t, (*d)?))).collect();
        let costs: Vec<Vec<f64>> = (0..rows).map(|t| (0..columns).map(|d| cost(t, d)).collect()).collect();
        let (pairs, least) = most_then_least(&costs, 0, 0);
        assert_eq!(each.len(), pairs, "problem {problem}");
        assert_near("cost", each.iter().sum(), least, 1e-9);
    }
}

#[test]
fn further_evidence_joins_the_distances() {
    let targets = [at(0.0, 0.0, 1.0), at(1.0, 0.0, 1.0)];
    let detections = [vector![0.4, 0.0]];
    let mut distances = Distances::new();
    distances.fill(&targets, &detections).unwrap();
    assert_eq!((distances.targets(), distances.detections()), (2, 1));
    assert_near("distance", distances.squared(1, 0), 0.36, 1e-12);
    assert_eq!((distances.squared(0, 1), distances.squared(2, 0)), (f64::INFINITY, f64::INFINITY));
    let mut nearest = NearestNeighbours::new(gate(), Cost::MostPairs).unwrap();
    assert_eq!(nearest.assign(&distances, |_, _| 0.0).unwrap(), [Some(0), None]);
    assert_eq!(nearest.assign(&distances, |t, _| if t == 0 { 1.0 } else { 0.0 }).unwrap(), [None, Some(0)]);
    let params = JointParams { detection_probability: 0.9, clutter_density: 0.01, gate: gate(), most_events: 100 };
    let joint = JointProbabilities::new(params).unwrap();
    let plain = joint.among(&distances, |_, _| 0.0).unwrap();
    assert_eq!(plain, joint.of(&targets, &detections).unwrap());
    // Minus twice the logarithm of a likelihood ratio, inside the gate or beside it, says the same.
    let beside = joint.among(&distances, |t, _| if t == 0 { 2.0 } else { 0.0 }).unwrap();
    distances.add(0, 0, 2.0);
    assert_eq!(beside, joint.among(&distances, |_, _| 0.0).unwrap());
    distances.add(0, 0, f64::INFINITY);
    assert_eq!(nearest.assign(&distances, |_, _| 0.0).unwrap(), [None, Some(0)]);
}

#[test]
fn what_is_expected_includes_the_sensors_noise() {
    let belief = Gaussian::<4>::new(vector![1.0, 2.0, 3.0, 4.0], SMatrix::identity() * 2.0).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 3], [0.5, 0.25]).unwrap();
    let expected = belief.expected(&sensor).unwrap();
    assert_eq!(*expected.mean(), vector![1.0, 4.0]);
    assert_eq!(*expected.covariance(), matrix![2.5, 0.0; 0.0, 2.25]);
}

/// All joint events, one by one, without clusters or scaling.
fn tried(targets: &[Gaussian<2>], detections: &[SVector<f64, 2>], params: &JointParams) -> Vec<Vec<f64>> {
    let width = detections.len() + 1;
    let inside = chi_square_cumulative(2.0, params.gate.threshold).unwrap();
    let weight = |t: usize, choice: usize| match choice.checked_sub(1) {
        None => 1.0 - params.detection_probability * inside,
        Some(d) if targets[t].nees(&detections[d]).unwrap() <= params.gate.threshold => {
            params.detection_probability * targets[t].log_density(&detections[d]).unwrap().exp()
                / params.clutter_density
        }
        Some(_) => 0.0,
    };
    let mut sums = vec![vec![0.0; width]; targets.len()];
    let events = width.pow(targets.len() as u32);
    let mut total = 0.0;
    for event in 0..events {
        let choices: Vec<usize> = (0..targets.len()).map(|t| event / width.pow(t as u32) % width).collect();
        let clash = (1..width).any(|d| choices.iter().filter(|c| **c == d).count() > 1);
        if clash {
            continue;
        }
        let product: f64 = choices.iter().enumerate().map(|(t, c)| weight(t, *c)).product();
        total += product;
        for (t, c) in choices.iter().enumerate() {
            sums[t][*c] += product;
        }
    }
    sums.iter().map(|row| row.iter().map(|sum| sum / total).collect()).collect()
}

#[test]
fn joint_probabilities_are_the_sums_over_events() {
    let targets = [at(0.0, 0.0, 1.0), at(2.0, 0.5, 1.5), at(1.0, 2.0, 0.7), at(50.0, 0.0, 1.0)];
    let detections = [vector![0.5, 0.2], vector![1.6, 1.0], vector![1.0, 1.4], vector![51.0, 0.3], vector![-30.0, 2.0]];
    for (p, density) in [(0.9, 0.01), (0.5, 0.2), (0.99, 1e-6)] {
        let params =
            JointParams { detection_probability: p, clutter_density: density, gate: gate(), most_events: 10_000 };
        let joint = JointProbabilities::new(params).unwrap();
        let found = joint.of(&targets, &detections).unwrap();
        let expected = tried(&targets, &detections, &params);
        for (t, row) in expected.iter().enumerate() {
            for (a, b) in found.of(t).unwrap().iter().zip(row) {
                assert_near("probability", *a, *b, 1e-12);
            }
            assert_near("sum", found.of(t).unwrap().iter().sum(), 1.0, 1e-12);
        }
        assert_eq!(found.of(targets.len()), None);
        assert_eq!(found.of(0).unwrap().len(), 6);
    }
}

#[test]
fn a_crowd_is_left_to_belief_propagation() {
    let targets: Vec<_> = (0..30).map(|k| at(0.01 * f64::from(k), 0.0, 1.0)).collect();
    let detections: Vec<_> = (0..30).map(|k| vector![0.0, 0.01 * f64::from(k)]).collect();
    let params = JointParams { detection_probability: 0.9, clutter_density: 1e-3, gate: gate(), most_events: 100_000 };
    let crowd = JointProbabilities::new(params).unwrap().of(&targets, &detections).unwrap();
    for t in 0..30 {
        let row = crowd.of(t).unwrap();
        assert_near("sum", row.iter().sum(), 1.0, 1e-9);
        // Each is as good as any other: one in thirty, but for the few that are missed.
        assert!(row[1..].iter().all(|p| *p > 0.02 && *p < 0.05), "{row:?}");
    }
    // What is left to it in a small cluster is near what is exact, where clutter is as dense as targets.
    let params = JointParams { clutter_density: 0.1, ..params };
    let (targets, detections) = (&[at(0.0, 0.0, 1.0), at(1.5, 0.0, 1.0)], &[vector![0.2, 0.3], vector![1.1, -0.4]]);
    let exact = JointProbabilities::new(params).unwrap().of(targets, detections).unwrap();
    let near =
        JointProbabilities::new(JointParams { most_events: 1, ..params }).unwrap().of(targets, detections).unwrap();
    for t in 0..2 {
        for (a, b) in exact.of(t).unwrap().iter().zip(near.of(t).unwrap()) {
            assert!((a - b).abs() < 0.12, "{exact:?}, not {near:?}");
        }
    }
    assert_ne!(exact, near);
    // More at one place than a sum over them may be deep.
    let heap = vec![at(0.0, 0.0, 1.0); 1001];
    let detections: Vec<_> = (0..30).map(|k| vector![0.0, 0.01 * f64::from(k)]).collect();
    let params = JointParams { clutter_density: 1e-3, most_events: usize::MAX, ..params };
    let found = JointProbabilities::new(params).unwrap().of(&heap, &detections[..1]).unwrap();
    assert!((found.of(1000).unwrap()[1] - 1.0 / 1001.0).abs() < 1e-4);
    // As many as may be: the one detection is of each with the same chance.
    let found = JointProbabilities::new(params).unwrap().of(&heap[..1000], &detections[..1]).unwrap();
    let missed = 1.0 - 0.9 * 0.99;
    let one = 0.9 / std::f64::consts::TAU / 1e-3 / missed;
    assert_near("one of a thousand", found.of(999).unwrap()[1], one / (1.0 + 1000.0 * one), 1e-9);
    // Apart they are no trouble, however many.
    let targets: Vec<_> = (0..300).map(|k| at(30.0 * f64::from(k), 0.0, 1.0)).collect();
    let detections: Vec<_> = (0..300).map(|k| vector![30.0 * f64::from(k), 1.0]).collect();
    let found = JointProbabilities::new(params).unwrap().of(&targets, &detections).unwrap();
    assert!(found.of(299).unwrap()[300] > 0.9);
}

#[test]
fn parameters_out_of_range_are_named() {
    let good = JointParams { detection_probability: 0.9, clutter_density: 1.0, gate: gate(), most_events: 1 };
    let closed = Gate { threshold: f64::NAN };
    for bad in [
        JointParams { detection_probability: 1.0, ..good },
        JointParams { detection_probability: 0.0, ..good },
        JointParams { clutter_density: 0.0, ..good },
        JointParams { gate: closed, ..good },
        JointParams { most_events: 0, ..good },
    ] {
        assert!(matches!(JointProbabilities::new(bad), Err(EstimationError::Parameter { .. })));
    }
    assert!(NearestNeighbours::new(closed, Cost::Distance).is_err());
    for (p, density) in [(1.0, 1.0), (0.0, 1.0), (0.5, 0.0), (0.5, f64::NAN)] {
        let cost = Cost::Likelihood { detection_probability: p, clutter_density: density };
        assert!(NearestNeighbours::new(gate(), cost).is_err());
    }
    let mut nearest = NearestNeighbours::new(gate(), Cost::Distance).unwrap();
    let nan = [vector![f64::NAN, 0.0]];
    assert!(matches!(nearest.associate(&[at(0.0, 0.0, 1.0)], &nan), Err(EstimationError::NotFinite { .. })));
    assert!(matches!(
        JointProbabilities::new(good).unwrap().of(&[at(0.0, 0.0, 1.0)], &nan),
        Err(EstimationError::NotFinite { .. })
    ));
}

/// The textbook's form, with its differences.
#[test]
fn a_weighted_correction_is_the_textbooks() {
    let mut belief = Gaussian::<4>::new(vector![1.0, 2.0, 0.3, 0.4], SMatrix::identity() * 2.0).unwrap();
    belief.predict(&ConstantVelocity::<2>::white(1.0).over(0.5).unwrap()).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [0.5, 1.5]).unwrap();
    let values = [vector![2.0, 2.5], vector![0.0, 3.0]];
    let beta = [0.2, 0.5, 0.3];
    let (x, p, h) = (*belief.mean(), *belief.covariance(), *sensor.matrix());
    let s = h * p * h.transpose() + sensor.noise();
    let k = p * h.transpose() * s.try_inverse().unwrap();
    let nu = values.map(|z| z - h * x);
    let mean = nu[0] * beta[1] + nu[1] * beta[2];
    let second = nu[0] * nu[0].transpose() * beta[1] + nu[1] * nu[1].transpose() * beta[2];
    let certain = p - k * s * k.transpose();
    let expected = p * beta[0] + certain * (1.0 - beta[0]) + k * (second - mean * mean.transpose()) * k.transpose();
    let before = belief;
    belief.update_weighted(&sensor, &values, &beta).unwrap();
    assert_close("mean", belief.mean(), &(x + k * mean), 1e-12);
    assert_close("covariance", belief.covariance(), &expected, 1e-12);
    // One certain detection is the plain update, and none at all changes nothing.
    let (mut sure, mut plain, mut none) = (before, before, before);
    sure.update_weighted(&sensor, &values, &[0.0, 0.0, 1.0]).unwrap();
    plain.update(&sensor, &values[1]).unwrap();
    assert_close("mean", sure.mean(), plain.mean(), 1e-12);
    assert_close("covariance", sure.covariance(), plain.covariance(), 1e-12);
    none.update_weighted(&sensor, &values, &[1.0, 0.0, 0.0]).unwrap();
    assert_close("covariance", none.covariance(), before.covariance(), 1e-12);
    for bad in [&[][..], &[1.0], &[0.2, 0.5], &[0.2, 0.5, 0.2], &[1.2, -0.2, 0.0], &[f64::NAN, 0.5, 0.5]] {
        let mut it = before;
        assert!(it.update_weighted(&sensor, &values, bad).is_err(), "{bad:?}");
        assert_eq!(it, before);
    }
    let mut it = before;
    assert!(it.update_weighted(&sensor, &[vector![f64::NAN, 0.0]], &[0.5, 0.5]).is_err());
    assert_eq!(it, before);
}
