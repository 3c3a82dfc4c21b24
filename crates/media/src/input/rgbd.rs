//! Colour and depth side by side: the folders of the Princeton Tracking Benchmark, of CDTB and of DepthTrack, and any two
//! folders.

use super::folder::{FolderSource, Row, list_images};
use super::open::open;
use crate::depth::{DepthOptions, WithDepthFolder, pair};
use crate::wrappers::WithDepth;
use crate::{MediaError, OpenOptions, Result, Source};
use pursuit_address::Locator;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The longest `frames.json` read.
const MOST_JSON_BYTES: u64 = 16 << 20;
/// Names of the folder of pictures beside `depth`.
const PICTURES: [&str; 2] = ["rgb", "color"];

/// The folders of pictures and of depth in `folder`, where it has both.
pub(super) fn parts(folder: &Path) -> Option<(PathBuf, PathBuf)> {
    let depth = folder.join("depth");
    let images = PICTURES.iter().map(|name| folder.join(name)).find(|images| images.is_dir())?;
    depth.is_dir().then_some((images, depth))
}

/// Pictures and depth images of two folders, paired by their names.
pub(super) fn open_folders(images: &Path, depth: &Path, name: &str, options: &OpenOptions) -> Result<FolderSource> {
    let images = list_images(images, &images.display().to_string())?;
    let depth = list_images(depth, &depth.display().to_string())?;
    let (found, facts) = pair(&images, &depth);
    if facts.paired == 0 {
        let reason = "none of the depth images belongs to a frame, by number or by time; name them alike";
        return Err(MediaError::unreadable(name, reason));
    }
    let rows = images.into_iter().zip(found).map(|(image, depth)| Row { image, depth }).collect();
    let of_images = with_intrinsics(&options.depth, Path::new(name));
    FolderSource::new(rows, name, options.default_fps, "folders of images and depth (built in)")?
        .with_depth(&of_images, Some(facts))
}

/// The options with the intrinsics that the Princeton benchmark's `frames.json` in `folder` states, unless they are said.
fn with_intrinsics(options: &DepthOptions, folder: &Path) -> DepthOptions {
    let mut options = *options;
    if options.intrinsics.is_none() {
        options.intrinsics = frames_json(folder).and_then(|text| camera_matrix(&text));
    }
    options
}

/// The text of `frames.json`; a longer one than any recording needs is not read.
fn frames_json(folder: &Path) -> Option<String> {
    let mut text = String::new();
    std::fs::File::open(folder.join("frames.json")).ok()?.take(MOST_JSON_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
}

/// `[fx, fy, cx, cy]` of the member `"K": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`; nothing else is looked at.
fn camera_matrix(json: &str) -> Option<[f64; 4]> {
    let (_, rest) = json.split_once("\"K\"")?;
    let numbers: Vec<f64> = rest
        .get(..rest.len().min(400))
        .unwrap_or(rest)
        .split(['[', ']', ',', ':'])
        .map(str::trim)
        .filter(|text| !text.is_empty())
        .map_while(|text| text.parse().ok())
        .take(9)
        .collect();
    let [fx, _, cx, _, fy, cy, _, _, one] = numbers.try_into().ok()?;
    let sound = fx > 0.0 && fy > 0.0 && one == 1.0 && [fx, fy, cx, cy].iter().all(|v: &f64| v.is_finite());
    sound.then_some([fx, fy, cx, cy])
}

/// Opens `input` with the depth `depth`: a folder of 16-bit PNG, paired with a folder of images by name and with anything
/// else by order, or another input of 16-bit grey frames in millimetres.
///
/// # Errors
/// As [`open`], and where the two do not fit.
pub fn open_with_depth(input: impl Into<Locator>, depth: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let input = input.into();
    let (images, folder) = (input.path(), Path::new(depth));
    if folder.is_dir() && images.is_dir() && !images.join("frames.csv").is_file() {
        let images = parts(images).map_or_else(|| images.to_owned(), |(images, _)| images);
        return Ok(Box::new(open_folders(&images, folder, &input.to_string(), options)?));
    }
    let source = open(input, options)?;
    with_depth(source, depth, options)
}

/// Puts the depth `depth` beside an opened source, in order.
///
/// # Errors
/// As [`open`], and where the two do not fit.
pub fn with_depth(source: Box<dyn Source>, depth: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let folder = Path::new(depth);
    if folder.is_dir() {
        return Ok(Box::new(WithDepthFolder::new(source, folder, &options.depth)?));
    }
    Ok(Box::new(WithDepth::new(source, open(depth, options)?)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_matrix_is_read_from_the_list_of_frames() {
        let text =
            r#"{"K": [[575.8, 0, 320], [0, 576.1, 240.5], [0, 0, 1]], "format": "OpenNI", "depthTimestamp": [0]}"#;
        assert_eq!(camera_matrix(text), Some([575.8, 576.1, 320.0, 240.5]));
        for bad in
            ["{}", r#"{"K": [[-1, 0, 3], [0, 5, 2], [0, 0, 1]]}"#, r#"{"K": [[1, 0, 3], [0, NaN, 2], [0, 0, 1]]}"#]
        {
            assert_eq!(camera_matrix(bad), None, "{bad}");
        }
    }
}
