//! Where frames come from and where they go to: image folders, video files, cameras and streams on the way in
//! ([`input`]), depth beside the picture ([`depth`]), wrappers that pace, cut, retime, record or spoil them ([`wrappers`]), encoders and drawing on the way
//! out ([`output`]).

pub mod depth;
mod error;
#[doc(hidden)]
pub mod fuzz_entry;
pub mod input;
pub mod output;
pub mod wrappers;

pub use error::MediaError;
pub use input::{Locator, OpenOptions, Source, SourceInfo, StopHandle, Truth, View, open, open_with_depth, with_depth};

/// The result of a fallible media operation.
pub type Result<T, E = MediaError> = std::result::Result<T, E>;
