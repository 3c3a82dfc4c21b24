//! UAV123 and UAV20L (Mueller, Smith, Ghanem 2016): `anno/UAV123/NAME.txt` beside `data_seq/UAV123/FOLDER/`.
//!
//! Several sequences of UAV123 are cut from one recording; the frame ranges are those of the toolkit's `configSeqs.m`.

use super::text::read_ltwh;
use super::{MATLAB_ORIGIN, listing, stem};
use crate::{EvaluationError, Result, Sequence};
use std::path::Path;

/// `(sequence, folder, first frame from 1)`; the last frame follows from the number of annotations.
/// Sequences that are not listed are their own folder, from its first frame.
const CUTS: &[(&str, &str, usize)] = &[
    ("bird1_1", "bird1", 1),
    ("bird1_2", "bird1", 775),
    ("bird1_3", "bird1", 1573),
    ("car1_1", "car1", 1),
    ("car1_2", "car1", 751),
    ("car1_3", "car1", 1627),
    ("car6_1", "car6", 1),
    ("car6_2", "car6", 487),
    ("car6_3", "car6", 1807),
    ("car6_4", "car6", 2953),
    ("car6_5", "car6", 3925),
    ("car8_1", "car8", 1),
    ("car8_2", "car8", 1357),
    ("car16_1", "car16", 1),
    ("car16_2", "car16", 415),
    ("group1_1", "group1", 1),
    ("group1_2", "group1", 1333),
    ("group1_3", "group1", 2515),
    ("group1_4", "group1", 3925),
    ("group2_1", "group2", 1),
    ("group2_2", "group2", 907),
    ("group2_3", "group2", 1771),
    ("group3_1", "group3", 1),
    ("group3_2", "group3", 1567),
    ("group3_3", "group3", 2827),
    ("group3_4", "group3", 4369),
    ("person2_1", "person2", 1),
    ("person2_2", "person2", 1189),
    ("person4_1", "person4", 1),
    ("person4_2", "person4", 1501),
    ("person5_1", "person5", 1),
    ("person5_2", "person5", 877),
    ("person7_1", "person7", 1),
    ("person7_2", "person7", 1249),
    ("person8_1", "person8", 1),
    ("person8_2", "person8", 1075),
    ("person12_1", "person12", 1),
    ("person12_2", "person12", 601),
    ("person14_1", "person14", 1),
    ("person14_2", "person14", 847),
    ("person14_3", "person14", 1813),
    ("person17_1", "person17", 1),
    ("person17_2", "person17", 1501),
    ("person19_1", "person19", 1),
    ("person19_2", "person19", 1243),
    ("person19_3", "person19", 2791),
    ("truck4_1", "truck4", 1),
    ("truck4_2", "truck4", 577),
    ("uav1_1", "uav1", 1),
    ("uav1_2", "uav1", 1555),
    ("uav1_3", "uav1", 2473),
];

/// The folder whose `NAME.txt` say by numbers, 1 or 0, which of these attributes a sequence has, in the order of the toolkit's
/// `perfPlot.m`.
const ATTRIBUTES: &str = "att";
const FLAGS: [&str; 12] = [
    "scale variation",
    "aspect ratio change",
    "low resolution",
    "fast motion",
    "full occlusion",
    "partial occlusion",
    "out of view",
    "background clutter",
    "illumination variation",
    "viewpoint change",
    "camera motion",
    "similar object",
];

/// Whether `folder` is the root of the data set.
pub(super) fn is_root(folder: &Path) -> bool {
    folder.join("anno").is_dir() && folder.join("data_seq").is_dir()
}

/// Every sequence below `anno/`, the trouble with the others.
pub(super) fn read(root: &Path) -> Vec<Result<Sequence>> {
    let mut found = Vec::new();
    for version in listing(&root.join("anno")).folders.into_iter().filter(|v| stem(v) != ATTRIBUTES) {
        for file in listing(&version).files.iter().filter(|f| super::has_extension(f, &["txt"])) {
            found.push(read_one(root, &version, file));
        }
    }
    found
}

fn read_one(root: &Path, version: &Path, annotation: &Path) -> Result<Sequence> {
    let name = stem(annotation);
    // UAV20L is annotated over the same recordings, whole; its images lie under data_seq/UAV123 as well.
    let long = stem(version).eq_ignore_ascii_case("UAV20L");
    let cut = CUTS.iter().find(|(sequence, ..)| *sequence == name);
    let (folder, first) = match cut {
        Some((_, folder, _)) if long => (*folder, 1),
        Some((_, folder, first)) => (*folder, *first),
        None => (name.as_str(), 1),
    };
    let candidates = [root.join("data_seq").join(stem(version)), root.join("data_seq/UAV123"), root.join("data_seq")];
    let images = candidates.iter().map(|c| c.join(folder)).find(|c| c.is_dir()).ok_or_else(|| {
        EvaluationError::dataset(annotation, None, format!("its images data_seq/UAV123/{folder} are not there"))
    })?;
    let truth = read_ltwh(annotation, MATLAB_ORIGIN)?;
    let name = if long { format!("UAV20L/{name}") } else { name };
    let mut sequence = Sequence::from_path(name, &images, first - 1, truth).published_from(MATLAB_ORIGIN);
    // Beside the truth, or, where there is one version alone, beside its folder.
    let beside = [version.join(ATTRIBUTES), root.join("anno").join(ATTRIBUTES)];
    let file = annotation.file_name().unwrap_or_default();
    if let Some(file) = beside.iter().map(|folder| folder.join(file)).find(|f| f.is_file()) {
        super::attributes::add_flags(&mut sequence, &file, &FLAGS)?;
    }
    Ok(sequence)
}
