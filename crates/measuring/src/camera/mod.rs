//! A camera with distortion: where a perfect lens would have shown what is seen at a pixel.

mod board;
mod opencv;

pub use board::{BoardView, FoundCamera};

use crate::{MeasuringError, Result};
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// Focal lengths, principal point and distortion of a camera, in OpenCV's model: `x'' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) /
/// (1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²) + s1 r² + s2 r⁴`, and so for y (OpenCV, "Camera Calibration and 3D
/// Reconstruction"; Brown 1966).
///
/// OpenCV puts the centre of the first pixel at (0, 0), this project at (0.5, 0.5): [`Camera::from_opencv`] moves the
/// principal point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Width and height of the pictures that it was calibrated on.
    pub picture: [usize; 2],
    /// Focal lengths across and down, in pixels. Above 0.
    pub focal: [f64; 2],
    /// Principal point, in pixels.
    pub centre: [f64; 2],
    /// `k1, k2, p1, p2[, k3[, k4, k5, k6[, s1, s2, s3, s4]]]`; none for a perfect lens.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distortion: Vec<f64>,
}

impl Camera {
    /// Reads what OpenCV's `FileStorage` writes after a calibration, YAML or JSON: `camera_matrix`,
    /// `distortion_coefficients`, `image_width` and `image_height`, or the other names in use for them.
    ///
    /// # Errors
    /// Where something is missing or makes no camera; the message names it.
    pub fn from_opencv(text: &str) -> Result<Self> {
        let camera = opencv::read(text)?;
        camera.check()?;
        Ok(camera)
    }

    /// Refuses what is no camera.
    pub(crate) fn check(&self) -> Result<()> {
        let wrong = |what: String| Err(MeasuringError::Camera(what));
        if !self.focal.iter().all(|f| *f > 0.0 && f.is_finite()) || !self.centre.iter().all(|c| c.is_finite()) {
            return wrong(format!(
                "the camera's focal lengths are {:?} and its centre {:?}; focal lengths are pixels above 0, calibrate the camera anew",
                self.focal, self.centre
            ));
        }
        if !matches!(self.distortion.len(), 0 | 4 | 5 | 8 | 12) || !self.distortion.iter().all(|k| k.is_finite()) {
            return wrong(format!(
                "the camera has {} distortion coefficients; finite ones are understood, 0, 4, 5, 8 or 12 (no tilted sensor, no fisheye)",
                self.distortion.len()
            ));
        }
        if self.picture.contains(&0) {
            return wrong(
                "the camera was calibrated on pictures without a size; give image_width and image_height".into(),
            );
        }
        Ok(())
    }

    /// The coefficient at `index` of OpenCV's order, 0 where the camera has fewer.
    fn k(&self, index: usize) -> f64 {
        self.distortion.get(index).copied().unwrap_or(0.0)
    }

    /// Where the lens shows a ray of tangents `(x, y)`, in tangents, and how that changes with the ray.
    fn distorted(&self, ray: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let (p1, p2) = (self.k(2), self.k(3));
        let above = 1.0 + r2 * (self.k(0) + r2 * (self.k(1) + r2 * self.k(4)));
        let below = 1.0 + r2 * (self.k(5) + r2 * (self.k(6) + r2 * self.k(7)));
        let radial = above / below;
        // By r², with r² itself changing by 2x and 2y.
        let above_slope = self.k(0) + r2 * (2.0 * self.k(1) + 3.0 * r2 * self.k(4));
        let below_slope = self.k(5) + r2 * (2.0 * self.k(6) + 3.0 * r2 * self.k(7));
        let slope = (above_slope - radial * below_slope) / below;
        let prism = [self.k(8) + r2 * self.k(9), self.k(10) + r2 * self.k(11)];
        let prism_slope = [self.k(8) + 2.0 * r2 * self.k(9), self.k(10) + 2.0 * r2 * self.k(11)];
        let at = Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * prism[0],
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * prism[1],
        );
        let change = Matrix2::new(
            radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + 2.0 * x * prism_slope[0],
            2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y + 2.0 * y * prism_slope[0],
            2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y + 2.0 * x * prism_slope[1],
            radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + 2.0 * y * prism_slope[1],
        );
        (at, change)
    }

    /// The pixel at which the camera shows what a perfect lens of the same focal length would show at `ideal`.
    pub fn distort(&self, ideal: [f64; 2]) -> [f64; 2] {
        let ray =
            Vector2::new((ideal[0] - self.centre[0]) / self.focal[0], (ideal[1] - self.centre[1]) / self.focal[1]);
        let at = self.distorted(ray).0;
        [at.x * self.focal[0] + self.centre[0], at.y * self.focal[1] + self.centre[1]]
    }

    /// Where a perfect lens of the same focal length would have shown what is seen at pixel `seen`, and how that changes with
    /// the pixel; none where the lens shows nothing there (beyond the fold of its polynomial). By Newton's method.
    pub fn undistort(&self, seen: [f64; 2]) -> Option<([f64; 2], Matrix2<f64>)> {
        let wanted =
            Vector2::new((seen[0] - self.centre[0]) / self.focal[0], (seen[1] - self.centre[1]) / self.focal[1]);
        let mut ray = wanted;
        for _ in 0..50 {
            let (at, change) = self.distorted(ray);
            let missing = wanted - at;
            let step = change.try_inverse()? * missing;
            // Far from the solution the whole step may lead beyond the fold.
            let length = step.norm();
            ray += if length > 0.5 { step * (0.5 / length) } else { step };
            if length < 1e-12 {
                break;
            }
        }
        let (at, change) = self.distorted(ray);
        if (at - wanted).norm() > 1e-9 || change.determinant() <= 0.0 {
            return None;
        }
        let scale = Matrix2::from_diagonal(&Vector2::from(self.focal));
        let slope = scale * change.try_inverse()? * scale.try_inverse()?;
        let ideal = [ray.x * self.focal[0] + self.centre[0], ray.y * self.focal[1] + self.centre[1]];
        ideal.iter().all(|v| v.is_finite()).then_some((ideal, slope))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide() -> Camera {
        Camera {
            picture: [1280, 720],
            focal: [900.0, 910.0],
            centre: [640.5, 355.0],
            distortion: vec![-0.21, 0.05, 0.001, -0.0007, -0.004],
        }
    }

    #[test]
    fn undistorting_undoes_distorting() {
        let thin = vec![-0.2, 0.1, 1e-3, -2e-3, 0.01, 0.05, -0.02, 0.003, 1e-3, -5e-4, 2e-3, 1e-4];
        for camera in [wide(), Camera { distortion: thin, ..wide() }] {
            for ideal in [[640.5, 355.0], [0.0, 0.0], [1300.0, 700.0], [200.0, 650.0]] {
                let (back, slope) = camera.undistort(camera.distort(ideal)).unwrap();
                assert!((back[0] - ideal[0]).hypot(back[1] - ideal[1]) < 1e-6, "{ideal:?} {back:?}");
                let seen = camera.distort(ideal);
                let moved = camera.undistort([seen[0] + 0.01, seen[1] - 0.02]).unwrap().0;
                let expected = slope * Vector2::new(0.01, -0.02);
                assert!(
                    (moved[0] - back[0] - expected.x).abs() < 1e-5 && (moved[1] - back[1] - expected.y).abs() < 1e-5
                );
            }
        }
    }

    #[test]
    fn beyond_the_fold_there_is_nothing() {
        let folding = Camera { distortion: vec![-0.5, 0.0, 0.0, 0.0], ..wide() };
        assert!(folding.undistort([6000.0, 6000.0]).is_none());
        assert!(folding.undistort([f64::NAN, 1.0]).is_none());
        assert!(folding.undistort([700.0, 400.0]).is_some());
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        for camera in [
            Camera { focal: [0.0, 1.0], ..wide() },
            Camera { distortion: vec![0.1; 3], ..wide() },
            Camera { distortion: vec![0.1; 14], ..wide() },
            Camera { picture: [0, 720], ..wide() },
        ] {
            assert!(camera.check().is_err(), "{camera:?}");
        }
    }
}
