//! A belief about a box whose axes know nothing of each other.

use nalgebra::{SMatrix, SVector};

use super::PhysicalBox;
use crate::error::require;
use crate::matrix::PIVOT_ROUNDING;
use crate::prediction::SAFE;
use crate::{EstimationError, Gaussian, MotionModel, Result};

/// A [`Gaussian`] about `[x, y, vx, vy, w, h]` in which no axis is correlated with another: fourteen numbers in place of 42. What
/// [`PhysicalBox`] predicts and its sensor corrects stays so.
///
/// Steps are those of the Gaussian to the last bit, without its zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApartBox {
    mean: [f64; 6],
    /// Of x and of y.
    moving: [Moving; 2],
    /// Variances of width and height.
    size: [f64; 2],
}

/// What is known of a position and its velocity, or what a step adds to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moving {
    /// Variance of the position.
    pub place: f64,
    /// Covariance of position and velocity.
    pub both: f64,
    /// Variance of the velocity.
    pub speed: f64,
}

impl From<ApartBox> for Gaussian<6> {
    fn from(belief: ApartBox) -> Self {
        let mut p = SMatrix::<f64, 6, 6>::zeros();
        for (axis, Moving { place, both, speed }) in belief.moving.into_iter().enumerate() {
            p[(axis, axis)] = place;
            (p[(axis, axis + 2)], p[(axis + 2, axis)]) = (both, both);
            p[(axis + 2, axis + 2)] = speed;
            p[(axis + 4, axis + 4)] = belief.size[axis];
        }
        Self::trusted(SVector::from(belief.mean), p)
    }
}

impl ApartBox {
    /// A belief whose components are independent, with the variances given: see [`Gaussian::from_variances`].
    ///
    /// # Errors
    /// Where a number is not finite or a variance is not positive.
    pub fn from_variances(mean: [f64; 6], variances: [f64; 6]) -> Result<Self> {
        let sound = mean.iter().all(|v| v.is_finite()) && variances.iter().all(|v| v.is_finite() && *v > 0.0);
        if !sound {
            // The general way says what is wrong.
            Gaussian::from_variances(mean.into(), variances.into())?;
        }
        let [x, y, vx, vy, w, h] = variances;
        let moving = |place, speed| Moving { place, both: 0.0, speed };
        Ok(Self { mean, moving: [moving(x, vx), moving(y, vy)], size: [w, h] })
    }

    /// The same belief; `None` where two axes are correlated.
    pub fn of(belief: &Gaussian<6>) -> Option<Self> {
        let p = belief.covariance();
        let own = |r: usize, c: usize| r == c || (r < 4 && r.abs_diff(c) == 2);
        let apart = (0..6).all(|r| (0..r).all(|c| own(r, c) || p[(r, c)] == 0.0));
        let moving =
            |axis: usize| Moving { place: p[(axis, axis)], both: p[(axis, axis + 2)], speed: p[(axis + 2, axis + 2)] };
        let mean = (*belief.mean()).into();
        apart.then(|| Self { mean, moving: [moving(0), moving(1)], size: [p[(4, 4)], p[(5, 5)]] })
    }

    /// The expected `[x, y, vx, vy, w, h]`.
    pub const fn mean(&self) -> &[f64; 6] {
        &self.mean
    }

    /// Variances of `[x, y, w, h]`.
    pub const fn variances(&self) -> [f64; 4] {
        [self.moving[0].place, self.moving[1].place, self.size[0], self.size[1]]
    }

    /// Moves the belief `dt_s` seconds on: see [`Gaussian::predict`].
    ///
    /// # Errors
    /// As [`PhysicalBox::over`](MotionModel::over), and where the result overflows; the belief is then as it was.
    #[inline]
    pub fn predict(&mut self, model: &PhysicalBox, dt_s: f64) -> Result<()> {
        let (added, size) = model.added(dt_s)?;
        let [x, y, vx, vy, w, h] = self.mean;
        let [of_x, of_y] = self.moving;
        let trace = of_x.place + of_y.place + of_x.speed + of_y.speed + self.size[0] + self.size[1];
        let far = x.abs() + y.abs() + vx.abs() + vy.abs() + w.abs() + h.abs();
        let growth = 1.0 + dt_s;
        let noise = 2.0 * (added.place + added.speed + size);
        // Written so that NaN is not safe.
        let safe = growth * (growth * trace + far) + noise < SAFE;
        if !safe {
            let mut whole = Gaussian::from(*self);
            whole.predict(&model.over(dt_s)?)?;
            // What was apart stays so.
            *self = Self::of(&whole).unwrap_or(*self);
            return Ok(());
        }
        self.mean[0] += vx * dt_s;
        self.mean[1] += vy * dt_s;
        for moving in &mut self.moving {
            let Moving { place, both, speed } = *moving;
            let moved = both + speed * dt_s;
            moving.place = place + both * dt_s + moved * dt_s + added.place;
            moving.both = moved + added.both;
            moving.speed = speed + added.speed;
        }
        self.size.iter_mut().for_each(|variance| *variance += size);
        Ok(())
    }

    /// Corrects the belief by a measured `[x, y, w, h]` with the variances of position and size given: see [`Gaussian::update`].
    ///
    /// # Errors
    /// Where a number is not finite or a variance is negative, and where nothing is left to be divided by; the belief is then as it was.
    #[inline]
    pub fn update(&mut self, [position, size]: [f64; 2], seen: [f64; 4]) -> Result<()> {
        let mut after = *self;
        let finite = seen.iter().all(|v| v.is_finite());
        if !finite {
            return Err(EstimationError::NotFinite { what: "the measurement" });
        }
        if !(position >= 0.0 && size >= 0.0) {
            require("the variance of a measured position", position, position >= 0.0, "zero or more")?;
            require("the variance of a measured size", size, size >= 0.0, "zero or more")?;
        }
        for axis in 0..2 {
            let Moving { place, both, speed } = self.moving[axis];
            let step = Step::new(axis, place, position)?;
            let unexpected = (seen[axis] - self.mean[axis]) * step.inverse;
            after.mean[axis] += place * unexpected;
            after.mean[axis + 2] += both * unexpected;
            after.moving[axis] = Moving {
                place: place * step.kept,
                both: both * step.kept,
                speed: speed - (both * both) * step.inverse,
            };
            let step = Step::new(axis + 2, self.size[axis], size)?;
            after.mean[axis + 4] += self.size[axis] * ((seen[axis + 2] - self.mean[axis + 4]) * step.inverse);
            after.size[axis] = self.size[axis] * step.kept;
        }
        let speeds = after.moving.iter().map(|m| m.speed).sum::<f64>();
        if !(after.mean.iter().sum::<f64>() + after.variances().iter().sum::<f64>() + speeds).is_finite() {
            return Err(EstimationError::Overflow { what: "the new belief" });
        }
        *self = after;
        Ok(())
    }
}

/// How a component with a variance is corrected by a measurement with one.
struct Step {
    /// 1 / (P + R).
    inverse: f64,
    /// R / (P + R): the share of the variance that stays.
    kept: f64,
}

impl Step {
    #[inline]
    fn new(row: usize, variance: f64, noise: f64) -> Result<Self> {
        let pivot = variance + noise;
        // Written so that a NaN pivot fails too.
        let sound = pivot > PIVOT_ROUNDING * (variance + noise) && pivot < f64::INFINITY;
        if !sound {
            return Err(EstimationError::SingularInnovation { row, pivot });
        }
        let inverse = 1.0 / pivot;
        Ok(Self { inverse, kept: noise * inverse })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;

    fn start() -> Gaussian<6> {
        let variances = [9.0, 7.0, 400.0, 300.0, 4.0, 5.0];
        Gaussian::from_variances(SVector::from([80.0, 50.0, 0.0, 0.0, 24.0, 41.0]), SVector::from(variances)).unwrap()
    }

    /// The twin: the whole matrix.
    #[test]
    fn it_is_the_gaussian_to_the_last_bit() {
        let mut numbers = SplitMix(3);
        for _ in 0..50 {
            let (mut whole, mut apart) = (start(), ApartBox::of(&start()).unwrap());
            for _ in 0..40 {
                let mut some = |most: f64| most * numbers.unit();
                let model = PhysicalBox {
                    acceleration_density: some(90.0),
                    size_density: some(3.0),
                    position_density: some(2.0),
                };
                let dt_s = 1e-3 + some(0.5);
                whole.predict(&model.over(dt_s).unwrap()).unwrap();
                apart.predict(&model, dt_s).unwrap();
                assert_eq!(Gaussian::from(apart), whole);
                let (position, size) = (some(5.0), some(9.0));
                let seen = [60.0 + some(40.0), 30.0 + some(40.0), 20.0 + some(9.0), 35.0 + some(9.0)];
                whole.update(&PhysicalBox::measurement(position, size).unwrap(), &seen.into()).unwrap();
                apart.update([position, size], seen).unwrap();
                assert_eq!(Gaussian::from(apart), whole);
                assert_eq!(apart.mean(), &<[f64; 6]>::from(*whole.mean()));
            }
            assert_eq!(ApartBox::of(&whole).unwrap(), apart);
        }
    }

    #[test]
    fn what_is_refused_changes_nothing() {
        let model = PhysicalBox { acceleration_density: 1.0, size_density: 1.0, position_density: 1.0 };
        let before = ApartBox::of(&start()).unwrap();
        let mut after = before;
        let seen = [80.0, 50.0, 24.0, 41.0];
        assert!(after.predict(&model, 0.0).is_err() && after.predict(&model, f64::NAN).is_err());
        assert!(after.predict(&model, 1e200).is_err(), "it overflows");
        assert!(after.predict(&PhysicalBox { size_density: -1.0, ..model }, 0.1).is_err());
        assert!(after.update([1.0, 1.0], [f64::NAN, 50.0, 24.0, 41.0]).is_err());
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(after.update([bad, 1.0], seen).is_err() && after.update([1.0, bad], seen).is_err(), "{bad}");
        }
        assert_eq!(after, before);
        // A step so large that the numbers are looked at is taken all the same.
        let quick = PhysicalBox { acceleration_density: 3.0, ..model };
        let (mut whole, mut far) = (start(), before);
        whole.predict(&quick.over(1e100).unwrap()).unwrap();
        far.predict(&quick, 1e100).unwrap();
        assert_eq!(Gaussian::from(far), whole);
    }

    #[test]
    fn it_starts_as_the_gaussian_does() {
        let (mean, variances) = ([80.0, 50.0, 0.0, 0.0, 24.0, 41.0], [9.0, 7.0, 400.0, 300.0, 4.0, 5.0]);
        assert_eq!(Gaussian::from(ApartBox::from_variances(mean, variances).unwrap()), start());
        for (at, bad) in [(0, f64::NAN), (3, 0.0), (4, -1.0), (5, f64::INFINITY)] {
            let mut refused = variances;
            refused[at] = bad;
            assert!(ApartBox::from_variances(mean, refused).is_err(), "{at}");
            let whole = Gaussian::from_variances(mean.into(), refused.into());
            assert_eq!(ApartBox::from_variances(mean, refused).map(Gaussian::from).is_err(), whole.is_err());
        }
        assert!(ApartBox::from_variances([f64::NAN; 6], variances).is_err());
    }

    #[test]
    fn correlated_axes_are_not_apart() {
        for (r, c) in [(0, 1), (0, 3), (1, 2), (2, 3), (0, 4), (2, 4), (4, 5)] {
            let mut covariance = *start().covariance();
            (covariance[(r, c)], covariance[(c, r)]) = (0.5, 0.5);
            let belief = Gaussian::new(*start().mean(), covariance).unwrap();
            assert!(ApartBox::of(&belief).is_none(), "{r} {c}");
        }
    }
}
