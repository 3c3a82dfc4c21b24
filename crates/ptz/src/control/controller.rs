use crate::{Command, Forecast, Result, Status};
use pursuit_imaging::CameraPose;

/// What drives a head.
pub trait Controller {
    /// A frame has been looked at: `stamp_s` is its time stamp, `now_s` the time now, `forecast` what the tracker says.
    ///
    /// # Errors
    /// Where a number is not finite.
    fn see(&mut self, now_s: f64, stamp_s: f64, forecast: &dyn Forecast) -> Result<()>;

    /// What the head shall do now, if anything new: to be asked often, at least once a frame. `status` is what the head
    /// said of itself last, if it says anything.
    ///
    /// # Errors
    /// Where a number is not finite.
    fn act(&mut self, now_s: f64, status: Option<&Status>) -> Result<Option<Command>>;

    /// How the camera is believed to have stood when it took the frame of this time stamp; `None` for a controller that does
    /// not keep account of it.
    fn camera(&self, _stamp_s: f64) -> Option<CameraPose> {
        None
    }
}
