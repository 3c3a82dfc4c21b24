//! Writing MP4: fragment by fragment, so that whatever happens, what is on disk plays.

mod boxes;

use crate::{ContainerError, Result, Storage};
use boxes::{EntryPoint, Sample, TIMESCALE};
use std::io::{self, SeekFrom};

/// A fragment is written after so many frames…
const FRAGMENT_FRAMES: usize = 8;
/// … or so many ticks, whichever comes first: all that a crash can cost.
const FRAGMENT_TICKS: u64 = TIMESCALE as u64 / 2;
/// Decoding can begin every so many ticks.
const KEYFRAME_TICKS: u64 = 2 * TIMESCALE as u64;
/// The longest that one frame is shown: half a day, where durations of 32 bits end.
const LONGEST_TICKS: u64 = TIMESCALE as u64 * 43_200;

/// One picture of an H.264 encoder.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EncodedSample {
    /// NAL units with 4-byte lengths, as MP4 stores them.
    pub data: Vec<u8>,
    /// Whether decoding can begin here.
    pub keyframe: bool,
    /// Sequence and picture parameter sets, where the encoder gave them. The first picture needs them.
    pub parameter_sets: Option<(Vec<u8>, Vec<u8>)>,
}

/// Writes one track of H.264 as fragmented MP4: the header comes first, then a self-contained fragment for every 8 frames
/// or half second, each in one write, and an index at the end. Memory does not grow with the clip's length beyond 16 bytes
/// for every two seconds.
#[derive(Debug)]
pub struct Writer {
    width: u16,
    height: u16,
    /// Width against height of a pixel.
    pixel_aspect: Option<(u32, u32)>,
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

impl Writer {
    /// A writer for pictures of this size, the first of them shown at `origin_s` (seconds), which becomes 0 in the file.
    pub const fn new(width: u16, height: u16, origin_s: f64) -> Self {
        Self {
            width,
            height,
            pixel_aspect: None,
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
        }
    }

    /// The same, of pixels that are not square: width against height of one.
    #[must_use]
    pub const fn with_pixel_aspect(mut self, aspect: Option<(u32, u32)>) -> Self {
        self.pixel_aspect = aspect;
        self
    }

    /// Whether the picture at `time_s` should be one that decoding can begin with: two seconds have passed since the last.
    pub fn keyframe_due(&self, time_s: f64) -> bool {
        self.ticks(time_s) - self.last_keyframe >= KEYFRAME_TICKS
    }

    /// Adds a picture, shown from `time_s` on (seconds) until the next one's time; a time that is not later than its
    /// predecessor's is taken as later by a tick of 1/90000 s.
    ///
    /// # Errors
    /// [`ContainerError::Unwritable`] when the storage fails, after which what is complete there still plays, or the first
    /// picture has no parameter sets.
    pub fn add(&mut self, sample: &EncodedSample, time_s: f64, storage: &mut dyn Storage) -> Result<()> {
        let time = self.ticks(time_s);
        if let Some(before) = self.samples.last_mut() {
            before.duration = (time - self.latest) as u32;
            self.usual = before.duration;
        }
        self.latest = time;
        if self.length == 0 {
            self.write_header(sample, storage)?;
        }
        let full = self.samples.len() >= FRAGMENT_FRAMES || time - self.begins >= FRAGMENT_TICKS || sample.keyframe;
        if full && !self.samples.is_empty() {
            self.write_fragment(storage)?;
        }
        if self.samples.is_empty() {
            self.begins = time;
        }
        if sample.keyframe {
            self.last_keyframe = time;
        }
        self.samples.push(Sample { duration: 0, size: sample.data.len() as u32, keyframe: sample.keyframe });
        self.data.extend_from_slice(&sample.data);
        Ok(())
    }

    /// Writes what is still held back, the index, and the duration into the header. `last_s` (seconds) is how long a lone
    /// picture is shown; the last of several is shown as long as the one before.
    ///
    /// # Errors
    /// [`ContainerError::Unwritable`] when the storage fails.
    pub fn close(&mut self, last_s: f64, storage: &mut dyn Storage) -> Result<()> {
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
        stated.and_then(|()| storage.flush()).map_err(|e| unwritable(&e))
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

    fn write_header(&mut self, first: &EncodedSample, storage: &mut dyn Storage) -> Result<()> {
        let Some((sequence, pictures)) = &first.parameter_sets else {
            return Err(ContainerError::unwritable("the encoder's first frame came without parameter sets"));
        };
        let (width, height) = (self.width, self.height);
        let (header, duration_at) =
            boxes::header(&boxes::Track { width, height, pixel_aspect: self.pixel_aspect, sequence, pictures });
        self.duration_at = duration_at;
        self.append(&header, storage)
    }

    fn write_fragment(&mut self, storage: &mut dyn Storage) -> Result<()> {
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
    fn append(&mut self, bytes: &[u8], storage: &mut dyn Storage) -> Result<()> {
        let written = storage.seek(SeekFrom::Start(self.length)).and_then(|_| storage.write_all(bytes));
        match written.and_then(|()| storage.flush()) {
            Ok(()) => {
                self.length += bytes.len() as u64;
                Ok(())
            }
            Err(error) => {
                // Half a box would only confuse players; if cutting it off fails too, they still play what is before.
                let _ = storage.truncate(self.length);
                Err(unwritable(&error))
            }
        }
    }
}

/// A system error in words that say what would mend it.
fn unwritable(error: &io::Error) -> ContainerError {
    ContainerError::unwritable(match error.kind() {
        io::ErrorKind::StorageFull => "the disk is full; what was written before is kept; free some space".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied; choose a folder you may write to".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only; choose another folder".to_owned(),
        io::ErrorKind::NotFound => "its folder does not exist; create it first".to_owned(),
        _ => error.to_string(),
    })
}
