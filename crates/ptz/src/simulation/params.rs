use crate::error::require;
use crate::geometry::{FieldOfView, FieldsOfView};
use crate::mechanics::HeadLimits;
use crate::{Position, PtzError, Result};
use pursuit_geometry::Size;
use pursuit_parameters::{choices, parameters};
use serde::{Deserialize, Serialize};

choices! {
    /// How far what a simulated head says of itself is true.
    pub enum StatusHonesty {
        /// Where it stands and whether it moves, now.
        TheTruth = "the_truth",
        /// The truth of a while ago.
        OldNews = "old_news",
        /// That it moves, always; and where it stood at first.
        AlwaysMoving = "always_moving",
        /// That it stands, always; and where it stood at first.
        AlwaysIdle = "always_idle",
        /// Nothing.
        Nothing = "nothing",
    }
}

parameters! {
    /// What a simulated head says of itself.
    #[derive(Copy)]
    pub struct StatusParams {
        /// How far it is true.
        pub says: StatusHonesty = StatusHonesty::TheTruth;
        /// Of `old_news`: how old.
        pub age_s: f64 = 1.0, in 0.0..=5.0, unit "s";
    }
}

parameters! {
    /// What a simulated head is like.
    pub struct HeadParams {
        /// What its axes can do.
        pub limits: HeadLimits = HeadLimits::default();
        /// Where it stands at first.
        pub home: Position = Position::default();
        /// How long a command takes to act.
        pub delay_s: f64 = 0.15, in 0.0..=5.0, unit "s";
        /// How much longer it may take: uniform from 0 to this. Commands stay in order.
        pub jitter_s: f64 = 0.0, in 0.0..=5.0, unit "s";
        /// Which fraction of commands gets lost.
        pub dropped: f64 = 0.0, in 0.0..=1.0;
        /// The steps in which the camera's angles go; 0 for none.
        pub quantum_deg: f64 = 0.0, in 0.0..=10.0, unit "deg";
        /// How many speeds there are between none and the greatest; 0 for any.
        pub speed_levels: u32 = 0;
        /// The true speed for each unit of speed commanded.
        pub speed_scale: f64 = 1.0, in 0.1..=10.0;
        /// What it says of itself.
        pub status: StatusParams = StatusParams::default();
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
    use pursuit_parameters::Parameters;

    #[test]
    fn heads_and_cameras_are_read_with_their_checks() {
        let with = |text: &str| HeadParams::default().with("head", &text.parse().unwrap());
        let head = with("delay_s = 0.3\nstatus = { says = 'old_news', age_s = 1.0 }").unwrap();
        assert_eq!((head.delay_s, head.status.says, head.status.age_s), (0.3, StatusHonesty::OldNews, 1.0));
        for text in ["delay_s = 6.0", "dropped = 1.1", "status.age_s = 9.0", "limits.zoom_per_s = 0", "speed = 1"] {
            assert!(with(text).is_err(), "{text}");
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
