use super::i420::I420;
use super::video::VideoOptions;
use openh264::OpenH264API;
use openh264::encoder::{
    Complexity, Encoder, EncoderConfig, FrameRate, FrameType, RateControlMode, UsageType, VuiConfig,
};
use openh264::formats::YUVSource;
use pursuit_containers::mp4::EncodedSample;

/// The greatest picture of H.264 level 5.2 that this encoder takes, either way up.
const LONGEST_SIDE: usize = 3840;
const SHORTEST_SIDE: usize = 2160;

/// An H.264 encoder whose every call returns that picture's data: no reordering, no look-ahead.
pub(super) struct H264Encoder {
    encoder: Encoder,
}

impl H264Encoder {
    /// An encoder for pictures of the given (padded) size.
    ///
    /// # Errors
    /// In words, when the size is beyond the encoder's.
    pub(super) fn new(width: usize, height: usize, options: &VideoOptions) -> Result<Self, String> {
        if width.max(height) > LONGEST_SIDE || width.min(height) > SHORTEST_SIDE {
            return Err(format!(
                "frames of {width}x{height} are larger than the encoder's {LONGEST_SIDE}x{SHORTEST_SIDE}; go without a video, or scale the input down"
            ));
        }
        let config = EncoderConfig::new()
            .max_frame_rate(FrameRate::from_hz(options.sane_fps() as f32))
            .usage_type(UsageType::CameraVideoRealTime)
            // A constant quantiser (26, the library's): small text stays readable whatever moves behind it, every frame
            // appears, and no bits are spent on the sensor's noise. On the table-tennis scene 0.17 Mbit/s and 38.7 dB,
            // where a rate of 1 Mbit/s buys 39.1 dB.
            .rate_control_mode(RateControlMode::Off)
            .skip_frames(false)
            // On three clips .07 dB and 3 % of the bytes from Medium at the same quantiser, for 6 % less of a 4K run.
            .complexity(Complexity::Low)
            .vui(VuiConfig::bt709())
            // More threads would cut the picture into as many slices: other bytes on other machines.
            .num_threads(1);
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config).map_err(|e| e.to_string())?;
        Ok(Self { encoder })
    }

    /// Encodes one picture into `out`, from which decoding can begin if `keyframe` is asked for.
    ///
    /// # Errors
    /// What the encoder says, in words.
    pub(super) fn encode(&mut self, picture: &I420, keyframe: bool, out: &mut EncodedSample) -> Result<(), String> {
        out.data.clear();
        let (mut sequence, mut pictures) = (None, None);
        out.keyframe = self.units(picture, keyframe, |unit| {
            // H.264 table 7-1: the lower five bits of a unit's first byte are its type.
            match unit.first().map_or(0, |b| b & 31) {
                7 => sequence = Some(unit.to_vec()),
                8 => pictures = Some(unit.to_vec()),
                _ => {
                    out.data.extend_from_slice(&(unit.len() as u32).to_be_bytes());
                    out.data.extend_from_slice(unit);
                }
            }
        })?;
        out.parameter_sets = sequence.zip(pictures);
        if out.data.is_empty() { Err("the encoder returned no data for a frame".to_owned()) } else { Ok(()) }
    }

    /// Encodes one picture and hands out its units, without start codes; whether decoding can begin with it.
    ///
    /// # Errors
    /// What the encoder says, in words.
    pub(super) fn units(
        &mut self,
        picture: &I420,
        keyframe: bool,
        mut each: impl FnMut(&[u8]),
    ) -> Result<bool, String> {
        if keyframe {
            self.encoder.force_intra_frame();
        }
        let stream = self.encoder.encode(picture).map_err(|e| e.to_string())?;
        for layer in (0..stream.num_layers()).filter_map(|l| stream.layer(l)) {
            (0..layer.nal_count()).filter_map(|n| layer.nal_unit(n)).for_each(|unit| each(without_start_code(unit)));
        }
        Ok(matches!(stream.frame_type(), FrameType::IDR))
    }
}

/// Annex B: zeros, then a one, then the unit.
fn without_start_code(unit: &[u8]) -> &[u8] {
    let zeros = unit.iter().take_while(|b| **b == 0).count();
    if zeros >= 2 && unit.get(zeros) == Some(&1) { &unit[zeros + 1..] } else { unit }
}

impl YUVSource for I420 {
    fn dimensions(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn strides(&self) -> (usize, usize, usize) {
        (self.width, self.width / 2, self.width / 2)
    }

    fn y(&self) -> &[u8] {
        &self.y
    }

    fn u(&self) -> &[u8] {
        &self.u
    }

    fn v(&self) -> &[u8] {
        &self.v
    }
}
