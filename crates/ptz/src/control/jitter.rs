use crate::Direction;

/// How much the delays of commands and of pictures vary, measured from how far sightings are off what was expected.
///
/// The variance of an innovation is `S = S₀ + σ_c² D + σ_p² R`: `D` is what [`HeadModel::drift`](super::HeadModel::drift) says
/// of the commands since the sighting before, `R` the square of the speed at which the target passes through the picture. Each
/// `σ²` maximises the likelihood of the recent innovations by the method of scoring: the mean of `(e² − S) / D + σ²` weighted by
/// `(D / S)²`, with older ones forgotten (Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE
/// Transactions on Automatic Control 15, 1970, states the problem).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter {
    commands: Variance,
    pictures: Variance,
    measured: bool,
}

impl Jitter {
    /// Delays of commands and ages of pictures that vary by so much, one standard deviation; measured from then on where so wanted.
    pub const fn new(commands_s: f64, pictures_s: f64, measured: bool) -> Self {
        Self { commands: Variance::new(commands_s), pictures: Variance::new(pictures_s), measured }
    }

    /// Of commands, one standard deviation, seconds.
    pub fn commands_s(&self) -> f64 {
        self.commands.value.sqrt()
    }

    /// Of pictures, one standard deviation, seconds.
    pub fn pictures_s(&self) -> f64 {
        self.pictures.value.sqrt()
    }

    pub(super) fn drift_deg2(&self, drift: Direction) -> Direction {
        Direction::new(self.commands.value * drift.pan_deg, self.commands.value * drift.tilt_deg)
    }

    pub(super) fn blur_deg2(&self, passing_deg_s: Direction) -> Direction {
        let of = |speed: f64| self.pictures.value * speed * speed;
        Direction::new(of(passing_deg_s.pan_deg), of(passing_deg_s.tilt_deg))
    }

    /// Takes note of the square of an innovation and of the variance expected of it, degrees².
    pub(super) fn learn(&mut self, square: f64, expected: f64, drift: f64, passing: f64, dt: f64) {
        if self.measured && expected > 0.0 && square.is_finite() {
            // One outlier is not to outweigh all else.
            let surprise = square.min(Self::MOST_SURPRISING * expected) - expected;
            self.commands.learn(surprise, expected, drift, dt);
            self.pictures.learn(surprise, expected, passing, dt);
        }
    }

    /// A square of an innovation counts as no more than that many times what was expected of it.
    const MOST_SURPRISING: f64 = 9.0;
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Variance {
    /// The variance, seconds².
    value: f64,
    weighted: f64,
    weight: f64,
}

impl Variance {
    /// How long a measurement counts, seconds.
    const MEMORY_S: f64 = 8.0;
    /// What is known before counts as much as measurements of this weight.
    const KNOWN: f64 = 20.0;
    /// The least and the greatest variance believed, seconds².
    const RANGE: [f64; 2] = [1e-6, 0.09];

    const fn new(sigma_s: f64) -> Self {
        let value = sigma_s * sigma_s;
        let scale = if value > 1e-4 { value } else { 1e-4 };
        // A weight is (D / S)², 1 / value² where a jitter of that size is all that was expected.
        let weight = Self::KNOWN / (scale * scale) * 0.01;
        Self { value, weighted: value * weight, weight }
    }

    fn learn(&mut self, surprise: f64, expected: f64, slope: f64, dt: f64) {
        if slope <= 0.0 {
            return;
        }
        let keeps = (-dt.max(0.0) / Self::MEMORY_S).exp();
        let weight = (slope / expected).powi(2);
        self.weighted = keeps * self.weighted + weight * (surprise / slope + self.value);
        self.weight = keeps * self.weight + weight;
        let [least, most] = Self::RANGE;
        self.value = (self.weighted / self.weight).clamp(least, most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is measured of innovations whose variance is `0.04 + 100 sigma²`, beginning from `start_s`.
    fn measured(sigma_s: f64, start_s: f64) -> f64 {
        let mut jitter = Jitter::new(start_s, 0.5 * start_s, true);
        let truth = 0.04 + 100.0 * sigma_s * sigma_s;
        for k in 0..5000_u32 {
            // Squares of a normal quantity at its deciles, the outermost left out.
            let square = truth * [0.02, 0.15, 0.45, 1.07, 3.31][(k % 5) as usize];
            let expected = 0.04 + jitter.drift_deg2(Direction::new(100.0, 0.0)).pan_deg;
            jitter.learn(square, expected, 100.0, 0.0, 0.04);
        }
        jitter.commands_s()
    }

    #[test]
    fn jitter_is_found_from_either_side() {
        for start in [0.0, 0.05, 0.2] {
            assert!((measured(0.08, start) - 0.08).abs() < 0.02, "{start}: {}", measured(0.08, start));
        }
        assert!(measured(0.0, 0.1) < 0.01, "{}", measured(0.0, 0.1));
    }

    #[test]
    fn what_is_not_to_be_measured_stays() {
        let mut fixed = Jitter::new(0.07, 0.07, false);
        fixed.learn(900.0, 1.0, 100.0, 100.0, 0.04);
        assert_eq!(fixed, Jitter::new(0.07, 0.07, false));
        let mut bad = Jitter::new(0.07, 0.07, true);
        bad.learn(f64::NAN, 1.0, 100.0, 100.0, 0.04);
        bad.learn(1.0, 0.0, 100.0, 100.0, 0.04);
        assert_eq!(bad, Jitter::new(0.07, 0.07, true));
    }
}
