#[cfg(feature = "mcap")]
mod cdr;
#[cfg(feature = "mcap")]
mod sink;

#[cfg(feature = "mcap")]
pub use sink::McapSink;

use super::format::{Declared, Format, Kind};

pub(super) const FORMAT: Format = Format(&Declared {
    name: "mcap",
    summary: "Detections of ROS 2 (vision_msgs) in an MCAP file",
    file_name: "trajectory.mcap",
    media_type: "application/octet-stream",
    #[cfg(feature = "mcap")]
    kind: Kind::File(|path| Ok(Box::new(McapSink::create(path)?))),
    #[cfg(not(feature = "mcap"))]
    kind: Kind::Missing("this build cannot write MCAP; build with `--features mcap`"),
});
