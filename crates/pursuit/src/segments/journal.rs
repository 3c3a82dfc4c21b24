//! Which files of a folder are segments, clips and pictures of runs: written down before they are made, so that a run that was
//! killed leaves none that nobody knows.

use super::stamp::is_stamp;
use super::streams;
use crate::RunError;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// The list, in the folder of a run.
pub(crate) const JOURNAL: &str = "segments.jsonl";
/// A row is less than 200 bytes; what has more than a million of them was not written here.
const MOST_BYTES: u64 = 1 << 28;

/// A file, as a line of the list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// Its name, from the run's folder.
    pub file: String,
    /// When its run began, seconds since 1970.
    pub run: f64,
    /// Time of its first frame, seconds since 1970, and by the input's own clock.
    pub unix_time_s: f64,
    pub time_s: f64,
}

impl Entry {
    /// What it is a piece of; `None` for a file that is nobody's segment.
    pub fn stream(&self) -> Option<&'static str> {
        streams().find(|stream| {
            let (start, end) = parts(stream);
            let middle = self.file.strip_prefix(start).and_then(|rest| rest.strip_suffix(end));
            middle.and_then(|m| m.strip_prefix('-')).is_some_and(is_stamp)
        })
    }
}

/// What stands before and after the stamp.
pub(super) fn parts(stream: &str) -> (&str, &str) {
    stream.rfind('.').map_or((stream, ""), |dot| stream.split_at(dot))
}

/// What the list of `folder` says, the oldest first; lines that are torn, or that name anything but segments, are left out.
pub(super) fn read(folder: &Path) -> Vec<Entry> {
    let text = File::open(folder.join(JOURNAL)).and_then(|file| {
        let mut text = String::new();
        file.take(MOST_BYTES).read_to_string(&mut text)?;
        Ok(text)
    });
    let entries = text.unwrap_or_default();
    let entries = entries.lines().filter_map(|line| serde_json::from_str::<Entry>(line).ok());
    let sensible = |e: &Entry| e.stream().is_some() && e.unix_time_s.is_finite() && e.run.is_finite();
    entries.filter(sensible).collect()
}

/// The files that the list of `folder` names, whether they are there or not.
pub(crate) fn listed(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let folder = folder.to_path_buf();
    read(&folder).into_iter().map(move |entry| folder.join(entry.file))
}

/// Adds a line.
pub(super) fn append(folder: &Path, entry: &Entry) -> Result<(), RunError> {
    let path = folder.join(JOURNAL);
    let file = File::options().append(true).create(true).open(&path);
    file.and_then(|mut file| file.write_all(line(entry).as_bytes())).map_err(RunError::output(&path))
}

/// Writes the whole list anew in one step.
pub(super) fn rewrite<'a>(folder: &Path, entries: impl Iterator<Item = &'a Entry>) -> Result<(), RunError> {
    let path = folder.join(JOURNAL);
    let temporary = path.with_extension("part");
    let text: String = entries.map(line).collect();
    let written = std::fs::write(&temporary, text).and_then(|()| std::fs::rename(&temporary, &path));
    written.map_err(RunError::output(&path))
}

/// What is serialised here has nothing that can fail.
fn line(entry: &Entry) -> String {
    serde_json::to_string(entry).unwrap_or_default() + "\n"
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn entry(file: &str) -> Entry {
        Entry { file: file.to_owned(), run: 1.0, unix_time_s: 2.0, time_s: 0.5 }
    }

    #[test]
    fn only_names_that_segments_have_are_believed() {
        let folder = tempfile::tempdir().unwrap();
        let good = ["trajectory-20261125T130000Z.csv", "clips/clip-20261125T130000.250Z_2.mp4"];
        let bad = ["trajectory.csv", "../trajectory-20261125T130000Z.csv", "mine-20261125T130000Z.csv", "/etc/passwd"];
        for file in good.iter().chain(&bad) {
            append(folder.path(), &entry(file)).unwrap();
        }
        let path = folder.path().join(JOURNAL);
        File::options().append(true).open(path).unwrap().write_all(b"{\"file\": \"traj").unwrap();
        let read: Vec<String> = read(folder.path()).into_iter().map(|e| e.file).collect();
        assert_eq!(read, good);
        assert_eq!(listed(folder.path()).next().unwrap(), folder.path().join(good[0]));
    }

    #[test]
    fn streams_are_told_by_their_names() {
        assert_eq!(entry("overlay-20261125T130000Z.mp4").stream(), Some("overlay.mp4"));
        assert_eq!(entry("trajectory-20261125T130000Z.jsonl").stream(), Some("trajectory.jsonl"));
        assert_eq!(entry("trajectory-20261125T130000Z.mp4").stream(), None);
    }
}
