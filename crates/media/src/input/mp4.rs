use super::fault::Fault;
use super::h264::PictureDecoder;
use super::limits::MAX_SAMPLE_BYTES;
use super::orientation::Orientation;
use crate::{Result, Source, SourceInfo};
use pursuit_containers::bytes::{RandomAccess, ReadSeek};
use pursuit_containers::mp4::{Codec, Movie, Sample};
use pursuit_imaging::{Frame, Yuv420};
use std::collections::BTreeMap;

/// H.264 in MP4 or QuickTime, decoded here.
///
/// Samples are decoded in file order and shown in the order of their composition times; times are those of the file, with
/// edits applied and the first shown frame at 0. After a damaged sample nothing more is decoded; the pictures that wait
/// are still delivered, then the damage is reported.
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
    /// Pictures that wait for their turn; `None` for samples that turned out to hold none.
    waiting: BTreeMap<u32, Option<Yuv420>>,
    /// Samples without pictures shown so far: they take no frame number.
    skipped: u32,
    fault: Option<(u32, Fault)>,
    /// Whether frames are missing after the last that the index knows.
    ends_early: bool,
    buffer: Vec<u8>,
}

impl Mp4Source {
    /// Reads the index and decodes as far as the first picture, so that what cannot be decoded is known at once.
    pub fn new(reader: Box<dyn ReadSeek>, name: &str) -> Result<Self, Fault> {
        let Movie { mut input, track, ends_early } = Movie::read(RandomAccess::new(reader)?)?;
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
            name: name.to_owned(),
            size: decoder.size(),
            fps: mean_rate(&times_s),
            frame_count: Some(times_s.len() as u64),
            live: false,
            decoder: "H.264 in MP4 (built in)".to_owned(),
            truth: None,
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
            skipped: 0,
            fault: None,
            ends_early,
            buffer,
        };
        source.fill();
        match source.fault.take() {
            Some((_, fault)) if source.waiting.is_empty() => Err(fault),
            fault => {
                source.fault = fault;
                Ok(source)
            }
        }
    }

    /// The next frame, or what stopped us and at which frame.
    pub fn next(&mut self) -> Result<Option<Frame>, (u64, Fault)> {
        loop {
            self.fill();
            // After a fault the pictures behind the gap are still good.
            let Some((rank, picture)) = self.waiting.pop_first() else {
                let missing = std::mem::take(&mut self.ends_early).then(|| {
                    (self.next_rank, Fault::malformed("the file ends early; it may not have been copied to its end"))
                });
                let fault = self.fault.take().or(missing);
                return fault
                    .map_or(Ok(None), |(rank, fault)| Err((u64::from(rank.saturating_sub(self.skipped)), fault)));
            };
            self.next_rank = rank + 1;
            let Some(picture) = picture else {
                self.skipped += 1;
                continue;
            };
            let index = u64::from(rank.saturating_sub(self.skipped));
            let time_s = self.times_s.get(rank as usize).copied().unwrap_or_default();
            return Ok(Some(Frame::new(index, time_s, picture)));
        }
    }

    /// Decodes until the next picture to show is there, or nothing more can be had.
    fn fill(&mut self) {
        while !self.waiting.contains_key(&self.next_rank)
            && self.fault.is_none()
            && let Some(sample) = self.samples.get(self.next_sample).copied()
        {
            let rank = self.ranks.get(self.next_sample).copied().flatten();
            self.next_sample += 1;
            let picture = read_sample(&mut self.input, &sample, &mut self.buffer)
                .and_then(|()| self.decoder.decode(&self.buffer))
                .and_then(|picture| self.check_waiting().map(|()| picture));
            match (picture, rank) {
                (Ok(picture), Some(rank)) => _ = self.waiting.insert(rank, picture),
                (Ok(_), None) => {}
                (Err(fault), rank) => {
                    // Later samples are never reached again, whatever they are.
                    self.next_sample = self.samples.len();
                    self.fault = Some((rank.unwrap_or(self.next_rank), fault));
                }
            }
        }
    }

    fn check_waiting(&self) -> Result<(), Fault> {
        if self.waiting.len() <= self.decoder.max_waiting() {
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
        self.next().map_err(|(frame, fault)| fault.broken(&self.info.name, frame))
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
