//! Projective maps of a plane, what they do to position, velocity and acceleration, and how they are found from points.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

/// A projective map of the plane: `(x, y)` goes to `(u/w, v/w)` with `(u, v, w) = H (x, y, 1)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homography(pub(crate) Matrix3<f64>);

/// A place with how it changes: position, velocity and acceleration of a point of the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet {
    pub at: Vector2<f64>,
    pub velocity: Vector2<f64>,
    pub acceleration: Vector2<f64>,
}

impl Homography {
    /// Where a point goes; none where it has no image (at or beyond the horizon).
    pub fn apply(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let image = self.0 * Vector3::new(at[0], at[1], 1.0);
        (image.z > 0.0 && image.iter().all(|v| v.is_finite())).then(|| [image.x / image.z, image.y / image.z])
    }

    /// How the image changes with the point.
    pub(crate) fn slope(&self, at: [f64; 2]) -> Option<Matrix2<f64>> {
        let image = self.0 * Vector3::new(at[0], at[1], 1.0);
        let to = Vector2::from(self.apply(at)?);
        let top = self.0.fixed_view::<2, 2>(0, 0);
        let bottom = self.0.fixed_view::<1, 2>(2, 0);
        Some((top - to * bottom) / image.z)
    }

    /// What becomes of a place with its velocity and acceleration: the derivatives of `u/w` and `v/w` in time.
    pub(crate) fn of_jet(&self, jet: &Jet) -> Option<Jet> {
        let lift = |v: Vector2<f64>, one: f64| self.0 * Vector3::new(v.x, v.y, one);
        let (n, n1, n2) = (lift(jet.at, 1.0), lift(jet.velocity, 0.0), lift(jet.acceleration, 0.0));
        if n.z <= 0.0 {
            return None;
        }
        let at = n.xy() / n.z;
        let velocity = (n1.xy() - at * n1.z) / n.z;
        let acceleration = (n2.xy() - velocity * (2.0 * n1.z) - at * n2.z) / n.z;
        Some(Jet { at, velocity, acceleration })
    }

    /// The way back.
    pub(crate) fn inverse(&self) -> Option<Self> {
        // The sign is chosen so that what has an image has one above 0 on the way back too.
        let inverse = self.0.try_inverse()?;
        Some(Self(inverse))
    }

    /// The map under which `from` goes to `to`, with the least squares of the distances in `from`'s plane as it would be seen
    /// back: by the linear solution in normalised coordinates (Hartley 1997), then Gauss and Newton's steps. Four points or
    /// more, no three of four on a line; the caller has seen to that.
    pub(crate) fn fitted(from: &[[f64; 2]], to: &[[f64; 2]]) -> Option<Self> {
        let (from_n, from_t) = normalised(from)?;
        let (to_n, to_t) = normalised(to)?;
        // Seen back: G takes `to` to `from`, where errors are made.
        let mut g = linear(&to_n, &from_n)?;
        for _ in 0..20 {
            let step = gauss_newton(&g, &to_n, &from_n)?;
            g += step;
            if step.norm() < 1e-13 * g.norm() {
                break;
            }
        }
        let back = from_t.try_inverse()? * matrix(&g) * to_t;
        let forth = back.try_inverse()?;
        // One sign for all points that it was made from.
        let w = forth * Vector3::new(from[0][0], from[0][1], 1.0);
        let forth = forth / (forth.norm() * w.z.signum());
        let sound = from.iter().all(|p| (forth * Vector3::new(p[0], p[1], 1.0)).z > 0.0);
        (sound && forth.iter().all(|v| v.is_finite())).then_some(Self(forth))
    }
}

/// Points moved and scaled so that their middle is 0 and their mean distance from it √2, and the map that does it.
fn normalised(points: &[[f64; 2]]) -> Option<(Vec<Vector2<f64>>, Matrix3<f64>)> {
    let n = points.len() as f64;
    let middle: Vector2<f64> = points.iter().map(|p| Vector2::from(*p)).sum::<Vector2<f64>>() / n;
    let mean = points.iter().map(|p| (Vector2::from(*p) - middle).norm()).sum::<f64>() / n;
    let s = std::f64::consts::SQRT_2 / mean;
    let map = Matrix3::new(s, 0.0, -s * middle.x, 0.0, s, -s * middle.y, 0.0, 0.0, 1.0);
    s.is_finite().then(|| (points.iter().map(|p| (Vector2::from(*p) - middle) * s).collect(), map))
}

fn matrix(g: &SVector<f64, 8>) -> Matrix3<f64> {
    Matrix3::new(g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], 1.0)
}

/// The two rows of the equations of one point, for the eight numbers of the map (the ninth is 1: the middle of the points is
/// in front of the camera).
fn rows(from: &Vector2<f64>, to: &Vector2<f64>) -> [SVector<f64, 8>; 2] {
    let (x, y, u, v) = (from.x, from.y, to.x, to.y);
    [
        SVector::from([x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y]),
        SVector::from([0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y]),
    ]
}

fn linear(from: &[Vector2<f64>], to: &[Vector2<f64>]) -> Option<SVector<f64, 8>> {
    let (mut normal, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
    for (p, q) in from.iter().zip(to) {
        for (row, value) in rows(p, q).into_iter().zip([q.x, q.y]) {
            normal += row * row.transpose();
            right += row * value;
        }
    }
    normal.lu().solve(&right)
}

fn gauss_newton(g: &SVector<f64, 8>, from: &[Vector2<f64>], to: &[Vector2<f64>]) -> Option<SVector<f64, 8>> {
    let (mut normal, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
    let map = matrix(g);
    for (p, q) in from.iter().zip(to) {
        let image = map * Vector3::new(p.x, p.y, 1.0);
        let found = image.xy() / image.z;
        for (row, missing) in rows(p, &found).into_iter().zip([q.x - found.x, q.y - found.y]) {
            let row = row / image.z;
            normal += row * row.transpose();
            right += row * missing;
        }
    }
    normal.lu().solve(&right)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oblique() -> Homography {
        Homography(Matrix3::new(0.004, 0.0005, -1.2, -0.0002, 0.011, -3.0, 1e-5, 9e-4, 0.4))
    }

    #[test]
    fn a_map_is_found_again_from_its_points() {
        let from = [[100.0, 200.0], [900.0, 220.0], [1000.0, 650.0], [60.0, 700.0], [500.0, 400.0], [300.0, 600.0]];
        let to = from.map(|p| oblique().apply(p).unwrap());
        for n in 4..=6 {
            let found = Homography::fitted(&from[..n], &to[..n]).unwrap();
            for p in [[333.0, 444.0], [700.0, 300.0]] {
                let (a, b) = (found.apply(p).unwrap(), oblique().apply(p).unwrap());
                assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9, "{n}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn jets_are_derivatives_in_time() {
        let map = oblique();
        let jet = Jet {
            at: Vector2::new(400.0, 500.0),
            velocity: Vector2::new(30.0, -12.0),
            acceleration: Vector2::new(-7.0, 40.0),
        };
        let image = map.of_jet(&jet).unwrap();
        let at = |t: f64| {
            let p = jet.at + jet.velocity * t + jet.acceleration * (0.5 * t * t);
            Vector2::from(map.apply([p.x, p.y]).unwrap())
        };
        let h = 1e-3;
        assert!((image.at - at(0.0)).norm() < 1e-12);
        assert!((image.velocity - (at(h) - at(-h)) / (2.0 * h)).norm() < 1e-6);
        assert!((image.acceleration - (at(h) - at(0.0) * 2.0 + at(-h)) / (h * h)).norm() < 1e-5);
        let back = map.inverse().unwrap().of_jet(&image).unwrap();
        assert!((back.velocity - jet.velocity).norm() < 1e-9 && (back.acceleration - jet.acceleration).norm() < 1e-9);
        let slope = map.slope([400.0, 500.0]).unwrap();
        assert!((slope * jet.velocity - image.velocity).norm() < 1e-12);
    }

    #[test]
    fn beyond_the_horizon_there_is_no_place() {
        // The horizon is where 1e-5 x + 9e-4 y + 0.4 is 0.
        assert!(oblique().apply([0.0, -500.0]).is_none());
        assert!(oblique().slope([0.0, -500.0]).is_none());
    }
}
