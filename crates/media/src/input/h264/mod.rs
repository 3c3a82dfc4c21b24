//! H.264 in MP4, decoded here: what a stream says about itself, pictures in display order.

mod bits;
mod pictures;
mod sequence;
mod source;
mod units;

pub(crate) use source::Mp4Source;
