use super::SpaceParams;
use nalgebra::SVector;
use pursuit_estimation::motion::ConstantVelocity;
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel, Result, Transition};
use pursuit_geometry::Point;
use serde::{Deserialize, Serialize};

/// Where the target goes in space, `[x, y, z]` in metres before the camera, with constant velocity: in the picture that is
/// faster the nearer it comes. Needs the camera's focal lengths and principal point, in pixels.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SpacePath {
    belief: Gaussian<6>,
}

/// Focal lengths and principal point, `[fx, fy, cx, cy]` in pixels.
pub type Pinhole = [f64; 4];

/// The point of space seen at `center` at the distance `z_m`.
fn unproject([fx, fy, cx, cy]: Pinhole, center: Point, z_m: f64) -> SVector<f64, 3> {
    SVector::from([(center.x - cx) * z_m / fx, (center.y - cy) * z_m / fy, z_m])
}

/// Where the picture shows a state; `None` nearer than `nearest_m`, or behind the camera.
fn project([fx, fy, cx, cy]: Pinhole, state: &SVector<f64, 6>, nearest_m: f64) -> Option<Point> {
    (state[2] >= nearest_m).then(|| Point::new(cx + fx * state[0] / state[2], cy + fy * state[1] / state[2]))
}

/// Of a place that is measured, in square metres.
fn variances(params: &SpaceParams, [fx, fy, ..]: Pinhole, z_m: f64) -> [f64; 3] {
    let (x, y, z) = (params.center_px * z_m / fx, params.center_px * z_m / fy, params.distance * z_m * z_m);
    [x * x, y * y, z * z]
}

/// The motion over `dt_s` seconds.
fn motion(params: &SpaceParams, dt_s: f64) -> Result<Transition<6>> {
    ConstantVelocity::<3>::white(params.acceleration).over(dt_s)
}

impl SpacePath {
    /// At rest where it is seen at `center`, `z_m` metres away.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn new(params: &SpaceParams, pinhole: Pinhole, center: Point, z_m: f64) -> Result<Self> {
        let at = unproject(pinhole, center, z_m);
        let (place, speed) = (variances(params, pinhole, z_m), params.start_speed * params.start_speed);
        let mean = SVector::from([at[0], at[1], at[2], 0.0, 0.0, 0.0]);
        let variances = SVector::from([place[0], place[1], place[2], speed, speed, speed]);
        Ok(Self { belief: Gaussian::from_variances(mean, variances)? })
    }

    /// How far it moves in the picture in `dt_s` seconds, in pixels; `None` where it leaves the camera's sight.
    ///
    /// # Errors
    /// Where the step cannot be computed.
    pub fn shift_px(&self, params: &SpaceParams, pinhole: Pinhole, dt_s: f64) -> Result<Option<SVector<f64, 2>>> {
        let ahead = self.belief.predicted(&motion(params, dt_s)?)?;
        let places = project(pinhole, self.belief.mean(), params.nearest_m).zip(project(
            pinhole,
            ahead.mean(),
            params.nearest_m,
        ));
        Ok(places.map(|(now, then)| SVector::from([then.x - now.x, then.y - now.y])))
    }

    /// Moves on by `dt_s` seconds.
    ///
    /// # Errors
    /// Where the step cannot be computed; nothing changes then.
    pub fn predict(&mut self, params: &SpaceParams, dt_s: f64) -> Result<()> {
        self.belief.predict(&motion(params, dt_s)?)
    }

    /// It was seen at `center`, `z_m` metres away.
    ///
    /// # Errors
    /// Where a number is not finite; nothing changes then.
    pub fn correct(&mut self, params: &SpaceParams, pinhole: Pinhole, center: Point, z_m: f64) -> Result<()> {
        let sensor = LinearMeasurement::<3, 6>::select([0, 1, 2], variances(params, pinhole, z_m))?;
        self.belief.update(&sensor, &unproject(pinhole, center, z_m)).map(drop)
    }

    /// Its distance in metres.
    #[cfg(test)]
    fn distance_m(&self) -> f64 {
        self.belief.mean()[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PINHOLE: Pinhole = [500.0, 400.0, 320.0, 240.0];

    #[test]
    fn what_comes_nearer_goes_faster_in_the_picture() {
        let params = SpaceParams::default();
        // From (-0.5, 0.2, 4) m with (0.3, 0, -1) m/s.
        let at = |t: f64| {
            let (x, y, z) = (-0.5 + 0.3 * t, 0.2, 4.0 - t);
            (Point::new(320.0 + 500.0 * x / z, 240.0 + 400.0 * y / z), z)
        };
        let mut path = SpacePath::new(&params, PINHOLE, at(0.0).0, 4.0).unwrap();
        for k in 1..=60 {
            path.predict(&params, 1.0 / 30.0).unwrap();
            let (center, z) = at(f64::from(k) / 30.0);
            path.correct(&params, PINHOLE, center, z).unwrap();
        }
        assert!((path.distance_m() - 2.0).abs() < 0.01);
        // Two seconds on it is 1.9 m... half a second ahead:
        let shift = path.shift_px(&params, PINHOLE, 0.5).unwrap().unwrap();
        let (now, then) = (at(2.0).0, at(2.5).0);
        assert!((shift - SVector::from([then.x - now.x, then.y - now.y])).norm() < 2.0, "{shift} {now:?} {then:?}");
        // It reaches the camera after two seconds more.
        assert_eq!(path.shift_px(&params, PINHOLE, 2.5).unwrap(), None);
        assert!(
            path.shift_px(&params, PINHOLE, 0.0).is_err()
                && path.correct(&params, PINHOLE, Point::new(f64::NAN, 0.0), 1.0).is_err()
        );
    }
}
