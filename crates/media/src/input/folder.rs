use super::fault::Fault;
use super::image::read_image;
use crate::depth::{DepthOptions, DepthReader, Pairing, PairingFacts};
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Rows from the start on, some of which tell whether depth lies on the picture.
const MOST_ALIGNED: usize = 160;

/// One row of a folder source: the image, and the depth image that goes with it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    pub image: PathBuf,
    pub depth: Option<PathBuf>,
}

/// A folder of images as a video.
pub(crate) struct FolderSource {
    rows: Vec<Row>,
    /// Reads the depth images, where there are some.
    depth: Option<DepthReader>,
    info: SourceInfo,
    fps: f64,
    /// The place of each row in time, in frames; none where rows follow one another without gaps.
    places: Option<Vec<u64>>,
    next: usize,
    finished: bool,
}

impl FolderSource {
    /// All JPEG and PNG files of `folder` in natural order.
    pub fn list(folder: &Path, name: &str, fps: f64) -> Result<Self> {
        let images = list_images(folder, name)?;
        let places = places(&images);
        let rows = images.into_iter().map(|image| Row { image, depth: None }).collect();
        Ok(Self { places, ..Self::new(rows, name, fps, "image folder (built in)")? })
    }

    /// The images of `rows`, in their order.
    pub fn new(rows: Vec<Row>, name: &str, fps: f64, decoder: &str) -> Result<Self> {
        let first = rows.first().ok_or_else(|| MediaError::unreadable(name, "it lists no images"))?;
        let size = read_image(&first.image)
            .map(|pixels| Frame::new(0, 0.0, pixels).size())
            .map_err(|fault| fault.unreadable(&first.image.display().to_string()))?;
        let info = SourceInfo {
            fps: Some(fps),
            frame_count: Some(rows.len() as u64),
            seekable: true,
            ..SourceInfo::new(name, size, decoder)
        };
        Ok(Self { rows, depth: None, info, fps, places: None, next: 0, finished: false })
    }

    /// The same, its rows' depth images read as `options` say; `pairing` is how the rows came by them.
    pub fn with_depth(mut self, options: &DepthOptions, pairing: Option<PairingFacts>) -> Result<Self> {
        let files = || self.rows.iter().filter_map(|row| row.depth.as_deref());
        let paired = files().count();
        if paired > 0 {
            // Those at the start of a long recording tell enough.
            let both = self.rows.iter().filter_map(|row| Some((row.image.as_path(), row.depth.as_deref()?)));
            let both: Vec<_> = both.take(MOST_ALIGNED).collect();
            let reader = DepthReader::new(options, files())?.align(options, &both, self.info.size)?;
            let listed = PairingFacts {
                pairing: Pairing::List,
                paired,
                unpaired: self.rows.len() - paired,
                largest_offset_s: None,
                mean_offset_s: None,
            };
            self.info.depth = Some(reader.facts(options, pairing.unwrap_or(listed)));
            self.depth = Some(reader);
        }
        Ok(self)
    }

    pub const fn info_mut(&mut self) -> &mut SourceInfo {
        &mut self.info
    }

    fn read(&self, row: &Row) -> Result<Frame> {
        let index = self.next as u64;
        let broken = |path: &Path, fault: Fault| fault.broken(&path.display().to_string(), index);
        let damaged = |path: &Path, fault: Fault| fault.damaged(&path.display().to_string(), index);
        let pixels = read_image(&row.image).map_err(|f| damaged(&row.image, f))?;
        let place = self.places.as_ref().and_then(|p| p.get(self.next).copied()).unwrap_or(index);
        let frame = Frame::new(index, place as f64 / self.fps, pixels);
        if frame.size() != self.info.size {
            let reason = format!(
                "it is {} pixels, the frames before it are {}; give all images one size",
                frame.size(),
                self.info.size
            );
            return Err(broken(&row.image, Fault::malformed(reason)));
        }
        let Some(reader) = &self.depth else { return Ok(frame) };
        let depth = row.depth.as_deref();
        reader.add(frame, depth).map_err(|fault| broken(depth.unwrap_or(&row.image), fault))
    }
}

impl Source for FolderSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let row = match self.rows.get(self.next) {
            Some(row) if !self.finished => row,
            _ => return Ok(None),
        };
        let frame = self.read(row);
        self.finished = frame.as_ref().is_err_and(|e| !e.is_damage());
        self.next += 1;
        frame.map(Some)
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.info.check_seek(index)?;
        // There are as many rows, so the number fits.
        (self.next, self.finished) = (index as usize, false);
        Ok(())
    }
}

/// JPEG and PNG files of a folder (by extension; hidden files left out) in natural order.
pub(crate) fn list_images(folder: &Path, name: &str) -> Result<Vec<PathBuf>> {
    let unreadable = |e: std::io::Error| MediaError::unreadable(name, e.to_string());
    let mut images = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let hidden = path.file_name().is_some_and(|n| n.as_encoded_bytes().starts_with(b"."));
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if !hidden && matches!(extension.as_deref(), Some("jpg" | "jpeg" | "png")) {
            images.push(path);
        }
    }
    if images.is_empty() {
        let reason = "the folder has no JPEG or PNG images and no frames.csv; name the folder that holds the images";
        return Err(MediaError::unreadable(name, reason));
    }
    images.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(images)
}

/// Compares names so that `img9` comes before `img10`: runs of digits by value, everything else by character.
pub(crate) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a.as_bytes(), b.as_bytes());
    loop {
        match (a.first(), b.first()) {
            (Some(x), Some(y)) if x.is_ascii_digit() && y.is_ascii_digit() => {
                let (x, y) = (take_digits(&mut a), take_digits(&mut b));
                // Without leading zeros the longer number is the larger one; equal values fall through to what follows.
                let order = x.len().cmp(&y.len()).then_with(|| x.cmp(y));
                if order != Ordering::Equal {
                    return order;
                }
            }
            (Some(x), Some(y)) if x == y => (a, b) = (&a[1..], &b[1..]),
            (x, y) => return x.cmp(&y),
        }
    }
}

/// Where images stand in time, in frames from the first, when their names are numbers with gaps: `img7`, `img8`, `img11` are 0, 1
/// and 4. `None` where there are no gaps, and where the numbers are not of frames: the words around them differ, or a
/// step is no multiple of the smallest, or most of the frames would be missing (times, or numbers of something else).
fn places(images: &[PathBuf]) -> Option<Vec<u64>> {
    let numbers: Vec<(String, u64)> = images.iter().map(|path| number(path)).collect::<Option<_>>()?;
    let same = numbers.iter().all(|(word, _)| *word == numbers[0].0);
    let steps = || numbers.windows(2).map(|pair| pair[1].1.saturating_sub(pair[0].1));
    let step = steps().min().filter(|&step| same && step > 0)?;
    if steps().any(|s| s % step != 0) {
        return None;
    }
    let places: Vec<u64> = numbers.iter().map(|(_, n)| (n - numbers[0].1) / step).collect();
    let span = places.last()? + 1;
    (span > places.len() as u64 && span <= 2 * places.len() as u64).then_some(places)
}

/// The last number in a file's name, and the words before it.
fn number(path: &Path) -> Option<(String, u64)> {
    let stem = path.file_stem()?.to_str()?;
    let word = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    Some((word.to_owned(), stem[word.len()..].parse().ok()?))
}

/// Takes a run of digits off the front; returns it without leading zeros.
fn take_digits<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let end = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    *text = rest;
    &digits[digits.iter().position(|&b| b != b'0').unwrap_or(digits.len())..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_between_numbers_are_gaps_in_time() {
        let of = |names: &[&str]| places(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(of(&["img7.png", "img8.jpg", "img10.png"]), Some(vec![0, 1, 3]));
        assert_eq!(of(&["0010.png", "0015.png", "0030.png", "0035.png"]), Some(vec![0, 1, 4, 5]));
        // No gap, no numbers, other words, the same number twice, no common step, more gaps than images.
        for names in [
            ["a1.png", "a2.png", "a3.png"],
            ["a.png", "b.png", "c.png"],
            ["a1.png", "b2.png", "b4.png"],
            ["a1.jpg", "a1.png", "a3.png"],
            ["a1.png", "a3.png", "a6.png"],
            ["a1.png", "a2.png", "a9.png"],
        ] {
            assert_eq!(of(&names), None, "{names:?}");
        }
    }

    #[test]
    fn numbers_in_names_count_by_value() {
        let mut names = ["img10.png", "img9.png", "img1.png", "img002.png", "a.png", "img10a.png", "img010b.png"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["a.png", "img1.png", "img002.png", "img9.png", "img10.png", "img10a.png", "img010b.png"]);
    }
}
