use crate::error::require;
use crate::geometry::{FieldOfView, FieldsOfView};
use crate::mechanics::HeadLimits;
use crate::{Position, PtzError, Result};
use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};

/// How far what a simulated head says of itself is true.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "says", rename_all = "snake_case", deny_unknown_fields)]
pub enum StatusHonesty {
    /// Where it stands and whether it moves, now.
    #[default]
    TheTruth,
    /// The truth of a while ago.
    OldNews {
        /// How old, seconds.
        age_s: f64,
    },
    /// That it moves, always; and where it stood at first.
    AlwaysMoving,
    /// That it stands, always; and where it stood at first.
    AlwaysIdle,
    /// Nothing.
    Nothing,
}

/// What a simulated head is like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeadParams {
    /// What its axes can do.
    pub limits: HeadLimits,
    /// Where it stands at first.
    pub home: Position,
    /// How long a command takes to act, seconds.
    pub delay_s: f64,
    /// How much longer it may take: uniform from 0 to this, seconds. Commands stay in order.
    pub jitter_s: f64,
    /// Which fraction of commands gets lost, in `[0, 1]`.
    pub dropped: f64,
    /// The steps in which the camera's angles go, degrees; 0 for none.
    pub quantum_deg: f64,
    /// How many speeds there are between none and the greatest; 0 for any.
    pub speed_levels: u32,
    /// The true speed for each unit of speed commanded.
    pub speed_scale: f64,
    /// How far what it says of itself is true.
    pub status: StatusHonesty,
}

impl Default for HeadParams {
    fn default() -> Self {
        Self {
            limits: HeadLimits::default(),
            home: Position::default(),
            delay_s: 0.15,
            jitter_s: 0.0,
            dropped: 0.0,
            quantum_deg: 0.0,
            speed_levels: 0,
            speed_scale: 1.0,
            status: StatusHonesty::TheTruth,
        }
    }
}

impl HeadParams {
    /// Refuses parameters that are out of their ranges.
    ///
    /// # Errors
    /// Names the first such parameter and its range.
    pub fn check(&self) -> Result<()> {
        self.limits.check()?;
        let seconds = |name, value: f64| require(name, value, (0.0..=5.0).contains(&value), "between 0 and 5 s");
        seconds("delay_s", self.delay_s)?;
        seconds("jitter_s", self.jitter_s)?;
        require("dropped", self.dropped, (0.0..=1.0).contains(&self.dropped), "between 0 and 1")?;
        require("quantum_deg", self.quantum_deg, (0.0..=10.0).contains(&self.quantum_deg), "between 0 and 10 degrees")?;
        let scale = self.speed_scale;
        require("speed_scale", scale, (0.1..=10.0).contains(&scale), "between 0.1 and 10")?;
        if let StatusHonesty::OldNews { age_s } = self.status {
            seconds("age_s", age_s)?;
        }
        Ok(())
    }
}

/// What a simulated camera is like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawCamera", into = "RawCamera")]
pub struct CameraParams {
    /// Its fields of view by zoom.
    pub views: FieldsOfView,
    /// Size of the picture.
    pub size: Size,
    /// Pictures per second.
    pub fps: f64,
    /// How long a picture takes from its exposure to the program, seconds.
    pub age_s: f64,
    /// How much longer it may take: uniform from 0 to this, seconds. Pictures stay in order.
    pub jitter_s: f64,
    /// Which fraction of pictures gets lost, in `[0, 1]`.
    pub dropped: f64,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename = "CameraParams")]
struct RawCamera {
    views: Option<FieldsOfView>,
    width: usize,
    height: usize,
    fps: f64,
    age_s: f64,
    jitter_s: f64,
    dropped: f64,
}

impl Default for RawCamera {
    fn default() -> Self {
        Self { views: None, width: 640, height: 360, fps: 25.0, age_s: 0.15, jitter_s: 0.0, dropped: 0.0 }
    }
}

impl TryFrom<RawCamera> for CameraParams {
    type Error = PtzError;

    fn try_from(raw: RawCamera) -> Result<Self> {
        let views = match raw.views {
            Some(views) => views,
            None => FieldsOfView::new(vec![
                FieldOfView { zoom: 0.0, half_fov_x_deg: 30.0 },
                FieldOfView { zoom: 1.0, half_fov_x_deg: 3.0 },
            ])?,
        };
        let RawCamera { width, height, fps, age_s, jitter_s, dropped, .. } = raw;
        let camera = Self { views, size: Size::new(width, height), fps, age_s, jitter_s, dropped };
        camera.check()?;
        Ok(camera)
    }
}

impl From<CameraParams> for RawCamera {
    fn from(of: CameraParams) -> Self {
        let CameraParams { views, size, fps, age_s, jitter_s, dropped } = of;
        Self { views: Some(views), width: size.width, height: size.height, fps, age_s, jitter_s, dropped }
    }
}

impl CameraParams {
    /// 640 × 360 pixels at 25 per second, 60° wide with a tenfold zoom, each picture 150 ms old.
    ///
    /// # Errors
    /// Never.
    pub fn usual() -> Result<Self> {
        RawCamera::default().try_into()
    }

    /// Refuses parameters that are out of their ranges.
    ///
    /// # Errors
    /// Names the first such parameter and its range.
    pub fn check(&self) -> Result<()> {
        self.views.lens(0.0, self.size)?;
        let largest = self.size.width.max(self.size.height);
        require("width or height", largest as f64, largest <= 16_384, "at most 16384 pixels")?;
        require("fps", self.fps, (0.1..=1000.0).contains(&self.fps), "between 0.1 and 1000")?;
        require("age_s", self.age_s, (0.0..=5.0).contains(&self.age_s), "between 0 and 5 s")?;
        require("jitter_s", self.jitter_s, (0.0..=5.0).contains(&self.jitter_s), "between 0 and 5 s")?;
        require("dropped", self.dropped, (0.0..=1.0).contains(&self.dropped), "between 0 and 1")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_and_cameras_are_read_with_their_checks() {
        let head: HeadParams = toml::from_str("delay_s = 0.3\nstatus = { says = 'old_news', age_s = 1.0 }").unwrap();
        assert_eq!((head.delay_s, head.status), (0.3, StatusHonesty::OldNews { age_s: 1.0 }));
        head.check().unwrap();
        for (text, name) in [
            ("delay_s = 6.0", "delay_s"),
            ("jitter_s = -0.1", "jitter_s"),
            ("dropped = 1.1", "dropped"),
            ("quantum_deg = -1", "quantum_deg"),
            ("speed_scale = 0", "speed_scale"),
            ("status = { says = 'old_news', age_s = 9.0 }", "age_s"),
            ("limits = { zoom_per_s = 0 }", "zoom_per_s"),
        ] {
            let message = toml::from_str::<HeadParams>(text).unwrap().check().unwrap_err().to_string();
            assert!(message.starts_with(&format!("`{name}`")), "{message}");
        }
        let camera: CameraParams = toml::from_str("width = 1280\nheight = 720").unwrap();
        assert_eq!((camera.size, camera.fps), (Size::new(1280, 720), 25.0));
        for bad in ["width = 0", "fps = 0", "age_s = -1", "jitter_s = 9", "dropped = 2", "height = 99999", "zoom = 3"] {
            assert!(toml::from_str::<CameraParams>(bad).is_err(), "{bad}");
        }
        let usual = CameraParams::usual().unwrap();
        let text = toml::to_string(&usual).unwrap();
        assert_eq!(toml::from_str::<CameraParams>(&text).unwrap(), usual);
    }
}
