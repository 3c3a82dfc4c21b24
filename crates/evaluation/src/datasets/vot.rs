//! VOT (Kristan et al. 2013…2022): `groundtruth.txt` with polygons (x1,y1,…,x4,y4) or rectangles, images beside it or in
//! `color/` from 2019 on, with depth in `depth/` (CDTB, DepthTrack); also a lone video with such a file. A polygon's truth is its axis-aligned bounds, which is how
//! the toolkit converts regions for trackers of boxes. From 2020 on a line may be a mask (`m…`); its truth is the box about it, and
//! masks that a tracker says are compared with it.

use super::attributes::add_tags;
use super::davis::truth_of as truth_of_mask;
use super::text::{Line, read_numbers, truth_ltwh};
use super::{IMAGES, Listing, VIDEOS, count_images, has_extension, text};
use crate::{EvaluationError, Result, Sequence, Truth};
use pursuit_geometry::{BBox, Mask, Point, Polygon};
use std::path::{Path, PathBuf};

pub(super) fn read(folder: &Path, name: &str, inside: &Listing) -> Result<Sequence> {
    let file = folder.join("groundtruth.txt");
    let (truth, masks) = read_truth(&file)?;
    let input = input_of(folder, inside)
        .ok_or_else(|| EvaluationError::dataset(&file, None, "has neither images nor one video beside it"))?;
    if input.is_dir() && count_images(&input) < truth.len() {
        return Err(too_few_images(&file, truth.len(), count_images(&input), &input));
    }
    // CDTB and DepthTrack: `color/` and `depth/` are opened together.
    let both = folder.join("depth").is_dir() && input == folder.join("color");
    let mut sequence = Sequence::from_path(name, if both { folder } else { &input }, 0, truth).with_masks(masks);
    add_tags(&mut sequence, inside)?;
    Ok(sequence)
}

/// The images beside the truth, in `color/`, in the only other folder of images, or the only video.
pub(super) fn input_of(folder: &Path, inside: &Listing) -> Option<PathBuf> {
    if inside.files.iter().any(|f| has_extension(f, IMAGES)) {
        return Some(folder.to_owned());
    }
    let named = ["color", "img", "imgs", "images", "rgb", "frames"].map(|n| folder.join(n));
    if let Some(found) = named.into_iter().find(|p| count_images(p) > 0) {
        return Some(found);
    }
    let mut videos = inside.files.iter().filter(|f| has_extension(f, VIDEOS));
    videos.next().filter(|_| videos.next().is_none()).cloned()
}

pub(super) fn too_few_images(file: &Path, boxes: usize, images: usize, folder: &Path) -> EvaluationError {
    let reason = format!("has {boxes} boxes for the {images} images in {}", folder.display());
    EvaluationError::dataset(file, None, reason)
}

/// The truth about every frame; with its mask, where the file has masks, as those from 2020 on may.
fn read_truth(file: &Path) -> Result<(Vec<Truth>, Vec<Option<Mask>>)> {
    let text = text::read(file)?;
    let is_mask = |line: &str| line.trim_start().starts_with('m');
    if !text.lines().any(is_mask) {
        let truth = read_numbers(file, 1)?.into_iter().map(|line| truth_of(file, &line)).collect::<Result<_>>()?;
        return Ok((truth, Vec::new()));
    }
    let mut masks = Vec::new();
    let mut truth = Vec::new();
    for (number, line) in (1..).zip(text.trim_end().lines()) {
        if is_mask(line) {
            let mask = Mask::from_vot(line).map_err(|e| EvaluationError::dataset(file, number, e.to_string()))?;
            truth.push(truth_of_mask(Some(&mask)));
            masks.push(Some(mask));
        } else {
            let values = text::numbers_in(file, number, line)?;
            masks.push(None);
            truth.push(truth_of(file, &Line { number, values })?);
        }
    }
    Ok((truth, masks))
}

fn truth_of(file: &Path, line: &Line) -> Result<Truth> {
    match line.values[..] {
        // A single number is one of the toolkit's special codes: 0 unknown; others do not describe a target either.
        [_] => Ok(Truth::Unknown),
        [left, top, width, height] => truth_ltwh(file, line.number, [left, top, width, height]),
        _ if line.values.len() >= 6 && line.values.len().is_multiple_of(2) => {
            Ok(bounds(&line.values).map_or(Truth::Absent, Truth::Visible))
        }
        _ => {
            let reason = format!("has {} numbers; a rectangle has 4, a polygon 6, 8 or more", line.values.len());
            Err(EvaluationError::dataset(file, line.number, reason))
        }
    }
}

/// The bounds of the polygon of these corners, x and y in turn; `None` with NaN and without area.
pub(crate) fn bounds(values: &[f64]) -> Option<BBox> {
    if values.iter().any(|v| v.is_nan()) {
        return None;
    }
    let vertices = values.chunks_exact(2).map(|p| Point::new(p[0], p[1])).collect();
    Polygon::new(vertices).bounds().filter(|bbox| !bbox.is_empty())
}
