use crate::View;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, Rgb8};

/// A synthetic world: a pure function of time and view. The same scene asked for the same time and view gives the same
/// bytes, in any order and from any thread.
pub trait Scene: Send + Sync {
    /// Width and height of every image, in pixels.
    fn size(&self) -> Size;

    /// Nominal frames per second.
    fn fps(&self) -> f64;

    /// How long the scene lasts, in seconds.
    fn duration_s(&self) -> f64;

    /// The view of a camera that nobody turns: straight ahead, [`size`](Self::size) pixels.
    fn home(&self) -> View;

    /// What a camera with this view sees at `time_s` seconds (the middle of its exposure) and where the targets truly are
    /// in its picture. Any finite time may be asked for; before 0 and after [`duration_s`](Self::duration_s) the motion goes
    /// on or stands still. Beyond what was painted of the world its border goes on.
    fn render_view(&self, time_s: f64, view: &View) -> SceneMoment;

    /// The truth alone: the same as [`render_view`](Self::render_view)'s, many times faster.
    fn targets_in_view(&self, time_s: f64, view: &View) -> Vec<TargetTruth>;

    /// What a camera sees that nobody turns: [`render_view`](Self::render_view) of [`home`](Self::home).
    fn render(&self, time_s: f64) -> SceneMoment {
        self.render_view(time_s, &self.home())
    }

    /// The truth alone in the picture of a camera that nobody turns.
    fn targets(&self, time_s: f64) -> Vec<TargetTruth> {
        self.targets_in_view(time_s, &self.home())
    }

    /// Number of frames at the nominal rate.
    fn frame_count(&self) -> u64 {
        (self.duration_s() * self.fps()).round().max(1.0) as u64
    }

    /// Time of frame `index` at the nominal rate, in seconds.
    fn frame_time_s(&self, index: u64) -> f64 {
        index as f64 / self.fps()
    }
}

/// One moment of a [`Scene`].
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMoment {
    /// The picture.
    pub image: Image<Rgb8>,
    /// Depth in millimetres, 0 where the sensor has none; for scenes with a depth sensor.
    pub depth_mm: Option<Image<u16>>,
    /// The truth about each target; the first is the one to follow. The number of targets never changes within a scene.
    pub targets: Vec<TargetTruth>,
}

impl SceneMoment {
    /// The picture as a frame, with its depth and the view's camera.
    pub fn into_frame(self, index: u64, time_s: f64, view: &View) -> Frame {
        let frame = Frame::new(index, time_s, self.image);
        let frame = match self.depth_mm {
            Some(depth) => frame.clone().with_depth(depth).unwrap_or(frame),
            None => frame,
        };
        let (camera, lens) = (&view.camera, *view.camera.lens());
        match pursuit_imaging::CameraPose::new(time_s, camera.pan_rad(), camera.tilt_rad(), lens) {
            Ok(pose) => frame.with_camera(pose),
            Err(_) => frame, // a time that is not finite
        }
    }
}

/// Where a target truly is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetTruth {
    /// Its whole extent in the middle of the exposure, without motion blur, including parts that are hidden or outside of
    /// the picture; `None` when it is not in the world at all.
    pub extent: Option<BBox>,
    /// The fraction of it that can be seen, in `[0, 1]`: not behind anything and inside the picture.
    pub visible_fraction: f64,
}

impl TargetTruth {
    /// With less of it to be seen than this fraction, a target counts as absent.
    pub const ABSENT_BELOW: f64 = 0.1;

    /// Not in the world.
    pub const ABSENT: Self = Self { extent: None, visible_fraction: 0.0 };

    /// The true box where the target can be seen, `None` where it is absent.
    pub fn visible(&self) -> Option<BBox> {
        self.extent.filter(|_| self.visible_fraction >= Self::ABSENT_BELOW)
    }
}
