use super::journal::{self, Entry, JOURNAL, parts};
use super::stamp::stamp;
use super::{CLIP, SNAPSHOT, SegmentFacts};
use crate::RunError;
use crate::run::RunFile;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How a run is cut, and for how long its pieces stay.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Stretch {
    /// Seconds of a segment; none where nothing is cut.
    pub every_s: Option<f64>,
    /// Seconds for which files stay; none for ever.
    pub keep_s: Option<f64>,
}

/// A file of an earlier part of a run.
pub(crate) struct Written {
    pub path: PathBuf,
    pub stream: &'static str,
}

/// The files of a folder that come and go: names them, lists them, and removes what is too old. Clones are the same one.
#[derive(Clone)]
pub(crate) struct Shelf(Arc<Mutex<Inner>>);

struct Inner {
    folder: PathBuf,
    stretch: Stretch,
    /// When the run began, seconds since 1970, and the time of its first frame.
    run: f64,
    origin_s: Option<f64>,
    entries: VecDeque<Entry>,
    /// Lines of the list that speak of files that are no more.
    stale: usize,
    removed: u64,
    /// What `run.json` says while the run goes on, and where.
    facts: Option<(RunFile, PathBuf)>,
}

impl Shelf {
    /// Of `folder`, with what earlier runs left there. `now` is in seconds since 1970.
    ///
    /// # Errors
    /// [`RunError::Output`] when the list cannot be written.
    pub fn open(folder: &Path, stretch: Stretch, now: f64) -> Result<Self, RunError> {
        Self::with(folder, stretch, now, None)
    }

    /// The same, to go on with the run that wrote there last.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn reopen(folder: &Path, stretch: Stretch, now: f64) -> Result<Self, RunError> {
        match journal::read(folder).pop() {
            Some(last) => Self::with(folder, stretch, last.run, Some(last.run + last.time_s - last.unix_time_s)),
            None => Self::open(folder, stretch, now),
        }
    }

    fn with(folder: &Path, stretch: Stretch, run: f64, origin_s: Option<f64>) -> Result<Self, RunError> {
        let entries: VecDeque<Entry> =
            journal::read(folder).into_iter().filter(|e| folder.join(&e.file).is_file()).collect();
        journal::rewrite(folder, entries.iter())?;
        let folder = folder.to_path_buf();
        let inner = Inner { folder, stretch, run, origin_s, entries, stale: 0, removed: 0, facts: None };
        Ok(Self(Arc::new(Mutex::new(inner))))
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What `run.json` says; it is written again at every cut, so that it knows of the newest.
    pub fn tell_in(&self, facts: RunFile, path: PathBuf) {
        self.lock().facts = Some((facts, path));
    }

    /// The number of the segment that a frame of `time_s` belongs to; 0 where nothing is cut.
    pub fn segment_of(&self, time_s: f64) -> u64 {
        let mut inner = self.lock();
        let since = time_s - *inner.origin_s.get_or_insert(time_s);
        inner.stretch.every_s.map_or(0, |every| (since / every).max(0.0) as u64)
    }

    /// A name for a file of `stream` that begins at `time_s`, in the list; then what is too old goes.
    ///
    /// # Errors
    /// [`RunError::Output`] when the list cannot be written, or an old file cannot be removed.
    pub fn add(&self, stream: &str, time_s: f64) -> Result<PathBuf, RunError> {
        let mut inner = self.lock();
        let path = inner.add(stream, time_s)?;
        inner.tidy(time_s)?;
        if !is_clip(stream) {
            inner.tell()?;
        }
        Ok(path)
    }

    /// What of the list this run wrote, the oldest first.
    pub fn own(&self) -> Vec<Written> {
        let inner = self.lock();
        let own = inner.entries.iter().filter(|e| e.run == inner.run);
        own.filter_map(|e| Some(Written { path: inner.folder.join(&e.file), stream: e.stream()? })).collect()
    }

    /// Removes a file and its line.
    ///
    /// # Errors
    /// [`RunError::Output`] when that cannot be done.
    pub fn drop_file(&self, path: &Path) -> Result<(), RunError> {
        let mut inner = self.lock();
        let folder = inner.folder.clone();
        inner.entries.retain(|e| folder.join(&e.file) != path);
        remove(path)?;
        journal::rewrite(&folder, inner.entries.iter())
    }

    /// What `run.json` says of it.
    pub fn facts(&self) -> SegmentFacts {
        self.lock().facts()
    }

    /// The list.
    pub fn list(&self) -> PathBuf {
        self.lock().folder.join(JOURNAL)
    }
}

impl Inner {
    fn unix_time_s(&mut self, time_s: f64) -> f64 {
        self.run + time_s - *self.origin_s.get_or_insert(time_s)
    }

    fn add(&mut self, stream: &str, time_s: f64) -> Result<PathBuf, RunError> {
        let unix_time_s = self.unix_time_s(time_s);
        let (start, end) = parts(stream);
        let stamp = stamp(unix_time_s, is_clip(stream));
        let name = |n: u32| match n {
            1 => format!("{start}-{stamp}{end}"),
            n => format!("{start}-{stamp}_{n}{end}"),
        };
        let free = |name: &String| self.folder.join(name).symlink_metadata().is_err();
        let file = (1..).map(name).find(free).unwrap_or_default();
        let path = self.folder.join(&file);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(RunError::output(parent))?;
        }
        let entry = Entry { file, run: self.run, unix_time_s, time_s };
        journal::append(&self.folder, &entry)?;
        self.entries.push_back(entry);
        Ok(path)
    }

    /// Removes what is too old: a clip by its event, a segment when the one after it is.
    fn tidy(&mut self, time_s: f64) -> Result<(), RunError> {
        let Some(keep_s) = self.stretch.keep_s else { return Ok(()) };
        let oldest = self.unix_time_s(time_s) - keep_s;
        let mut begins = BTreeMap::new();
        let mut old = Vec::new();
        // From the newest on, so that the segment after each is known.
        for entry in self.entries.iter().rev() {
            let Some(stream) = entry.stream() else { continue };
            let ends = if is_clip(stream) { Some(entry.unix_time_s) } else { begins.get(stream).copied() };
            if ends.is_some_and(|ends| ends <= oldest) {
                old.push(entry.file.clone());
            }
            begins.insert(stream, entry.unix_time_s);
        }
        for file in &old {
            remove(&self.folder.join(file))?;
        }
        self.removed += old.len() as u64;
        self.stale += old.len();
        self.entries.retain(|entry| !old.contains(&entry.file));
        // Lines of files that are gone do no harm: they are left until they are many.
        if self.stale > self.entries.len() / 2 + 16 {
            journal::rewrite(&self.folder, self.entries.iter())?;
            self.stale = 0;
        }
        Ok(())
    }

    fn facts(&self) -> SegmentFacts {
        let (clips, files): (Vec<&Entry>, Vec<&Entry>) =
            self.entries.iter().partition(|entry| entry.stream().is_none_or(is_clip));
        SegmentFacts {
            every_s: self.stretch.every_s,
            keep_s: self.stretch.keep_s,
            files: files.into_iter().map(|entry| entry.file.clone()).collect(),
            clips: clips.len(),
            removed: self.removed,
            list: JOURNAL,
        }
    }

    fn tell(&mut self) -> Result<(), RunError> {
        let segments = self.facts();
        match &mut self.facts {
            Some((facts, path)) => {
                facts.segments = Some(segments);
                facts.write(path)
            }
            None => Ok(()),
        }
    }
}

/// Whether a file is of an event, and not a segment with another after it.
fn is_clip(stream: &str) -> bool {
    [CLIP, SNAPSHOT].contains(&stream)
}

/// Removes a file, that may be gone already.
fn remove(path: &Path) -> Result<(), RunError> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(RunError::output(path)(e)),
        _ => Ok(()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const DAY: Stretch = Stretch { every_s: Some(10.0), keep_s: Some(25.0) };

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn write(shelf: &Shelf, stream: &str, time_s: f64) -> PathBuf {
        let path = shelf.add(stream, time_s).unwrap();
        std::fs::write(&path, "x").unwrap();
        path
    }

    #[test]
    fn what_is_kept_covers_the_time_and_nobody_elses_goes() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("trajectory-19700101T000000Z.csv"), "mine").unwrap();
        let shelf = Shelf::open(folder.path(), DAY, 1000.0).unwrap();
        for k in 0..6 {
            write(&shelf, "trajectory.csv", 3.0 + f64::from(10 * k));
        }
        // The last begins at 1050 s: from 1025 s on all is there.
        assert_eq!(
            names(folder.path()),
            [
                "segments.jsonl",
                "trajectory-19700101T000000Z.csv",
                "trajectory-19700101T001700Z.csv",
                "trajectory-19700101T001710Z.csv",
                "trajectory-19700101T001720Z.csv",
                "trajectory-19700101T001730Z.csv",
            ]
        );
    }

    #[test]
    fn names_are_never_given_twice() {
        let folder = tempfile::tempdir().unwrap();
        let shelf = Shelf::open(folder.path(), Stretch::default(), 0.0).unwrap();
        let first = write(&shelf, CLIP, 0.0);
        let second = write(&shelf, CLIP, 0.0004);
        assert_ne!(first, second);
        assert!(second > first, "{second:?}");
        assert_eq!(shelf.facts().clips, 2);
    }

    #[test]
    fn a_later_run_goes_on_with_the_list() {
        let folder = tempfile::tempdir().unwrap();
        let shelf = Shelf::open(folder.path(), DAY, 1000.0).unwrap();
        write(&shelf, "trajectory.csv", 0.0);
        let gone = write(&shelf, "trajectory.csv", 10.0);
        std::fs::remove_file(gone).unwrap();
        let later = Shelf::open(folder.path(), DAY, 1010.0).unwrap();
        assert_eq!((later.facts().files.len(), later.own().len()), (1, 0));
        write(&later, "trajectory.csv", 0.0);
        write(&later, "trajectory.csv", 30.0);
        assert_eq!(later.facts().files.len(), 2, "the first run's is too old");
        let resumed = Shelf::reopen(folder.path(), DAY, 9999.0).unwrap();
        assert_eq!(resumed.own().len(), 2);
        assert_eq!(resumed.lock().unix_time_s(31.0), 1041.0);
        assert_eq!((resumed.segment_of(39.0), resumed.segment_of(40.0)), (3, 4));
    }
}
