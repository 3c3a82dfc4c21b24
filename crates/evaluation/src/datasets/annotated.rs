//! The project's own layouts, which the media layer reads itself: a folder with `frames.csv`, and a video `NAME.mp4` with
//! `NAME.csv` beside it. Boxes are taken as they are.

use crate::{EvaluationError, Result, Sequence};
use pursuit_media::OpenOptions;
use std::path::Path;

/// A folder or video with the truth that its source comes with.
pub(super) fn read(path: &Path, name: String, open: &OpenOptions) -> Result<Sequence> {
    let source =
        pursuit_media::open(path, open).map_err(|cause| EvaluationError::Frames { sequence: name.clone(), cause })?;
    match &source.info().truth {
        Some(truth) => Ok(Sequence::from_path(name, path, 0, truth.clone())),
        None => {
            let reason = "comes without truth; put NAME.csv with the columns index,x,y,w,h beside NAME.mp4";
            Err(EvaluationError::dataset(path, None, reason))
        }
    }
}
