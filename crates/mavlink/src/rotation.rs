//! Rotations as MAVLink has them: quaternions w, x, y, z; axes forward, right, down; angles positive to the right and, for pitch, upward.

/// A rotation from a body's axes to those outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotation([f64; 4]);

impl Rotation {
    /// Of a quaternion that was received; `None` where it is no rotation.
    pub fn of(q: [f32; 4]) -> Option<Self> {
        let q = q.map(f64::from);
        let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
        (norm.is_finite() && norm > 0.5).then(|| Self(q.map(|v| v / norm)))
    }

    /// Of yaw, then pitch, then roll, in radians.
    pub fn from_euler(roll: f64, pitch: f64, yaw: f64) -> Self {
        let half = |angle: f64| (0.5 * angle).sin_cos();
        let ((sr, cr), (sp, cp), (sy, cy)) = (half(roll), half(pitch), half(yaw));
        Self([
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ])
    }

    /// Roll, pitch and yaw in radians.
    pub fn euler(self) -> (f64, f64, f64) {
        let [w, x, y, z] = self.0;
        let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
        let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
        let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        (roll, pitch, yaw)
    }

    /// First `other`, then this.
    pub fn after(self, other: Self) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Self([
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ])
    }

    /// A vector of the body as it is outside.
    pub fn apply(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [w, qx, qy, qz] = self.0;
        // Twice the cross product with the vector part, and that once more.
        let t = [2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)];
        [
            x + w * t[0] + qy * t[2] - qz * t[1],
            y + w * t[1] + qz * t[0] - qx * t[2],
            z + w * t[2] + qx * t[1] - qy * t[0],
        ]
    }

    /// As it is sent.
    pub fn quaternion(self) -> [f32; 4] {
        self.0.map(|v| v as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn looking_up_and_right_is_positive() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let ahead = [1.0, 0.0, 0.0];
        assert!(close(Rotation::from_euler(0.0, 0.0, quarter).apply(ahead), [0.0, 1.0, 0.0]));
        assert!(close(Rotation::from_euler(0.0, quarter, 0.0).apply(ahead), [0.0, 0.0, -1.0]));
        assert_eq!(Rotation::of([0.0; 4]), None);
        assert_eq!(Rotation::of([f32::NAN, 0.0, 0.0, 0.0]), None);
    }

    proptest! {
        #[test]
        fn angles_come_back(roll in -3.0..3.0f64, pitch in -1.4..1.4f64, yaw in -3.0..3.0f64) {
            let there = Rotation::from_euler(roll, pitch, yaw);
            let (r, p, y) = there.euler();
            prop_assert!(close([r, p, y], [roll, pitch, yaw]));
            let twice = there.after(there).apply([0.3, -0.2, 0.9]);
            prop_assert!(close(twice, there.apply(there.apply([0.3, -0.2, 0.9]))));
            prop_assert!(Rotation::of(there.quaternion()).is_some());
        }
    }
}
