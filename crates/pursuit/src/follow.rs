//! One target, a few lines.

use crate::{RunError, Session};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_media::input::Frames;
use pursuit_media::{Locator, OpenOptions, Source};
use pursuit_trackers::registry;
use pursuit_tracking::{Estimate, Recipe};

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

/// The frames of an iterator as a source, which reads each when it is asked for it; frames carry their own numbers and times.
/// Fallible ones, and what more is known of them, take [`Frames`].
///
/// ```
/// use pursuit::imaging::Image;
/// use pursuit::{BBox, Frame, frames, recipe, track};
///
/// let square = |x: usize, at: usize| if (at..at + 20).contains(&x) { 200_u8 } else { 40 };
/// let made = (0..10_u64).filter_map(move |k| {
///     let image = Image::from_fn(120, 80, |x, y| square(x, 30 + k as usize).min(square(y, 30))).ok()?;
///     Some(Frame::new(k, k as f64 / 25.0, image))
/// });
/// let target = BBox::from_ltwh(30.0, 30.0, 20.0, 20.0);
/// assert_eq!(track(frames(made)?, &*recipe("kcf")?, target).count(), 10);
/// # Ok::<(), pursuit::RunError>(())
/// ```
///
/// # Errors
/// When there is no frame: the first is read at once, as it says the size.
pub fn frames<I>(frames: I) -> Result<Box<dyn Source>, RunError>
where
    I: IntoIterator<Item = Frame, IntoIter: Send + 'static>,
{
    Ok(Box::new(Frames::new("frames", frames.into_iter().map(Ok))?))
}

/// Follows the target inside `bbox` of the first frame of `source` to its end: an estimate for every frame that can be had, the
/// first one the box itself.
pub fn track(source: Box<dyn Source>, recipe: &dyn Recipe, bbox: BBox) -> Follow {
    Follow(Session::new(source, recipe.boxed_clone()).starting_on(vec![bbox]))
}

/// The estimates of [`track`], frame by frame: a [`Session`] of one target. After an error comes the end.
pub struct Follow(Session);

impl Iterator for Follow {
    type Item = Result<Estimate, RunError>;

    fn next(&mut self) -> Option<Self::Item> {
        let progress = self.0.step().transpose()?;
        progress.map(|progress| progress.records.first()?.estimate.clone()).transpose()
    }
}
