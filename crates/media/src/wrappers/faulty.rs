use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::{ColorRange, Frame, ImageView, Pixels, Yuv420};
use std::time::Duration;

/// What a [`Faulty`] source does wrong. All chances are per frame, between 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// The same seed spoils the same frames.
    pub seed: u64,
    /// Chance that a frame is left out.
    pub drop: f64,
    /// Chance that a frame is black.
    pub black: f64,
    /// Chance that a band of a frame is noise.
    pub corrupt: f64,
    /// Chance that a frame comes late.
    pub stall: f64,
    /// How late.
    pub stall_time: Duration,
    /// The frame number at which the source breaks off.
    pub fail_at: Option<u64>,
}

/// Spoils a source on purpose, the same way every time: for tests of what stands behind it.
pub struct Faulty<S> {
    source: S,
    faults: Faults,
    failed: bool,
}

impl<S: Source> Faulty<S> {
    /// Spoils `source` by `faults`.
    pub fn new(source: S, faults: Faults) -> Self {
        Self { source, faults, failed: false }
    }

    /// Whether the kind of fault numbered `kind` befalls frame `index`.
    fn befalls(&self, chance: f64, kind: u64, index: u64) -> bool {
        let uniform = (mixed(self.faults.seed, kind, index) >> 11) as f64 / (1u64 << 53) as f64;
        uniform < chance
    }
}

impl<S: Source> Source for Faulty<S> {
    fn info(&self) -> &SourceInfo {
        self.source.info()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let faults = self.faults;
        while !self.failed
            && let Some(frame) = self.source.next_frame()?
        {
            let index = frame.index();
            if faults.fail_at.is_some_and(|n| index >= n) {
                self.failed = true;
                return Err(MediaError::broken(&self.info().name, index, "it was told to break here"));
            }
            if self.befalls(faults.stall, 1, index) {
                std::thread::sleep(faults.stall_time);
            }
            if self.befalls(faults.drop, 2, index) {
                continue;
            }
            let black = self.befalls(faults.black, 3, index);
            let corrupt = self.befalls(faults.corrupt, 4, index);
            let seed = mixed(faults.seed, 5, index);
            return Ok(Some(match (black, corrupt) {
                (true, _) => spoiled(&frame, |plane, level| plane.fill(level)),
                (false, true) => spoiled(&frame, |plane, _| noise_band(plane, seed)),
                (false, false) => frame,
            }));
        }
        Ok(None)
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.source.seek(index)?;
        self.failed = false;
        Ok(())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}

/// The frame with every plane passed to `spoil`, along with the plane's code for black.
fn spoiled(frame: &Frame, spoil: impl Fn(&mut [u8], u8)) -> Frame {
    let changed = |image: ImageView<'_, u8>, black: u8| {
        let mut image = image.to_image();
        spoil(image.as_mut_slice(), black);
        image
    };
    let pixels = match frame.pixels() {
        Pixels::Gray8(image) => changed(image.view(), 0).into(),
        Pixels::Gray16(image) => {
            let mut image = image.to_image();
            let mut bytes: Vec<u8> = image.as_slice().iter().flat_map(|v| v.to_le_bytes()).collect();
            spoil(&mut bytes, 0);
            let values = bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_le_bytes(b));
            image.as_mut_slice().iter_mut().zip(values).for_each(|(to, value)| *to = value);
            image.into()
        }
        Pixels::Rgb8(image) => {
            let mut image = image.to_image();
            spoil(image.as_mut_slice().as_flattened_mut(), 0);
            image.into()
        }
        Pixels::Yuv420(planes) => {
            let black = if planes.range() == ColorRange::Limited { 16 } else { 0 };
            let (u, v) = planes.chroma();
            let [y, u, v] = [(planes.luma(), black), (u, 128), (v, 128)].map(|(view, black)| changed(view, black));
            match Yuv420::new(y, u, v, planes.matrix(), planes.range()) {
                Ok(planes) => Pixels::Yuv420(planes),
                Err(_) => return frame.clone(), // cannot be: the planes keep their sizes
            }
        }
    };
    // The size is the frame's own, so the depth still fits.
    frame.with_pixels(pixels).unwrap_or_else(|_| frame.clone())
}

/// Overwrites the middle third.
fn noise_band(plane: &mut [u8], seed: u64) {
    let third = plane.len() / 3;
    for (i, value) in plane.iter_mut().enumerate().skip(third).take(third) {
        *value = mixed(seed, 0, i as u64) as u8;
    }
}

/// A 64-bit hash of three numbers (the finaliser of SplitMix64, Steele et al. 2014).
fn mixed(seed: u64, kind: u64, index: u64) -> u64 {
    let mut z = seed ^ kind.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ index.wrapping_mul(0xD1B5_4A32_D192_ED03);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
