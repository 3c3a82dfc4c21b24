use pursuit_geometry::Point;

/// A point of the world in metres: x to the right, y up from the table's surface, z away from the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct World {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

/// Focal length in pixels of the 640 × 480 picture.
const FOCAL_PX: f64 = 700.0;
/// The camera above the table, in metres.
pub(super) const HEIGHT_M: f64 = 0.42;
/// Sine and cosine of its downward tilt of 16°.
const TILT: (f64, f64) = (0.275_637_355_817, 0.961_261_695_938);
const CENTER: Point = Point::new(320.0, 240.0);

/// How wide the camera sees, in radians: 49°. Views are aimed from its axis, which is tilted downwards by itself.
pub(super) fn home_rad() -> f64 {
    2.0 * (CENTER.x / FOCAL_PX).atan()
}

/// Where a point appears, and the pixels that a metre has there.
pub(super) fn project(p: World) -> (Point, f64) {
    let (sin, cos) = TILT;
    let above = p.y - HEIGHT_M;
    let depth = p.z * cos - above * sin;
    let scale = FOCAL_PX / depth;
    (Point::new(CENTER.x + p.x * scale, CENTER.y - (above * cos + p.z * sin) * scale), scale)
}

/// The direction in which the camera sees a pixel, one metre long along its axis; the ray starts at `(0, HEIGHT_M, 0)`.
pub(super) fn ray(pixel: Point) -> World {
    let (sin, cos) = TILT;
    let (right, up) = ((pixel.x - CENTER.x) / FOCAL_PX, (CENTER.y - pixel.y) / FOCAL_PX);
    World { x: right, y: up * cos - sin, z: up * sin + cos }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_runs_through_the_point_that_projects_to_its_pixel() {
        let p = World { x: -0.3, y: 0.1, z: 1.4 };
        let r = ray(project(p).0);
        let along = p.z / r.z;
        assert!((r.x * along - p.x).abs() < 1e-9 && (HEIGHT_M + r.y * along - p.y).abs() < 1e-9);
    }
}
