//! MCAP files and ROS 2 bags: the images of one topic as a video.

mod cdr;
mod message;
mod raw;
mod recording;

use super::fault::Fault;
use crate::{MediaError, Result, Source, SourceInfo};
use ::mcap::io::MessageReader;
use message::Reading;
use pursuit_imaging::Frame;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The images of one topic.
pub(crate) struct McapSource {
    info: SourceInfo,
    files: Vec<PathBuf>,
    topic: String,
    /// The file that is read, and how far.
    file: usize,
    messages: Option<MessageReader<BufReader<File>>>,
    clock: Clock,
    /// The number of the next frame.
    next: u64,
    /// How often an image was passed over on the way to a frame that was asked for.
    skip_to: u64,
    finished: bool,
}

/// Where the times of frames come from: what the images say, or when they were recorded.
#[derive(Debug, Clone, Copy, Default)]
struct Clock {
    /// Whether the images say when they were taken.
    by_stamp: bool,
    /// The first time, and the last with when that was recorded.
    first_s: Option<f64>,
    last: Option<(f64, f64)>,
}

impl Clock {
    /// The least step of time: stamps that stand still or go back are no times.
    const LEAST_S: f64 = 1e-4;

    /// The time of an image by its stamp and by when it was recorded, seconds from the first.
    fn time_s(&mut self, stamp_s: f64, logged_s: f64) -> f64 {
        if self.first_s.is_none() {
            self.by_stamp = stamp_s > 0.0;
        }
        let said = if self.by_stamp { stamp_s } else { logged_s };
        let first = *self.first_s.get_or_insert(said);
        let time_s = match self.last {
            Some((last_s, last_logged_s)) if said - first <= last_s || !said.is_finite() => {
                last_s + (logged_s - last_logged_s).max(Self::LEAST_S)
            }
            _ => said - first,
        };
        self.last = Some((time_s, logged_s));
        time_s
    }
}

/// A file's name and the topic that is asked for behind it: `bag.mcap?topic=/camera/image`.
pub(crate) fn split_topic(input: &str) -> Option<(&str, &str)> {
    let (path, topic) = input.split_once("?topic=")?;
    (!path.is_empty() && !topic.is_empty()).then_some((path, topic))
}

/// Whether a folder is a ROS 2 bag.
pub(crate) fn is_bag(folder: &Path) -> bool {
    recording::files_of(folder).is_some()
}

impl McapSource {
    /// A file, or a bag's folder.
    pub fn open(path: &Path, name: &str, topic: Option<&str>) -> Result<Self> {
        let unreadable = |reason: String| MediaError::unreadable(name, reason);
        let files = match recording::files_of(path) {
            Some(files) => files.map_err(unreadable)?,
            None => vec![path.to_owned()],
        };
        let contents = recording::look_through(&files).map_err(|fault| fault.unreadable(name))?;
        let (topic, known) = contents.choose(topic).map_err(unreadable)?;
        let mut source = Self {
            info: SourceInfo::new(name, pursuit_geometry::Size::new(1, 1), format!("MCAP (built in): {topic}")),
            files,
            topic,
            file: 0,
            messages: None,
            clock: Clock::default(),
            next: 0,
            skip_to: 0,
            finished: false,
        };
        // The size is that of the first image that can be read; so is the rate, of the first two.
        let mut times = Vec::new();
        while times.len() < 2 {
            match source.read() {
                Ok(Some(frame)) => {
                    if times.is_empty() {
                        source.info.size = frame.size();
                    }
                    times.push(frame.time_s());
                }
                Ok(None) => break,
                Err(error) if error.is_damage() => {}
                Err(error) if times.is_empty() => return Err(unreadable(error.to_string())),
                Err(_) => break,
            }
        }
        if times.is_empty() {
            return Err(unreadable("none of its images can be read".to_owned()));
        }
        source.info.fps = mean_rate(&times);
        source.info.frame_count = contents.is_whole.then_some(known.messages);
        source.info.seekable = true;
        source.rewind();
        Ok(source)
    }

    fn rewind(&mut self) {
        (self.file, self.messages, self.clock) = (0, None, Clock::default());
        (self.next, self.skip_to, self.finished) = (0, 0, false);
    }

    /// The next image of the topic.
    fn read(&mut self) -> Result<Option<Frame>> {
        loop {
            let Some(path) = self.files.get(self.file).cloned() else { return Ok(None) };
            let named = if self.files.len() > 1 { path.display().to_string() } else { self.info.name.clone() };
            let messages = match &mut self.messages {
                Some(messages) => messages,
                none => none.insert(recording::open(&path).map_err(|fault| fault.broken(&named, self.next))?),
            };
            let message = match messages.next() {
                None => {
                    (self.file, self.messages) = (self.file + 1, None);
                    continue;
                }
                Some(Err(error)) => return Err(recording::fault(&error).broken(&named, self.next)),
                Some(Ok(message)) if message.channel.topic == self.topic => message,
                Some(Ok(_)) => continue,
            };
            let index = self.next;
            self.next += 1;
            let logged_s = 1e-9 * message.log_time as f64;
            let unlike = || Fault::malformed("its channel is of another type than before");
            let reading: Reading = recording::reading(&message).ok_or_else(|| unlike().damaged(&named, index))?;
            let (stamp_s, picture) = reading.read(&message.data).map_err(|fault| fault.damaged(&named, index))?;
            let time_s = self.clock.time_s(stamp_s, logged_s);
            if index < self.skip_to {
                continue;
            }
            let pixels = picture.decode().map_err(|fault| fault.damaged(&named, index))?;
            return Ok(Some(Frame::new(index, time_s, pixels)));
        }
    }
}

/// Frames a second by the times of the first two.
fn mean_rate(times: &[f64]) -> Option<f64> {
    let [first, second] = times else { return None };
    let rate = 1.0 / (second - first);
    (0.001..=1e6).contains(&rate).then_some(rate)
}

impl Source for McapSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        let frame = self.read();
        self.finished = match &frame {
            Ok(frame) => frame.is_none(),
            Err(error) => !error.is_damage(),
        };
        frame
    }

    /// Goes on from where it is, or from the beginning; images on the way are not decoded.
    fn seek(&mut self, index: u64) -> Result<()> {
        self.info.check_seek(index)?;
        if index < self.next || self.finished {
            self.rewind();
        }
        self.skip_to = index;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_times_as_long_as_they_grow() {
        let times = |pairs: &[(f64, f64)]| {
            let mut clock = Clock::default();
            pairs.iter().map(|(stamp, logged)| clock.time_s(*stamp, *logged)).collect::<Vec<_>>()
        };
        assert_eq!(times(&[(100.0, 7.0), (100.5, 7.9), (101.0, 8.0)]), [0.0, 0.5, 1.0]);
        assert_eq!(times(&[(0.0, 7.0), (0.0, 7.5)]), [0.0, 0.5], "no stamps");
        assert_eq!(times(&[(100.0, 7.0), (100.0, 7.5), (102.0, 8.0)]), [0.0, 0.5, 2.0], "a stamp that stands still");
        assert_eq!(times(&[(100.0, 7.0), (f64::NAN, 7.0)]), [0.0, 1e-4]);
    }

    #[test]
    fn a_topic_stands_behind_the_file() {
        assert_eq!(split_topic("a/b.mcap?topic=/camera/image"), Some(("a/b.mcap", "/camera/image")));
        assert_eq!(split_topic("a/b.mcap"), None);
        assert_eq!(split_topic("a/b.mcap?topic="), None);
    }
}
