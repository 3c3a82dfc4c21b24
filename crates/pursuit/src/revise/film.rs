use super::{Input, Row};
use crate::RunError;
use crate::sinks::{Moment, OverlayStyle, overlay};
use std::path::Path;
use std::sync::Arc;

/// Reads an input once more and writes it as a video with what these rows say drawn in, as a run writes its overlay: the part of the input
/// that the rows are about. `stopped` is asked before every frame; what was written up to then is a whole video.
///
/// # Errors
/// An input that cannot be read again, a file that cannot be written, a build without an encoder.
pub fn film(input: &Input, rows: &[Arc<Row>], path: &Path, stopped: impl Fn() -> bool) -> Result<(), RunError> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Err(RunError::usage("nothing was followed yet; there is nothing to make a video of"));
    };
    let (mut source, info) = input.open(first.frame)?;
    if info.live {
        return Err(RunError::usage("what a live source has shown does not come again; there is no video of it"));
    }
    let sink = overlay(path, &info, Some(true), OverlayStyle::default())?;
    let mut sink = sink.unwrap_or_else(crate::sinks::nothing);
    let mut rows = rows.iter().peekable();
    while !stopped() {
        let frame = match source.next_frame() {
            Ok(Some(frame)) if frame.index() <= last.frame => frame,
            Ok(_) => break,
            Err(e) if e.is_damage() => continue,
            Err(e) => return Err(e.into()),
        };
        while rows.next_if(|row| row.frame < frame.index()).is_some() {}
        let records = rows.peek().filter(|row| row.frame == frame.index()).map_or(&[][..], |row| &row.records);
        sink.write(&Moment::recorded(&Arc::new(frame), records))?;
    }
    sink.finish()
}
