//! What an audit on cases that nothing was built on found, kept from coming back.

use nalgebra::{SMatrix, SVector, matrix, vector};
use pursuit_estimation::filters::SquareRoot;
use pursuit_estimation::nonlinear::{LinearizedSensor, NonlinearSensor, Unscented};
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions, multinomial, residual, stratified, systematic};
use pursuit_estimation::{EstimationError, Gaussian, Imm, LinearMeasurement, Switching, Transition};

/// Two readings of one component: the exact answer is that of one reading of half the noise.
const SHARP: [(f64, f64); 3] = [(1e6, 1e-10), (1e8, 1e-8), (1e12, 1e-12)];

fn believed(variance: f64) -> Gaussian<2> {
    Gaussian::from_variances(vector![0.0, 5.0], vector![variance, 1.0]).unwrap()
}

/// Mean and variance that two readings 2 and 4 of equal noise leave.
#[track_caller]
fn sharp(what: &str, belief: &Gaussian<2>, p: f64, r: f64) {
    let variance = 1.0 / (1.0 / p + 2.0 / r);
    assert!((belief.mean()[0] - 3.0).abs() < 1e-6, "{what}: {}", belief.mean());
    assert!((belief.covariance()[(0, 0)] / variance - 1.0).abs() < 1e-6, "{what}: {}", belief.covariance());
    assert_eq!(belief.mean()[1], 5.0);
    assert!((belief.covariance()[(1, 1)] - 1.0).abs() < 1e-12);
    assert!(belief.factor().is_ok());
}

#[test]
fn a_component_read_twice_by_sharp_sensors() {
    for (p, r) in SHARP {
        let sensor = LinearMeasurement::<2, 2>::select([0, 0], [r, r]).unwrap();
        let z = vector![2.0, 4.0];
        let mut plain = believed(p);
        let innovation = plain.update(&sensor, &z).unwrap();
        sharp("by components", &plain, p, r);
        assert_eq!(*innovation.residual(), z);
        // ν = (2, 4) splits into a sum, of variance 4 P + 2 R, and a difference, of variance 2 R.
        let expected = 36.0 / (4.0 * p + 2.0 * r) + 4.0 / (2.0 * r);
        assert!((innovation.nis() / expected - 1.0).abs() < 1e-6, "{} {expected}", innovation.nis());

        let mut root = SquareRoot::new(&believed(p)).unwrap();
        root.update(&sensor, &z).unwrap();
        // The factor holds half the digits of the variance's range.
        let after = root.to_gaussian();
        assert!((after.mean()[0] - 3.0).abs() < 1e-3, "{}", after.mean());
        assert!((after.covariance()[(0, 0)] / (0.5 * r) - 1.0).abs() < 1e-3, "{}", after.covariance());

        // Not component by component: the rows are scaled, and so is the noise.
        let scaled = LinearMeasurement::new(sensor.matrix() * 2.0, sensor.noise() * 4.0).unwrap();
        let before = believed(p);
        let mut joseph = before;
        let innovation = joseph.update(&scaled, &(z * 2.0)).unwrap();
        sharp("at once", &joseph, p, r);
        assert!((innovation.nis() / expected - 1.0).abs() < 1e-6, "{} {expected}", innovation.nis());
        assert_eq!(before.innovation(&scaled, &(z * 2.0)).unwrap(), innovation);
        let gain = before.gain(&scaled).unwrap();
        for weight in gain.row(0).iter() {
            assert!((weight - 0.25).abs() < 1e-6, "{gain}");
        }
        // And with noise that is correlated.
        let tied = scaled.with_noise(matrix![1.0, 0.5; 0.5, 1.0] * r).unwrap();
        let mut after = before;
        after.update(&tied, &vector![4.0, 8.0]).unwrap();
        assert!((after.mean()[0] - 3.0).abs() < 1e-6);
        // (Σ R⁻¹)⁻¹ = r (1 + ρ) / 2, over the scale squared.
        assert!((after.covariance()[(0, 0)] / (r * 1.5 / 8.0) - 1.0).abs() < 1e-6, "{}", after.covariance());
    }
}

struct Twice(f64);

impl NonlinearSensor<2, 2> for Twice {
    fn expected(&self, state: &SVector<f64, 2>) -> SVector<f64, 2> {
        vector![state[0], state[0]]
    }

    fn noise(&self) -> SMatrix<f64, 2, 2> {
        SMatrix::identity() * self.0
    }
}

impl LinearizedSensor<2, 2> for Twice {
    fn jacobian(&self, _: &SVector<f64, 2>) -> SMatrix<f64, 2, 2> {
        matrix![1.0, 0.0; 1.0, 0.0]
    }
}

#[test]
fn the_nonlinear_filters_take_sharp_sensors_too() {
    for (p, r) in SHARP {
        let mut extended = believed(p);
        extended.update_extended(&Twice(r), &vector![2.0, 4.0]).unwrap();
        sharp("extended", &extended, p, r);
        for alpha in [0.5, 1.0] {
            let shape = Unscented { alpha, ..Unscented::default() };
            let mut unscented = believed(p);
            unscented.update_unscented(&Twice(r), &vector![2.0, 4.0], &shape).unwrap();
            assert!((unscented.mean()[0] - 3.0).abs() < 1e-3, "{}", unscented.mean());
            assert!((unscented.covariance()[(0, 0)] / (0.5 * r) - 1.0).abs() < 1e-3, "{}", unscented.covariance());
        }
    }
}

#[test]
fn perfect_sensors_that_repeat_each_other_are_still_singular() {
    let perfect = LinearMeasurement::<2, 2>::select([0, 0], [0.0, 0.0]).unwrap();
    let scaled = LinearMeasurement::new(perfect.matrix() * 2.0, SMatrix::zeros()).unwrap();
    for sensor in [perfect, scaled] {
        let mut it = believed(1e6);
        let result = it.update(&sensor, &vector![1.0, 1.0]);
        assert!(matches!(result, Err(EstimationError::SingularInnovation { row: 1, .. })), "{result:?}");
        assert_eq!(it, believed(1e6));
        let mut root = SquareRoot::new(&it).unwrap();
        let result = root.update(&sensor, &vector![1.0, 1.0]);
        assert!(matches!(result, Err(EstimationError::SingularInnovation { row: 1, .. })), "{result:?}");
    }
    // Two components so alike that the first leaves nothing of the second but rounding.
    let mut alike = Gaussian::new(vector![0.0, 0.0], matrix![1e6, 1e6; 1e6, 1e6 + 1e-8])
        .unwrap_or_else(|_| Gaussian::new(vector![0.0, 0.0], matrix![1e6, 1e6 - 1e-6; 1e6 - 1e-6, 1e6]).unwrap());
    let sensor = LinearMeasurement::<2, 2>::select([0, 1], [1e-12, 1e-12]).unwrap();
    if alike.update(&sensor, &vector![1.0, 1.0]).is_ok() {
        assert!(alike.covariance().diagonal().iter().all(|variance| *variance > 0.0), "{}", alike.covariance());
    }
}

#[test]
fn an_imm_is_not_poisoned_by_what_is_infinitely_far_away() {
    let start = Gaussian::<2>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let sensor = LinearMeasurement::<2, 2>::select([0, 1], [1.0, 1.0]).unwrap();
    for far in [1e155, 1e300, f64::MAX] {
        let mut imm = Imm::new(start, [0.5, 0.5]).unwrap();
        let result = imm.update(&sensor, &vector![far, 0.0]);
        assert!(matches!(result, Err(EstimationError::Impossible { hypothesis: "mode" })), "{result:?}");
        assert_eq!(imm, Imm::new(start, [0.5, 0.5]).unwrap());
        // Just near enough, it goes on.
        assert!(imm.update(&sensor, &vector![1e150, 0.0]).unwrap().is_finite());
        assert!((imm.probabilities().sum() - 1.0).abs() < 1e-12);
    }
    // Modes so far apart that their mixture has no finite covariance.
    let at = |x: f64| Gaussian::<2>::new(vector![x, 0.0], SMatrix::identity()).unwrap();
    let apart = Imm::from_beliefs([at(1e160), at(-1e160)], [0.5, 0.5]);
    assert!(matches!(apart, Err(EstimationError::Overflow { .. })), "{apart:?}");
    let mut imm = Imm::from_beliefs([at(1e100), at(-1e100)], [0.5, 0.5]).unwrap();
    let stretch = Transition::new(SMatrix::<f64, 2, 2>::identity() * 1e60, SMatrix::zeros()).unwrap();
    let stay = Switching::per_step(SMatrix::<f64, 2, 2>::identity()).unwrap();
    let result = imm.predict(&[stretch, stretch], &stay);
    assert!(matches!(result, Err(EstimationError::Overflow { .. })), "{result:?}");
    assert_eq!(imm.beliefs()[0], at(1e100));
}

#[test]
fn a_lost_target_and_a_broken_likelihood_are_two_errors() {
    let start = Gaussian::<2>::new(SVector::zeros(), SMatrix::identity()).unwrap();
    let mut filter = ParticleFilter::from_gaussian(20, &start, ParticleOptions::default(), 1).unwrap();
    let lost = filter.weigh(&[f64::NEG_INFINITY; 20]).unwrap_err();
    let broken = filter.weigh(&[f64::NAN; 20]).unwrap_err();
    assert_eq!(lost, EstimationError::Impossible { hypothesis: "particle" });
    assert!(matches!(broken, EstimationError::NotFinite { .. }));
    assert!(lost.to_string().contains("start again from a detection"), "{lost}");
    assert!(broken.to_string().contains("likelihood is NaN or infinite"), "{broken}");
    let negative = filter.weigh_plain(&[-0.5; 20]).unwrap_err();
    assert!(matches!(negative, EstimationError::Parameter { value: -0.5, .. }), "{negative}");
    let index = LinearMeasurement::<1, 4>::select([7], [1.0]).unwrap_err();
    assert_eq!(index.to_string(), "the measured component 7 does not exist: indices are 0-based and below 4");
}

#[test]
fn resampling_takes_distributions_only() {
    let mut indices = Vec::new();
    let bad: [&[f64]; 7] =
        [&[], &[f64::NAN, 1.0], &[1.5, -0.5], &[0.0, 0.0], &[0.5, 0.4], &[2.0, 2.0], &[f64::INFINITY, 0.0]];
    for weights in bad {
        assert!(systematic(weights, 0.5, &mut indices).is_err(), "{weights:?}");
        assert!(stratified(weights, || 0.5, &mut indices).is_err(), "{weights:?}");
        assert!(residual(weights, 0.5, &mut indices).is_err(), "{weights:?}");
        assert!(multinomial(weights, || 0.5, &mut indices).is_err(), "{weights:?}");
    }
    // Rounding is not refused.
    let weights = vec![1.0 / 30_000.0; 30_000];
    systematic(&weights, 0.5, &mut indices).unwrap();
    assert_eq!(indices.len(), weights.len());
}
