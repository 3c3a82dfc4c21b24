use crate::{ImagingError, Result};
use pursuit_geometry::{Point, Size};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

/// How wide a camera sees: what zoom changes. A pinhole without distortion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawLens", into = "RawLens")]
pub struct Lens(RawLens);

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum RawLens {
    FieldOfView { horizontal_rad: f64 },
    Intrinsics { fx_px: f64, fy_px: f64, cx_px: f64, cy_px: f64 },
}

impl Lens {
    /// A lens that shows `horizontal_rad` radians from the picture's left edge to its right one, with square pixels and the
    /// axis through the picture's middle.
    ///
    /// # Errors
    /// [`ImagingError::Camera`] unless `0 < horizontal_rad < π`.
    pub fn field_of_view(horizontal_rad: f64) -> Result<Self> {
        let wanted = "it must lie between 0 and π radians";
        if !(horizontal_rad > 0.0 && horizontal_rad < PI) {
            return Err(wrong("a field of view of", horizontal_rad, wanted));
        }
        Ok(Self(RawLens::FieldOfView { horizontal_rad }))
    }

    /// A calibrated lens: focal lengths and principal point in continuous pixels (the middle of a picture of width w is
    /// at w / 2).
    ///
    /// # Errors
    /// [`ImagingError::Camera`] unless all are finite and the focal lengths positive.
    pub fn intrinsics(fx_px: f64, fy_px: f64, cx_px: f64, cy_px: f64) -> Result<Self> {
        for focal in [fx_px, fy_px] {
            if !(focal > 0.0 && focal.is_finite()) {
                return Err(wrong("a focal length of", focal, "it must be positive and finite, in pixels"));
            }
        }
        for center in [cx_px, cy_px] {
            if !center.is_finite() {
                return Err(wrong("a principal point at", center, "it must be finite, in pixels"));
            }
        }
        Ok(Self(RawLens::Intrinsics { fx_px, fy_px, cx_px, cy_px }))
    }

    /// Focal lengths and principal point, `[fx, fy, cx, cy]` in pixels, for a picture of `size`.
    pub fn pinhole_px(&self, size: Size) -> [f64; 4] {
        let (width, height) = (size.width as f64, size.height as f64);
        match self.0 {
            RawLens::FieldOfView { horizontal_rad } => {
                let focal = width / 2.0 / (horizontal_rad / 2.0).tan();
                [focal, focal, width / 2.0, height / 2.0]
            }
            RawLens::Intrinsics { fx_px, fy_px, cx_px, cy_px } => [fx_px, fy_px, cx_px, cy_px],
        }
    }

    /// The angle from the left edge of a picture of `size` to its right edge, in radians.
    pub fn horizontal_rad(&self, size: Size) -> f64 {
        let [fx, _, cx, _] = self.pinhole_px(size);
        (cx / fx).atan() + ((size.width as f64 - cx) / fx).atan()
    }
}

impl TryFrom<RawLens> for Lens {
    type Error = ImagingError;

    fn try_from(raw: RawLens) -> Result<Self> {
        match raw {
            RawLens::FieldOfView { horizontal_rad } => Self::field_of_view(horizontal_rad),
            RawLens::Intrinsics { fx_px, fy_px, cx_px, cy_px } => Self::intrinsics(fx_px, fy_px, cx_px, cy_px),
        }
    }
}

impl From<Lens> for RawLens {
    fn from(lens: Lens) -> Self {
        lens.0
    }
}

/// A direction seen from the camera's place: the pan and tilt at which the camera would have it in its axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Direction {
    /// Radians to the right of the camera's zero position.
    pub pan_rad: f64,
    /// Radians above the horizon.
    pub tilt_rad: f64,
}

/// Where a camera on a pan-tilt head looked, how wide, and when: what turns pixels into directions.
///
/// Pan turns about the vertical, positive to the right; tilt about the horizontal axis that pan has turned, positive
/// upwards. At pan 0 and tilt 0 the camera looks along its zero direction. Head and lens share one centre.
///
/// ```
/// use pursuit_geometry::{Point, Size};
/// use pursuit_imaging::{CameraPose, Lens};
///
/// let size = Size::new(640, 480);
/// let pose = CameraPose::new(0.0, 0.5, 0.1, Lens::field_of_view(1.0)?)?;
/// let axis = pose.direction_of(Point::new(320.0, 240.0), size);
/// assert!((axis.pan_rad - 0.5).abs() < 1e-12 && (axis.tilt_rad - 0.1).abs() < 1e-12);
/// // The right edge at the horizon lies half a field of view to the right.
/// let level = CameraPose::new(0.0, 0.0, 0.0, Lens::field_of_view(1.0)?)?;
/// assert!((level.direction_of(Point::new(640.0, 240.0), size).pan_rad - 0.5).abs() < 1e-12);
/// # Ok::<(), pursuit_imaging::ImagingError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawPose", into = "RawPose")]
pub struct CameraPose(RawPose);

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct RawPose {
    time_s: f64,
    pan_rad: f64,
    tilt_rad: f64,
    lens: Lens,
}

impl CameraPose {
    /// A pose at the time `time_s` in seconds, on the clock of the frames.
    ///
    /// # Errors
    /// [`ImagingError::Camera`] unless time and pan are finite and the tilt is within ± π / 2.
    pub fn new(time_s: f64, pan_rad: f64, tilt_rad: f64, lens: Lens) -> Result<Self> {
        if !time_s.is_finite() {
            return Err(wrong("the time", time_s, "it must be a finite number of seconds"));
        }
        if !pan_rad.is_finite() {
            return Err(wrong("a pan of", pan_rad, "it must be a finite number of radians"));
        }
        if !(-FRAC_PI_2..=FRAC_PI_2).contains(&tilt_rad) {
            return Err(wrong("a tilt of", tilt_rad, "it must lie within ± π/2 radians"));
        }
        Ok(Self(RawPose { time_s, pan_rad, tilt_rad, lens }))
    }

    /// When the camera had this pose, in seconds.
    pub const fn time_s(&self) -> f64 {
        self.0.time_s
    }

    /// Pan in radians, positive to the right.
    pub const fn pan_rad(&self) -> f64 {
        self.0.pan_rad
    }

    /// Tilt in radians, positive upwards.
    pub const fn tilt_rad(&self) -> f64 {
        self.0.tilt_rad
    }

    /// How wide it sees: its zoom.
    pub const fn lens(&self) -> &Lens {
        &self.0.lens
    }

    /// The direction that appears at `point` of a picture of `size`.
    pub fn direction_of(&self, point: Point, size: Size) -> Direction {
        let [fx, fy, cx, cy] = self.0.lens.pinhole_px(size);
        // In the camera: x right, y down, z forward.
        let (x, y) = ((point.x - cx) / fx, (point.y - cy) / fy);
        let (sin, cos) = self.0.tilt_rad.sin_cos();
        let (down, forward) = (y * cos - sin, y * sin + cos);
        Direction { pan_rad: self.0.pan_rad + x.atan2(forward), tilt_rad: (-down).atan2(x.hypot(forward)) }
    }

    /// Where `direction` appears in a picture of `size`, in continuous pixels; `None` when it is not before the camera.
    /// Points outside of the picture are those of its continued plane.
    pub fn point_of(&self, direction: Direction, size: Size) -> Option<Point> {
        let [fx, fy, cx, cy] = self.0.lens.pinhole_px(size);
        let (sin, cos) = (direction.pan_rad - self.0.pan_rad).sin_cos();
        let (up, level) = direction.tilt_rad.sin_cos();
        let (right, ahead) = (level * sin, level * cos);
        let (sin, cos) = self.0.tilt_rad.sin_cos();
        let (down, forward) = (ahead * sin - up * cos, ahead * cos + up * sin);
        // A direction at a right angle to the axis appears infinitely far away.
        (forward > 1e-9).then(|| Point::new(cx + fx * right / forward, cy + fy * down / forward))
    }
}

impl TryFrom<RawPose> for CameraPose {
    type Error = ImagingError;

    fn try_from(raw: RawPose) -> Result<Self> {
        Self::new(raw.time_s, raw.pan_rad, raw.tilt_rad, raw.lens)
    }
}

impl From<CameraPose> for RawPose {
    fn from(pose: CameraPose) -> Self {
        pose.0
    }
}

fn wrong(quantity: &'static str, value: f64, wanted: &'static str) -> ImagingError {
    ImagingError::Camera { quantity, value: value.to_string(), wanted }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: Size = Size::new(640, 480);

    fn pose(pan: f64, tilt: f64, fov: f64) -> CameraPose {
        CameraPose::new(0.0, pan, tilt, Lens::field_of_view(fov).unwrap()).unwrap()
    }

    /// The obvious reference: rotation matrices applied to a vector (x right, y down, z ahead).
    fn by_matrices(pose: &CameraPose, d: Direction) -> Option<Point> {
        let world = [d.pan_rad.sin() * d.tilt_rad.cos(), -d.tilt_rad.sin(), d.pan_rad.cos() * d.tilt_rad.cos()];
        let (s, c) = pose.pan_rad().sin_cos();
        let unpan = [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]];
        let (s, c) = pose.tilt_rad().sin_cos();
        let untilt = [[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]];
        let times = |m: [[f64; 3]; 3], v: [f64; 3]| m.map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum::<f64>());
        let [x, y, z] = times(untilt, times(unpan, world));
        let [fx, fy, cx, cy] = pose.lens().pinhole_px(SIZE);
        (z > 1e-9).then(|| Point::new(cx + fx * x / z, cy + fy * y / z))
    }

    proptest! {
        #[test]
        fn points_and_directions_are_each_others_inverse(
            pan in -3.0..3.0, tilt in -1.2..1.2, fov in 0.02..2.0, x in 0.0..640.0, y in 0.0..480.0
        ) {
            let pose = pose(pan, tilt, fov);
            let direction = pose.direction_of(Point::new(x, y), SIZE);
            let back = pose.point_of(direction, SIZE).unwrap();
            prop_assert!(back.distance(Point::new(x, y)) < 1e-6, "{back:?}");
        }

        #[test]
        fn projection_is_that_of_rotation_matrices(
            pan in -3.0..3.0, tilt in -1.2..1.2f64, off in -1.0..1.0, up in -0.5..0.5
        ) {
            let pose = pose(pan, tilt, 1.0);
            let direction = Direction { pan_rad: pan + off, tilt_rad: f64::clamp(tilt + up, -1.5, 1.5) };
            match (pose.point_of(direction, SIZE), by_matrices(&pose, direction)) {
                (Some(a), Some(b)) => prop_assert!(a.distance(b) <= 1e-6 * (1.0 + b.distance(Point::default()))),
                (a, b) => prop_assert_eq!(a.is_none(), b.is_none()),
            }
        }
    }

    #[test]
    fn right_is_positive_pan_and_up_is_positive_tilt() {
        let level = pose(0.0, 0.0, 1.0);
        let at = |pan_rad, tilt_rad| level.point_of(Direction { pan_rad, tilt_rad }, SIZE);
        assert_eq!(at(0.0, 0.0), Some(Point::new(320.0, 240.0)));
        assert!(at(0.1, 0.0).unwrap().x > 330.0 && at(0.0, 0.1).unwrap().y < 230.0);
        assert_eq!(at(2.0, 0.0), None, "behind the camera");
        let focal = 320.0 / 0.5f64.tan();
        assert!((at(0.3, 0.0).unwrap().x - (320.0 + focal * 0.3f64.tan())).abs() < 1e-9);
    }

    #[test]
    fn intrinsics_and_field_of_view_agree() {
        let lens = Lens::field_of_view(1.0).unwrap();
        let [fx, fy, cx, cy] = lens.pinhole_px(SIZE);
        assert_eq!((fx, cx, cy), (fy, 320.0, 240.0));
        let same = Lens::intrinsics(fx, fy, cx, cy).unwrap();
        assert_eq!(same.pinhole_px(Size::new(9, 9)), [fx, fy, cx, cy], "a calibration holds for its own picture size");
        assert!((same.horizontal_rad(SIZE) - 1.0).abs() < 1e-12 && (lens.horizontal_rad(SIZE) - 1.0).abs() < 1e-12);
        let off_axis = Lens::intrinsics(500.0, 500.0, 0.0, 240.0).unwrap();
        assert!((off_axis.horizontal_rad(SIZE) - (640.0f64 / 500.0).atan()).abs() < 1e-12);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        for fov in [0.0, -1.0, PI, f64::NAN, f64::INFINITY] {
            assert!(Lens::field_of_view(fov).is_err(), "{fov}");
        }
        assert!(Lens::intrinsics(0.0, 1.0, 0.0, 0.0).is_err() && Lens::intrinsics(1.0, f64::NAN, 0.0, 0.0).is_err());
        assert!(Lens::intrinsics(1.0, 1.0, f64::NAN, 0.0).is_err());
        let lens = Lens::field_of_view(1.0).unwrap();
        for (time, pan, tilt) in
            [(f64::NAN, 0.0, 0.0), (0.0, f64::INFINITY, 0.0), (0.0, 0.0, 1.6), (0.0, 0.0, f64::NAN)]
        {
            assert!(CameraPose::new(time, pan, tilt, lens).is_err(), "{time} {pan} {tilt}");
        }
        let message = CameraPose::new(0.0, 0.0, 1.6, lens).unwrap_err().to_string();
        assert!(message.contains("a tilt of 1.6") && message.contains("π/2"), "{message}");
    }

    #[test]
    fn a_pose_survives_its_text_and_a_damaged_one_is_refused() {
        let pose = pose(0.25, -0.5, 1.0);
        let text = serde_json::to_string(&pose).unwrap();
        assert_eq!(serde_json::from_str::<CameraPose>(&text).unwrap(), pose);
        assert!(serde_json::from_str::<CameraPose>(&text.replace("-0.5", "-5")).is_err(), "{text}");
        assert!(
            serde_json::from_str::<CameraPose>(&text.replace("\"horizontal_rad\":1.0", "\"horizontal_rad\":4.0"))
                .is_err()
        );
    }
}
