use super::params::CameraParams;
use super::random::Random;
use crate::geometry::{Direction, Lens, pixel_of};
use crate::{Position, Result};
use pursuit_geometry::{BBox, Point};

/// One picture of a simulated camera: when it was taken, how the camera stood, and what of the target is in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// When it was taken, seconds.
    pub time_s: f64,
    /// When it reaches the program, seconds.
    pub arrival_s: f64,
    /// How the camera truly stood.
    pub position: Position,
    /// How far it was rolled about its optical axis, clockwise as it looks, degrees.
    pub roll_deg: f64,
    /// Its lens at that zoom.
    pub lens: Lens,
    /// The target's true box, also where it is outside of the picture; `None` when it is behind the camera.
    pub truth: Option<BBox>,
}

impl Exposure {
    /// Whether the middle of the target is in the picture.
    pub fn shows_target(&self) -> bool {
        let size = self.lens.size();
        self.truth.is_some_and(|truth| {
            let c = truth.center();
            (0.0..=size.width as f64).contains(&c.x) && (0.0..=size.height as f64).contains(&c.y)
        })
    }

    /// How far the middle of the target is from the middle of the picture, to the right and downward, in halves of the
    /// picture's width and height.
    pub fn offset(&self) -> Option<(f64, f64)> {
        let middle = self.lens.middle();
        let c = self.truth?.center();
        Some(((c.x - middle.x) / middle.x, (c.y - middle.y) / middle.y))
    }
}

/// Takes pictures at its rate and hands them on late.
#[derive(Debug, Clone)]
pub struct SimulatedCamera {
    params: CameraParams,
    taken: u64,
    last_arrival_s: f64,
    random: Random,
}

impl SimulatedCamera {
    /// A camera that takes its first picture at time 0.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn new(params: CameraParams, seed: u64) -> Result<Self> {
        params.check()?;
        Ok(Self { params, taken: 0, last_arrival_s: f64::NEG_INFINITY, random: Random::new(seed, 3) })
    }

    /// When the next picture is taken, seconds.
    pub fn next_s(&self) -> f64 {
        self.taken as f64 / self.params.fps
    }

    /// Takes the next picture, of a target in this direction with these tangents of width and height, and says whether it arrives.
    /// `roll_deg` is how far the camera is rolled clockwise.
    ///
    /// # Errors
    /// Never for sound parameters.
    pub fn take(
        &mut self,
        position: Position,
        roll_deg: f64,
        target: (Direction, f64, f64),
    ) -> Result<(Exposure, bool)> {
        let time_s = self.next_s();
        self.taken += 1;
        let lens = self.params.views.lens(position.zoom, self.params.size)?;
        let (direction, width, height) = target;
        let px_per_tangent = lens.middle().x / lens.half_fov_deg().0.to_radians().tan();
        let truth = pixel_of(&lens, position.direction, direction)
            .map(|center| BBox::from_center_size(center, width * px_per_tangent, height * px_per_tangent))
            .map(|truth| rolled(truth, lens.middle(), roll_deg));
        let (late, lost) = (self.random.unit(), self.random.happens(self.params.dropped));
        let arrival_s = (time_s + self.params.age_s + self.params.jitter_s * late).max(self.last_arrival_s);
        self.last_arrival_s = arrival_s;
        Ok((Exposure { time_s, arrival_s, position, roll_deg, lens, truth }, !lost))
    }
}

/// A box as a camera sees it that is rolled clockwise: turned the other way about the middle of the picture.
fn rolled(truth: BBox, middle: Point, roll_deg: f64) -> BBox {
    if roll_deg == 0.0 {
        return truth;
    }
    let (sine, cosine) = (-roll_deg).to_radians().sin_cos();
    let (x, y) = (truth.center().x - middle.x, truth.center().y - middle.y);
    let center = Point::new(middle.x + cosine * x - sine * y, middle.y + sine * x + cosine * y);
    let (width, height) = (truth.width(), truth.height());
    let (across, down) = (cosine.abs(), sine.abs());
    BBox::from_center_size(center, across * width + down * height, down * width + across * height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_taken_at_the_rate_and_arrive_late_and_in_order() {
        let params = CameraParams { jitter_s: 0.2, dropped: 0.25, ..CameraParams::usual().unwrap() };
        let mut camera = SimulatedCamera::new(params, 1).unwrap();
        let mut last = 0.0;
        let mut kept = 0;
        for k in 0..2000 {
            assert!((camera.next_s() - f64::from(k) / 25.0).abs() < 1e-12);
            let (exposure, arrives) = camera.take(Position::default(), 0.0, (Direction::AHEAD, 0.1, 0.3)).unwrap();
            let age = exposure.arrival_s - exposure.time_s;
            assert!((0.15..0.35001).contains(&age) && exposure.arrival_s >= last);
            last = exposure.arrival_s;
            kept += u32::from(arrives);
        }
        assert!((1400..1600).contains(&kept), "{kept}");
    }

    #[test]
    fn the_target_is_where_the_lens_shows_it() {
        let mut camera = SimulatedCamera::new(CameraParams::usual().unwrap(), 1).unwrap();
        let position = Position { direction: Direction::new(40.0, 0.0), zoom: 0.0 };
        let (exposure, _) = camera.take(position, 0.0, (Direction::new(70.0, 0.0), 0.1, 0.3)).unwrap();
        assert!(exposure.shows_target());
        let (x, y) = exposure.offset().unwrap();
        assert!((x - 1.0).abs() < 1e-9 && y.abs() < 1e-9);
        let truth = exposure.truth.unwrap();
        assert!((truth.width() - 0.1 * 320.0 / 30f64.to_radians().tan()).abs() < 1e-9);
        assert!((truth.height() / truth.width() - 3.0).abs() < 1e-9);
        let (exposure, _) = camera.take(position, 0.0, (Direction::new(70.1, 0.0), 0.1, 0.3)).unwrap();
        assert!(!exposure.shows_target());
        let (exposure, _) = camera.take(position, 0.0, (Direction::new(-140.0, 0.0), 0.1, 0.3)).unwrap();
        assert_eq!((exposure.truth, exposure.offset(), exposure.shows_target()), (None, None, false));
    }

    #[test]
    fn a_rolled_camera_sees_boxes_turned_about_the_middle() {
        let middle = Point::new(320.0, 180.0);
        let right = BBox::from_center_size(Point::new(420.0, 180.0), 10.0, 30.0);
        // What is at the right of a camera that is rolled to the right is up in its picture.
        let turned = rolled(right, middle, 90.0);
        assert!((turned.center().x - 320.0).abs() < 1e-9 && (turned.center().y - 80.0).abs() < 1e-9);
        assert!((turned.width() - 30.0).abs() < 1e-9 && (turned.height() - 10.0).abs() < 1e-9);
        assert_eq!(rolled(right, middle, 0.0), right);
    }
}
