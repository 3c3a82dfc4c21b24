//! A sequence's frames, decoded beforehand where they fit into memory, else decoded again for every pass.

use crate::{EvaluationError, Footage, Result, Sequence};
use pursuit_imaging::Frame;
use pursuit_media::{OpenOptions, Source};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// Frames of one sequence, ready to be shown to one tracker after the other.
pub(crate) struct FrameCache<'a> {
    sequence: &'a Sequence,
    open: &'a OpenOptions,
    /// All frames, where they fit.
    decoded: Option<Vec<Frame>>,
}

/// How a showing ended.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ending {
    /// One more than the last frame shown (or passed over).
    pub frames: usize,
    /// What broke, if the footage did.
    pub broken: Option<String>,
}

impl<'a> FrameCache<'a> {
    /// Nothing in memory: the frames are decoded whenever they are shown.
    pub const fn undecoded(sequence: &'a Sequence, open: &'a OpenOptions) -> Self {
        Self { sequence, open, decoded: None }
    }

    /// Decodes the whole sequence unless it needs more than `budget` bytes or `stop` is set.
    pub fn load(sequence: &'a Sequence, open: &'a OpenOptions, budget: u64, stop: &AtomicBool) -> Result<Self> {
        let mut cache = Self::undecoded(sequence, open);
        if matches!(sequence.footage(), Footage::Memory(_)) {
            return Ok(cache);
        }
        let (mut frames, mut size) = (Vec::new(), 0);
        let mut too_large = false;
        let ending = cache.decode(|_, frame| {
            size += frame.source_bytes() as u64;
            frames.push(frame);
            too_large = size > budget;
            if too_large || stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        // Broken footage is decoded again by every pass, so that each meets the break itself.
        if !too_large && ending.broken.is_none() && !stop.load(Ordering::Relaxed) {
            cache.decoded = Some(frames);
        }
        Ok(cache)
    }

    /// Shows the frames from `start` on, each without any derived plane, so that every tracker pays for the planes it needs;
    /// pixels are shared, not copied.
    pub fn show(&self, start: usize, mut viewer: impl FnMut(usize, Frame) -> ControlFlow<()>) -> Result<Ending> {
        let frames = match (&self.decoded, self.sequence.footage()) {
            (Some(frames), _) => frames,
            (None, Footage::Memory(frames)) => frames.as_ref(),
            (None, Footage::Input { .. }) => {
                return self.decode(|i, frame| if i < start { ControlFlow::Continue(()) } else { viewer(i, frame) });
            }
        };
        let length = frames.len().min(self.sequence.truth().len());
        for (i, frame) in frames.iter().enumerate().take(length).skip(start) {
            if viewer(i, frame.undecorated()).is_break() {
                return Ok(Ending { frames: i + 1, broken: None });
            }
        }
        Ok(Ending { frames: length, broken: None })
    }

    fn decode(&self, mut viewer: impl FnMut(usize, Frame) -> ControlFlow<()>) -> Result<Ending> {
        let Footage::Input { path, first } = self.sequence.footage() else { return Ok(Ending::default()) };
        let failed = |cause| EvaluationError::Frames { sequence: self.sequence.name().to_owned(), cause };
        let mut source: Box<dyn Source> = pursuit_media::open(path, self.open).map_err(failed)?;
        let mut passed = 0;
        let length = self.sequence.truth().len();
        let mut ending = Ending::default();
        while ending.frames < length {
            let frame = match source.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => break,
                Err(e) => {
                    ending.broken = Some(e.to_string());
                    break;
                }
            };
            if passed < *first {
                passed += 1;
                continue;
            }
            ending.frames += 1;
            if viewer(ending.frames - 1, frame).is_break() {
                break;
            }
        }
        Ok(ending)
    }
}
