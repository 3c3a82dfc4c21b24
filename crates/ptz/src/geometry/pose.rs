use super::{AngleFormula, Direction, Lens, qu2010};
use pursuit_geometry::Point;

/// The direction in the world of what a camera that looks towards `pose` shows at `pixel`.
///
/// The camera is tilted about its own horizontal axis and the tilted camera is panned about the vertical, as heads are
/// built. A level camera that looks ahead gives `pan = atan x`, `tilt = −atan(y / √(1 + x²))` for tangents `(x, y)`.
pub fn direction_of(lens: &Lens, pose: Direction, pixel: Point, formula: AngleFormula) -> Direction {
    match formula {
        AngleFormula::Qu2010 => pose.turned(qu2010::turn(lens, pixel)),
        AngleFormula::PanThenTilt => {
            let (right, down) = lens.offset(pixel);
            let (sin_tilt, cos_tilt) = pose.tilt_deg.to_radians().sin_cos();
            // The ray (right, −down, 1), tilted: its parts upward and ahead.
            let (up, ahead) = (sin_tilt - down * cos_tilt, cos_tilt + down * sin_tilt);
            let pan = right.atan2(ahead).to_degrees();
            Direction::new(pose.pan_deg + pan, up.atan2(right.hypot(ahead)).to_degrees())
        }
    }
}

/// Where a camera that looks towards `pose` shows `direction`; `None` when that lies behind it. The pixel may be outside
/// of the picture.
pub fn pixel_of(lens: &Lens, pose: Direction, direction: Direction) -> Option<Point> {
    let [right, up, ahead] = Direction::new(direction.pan_deg - pose.pan_deg, direction.tilt_deg).unit();
    let (sin_tilt, cos_tilt) = pose.tilt_deg.to_radians().sin_cos();
    let (up, depth) = (up * cos_tilt - ahead * sin_tilt, ahead * cos_tilt + up * sin_tilt);
    (depth > 1e-6).then(|| lens.pixel((right / depth, -up / depth)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_geometry::Size;

    #[derive(serde::Deserialize)]
    struct Row {
        u: f64,
        v: f64,
        half_fov_x: f64,
        half_fov_y: f64,
        alpha: f64,
        beta: f64,
        pan_exact: f64,
        tilt_exact: f64,
    }

    #[derive(serde::Deserialize)]
    struct Fixture {
        tolerance: f64,
        rows: Vec<Row>,
    }

    /// `ptz_angles.json` was computed with numpy from the paper's equations and from an ideal pinhole camera.
    #[test]
    fn angles_are_those_of_the_independent_fixture() {
        let fixture: Fixture = serde_json::from_str(include_str!("../../tests/fixtures/ptz_angles.json")).unwrap();
        assert!(fixture.rows.len() >= 10);
        for row in &fixture.rows {
            let lens = Lens::new(Size::new(320, 240), row.half_fov_x).unwrap().with_half_fov_y(row.half_fov_y).unwrap();
            let pixel = Point::new(row.u, row.v);
            let (alpha, beta) = qu2010::angles_deg(&lens, pixel);
            let close = |a: f64, b: f64| (a - b).abs() <= fixture.tolerance;
            assert!(close(alpha, row.alpha) && close(beta, row.beta), "{alpha} {beta}");
            // The fixture's angles grow downward, ours upward.
            let printed = direction_of(&lens, Direction::AHEAD, pixel, AngleFormula::Qu2010);
            assert!(close(printed.pan_deg, row.alpha) && close(-printed.tilt_deg, row.beta));
            let exact = direction_of(&lens, Direction::AHEAD, pixel, AngleFormula::PanThenTilt);
            assert!(close(exact.pan_deg, row.pan_exact) && close(-exact.tilt_deg, row.tilt_exact), "{exact:?}");
        }
    }

    #[test]
    fn the_papers_formula_leaves_the_corner_14_pixels_off() {
        let lens = Lens::new(Size::new(320, 240), 30.0).unwrap();
        let corner = Point::new(320.0, 240.0);
        let exact = direction_of(&lens, Direction::AHEAD, corner, AngleFormula::PanThenTilt);
        let turned = Direction::AHEAD.turned(qu2010::turn(&lens, corner));
        let left_over = pixel_of(&lens, turned, exact).unwrap();
        let off = (left_over.y - 120.0).hypot(left_over.x - 160.0);
        assert!((off - 13.8).abs() < 0.1, "{off}");
        assert!((exact.tilt_deg - turned.tilt_deg - 2.857).abs() < 1e-3);
    }

    /// The slow twin: rotation matrices.
    fn by_matrices(lens: &Lens, pose: Direction, pixel: Point) -> Direction {
        use nalgebra::{Rotation3, Vector3};
        let (x, y) = lens.offset(pixel);
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), -pose.tilt_deg.to_radians());
        let pan = Rotation3::from_axis_angle(&Vector3::y_axis(), pose.pan_deg.to_radians());
        let world = pan * tilt * Vector3::new(x, -y, 1.0).normalize();
        Direction::new(world.x.atan2(world.z).to_degrees(), world.y.asin().to_degrees())
    }

    proptest! {
        #[test]
        fn directions_are_those_of_rotation_matrices_and_come_back_as_pixels(
            pan in -80.0..80.0f64, tilt in -50.0..50.0f64, u in 0.0..320.0f64, v in 0.0..240.0f64,
        ) {
            let lens = Lens::new(Size::new(320, 240), 30.0).unwrap();
            let (pose, pixel) = (Direction::new(pan, tilt), Point::new(u, v));
            let found = direction_of(&lens, pose, pixel, AngleFormula::PanThenTilt);
            prop_assert!(found.angle_to(by_matrices(&lens, pose, pixel)) < 1e-9);
            let back = pixel_of(&lens, pose, found).unwrap();
            prop_assert!((back.x - u).abs() < 1e-7 && (back.y - v).abs() < 1e-7);
        }
    }

    #[test]
    fn what_lies_behind_has_no_pixel() {
        let lens = Lens::new(Size::new(320, 240), 30.0).unwrap();
        assert_eq!(pixel_of(&lens, Direction::AHEAD, Direction::new(180.0, 0.0)), None);
        assert_eq!(pixel_of(&lens, Direction::AHEAD, Direction::new(90.0, 0.0)), None);
        assert!(pixel_of(&lens, Direction::new(170.0, 0.0), Direction::new(-175.0, 0.0)).unwrap().x > 160.0);
    }
}
