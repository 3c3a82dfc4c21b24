//! What is believed of a box and its motion: in as few numbers as that takes.

use super::{SIZE, VELOCITY};
use crate::BoxCovariance;
use nalgebra::{SMatrix, SVector, Vector4};
use pursuit_estimation::motion::{ApartBox, PhysicalBox, StepBox};
use pursuit_estimation::{Gaussian, MotionModel, Result};
use serde::{Deserialize, Serialize};

/// A belief about `[x, y, vx, vy, w, h]`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Gaussian<6>", into = "Gaussian<6>")]
pub(super) enum BoxBelief {
    /// No axis is correlated with another, as long as each detection is a target's for certain.
    Apart(ApartBox),
    /// Axes are correlated by detections that may be the target's.
    Whole(Box<Gaussian<6>>),
}

/// What moves a box.
pub(super) enum Mover {
    PerStep(StepBox),
    Physical(PhysicalBox),
}

impl Clone for BoxBelief {
    fn clone(&self) -> Self {
        match self {
            Self::Apart(belief) => Self::Apart(*belief),
            Self::Whole(belief) => Self::Whole(belief.clone()),
        }
    }

    fn clone_from(&mut self, source: &Self) {
        match (self, source) {
            (Self::Whole(own), Self::Whole(other)) => **own = **other,
            (own, other) => *own = other.clone(),
        }
    }
}

impl From<Gaussian<6>> for BoxBelief {
    fn from(belief: Gaussian<6>) -> Self {
        ApartBox::of(&belief).map_or_else(|| Self::Whole(Box::new(belief)), Self::Apart)
    }
}

impl From<BoxBelief> for Gaussian<6> {
    fn from(belief: BoxBelief) -> Self {
        belief.whole()
    }
}

impl BoxBelief {
    /// With all covariances.
    pub fn whole(&self) -> Gaussian<6> {
        match self {
            Self::Apart(belief) => (*belief).into(),
            Self::Whole(belief) => **belief,
        }
    }

    /// Becomes another.
    pub fn set(&mut self, belief: Gaussian<6>) {
        match self {
            Self::Whole(own) => **own = belief,
            Self::Apart(_) => *self = belief.into(),
        }
    }

    /// The expected `[x, y, vx, vy, w, h]`.
    pub fn mean(&self) -> &[f64; 6] {
        match self {
            Self::Apart(belief) => belief.mean(),
            Self::Whole(belief) => &belief.mean().data.0[0],
        }
    }

    /// Covariance of centre and size.
    pub fn of_box(&self) -> BoxCovariance {
        match self {
            Self::Apart(belief) => BoxCovariance::from_diagonal(&Vector4::from(belief.variances())),
            Self::Whole(belief) => super::box_covariance(belief.covariance(), SIZE),
        }
    }

    /// Moves it `dt_s` seconds on.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    #[inline]
    pub fn predict(&mut self, mover: &Mover, dt_s: f64) -> Result<()> {
        match (self, mover) {
            (Self::Apart(belief), Mover::Physical(model)) => belief.predict(model, dt_s),
            (Self::Whole(belief), Mover::Physical(model)) => belief.predict(&model.over(dt_s)?),
            (belief, Mover::PerStep(model)) => {
                let mut after = belief.whole();
                after.predict(&model.over(dt_s)?)?;
                belief.set(after);
                Ok(())
            }
        }
    }

    /// Corrects it by a measured `[x, y, w, h]` with variances of centre and size.
    ///
    /// # Errors
    /// When the step cannot be computed; the belief is then as before.
    #[inline]
    pub fn update(&mut self, variances: [f64; 2], seen: &SVector<f64, 4>) -> Result<()> {
        match self {
            Self::Apart(belief) => belief.update(variances, (*seen).into()),
            Self::Whole(belief) => {
                belief.update(&PhysicalBox::measurement(variances[0], variances[1])?, seen).map(|_| ())
            }
        }
    }

    /// Squared Mahalanobis distance of a centre measured with a variance; `None` where none can be computed.
    pub fn distance2(&self, variance: f64, seen: &SVector<f64, 4>) -> Option<f64> {
        let (x, y) = (seen[0] - self.mean()[0], seen[1] - self.mean()[1]);
        let (of_x, both, of_y) = match self {
            Self::Apart(belief) => (belief.variances()[0], 0.0, belief.variances()[1]),
            Self::Whole(belief) => {
                let p = belief.covariance();
                (p[(0, 0)], p[(0, 1)], p[(1, 1)])
            }
        };
        let (of_x, of_y) = (of_x + variance, of_y + variance);
        let determinant = of_x * of_y - both * both;
        (determinant != 0.0).then(|| (x * x * of_y - 2.0 * x * y * both + y * y * of_x) / determinant)
    }

    /// With the velocity kept as it was `before` by the share `kept` (partial-update Schmidt-Kalman filter: Brink 2017, γ of the
    /// velocity `kept`, of the rest 0).
    ///
    /// # Errors
    /// Where the covariance is none.
    pub fn partly(&mut self, before: &Self, kept: f64) -> Result<()> {
        let kept_of = |i: usize| if VELOCITY.contains(&i) { kept } else { 0.0 };
        let (before, after) = (before.whole(), self.whole());
        let mean = SVector::from_fn(|i, _| before.mean()[i] * kept_of(i) + after.mean()[i] * (1.0 - kept_of(i)));
        let covariance = SMatrix::from_fn(|i, j| {
            let kept = kept_of(i) * kept_of(j);
            before.covariance()[(i, j)] * kept + after.covariance()[(i, j)] * (1.0 - kept)
        });
        self.set(Gaussian::new(mean, covariance)?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apart() -> Gaussian<6> {
        let variances = [9.0, 7.0, 400.0, 300.0, 4.0, 5.0];
        Gaussian::from_variances(SVector::from([80.0, 50.0, 3.0, -2.0, 24.0, 41.0]), SVector::from(variances)).unwrap()
    }

    fn whole() -> Gaussian<6> {
        let mut covariance = *apart().covariance();
        (covariance[(0, 1)], covariance[(1, 0)]) = (2.5, 2.5);
        Gaussian::new(*apart().mean(), covariance).unwrap()
    }

    #[test]
    fn what_is_correlated_is_kept_whole() {
        let (one, other) = (BoxBelief::from(apart()), BoxBelief::from(whole()));
        assert!(matches!(one, BoxBelief::Apart(_)) && matches!(other, BoxBelief::Whole(_)));
        assert!(Gaussian::from(one.clone()) == apart() && Gaussian::from(other.clone()) == whole());
        let (mut set, mut cloned) = (one.clone(), one.clone());
        set.set(whole());
        cloned.clone_from(&other);
        assert!(set == other && cloned == other);
        cloned.clone_from(&one);
        assert!(cloned == one);
        for (belief, gaussian) in [(one, apart()), (other, whole())] {
            assert_eq!(belief.mean()[..], gaussian.mean().as_slice()[..]);
            assert_eq!(belief.of_box(), super::super::box_covariance(gaussian.covariance(), SIZE));
            let text = serde_json::to_string(&belief).unwrap();
            assert_eq!(text, serde_json::to_string(&gaussian).unwrap());
            assert_eq!(serde_json::from_str::<BoxBelief>(&text).unwrap(), belief);
        }
    }

    #[test]
    fn the_distance_is_that_of_the_inverse() {
        let seen = SVector::from([86.0, 41.0, 20.0, 30.0]);
        for gaussian in [apart(), whole()] {
            let innovation = gaussian.covariance().fixed_view::<2, 2>(0, 0) + nalgebra::Matrix2::identity() * 1.5;
            let off = nalgebra::Vector2::new(6.0, -9.0);
            let want = off.dot(&(innovation.try_inverse().unwrap() * off));
            assert!((BoxBelief::from(gaussian).distance2(1.5, &seen).unwrap() - want).abs() < 1e-12);
        }
        assert_eq!(BoxBelief::from(apart()).distance2(-9.0, &seen), None);
    }
}
