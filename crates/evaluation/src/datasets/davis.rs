//! DAVIS (Perazzi et al. 2016, Pont-Tuset et al. 2017) and YouTube-VOS: `JPEGImages` and `Annotations` beside each other, in each the
//! same folders of sequences, below one named for the resolution (`480p`) or not. An annotation is a PNG whose colour numbers are those
//! of the objects: 0 is the background, 255 nothing that counts. Each object is a sequence; its truth is the box about its mask.

use super::{IMAGES, count_images, has_extension, listing, lossy, stem};
use crate::{EvaluationError, Result, Sequence, Truth};
use pursuit_geometry::Mask;
use pursuit_media::input::{Labels, read_labels};
use std::collections::BTreeMap;
use std::path::Path;

const PICTURES: &str = "JPEGImages";
const ANNOTATIONS: &str = "Annotations";
/// Marks what does not count.
const VOID: u8 = 255;

pub(super) fn is_root(folder: &Path) -> bool {
    folder.join(PICTURES).is_dir() && folder.join(ANNOTATIONS).is_dir()
}

pub(super) fn read(root: &Path) -> Vec<Result<Sequence>> {
    let mut found = Vec::new();
    let (pictures, annotations) = (root.join(PICTURES), root.join(ANNOTATIONS));
    for folder in listing(&annotations).folders {
        let name = folder.file_name().map(lossy).unwrap_or_default();
        if count_images(&folder) > 0 {
            found.extend(read_one(&pictures.join(&name), &folder, &name));
            continue;
        }
        // A resolution.
        for inner in listing(&folder).folders.into_iter().filter(|f| count_images(f) > 0) {
            let sequence = inner.file_name().map(lossy).unwrap_or_default();
            let images = pictures.join(&name).join(&sequence);
            // Pictures may be there in one of the resolutions alone.
            if images.is_dir() {
                found.extend(read_one(&images, &inner, &format!("{name}/{sequence}")));
            }
        }
    }
    found
}

/// The sequences of the objects that are annotated in one folder.
fn read_one(images: &Path, annotations: &Path, name: &str) -> Vec<Result<Sequence>> {
    let pictures = listing(images).files.into_iter().filter(|f| has_extension(f, IMAGES)).collect::<Vec<_>>();
    if pictures.is_empty() {
        let reason = format!("has no images in {}", images.display());
        return vec![Err(EvaluationError::dataset(annotations, None, reason))];
    }
    let mut objects: BTreeMap<u8, Vec<Option<Mask>>> = BTreeMap::new();
    for (k, picture) in pictures.iter().enumerate() {
        let file = annotations.join(format!("{}.png", stem(picture)));
        if !file.is_file() {
            continue;
        }
        let masks = match read_masks(&file, name) {
            Ok(masks) => masks,
            Err(problem) => return vec![Err(problem)],
        };
        for object in masks.keys() {
            // Before it was seen for the first time nothing is said of it.
            objects.entry(*object).or_insert_with(|| vec![None; pictures.len()]);
        }
        for (object, frames) in &mut objects {
            let begun = frames.iter().take(k).any(Option::is_some);
            frames[k] = masks.get(object).cloned().or_else(|| begun.then(Mask::default));
        }
    }
    if objects.is_empty() {
        return vec![Err(EvaluationError::dataset(annotations, None, "has no object in its annotations"))];
    }
    let alone = objects.len() == 1;
    let sequence = |(object, masks): (u8, Vec<Option<Mask>>)| {
        let truth = masks.iter().map(|mask| truth_of(mask.as_ref())).collect();
        let name = if alone { name.to_owned() } else { format!("{name}-{object}") };
        Ok(Sequence::from_path(name, images, 0, truth).with_masks(masks))
    };
    objects.into_iter().map(sequence).collect()
}

/// The box about a mask, where it is known; an empty one says that the target is away.
pub(super) fn truth_of(mask: Option<&Mask>) -> Truth {
    mask.map_or(Truth::Unknown, |mask| mask.bounds().map_or(Truth::Absent, Truth::Visible))
}

/// The masks of a picture by the numbers of the objects; of one in shades of grey everything that is not black is object 1.
fn read_masks(path: &Path, sequence: &str) -> Result<BTreeMap<u8, Mask>> {
    let Labels { numbers, is_indexed } =
        read_labels(path).map_err(|cause| EvaluationError::Frames { sequence: sequence.to_owned(), cause })?;
    let (width, height) = (numbers.width(), numbers.height());
    if width > Mask::MOST_SIDE || height > Mask::MOST_SIDE || width * height > Mask::MOST_PIXELS {
        let reason = format!("has {width}x{height} pixels, too many for a mask");
        return Err(EvaluationError::dataset(path, None, reason));
    }
    let mut masks: BTreeMap<u8, Mask> = BTreeMap::new();
    for y in 0..height {
        let mut x = 0;
        for run in numbers.row(y).chunk_by(|a, b| a == b) {
            let object = if is_indexed { run[0] } else { u8::from(run[0] > 0) };
            if object != 0 && !(is_indexed && object == VOID) {
                masks.entry(object).or_default().extend_row(y, x, std::iter::repeat_n(true, run.len()));
            }
            x += run.len();
        }
    }
    Ok(masks)
}
