//! Linear filters.

use super::*;

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn kalman_in_joseph_and_square_root_form() {
    let plain = |step: Transition<4>, sensor: LinearMeasurement<2, 4>| {
        move |belief: &mut Gaussian<4>, z: &SVector<f64, 2>| {
            belief.predict(&step).unwrap();
            belief.update(&sensor, z).unwrap()
        }
    };
    let (step, sensor, start) = (cv(), position(), unit::<4>());
    linear("Kalman, components", (&step, &sensor), (&start, &start), plain(step, sensor), |b| *b);
    // Correlated noise is taken in at once, in Joseph form.
    let correlated = sensor.with_noise(SMatrix::<f64, 2, 2>::new(1.0, 0.6, 0.6, 2.0)).unwrap();
    linear("Kalman, Joseph", (&step, &correlated), (&start, &start), plain(step, correlated), |b| *b);
    let root = SquareRoot::new(&start).unwrap();
    let go = |filter: &mut SquareRoot<4>, z: &SVector<f64, 2>| {
        filter.predict(&step).unwrap();
        filter.update(&correlated, z).unwrap()
    };
    linear("square root", (&step, &correlated), (&start, &root), go, SquareRoot::to_gaussian);
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn constant_acceleration_of_qu2010() {
    let params = Qu2010Params::printed();
    let (step, sensor, start) = (params.motion().over(1.0).unwrap(), params.measurement().unwrap(), unit::<6>());
    let go = |belief: &mut Gaussian<6>, z: &SVector<f64, 2>| {
        belief.predict(&step).unwrap();
        belief.update(&sensor, z).unwrap()
    };
    linear("qu2010", (&step, &sensor), (&start, &start), go, |b| *b);
}

/// Memory that fades by α is exact for a target whose process noise is `Q + (α² − 1) F P Fᵀ`, with the filter's own `P`,
/// which does not depend on the data.
#[test]
#[ignore = "release: 20 000 runs"]
fn fading_memory() {
    const ALPHA: f64 = 1.05;
    let (step, sensor, start) = (cv(), position(), unit::<4>());
    consistent("fading memory", [4, 2], |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        for _ in 0..STEPS {
            let forgotten = step.matrix() * belief.covariance() * step.matrix().transpose() * (ALPHA * ALPHA - 1.0);
            state = random.moved(&step, &state) + random.noise(&forgotten);
            belief.predict_fading(&step, ALPHA).unwrap();
            nis = belief.update(&sensor, &random.measured(&sensor, &state)).unwrap().nis();
        }
        [belief.nees(&state).unwrap(), nis]
    });
}

/// The fixed gain, started from its own stationary error.
#[test]
#[ignore = "release: 20 000 runs"]
fn steady_state() {
    let (step, sensor) = (cv(), position());
    let gain = SteadyState::solve(&step, &sensor).unwrap();
    let settled = Gaussian::new(SVector::zeros(), gain.posterior_covariance).unwrap();
    let expected = sensor.matrix() * gain.prior_covariance * sensor.matrix().transpose() + sensor.noise();
    consistent("steady state", [4, 2], |random| {
        let (mut state, mut estimate, mut nis) = (random.draw(&settled), SVector::<f64, 4>::zeros(), 0.0);
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            let z = random.measured(&sensor, &state);
            let prior = gain.step(&mut estimate, &z).unwrap();
            nis = Innovation::new(z - sensor.matrix() * prior, expected).unwrap().nis();
        }
        [Gaussian::new(estimate, gain.posterior_covariance).unwrap().nees(&state).unwrap(), nis]
    });
}

/// NEES of the smoothed belief half-way; NIS of the filter's last step.
#[test]
#[ignore = "release: 20 000 runs"]
fn smoother() {
    let (step, sensor, start) = (cv(), position(), unit::<4>());
    consistent("smoother", [4, 2], |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        let (mut states, mut beliefs) = (vec![], vec![]);
        for _ in 0..STEPS {
            state = random.moved(&step, &state);
            belief.predict(&step).unwrap();
            nis = belief.update(&sensor, &random.measured(&sensor, &state)).unwrap().nis();
            states.push(state);
            beliefs.push(belief);
        }
        smooth(&mut beliefs, &[step; STEPS - 1]).unwrap();
        [beliefs[STEPS / 2].nees(&states[STEPS / 2]).unwrap(), nis]
    });
}
