//! GOT-10k (Huang, Zhao, Huang 2019): images beside `groundtruth.txt` (left,top,width,height), `absence.label` (1 where
//! the target is away) and `cover.label` (0…8, how much of it is visible; 0 = hidden or out of the image).

use super::attributes::add_classes;
use super::text::{read_ltwh, read_numbers};
use super::{count_images, vot};
use crate::{EvaluationError, Result, Sequence, Truth};
use std::path::Path;

pub(super) fn read(folder: &Path, name: &str) -> Result<Sequence> {
    let file = folder.join("groundtruth.txt");
    let mut truth = read_ltwh(&file, 0.0)?;
    let images = count_images(folder);
    // The test split publishes the first box only.
    if truth.len() == 1 && images > 1 {
        truth.resize(images, Truth::Unknown);
    }
    if truth.len() > images {
        return Err(vot::too_few_images(&file, truth.len(), images, folder));
    }
    for label in ["absence.label", "cover.label"] {
        let path = folder.join(label);
        if !path.is_file() {
            continue;
        }
        let lines = read_numbers(&path, 1)?;
        if lines.len() != truth.len() {
            let reason = format!("has {} lines for {} boxes", lines.len(), truth.len());
            return Err(EvaluationError::dataset(&path, None, reason));
        }
        for (line, truth) in lines.iter().zip(&mut truth) {
            if line.values.first().is_some_and(|v| (*v == 0.0) == (label == "cover.label")) {
                *truth = Truth::Absent;
            }
        }
    }
    let mut sequence = Sequence::from_path(name, folder, 0, truth);
    add_classes(&mut sequence, folder)?;
    Ok(sequence)
}
