use crate::depth::DepthFacts;
use crate::wrappers::StreamStats;
use crate::{MediaError, Result, Truth, View};
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use std::sync::Arc;

/// Anything that delivers frames, one after the other.
pub trait Source: Send {
    /// What is known before the first frame is read.
    fn info(&self) -> &SourceInfo;

    /// The next frame, or `None` after the last.
    ///
    /// # Errors
    /// [`MediaError::Damaged`](crate::MediaError::Damaged) when a frame cannot be had and the input goes on behind it: the
    /// next call delivers what comes then, with its own number and time. [`MediaError::Broken`](crate::MediaError::Broken)
    /// when the input breaks off. Everything that could be decoded has been delivered by then, and what was delivered stays
    /// valid; later calls return `None`.
    fn next_frame(&mut self) -> Result<Option<Frame>>;

    /// Goes to frame `index`, forward or back: [`next_frame`](Self::next_frame) delivers that frame next, with the number
    /// and the time it has whenever it is read.
    ///
    /// # Errors
    /// [`MediaError::NotSeekable`] when the source can only be read from front to back ([`SourceInfo::seekable`] says so
    /// beforehand) or has no such frame; it then goes on where it was.
    fn seek(&mut self, index: u64) -> Result<()> {
        Err(MediaError::not_seekable(&self.info().name, index, "it can only be read from front to back"))
    }

    /// A way to end the source from another thread while [`next_frame`](Self::next_frame) waits for something that may
    /// never come. `None` for sources that never wait for long.
    fn stop_handle(&self) -> Option<StopHandle> {
        None
    }
}

/// An aspect of pixels; `None` for square ones.
pub(crate) fn not_square(aspect: Option<(u32, u32)>) -> Option<(u32, u32)> {
    aspect.filter(|(width, height)| width != height)
}

/// Ends a source from another thread; its `next_frame` then returns promptly.
#[derive(Clone)]
pub struct StopHandle(Arc<dyn Fn() + Send + Sync>);

impl StopHandle {
    /// A handle that calls `stop`, which must be harmless when called twice or too late.
    pub fn new(stop: impl Fn() + Send + Sync + 'static) -> Self {
        Self(Arc::new(stop))
    }

    /// Ends the source.
    pub fn stop(&self) {
        (self.0)();
    }
}

impl std::fmt::Debug for StopHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("StopHandle")
    }
}

impl<S: Source + ?Sized> Source for Box<S> {
    fn info(&self) -> &SourceInfo {
        (**self).info()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        (**self).next_frame()
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        (**self).seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        (**self).stop_handle()
    }
}

/// What a [`Source`] knows about itself before its first frame.
///
/// A wrapper starts from the whole `SourceInfo` of what it wraps and changes only the facts that it changes itself.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceInfo {
    /// The input as the user wrote it.
    pub name: String,
    /// Width and height of every frame, after rotation, in pixels.
    pub size: Size,
    /// Nominal frames per second, where the input states a rate. Frames carry their own times; this is for display.
    pub fps: Option<f64>,
    /// How many frames there will be, where that is known beforehand.
    pub frame_count: Option<u64>,
    /// How long the file says that it is, in seconds, where its frames are not counted: they may be a few more or fewer.
    pub duration_s: Option<f64>,
    /// Whether frames come in real time and cannot wait (cameras, streams).
    pub live: bool,
    /// How it is decoded, in words: `H.264 in MP4 (built in)`, `ffmpeg: vp9`.
    pub decoder: String,
    /// The true boxes that came with the input, by frame index; see [`truth_at`](Self::truth_at).
    pub truth: Option<Vec<Truth>>,
    /// Whether [`Source::seek`] can succeed.
    pub seekable: bool,
    /// The part of the input's picture that frames show, where that is not all as it came. The other facts are of the whole
    /// input, and boxes (the truth too) are in its pixels.
    pub view: Option<View>,
    /// Width against height of a pixel of the input, where it says that they are not square.
    pub pixel_aspect: Option<(u32, u32)>,
    /// What was found out about its depth, of inputs that have depth images of their own.
    pub depth: Option<DepthFacts>,
    /// Running counts of a live source that is connected to again when it breaks off; they go on changing.
    pub stream: Option<StreamStats>,
}

impl SourceInfo {
    /// Of an input that can only be read from front to back, with nothing else known.
    pub fn new(name: impl Into<String>, size: Size, decoder: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            size,
            fps: None,
            frame_count: None,
            duration_s: None,
            live: false,
            decoder: decoder.into(),
            truth: None,
            seekable: false,
            view: None,
            pixel_aspect: None,
            depth: None,
            stream: None,
        }
    }

    /// Width and height of the input's whole picture, in pixels.
    pub fn input_size(&self) -> Size {
        self.view.map_or(self.size, |view| view.input)
    }

    /// Refuses to go to a frame that is known not to exist.
    ///
    /// # Errors
    /// [`MediaError::NotSeekable`] with the number of frames there are.
    pub fn check_seek(&self, index: u64) -> Result<()> {
        match self.frame_count {
            Some(count) if index >= count => {
                let reason = format!("it has {count} frames, counted from 0");
                Err(MediaError::not_seekable(&self.name, index, reason))
            }
            _ => Ok(()),
        }
    }

    /// The true box of frame `index`; [`Truth::Unknown`] where nothing is said.
    pub fn truth_at(&self, index: u64) -> Truth {
        let row = self.truth.as_ref().and_then(|t| t.get(usize::try_from(index).ok()?));
        row.copied().unwrap_or(Truth::Unknown)
    }
}
