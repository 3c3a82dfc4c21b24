use super::sequence::{MAX_BUFFERED_MACROBLOCKS, Sequence};
use super::stand_in::{Place, stand_in};
use super::units::{self, push_with_start_code};
use crate::input::color::ColorInfo;
use crate::input::fault::Fault;
use crate::input::orientation::Orientation;
use pursuit_containers::mp4::AvcConfig;
use pursuit_geometry::Size;
use pursuit_imaging::{ColorMatrix, ColorRange, Image, Yuv420};
use rusty_h264_decoder::{DecodeError, Decoder};

/// What follows a slice that is coded arithmetically: a sound one is over before (its decoder reads zeros beyond its end,
/// and they say that more comes). To a decoder that a wrong bit has led astray, ones say that the slice ends here (ITU-T
/// H.264 §9.3.3.2.2.3), so that a part of its picture is missing, and that is noticed.
const BEYOND: [u8; 32] = [0xFF; 32];

/// Decodes samples of an MP4 track to pictures, turned and cropped, in decoding order.
pub(crate) struct PictureDecoder {
    decoder: Decoder,
    config: AvcConfig,
    orientation: Orientation,
    sequence: Sequence,
    matrix: ColorMatrix,
    range: ColorRange,
    started: bool,
    /// Whether the picture before was left unfinished.
    is_torn: bool,
    /// The place of the last picture that others refer to.
    place: Option<Place>,
    /// Whether all pictures are coded arithmetically.
    arithmetic: bool,
    /// The sample with start codes, reused from picture to picture.
    stream: Vec<u8>,
}

impl PictureDecoder {
    /// `first_sample` is looked at only when the container has no parameter sets of its own.
    pub fn new(config: AvcConfig, orientation: Orientation, first_sample: &[u8]) -> Result<Self, Fault> {
        let in_band = || units::units(first_sample, config.length_bytes).find(|u| is_sequence(u));
        let unit = config.sps.first().map(Vec::as_slice).or_else(in_band);
        let unit = unit.ok_or_else(|| Fault::malformed("the MP4 has no H.264 parameters (SPS)"))?;
        let sequence = Sequence::read(unit)?;
        // What the stream says goes before what the container says, as in other decoders.
        let (matrix, range) = sequence.color.or(ColorInfo::of_tags(config.color)).resolve(sequence.size);
        let in_band = units::units(first_sample, config.length_bytes);
        let arithmetic = arithmetic(config.pps.iter().map(Vec::as_slice).chain(in_band));
        let (decoder, stream) = (Decoder::new(), Vec::new());
        let arithmetic = arithmetic == Some(true);
        Ok(Self {
            decoder,
            config,
            orientation,
            sequence,
            matrix,
            range,
            started: false,
            is_torn: false,
            place: None,
            arithmetic,
            stream,
        })
    }

    /// Width and height of every picture.
    pub const fn size(&self) -> Size {
        self.orientation.turned_size(self.sequence.size)
    }

    /// Width against height of a pixel as it is shown, where the stream or the container says so.
    pub fn pixel_aspect(&self) -> Option<(u32, u32)> {
        let (width, height) = self.sequence.pixel_aspect.or(self.config.pixel_aspect)?;
        let turned = self.orientation.turned_size(Size::new(1, 2)) != Size::new(1, 2);
        Some(if turned { (height, width) } else { (width, height) })
    }

    /// Forgets every picture, to go on with the next one that needs none.
    pub fn restart(&mut self) {
        (self.decoder, self.started, self.is_torn, self.place) = (Decoder::new(), false, false, None);
    }

    /// Puts the picture before in the place of a damaged one, for those that refer to it. Nothing is done before the first
    /// picture, and for one that none refers to.
    pub fn stand_in(&mut self, sample: &[u8]) {
        let Some(before) = self.place else { return };
        let first = units::units(sample, self.config.length_bytes).find(|unit| units::is_slice(unit));
        let place = Place::of_damaged(first, before, &self.sequence);
        let Some(stream) = stand_in(place, &self.sequence).filter(|_| place.is_reference) else { return };
        // The first call may but end what was left unfinished.
        if self.decoder.decode(&stream).is_ok() || self.decoder.decode(&stream).is_ok() {
            (self.is_torn, self.place) = (false, Some(place));
        }
    }

    /// Whether a sample begins afresh: its pictures need none before them.
    pub fn is_entry(&self, sample: &[u8]) -> bool {
        units::units(sample, self.config.length_bytes).any(|unit| units::kind(unit) == units::REFRESH_SLICE)
    }

    /// How many pictures may wait for their turn: sixteen (ITU-T H.264 §A.3.1), fewer when they are very large.
    pub fn max_waiting(&self) -> usize {
        (MAX_BUFFERED_MACROBLOCKS / self.sequence.macroblocks.max(1)).clamp(2, 16)
    }

    /// The picture of a sample; `None` when the sample holds none.
    pub fn decode(&mut self, sample: &[u8]) -> Result<Option<Yuv420>, Fault> {
        if !units::are_whole(sample, self.config.length_bytes) {
            return Err(Fault::malformed("the picture is damaged (its parts do not fit together)"));
        }
        self.stream.clear();
        if !self.started {
            let sets = self.config.sps.iter().chain(&self.config.pps);
            sets.for_each(|set| push_with_start_code(set, &mut self.stream));
        }
        let mut has_picture = false;
        for unit in units::units(sample, self.config.length_bytes) {
            if is_sequence(unit) {
                self.check_sequence(unit)?;
            }
            self.arithmetic &= units::is_arithmetic(unit).unwrap_or(true);
            push_with_start_code(unit, &mut self.stream);
            if units::is_slice(unit) {
                has_picture = true;
                self.stream.extend_from_slice(if self.arithmetic { &BEYOND } else { &[] });
            }
        }
        // A picture that follows an unfinished one is refused, once.
        let first = self.decoder.decode(&self.stream);
        let picture = if self.is_torn && first.is_err() { self.decoder.decode(&self.stream) } else { first };
        self.is_torn = !matches!(picture, Ok(Some(_)));
        let picture = picture.map_err(fault)?;
        self.started = true;
        let first = units::units(sample, self.config.length_bytes).find_map(|unit| Place::read(unit, &self.sequence));
        self.place = first.filter(|place| place.is_reference).or(self.place);
        match picture {
            Some(p) => self.finish((p.width, p.height), p.y, [p.u, p.v]).map(Some),
            None if has_picture => Err(Fault::malformed("a part of the picture is missing")),
            None => Ok(None),
        }
    }

    /// New parameters on the way are fine as long as the picture keeps its size.
    fn check_sequence(&self, unit: &[u8]) -> Result<(), Fault> {
        let sequence = Sequence::read(unit)?;
        if (sequence.size, sequence.crop_origin) == (self.sequence.size, self.sequence.crop_origin) {
            return Ok(());
        }
        let reason =
            format!("the picture changes from {} to {}; cut the file there", self.sequence.size, sequence.size);
        Err(Fault::malformed(reason))
    }

    /// Cuts off what the decoder left on the left and top, and turns the planes.
    fn finish(&self, decoded: (usize, usize), luma: Vec<u8>, [u, v]: [Vec<u8>; 2]) -> Result<Yuv420, Fault> {
        let (left, top) = self.sequence.crop_origin;
        let Size { width, height } = self.sequence.size;
        if decoded != (width + left, height + top) {
            let reason = format!("a picture is {}x{} instead of {width}x{height}", decoded.0, decoded.1);
            return Err(Fault::malformed(reason));
        }
        let plane = |data: Vec<u8>, scale: usize| -> Result<Image<u8>, Fault> {
            let whole = Image::from_vec(data, decoded.0 / scale, decoded.1 / scale)?;
            let cut = if (left, top) == (0, 0) {
                whole
            } else {
                let part = whole.view().crop(left / scale, top / scale, width / scale, height / scale);
                part.ok_or_else(|| Fault::malformed("its H.264 picture is cropped to nothing"))?.to_image()
            };
            Ok(self.orientation.apply(cut)?)
        };
        let (y, u, v) = (plane(luma, 1)?, plane(u, 2)?, plane(v, 2)?);
        Ok(Yuv420::new(y, u, v, self.matrix, self.range)?)
    }
}

/// Whether all picture parameters among these units say that pictures are coded arithmetically; `None` without any.
fn arithmetic<'a>(units: impl Iterator<Item = &'a [u8]>) -> Option<bool> {
    units.filter_map(units::is_arithmetic).reduce(|a, b| a && b)
}

fn is_sequence(unit: &[u8]) -> bool {
    units::kind(unit) == units::SEQUENCE_PARAMETERS
}

fn fault(error: DecodeError) -> Fault {
    match error {
        DecodeError::Unsupported(what) => Fault::unsupported(format!("H.264 with {what}")),
        other => Fault::malformed(format!("the picture is damaged ({other})")),
    }
}
