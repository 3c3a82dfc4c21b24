use crate::Result;
use crate::error::require;
use serde::{Deserialize, Serialize};

/// Radial lens distortion, the even polynomial of Brown (1966): a ray that a perfect lens would show at radius `r` (in
/// tangents) is shown at `r (1 + k1 r² + k2 r⁴)`. Negative `k1` is barrel distortion, as wide lenses have it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(remote = "Distortion", default, deny_unknown_fields)]
pub struct Distortion {
    k1: f64,
    k2: f64,
}

pursuit_estimation::checked!(Distortion);

impl Distortion {
    fn restored(self) -> Result<Self> {
        Self::new(self.k1, self.k2)
    }
}

impl Distortion {
    /// A perfect lens.
    pub const NONE: Self = Self { k1: 0.0, k2: 0.0 };

    /// How far `k1` may be from 0.
    const LIMIT: f64 = 1.0;

    /// A lens with these coefficients, each in `[-1, 1]`.
    ///
    /// # Errors
    /// Where a coefficient is out of range.
    pub fn new(k1: f64, k2: f64) -> Result<Self> {
        require("distortion k1", k1, k1.abs() <= Self::LIMIT, "between -1 and 1")?;
        require("distortion k2", k2, k2.abs() <= Self::LIMIT, "between -1 and 1")?;
        Ok(Self { k1, k2 })
    }

    /// Where the lens shows a ray of tangents `(x, y)`.
    pub fn apply(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let r2 = x * x + y * y;
        let stretch = 1.0 + r2 * (self.k1 + r2 * self.k2);
        (x * stretch, y * stretch)
    }

    /// Which ray the lens shows at `(x, y)`: the inverse of [`apply`](Self::apply), by Newton's method on the radius.
    ///
    /// Beyond the radius where the polynomial folds back there is no such ray; the ray at the fold is given.
    pub fn remove(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let shown = x.hypot(y);
        if *self == Self::NONE || shown == 0.0 || !shown.is_finite() {
            return (x, y);
        }
        let mut radius = shown;
        for _ in 0..20 {
            let r2 = radius * radius;
            let value = radius * (1.0 + r2 * (self.k1 + r2 * self.k2)) - shown;
            let slope = 1.0 + r2 * (3.0 * self.k1 + 5.0 * self.k2 * r2);
            if slope < 0.05 {
                // Past the fold: back towards the middle, where the polynomial still grows.
                radius *= 0.8;
                continue;
            }
            let step = value / slope;
            radius -= step;
            if step.abs() < 1e-15 * shown {
                break;
            }
        }
        let scale = radius / shown;
        (x * scale, y * scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_is_browns() {
        let lens = Distortion::new(-0.2, 0.05).unwrap();
        let (x, y) = lens.apply((0.3, 0.4)); // r² = 0.25
        let stretch = 1.0 - 0.2 * 0.25 + 0.05 * 0.0625;
        assert!((x - 0.3 * stretch).abs() < 1e-15 && (y - 0.4 * stretch).abs() < 1e-15);
    }

    #[test]
    fn removing_undoes_applying() {
        for (k1, k2) in [(0.0, 0.0), (-0.25, 0.03), (0.3, 0.1), (-0.1, -0.02)] {
            let lens = Distortion::new(k1, k2).unwrap();
            for ray in [(0.0, 0.0), (0.1, -0.2), (-0.5, 0.3), (0.6, 0.35)] {
                let back = lens.remove(lens.apply(ray));
                assert!((back.0 - ray.0).abs() < 1e-12 && (back.1 - ray.1).abs() < 1e-12, "{k1} {k2} {ray:?} {back:?}");
            }
        }
    }

    #[test]
    fn past_the_fold_the_answer_stays_finite_and_in_its_direction() {
        let lens = Distortion::new(-1.0, 0.0).unwrap();
        let (x, y) = lens.remove((5.0, -5.0));
        assert!(x.is_finite() && x > 0.0 && (x + y).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn coefficients_out_of_range_are_named() {
        assert!(Distortion::new(f64::NAN, 0.0).is_err());
        let error = Distortion::new(0.0, -1.5).unwrap_err();
        assert_eq!(error.to_string(), "`distortion k2` is -1.5; it must be between -1 and 1");
        assert!(serde_json::from_str::<Distortion>(r#"{"k1": 7}"#).is_err());
        let lens: Distortion = serde_json::from_str(r#"{"k1": -0.5}"#).unwrap();
        assert_eq!(lens, Distortion::new(-0.5, 0.0).unwrap());
        assert_eq!(serde_json::to_string(&lens).unwrap(), r#"{"k1":-0.5,"k2":0.0}"#);
    }
}
