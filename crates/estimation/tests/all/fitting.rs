//! Parameters fitted to simulated tracks are those they were simulated with, as nearly as the fit says.

use nalgebra::{SMatrix, SVector, vector};
use pursuit_estimation::fitting::{Candidate, ImmFilter, LinearFilter, Recording, fit};
use pursuit_estimation::motion::{ConstantVelocity, RandomWalk};
use pursuit_estimation::{EstimationError, Gaussian, MotionModel, Sojourn};
use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

fn normal(random: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(random)
}

/// A draw of a Gaussian of mean zero.
fn noise<const N: usize>(random: &mut Pcg64Mcg, covariance: &SMatrix<f64, N, N>) -> SVector<f64, N> {
    let lower = Gaussian::new(SVector::zeros(), *covariance).unwrap().factor().unwrap();
    lower * SVector::from_fn(|_, _| normal(random))
}

/// Tracks of the two densities, with gaps and uneven steps; modes last two seconds and one.
fn tracks(densities: [f64; 2], variance: f64, count: u64, frames: usize) -> Vec<Recording<1>> {
    let sojourn = Sojourn::new([2.0, 1.0]).unwrap();
    (0..count)
        .map(|seed| {
            let mut random = Pcg64Mcg::seed_from_u64(seed);
            let (mut state, mut time_s, mut mode) = (vector![0.0, 10.0 * normal(&mut random)], 0.0, 0);
            let (mut times, mut values) = (vec![], vec![]);
            for k in 0..frames {
                let dt_s = if k % 3 == 0 { 0.15 } else { 0.1 };
                let stay = sojourn.over(dt_s).unwrap().matrix()[(mode, mode)];
                if (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 > stay {
                    mode = 1 - mode;
                }
                let step = ConstantVelocity::<1>::white(densities[mode]).over(dt_s).unwrap();
                state = step.matrix() * state + noise(&mut random, step.noise());
                time_s += dt_s;
                times.push(time_s);
                let z = SVector::<f64, 1>::new(state[0] + variance.sqrt() * normal(&mut random));
                values.push((k % 7 != 5).then_some(z));
            }
            Recording::new(times, values).unwrap()
        })
        .collect()
}

/// Within three of the deviations that the fit itself states, and those are not boundless.
#[track_caller]
fn near<const P: usize>(found: [f64; P], deviations: [f64; P], truth: [f64; P], most: f64) {
    for k in 0..P {
        let away = (found[k] / truth[k]).ln();
        assert!(away.abs() < 3.0 * deviations[k], "{k}: {} for {}, deviation {}", found[k], truth[k], deviations[k]);
        assert!(deviations[k] < most, "{k}: deviation {}", deviations[k]);
    }
}

#[test]
fn noise_of_motion_and_sensor_is_found() {
    let tracks = tracks([3.0, 3.0], 0.5, 12, 150);
    let build =
        |&[density, variance]: &[f64; 2]| LinearFilter::new(ConstantVelocity::<1>::white(density), variance, [1e3]);
    let found = fit(&tracks, [1.0, 10.0], build).unwrap();
    near(found.parameters, found.deviations.unwrap(), [3.0, 0.5], 0.2);
    // From elsewhere it is the same, and nothing near by is more likely.
    let again = fit(&tracks, [100.0, 0.01], build).unwrap();
    for k in 0..2 {
        assert!((again.parameters[k] / found.parameters[k] - 1.0).abs() < 1e-3, "{again:?} {found:?}");
    }
    let likelihood = |parameters: [f64; 2]| -> f64 {
        tracks.iter().map(|track| track.log_likelihood(&mut build(&parameters).unwrap()).unwrap()).sum()
    };
    assert!((likelihood(found.parameters) - found.log_likelihood).abs() < 1e-6);
    let [q, r] = found.parameters;
    for other in [[q * 1.05, r], [q * 0.95, r], [q, r * 1.05], [q, r * 0.95]] {
        assert!(likelihood(other) < found.log_likelihood);
    }
    assert!(found.evaluations > 20);
}

#[test]
fn switching_is_found() {
    let truth = [0.5, 50.0, 2.0, 1.0, 0.01];
    let tracks = tracks([truth[0], truth[1]], truth[4], 16, 150);
    let found = fit(&tracks, [1.0, 10.0, 1.0, 1.0, 0.1], |&[quiet, agile, long, short, variance]| {
        let modes = [quiet, agile].map(ConstantVelocity::<1>::white);
        ImmFilter::new(modes, [long, short], variance, [1e3])
    })
    .unwrap();
    println!("{found:?}");
    // A velocity that is not measured is known after several steps only; merging the branches meanwhile makes modes last
    // longer than they do, so that this is less exact than the fit believes.
    for (value, truth) in found.parameters.into_iter().zip(truth) {
        assert!((0.5..2.0).contains(&(value / truth)), "{:?}", found.parameters);
    }
    let plain = fit(&tracks, [5.0, 1.0], |&[density, variance]| {
        LinearFilter::new(ConstantVelocity::<1>::white(density), variance, [1e3])
    })
    .unwrap();
    assert!(found.log_likelihood > plain.log_likelihood + 50.0);
}

/// Where a position is all there is and a sensor sees it well, every mode's belief is the same after an update, so that
/// the estimator is exact, and so is the fit.
#[test]
fn switching_that_is_seen_at_once_is_found_exactly() {
    let truth = [0.5, 50.0, 2.0, 1.0];
    let sojourn = Sojourn::new([truth[2], truth[3]]).unwrap();
    let tracks: Vec<_> = (0..12)
        .map(|seed| {
            let mut random = Pcg64Mcg::seed_from_u64(seed);
            let (mut x, mut mode, mut time_s) = (0.0, 0, 0.0);
            let (mut times, mut values) = (vec![], vec![]);
            for k in 0..200 {
                let dt_s = if k % 3 == 0 { 0.15 } else { 0.1 };
                let stay = sojourn.over(dt_s).unwrap().matrix()[(mode, mode)];
                if (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 > stay {
                    mode = 1 - mode;
                }
                x += (truth[mode] * dt_s).sqrt() * normal(&mut random);
                time_s += dt_s;
                times.push(time_s);
                values.push(Some(SVector::<f64, 1>::new(x + 1e-3 * normal(&mut random))));
            }
            Recording::new(times, values).unwrap()
        })
        .collect();
    let found = fit(&tracks, [1.0, 10.0, 1.0, 1.0], |&[quiet, agile, long, short]| {
        ImmFilter::new([quiet, agile].map(RandomWalk::<1>::white), [long, short], 1e-6, [])
    })
    .unwrap();
    println!("{found:?}");
    near(found.parameters, found.deviations.unwrap(), truth, 0.2);
}

/// The likelihood is the product of the densities of what was not expected, with gaps, from the first measurement on.
#[test]
fn the_likelihood_is_of_the_innovations() {
    let one = |x: f64| Some(SVector::<f64, 1>::new(x));
    let track = Recording::new(vec![0.0, 1.0, 2.5, 3.0], vec![None, one(2.0), None, one(5.0)]).unwrap();
    let mut filter = LinearFilter::<_, 1, 1>::new(RandomWalk::<1>::white(0.5), 2.0, []).unwrap();
    let found = track.log_likelihood(&mut filter).unwrap();
    // Started at 2 with variance 2, two seconds on, read with variance 2.
    let s: f64 = 2.0 + 0.5 * 2.0 + 2.0;
    let expected = -0.5 * (9.0 / s + (s * std::f64::consts::TAU).ln());
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
}

#[test]
fn what_the_tracks_do_not_tell_is_said() {
    let tracks = tracks([3.0, 3.0], 0.5, 2, 50);
    let idle = fit(&tracks, [1.0, 1.0, 1.0], |&[density, variance, _]| {
        LinearFilter::new(ConstantVelocity::<1>::white(density), variance, [1e3])
    })
    .unwrap();
    assert_eq!(idle.deviations, None);
}

struct Failing;

impl Candidate<1> for Failing {
    fn start(&mut self, _: &SVector<f64, 1>) -> pursuit_estimation::Result<()> {
        Ok(())
    }

    fn predict(&mut self, dt_s: f64) -> pursuit_estimation::Result<()> {
        Err(EstimationError::TimeStep { dt_s })
    }

    fn update(&mut self, _: &SVector<f64, 1>) -> pursuit_estimation::Result<f64> {
        Ok(0.0)
    }
}

#[test]
fn bad_tracks_and_guesses_are_refused() {
    let one = Some(SVector::<f64, 1>::new(1.0));
    assert!(matches!(Recording::new(vec![0.0], vec![one, one]), Err(EstimationError::Length { .. })));
    assert!(matches!(Recording::<1>::new(vec![0.0], vec![None]), Err(EstimationError::Length { .. })));
    assert!(matches!(Recording::new(vec![0.0, 0.0], vec![one, one]), Err(EstimationError::TimeStep { .. })));
    assert!(matches!(Recording::new(vec![f64::NAN], vec![one]), Err(EstimationError::NotFinite { .. })));
    let nan = Some(SVector::<f64, 1>::new(f64::NAN));
    assert!(matches!(Recording::new(vec![0.0], vec![nan]), Err(EstimationError::NotFinite { .. })));
    let tracks = [Recording::new(vec![0.0, 1.0], vec![one, one]).unwrap()];
    let build = |&[q]: &[f64; 1]| LinearFilter::<_, 1, 2>::new(ConstantVelocity::<1>::white(q), 1.0, [1.0]);
    assert!(matches!(fit(&[], [1.0], build), Err(EstimationError::Length { .. })));
    for guess in [0.0, -1.0, f64::NAN] {
        assert!(matches!(fit(&tracks, [guess], build), Err(EstimationError::Parameter { .. })));
    }
    assert!(matches!(fit(&tracks, [1.0], |_| Ok(Failing)), Err(EstimationError::TimeStep { .. })));
    let short = LinearFilter::<_, 1, 2>::new(ConstantVelocity::<1>::white(1.0), 1.0, []);
    assert!(matches!(short, Err(EstimationError::Length { got: 0, expected: 1, .. })), "{short:?}");
    assert!(ImmFilter::<_, 1, 2, 2>::new([ConstantVelocity::<1>::white(1.0); 2], [1.0, 0.0], 1.0, [1.0]).is_err());
}
