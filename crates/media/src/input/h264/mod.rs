//! H.264, decoded here: what a stream says about itself, and pictures in decoding order.

mod bits;
mod pictures;
mod sequence;
mod stand_in;
mod units;

pub(crate) use pictures::PictureDecoder;
