use super::h264::H264Encoder;
use super::i420::I420;
use super::mp4::unwritable;
use super::video::VideoOptions;
use crate::Result;
use pursuit_containers::mp4::{EncodedSample, Writer};
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Rgb8};
use std::collections::VecDeque;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Decoding can begin so often, seconds: a clip begins up to this much earlier than asked for.
const KEYFRAME_S: f64 = 1.0;
/// The past is forgotten earlier than asked for where it would take more bytes than this.
const MOST_BYTES: usize = 64 << 20;

/// Makes MP4 clips of moments that are known to matter only when they have come: the last seconds are held, compressed, and a
/// clip begins with them.
///
/// Pictures are encoded once, whether they get into a clip or not. Memory does not grow beyond the past that is held (some
/// seconds of H.264, at most 64 MiB). Clips are fragmented MP4 as [`Mp4Writer`](super::Mp4Writer)'s are: whatever happens, what
/// is on disk plays.
pub struct ClipRecorder {
    options: VideoOptions,
    before_s: f64,
    stream: Option<Stream>,
    clip: Option<Clip>,
}

/// What exists from the first picture on.
struct Stream {
    size: Size,
    encoder: H264Encoder,
    planes: I420,
    /// The past, which begins with a picture that decoding can begin with.
    past: VecDeque<(f64, EncodedSample)>,
    bytes: usize,
    last_keyframe_s: f64,
    parameter_sets: Option<(Vec<u8>, Vec<u8>)>,
}

/// A clip in the making.
struct Clip {
    path: PathBuf,
    file: File,
    container: Option<Writer>,
}

impl ClipRecorder {
    /// Holds the last `before_s` seconds, ≥ 0, and up to a second more.
    pub const fn new(options: VideoOptions, before_s: f64) -> Self {
        Self { options, before_s, stream: None, clip: None }
    }

    /// Takes a picture of the time `time_s`; into the clip, where one is being made.
    ///
    /// # Errors
    /// [`MediaError::Unwritable`](crate::MediaError::Unwritable) when it cannot be encoded (its size changed, or is beyond the
    /// encoder's) or written.
    pub fn write(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<()> {
        let stream = match &mut self.stream {
            Some(stream) => stream,
            none => {
                none.insert(Stream::new(image.size(), &self.options).map_err(|why| unwritable(CLIPS.as_ref(), &why))?)
            }
        };
        stream.encode(image, time_s).map_err(|why| unwritable(CLIPS.as_ref(), &why))?;
        if let Some((clip, (time_s, sample))) = self.clip.as_mut().zip(stream.past.back()) {
            clip.add(*time_s, sample, stream.size, &self.options)?;
        }
        stream.forget(time_s - self.before_s);
        Ok(())
    }

    /// Begins a clip with the past, ending the one before.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn begin(&mut self, path: &Path) -> Result<()> {
        self.end()?;
        let file = File::create(path).map_err(|e| unwritable(path, &e.to_string()))?;
        let mut clip = Clip { path: path.to_path_buf(), file, container: None };
        if let Some(stream) = &self.stream {
            for (time_s, sample) in &stream.past {
                clip.add(*time_s, sample, stream.size, &self.options)?;
            }
        }
        self.clip = Some(clip);
        Ok(())
    }

    /// Ends the clip in the making, where there is one.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn end(&mut self) -> Result<()> {
        let last_s = 1.0 / self.options.sane_fps();
        self.clip.take().map_or(Ok(()), |clip| clip.close(last_s))
    }
}

/// What errors of the encoder are about: it has no file of its own.
const CLIPS: &str = "clips of events";

impl Stream {
    fn new(size: Size, options: &VideoOptions) -> Result<Self, String> {
        let (width, height) = I420::padded(size.width, size.height);
        Ok(Self {
            size,
            encoder: H264Encoder::new(width, height, options)?,
            planes: I420::default(),
            past: VecDeque::new(),
            bytes: 0,
            last_keyframe_s: f64::NEG_INFINITY,
            parameter_sets: None,
        })
    }

    fn encode(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<(), String> {
        if image.size() != self.size {
            let (before, now) = (self.size, image.size());
            return Err(format!("the frame size changed from {before} to {now}; one video has one size"));
        }
        self.planes.fill_from(image);
        let is_due = !(0.0..KEYFRAME_S).contains(&(time_s - self.last_keyframe_s));
        let mut sample = EncodedSample::default();
        self.encoder.encode(&self.planes, is_due, &mut sample)?;
        self.parameter_sets = sample.parameter_sets.take().or(self.parameter_sets.take());
        if sample.keyframe {
            self.last_keyframe_s = time_s;
            // A clip may begin with any of these.
            sample.parameter_sets.clone_from(&self.parameter_sets);
        }
        self.bytes += sample.data.len();
        self.past.push_back((time_s, sample));
        Ok(())
    }

    /// Drops what is older than `oldest_s` as far as what is left begins with a keyframe.
    fn forget(&mut self, oldest_s: f64) {
        loop {
            let next = self.past.iter().skip(1).position(|(_, sample)| sample.keyframe).map(|at| at + 1);
            let Some(next) = next else { return };
            let is_old = self.past.get(next).is_some_and(|(time_s, _)| *time_s <= oldest_s);
            if !is_old && self.bytes <= MOST_BYTES {
                return;
            }
            self.bytes -= self.past.drain(..next).map(|(_, sample)| sample.data.len()).sum::<usize>();
        }
    }
}

impl Clip {
    fn add(&mut self, time_s: f64, sample: &EncodedSample, size: Size, options: &VideoOptions) -> Result<()> {
        let container = self.container.get_or_insert_with(|| {
            let (width, height) = I420::padded(size.width, size.height);
            // The encoder takes no larger pictures than fit.
            Writer::new(width as u16, height as u16, time_s).with_pixel_aspect(options.pixel_aspect)
        });
        container.add(sample, time_s, &mut self.file).map_err(|e| unwritable(&self.path, &e.to_string()))
    }

    fn close(mut self, last_s: f64) -> Result<()> {
        let closed = self.container.as_mut().map_or(Ok(()), |container| container.close(last_s, &mut self.file));
        closed.map_err(|e| unwritable(&self.path, &e.to_string()))
    }
}

impl Drop for ClipRecorder {
    /// Closes the clip properly when nobody did; who wants to know whether that worked calls `end`.
    fn drop(&mut self) {
        let _ = self.end();
    }
}
