//! A limit on memory (`ulimit -v`) that is too low is an error before anything is done: in the middle, an allocation that
//! fails ends the program without a word on what to do.

use pursuit::RunError;

/// What the program, its threads and their stacks take of the address space, most of it never touched, in bytes.
const PROGRAM: u64 = 448 << 20;
/// What a run takes for each pixel of a frame: frames decoded ahead, pictures derived from them, the video's.
#[cfg(unix)]
const A_PIXEL: u64 = 48;

/// Refuses to look at frames of this many pixels where the limit on the address space is too low for them.
///
/// # Errors
/// [`RunError::Usage`] with the limit, what is needed, and what would help.
#[cfg(unix)]
pub fn check(pixels: usize) -> Result<(), RunError> {
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
    let needed = PROGRAM.saturating_add(A_PIXEL.saturating_mul(pixels as u64));
    match limit {
        Some(limit) if limit < needed => Err(RunError::usage(format!(
            "the limit on memory (ulimit -v) is {} MB, and this needs an address space of {} MB; raise it{}",
            limit >> 20,
            needed >> 20,
            if pixels > 0 { ", or look at smaller pictures (`--resize`)" } else { "" }
        ))),
        _ => Ok(()),
    }
}

/// Elsewhere there is no such limit.
#[cfg(not(unix))]
pub fn check(_: usize) -> Result<(), RunError> {
    let _ = PROGRAM;
    Ok(())
}
