use super::camera::{Exposure, SimulatedCamera};
use super::drone::{Drone, DroneParams};
use super::head::SimulatedHead;
use super::params::{CameraParams, HeadParams};
use super::random::Random;
use crate::control::Controller;
use crate::{Aim, Direction, Forecast, Position, Result};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::CameraPose;
use pursuit_tracking::TrackState;
use pursuit_tracking::motion::{CameraCompensation, CameraShift, Motion, MotionFilter, MotionParams, Sight};
use std::collections::VecDeque;

/// What looks at the pictures of a simulation: a tracker, or something that stands for one.
pub trait Eye {
    /// What is seen in a picture; called once for each picture that arrives, in order. `camera` is how the controller
    /// believes that the camera stood, where it keeps account of that.
    ///
    /// # Errors
    /// Where the picture cannot be made or looked at.
    fn look(&mut self, exposure: &Exposure, camera: Option<CameraPose>) -> Result<Box<dyn Forecast + '_>>;
}

/// Stands for a tracker: sees the true box with an error, and expects the target by a motion model as trackers do.
#[derive(Debug, Clone)]
pub struct NoisyEye {
    sigma_px: f64,
    missed: f64,
    /// When the target is behind something, seconds from and to.
    hidden: Vec<(f64, f64)>,
    random: Random,
    /// What the motion of the target is believed to be in the picture, with the time of the last picture, seconds.
    motion: Option<(Motion, f64)>,
    camera: CameraShift,
}

impl NoisyEye {
    /// An eye whose error is normal with a deviation of `sigma_px`, and that overlooks the target in the fraction `missed`
    /// of pictures.
    pub fn new(sigma_px: f64, missed: f64, seed: u64) -> Self {
        let (random, camera) = (Random::new(seed, 4), CameraShift::new(CameraCompensation::Pose));
        Self { sigma_px, missed, hidden: Vec::new(), random, motion: None, camera }
    }

    /// The target is behind something from one time to another, seconds.
    #[must_use]
    pub fn hiding(self, hidden: Vec<(f64, f64)>) -> Self {
        Self { hidden, ..self }
    }
}

impl Eye for NoisyEye {
    fn look(&mut self, exposure: &Exposure, camera: Option<CameraPose>) -> Result<Box<dyn Forecast + '_>> {
        let error = Point::new(self.random.normal() * self.sigma_px, self.random.normal() * self.sigma_px);
        let missed = self.random.happens(self.missed)
            || self.hidden.iter().any(|(from, to)| (*from..*to).contains(&exposure.time_s));
        let seen = exposure.truth.filter(|_| exposure.shows_target() && !missed);
        let seen = seen.map(|truth| truth.translated(error.x, error.y));
        self.follow(exposure, camera, seen)?;
        let stamp_s = exposure.arrival_s;
        Ok(Box::new(move |time_s: f64| {
            let (motion, _) = self.motion.as_ref()?;
            let bbox = if time_s > stamp_s { motion.forecast(stamp_s, time_s - stamp_s).ok()?.bbox } else { seen? };
            seen.map(|_| Aim { bbox, covariance: None, state: TrackState::Tracking })
        }))
    }
}

impl NoisyEye {
    /// Predicts the motion into this picture, and corrects it by what is seen.
    fn follow(&mut self, exposure: &Exposure, camera: Option<CameraPose>, seen: Option<BBox>) -> Result<()> {
        let Some((motion, before_s)) = &mut self.motion else {
            if let Some(bbox) = seen {
                self.camera.by_pose(camera, exposure.lens.size(), bbox.center());
                self.motion = Some((Motion::new(MotionParams::default(), bbox)?, exposure.time_s));
            }
            return Ok(());
        };
        if let Some(shift) = self.camera.by_pose(camera, exposure.lens.size(), motion.bbox().center()) {
            motion.carry(shift);
        }
        motion.predict(exposure.time_s - *before_s)?;
        if let Some(bbox) = seen {
            motion.correct(&Sight::of(bbox, Some(self.sigma_px.max(0.1))))?;
        }
        *before_s = exposure.time_s;
        Ok(())
    }
}

/// A loop to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The head.
    pub head: HeadParams,
    /// The camera on it.
    pub camera: CameraParams,
    /// The drone that carries it, where one does.
    pub drone: Option<DroneParams>,
    /// How long, seconds.
    pub duration_s: f64,
    /// How often the controller is asked, seconds.
    pub tick_s: f64,
}

/// One picture of a simulation, as it truly was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// When it was taken, seconds.
    pub time_s: f64,
    /// Where the target was, in the world.
    pub target: Direction,
    /// How the camera stood.
    pub position: Position,
    /// How far the target was from the middle of the picture, in halves of its width and height; `None` behind the camera.
    pub offset: Option<(f64, f64)>,
    /// Whether the middle of the target was in the picture.
    pub shown: bool,
}

/// Runs the loop: target, head, camera, eye, controller, and back to the head.
///
/// `target` gives direction and tangents of width and height at a time. The controller sees each picture when it arrives,
/// stamped with its arrival.
///
/// # Errors
/// Where parameters are out of range, or the eye or the controller fails.
pub fn run(
    simulation: &Simulation,
    seed: u64,
    target: &dyn Fn(f64) -> (Direction, f64, f64),
    eye: &mut dyn Eye,
    controller: &mut dyn Controller,
) -> Result<Vec<Sample>> {
    let tick_s = simulation.tick_s.max(0.001);
    let mut head = SimulatedHead::new(simulation.head.clone(), seed)?;
    let mut camera = SimulatedCamera::new(simulation.camera.clone(), seed)?;
    let drone = simulation.drone.map(|params| Drone::new(params, seed));
    let mut under_way: VecDeque<Exposure> = VecDeque::new();
    let mut samples = Vec::new();
    let mut tick = 0_u32;
    loop {
        let now_s = f64::from(tick) * tick_s;
        if now_s > simulation.duration_s {
            return Ok(samples);
        }
        tick += 1;
        while camera.next_s() <= now_s {
            let time_s = camera.next_s();
            head.advance_to(time_s);
            let there = target(time_s);
            let (position, roll_deg) = stands(head.position(), drone.as_ref(), time_s);
            let (exposure, arrives) = camera.take(position, roll_deg, there)?;
            let (offset, shown) = (exposure.offset(), exposure.shows_target());
            samples.push(Sample { time_s, target: there.0, position: exposure.position, offset, shown });
            under_way.extend(arrives.then_some(exposure));
        }
        while under_way.front().is_some_and(|exposure| exposure.arrival_s <= now_s) {
            let Some(exposure) = under_way.pop_front() else { break };
            let seen = eye.look(&exposure, controller.camera(exposure.arrival_s))?;
            controller.see(now_s, exposure.arrival_s, &*seen)?;
        }
        head.advance_to(now_s);
        let said = head.status();
        let said = drone.as_ref().map_or(said, |drone| drone.in_world(now_s, said));
        if let Some(command) = controller.act(now_s, said.as_ref())? {
            head.command(now_s, drone.as_ref().map_or(command, |drone| drone.handed_on(now_s, command)));
        }
    }
}

/// How a camera stands whose head stands there, and how far it is rolled.
fn stands(head: Position, drone: Option<&Drone>, time_s: f64) -> (Position, f64) {
    let Some(drone) = drone else { return (head, 0.0) };
    let (by, roll_deg) = drone.disturbance(time_s);
    (Position { direction: head.direction.turned(by), ..head }, roll_deg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Still;

    #[test]
    fn what_is_behind_something_is_not_seen() {
        let mut camera = SimulatedCamera::new(CameraParams::usual().unwrap(), 1).unwrap();
        let mut eye = NoisyEye::new(2.0, 0.0, 1).hiding(vec![(0.1, 0.3)]);
        for _ in 0..12 {
            let (exposure, _) = camera.take(Position::default(), 0.0, (Direction::AHEAD, 0.1, 0.3)).unwrap();
            let (time_s, arrival_s) = (exposure.time_s, exposure.arrival_s);
            let seen = eye.look(&exposure, None).unwrap();
            assert_eq!(seen.at(arrival_s).is_none(), (0.1..0.3).contains(&time_s), "{time_s}");
            assert_eq!(seen.at(arrival_s + 0.2).is_none(), seen.at(arrival_s).is_none(), "nothing is expected of it");
        }
    }

    /// A controller that does nothing.
    struct Nothing;

    impl Controller for Nothing {
        fn see(&mut self, _: f64, _: f64, _: &dyn Forecast) -> Result<()> {
            Ok(())
        }

        fn act(&mut self, _: f64, _: Option<&crate::Status>) -> Result<Option<crate::Command>> {
            Ok(None)
        }
    }

    /// An eye that sees nothing and keeps what it was shown.
    struct Kept(Vec<Exposure>);

    impl Eye for Kept {
        fn look(&mut self, exposure: &Exposure, _: Option<CameraPose>) -> Result<Box<dyn Forecast + '_>> {
            self.0.push(*exposure);
            Ok(Box::new(Still(None)))
        }
    }

    #[test]
    fn pictures_are_taken_by_the_disturbed_camera() {
        let params = DroneParams { roll_deg: 20.0, vibration_deg: 0.5, ..DroneParams::default() };
        let simulation = Simulation {
            head: HeadParams::default(),
            camera: CameraParams::usual().unwrap(),
            drone: Some(params),
            duration_s: 2.0,
            tick_s: 0.02,
        };
        let mut eye = Kept(Vec::new());
        let target = |_: f64| (Direction::new(10.0, 0.0), 0.1, 0.3);
        run(&simulation, 3, &target, &mut eye, &mut Nothing).unwrap();
        let drone = Drone::new(params, 3);
        assert!(eye.0.len() > 40);
        for exposure in eye.0 {
            let (by, roll_deg) = drone.disturbance(exposure.time_s);
            assert_eq!((exposure.position.direction, exposure.roll_deg), (by, roll_deg));
            // The head never moved: turned back, the target stands at the right of the middle.
            let middle = exposure.lens.middle();
            let (x, y) = exposure.truth.map(|b| (b.center().x - middle.x, b.center().y - middle.y)).unwrap();
            let (sine, cosine) = roll_deg.to_radians().sin_cos();
            let level = (cosine * x - sine * y, sine * x + cosine * y);
            let tangent = |deg: f64| deg.to_radians().tan() * 320.0 / 30f64.to_radians().tan();
            assert!((level.0 - tangent(10.0 - by.pan_deg)).abs() < 0.5, "{level:?}");
            assert!((level.1 - tangent(by.tilt_deg)).abs() < 0.5, "{level:?}");
        }
    }
}
