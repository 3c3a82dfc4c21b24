use super::fault::{Fault, Trouble};
use super::h264::PictureDecoder;
use super::limits::MAX_SAMPLE_BYTES;
use super::orientation::Orientation;
use super::source::not_square;
use crate::{Result, Source, SourceInfo};
use pursuit_containers::bytes::{RandomAccess, ReadSeek};
use pursuit_containers::mp4::{Codec, Movie, Sample};
use pursuit_imaging::{Frame, Yuv420};
use std::collections::BTreeMap;

/// H.264 in MP4 or QuickTime, decoded here.
///
/// Samples are decoded in file order and shown in the order of their composition times; times are those of the file, with
/// edits applied and the first shown frame at 0. A damaged sample is reported in its place; decoding goes on at the next
/// picture that needs none before it, and the frames between are left out. Where no such picture comes, the one before the
/// damaged one stands in for it, and it goes on at once.
pub(crate) struct Mp4Source {
    input: RandomAccess,
    samples: Vec<Sample>,
    /// For every sample its place in display order; `None` when an edit cuts it away.
    ranks: Vec<Option<u32>>,
    /// Times in seconds, in display order.
    times_s: Vec<f64>,
    decoder: PictureDecoder,
    info: SourceInfo,
    next_sample: usize,
    next_rank: u32,
    /// What waits for its turn.
    waiting: BTreeMap<u32, Slot>,
    /// How many of them are pictures.
    pictures: usize,
    /// Samples without pictures shown so far: they take no frame number.
    skipped: u32,
    /// Whether a picture that needs none before it may yet come.
    may_enter: bool,
    /// What ends it, and where.
    fault: Option<(u32, Fault)>,
    /// What of the file's own statements is not true, said after the last frame.
    flaw: Option<String>,
    buffer: Vec<u8>,
}

/// What became of a sample.
enum Slot {
    Picture(Yuv420),
    /// It holds no picture.
    Empty,
    /// It could not be decoded.
    Damaged(Fault),
    /// It needs pictures that could not be decoded.
    Orphan,
}

impl Mp4Source {
    /// Reads the index and decodes as far as the first picture, so that what cannot be decoded is known at once.
    pub fn new(reader: Box<dyn ReadSeek>, name: &str) -> Result<Self, Fault> {
        let Movie { mut input, track, flaw } = Movie::read(RandomAccess::new(reader)?)?;
        let config = match track.codec {
            Codec::Avc(config) => config,
            Codec::Other(code) => return Err(Fault::unsupported(format!("the codec {code} in MP4"))),
        };
        let orientation = Orientation::from_matrix(track.matrix);
        let orientation = orientation.ok_or_else(|| Fault::unsupported("MP4 with a slanted picture"))?;
        let (ranks, times_s) = display_order(&track.samples, |t| track.edits.shown_at(t), track.time_scale);
        let mut buffer = Vec::new();
        let first = track.samples.first().ok_or_else(|| Fault::malformed("its video track has no frames"))?;
        read_sample(&mut input, first, &mut buffer)?;
        let decoder = PictureDecoder::new(config, orientation, &buffer)?;
        let info = SourceInfo {
            fps: mean_rate(&times_s),
            frame_count: Some(times_s.len() as u64),
            pixel_aspect: not_square(decoder.pixel_aspect()),
            ..SourceInfo::new(name, decoder.size(), "H.264 in MP4 (built in)")
        };
        let mut source = Self {
            input,
            samples: track.samples,
            ranks,
            times_s,
            decoder,
            info,
            next_sample: 0,
            next_rank: 0,
            waiting: BTreeMap::new(),
            pictures: 0,
            skipped: 0,
            may_enter: true,
            fault: None,
            flaw,
            buffer,
        };
        source.fill();
        while source.pictures == 0 && source.decode_next() {}
        match source.fault.take() {
            Some((_, fault)) if source.pictures == 0 => Err(fault),
            None if source.pictures == 0 => Err(source.first_damage()),
            fault => {
                source.fault = fault;
                Ok(source)
            }
        }
    }

    fn first_damage(self) -> Fault {
        let damage = self.waiting.into_values().find_map(|slot| match slot {
            Slot::Damaged(fault) => Some(fault),
            _ => None,
        });
        damage.unwrap_or_else(|| Fault::malformed("its video track has no pictures"))
    }

    /// The next frame, or why it cannot be had.
    pub fn next(&mut self) -> Result<Option<Frame>, Trouble> {
        loop {
            self.fill();
            // After a fault the pictures behind the gap are still good.
            let Some((rank, slot)) = self.waiting.pop_first() else {
                let missing = self.flaw.take().map(|flaw| (self.next_rank, Fault::malformed(flaw)));
                let fault = self.fault.take().or(missing);
                return fault.map_or(Ok(None), |(rank, fault)| {
                    Err(Trouble::end(u64::from(rank.saturating_sub(self.skipped)), fault))
                });
            };
            self.next_rank = rank + 1;
            let index = u64::from(rank.saturating_sub(self.skipped));
            let picture = match slot {
                Slot::Picture(picture) => picture,
                Slot::Damaged(fault) => return Err(Trouble::damage(index, fault)),
                Slot::Orphan => continue,
                Slot::Empty => {
                    self.skipped += 1;
                    continue;
                }
            };
            self.pictures -= 1;
            let time_s = self.times_s.get(rank as usize).copied().unwrap_or_default();
            return Ok(Some(Frame::new(index, time_s, picture)));
        }
    }

    /// Decodes until the next picture to show is there, or nothing more can be had.
    fn fill(&mut self) {
        while !self.waiting.contains_key(&self.next_rank) && self.decode_next() {}
    }

    /// Decodes a sample; false when nothing more can be had.
    fn decode_next(&mut self) -> bool {
        let Some(sample) = self.samples.get(self.next_sample).copied() else {
            return false;
        };
        let rank = self.rank();
        self.next_sample += 1;
        let read = read_sample(&mut self.input, &sample, &mut self.buffer).and_then(|()| self.check_waiting());
        let slot = match read.map(|()| self.decoder.decode(&self.buffer)) {
            Ok(Ok(Some(picture))) => Slot::Picture(picture),
            Ok(Ok(None)) => Slot::Empty,
            Ok(Err(fault @ Fault::Malformed(_))) => {
                match self.next_entry() {
                    Some(entry) => self.go_to(entry),
                    None => self.go_on_without(&sample),
                }
                Slot::Damaged(fault)
            }
            // What cannot be read, or not be decoded here, cannot be later.
            Ok(Err(fault)) | Err(fault) => {
                self.fault = Some((rank.unwrap_or(self.next_rank), fault));
                self.next_sample = self.samples.len();
                return false;
            }
        };
        self.wait(rank, slot);
        true
    }

    /// The place in display order of the sample that comes next.
    fn rank(&self) -> Option<u32> {
        self.ranks.get(self.next_sample).copied().flatten()
    }

    fn wait(&mut self, rank: Option<u32>, slot: Slot) {
        if let Some(rank) = rank {
            self.pictures += usize::from(matches!(slot, Slot::Picture(_)));
            self.waiting.insert(rank, slot);
        }
    }

    /// Leaves out samples up to one that can be decoded without those before it.
    fn go_to(&mut self, entry: usize) {
        while self.next_sample < entry {
            self.wait(self.rank(), Slot::Orphan);
            self.next_sample += 1;
        }
        self.decoder.restart();
    }

    /// Goes on behind a sample that could not be decoded.
    fn go_on_without(&mut self, damaged: &Sample) {
        self.may_enter = false;
        if read_sample(&mut self.input, damaged, &mut self.buffer).is_ok() {
            self.decoder.stand_in(&self.buffer);
        }
    }

    /// The next sample that needs none before it; `None` where none comes that can be read.
    fn next_entry(&mut self) -> Option<usize> {
        if !self.may_enter {
            return None;
        }
        for at in self.next_sample..self.samples.len() {
            read_sample(&mut self.input, self.samples.get(at)?, &mut self.buffer).ok()?;
            if self.decoder.is_entry(&self.buffer) {
                return Some(at);
            }
        }
        None
    }

    fn check_waiting(&self) -> Result<(), Fault> {
        if self.pictures <= self.decoder.max_waiting() {
            return Ok(());
        }
        Err(Fault::malformed("its index puts frames in an order no H.264 stream can have"))
    }
}

impl Source for Mp4Source {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        self.next().map_err(|trouble| trouble.error(&self.info.name))
    }
}

fn read_sample(input: &mut RandomAccess, sample: &Sample, buffer: &mut Vec<u8>) -> Result<(), Fault> {
    if u64::from(sample.size) > MAX_SAMPLE_BYTES {
        return Err(Fault::malformed(format!("a frame of {} bytes cannot be right", sample.size)));
    }
    Ok(input.read_at(sample.offset, sample.size.into(), buffer)?)
}

/// For every sample its place in display order, and the times in that order, in seconds from the first.
fn display_order(
    samples: &[Sample],
    shown_at: impl Fn(i64) -> Option<i64>,
    time_scale: u32,
) -> (Vec<Option<u32>>, Vec<f64>) {
    let mut shown: Vec<(i64, u32)> =
        (0u32..).zip(samples).filter_map(|(i, s)| Some((shown_at(s.composition_time)?, i))).collect();
    shown.sort_unstable();
    let first = shown.first().map_or(0, |s| s.0);
    let mut ranks = vec![None; samples.len()];
    let mut times_s = Vec::with_capacity(shown.len());
    for (rank, (time, sample)) in (0u32..).zip(shown) {
        if let Some(slot) = ranks.get_mut(sample as usize) {
            *slot = Some(rank);
        }
        times_s.push(time.saturating_sub(first) as f64 / f64::from(time_scale));
    }
    (ranks, times_s)
}

/// Frames per second over the whole clip.
fn mean_rate(times_s: &[f64]) -> Option<f64> {
    let span = times_s.last()? - times_s.first()?;
    (span > 0.0).then(|| (times_s.len() - 1) as f64 / span)
}
