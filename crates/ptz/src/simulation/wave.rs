use super::random::Random;
use std::f64::consts::TAU;

/// A random motion of a colour: its periods lie within an octave to either side of its own. A pure function of time once made,
/// of mean 0 and root mean square 1.
#[derive(Debug, Clone)]
pub struct Wave {
    /// The rate, radians per second, and the phase, radians, of each of the swings that add up to it.
    swings: [(f64, f64); Wave::SWINGS],
}

impl Wave {
    /// So many that their sum is close to normal.
    const SWINGS: usize = 16;

    /// The motion of this period that comes next by `random`.
    pub fn new(random: &mut Random, period_s: f64) -> Self {
        // Each swing has its own part of the two octaves, so that no seed is much faster than another.
        let swings = std::array::from_fn(|k| {
            let octave = 2.0 * (k as f64 + random.unit()) / Self::SWINGS as f64 - 1.0;
            (TAU / period_s * octave.exp2(), TAU * random.unit())
        });
        Self { swings }
    }

    /// Where it is at a time, and how fast it changes, per second.
    pub fn at(&self, time_s: f64) -> (f64, f64) {
        let size = (2.0 / Self::SWINGS as f64).sqrt();
        self.swings.iter().fold((0.0, 0.0), |(value, speed), (rate, phase)| {
            let (sine, cosine) = (rate * time_s + phase).sin_cos();
            (value + size * sine, speed + size * rate * cosine)
        })
    }

    /// How fast it changes, root mean square, per second.
    pub fn speed(&self) -> f64 {
        (self.swings.iter().map(|(rate, _)| rate * rate).sum::<f64>() / Self::SWINGS as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_as_strong_and_fast_as_said() {
        let wave = Wave::new(&mut Random::new(3, 5), 4.0);
        let values: Vec<(f64, f64)> = (0..100_000).map(|k| wave.at(f64::from(k) * 0.05)).collect();
        let rms = |of: fn(&(f64, f64)) -> f64| {
            (values.iter().map(|v| of(v).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
        };
        assert!((rms(|v| v.0) - 1.0).abs() < 0.02, "{}", rms(|v| v.0));
        assert!((rms(|v| v.1) / wave.speed() - 1.0).abs() < 0.02, "{} {}", rms(|v| v.1), wave.speed());
        assert!((wave.speed() / (TAU / 4.0) - 1.16).abs() < 0.05, "{}", wave.speed());
    }

    #[test]
    fn its_speed_is_its_slope() {
        let wave = Wave::new(&mut Random::new(4, 5), 0.5);
        let slope = |t: f64| (wave.at(t + 1e-6).0 - wave.at(t - 1e-6).0) / 2e-6;
        assert!((0..200).map(|k| f64::from(k) * 0.13).all(|t| (slope(t) - wave.at(t).1).abs() < 1e-4));
    }

    #[test]
    fn seeds_swing_apart() {
        let at = |seed| Wave::new(&mut Random::new(seed, 5), 4.0).at(2.0);
        assert_eq!(at(1), at(1));
        assert_ne!(at(1), at(2));
    }
}
