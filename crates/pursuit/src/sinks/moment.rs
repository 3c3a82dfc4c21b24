use crate::Record;
use crate::events::Watched;
use pursuit_imaging::Frame;
use pursuit_tracking::{Forecast, TargetId};
use std::sync::Arc;

/// What a sink is handed of one frame.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// The frame.
    pub frame: &'a Arc<Frame>,
    /// What is known of every target in it, in order of the targets.
    pub records: &'a [Record],
    forecast: &'a dyn Fn(TargetId, f64) -> Option<Forecast>,
    watched: Option<&'a Watched>,
}

impl<'a> Moment<'a> {
    /// Of a frame with its records; `forecast` says where a target will be so many seconds later.
    pub const fn new(
        frame: &'a Arc<Frame>,
        records: &'a [Record],
        forecast: &'a dyn Fn(TargetId, f64) -> Option<Forecast>,
    ) -> Self {
        Self { frame, records, forecast, watched: None }
    }

    /// Of a frame of which nothing but the records is known.
    pub const fn recorded(frame: &'a Arc<Frame>, records: &'a [Record]) -> Self {
        Self::new(frame, records, &|_, _| None)
    }

    /// With what happened in the frame, and who is where.
    #[must_use]
    pub const fn with_watched(self, watched: Option<&'a Watched>) -> Self {
        Self { watched, ..self }
    }

    /// What happened in the frame, and who is where; `None` where nobody asked for that.
    pub const fn watched(&self) -> Option<&'a Watched> {
        self.watched
    }

    /// Where the tracker expects `target` so many seconds after this frame, in pixels of the whole input; `None` for a target
    /// that is not followed and where the tracker cannot say.
    pub fn forecast(&self, target: TargetId, seconds: f64) -> Option<Forecast> {
        (self.forecast)(target, seconds)
    }
}
