use super::{LostPolicy, ZoomParams};
use crate::error::require;
use crate::geometry::AngleFormula;
use crate::mechanics::HeadLimits;
use crate::{Position, Result};
use serde::{Deserialize, Serialize};

/// How a head is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// The head's velocity follows the target's, and closes the distance.
    #[default]
    Velocity,
    /// The head is sent to where the target will be when it arrives, again and again.
    Steps,
}

/// What says where the target will be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PredictBy {
    /// The follower's own filter of directions in the world: right for any tracker and a moving camera.
    #[default]
    World,
    /// The tracker's forecast, in the picture of the last frame: right when the camera stands still while the tracker
    /// measures, or when the tracker takes the camera's motion into account.
    Tracker,
    /// Nothing: the target is taken to be where it was seen last.
    Nothing,
}

/// How a target may move, as seen from the head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionParams {
    /// Density of the random acceleration of calm motion, above 0, deg²/s³.
    pub calm_deg2_s3: f64,
    /// Density of the random acceleration in a turn, above 0, deg²/s³. A walker 5 m away who turns round within a
    /// second changes the pan's rate by 34°/s.
    pub brisk_deg2_s3: f64,
    /// How long calm motion lasts on average, seconds.
    pub calm_s: f64,
    /// How long a turn lasts on average, seconds.
    pub brisk_s: f64,
    /// Standard deviation of a sighting where the tracker gives no covariance, and the least one believed, pixels.
    pub sigma_px: f64,
    /// How uncertain the delays of commands and pictures together are, one standard deviation, seconds.
    pub timing_s: f64,
    /// How much these delays vary from command to command and from picture to picture, one standard deviation, seconds.
    pub jitter_s: f64,
}

impl Default for MotionParams {
    fn default() -> Self {
        // Found on the simulator: less jitter swings where the delays are wrong, more follows turns late.
        Self {
            calm_deg2_s3: 1.0,
            brisk_deg2_s3: 200.0,
            calm_s: 2.0,
            brisk_s: 0.5,
            sigma_px: 2.0,
            timing_s: 0.1,
            jitter_s: 0.05,
        }
    }
}

/// Parameters of a [`Follower`](super::Follower).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FollowerParams {
    /// How the head is driven.
    pub scheme: Scheme,
    /// What says where the target will be.
    pub predict_by: PredictBy,
    /// How a pixel becomes an angle.
    pub formula: AngleFormula,
    /// What the head can do.
    pub limits: HeadLimits,
    /// Where the head stands at the beginning, and looks to for the lost policy `home`.
    pub home: Position,
    /// How long after its sending a command moves the head, 0 to 5 s. Measured by the calibration.
    pub command_delay_s: f64,
    /// How old a picture is at the time it is stamped with, 0 to 5 s: 0 for stamps from the camera, the camera's delay for
    /// stamps of arrival. Measured by the calibration, together with the delay of commands.
    pub frame_age_s: f64,
    /// Time between two commands, seconds.
    pub period_s: f64,
    /// How fast the velocity scheme closes the distance, per second.
    pub gain_per_s: f64,
    /// Half the side of the zone in the middle of the picture within which a standing target is left alone, as a fraction
    /// of half the picture. The paper `qu2010` asks for such a zone and gives no size.
    pub dead_zone: f64,
    /// Below this speed a target counts as standing, degrees per second.
    pub still_deg_s: f64,
    /// For how long a target that is not measured is followed by prediction, seconds.
    pub coast_s: f64,
    /// What to do about a target that is lost.
    pub when_lost: LostPolicy,
    /// For how long after a manual command the follower keeps still, seconds.
    pub manual_s: f64,
    /// How the target moves.
    pub motion: MotionParams,
    /// How the zoom is driven; without it the zoom is left alone.
    pub zoom: Option<ZoomParams>,
}

impl Default for FollowerParams {
    fn default() -> Self {
        Self {
            scheme: Scheme::Velocity,
            predict_by: PredictBy::World,
            formula: AngleFormula::PanThenTilt,
            limits: HeadLimits::default(),
            home: Position::default(),
            command_delay_s: 0.15,
            frame_age_s: 0.0,
            period_s: 0.1,
            gain_per_s: 3.0,
            dead_zone: 0.1,
            still_deg_s: 1.5,
            coast_s: 1.5,
            when_lost: LostPolicy::Hold,
            manual_s: 5.0,
            motion: MotionParams::default(),
            zoom: None,
        }
    }
}

impl FollowerParams {
    /// Refuses parameters that are out of their ranges.
    ///
    /// # Errors
    /// Names the first such parameter and its range.
    pub fn check(&self) -> Result<()> {
        self.limits.check()?;
        let seconds = |name, value: f64| require(name, value, (0.0..=5.0).contains(&value), "between 0 and 5 s");
        seconds("command_delay_s", self.command_delay_s)?;
        seconds("frame_age_s", self.frame_age_s)?;
        require("period_s", self.period_s, (0.01..=2.0).contains(&self.period_s), "between 0.01 and 2 s")?;
        require(
            "gain_per_s",
            self.gain_per_s,
            (0.01..=50.0).contains(&self.gain_per_s),
            "between 0.01 and 50 per second",
        )?;
        require("dead_zone", self.dead_zone, (0.0..1.0).contains(&self.dead_zone), "at least 0 and below 1")?;
        let long = |name, value: f64| require(name, value, (0.0..=3600.0).contains(&value), "between 0 and 3600");
        long("still_deg_s", self.still_deg_s)?;
        long("coast_s", self.coast_s)?;
        long("manual_s", self.manual_s)?;
        require("home zoom", self.home.zoom, (0.0..=1.0).contains(&self.home.zoom), "between 0 and 1")?;
        require("home pan", self.home.direction.pan_deg, self.home.direction.is_finite(), "a finite angle")?;
        self.motion.check()?;
        self.when_lost.check()?;
        self.zoom.as_ref().map_or(Ok(()), ZoomParams::check)
    }
}

impl MotionParams {
    fn check(&self) -> Result<()> {
        let positive = |name, value: f64| require(name, value, value > 0.0 && value <= 1e6, "above 0, at most 1000000");
        positive("calm_deg2_s3", self.calm_deg2_s3)?;
        positive("brisk_deg2_s3", self.brisk_deg2_s3)?;
        positive("calm_s", self.calm_s)?;
        positive("brisk_s", self.brisk_s)?;
        positive("sigma_px", self.sigma_px)?;
        require("jitter_s", self.jitter_s, (0.0..=1.0).contains(&self.jitter_s), "between 0 and 1 s")?;
        require("timing_s", self.timing_s, (0.0..=1.0).contains(&self.timing_s), "between 0 and 1 s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_sound_and_each_parameter_is_checked() {
        FollowerParams::default().check().unwrap();
        let wrongs: &[(&str, &str)] = &[
            ("command_delay_s = 5.1", "command_delay_s"),
            ("frame_age_s = -0.1", "frame_age_s"),
            ("period_s = 0.001", "period_s"),
            ("gain_per_s = 0", "gain_per_s"),
            ("dead_zone = 1.0", "dead_zone"),
            ("still_deg_s = -1", "still_deg_s"),
            ("coast_s = nan", "coast_s"),
            ("manual_s = -1", "manual_s"),
            ("home = { zoom = 2 }", "home zoom"),
            ("home = { direction = { tilt_deg = nan } }", "home pan"),
            ("motion = { calm_deg2_s3 = 0 }", "calm_deg2_s3"),
            ("motion = { brisk_deg2_s3 = -1 }", "brisk_deg2_s3"),
            ("motion = { calm_s = 0 }", "calm_s"),
            ("motion = { brisk_s = 0 }", "brisk_s"),
            ("motion = { sigma_px = 0 }", "sigma_px"),
            ("motion = { jitter_s = 2 }", "jitter_s"),
            ("motion = { timing_s = 2 }", "timing_s"),
            ("zoom = { target_fraction = 0 }", "target_fraction"),
            ("when_lost = { policy = 'search', amplitude_deg = 0 }", "amplitude_deg"),
            ("limits = { zoom_per_s = 0 }", "zoom_per_s"),
        ];
        for (text, name) in wrongs {
            let params: FollowerParams = toml::from_str(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            let message = params.check().unwrap_err().to_string();
            assert!(message.starts_with(&format!("`{name}`")), "{text}: {message}");
        }
        assert!(toml::from_str::<FollowerParams>("gain = 3").is_err(), "unknown keys are refused");
    }

    #[test]
    fn words_are_those_of_the_documentation() {
        let text = "scheme = 'steps'\npredict_by = 'nothing'\nformula = 'qu2010'\nwhen_lost = { policy = 'zoom_out' }";
        let params: FollowerParams = toml::from_str(text).unwrap();
        assert_eq!((params.scheme, params.predict_by), (Scheme::Steps, PredictBy::Nothing));
        assert_eq!((params.formula, params.when_lost), (AngleFormula::Qu2010, LostPolicy::ZoomOut));
    }
}
