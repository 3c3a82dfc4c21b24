use serde::{Deserialize, Serialize};

/// Rays this close to a right angle to the axis are shown nowhere: the tangent of one ahead would be beyond 10⁹.
const NEAREST_AHEAD: f64 = 1e-9;

/// A direction seen from the camera's place: the pan and tilt at which a camera would have it in its axis. Pan turns about
/// the vertical; tilt turns about the horizontal axis that pan has turned, as heads are built. Head and lens share one centre.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Direction {
    /// Radians to the right of the zero position.
    pub pan_rad: f64,
    /// Radians above the horizon.
    pub tilt_rad: f64,
}

impl Direction {
    /// The direction that a camera which looks here sees along the ray of tangents `(right, down)`.
    ///
    /// A level camera that looks ahead gives `pan = atan right`, `tilt = −atan(down / √(1 + right²))`.
    #[must_use]
    pub fn along(&self, (right, down): (f64, f64)) -> Self {
        let (sin, cos) = self.tilt_rad.sin_cos();
        // The ray (right, down, 1), tilted: its parts downward and ahead.
        let (down, ahead) = (down * cos - sin, down * sin + cos);
        Self { pan_rad: self.pan_rad + right.atan2(ahead), tilt_rad: (-down).atan2(right.hypot(ahead)) }
    }

    /// The ray, right, down and ahead, along which a camera that looks here sees `other`; `None` where that is not before it.
    pub fn ray_to(&self, other: Self) -> Option<[f64; 3]> {
        let (sin, cos) = (other.pan_rad - self.pan_rad).sin_cos();
        let (up, level) = other.tilt_rad.sin_cos();
        let (right, ahead) = (level * sin, level * cos);
        let (sin, cos) = self.tilt_rad.sin_cos();
        let (down, ahead) = (ahead * sin - up * cos, ahead * cos + up * sin);
        (ahead > NEAREST_AHEAD).then_some([right, down, ahead])
    }

    /// The angle between two directions on the sphere, radians.
    pub fn angle_to(&self, other: Self) -> f64 {
        let (a, b) = (self.unit(), other.unit());
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let sine = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
        let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        sine.atan2(cosine)
    }

    /// The unit vector that points there: right, up, ahead.
    pub fn unit(&self) -> [f64; 3] {
        let (sin_pan, cos_pan) = self.pan_rad.sin_cos();
        let (sin_tilt, cos_tilt) = self.tilt_rad.sin_cos();
        [cos_tilt * sin_pan, sin_tilt, cos_tilt * cos_pan]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};
    use proptest::prelude::*;

    /// The slow twin: rotation matrices.
    fn by_matrices(camera: Direction, (right, down): (f64, f64)) -> Vector3<f64> {
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), -camera.tilt_rad);
        let pan = Rotation3::from_axis_angle(&Vector3::y_axis(), camera.pan_rad);
        pan * tilt * Vector3::new(right, -down, 1.0).normalize()
    }

    proptest! {
        #[test]
        fn rays_are_those_of_rotation_matrices(
            pan_rad in -3.0..3.0f64, tilt_rad in -1.2..1.2f64, right in -3.0..3.0f64, down in -3.0..3.0f64
        ) {
            let camera = Direction { pan_rad, tilt_rad };
            let seen = camera.along((right, down));
            prop_assert!((Vector3::from(seen.unit()) - by_matrices(camera, (right, down))).norm() < 1e-12);
            let [x, y, z] = camera.ray_to(seen).unwrap();
            prop_assert!((x / z - right).abs() < 1e-9 && (y / z - down).abs() < 1e-9);
        }
    }

    #[test]
    fn what_lies_behind_is_on_no_ray() {
        let level = Direction::default();
        let at = |pan_rad, tilt_rad| level.ray_to(Direction { pan_rad, tilt_rad });
        assert_eq!(at(0.0, 0.0), Some([0.0, 0.0, 1.0]));
        assert!(at(0.1, 0.0).unwrap()[0] > 0.0 && at(0.0, 0.1).unwrap()[1] < 0.0);
        assert_eq!((at(2.0, 0.0), at(std::f64::consts::FRAC_PI_2, 0.0)), (None, None));
    }

    #[test]
    fn angles_on_the_sphere_shrink_towards_the_zenith() {
        let apart =
            |tilt_rad: f64| Direction { pan_rad: 0.2, tilt_rad }.angle_to(Direction { pan_rad: -0.2, tilt_rad });
        assert!((apart(0.0) - 0.4).abs() < 1e-12);
        // Haversine: sin(θ/2) = cos(tilt) sin(Δpan/2).
        assert!((apart(1.0) - 2.0 * (1f64.cos() * 0.2f64.sin()).asin()).abs() < 1e-12);
    }
}
