use super::{
    CameraParams, Drone, DroneParams, Eye, Figures, Flight, HeadParams, NoisyEye, Sample, Simulation, Walk, Walker, run,
};
use crate::control::{Controller, Follower, FollowerParams, PredictBy, Proportional, Scheme, StopAndGo, ZoomParams};
use crate::{Direction, Result};
use pursuit_parameters::{Parameters, Table, Value};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A controller to compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contender {
    /// [`Scheme::Velocity`], predicting.
    Velocity,
    /// [`Scheme::Steps`], predicting.
    Steps,
    /// [`Scheme::Velocity`], by the forecast of the tracker.
    Forecast,
    /// [`Scheme::Velocity`] without prediction.
    Unpredicted,
    /// [`Proportional`] of gain 1.5 per second.
    Proportional,
    /// [`StopAndGo`].
    StopAndGo,
}

impl Contender {
    /// Every contender.
    pub const ALL: [Self; 6] =
        [Self::Velocity, Self::Steps, Self::Forecast, Self::Unpredicted, Self::Proportional, Self::StopAndGo];

    /// Its name, as in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Steps => "steps",
            Self::Forecast => "forecast",
            Self::Unpredicted => "unpredicted",
            Self::Proportional => "proportional",
            Self::StopAndGo => "stop_and_go",
        }
    }

    /// The controller, for a simulation; followers have these parameters but for what makes the contender.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn controller(self, simulation: &Simulation, params: &FollowerParams) -> Result<Box<dyn Controller>> {
        let CameraParams { views, size, .. } = simulation.camera.clone();
        let follower = |scheme, predict_by| {
            let params = FollowerParams { scheme, predict_by, home: simulation.head.home, ..params.clone() };
            Follower::new(params, views.clone(), size, 0.0)
        };
        Ok(match self {
            Self::Velocity => Box::new(follower(Scheme::Velocity, params.predict_by)?),
            Self::Steps => Box::new(follower(Scheme::Steps, params.predict_by)?),
            Self::Forecast => Box::new(follower(Scheme::Velocity, PredictBy::Tracker)?),
            Self::Unpredicted => Box::new(follower(Scheme::Velocity, PredictBy::Nothing)?),
            Self::Proportional => Box::new(Proportional::new(views, size, 1.5, params.period_s)?),
            Self::StopAndGo => Box::new(StopAndGo::new(views, size, params.dead_zone, 10.0, 0.2)?),
        })
    }
}

/// A comparison to run: everything that a file says of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Study {
    /// The head.
    pub head: HeadParams,
    /// The camera; the usual one where it is left out.
    pub camera: Option<CameraParams>,
    /// The drone that carries the head; none where it is left out.
    pub drone: Option<DroneParams>,
    /// What is said of the follower. Its limits and delays are those of the head and the camera where nothing is said of them.
    pub follower: Table,
    /// Length of each run, seconds.
    pub duration_s: f64,
    /// From when on a run is judged, seconds.
    pub judged_from_s: f64,
    /// Deviation of the simulated tracker's boxes, pixels.
    pub sigma_px: f64,
    /// Which fraction of pictures the simulated tracker misses.
    pub missed: f64,
}

impl Default for Study {
    fn default() -> Self {
        Self {
            head: HeadParams::default(),
            camera: None,
            drone: None,
            follower: Table::new(),
            duration_s: 30.0,
            judged_from_s: 3.0,
            sigma_px: 2.0,
            missed: 0.0,
        }
    }
}

impl Study {
    /// Refuses parameters of the head and the follower that are out of their ranges.
    ///
    /// # Errors
    /// Names the first such parameter and its range.
    pub fn validate(&self) -> Result<()> {
        self.head.validate("head")?;
        self.drone.map_or(Ok(()), |drone| drone.validate("drone"))?;
        self.follower_params(&self.camera()?).map(|_| ())
    }

    /// The head; one below a drone looks straight down, too. One that orbits turns with its way, so that the travel of the pan,
    /// which is counted from the vehicle, never ends.
    fn head(&self) -> HeadParams {
        let mut head = self.head.clone();
        if let Some(drone) = self.drone {
            head.limits.tilt.min_deg = head.limits.tilt.min_deg.min(-90.0);
            if drone.flight == Flight::Orbit {
                (head.limits.pan.min_deg, head.limits.pan.max_deg) = (-1e6, 1e6);
            }
        }
        head
    }

    fn camera(&self) -> Result<CameraParams> {
        self.camera.clone().map_or_else(CameraParams::usual, Ok)
    }

    /// The follower's parameters: what is said of them over what head and camera are like.
    fn follower_params(&self, camera: &CameraParams) -> Result<FollowerParams> {
        // A group that is named and says nothing is asked for as it is by default.
        let zooms = self.follower.get("zoom").is_some_and(Value::is_table);
        let known = FollowerParams {
            zoom: zooms.then(ZoomParams::default),
            limits: self.head().limits,
            command_delay_s: self.head.delay_s,
            frame_age_s: camera.age_s,
            ..FollowerParams::default()
        };
        Ok(known.with("follower", &self.follower)?)
    }

    /// The figures of a contender that follows this walk, one for each seed. Pictures in which the target is behind something are
    /// not judged: what a controller makes of its return is.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn run(&self, walk: Walk, contender: Contender, seeds: Range<u64>) -> Result<Vec<Figures>> {
        let duration = self.duration_s;
        crate::error::require(
            "duration_s",
            duration,
            duration > 0.0 && duration <= 3600.0,
            "above 0 and at most 3600 s",
        )?;
        seeds.map(|seed| self.one(walk, contender, seed)).collect()
    }

    fn one(&self, walk: Walk, contender: Contender, seed: u64) -> Result<Figures> {
        let walker = Walker::new(walk, seed, self.duration_s);
        let mut eye = NoisyEye::new(self.sigma_px, self.missed, seed).hiding(walker.hidden().to_vec());
        let drone = self.drone.map(|params| Drone::new(params, seed));
        let target = |t: f64| drone.as_ref().map_or_else(|| walker.at(t), |drone| walker.seen_from(t, drone.place(t)));
        let first_view = if drone.is_some() { target(0.0).0 } else { walker.first_view(walk) };
        let mut samples = self.follow(contender, seed, first_view, &target, &mut eye)?;
        samples.retain(|sample| !walker.hides(sample.time_s));
        Ok(Figures::of(&samples, self.judged_from_s))
    }

    /// One run of a contender from a head that looks at `first_view`, frame by frame: `target` gives the target's direction
    /// and the tangents of its width and height at a time, `eye` looks at the pictures.
    ///
    /// # Errors
    /// Where a parameter is out of its range, or the eye fails.
    pub fn follow(
        &self,
        contender: Contender,
        seed: u64,
        first_view: Direction,
        target: &dyn Fn(f64) -> (Direction, f64, f64),
        eye: &mut dyn Eye,
    ) -> Result<Vec<Sample>> {
        let camera = self.camera()?;
        let params = self.follower_params(&camera)?;
        let mut simulation =
            Simulation { head: self.head(), camera, drone: self.drone, duration_s: self.duration_s, tick_s: 0.02 };
        simulation.head.home.direction = first_view;
        let mut controller = contender.controller(&simulation, &params)?;
        run(&simulation, seed, target, eye, &mut *controller)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_is_read_run_and_repeatable() {
        let study: Study = toml::from_str("duration_s = 8\nhead = { delay_s = 0.2 }\ncamera = { fps = 20 }").unwrap();
        let run = |contender| study.run(Walk::Passing, contender, 0..2).unwrap();
        for contender in Contender::ALL {
            let figures = run(contender);
            assert_eq!(figures.len(), 2, "{}", contender.name());
            assert_eq!(figures, run(contender));
        }
        let rms = |contender| Figures::mean(&run(contender)).rms_deg;
        assert!(rms(Contender::Velocity) < rms(Contender::Unpredicted));
        assert!(rms(Contender::Velocity) < rms(Contender::StopAndGo));
        assert!(Study { duration_s: 0.0, ..study }.run(Walk::Passing, Contender::Steps, 0..1).is_err());
        assert!(toml::from_str::<Study>("speed = 3").is_err());
    }

    #[test]
    fn a_still_drone_gives_the_figures_of_none() {
        let none = Study { duration_s: 8.0, ..Study::default() };
        // As high as the camera that stands, at its place.
        let still = "altitude_m = 2.5\ndistance_m = 0\nwander_m_s = 0\nswing_deg = 0\nvibration_deg = 0\nroll_deg = 0";
        let drone = Some(DroneParams::default().with("drone", &still.parse().unwrap()).unwrap());
        let still = Study { drone, ..none.clone() };
        for walk in [Walk::Pacing, Walk::Passing, Walk::DogLeg, Walk::Crossing, Walk::Stopping, Walk::Hiding] {
            let run = |study: &Study| study.run(walk, Contender::Velocity, 0..3).unwrap();
            assert_eq!(run(&still), run(&none), "{}", walk.name());
        }
    }

    #[test]
    fn a_follower_given_in_part_keeps_the_known_delays() {
        let study = |text: &str| toml::from_str::<Study>(text).unwrap();
        for (text, delays) in [
            ("[follower.zoom]", (0.15, 0.15)),
            ("[follower.motion]\njitter_s = 0.2", (0.15, 0.15)),
            ("[head]\ndelay_s = 0.3\n[camera]\nage_s = 0.4\n[follower]\ngain_per_s = 2", (0.3, 0.4)),
            ("follower = { frame_age_s = 0.05 }", (0.15, 0.05)),
            ("[camera]\nfps = 10", (0.15, 0.15)),
            ("[head]\njitter_s = 0.1", (0.15, 0.15)),
        ] {
            let study = study(text);
            let params = study.follower_params(&study.camera().unwrap()).unwrap();
            assert_eq!((params.command_delay_s, params.frame_age_s), delays, "{text}");
            assert_eq!(params.zoom.is_some(), text.contains("zoom"), "{text}");
        }
        let fast = study("[head.limits.pan]\nmax_speed_deg_s = 200\n[follower.limits.tilt]\nbacklash_deg = 0.5");
        let params = fast.follower_params(&fast.camera().unwrap()).unwrap();
        assert_eq!((params.limits.pan.max_speed_deg_s, params.limits.tilt.max_speed_deg_s), (200.0, 60.0));
        let wrong = study("[follower]\ngain_per = 3").validate().unwrap_err().to_string();
        assert!(wrong.contains("gain_per_s"), "{wrong}");
        assert!(study("[follower.zoom]\nsigma = 3").validate().is_err());
    }
}
