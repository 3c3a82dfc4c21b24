//! MCAP files and ROS 2 bags: the images of one topic as a video.

mod cdr;
mod clock;
#[cfg(feature = "db3")]
mod database;
mod message;
mod raw;
mod recording;
mod records;

use super::fault::Fault;
use crate::{MediaError, Result, Source, SourceInfo};
use clock::Clock;
use pursuit_geometry::Size;
use pursuit_imaging::{Frame, Pixels};
use recording::Reader;
use std::path::{Path, PathBuf};

/// Images from whose times the rate is taken: the recorder may have been late with any one.
const TIMED: usize = 10;

/// The images of one topic.
pub(crate) struct McapSource {
    info: SourceInfo,
    files: Vec<PathBuf>,
    topic: String,
    /// The file that is read, and how far.
    file: usize,
    reader: Option<Reader>,
    clock: Clock,
    /// The number of the next frame.
    next: u64,
    /// The frame that was asked for: those on the way are not decoded.
    skip_to: u64,
    finished: bool,
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
        let contents = recording::look_through(&files, topic).map_err(|fault| fault.unreadable(name))?;
        let (topic, count) = contents.choose(topic).map_err(unreadable)?;
        let info = SourceInfo {
            frame_count: contents.is_whole.then_some(count),
            seekable: true,
            ..SourceInfo::new(name, Size::new(1, 1), format!("recording (built in): {topic}"))
        };
        let mut source = Self {
            info,
            files,
            topic,
            file: 0,
            reader: None,
            clock: Clock::default(),
            next: 0,
            skip_to: 0,
            finished: false,
        };
        (source.info.size, source.info.fps) = source.first_size_and_rate()?;
        source.rewind();
        Ok(source)
    }

    /// The size of the first image that can be read, and the rate of it and those behind it.
    fn first_size_and_rate(&mut self) -> Result<(Size, Option<f64>)> {
        let (mut size, mut times) = (None, Vec::new());
        while times.len() < TIMED {
            match self.read(size.is_none()) {
                Ok(Some((index, time_s, pixels))) => {
                    times.push(time_s);
                    size = size.or(pixels.map(|pixels| Frame::new(index, time_s, pixels).size()));
                }
                Err(error) if size.is_none() && !error.is_damage() => {
                    return Err(MediaError::unreadable(&self.info.name, error.to_string()));
                }
                Err(error) if error.is_damage() => {}
                Ok(None) | Err(_) => break,
            }
        }
        let none = || MediaError::unreadable(&self.info.name, "none of its images can be read");
        Ok((size.ok_or_else(none)?, middle_rate(&times)))
    }

    fn rewind(&mut self) {
        (self.file, self.reader, self.clock) = (0, None, Clock::default());
        (self.next, self.skip_to, self.finished) = (0, 0, false);
    }

    /// The next image of the topic: its number, its time, and, if it is to be decoded, its pixels.
    fn read(&mut self, decode: bool) -> Result<Option<(u64, f64, Option<Pixels>)>> {
        loop {
            let Some(path) = self.files.get(self.file) else { return Ok(None) };
            let name = if self.files.len() > 1 { path.display().to_string() } else { self.info.name.clone() };
            let reader = match &mut self.reader {
                Some(reader) => reader,
                none => none.insert(Reader::open(path).map_err(|gap| gap.fault.broken(&name, self.next))?),
            };
            let index = self.next;
            let message = match reader.next(|channel| channel.topic == self.topic) {
                Ok(Some(message)) => message,
                Ok(None) => {
                    (self.file, self.reader) = (self.file + 1, None);
                    continue;
                }
                // What was damaged has been read before it is known to be.
                Err(gap) if gap.goes_on => return Err(gap.fault.damaged(&name, index.saturating_sub(1))),
                Err(gap) => return Err(gap.fault.broken(&name, index)),
            };
            self.next += 1;
            let wanted = decode && index >= self.skip_to;
            let unlike = || Fault::malformed("its channel is of another type than before");
            let image = message.channel.reading.ok_or_else(unlike).and_then(|reading| {
                let (stamp_ns, picture) = reading.read(message.data)?;
                let time_s = self.clock.time_s(stamp_ns, message.logged_ns);
                Ok((index, time_s, wanted.then(|| picture.decode()).transpose()?))
            });
            if index >= self.skip_to {
                return image.map(Some).map_err(|fault| fault.damaged(&name, index));
            }
        }
    }

    fn frame(&mut self) -> Result<Option<Frame>> {
        let Some((index, time_s, Some(pixels))) = self.read(true)? else { return Ok(None) };
        let frame = Frame::new(index, time_s, pixels);
        if frame.size() != self.info.size {
            let reason = format!(
                "the picture changes from {} to {}; only images of one size are followed",
                self.info.size,
                frame.size()
            );
            return Err(MediaError::broken(&self.info.name, index, reason));
        }
        Ok(Some(frame))
    }
}

/// Frames a second by the step of time in the middle of all.
fn middle_rate(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let rate = 1.0 / steps.get(steps.len() / 2)?;
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
        let frame = self.frame();
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
    fn a_topic_stands_behind_the_file() {
        assert_eq!(split_topic("a/b.mcap?topic=/camera/image"), Some(("a/b.mcap", "/camera/image")));
        assert_eq!(split_topic("a/b.mcap"), None);
        assert_eq!(split_topic("a/b.mcap?topic="), None);
    }

    #[test]
    fn one_late_image_does_not_change_the_rate() {
        let rate = middle_rate(&[0.0, 0.3, 0.34, 0.38, 0.42]).unwrap();
        assert!((rate - 25.0).abs() < 1e-9, "{rate}");
        assert_eq!((middle_rate(&[0.0]), middle_rate(&[0.0, 0.0])), (None, None));
    }
}
