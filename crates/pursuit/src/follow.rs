//! One target, a few lines.

use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_media::{Locator, OpenOptions, Source};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, Recipe, Tracker};

/// Opens a video file, a folder of images, a camera (`camera:0`), a stream or a scene (`scene:NAME?key=value`) with what is
/// built in.
///
/// # Errors
/// An input that there is not, or that cannot be read.
pub fn open(input: impl Into<Locator>) -> Result<Box<dyn Source>, RunError> {
    open_with(input, &OpenOptions::default())
}

/// The same with options: where `ffmpeg` is found, the rate of inputs that state none.
///
/// # Errors
/// As [`open`].
pub fn open_with(input: impl Into<Locator>, options: &OpenOptions) -> Result<Box<dyn Source>, RunError> {
    crate::input::open_one(&input.into(), options)
}

/// The tracker called `name` with its default parameters; [`Recipe::with`] gives it others.
///
/// # Errors
/// A name that there is not; the message lists those there are.
pub fn recipe(name: &str) -> Result<Box<dyn Recipe>, RunError> {
    Ok(registry::tracker(name)?.default_recipe())
}

/// Follows the target inside `bbox` of the first frame of `source` to its end: an estimate for every frame, the first one
/// the box itself.
pub fn track(source: Box<dyn Source>, recipe: &dyn Recipe, bbox: BBox) -> Follow<'_> {
    Follow { source, recipe, bbox, tracker: None, broken: false }
}

/// The estimates of [`track`], frame by frame; after an error comes the end.
pub struct Follow<'a> {
    source: Box<dyn Source>,
    recipe: &'a dyn Recipe,
    bbox: BBox,
    tracker: Option<Box<dyn Tracker>>,
    broken: bool,
}

impl Follow<'_> {
    fn step(&mut self) -> Result<Option<Estimate>, RunError> {
        let Some(frame) = self.source.next_frame()? else { return Ok(None) };
        if let Some(tracker) = &mut self.tracker {
            return Ok(Some(tracker.update(&frame)?));
        }
        self.tracker = Some(self.recipe.init(&frame, self.bbox)?);
        Ok(Some(Estimate::started(frame.time_s(), self.bbox, 1.0)))
    }
}

impl Iterator for Follow<'_> {
    type Item = Result<Estimate, RunError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.broken {
            return None;
        }
        let step = self.step();
        self.broken = step.is_err();
        step.transpose()
    }
}
