use super::{LostParams, TrustParams, ZoneList, ZoomParams};
use crate::geometry::AngleFormula;
use crate::mechanics::HeadLimits;
use crate::{Command, Direction, Position};
use pursuit_geometry::{BBox, Size};
use pursuit_parameters::{choices, parameters};

choices! {
    /// How a head is driven.
    pub enum Scheme {
        /// The head's velocity follows the target's, and closes the distance.
        Velocity = "velocity",
        /// The head is sent to where the target will be when it arrives, again and again.
        Steps = "steps",
    }
}

choices! {
    /// What says where the target will be.
    pub enum PredictBy {
        /// The follower's own filter of directions in the world: right for any tracker and a moving camera.
        World = "world",
        /// The tracker's forecast, in the picture of the last frame: right when the tracker takes the camera's motion into account
        /// (`motion.camera = pose`, which `pursuit ptz follow` then sets), or when the camera stands still while the tracker measures.
        Tracker = "tracker",
        /// Nothing: the target is taken to be where it was seen last.
        Nothing = "nothing",
    }
}

// The defaults were found on the simulator: less jitter swings where the delays are wrong, more follows turns late.
parameters! {
    /// How a target may move, as seen from the head.
    #[derive(Copy)]
    pub struct MotionParams {
        /// Density of the random acceleration of calm motion.
        pub calm_deg2_s3: f64 = 1.0, in above(0.0).at_most(1e6), unit "deg²/s³";
        /// Density of the random acceleration in a turn. A walker 5 m away who turns round within a second changes the pan's rate
        /// by 34°/s.
        pub brisk_deg2_s3: f64 = 200.0, in above(0.0).at_most(1e6), unit "deg²/s³";
        /// How long calm motion lasts on average.
        pub calm_s: f64 = 2.0, in above(0.0).at_most(1e6), unit "s";
        /// How long a turn lasts on average.
        pub brisk_s: f64 = 0.5, in above(0.0).at_most(1e6), unit "s";
        /// Standard deviation of a sighting where the tracker gives no covariance, and the least one believed.
        pub sigma_px: f64 = 2.0, in above(0.0).at_most(1e6), unit "px";
        /// How uncertain the delays of commands and pictures together are, one standard deviation.
        pub timing_s: f64 = 0.3, in 0.0..=1.0, unit "s";
        /// How much the delay varies from command to command, one standard deviation.
        pub jitter_s: f64 = 0.05, in 0.0..=1.0, unit "s";
        /// How much the age varies from picture to picture, one standard deviation.
        pub picture_jitter_s: f64 = 0.025, in 0.0..=1.0, unit "s";
        /// Whether both are measured while following, beginning with these.
        pub measure_jitter: bool = true;
    }
}

parameters! {
    /// Where in the picture the target shall be.
    #[derive(Copy)]
    pub struct AimPoint {
        /// How far to the right of the middle, of half the picture's width.
        pub right: f64 = 0.0, in -0.8..=0.8;
        /// How far above the middle, of half the picture's height; below 0 there is room above the target's head.
        pub up: f64 = 0.0, in -0.8..=0.8;
    }
}

impl AimPoint {
    /// By how much the head looks beside the target so that it stands there, where the picture reaches `half_deg` to either side.
    pub(super) fn beside(&self, half_deg: (f64, f64)) -> Direction {
        // In the middle whatever the lens.
        if self.right == 0.0 && self.up == 0.0 {
            return Direction::AHEAD;
        }
        let angle = |part: f64, half_deg: f64| (part * half_deg.to_radians().tan()).atan().to_degrees();
        Direction::new(-angle(self.right, half_deg.0), -angle(self.up, half_deg.1))
    }
}

choices! {
    /// What of all that is tracked is followed.
    pub enum Subject {
        /// The first target.
        First = "first",
        /// All targets together: the middle of the box around them; with a zoom, so that all are in the picture.
        All = "all",
    }
}

choices! {
    /// What a head does when following ends.
    pub enum AtEnd {
        /// It stands where it is.
        Stop = "stop",
        /// It goes to its home position.
        Home = "home",
        /// It goes to a stored position.
        Preset = "preset",
    }
}

parameters! {
    /// What a head does when following ends.
    #[derive(Copy)]
    pub struct EndParams {
        /// Stand still, go home, or go to a stored position.
        pub policy: AtEnd = AtEnd::Stop;
        /// Of `preset`: the number of the stored position.
        pub preset: u32 = 1, in 0..=255;
    }
}

impl EndParams {
    /// The last command.
    pub fn command(&self) -> Command {
        match self.policy {
            AtEnd::Stop => Command::Stop,
            AtEnd::Home => Command::Home,
            AtEnd::Preset => Command::Preset { number: u8::try_from(self.preset).unwrap_or(u8::MAX) },
        }
    }
}

parameters! {
    /// How fast a head turns that is near to whom it follows.
    #[derive(Copy)]
    pub struct NearParams {
        /// A target that fills this part of the picture, in height or in width, is near.
        pub fills: f64 = 0.6, in 0.01..=1.0;
        /// Greatest speed then, of each axis.
        pub max_speed_deg_s: f64 = 20.0, in above(0.0).at_most(1e4), unit "deg/s";
    }
}

impl NearParams {
    /// What the head can do, slower where a target of this box is near in a picture of this size.
    pub(super) fn limits(&self, mut limits: HeadLimits, bbox: &BBox, size: Size) -> HeadLimits {
        let part = |length: f64, whole: usize| length / whole.max(1) as f64;
        if part(bbox.height(), size.height).max(part(bbox.width(), size.width)) >= self.fills {
            for axis in [&mut limits.pan, &mut limits.tilt] {
                axis.max_speed_deg_s = axis.max_speed_deg_s.min(self.max_speed_deg_s);
            }
        }
        limits
    }
}

parameters! {
    /// Parameters of a [`Follower`](super::Follower).
    pub struct FollowerParams {
        /// How the head is driven.
        pub scheme: Scheme = Scheme::Velocity;
        /// What says where the target will be.
        pub predict_by: PredictBy = PredictBy::World;
        /// How a pixel becomes an angle.
        pub formula: AngleFormula = AngleFormula::PanThenTilt;
        /// What the head can do.
        pub limits: HeadLimits = HeadLimits::default();
        /// Where the head stands at the beginning, and looks to for the lost policy `home`.
        pub home: Position = Position::default();
        /// How long after its sending a command moves the head. Measured by the calibration.
        pub command_delay_s: f64 = 0.15, in 0.0..=5.0, unit "s";
        /// How old a picture is at the time it is stamped with: 0 for stamps from the camera, the camera's delay for stamps of
        /// arrival. Measured by the calibration, together with the delay of commands.
        pub frame_age_s: f64 = 0.0, in 0.0..=5.0, unit "s";
        /// Time between two commands. Commands that are as frequent as pictures bear it better that some come late or never.
        pub period_s: f64 = 0.04, in 0.01..=2.0, unit "s";
        /// How fast the velocity scheme closes the distance.
        pub gain_per_s: f64 = 4.5, in 0.01..=50.0, unit "1/s";
        /// How much more slowly it does so while the delays are not known: the gain is divided by `1 + caution · gain · (σ − 0.03 s)`, σ being
        /// how uncertain they are.
        pub caution: f64 = 2.0, in 0.0..=100.0;
        /// The first target, or all together.
        pub subject: Subject = Subject::First;
        /// Where in the picture the target shall be.
        pub aim: AimPoint = AimPoint::default();
        /// Where the head may look: at most 8 of `allowed pan -90..90`, `forbidden pan 0..10 tilt -5..20` (the optical axis keeps out)
        /// and `private …` (no part of the picture shows it). Ways of home and stored positions are the head's own.
        pub zones: ZoneList = ZoneList::default();
        /// Half the side of the zone in the middle of the picture within which a standing target is left alone, as a fraction
        /// of half the picture. The paper `qu2010` asks for such a zone and gives no size.
        pub dead_zone: f64 = 0.1, in Bounds::from(0.0..).below(1.0);
        /// Below this speed a target counts as standing.
        pub still_deg_s: f64 = 1.5, in 0.0..=3600.0, unit "deg/s";
        /// For how long a target that is not measured is followed by prediction.
        pub coast_s: f64 = 1.5, in 0.0..=3600.0, unit "s";
        /// What to do about a target that is lost.
        pub when_lost: LostParams = LostParams::default();
        /// What to do when following ends.
        pub at_end: EndParams = EndParams::default();
        /// How fast to turn near to the target; as fast as the head can, where not given.
        pub near: Option<NearParams> = None;
        /// For how long after a manual command the follower keeps still.
        pub manual_s: f64 = 5.0, in 0.0..=3600.0, unit "s";
        /// How the target moves.
        pub motion: MotionParams = MotionParams::default();
        /// How far the prediction is trusted.
        pub trust: TrustParams = TrustParams::default();
        /// How the zoom is driven; without it the zoom is left alone.
        pub zoom: Option<ZoomParams> = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::LostPolicy;
    use pursuit_parameters::Parameters;

    fn with(text: &str) -> pursuit_parameters::Result<FollowerParams> {
        FollowerParams::default().with("follower", &text.parse().unwrap())
    }

    #[test]
    fn defaults_are_sound_and_groups_are_checked() {
        FollowerParams::default().validate("follower").unwrap();
        for (text, name) in [
            ("dead_zone = 1.0", "dead_zone"),
            ("coast_s = nan", "coast_s"),
            ("home.zoom = 2", "home.zoom"),
            ("home.direction.tilt_deg = nan", "home.direction.tilt_deg"),
            ("motion.calm_deg2_s3 = 0", "motion.calm_deg2_s3"),
            ("zoom.target_fraction = 0", "zoom.target_fraction"),
            ("when_lost = { policy = 'search', amplitude_deg = 0 }", "when_lost.amplitude_deg"),
            ("limits.pan = { min_deg = 10, max_deg = 9 }", "limits.pan.min_deg"),
            ("limits.zoom_per_s = 0", "limits.zoom_per_s"),
            ("gain_per = 3", "gain_per"),
        ] {
            let message = with(text).unwrap_err().to_string();
            assert!(message.contains(&format!("`{name}` of `follower`: ")), "{text}: {message}");
        }
        assert!(with("gain_per = 3").unwrap_err().to_string().contains("did you mean `gain_per_s`?"));
    }

    #[test]
    fn words_are_those_of_the_documentation() {
        let text = "scheme = 'steps'\npredict_by = 'nothing'\nformula = 'qu2010'\nwhen_lost = { policy = 'zoom_out' }";
        let params = with(text).unwrap();
        assert_eq!((params.scheme, params.predict_by), (Scheme::Steps, PredictBy::Nothing));
        assert_eq!((params.formula, params.when_lost.policy), (AngleFormula::Qu2010, LostPolicy::ZoomOut));
        let written = params.to_table("follower").unwrap();
        assert_eq!(with(&written.to_string()).unwrap(), params);
    }
}
