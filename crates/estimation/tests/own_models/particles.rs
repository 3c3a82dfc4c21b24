//! Particles.

use super::*;

/// Two thousand particles on a linear model. Their sampling error adds about one part in the effective number to mean and
/// covariance, a tenth of the band's width.
#[test]
#[ignore = "release: 20 000 runs of 2000 particles"]
fn particles() {
    let step = RandomWalk::<1>::white(1.0).over(1.0).unwrap();
    let sensor = LinearMeasurement::<1, 1>::select([0], [1.0]).unwrap();
    let start = unit::<1>();
    consistent("particles", [1, 1], |random| {
        let (mut state, mut nis) = (random.draw(&start), 0.0);
        let seed = random.0.next_u64();
        let mut filter = ParticleFilter::from_gaussian(2000, &start, ParticleOptions::default(), seed).unwrap();
        for _ in 0..6 {
            state = random.moved(&step, &state);
            filter.predict(&step).unwrap();
            let z = random.measured(&sensor, &state);
            nis = filter.to_gaussian().innovation(&sensor, &z).unwrap().nis();
            let likelihoods: Vec<f64> = filter.states().iter().map(|x| -0.5 * (z[0] - x[0]).powi(2)).collect();
            filter.weigh(&likelihoods).unwrap();
            filter.resample_if_needed().unwrap();
        }
        [filter.to_gaussian().nees(&state).unwrap(), nis]
    });
}
