use super::{AngleFormula, Direction, Distortion, direction_of};
use crate::Result;
use crate::error::require;
use pursuit_geometry::camera::Pinhole;
use pursuit_geometry::{Point, Size};

/// A camera at one zoom: the size of its picture, its angle of view and its distortion.
///
/// Half the angle of view is measured from the middle to the edge of the picture, along its middle row and column. The
/// optical axis goes through the middle of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    size: Size,
    pinhole: Pinhole,
    distortion: Distortion,
}

impl Lens {
    /// A lens that sees `half_fov_x_deg` to each side in a picture of `size`, with square pixels.
    ///
    /// # Errors
    /// Where the angle is not in (0, 85], or the picture has no pixels.
    pub fn new(size: Size, half_fov_x_deg: f64) -> Result<Self> {
        require_half_angle("half_fov_x_deg", half_fov_x_deg)?;
        require("width", size.width as f64, size.width > 0, "at least 1")?;
        require("height", size.height as f64, size.height > 0, "at least 1")?;
        let tan_half_x = half_fov_x_deg.to_radians().tan();
        let tan_half_y = tan_half_x * size.height as f64 / size.width as f64;
        let pinhole = Pinhole::of_half_tangents(size, (tan_half_x, tan_half_y));
        Ok(Self { size, pinhole, distortion: Distortion::NONE })
    }

    /// The same with a vertical angle of its own, for pixels that are not square.
    ///
    /// # Errors
    /// Where the angle is not in (0, 85].
    pub fn with_half_fov_y(mut self, half_fov_y_deg: f64) -> Result<Self> {
        require_half_angle("half_fov_y_deg", half_fov_y_deg)?;
        self.pinhole.focal_px.1 = self.middle().y / half_fov_y_deg.to_radians().tan();
        Ok(self)
    }

    /// The same with a distortion.
    #[must_use]
    pub const fn with_distortion(mut self, distortion: Distortion) -> Self {
        self.distortion = distortion;
        self
    }

    /// Width and height of the picture, pixels.
    pub const fn size(&self) -> Size {
        self.size
    }

    /// Half the horizontal and half the vertical angle of view, degrees.
    pub fn half_fov_deg(&self) -> (f64, f64) {
        let (middle, focal) = (self.middle(), self.pinhole.focal_px);
        ((middle.x / focal.0).atan().to_degrees(), (middle.y / focal.1).atan().to_degrees())
    }

    /// The middle of the picture.
    pub const fn middle(&self) -> Point {
        self.pinhole.center
    }

    /// The tangents, to the right and **downward**, of the ray that is shown at `pixel`.
    pub fn offset(&self, pixel: Point) -> (f64, f64) {
        self.distortion.remove(self.pinhole.ray(pixel))
    }

    /// The pixel at which a ray of tangents `(x, y)`, to the right and downward, is shown.
    pub fn pixel(&self, offset: (f64, f64)) -> Point {
        let (right, down) = self.distortion.apply(offset);
        self.pinhole.pixel([right, down, 1.0])
    }

    /// How far the picture reaches in pan and in tilt to either side of an optical axis at this tilt, degrees: more in pan the
    /// steeper the camera looks, and all round where it sees straight up or down.
    pub fn reach(&self, tilt_deg: f64) -> Direction {
        let (right, bottom) = (self.size.width as f64, self.size.height as f64);
        let pose = Direction::new(0.0, tilt_deg);
        if tilt_deg.abs() + self.half_fov_deg().1 >= 90.0 {
            return Direction::new(180.0, 180.0);
        }
        let border =
            [0.0, 0.5, 1.0].into_iter().flat_map(|x| [0.0, 0.5, 1.0].map(|y| Point::new(x * right, y * bottom)));
        border.fold(Direction::AHEAD, |reach, pixel| {
            let off = direction_of(self, pose, pixel, AngleFormula::PanThenTilt).from(pose);
            Direction::new(reach.pan_deg.max(off.pan_deg.abs()), reach.tilt_deg.max(off.tilt_deg.abs()))
        })
    }

    /// Pixels per degree in the middle of the picture, along x and y.
    pub fn px_per_deg(&self) -> (f64, f64) {
        let per_tangent = 1f64.to_radians();
        (self.pinhole.focal_px.0 * per_tangent, self.pinhole.focal_px.1 * per_tangent)
    }
}

const fn require_half_angle(name: &'static str, value: f64) -> Result<()> {
    require(name, value, value > 0.0 && value <= 85.0, "above 0 and at most 85 degrees")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens() -> Lens {
        Lens::new(Size::new(320, 240), 30.0).unwrap()
    }

    #[test]
    fn a_steep_camera_reaches_further_round() {
        let level = lens().reach(0.0);
        assert!((level.pan_deg - 30.0).abs() < 1e-9 && (level.tilt_deg - lens().half_fov_deg().1).abs() < 1e-9);
        let steep = lens().reach(-50.0);
        assert!(steep.pan_deg > 50.0 && steep.pan_deg < 90.0, "{steep:?}");
        assert_eq!(lens().reach(70.0), Direction::new(180.0, 180.0));
    }

    #[test]
    fn square_pixels_give_the_vertical_angle() {
        let (x, y) = lens().half_fov_deg();
        assert!((x - 30.0).abs() < 1e-12 && (y - 23.413_224_446_370_54).abs() < 1e-12);
        let (_, y) = lens().with_half_fov_y(20.0).unwrap().half_fov_deg();
        assert!((y - 20.0).abs() < 1e-12);
    }

    #[test]
    fn offsets_and_pixels_are_inverse() {
        let lens = lens().with_distortion(Distortion::new(-0.2, 0.01).unwrap());
        for (x, y) in [(160.0, 120.0), (0.0, 0.0), (319.5, 17.25)] {
            let back = lens.pixel(lens.offset(Point::new(x, y)));
            assert!((back.x - x).abs() < 1e-9 && (back.y - y).abs() < 1e-9);
        }
        let (right, down) = lens.offset(Point::new(200.0, 150.0));
        assert!(right > 0.0 && down > 0.0);
    }

    #[test]
    fn pixels_per_degree_is_the_slope_in_the_middle() {
        let (px, py) = lens().px_per_deg();
        let step = lens().pixel((0.01f64.to_radians().tan(), 0.01f64.to_radians().tan()));
        assert!(((step.x - 160.0) / 0.01 - px).abs() < 1e-4 && ((step.y - 120.0) / 0.01 - py).abs() < 1e-4);
        assert!((px - 4.836_8).abs() < 1e-3, "{px}");
    }

    #[test]
    fn impossible_lenses_are_refused() {
        for angle in [0.0, -1.0, 86.0, f64::NAN] {
            assert!(Lens::new(Size::new(320, 240), angle).is_err());
            assert!(lens().with_half_fov_y(angle).is_err());
        }
        assert!(Lens::new(Size::new(0, 240), 30.0).is_err() && Lens::new(Size::new(320, 0), 30.0).is_err());
        assert!(Lens::new(Size::new(320, 240), 85.0).is_ok());
    }
}
