//! ONVIF cameras, Profiles S and T: moves, presets, stop and status of the PTZ service, over HTTP and HTTPS.
//!
//! The user is proved by a WS-UsernameToken digest, dated by the camera's own clock, and by HTTP digest where the camera
//! asks for it; a password never crosses the network. Answers are read up to a size, within a time, and to a depth; what
//! they say of addresses other than the camera's own is not followed.

mod client;
mod clock;
mod discovery;
mod head;
mod messages;
mod spaces;
#[cfg(feature = "onvif-tls")]
mod tls;
mod token;
mod xml;

pub use client::Login;
pub use head::{Onvif, OnvifParams};
pub use spaces::{Range, Space, Spaces};
#[cfg(feature = "onvif-tls")]
pub use tls::shown_certificate;
pub use xml::{Element, parse_answer};
