use pursuit_geometry::Point;

/// The moments of a distribution over the picture, about a point near to it (bradski1998): sums of the probability times powers of
/// the displacement from there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    m00: f64,
    m10: f64,
    m01: f64,
    m20: f64,
    m11: f64,
    m02: f64,
}

/// How a distribution lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation along the longer axis, in pixels.
    pub length: f64,
    /// Standard deviation across it, in pixels.
    pub width: f64,
    /// Angle of the longer axis from the x axis, towards y, in radians.
    pub angle: f64,
}

impl Moments {
    /// Takes in a probability at a displacement.
    #[inline(always)]
    pub fn add(&mut self, p: f64, (x, y): (f64, f64)) {
        self.m00 += p;
        self.m10 += p * x;
        self.m01 += p * y;
        self.m20 += p * x * x;
        self.m11 += p * x * y;
        self.m02 += p * y * y;
    }

    /// The zeroth moment.
    pub const fn mass(&self) -> f64 {
        self.m00
    }

    /// The mean, `(M10 / M00, M01 / M00)`; `None` without mass.
    pub fn mean(&self) -> Option<Point> {
        (self.m00 > 0.0).then(|| Point::new(self.m10 / self.m00, self.m01 / self.m00))
    }

    /// Length, width and angle: with a = M20/M00 − x̄², b = 2 (M11/M00 − x̄ ȳ), c = M02/M00 − ȳ², the angle is ½ atan2(b, a − c), and
    /// length and width are √((a + c ± √(b² + (a − c)²)) / 2). `None` without mass.
    pub fn spread(&self) -> Option<Spread> {
        let mean = self.mean()?;
        let a = self.m20 / self.m00 - mean.x * mean.x;
        let b = 2.0 * (self.m11 / self.m00 - mean.x * mean.y);
        let c = self.m02 / self.m00 - mean.y * mean.y;
        let root = b.hypot(a - c);
        let axis = |square: f64| (square / 2.0).max(0.0).sqrt();
        Some(Spread { length: axis(a + c + root), width: axis(a + c - root), angle: 0.5 * b.atan2(a - c) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_bar_has_its_own_axes() {
        let angle = 0.5_f64;
        let mut moments = Moments::default();
        for i in -40..=40 {
            for j in -10..=10 {
                let (u, v) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
                moments.add(0.7, (3.0 + u * angle.cos() - v * angle.sin(), -2.0 + u * angle.sin() + v * angle.cos()));
            }
        }
        let (mean, spread) = (moments.mean().unwrap(), moments.spread().unwrap());
        assert!((mean.x - 3.0).abs() < 1e-9 && (mean.y + 2.0).abs() < 1e-9);
        // The variance of 2n + 1 places half a pixel apart is n (n + 1) / 12.
        let sigma = |n: f64| (n * (n + 1.0) / 12.0).sqrt();
        assert!((spread.length - sigma(40.0)).abs() < 1e-9, "{spread:?}");
        assert!((spread.width - sigma(10.0)).abs() < 1e-9 && (spread.angle - angle).abs() < 1e-9, "{spread:?}");
        assert!((moments.mass() - 0.7 * 81.0 * 21.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_has_no_mean() {
        assert!(Moments::default().mean().is_none() && Moments::default().spread().is_none());
    }
}
