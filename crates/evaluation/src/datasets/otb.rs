//! OTB-2013/2015 (Wu, Lim, Yang 2013, 2015) and what copied its layout (DTB70, PTB-TIR, Temple Color):
//! `img/` and `groundtruth_rect.txt`, left,top,width,height counted from 1, separated by commas, tabs or blanks.

use super::{Listing, MATLAB_ORIGIN, count_images, text};
use crate::{EvaluationError, Result, Sequence};
use std::path::Path;

/// Sequences that the benchmark cuts out of more images: `(name, first image from 1, last image)`.
///
/// From the benchmark's `configSeqs.m`. BlurCar1, BlurCar3 and BlurCar4 start at a number other than 1 too, but their
/// folders hold no earlier images.
const CUTS: &[(&str, usize, usize)] = &[
    ("david", 300, 770),
    ("football1", 1, 74),
    ("freeman3", 1, 460),
    ("freeman4", 1, 283),
    ("diving", 1, 215),
    ("blurcar1", 247, 988),
    ("blurcar3", 3, 359),
    ("blurcar4", 18, 397),
];

/// Whether the file is truth in this layout.
pub(super) fn is_annotation(file: &Path) -> bool {
    file.file_name().map(super::lossy).is_some_and(|n| n.starts_with("groundtruth_rect") && n.ends_with(".txt"))
}

/// One sequence for every annotated target (Jogging.1, Jogging.2); empty files are passed over, as Human4's first is.
pub(super) fn read(folder: &Path, name: &str, inside: &Listing) -> Vec<Result<Sequence>> {
    let is_filled =
        |f: &&std::path::PathBuf| is_annotation(f) && text::read(f).map_or(true, |content| !content.trim().is_empty());
    let files: Vec<_> = inside.files.iter().filter(is_filled).collect();
    let images = folder.join("img");
    let count = count_images(&images);
    let mut found = Vec::new();
    for (number, file) in (1..).zip(&files) {
        let own_name = if files.len() == 1 { name.to_owned() } else { format!("{name}.{number}") };
        found.push(read_one(file, own_name, name, &images, count));
    }
    found
}

fn read_one(file: &Path, own_name: String, name: &str, images: &Path, count: usize) -> Result<Sequence> {
    let truth = text::read_ltwh(file, MATLAB_ORIGIN)?;
    let base = name.rsplit('/').next().unwrap_or(name).to_ascii_lowercase();
    let cut = CUTS.iter().find(|(cut, first, last)| *cut == base && last - first + 1 == truth.len() && *last <= count);
    let first = match cut {
        Some((_, first, _)) => first - 1,
        None if truth.len() <= count => 0,
        None => {
            let reason = format!("has {} boxes for the {count} images in {}", truth.len(), images.display());
            return Err(EvaluationError::dataset(file, None, reason));
        }
    };
    Ok(Sequence::from_path(own_name, images, first, truth).published_from(MATLAB_ORIGIN))
}
