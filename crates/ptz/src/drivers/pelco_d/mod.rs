//! Pelco-D on a serial line: seven bytes a command, no answer to most of them.
//!
//! After the published protocol tables ("Pelco-D Protocol Command List" of many cameras' manuals): `FF`, the address, two
//! command bytes, two data bytes, and the sum of the five bytes before modulo 256.

mod frame;
mod head;

pub use frame::{Frame, Reply, parse_replies};
pub use head::{PelcoD, PelcoDParams};
