//! Princeton RGB-D (Song, Xiao 2013): `rgb/`, `depth/` and `<sequence>.txt` with left,top,width,height,frame counted
//! from 1 by MATLAB; `NaN` where the target is hidden. `init.txt` alone gives the first box.

use super::text::read_ltwh;
use super::{MATLAB_ORIGIN, count_images, lossy};
use crate::{EvaluationError, Result, Sequence, Truth};
use std::path::Path;

pub(super) fn is_sequence(folder: &Path) -> bool {
    folder.join("rgb").is_dir() && folder.join("depth").is_dir() && folder.join("init.txt").is_file()
}

pub(super) fn read(folder: &Path, name: &str) -> Result<Sequence> {
    let own = folder.file_name().map(lossy).unwrap_or_default();
    let whole = folder.join(format!("{own}.txt"));
    let file = if whole.is_file() { whole } else { folder.join("init.txt") };
    let mut truth = read_ltwh(&file, MATLAB_ORIGIN)?;
    let images = count_images(&folder.join("rgb"));
    if truth.len() == 1 && images > 1 {
        truth.resize(images, Truth::Unknown);
    }
    if truth.len() > images {
        let reason = format!("has {} boxes for the {images} images in rgb/", truth.len());
        return Err(EvaluationError::dataset(&file, None, reason));
    }
    // Names are r-TIME-FRAME.png: natural order is order of time. The folder brings its depth along.
    Ok(Sequence::from_path(name, folder, 0, truth).published_from(MATLAB_ORIGIN))
}
