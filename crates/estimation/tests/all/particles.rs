//! The particle filter against the independent reference, the Kalman filter, and itself.

use crate::common::{assert_close, assert_near, fixture, list, number, numbers, vector};
use nalgebra::{SMatrix, SVector};
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions, Resampling, effective_sample_size, systematic};
use pursuit_estimation::zhai2024::{
    LikelihoodNoiseFilter, VarianceParams, VarianceRule, bhattacharyya_coefficient, similarity_log_likelihood,
};
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel};

#[test]
fn systematic_resampling() {
    let data = fixture("systematic_resampling");
    let mut indices = Vec::new();
    for case in list(&data["cases"]) {
        let weights = numbers(&case["weights"]);
        systematic(&weights, number(&case["u"]), &mut indices).unwrap();
        let expected: Vec<usize> =
            list(&case["indices"]).iter().map(|index| index.as_u64().unwrap() as usize).collect();
        assert_eq!(indices, expected);
        assert_near("neff", effective_sample_size(&weights), number(&case["neff"]), 1e-12);
    }
}

#[test]
fn bhattacharyya_weights() {
    let data = fixture("bhattacharyya_pf");
    for case in list(&data["coefficients"]) {
        let rho = bhattacharyya_coefficient(&numbers(&case["p"]), &numbers(&case["q"])).unwrap();
        assert_near("rho", rho, number(&case["rho"]), 1e-12);
        assert_near("distance", (1.0 - rho).sqrt(), number(&case["distance"]), 1e-12);
    }
    let step = &data["step"];
    let target = numbers(&step["target"]);
    let states: Vec<SVector<f64, 2>> = list(&step["particles"]).iter().map(vector).collect();
    for result in list(&data["results"]) {
        let sigma_w = number(&result["sigma_w"]);
        let mut filter = ParticleFilter::from_states(states.clone(), ParticleOptions::default(), 0).unwrap();
        let rho: Vec<f64> = list(&step["hists"])
            .iter()
            .map(|hist| bhattacharyya_coefficient(&target, &numbers(hist)).unwrap())
            .collect();
        for (a, b) in rho.iter().zip(numbers(&result["rho"])) {
            assert_near("rho", *a, b, 1e-12);
        }
        let logs: Vec<f64> = rho.iter().map(|rho| similarity_log_likelihood(*rho, sigma_w)).collect();
        let normaliser = (std::f64::consts::TAU.sqrt() * sigma_w).ln();
        for (a, b) in logs.iter().zip(numbers(&result["w_raw"])) {
            assert_near("w raw", (a - normaliser).exp(), b, 1e-12);
        }
        filter.weigh(&logs).unwrap();
        for (a, b) in filter.weights().iter().zip(numbers(&result["w"])) {
            assert_near("w", *a, b, 1e-12);
        }
        assert_close("estimate", &filter.mean(), &vector(&result["estimate"]), 1e-9);
        assert_near("neff", filter.effective_sample_size(), number(&result["neff"]), 1e-9);
        let mut indices = Vec::new();
        systematic(filter.weights(), 0.3, &mut indices).unwrap();
        let expected: Vec<usize> =
            list(&result["indices_u03"]).iter().map(|index| index.as_u64().unwrap() as usize).collect();
        assert_eq!(indices, expected);
    }
}

/// On a linear Gaussian problem the Kalman filter is exact, and the particles must come close.
#[test]
fn follows_the_kalman_filter() {
    let step = ConstantVelocity::<2>::white(1.0).over(0.5).unwrap();
    let sensor = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let start = Gaussian::from_variances(SVector::zeros(), SVector::from([1.0, 1.0, 4.0, 4.0])).unwrap();
    for resampling in [Resampling::Systematic, Resampling::Stratified, Resampling::Residual, Resampling::Multinomial] {
        for regularisation in [0.0, 0.5] {
            let options = ParticleOptions { resampling, regularisation, ..ParticleOptions::default() };
            let mut particles = ParticleFilter::from_gaussian(20_000, &start, options, 5).unwrap();
            let mut exact = start;
            let mut resampled = 0;
            for k in 1..=12 {
                let t = f64::from(k);
                let z = SVector::from([0.6 * t + (2.1 * t).sin(), -0.3 * t + (1.3 * t).cos()]);
                exact.predict(&step).unwrap();
                let expected = exact.update(&sensor, &z).unwrap().log_likelihood();
                particles.predict(&step).unwrap();
                let evidence = particles
                    .weigh_by(|state| {
                        let miss = z - sensor.matrix() * state;
                        -0.5 * miss.norm_squared() - std::f64::consts::TAU.ln()
                    })
                    .unwrap();
                assert!((evidence - expected).abs() < 0.1, "evidence {evidence}, exact {expected}");
                resampled += usize::from(particles.resample_if_needed().unwrap());
            }
            assert!(resampled > 0);
            let belief = particles.to_gaussian();
            assert!((belief.mean() - exact.mean()).norm() < 0.1, "{resampling:?}");
            assert!(
                (belief.covariance() - exact.covariance()).norm() < 0.1 * exact.covariance().norm(),
                "{resampling:?} {regularisation}"
            );
        }
    }
}

#[test]
fn a_seed_decides_everything_whatever_the_threads() {
    let step = ConstantVelocity::<2>::white(1.0).over(0.5).unwrap();
    let start = Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let run = |seed, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut filter = ParticleFilter::from_gaussian(777, &start, ParticleOptions::default(), seed).unwrap();
            for k in 0..10 {
                filter.predict(&step).unwrap();
                filter.weigh_by(|state: &SVector<f64, 4>| -(state[0] - f64::from(k)).powi(2)).unwrap();
                filter.resample_if_needed().unwrap();
            }
            filter.states().to_vec()
        })
    };
    assert_eq!(run(1, 1), run(1, 3));
    assert_ne!(run(1, 1), run(2, 1));
}

#[test]
fn weights_survive_tiny_likelihoods_and_refuse_bad_ones() {
    let states = vec![SVector::<f64, 1>::new(0.0), SVector::<f64, 1>::new(1.0)];
    let mut filter = ParticleFilter::from_states(states, ParticleOptions::default(), 0).unwrap();
    let evidence = filter.weigh(&[-5000.0, -5000.0 + 3.0_f64.ln()]).unwrap();
    assert_near("w", filter.weights()[1], 0.75, 1e-12);
    assert_near("evidence", evidence, -5000.0 + 2.0_f64.ln(), 1e-12);
    let before = filter.weights().to_vec();
    let impossible = f64::NEG_INFINITY;
    for bad in [[f64::NAN, 0.0], [f64::INFINITY, 0.0], [impossible, impossible]] {
        assert!(filter.weigh(&bad).is_err());
    }
    assert!(filter.weigh(&[0.0]).is_err());
    assert!(filter.weigh_plain(&[-1.0, 1.0]).is_err());
    assert!(filter.weigh_plain(&[0.0, 0.0]).is_err());
    assert_eq!(filter.weights(), before);
    filter.weigh_plain(&[3.0, 1.0]).unwrap();
    assert_near("plain", filter.weights()[0], 0.5, 1e-12);
    assert_eq!(filter.heaviest()[0], 0.0);
}

/// The overlap of two 20 px squares whose centres are `away` apart, as the likelihood `√overlap` of the paper's toy.
fn similarity(away: &SVector<f64, 2>) -> f64 {
    const SIZE: f64 = 20.0;
    let share = |d: f64| (SIZE - d.abs()).max(0.0) / SIZE;
    (share(away[0]) * share(away[1])).sqrt()
}

struct Walk {
    root_mean_square_px: f64,
    lost: bool,
}

/// A target with an acceleration of .5 px/frame² root mean square (both axes together), followed for 80 frames by `count` particles.
fn follow(seed: u64, count: usize, params: VarianceParams) -> Walk {
    let mut truth = ParticleFilter::from_states(
        vec![SVector::from([100.0, 100.0, 2.0, 1.0])],
        ParticleOptions::default(),
        1000 + seed,
    )
    .unwrap();
    let step = ConstantVelocity::<2>::piecewise(0.125).over(1.0).unwrap();
    let options = ParticleOptions::default();
    let mut filter = LikelihoodNoiseFilter::new(count, SVector::from([100.0, 100.0]), params, options, seed).unwrap();
    let (mut sum, mut lost) = (0.0, false);
    for _ in 0..80 {
        truth.predict(&step).unwrap();
        let target = truth.states()[0].fixed_rows::<2>(0).into_owned();
        filter.predict(1.0).unwrap();
        let weighed =
            filter.particles_mut().weigh_by(|state| similarity_log_likelihood(similarity(&(state - target)), 0.15));
        weighed.unwrap();
        let found = filter.particles().mean();
        filter.correct(&found).unwrap();
        let error = (found - target).norm();
        sum += error * error;
        lost |= error > 20.0;
    }
    Walk { root_mean_square_px: (sum / 80.0).sqrt(), lost }
}

/// The bar of `zhai2024`: 20 particles with learnt noise do no worse than 100 with fixed noise on smooth motion, and lose
/// nothing; with the recursion as printed, ten particles are lost.
#[test]
fn zhai2024_few_particles_suffice() {
    let fixed = VarianceParams { rule: VarianceRule::Corrected, floor: 225.0, cap: 225.0 };
    let learnt = VarianceParams { rule: VarianceRule::Corrected, floor: 1.0, cap: 100.0 };
    let printed = VarianceParams { rule: VarianceRule::Printed, floor: 1.0, cap: f64::MAX };
    let all = |count, params| -> (f64, usize) {
        let runs: Vec<Walk> = (0..100).map(|seed| follow(seed, count, params)).collect();
        let kept: Vec<f64> = runs.iter().filter(|run| !run.lost).map(|run| run.root_mean_square_px).collect();
        (kept.iter().sum::<f64>() / kept.len().max(1) as f64, runs.len() - kept.len())
    };
    let (few, few_lost) = all(20, learnt);
    let (many, _) = all(100, fixed);
    let (_, printed_lost) = all(10, printed);
    let (_, learnt_lost) = all(10, learnt);
    println!("20 learnt: {few:.3} px, {few_lost} lost; 100 fixed: {many:.3} px");
    println!("10 learnt: {learnt_lost} lost; 10 printed: {printed_lost} lost");
    assert_eq!(few_lost, 0);
    assert!(few <= many, "{few} against {many}");
    assert!(printed_lost >= 71 && learnt_lost <= 20, "{printed_lost}, {learnt_lost}");
}

/// What is better known than the last two positions moves the particles; what was found for certain tells where they are.
#[test]
fn zhai2024_particles_go_where_they_are_told() {
    let params = VarianceParams { rule: VarianceRule::Corrected, floor: 1e-12, cap: 1.0 };
    let start = SVector::from([50.0, 40.0]);
    let mut filter = LikelihoodNoiseFilter::new(8, start, params, ParticleOptions::default(), 3).unwrap();
    filter.predict_by(&SVector::from([3.0, -2.0]), 0.5).unwrap();
    assert!((filter.predicted_px() - SVector::from([53.0, 38.0])).norm() < 1e-12);
    assert!((filter.particles().mean() - SVector::from([53.0, 38.0])).norm() < 1e-5);
    let spread = filter.particles().states()[0] - filter.particles().states()[1];
    filter.center_on(&SVector::from([10.0, 20.0])).unwrap();
    assert!((filter.particles().mean() - SVector::from([10.0, 20.0])).norm() < 1e-9);
    assert!((filter.particles().states()[0] - filter.particles().states()[1] - spread).norm() < 1e-9);
    assert!(filter.center_on(&SVector::from([f64::NAN, 0.0])).is_err() && filter.predict_by(&start, 0.0).is_err());
    // The velocity is that of the positions found: 50 to 53 px, 40 to 38 px, in half a second.
    filter.correct(&SVector::from([53.0, 38.0])).unwrap();
    filter.predict(1.0).unwrap();
    assert!((filter.predicted_px() - SVector::from([59.0, 34.0])).norm() < 1e-12);
    // A copy made over another one goes on alike.
    let mut copy = LikelihoodNoiseFilter::new(8, start, params, ParticleOptions::default(), 9).unwrap();
    copy.clone_from(&filter);
    copy.predict(0.25).unwrap();
    filter.predict(0.25).unwrap();
    assert_eq!(copy.particles().states(), filter.particles().states());
    assert_eq!((copy.predicted_px(), copy.variance_px2()), (filter.predicted_px(), filter.variance_px2()));
}
