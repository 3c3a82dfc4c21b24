//! Everything that is not decoded here: an `ffmpeg` process that writes Y4M to a pipe.
//!
//! The process is started with an argument vector, never through a shell, and killed when the source is dropped. Its
//! messages come over standard error and end up in our errors.
//!
//! # Times
//! Y4M carries no times, so they are taken from ffmpeg's `showinfo` filter, whose lines arrive on standard error before
//! the frame they belong to; frames are passed through one by one (`-fps_mode passthrough`), so that variable frame rates
//! stay variable. The first frame is at 0. Where ffmpeg itself knows no time for a frame, that frame is put one nominal
//! frame after the one before it.

mod command;
mod log;
mod source;

pub(crate) use command::Target;
pub(crate) use source::FfmpegSource;
