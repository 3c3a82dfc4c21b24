use crate::{ImagingError, Result};
pub use pursuit_geometry::camera::Direction;
use pursuit_geometry::camera::Pinhole;
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

    /// The camera that takes pictures of `size` through it.
    pub fn pinhole(&self, size: Size) -> Pinhole {
        match self.0 {
            RawLens::FieldOfView { horizontal_rad } => {
                let center = Point::new(size.width as f64 / 2.0, size.height as f64 / 2.0);
                let focal = center.x / (horizontal_rad / 2.0).tan();
                Pinhole { focal_px: (focal, focal), center }
            }
            RawLens::Intrinsics { fx_px, fy_px, cx_px, cy_px } => {
                Pinhole { focal_px: (fx_px, fy_px), center: Point::new(cx_px, cy_px) }
            }
        }
    }

    /// Focal lengths and principal point, `[fx, fy, cx, cy]` in pixels, for a picture of `size`.
    pub fn pinhole_px(&self, size: Size) -> [f64; 4] {
        let Pinhole { focal_px: (fx, fy), center } = self.pinhole(size);
        [fx, fy, center.x, center.y]
    }

    /// The angle from the left edge of a picture of `size` to its right edge, in radians.
    pub fn horizontal_rad(&self, size: Size) -> f64 {
        let Pinhole { focal_px: (focal, _), center } = self.pinhole(size);
        (center.x / focal).atan() + ((size.width as f64 - center.x) / focal).atan()
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

    /// Where its axis points.
    pub const fn axis(&self) -> Direction {
        Direction { pan_rad: self.0.pan_rad, tilt_rad: self.0.tilt_rad }
    }

    /// The direction that appears at `point` of a picture of `size`.
    pub fn direction_of(&self, point: Point, size: Size) -> Direction {
        self.axis().along(self.0.lens.pinhole(size).ray(point))
    }

    /// Where `direction` appears in a picture of `size`, in continuous pixels; `None` when it is not before the camera.
    /// Points outside of the picture are those of its continued plane.
    pub fn point_of(&self, direction: Direction, size: Size) -> Option<Point> {
        self.axis().ray_to(direction).map(|ray| self.0.lens.pinhole(size).pixel(ray))
    }

    /// The projective map, as the rows of a matrix, that takes points `(x, y, 1)` of a picture of `size` in this pose to where a
    /// picture in the pose `other` shows the same direction: multiples of `(x, y, 1)` again. What comes out with a third part that
    /// is not above 0 is not before `other`.
    pub fn map_to(&self, other: &Self, size: Size) -> [[f64; 3]; 3] {
        let [fx, fy, cx, cy] = self.0.lens.pinhole_px(size);
        let to_ray = [[1.0 / fx, 0.0, -cx / fx], [0.0, 1.0 / fy, -cy / fy], [0.0, 0.0, 1.0]];
        let [fx, fy, cx, cy] = other.0.lens.pinhole_px(size);
        let to_pixel = [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]];
        let [world, back] = [self.turn(), transposed(&other.turn())];
        product(&to_pixel, &product(&back, &product(&world, &to_ray)))
    }

    /// Takes rays of the camera (right, down, ahead) to those of one that looks along the zero direction.
    fn turn(&self) -> [[f64; 3]; 3] {
        let ((sin_pan, cos_pan), (sin, cos)) = (self.0.pan_rad.sin_cos(), self.0.tilt_rad.sin_cos());
        [[cos_pan, sin * sin_pan, cos * sin_pan], [0.0, cos, -sin], [-sin_pan, sin * cos_pan, cos * cos_pan]]
    }
}

fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| std::array::from_fn(|j| row.iter().zip(b).map(|(v, b)| v * b[j]).sum()))
}

fn transposed(a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
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
        fn a_map_between_pictures_goes_by_directions(
            pan in -3.0..3.0, tilt in -1.2..1.2, fov in 0.2..2.0, turned in -0.5..0.5, nodded in -0.3..0.3, zoomed in 0.2..2.0,
            x in 0.0..640.0, y in 0.0..480.0
        ) {
            let (here, there) = (pose(pan, tilt, fov), pose(pan + turned, tilt + nodded, zoomed));
            let [u, v, w] = here.map_to(&there, SIZE).map(|row| row[0] * x + row[1] * y + row[2]);
            match there.point_of(here.direction_of(Point::new(x, y), SIZE), SIZE) {
                Some(point) => prop_assert!(point.distance(Point::new(u / w, v / w)) < 1e-6 * (1.0 + u.hypot(v) / w), "{point:?}"),
                None => prop_assert!(w <= 1e-6, "{w}"),
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
