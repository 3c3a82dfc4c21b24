use crate::Result;
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Rgb8};

/// Encodes pictures one after the other for somebody who watches now: every call returns its picture, nothing is held back.
pub trait WireEncoder: Send {
    /// Encodes `image`, which has the size that the encoder was made for. Decoding can begin with it if `keyframe` is asked
    /// for; of the first picture, always.
    ///
    /// # Errors
    /// [`MediaError::Unwritable`](crate::MediaError::Unwritable) for a picture of another size, or one that cannot be encoded.
    fn encode(&mut self, image: ImageView<'_, Rgb8>, keyframe: bool) -> Result<WirePicture>;
}

/// One encoded picture.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WirePicture {
    /// H.264 in the byte stream format (Annex B); a key frame brings its parameter sets.
    pub data: Vec<u8>,
    /// Whether decoding can begin here.
    pub keyframe: bool,
    /// Of a key frame, what it takes to decode, as browsers want it said (RFC 6381: `avc1.42C01F`).
    pub codec: Option<String>,
}

/// An H.264 encoder for pictures of `size`, for about `nominal_fps` pictures a second; those with odd sides are widened by
/// one pixel, and none is smaller than 16 × 16.
///
/// # Errors
/// [`MediaError::Unwritable`](crate::MediaError::Unwritable) when the size is beyond the encoder's, or this build has none.
pub fn h264_for_wire(size: Size, nominal_fps: f64) -> Result<Box<dyn WireEncoder>> {
    #[cfg(feature = "encode")]
    return Ok(Box::new(annex_b::AnnexB::new(size, nominal_fps)?));
    #[cfg(not(feature = "encode"))]
    return Err(unwritable(format!(
        "this build has no video encoder for {size} at {nominal_fps} pictures a second; build with `--features encode` (needs a C++ compiler)"
    )));
}

fn unwritable(reason: String) -> crate::MediaError {
    crate::MediaError::Unwritable { name: "a live picture".to_owned(), reason }
}

#[cfg(feature = "encode")]
mod annex_b {
    use super::super::h264::H264Encoder;
    use super::super::i420::I420;
    use super::super::video::VideoOptions;
    use super::{WireEncoder, WirePicture, unwritable};
    use crate::Result;
    use pursuit_geometry::Size;
    use pursuit_imaging::{ImageView, Rgb8};

    pub(super) struct AnnexB {
        size: Size,
        encoder: H264Encoder,
        planes: I420,
    }

    impl AnnexB {
        pub(super) fn new(size: Size, nominal_fps: f64) -> Result<Self> {
            let (width, height) = I420::padded(size.width, size.height);
            let options = VideoOptions { nominal_fps, ..VideoOptions::default() };
            let encoder = H264Encoder::new(width, height, &options).map_err(unwritable)?;
            Ok(Self { size, encoder, planes: I420::default() })
        }
    }

    impl WireEncoder for AnnexB {
        fn encode(&mut self, image: ImageView<'_, Rgb8>, keyframe: bool) -> Result<WirePicture> {
            if image.size() != self.size {
                let (given, own) = (image.size(), self.size);
                return Err(unwritable(format!("the frame size changed from {own} to {given}; begin a new encoder")));
            }
            self.planes.fill_from(image);
            let mut picture = WirePicture::default();
            let each = |unit: &[u8]| {
                // H.264 table 7-1: type 7 is a sequence parameter set, which begins with profile, constraints and level.
                if let [first, profile, constraints, level, ..] = *unit
                    && first & 31 == 7
                {
                    picture.codec = Some(format!("avc1.{profile:02X}{constraints:02X}{level:02X}"));
                }
                picture.data.extend_from_slice(&[0, 0, 0, 1]);
                picture.data.extend_from_slice(unit);
            };
            picture.keyframe = self.encoder.units(&self.planes, keyframe, each).map_err(unwritable)?;
            if picture.data.is_empty() {
                return Err(unwritable("the encoder returned no data for a picture".to_owned()));
            }
            Ok(picture)
        }
    }
}
