use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Image, Rgb8};

/// A synthetic world: a pure function of time. The same scene asked for the same time gives the same bytes, in any order
/// and from any thread.
pub trait Scene: Send + Sync {
    /// Width and height of every image, in pixels.
    fn size(&self) -> Size;

    /// Nominal frames per second.
    fn fps(&self) -> f64;

    /// How long the scene lasts, in seconds.
    fn duration_s(&self) -> f64;

    /// What a camera sees at `time_s` seconds (the middle of its exposure) and where the targets truly are. Any finite
    /// time may be asked for; before 0 and after [`duration_s`](Self::duration_s) the motion goes on or stands still.
    fn render(&self, time_s: f64) -> SceneMoment;

    /// The truth alone: the same as [`render`](Self::render)'s, many times faster.
    fn targets(&self, time_s: f64) -> Vec<TargetTruth>;

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
    /// The truth about each target; the first is the one to follow. The number of targets never changes within a scene.
    pub targets: Vec<TargetTruth>,
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
