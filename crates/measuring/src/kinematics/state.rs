//! Position, velocity and acceleration with their covariance, and what follows from them.

use nalgebra::{SMatrix, SVector, Vector2};

/// Position, velocity and acceleration in the plane: `[x, y, vx, vy, ax, ay]` in the ruler's unit and seconds, with their
/// covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    mean: SVector<f64, 6>,
    covariance: SMatrix<f64, 6, 6>,
}

impl State {
    pub(crate) const fn new(mean: SVector<f64, 6>, covariance: SMatrix<f64, 6, 6>) -> Self {
        Self { mean, covariance }
    }

    /// Adds the squares of errors that are common to all.
    pub(crate) fn add(&mut self, changes: &[SVector<f64, 6>]) {
        for change in changes {
            self.covariance += change * change.transpose();
        }
    }

    /// `[x, y, vx, vy, ax, ay]`.
    pub const fn mean(&self) -> &SVector<f64, 6> {
        &self.mean
    }

    /// The covariance of [`mean`](Self::mean).
    pub const fn covariance(&self) -> &SMatrix<f64, 6, 6> {
        &self.covariance
    }

    /// Position, in the ruler's unit.
    pub fn position(&self) -> [f64; 2] {
        [self.mean[0], self.mean[1]]
    }

    /// Velocity, in the unit a second.
    pub fn velocity(&self) -> [f64; 2] {
        [self.mean[2], self.mean[3]]
    }

    /// Acceleration, in the unit a square second.
    pub fn acceleration(&self) -> [f64; 2] {
        [self.mean[4], self.mean[5]]
    }

    /// The standard deviation of component `i` of [`mean`](Self::mean), 0 to 5; of others none.
    pub fn deviation(&self, i: usize) -> f64 {
        self.covariance.get((i, i)).map_or(f64::NAN, |v| v.max(0.0).sqrt())
    }

    /// Speed and its standard deviation.
    pub fn speed(&self) -> (f64, f64) {
        self.magnitude(2)
    }

    /// How large the acceleration is, and the standard deviation of that.
    pub fn acceleration_magnitude(&self) -> (f64, f64) {
        self.magnitude(4)
    }

    /// The direction of motion in degrees from x toward y, −180 to 180, and its standard deviation; none where the speed is
    /// less than twice as large as its error, so that there is no direction.
    pub fn heading_deg(&self) -> Option<(f64, f64)> {
        let v = self.part(2);
        let speed = v.norm();
        let across = Vector2::new(-v.y, v.x) / speed;
        let (along, error) = self.magnitude(2);
        let sideways = self.spread(2, &across);
        (speed > 0.0 && along > 2.0 * error.max(sideways))
            .then(|| (v.y.atan2(v.x).to_degrees(), (sideways / speed).to_degrees()))
    }

    fn part(&self, first: usize) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(first).into_owned()
    }

    /// The standard deviation along a direction of the pair of components from `first` on.
    fn spread(&self, first: usize, direction: &Vector2<f64>) -> f64 {
        let block = self.covariance.fixed_view::<2, 2>(first, first);
        (direction.transpose() * block * direction)[0].max(0.0).sqrt()
    }

    fn magnitude(&self, first: usize) -> (f64, f64) {
        let v = self.part(first);
        let size = v.norm();
        if size > 0.0 {
            return (size, self.spread(first, &(v / size)));
        }
        (0.0, 0.5 * (self.deviation(first) + self.deviation(first + 1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_and_heading_follow_the_velocity() {
        let mut variances = SVector::<f64, 6>::repeat(1.0);
        (variances[2], variances[3]) = (0.04, 0.01);
        let state = State::new(SVector::from([1.0, 2.0, 3.0, 0.0, 0.0, -9.0]), SMatrix::from_diagonal(&variances));
        assert_eq!(state.speed(), (3.0, 0.2));
        let (heading, error) = state.heading_deg().unwrap();
        assert!(heading == 0.0 && (error - (0.1_f64 / 3.0).to_degrees()).abs() < 1e-12);
        assert_eq!(state.acceleration_magnitude(), (9.0, 1.0));
        let still = State::new(SVector::zeros(), SMatrix::from_diagonal(&variances));
        assert!(still.heading_deg().is_none() && still.speed().0 == 0.0 && still.speed().1 > 0.0);
        assert!(state.deviation(9).is_nan());
    }
}
