use super::input::Input;
use crate::RunError;
use pursuit_imaging::Frame;
use pursuit_media::Source;
use std::collections::VecDeque;
use std::sync::Arc;

/// What frames seen lately may take, bytes.
const ROOM: usize = 128 << 20;
/// Frames that are read on the way to one that was not kept, so that those before it are there too.
const RUN_UP: u64 = 24;
/// A reader that is this near is not begun again.
const NEAR: u64 = 48;
/// The frames seen lately, and a way to those before.
pub struct Frames {
    input: Input,
    live: bool,
    /// In order of arrival.
    kept: VecDeque<Arc<Frame>>,
    bytes: usize,
    reader: Option<(Box<dyn Source>, u64)>,
}

impl Frames {
    /// Of a live input only what was kept lately can be had.
    pub const fn new(input: Input, live: bool) -> Self {
        Self { input, live, kept: VecDeque::new(), bytes: 0, reader: None }
    }

    /// Keeps a frame's pixels without what is derived from them.
    pub fn keep(&mut self, frame: &Frame) {
        if self.find(frame.index()).is_some() {
            return;
        }
        let frame = Arc::new(frame.undecorated());
        self.bytes += frame.source_bytes();
        self.kept.push_back(frame);
        while self.bytes > ROOM && self.kept.len() > 1 {
            if let Some(oldest) = self.kept.pop_front() {
                self.bytes -= oldest.source_bytes();
            }
        }
    }

    /// The frame of this number; `None` where a live source has gone on or the input has no such frame.
    ///
    /// # Errors
    /// An input that cannot be read again.
    pub fn get(&mut self, index: u64) -> Result<Option<Arc<Frame>>, RunError> {
        if let Some(frame) = self.find(index) {
            return Ok(Some(frame));
        }
        if self.live {
            return Ok(None);
        }
        let near = self.reader.as_ref().is_some_and(|(_, next)| (*next..*next + NEAR).contains(&index));
        if !near {
            let from = index.saturating_sub(RUN_UP);
            self.reader = Some((self.input.open(from)?.0, from));
        }
        while let Some((reader, next)) = &mut self.reader {
            match reader.next_frame() {
                Ok(Some(frame)) => {
                    *next = frame.index() + 1;
                    let reached = frame.index() >= index;
                    self.keep(&frame);
                    if reached {
                        break;
                    }
                }
                Ok(None) => self.reader = None,
                Err(e) if e.is_damage() => {}
                Err(e) => {
                    self.reader = None;
                    return Err(e.into());
                }
            }
        }
        Ok(self.find(index))
    }

    fn find(&self, index: u64) -> Option<Arc<Frame>> {
        self.kept.iter().rev().find(|f| f.index() == index).cloned()
    }
}
