//! Finds sequences below a folder, in every layout that trackers are published on.
//!
//! Conventions of published layouts (pixels counted from 1, inclusive edges) are converted here and nowhere else;
//! `frames.csv` and `NAME.csv` are taken as they are.

mod annotated;
mod attributes;
mod davis;
mod got10k;
mod mot;
mod otb;
mod princeton;
pub(crate) mod text;
mod tld;
mod uav123;
mod vot;

pub(crate) use vot::bounds;

use crate::{EvaluationError, Result, Sequence};
use pursuit_media::OpenOptions;
use std::path::{Path, PathBuf};

/// Folders nested deeper than this are not searched: a link that leads back up must end somewhere.
const MAX_DEPTH: usize = 12;
/// Where MATLAB has the left and top edge of an image: it counts pixels from 1.
const MATLAB_ORIGIN: f64 = 1.0;
const IMAGES: &[&str] = &["jpg", "jpeg", "png", "bmp", "pgm", "ppm", "tif", "tiff", "webp"];
const VIDEOS: &[&str] = &["mp4", "m4v", "mov", "avi", "mkv", "webm", "mpg", "mpeg", "y4m"];

/// Sequences found below one or several folders, in natural order of their names.
#[derive(Debug, Default)]
pub struct Dataset {
    /// What can be evaluated.
    pub sequences: Vec<Sequence>,
    /// What looked like a sequence and cannot be used, with the file and line to blame.
    pub problems: Vec<EvaluationError>,
}

impl Dataset {
    /// Searches `root` at any depth; `root` may also be one sequence, a video with truth, or its `frames.csv`.
    ///
    /// # Errors
    /// A path that does not exist. A sequence that cannot be read is a [problem](Self::problems), not an error.
    pub fn discover(root: &Path, open: &OpenOptions) -> Result<Self> {
        let mut found = Vec::new();
        if root.is_dir() {
            let own_name = root.canonicalize().ok().and_then(|p| p.file_name().map(lossy)).unwrap_or_default();
            let place = Folder { path: root.to_owned(), prefix: String::new(), own_name };
            search(&place, 0, open, &mut found);
        } else if root.is_file() && root.file_name().is_some_and(|n| n == "frames.csv") {
            let folder = root.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            return Self::discover(folder, open);
        } else if root.is_file() && has_extension(root, VIDEOS) {
            found.push(annotated::read(root, stem(root), open));
        } else {
            let reason =
                "is no folder and no video; give a folder that holds sequences, or a video with truth beside it";
            return Err(EvaluationError::dataset(root, None, reason));
        }
        let mut dataset = Self::default();
        for item in found {
            match item {
                Ok(sequence) if sequence.first_visible().is_some() => dataset.sequences.push(sequence),
                Ok(sequence) => dataset.problems.push(EvaluationError::NoSequences {
                    name: sequence.name().to_owned(),
                    reason: "can be scored: no frame has a box".to_owned(),
                }),
                Err(problem) => dataset.problems.push(problem),
            }
        }
        dataset.sequences.sort_by(|a, b| natural_order(a.name(), b.name()));
        Ok(dataset)
    }

    /// Searches several folders. Sequences of one name get their folder's name in front.
    ///
    /// # Errors
    /// As [`discover`](Self::discover).
    pub fn discover_all(roots: &[PathBuf], open: &OpenOptions) -> Result<Self> {
        let mut whole = Self::default();
        for root in roots {
            let mut part = Self::discover(root, open)?;
            let taken = |s: &Sequence| whole.sequences.iter().any(|t| t.name() == s.name());
            if part.sequences.iter().any(taken) {
                let folder = root.canonicalize().ok().and_then(|p| p.file_name().map(lossy)).unwrap_or_default();
                let mut prefix = folder.clone();
                for n in 2.. {
                    let start = format!("{prefix}/");
                    if !whole.sequences.iter().any(|t| t.name().starts_with(&start)) {
                        break;
                    }
                    prefix = format!("{folder}-{n}");
                }
                part.sequences.iter_mut().for_each(|s| s.rename(format!("{prefix}/{}", s.name())));
            }
            whole.sequences.append(&mut part.sequences);
            whole.problems.append(&mut part.problems);
        }
        Ok(whole)
    }

    /// Keeps the sequences whose name, or the last part of it, matches one of the comma-separated patterns
    /// (`*` any text, `?` any letter).
    ///
    /// # Errors
    /// [`EvaluationError::Option`] when none does.
    pub fn retain_matching(&mut self, patterns: &str) -> Result<()> {
        let before: Vec<String> = self.sequences.iter().map(|s| s.name().to_owned()).collect();
        let wanted = |name: &str| {
            let last = name.rsplit('/').next().unwrap_or(name);
            patterns.split(',').map(str::trim).any(|p| matches(p, name) || matches(p, last))
        };
        self.sequences.retain(|s| wanted(s.name()));
        if self.sequences.is_empty() {
            let (shown, more) = before.split_at(before.len().min(20));
            let more = if more.is_empty() { String::new() } else { format!(" and {} more", more.len()) };
            return Err(EvaluationError::Option(format!(
                "{patterns}: no sequence matches; there are {}{more}",
                shown.join(", ")
            )));
        }
        Ok(())
    }
}

/// A folder on the way down.
struct Folder {
    path: PathBuf,
    /// Names of the folders between the root and this one, each with a `/` after it; empty at the root.
    prefix: String,
    /// The folder's own name.
    own_name: String,
}

impl Folder {
    /// The name of the sequence that this folder is: the path below the root, the folder's own name at the root.
    fn name(&self) -> String {
        format!("{}{}", self.prefix, self.own_name)
    }

    /// The name of a sequence inside this folder.
    fn name_of(&self, inner: &str, depth: usize) -> String {
        if depth == 0 { inner.to_owned() } else { format!("{}/{inner}", self.name()) }
    }

    fn child(&self, path: PathBuf, depth: usize) -> Self {
        let own_name = path.file_name().map(lossy).unwrap_or_default();
        let prefix = if depth == 0 { String::new() } else { format!("{}/", self.name()) };
        Self { path, prefix, own_name }
    }
}

type Sequences = Vec<Result<Sequence>>;

fn search(place: &Folder, depth: usize, open: &OpenOptions, found: &mut Sequences) {
    let inside = listing(&place.path);
    if is_sequence(place, depth, &inside, open, found) || depth >= MAX_DEPTH {
        return;
    }
    for video in inside.files.iter().filter(|f| has_extension(f, VIDEOS) && f.with_extension("csv").is_file()) {
        found.push(annotated::read(video, place.name_of(&stem(video), depth), open));
    }
    let listed = listed_folders(&place.path);
    for folder in inside.folders {
        let name = folder.file_name().map(lossy).unwrap_or_default();
        if listed.as_ref().is_none_or(|l| l.contains(&name)) {
            search(&place.child(folder, depth), depth + 1, open, found);
        }
    }
}

/// Adds what the folder itself is, if it is a sequence (or a data set with its own idea of folders).
fn is_sequence(place: &Folder, depth: usize, inside: &Listing, open: &OpenOptions, found: &mut Sequences) -> bool {
    let path = &place.path;
    let has = |name: &str| path.join(name).is_file();
    if has("frames.csv") {
        found.push(annotated::read(path, place.name(), open));
    } else if uav123::is_root(path) {
        let named = |mut s: Sequence| {
            s.rename(place.name_of(s.name(), depth));
            s
        };
        found.extend(uav123::read(path).into_iter().map(|r| r.map(named)));
    } else if davis::is_root(path) {
        let named = |mut s: Sequence| {
            s.rename(place.name_of(s.name(), depth));
            s
        };
        found.extend(davis::read(path).into_iter().map(|r| r.map(named)));
    } else if path.join("img").is_dir() && inside.files.iter().any(|f| otb::is_annotation(f)) {
        found.extend(otb::read(path, &place.name(), inside));
    } else if has("gt/gt.txt") {
        found.extend(mot::read(path, &place.name()).unwrap_or_else(|e| vec![Err(e)]));
    } else if has("groundtruth.txt") && (has("absence.label") || has("cover.label") || has("meta_info.ini")) {
        found.push(got10k::read(path, &place.name()));
    } else if has("groundtruth.txt") {
        found.push(vot::read(path, &place.name(), inside));
    } else if has("gt.txt") {
        found.push(tld::read(path, &place.name(), inside));
    } else if princeton::is_sequence(path) {
        found.push(princeton::read(path, &place.name()));
    } else {
        return false;
    }
    true
}

/// The folders that a `list.txt` (VOT, GOT-10k) names; `None` when there is none or it is about something else.
fn listed_folders(folder: &Path) -> Option<Vec<String>> {
    let text = text::read(&folder.join("list.txt")).ok()?;
    let names: Vec<String> = text.lines().map(|l| l.trim().to_owned()).filter(|l| !l.is_empty()).collect();
    names.iter().any(|n| folder.join(n).is_dir()).then_some(names)
}

/// What lies in a folder, in natural order.
#[derive(Default)]
struct Listing {
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

fn listing(folder: &Path) -> Listing {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.filter_map(|e| e.ok().map(|e| e.path())).collect())
        .unwrap_or_default();
    paths.retain(|p| p.file_name().is_some_and(|n| !lossy(n).starts_with('.')));
    paths.sort_by_cached_key(|p| natural_key(&p.file_name().map(lossy).unwrap_or_default()));
    let (folders, files) = paths.into_iter().partition(|p| p.is_dir());
    Listing { files, folders }
}

fn count_images(folder: &Path) -> usize {
    listing(folder).files.iter().filter(|f| has_extension(f, IMAGES)).count()
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
}

fn stem(path: &Path) -> String {
    path.file_stem().map(lossy).unwrap_or_default()
}

fn lossy(name: &std::ffi::OsStr) -> String {
    name.to_string_lossy().into_owned()
}

pub(crate) fn natural_order(a: &str, b: &str) -> std::cmp::Ordering {
    natural_key(a).cmp(&natural_key(b))
}

/// A key under which `img2` comes before `img10`: runs of digits become (length, digits).
fn natural_key(name: &str) -> Vec<(usize, String)> {
    let mut key: Vec<(usize, String)> = Vec::new();
    let mut in_number = false;
    for c in name.chars() {
        let digit = c.is_ascii_digit();
        match key.last_mut() {
            Some((length, run)) if digit == in_number => {
                if digit && run == "0" {
                    run.clear();
                    *length -= 1;
                }
                run.push(c);
                *length += usize::from(digit);
            }
            _ => key.push((usize::from(digit), c.to_string())),
        }
        in_number = digit;
    }
    key
}

/// Whether `text` matches a pattern of `*` (any text) and `?` (any letter).
pub(crate) fn matches(pattern: &str, text: &str) -> bool {
    let pattern: Vec<char> = pattern.chars().collect();
    let text: Vec<char> = text.chars().collect();
    let (mut p, mut t) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        if p < pattern.len() && pattern[p] == '*' {
            star = Some((p, t));
            p += 1;
        } else if p < pattern.len() && (pattern[p] == '?' || pattern[p] == text[t]) {
            (p, t) = (p + 1, t + 1);
        } else if let Some((star_p, star_t)) = star {
            // The star takes one letter more.
            (p, t) = (star_p + 1, star_t + 1);
            star = Some((star_p, star_t + 1));
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_sort_as_people_count() {
        let mut names = ["b10", "b2", "a", "b02x", "b2.1"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["a", "b2", "b2.1", "b02x", "b10"]);
    }

    #[test]
    fn patterns_match_as_in_a_shell() {
        for (pattern, text, expected) in [
            ("OTB_*", "OTB_David", true),
            ("OTB_*", "xOTB_David", false),
            ("*a?id", "OTB_David", true),
            ("*", "", true),
            ("", "a", false),
            ("a*b*c", "aXbYbZc", true),
            ("a*b*c", "aXbYbZ", false),
        ] {
            assert_eq!(matches(pattern, text), expected, "{pattern} {text}");
        }
    }
}
