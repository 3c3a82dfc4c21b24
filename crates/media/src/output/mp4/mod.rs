mod boxes;

use super::h264::{Encoded, H264Encoder};
use super::i420::I420;
use super::storage::Storage;
use super::video::{VideoOptions, VideoWriter};
use crate::{MediaError, Result};
use boxes::{EntryPoint, Sample, TIMESCALE};
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Rgb8};
use std::fs::File;
use std::io::{self, SeekFrom};
use std::path::{Path, PathBuf};

/// A fragment is written after so many frames…
const FRAGMENT_FRAMES: usize = 8;
/// … or so many ticks, whichever comes first: all that a crash can cost.
const FRAGMENT_TICKS: u64 = TIMESCALE as u64 / 2;
/// Decoding can begin every so many ticks.
const KEYFRAME_TICKS: u64 = 2 * TIMESCALE as u64;
/// The longest that one frame is shown: half a day, where durations of 32 bits end.
const LONGEST_TICKS: u64 = TIMESCALE as u64 * 43_200;

/// Writes an H.264 MP4 file that browsers play.
///
/// The file is fragmented: its header comes first, then a self-contained fragment for every 8 frames or half second,
/// each in one write. Whatever happens, also the end of this process from outside, all fragments on disk play. Memory does
/// not grow with the clip's length beyond 16 bytes for every two seconds. Pictures with odd sides are widened by one pixel.
pub struct Mp4Writer {
    path: PathBuf,
    storage: Box<dyn Storage>,
    options: VideoOptions,
    stream: Option<Stream>,
    ended: Ended,
}

/// Whether more can be written.
enum Ended {
    Not,
    Finished,
    /// With what went wrong.
    Failed(String),
}

/// What exists from the first picture on.
struct Stream {
    size: Size,
    encoder: H264Encoder,
    planes: I420,
    encoded: Encoded,
    /// Time of the first picture, and of the latest in ticks after it.
    origin_s: f64,
    latest: u64,
    /// How long the picture before the latest was shown; 0 before there are two.
    usual: u32,
    last_keyframe: u64,
    /// The fragment in the making: its first sample's time, samples, and their data. The last sample's duration is not
    /// known before the next picture comes.
    begins: u64,
    samples: Vec<Sample>,
    data: Vec<u8>,
    /// End of the last fragment in the file, in ticks.
    end: u64,
    /// Bytes of complete boxes in the file, fragments so far, where players can enter, where the duration goes.
    length: u64,
    fragments: u32,
    entries: Vec<EntryPoint>,
    duration_at: u64,
    buffer: Vec<u8>,
}

impl Mp4Writer {
    /// Creates (or replaces) the file `path`.
    ///
    /// # Errors
    /// [`MediaError::Unwritable`] when it cannot be created.
    pub fn create(path: &Path, options: VideoOptions) -> Result<Self> {
        let file = File::create(path).map_err(|e| unwritable(path, &describe(&e)))?;
        Ok(Self::new(Box::new(file), path, options))
    }

    /// Writes to anything; `name` stands in error messages.
    pub fn new(storage: Box<dyn Storage>, name: &Path, options: VideoOptions) -> Self {
        Self { path: name.to_path_buf(), storage, options, stream: None, ended: Ended::Not }
    }

    /// Notes a failure, so that later calls fail alike, and turns it into an error.
    fn fail(&mut self, reason: String) -> MediaError {
        let error = unwritable(&self.path, &reason);
        self.ended = Ended::Failed(reason);
        error
    }

    fn add(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<(), String> {
        let stream = match &mut self.stream {
            Some(stream) => stream,
            none => none.insert(Stream::new(image.size(), time_s, &self.options)?),
        };
        if stream.size != image.size() {
            return Err(format!(
                "the frame size changed from {} to {}; one video has one size",
                stream.size,
                image.size()
            ));
        }
        stream.add(image, time_s, self.storage.as_mut())
    }
}

impl VideoWriter for Mp4Writer {
    fn write(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<()> {
        match &self.ended {
            Ended::Not => self.add(image, time_s).map_err(|reason| self.fail(reason)),
            Ended::Finished => Err(unwritable(&self.path, "it is already finished")),
            Ended::Failed(reason) => Err(unwritable(&self.path, reason)),
        }
    }

    fn finish(&mut self) -> Result<()> {
        if matches!(self.ended, Ended::Finished) {
            return Ok(());
        }
        let last_s = 1.0 / self.options.sane_fps();
        let closed = self.stream.as_mut().map_or(Ok(()), |stream| stream.close(last_s, self.storage.as_mut()));
        match std::mem::replace(&mut self.ended, Ended::Finished) {
            Ended::Failed(reason) => Err(unwritable(&self.path, &reason)),
            _ => closed.map_err(|reason| self.fail(reason)),
        }
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Mp4Writer {
    /// Closes the file properly when nobody did; who wants to know whether that worked calls `finish`.
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

impl Stream {
    fn new(size: Size, origin_s: f64, options: &VideoOptions) -> Result<Self, String> {
        let (width, height) = I420::padded(size.width, size.height);
        Ok(Self {
            size,
            encoder: H264Encoder::new(width, height, options)?,
            planes: I420::default(),
            encoded: Encoded::default(),
            origin_s,
            latest: 0,
            usual: 0,
            last_keyframe: 0,
            begins: 0,
            samples: Vec::new(),
            data: Vec::new(),
            end: 0,
            length: 0,
            fragments: 0,
            entries: Vec::new(),
            duration_at: 0,
            buffer: Vec::new(),
        })
    }

    fn add(&mut self, image: ImageView<'_, Rgb8>, time_s: f64, storage: &mut dyn Storage) -> Result<(), String> {
        let time = self.ticks(time_s);
        self.planes.fill_from(image);
        // The first picture is one anyway.
        let due = time - self.last_keyframe >= KEYFRAME_TICKS;
        self.encoder.encode(&self.planes, due, &mut self.encoded)?;
        if let Some(sample) = self.samples.last_mut() {
            sample.duration = (time - self.latest) as u32;
            self.usual = sample.duration;
        }
        self.latest = time;
        if self.length == 0 {
            self.write_header(storage)?;
        }
        let full =
            self.samples.len() >= FRAGMENT_FRAMES || time - self.begins >= FRAGMENT_TICKS || self.encoded.keyframe;
        if full && !self.samples.is_empty() {
            self.write_fragment(storage)?;
        }
        if self.samples.is_empty() {
            self.begins = time;
        }
        if self.encoded.keyframe {
            self.last_keyframe = time;
        }
        self.samples.push(Sample {
            duration: 0,
            size: self.encoded.data.len() as u32,
            keyframe: self.encoded.keyframe,
        });
        self.data.extend_from_slice(&self.encoded.data);
        Ok(())
    }

    /// The time of a picture in ticks after the first: later than its predecessor's in any case.
    fn ticks(&self, time_s: f64) -> u64 {
        if self.length == 0 {
            return 0;
        }
        let ticks = ((time_s - self.origin_s) * f64::from(TIMESCALE)).round();
        // `as` turns NaN and negative times into 0.
        (ticks as u64).clamp(self.latest + 1, self.latest + LONGEST_TICKS)
    }

    fn write_header(&mut self, storage: &mut dyn Storage) -> Result<(), String> {
        let Some((sequence, pictures)) = &self.encoded.parameter_sets else {
            return Err("the encoder's first frame came without parameter sets".to_owned());
        };
        let (width, height) = (self.planes.width as u16, self.planes.height as u16);
        let (header, duration_at) = boxes::header(&boxes::Track { width, height, sequence, pictures });
        self.duration_at = duration_at;
        self.append(&header, storage)
    }

    fn write_fragment(&mut self, storage: &mut dyn Storage) -> Result<(), String> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        self.fragments += 1;
        boxes::fragment(&mut buffer, self.fragments, self.begins, &self.samples);
        buffer.extend_from_slice(&self.data);
        let entry = EntryPoint { time: self.begins, offset: self.length };
        let is_entry = self.samples.first().is_some_and(|s| s.keyframe);
        let end = self.begins + self.samples.iter().map(|s| u64::from(s.duration)).sum::<u64>();
        self.samples.clear();
        self.data.clear();
        let appended = self.append(&buffer, storage);
        self.buffer = buffer;
        if appended.is_ok() {
            self.end = end;
            self.entries.extend(is_entry.then_some(entry));
        }
        appended
    }

    /// Writes whole boxes at the end, or nothing.
    fn append(&mut self, bytes: &[u8], storage: &mut dyn Storage) -> Result<(), String> {
        let written = storage.seek(SeekFrom::Start(self.length)).and_then(|_| storage.write_all(bytes));
        match written.and_then(|()| storage.flush()) {
            Ok(()) => {
                self.length += bytes.len() as u64;
                Ok(())
            }
            Err(error) => {
                // Half a box would only confuse players; if cutting it off fails too, they still play what is before.
                let _ = storage.truncate(self.length);
                Err(describe(&error))
            }
        }
    }

    fn close(&mut self, last_s: f64, storage: &mut dyn Storage) -> Result<(), String> {
        if let Some(last) = self.samples.last_mut() {
            let nominal = (last_s * f64::from(TIMESCALE)) as u32;
            last.duration = if self.usual > 0 { self.usual } else { nominal };
            self.write_fragment(storage)?;
        }
        let entries = std::mem::take(&mut self.entries);
        if entries.is_empty() {
            return Ok(());
        }
        self.append(&boxes::index(&entries), storage)?;
        let place = storage.seek(SeekFrom::Start(self.duration_at));
        let stated = place.and_then(|_| storage.write_all(&boxes::duration(self.end)));
        stated.and_then(|()| storage.flush()).map_err(|e| describe(&e))
    }
}

fn unwritable(path: &Path, reason: &str) -> MediaError {
    MediaError::Unwritable { name: path.display().to_string(), reason: reason.to_owned() }
}

/// A system error in words that say what would mend it.
fn describe(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::StorageFull => "the disk is full; what was written before is kept; free some space".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied; choose a folder you may write to".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only; choose another folder".to_owned(),
        io::ErrorKind::NotFound => "its folder does not exist; create it first".to_owned(),
        _ => error.to_string(),
    }
}
