//! DAVIS (Perazzi et al. 2016, Pont-Tuset et al. 2017) and YouTube-VOS: `JPEGImages` and `Annotations` beside each other, in each the
//! same folders of sequences, below one named for the resolution (`480p`) or not. An annotation is a PNG whose colour numbers are those
//! of the objects: 0 is the background, 255 nothing that counts. Each object is a sequence; its truth is the box about its mask.

use super::{IMAGES, count_images, has_extension, listing, lossy, stem};
use crate::{EvaluationError, Result, Sequence, Truth};
use pursuit_geometry::Mask;
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
        let masks = match read_png(&file) {
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
fn read_png(path: &Path) -> Result<BTreeMap<u8, Mask>> {
    let fail = |reason: String| EvaluationError::dataset(path, None, reason);
    let file = std::fs::File::open(path).map_err(|e| fail(format!("cannot be read: {e}")))?;
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| fail(format!("is no PNG: {e}")))?;
    let (kind, depth) = reader.output_color_type();
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let gray = match kind {
        png::ColorType::Indexed => false,
        png::ColorType::Grayscale => true,
        other => {
            return Err(fail(format!(
                "has pixels of kind {other:?}; annotations have numbered colours, or shades of grey"
            )));
        }
    };
    let bits = match depth {
        png::BitDepth::Sixteen => return Err(fail("has 16 bits a pixel; annotations have at most 8".to_owned())),
        depth => depth as usize,
    };
    if width > Mask::MOST_SIDE || height > Mask::MOST_SIDE || width * height > Mask::MOST_PIXELS {
        return Err(fail(format!("has {width}x{height} pixels, too many for a mask")));
    }
    let mut bytes = vec![0; reader.output_buffer_size().ok_or_else(|| fail("is too large".to_owned()))?];
    reader.next_frame(&mut bytes).map_err(|e| fail(format!("is damaged: {e}")))?;
    let line = (width * bits).div_ceil(8);
    let mut masks: BTreeMap<u8, Mask> = BTreeMap::new();
    for (y, row) in bytes.chunks(line.max(1)).take(height).enumerate() {
        let value = |x: usize| {
            let at = x * bits;
            let byte = row.get(at / 8).copied().unwrap_or(0);
            let low = 8 - bits - at % 8;
            (byte >> low) & (0xff >> (8 - bits))
        };
        let mut x = 0;
        while x < width {
            let (from, own) = (x, value(x));
            while x < width && value(x) == own {
                x += 1;
            }
            let object = if gray { u8::from(own > 0) } else { own };
            if object != 0 && (gray || object != VOID) {
                masks.entry(object).or_default().extend_row(y, from, std::iter::repeat_n(true, x - from));
            }
        }
    }
    Ok(masks)
}
