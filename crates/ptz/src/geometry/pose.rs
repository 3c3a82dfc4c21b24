use super::{AngleFormula, Direction, Lens, qu2010};
use pursuit_geometry::Point;

/// The direction in the world of what a camera that looks towards `pose` shows at `pixel`.
///
/// See [`pursuit_geometry::camera::Direction::along`].
pub fn direction_of(lens: &Lens, pose: Direction, pixel: Point, formula: AngleFormula) -> Direction {
    match formula {
        AngleFormula::Qu2010 => pose.turned(qu2010::turn(lens, pixel)),
        AngleFormula::PanThenTilt => {
            // The head's own pan is added in degrees, in which it was given.
            let seen = Direction::new(0.0, pose.tilt_deg).radians().along(lens.offset(pixel));
            Direction::new(pose.pan_deg + seen.pan_rad.to_degrees(), seen.tilt_rad.to_degrees())
        }
    }
}

/// Where a camera that looks towards `pose` shows `direction`; `None` when that lies behind it. The pixel may be outside
/// of the picture.
pub fn pixel_of(lens: &Lens, pose: Direction, direction: Direction) -> Option<Point> {
    let turned = Direction::new(direction.pan_deg - pose.pan_deg, direction.tilt_deg);
    let [right, down, ahead] = Direction::new(0.0, pose.tilt_deg).radians().ray_to(turned.radians())?;
    Some(lens.pixel((right / ahead, down / ahead)))
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

    proptest! {
        #[test]
        fn directions_come_back_as_pixels(
            pan in -80.0..80.0f64, tilt in -50.0..50.0f64, u in 0.0..320.0f64, v in 0.0..240.0f64,
        ) {
            let lens = Lens::new(Size::new(320, 240), 30.0).unwrap();
            let (pose, pixel) = (Direction::new(pan, tilt), Point::new(u, v));
            let found = direction_of(&lens, pose, pixel, AngleFormula::PanThenTilt);
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
