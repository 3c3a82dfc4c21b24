//! VISCA: over IP by UDP (with the sequence header) or TCP (bare), or on a serial line.
//!
//! After the published command lists of several makers' cameras. A command is `8x … FF`; the camera answers `y0 4z FF` when
//! it takes it and `y0 5z FF` when it has carried it out, or `y0 6z ee FF` when it does not.

mod frame;
mod head;
mod link;

pub use frame::{Reply, Splitter, parse_reply};
pub use head::{SpeedSteps, Visca, ViscaParams};
pub use link::{Link, StreamLink, UdpLink, connect_tcp, connect_udp};
