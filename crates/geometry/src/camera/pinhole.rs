use crate::{Point, Size};

/// A camera without distortion: focal lengths and principal point, in continuous pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    /// Focal lengths along x and y, above 0.
    pub focal_px: (f64, f64),
    /// Where the optical axis meets the picture.
    pub center: Point,
}

impl Pinhole {
    /// The axis through the middle of a picture of `size` that shows the tangents `(right, down)` at its right and its lower
    /// edge.
    pub fn of_half_tangents(size: Size, (right, down): (f64, f64)) -> Self {
        let center = Point::new(size.width as f64 / 2.0, size.height as f64 / 2.0);
        Self { focal_px: (center.x / right, center.y / down), center }
    }

    /// The tangents of the ray that is shown at `pixel`.
    pub fn ray(&self, pixel: Point) -> (f64, f64) {
        ((pixel.x - self.center.x) / self.focal_px.0, (pixel.y - self.center.y) / self.focal_px.1)
    }

    /// The pixel at which a ray is shown; it may lie outside of the picture.
    pub fn pixel(&self, [right, down, ahead]: [f64; 3]) -> Point {
        Point::new(self.center.x + self.focal_px.0 * right / ahead, self.center.y + self.focal_px.1 * down / ahead)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_and_pixels_are_inverse() {
        let camera = Pinhole::of_half_tangents(Size::new(320, 240), (0.5, 0.25));
        assert_eq!(camera.ray(Point::new(320.0, 0.0)), (0.5, -0.25));
        assert_eq!(camera.pixel([0.0, 0.0, 2.0]), Point::new(160.0, 120.0));
        let pixel = Point::new(17.25, 230.5);
        let (right, down) = camera.ray(pixel);
        assert!(camera.pixel([right, down, 1.0]).distance(pixel) < 1e-12);
    }
}
