use crate::Position;
use crate::rotation::Rotation;

/// A place on flat ground at the height from which the vehicle started.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GroundPoint {
    pub latitude_deg: f64,
    pub longitude_deg: f64,
    pub altitude_m: f64,
    /// From the camera, metres.
    pub distance_m: f64,
    /// One standard deviation on the ground, metres.
    pub accuracy_m: f64,
}

/// How well an attitude is known, one standard deviation: what small autopilots reach in flight.
const ATTITUDE_RAD: f64 = 0.035;
/// Nearer to the horizon than this the place on the ground means nothing.
const LEAST_DEPRESSION: f64 = 0.05;
/// Metres of a degree of latitude, on a sphere of the earth's mean radius.
const METRES_PER_DEGREE: f64 = 111_194.93;

/// Where a ray from the camera meets the ground: `right` and `down` are its tangents in the picture, `camera` turns the camera's axes into
/// north, east and down. `None` for one that goes to the horizon or above.
pub(crate) fn ground_point(from: &Position, camera: Rotation, right: f64, down: f64) -> Option<GroundPoint> {
    let ray = camera.apply([1.0, right, down]);
    let length = ray.iter().map(|v| v * v).sum::<f64>().sqrt();
    let [north, east, below] = ray.map(|v| v / length);
    if !(below > LEAST_DEPRESSION && from.above_ground_m > 0.0) {
        return None;
    }
    let distance_m = from.above_ground_m / below;
    let per_longitude = METRES_PER_DEGREE * from.latitude_deg.to_radians().cos().max(1e-6);
    Some(GroundPoint {
        latitude_deg: from.latitude_deg + distance_m * north / METRES_PER_DEGREE,
        longitude_deg: from.longitude_deg + distance_m * east / per_longitude,
        altitude_m: from.altitude_m - from.above_ground_m,
        distance_m,
        accuracy_m: distance_m * ATTITUDE_RAD / below,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: Position =
        Position { latitude_deg: 48.0, longitude_deg: 11.0, altitude_m: 550.0, above_ground_m: 100.0 };

    #[test]
    fn a_ray_at_45_degrees_meets_the_ground_as_far_as_high() {
        let north = Rotation::from_euler(0.0, -std::f64::consts::FRAC_PI_4, 0.0);
        let point = ground_point(&HERE, north, 0.0, 0.0).unwrap();
        assert!(((point.latitude_deg - 48.0) * METRES_PER_DEGREE - 100.0).abs() < 1e-6);
        assert!((point.longitude_deg - 11.0).abs() < 1e-12);
        assert!((point.distance_m - 141.421_356).abs() < 1e-5 && (point.altitude_m - 450.0).abs() < 1e-9);
        // To the right of a camera that looks straight down, its top to the north, is east.
        let down = Rotation::from_euler(0.0, -std::f64::consts::FRAC_PI_2, 0.0);
        let point = ground_point(&HERE, down, 0.5, 0.0).unwrap();
        let east = (point.longitude_deg - 11.0) * METRES_PER_DEGREE * 48_f64.to_radians().cos();
        assert!((east - 50.0).abs() < 1e-6 && (point.latitude_deg - 48.0).abs() < 1e-9);
    }

    #[test]
    fn above_the_horizon_there_is_no_ground() {
        assert_eq!(ground_point(&HERE, Rotation::from_euler(0.0, 0.0, 0.0), 0.0, 0.0), None);
        let landed = Position { above_ground_m: 0.0, ..HERE };
        assert_eq!(ground_point(&landed, Rotation::from_euler(0.0, -1.0, 0.0), 0.0, 0.0), None);
    }
}
